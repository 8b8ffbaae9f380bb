//! The stage that fuses.

use super::Observer;
use super::config::{Config, Method};
use super::stages::Ground;
use crate::fuse::{Fusion, MixtureSettings, Observation, Weights, fuse_mixture};

/// Fuses the detections on the ground by the run's method.
pub fn fuse(config: &Config, ground: &Ground, observer: &dyn Observer) -> Fusion {
    observer.begin("fuse", None);
    let observations: Vec<Observation> = ground
        .placed
        .iter()
        .map(|placed| Observation {
            view: placed.view,
            class: ground
                .classes
                .binary_search(&placed.detection.class)
                .unwrap_or(0),
            place: placed.hit.point,
            covariance: placed.covariance,
        })
        .collect();
    let weights = match config.fusion.method {
        Method::Em => Weights::Equal,
        Method::Paper => Weights::Logistic,
    };
    let settings = MixtureSettings {
        width_m: config.fusion.width_m,
        min_weight: config.fusion.min_weight,
        ..MixtureSettings::new(weights)
    };
    let fusion = fuse_mixture(&observations, &ground.footprints, &settings);
    observer.end(&format!("{} objects", fusion.objects.len()));
    fusion
}
