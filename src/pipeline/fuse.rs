//! The stages that fuse.

use rayon::prelude::*;

use super::Observer;
use super::config::{Config, Method};
use super::read::Inputs;
use super::stages::{self, Clock, Ground};
use crate::adjust::{Measurement, Problem, Surface};
use crate::error::Error;
use crate::frame::{RigidTransform, Vector};
use crate::fuse::belief::{Belief, BeliefSettings, Confusion, Drift, fuse_belief};
use crate::fuse::{Fusion, MixtureSettings, Object, Observation, Weights, fuse_mixture};
use crate::input::Reject;
use crate::pose::PoseSigma;
use crate::project::{Hit, Miss, Placed, diameter_m};
use crate::view::View;

/// A run up to its map.
pub struct Mapped {
    /// Detections on the ground, and what views could have seen.
    pub ground: Ground,
    /// The map.
    pub fusion: Fusion,
}

/// Puts the detections of a run on the ground, traces what its views could have seen and fuses, in
/// the order that the run's method wants.
///
/// # Errors
/// None but those of the clock's stages.
pub fn map(
    config: &Config,
    inputs: &Inputs,
    clock: &mut Clock,
    observer: &dyn Observer,
) -> Result<Mapped, Error> {
    let weights = match config.fusion.method {
        Method::Em => Weights::Equal,
        Method::Paper => Weights::Logistic,
        Method::Belief => return believed(config, inputs, clock, observer),
    };
    let placed = clock.stage("project", || Ok(stages::project(config, inputs, observer)))?;
    let ground = clock.stage("footprint", || {
        Ok(stages::footprint(config, inputs, placed, None, observer))
    })?;
    let fusion = clock.stage("fuse", || Ok(mixture(config, &ground, weights, observer)))?;
    Ok(Mapped { ground, fusion })
}

/// Fuses the detections on the ground by a mixture.
fn mixture(config: &Config, ground: &Ground, weights: Weights, observer: &dyn Observer) -> Fusion {
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
    let settings = MixtureSettings {
        width_m: config.fusion.width_m,
        min_weight: config.fusion.min_weight,
        ..MixtureSettings::new(weights)
    };
    let fusion = fuse_mixture(&observations, &ground.footprints, &settings);
    observer.end(&format!("{} objects", fusion.objects.len()));
    fusion
}

/// Belief fusion comes before the ground: where a detection lies, and whether that is within the
/// trusted ranges, it says itself.
fn believed(
    config: &Config,
    inputs: &Inputs,
    clock: &mut Clock,
    observer: &dyn Observer,
) -> Result<Mapped, Error> {
    let measured = clock.stage("project", || Ok(measure(config, inputs)))?;
    let belief = clock.stage("fuse", || {
        observer.begin("fuse", None);
        let level;
        let surface: &dyn Surface = match &inputs.terrain {
            Some(terrain) => terrain,
            None => {
                level = crate::adjust::PlatformLevel::new(&inputs.views);
                &level
            }
        };
        let problem = Problem {
            views: &inputs.views,
            measurements: &measured.measurements,
            surface,
            height_sigma_m: config.terrain.height_sigma_m,
            max_range_m: config.view.max_range_m.unwrap_or(f64::INFINITY),
            min_range_m: config.view.min_range_m,
        };
        let settings = BeliefSettings {
            confusion: confusion(config, &measured.classes),
            ..settings(config)
        };
        let belief = fuse_belief(&problem, &settings);
        let at_least = |p| belief.objects.iter().filter(|o| o.p_exist >= p).count();
        let (n, likely) = (at_least(config.output.min_exist), at_least(0.5));
        observer.end(&format!(
            "{n} objects, {likely} of them more likely real than not"
        ));
        Ok(belief)
    })?;
    let views = corrected(&inputs.views, &belief);
    let (placed, misses, number) = place(config, inputs, &measured, &belief);
    let mut ground = clock.stage("footprint", || {
        let misses = [measured.misses.clone(), misses].concat();
        Ok(stages::footprint(
            config,
            inputs,
            (placed, misses),
            Some(views),
            observer,
        ))
    })?;
    ground.classes = measured.classes;
    let fusion = fusion(config, belief, &number);
    Ok(Mapped { ground, fusion })
}

fn settings(config: &Config) -> BeliefSettings {
    let f = &config.fusion;
    BeliefSettings {
        pose_correction: f.pose_correction,
        drift: Drift {
            share: f.drift_share,
            length_m: f.drift_length_m,
        },
        scores: f.scores,
        size_rule: f.size_from,
        log_size_sigma: f.log_size_sigma,
        shape: f.shape,
        radius_m: f.radius_m,
        size_m: f.size_m,
        fov: config.view.fov_deg.to_radians(),
        geometry_time_s: f.geometry_time_s,
        event_time_s: f.event_time_s,
        ..BeliefSettings::default()
    }
}

/// P(said | true) over all classes of a run, where some are taken for others. Classes of which the
/// run says nothing are taken for themselves.
fn confusion(config: &Config, classes: &[Option<String>]) -> Option<Confusion> {
    let table = &config.fusion.confusion;
    if table.is_empty() {
        return None;
    }
    let of = |class: &Option<String>| class.as_ref().and_then(|name| table.get(name));
    let row = |class: &Option<String>| -> Vec<f64> {
        let share = |said: &Option<String>| match (of(class), said) {
            (Some(row), Some(said)) => row.get(said).copied().unwrap_or(0.0),
            (Some(_), None) => 0.0,
            (None, said) => f64::from(u8::from(said == class)),
        };
        classes.iter().map(share).collect()
    };
    Confusion::new(classes.iter().map(row).collect())
}

/// The classes of a run, sorted: those that detections say, and those that they may be of.
fn classes(config: &Config, inputs: &Inputs) -> Vec<Option<String>> {
    let said = inputs.detections.iter().map(|(_, d)| d.class.clone());
    let table = &config.fusion.confusion;
    let known = table.iter().flat_map(|(class, row)| {
        let named = std::iter::once(class).chain(row.keys());
        named.cloned().map(Some)
    });
    let mut classes: Vec<Option<String>> = said.chain(known).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
}

/// Detections as measurements.
struct Measured {
    measurements: Vec<Measurement>,
    /// The detection of each.
    detection: Vec<usize>,
    classes: Vec<Option<String>>,
    misses: Vec<Reject>,
}

fn measure(config: &Config, inputs: &Inputs) -> Measured {
    let settings = config.projection();
    let classes = classes(config, inputs);
    let found: Vec<Result<Measurement, Miss>> = inputs
        .detections
        .par_iter()
        .map(|(view, detection)| {
            let class = classes.binary_search(&detection.class).unwrap_or(0);
            let seen_from = (*view, &inputs.views[*view]);
            let measured = Measurement::new(detection, seen_from, &settings)?;
            Ok(Measurement { class, ..measured })
        })
        .collect();
    let mut measured = Measured {
        measurements: Vec::new(),
        detection: Vec::new(),
        classes,
        misses: Vec::new(),
    };
    for (i, result) in found.into_iter().enumerate() {
        match result {
            Ok(m) => {
                measured.measurements.push(m);
                measured.detection.push(i);
            }
            Err(miss) => measured.misses.push(reject(inputs, i, &miss)),
        }
    }
    measured
}

fn reject(inputs: &Inputs, detection: usize, miss: &Miss) -> Reject {
    let detection = &inputs.detections[detection].1;
    Reject {
        file: inputs.detection_files[detection.file].clone(),
        line: Some(detection.line),
        record: detection.key(),
        reason: miss.reason(),
        detail: miss.to_string(),
    }
}

/// The views with the poses that fusion found.
fn corrected(views: &[View], belief: &Belief) -> Vec<View> {
    let errors = belief.poses.iter().zip(&belief.pose_covariances);
    views
        .iter()
        .zip(errors)
        .map(|(view, (delta, covariance))| {
            let mut view = view.clone();
            let measured = view.pose.enu_from_body;
            view.pose.enu_from_body = RigidTransform::new(
                measured.rotation.perturbed(delta.fixed_rows::<3>(3).into()),
                measured.translation + Vector::from_xyz(delta.fixed_rows::<3>(0).into()),
            );
            let sigma = covariance.diagonal().map(|v| v.max(0.0).sqrt());
            view.pose.sigma = PoseSigma::from_vector(sigma);
            view
        })
        .collect()
}

/// Every measurement where fusion places it by itself; those outside the trusted ranges are
/// misses. The last are the numbers of the placed ones, by measurement.
fn place(
    config: &Config,
    inputs: &Inputs,
    measured: &Measured,
    belief: &Belief,
) -> (Vec<Placed>, Vec<Reject>, Vec<Option<usize>>) {
    let settings = config.projection();
    let (mut placed, mut misses, mut number) = (Vec::new(), Vec::new(), Vec::new());
    for (m, single) in belief.singles.iter().enumerate() {
        let detection = measured.detection[m];
        let (view, found) = &inputs.detections[detection];
        let seen_from = &inputs.views[*view];
        let origin = seen_from.origin();
        let range_m = origin.horizontal_distance(single.place);
        if !single.is_trusted {
            let miss = if range_m < config.view.min_range_m {
                Miss::TooNear {
                    range_m,
                    min_range_m: config.view.min_range_m,
                }
            } else {
                Miss::TooFar {
                    range_m,
                    max_range_m: settings.max_range_m,
                }
            };
            misses.push(reject(inputs, detection, &miss));
            number.push(None);
            continue;
        }
        let slant_range_m = origin.distance(single.place);
        number.push(Some(placed.len()));
        placed.push(Placed {
            view: *view,
            detection: found.clone(),
            hit: Hit {
                point: single.place,
                slant_range_m,
                ground_range_m: range_m,
                mark_covariance: single.covariance,
                by_pose: nalgebra::Matrix3x6::zeros(),
                by_ground_height: nalgebra::Vector3::zeros(),
            },
            covariance: single.covariance,
            diameter_m: diameter_m(found, seen_from, slant_range_m, &settings),
        });
    }
    (placed, misses, number)
}

fn fusion(config: &Config, belief: Belief, number: &[Option<usize>]) -> Fusion {
    let least = config.output.min_exist;
    let mut objects: Vec<Object> = belief
        .objects
        .into_iter()
        .filter(|o| o.p_exist >= least)
        .map(|o| Object {
            place: o.place,
            covariance: o.covariance,
            class: o.class,
            p_class: o.p_class,
            weight: o.weight,
            p_exist: Some(o.p_exist),
            size_m: o.size_m,
            members: o
                .members
                .iter()
                .filter_map(|m| {
                    Some(crate::fuse::Member {
                        observation: number[m.observation]?,
                        weight: m.weight,
                    })
                })
                .collect(),
        })
        .collect();
    objects.sort_by_key(|o| o.members.first().map(|m| m.observation));
    Fusion {
        objects,
        solver: Vec::new(),
        belief: Some(Box::new(belief.evidence)),
    }
}
