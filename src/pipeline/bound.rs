//! The bounds of a run's data: the best maps that labels of its detections allow.

use std::collections::BTreeSet;
use std::path::Path;

use geo::{Area, MultiPolygon, unary_union};
use rayon::prelude::*;

use super::Observer;
use super::config::Config;
use super::read::{self, Inputs};
use crate::adjust::{Measurement, Problem};
use crate::bound::{BoundEvidence, BoundMap, BoundObject, Fair, Partition, clairvoyant, fair};
use crate::error::{Error, Fault, Place};
use crate::evaluate::{
    DetectionKey, Estimate, Evidence, Membership, RockMap, TrueObject, read_labels,
};
use crate::existence::{Exposure, Prior};
use crate::footprint::trace;
use crate::frame::{Pixel, Site, covariance_ellipse};
use crate::terrain::Terrain;
use crate::view::View;

/// Which bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// Every label is known.
    Clairvoyant,
    /// What belongs together is known; what is real is decided by the evidence.
    Fair,
}

impl Bound {
    /// Its name on the command line and in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Clairvoyant => "clairvoyant",
            Self::Fair => "fair",
        }
    }
}

/// A bound's map as [`crate::evaluate`] takes maps.
#[derive(Debug, Clone)]
pub struct Bounded {
    /// The map; `p_exist` is 1 throughout for the clairvoyant bound.
    pub map: RockMap,
    /// Which detection went to which object.
    pub evidence: Evidence,
    /// How the solver fared.
    pub solver: BoundEvidence,
    /// Detections that no label names, or whose object is not in the truth.
    pub n_left_out: usize,
    /// Detections that say nothing of a place: score too low, outside lens or picture.
    pub n_unusable: usize,
}

/// Reads a run's inputs and the labels of its detections, and solves for a bound.
///
/// Detections of what is not in the `truth` (things that move, for one) are left out, as they are
/// when associations are scored. The others are used whatever their range; views are trusted to have missed objects within the
/// run's ranges alone.
///
/// # Errors
/// Faults of the inputs and the labels; a run without a terrain; a problem without a solution.
pub fn bound(
    config: &Config,
    labels: &Path,
    truth: &[TrueObject],
    bound: Bound,
    observer: &dyn Observer,
) -> Result<Bounded, Error> {
    let inputs = read::read(config, observer)?;
    let shown = labels.display().to_string();
    let labels = read_labels(labels, &shown)?;
    let terrain = inputs.terrain.as_ref().ok_or_else(|| {
        let expected = "one: the bounds place objects on the ground";
        Fault::found(Place::default(), "terrain", "none", expected)
    })?;
    observer.begin("bound", None);
    let (measurements, used) = measure(config, &inputs);
    let keys: Vec<DetectionKey> = used.iter().map(|&i| key(&inputs, i)).collect();
    let known: BTreeSet<&str> = truth.iter().map(|t| t.object_id.as_str()).collect();
    let partition = Partition::of_labels(&labels, &keys, &known)?;
    let problem = Problem {
        views: &inputs.views,
        measurements: &measurements,
        surface: terrain,
        height_sigma_m: config.terrain.height_sigma_m,
        max_range_m: config.view.max_range_m.unwrap_or(f64::INFINITY),
        min_range_m: config.view.min_range_m,
    };
    let map = match bound {
        Bound::Clairvoyant => clairvoyant(&problem, &partition),
        Bound::Fair => {
            let exposure = exposure(config, &inputs.views, terrain);
            let prior = Prior {
                pixel_px: config.noise.pixel_px,
                ..Prior::default()
            };
            let data = Fair {
                problem: &problem,
                exposure: &exposure,
                prior: &prior,
            };
            fair(&data, &partition)
        }
    };
    let map = map.map_err(|why| Fault::new(Place::file(&shown), "", why.to_string()))?;
    observer.end(&format!("{} objects", map.objects.len()));
    let (estimates, memberships) = as_map(&inputs, &map, &used, &keys);
    Ok(Bounded {
        map: RockMap {
            planet: inputs.site.planet(),
            estimates,
        },
        evidence: Evidence {
            file: shown,
            memberships,
            by_image: true,
        },
        solver: map.evidence,
        n_left_out: partition.n_left_out,
        n_unusable: inputs.detections.len() - used.len(),
    })
}

/// The measurements of all usable detections, with the index of the detection of each.
fn measure(config: &Config, inputs: &Inputs) -> (Vec<Measurement>, Vec<usize>) {
    let settings = config.projection();
    let (mut measurements, mut used) = (Vec::new(), Vec::new());
    for (i, (view, detection)) in inputs.detections.iter().enumerate() {
        let seen_from = (*view, &inputs.views[*view]);
        if let Ok(measurement) = Measurement::new(detection, seen_from, &settings) {
            measurements.push(measurement);
            used.push(i);
        }
    }
    (measurements, used)
}

fn key(inputs: &Inputs, detection: usize) -> DetectionKey {
    let detection = &inputs.detections[detection].1;
    DetectionKey {
        image_id: detection.image_id.clone(),
        det_id: detection.det_id.clone(),
    }
}

/// How much the views could have seen.
fn exposure(config: &Config, views: &[View], terrain: &Terrain) -> Exposure {
    let reach = config.reach();
    let footprints: Vec<MultiPolygon<f64>> = views
        .par_iter()
        .map(|view| trace(view, Some(terrain), reach).ground().clone())
        .collect();
    let polygons = footprints.iter().flat_map(|ground| &ground.0);
    let ranges_m = (reach.min_range_m, reach.max_range_m);
    Exposure {
        area_m2: unary_union(polygons).unsigned_area().max(1.0),
        shares: views
            .par_iter()
            .map(|view| trusted_share(view, terrain, ranges_m))
            .collect(),
    }
}

/// The share of a view's picture that shows ground in the trusted ranges, on a grid of pixels; not
/// less than a twentieth, so that a picture of sky does not make clutter look dense.
fn trusted_share(view: &View, terrain: &Terrain, (least_m, most_m): (f64, f64)) -> f64 {
    const COLUMNS: u32 = 32;
    const ROWS: u32 = 24;
    let (Some(camera), Some(enu_from_camera)) = (view.camera.as_deref(), view.enu_from_camera())
    else {
        return 1.0;
    };
    let at =
        |i: u32, n: u32, size: u32| (f64::from(i) + 0.5) / f64::from(n) * f64::from(size) - 0.5;
    let shows_ground = |column: u32, row: u32| {
        let (u, v) = (
            at(column, COLUMNS, camera.width),
            at(row, ROWS, camera.height),
        );
        let Ok(ray) = camera.ray(Pixel::new(u, v)) else {
            return false;
        };
        let ray = enu_from_camera * ray;
        let hit = terrain.first_hit(ray, most_m);
        hit.is_ok_and(|hit| hit.point.horizontal_distance(ray.origin) >= least_m)
    };
    let shown: f64 = (0..ROWS)
        .flat_map(|row| (0..COLUMNS).map(move |column| (column, row)))
        .map(|(column, row)| f64::from(u8::from(shows_ground(column, row))))
        .sum();
    (shown / f64::from(COLUMNS * ROWS)).max(0.05)
}

/// The map as evaluation takes it, objects named in their order.
fn as_map(
    inputs: &Inputs,
    map: &BoundMap,
    used: &[usize],
    keys: &[DetectionKey],
) -> (Vec<Estimate>, Vec<Membership>) {
    let (mut estimates, mut memberships) = (Vec::new(), Vec::new());
    for (i, object) in map.objects.iter().enumerate() {
        let rock_id = format!("bound-{:05}", i + 1);
        for &observation in &object.observations {
            memberships.push(Membership {
                rock_id: rock_id.clone(),
                detection: keys[observation].clone(),
                weight: 1.0,
            });
        }
        let first = object.observations.first().map(|&o| used[o]);
        let class = first.and_then(|o| inputs.detections[o].1.class.clone());
        estimates.push(estimate(&inputs.site, object, rock_id, class));
    }
    (estimates, memberships)
}

fn estimate(site: &Site, object: &BoundObject, rock_id: String, class: Option<String>) -> Estimate {
    let place = site.geodetic(object.place);
    let local = site.enu_from_local(place).inverse().matrix();
    let covariance = local * object.covariance * local.transpose();
    let ellipse = covariance_ellipse(covariance.fixed_view::<2, 2>(0, 0).into());
    Estimate {
        rock_id,
        class,
        place,
        p_exist: Some(object.p_exist),
        ellipse: (ellipse.sigma_minor_m > 0.0).then_some(ellipse),
    }
}
