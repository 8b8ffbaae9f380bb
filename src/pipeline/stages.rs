//! The stages between reading and fusing, and the clock that times all of them.

use std::time::Instant;

use rayon::prelude::*;

use super::Observer;
use super::config::Config;
use super::read::Inputs;
use super::summary::Stage;
use crate::error::Error;
use crate::footprint::{Footprints, Reach, trace};
use crate::fuse::belief::PoseCorrection;
use crate::input::Reject;
use crate::project::{self, MarkNoise, Placed};
use crate::publish::Scene;
use crate::view::View;

/// How detections are read, as the projection takes it.
pub type Settings = project::Settings;

/// A run up to the ground.
pub struct Ground {
    /// Detections with a place on the ground, by view.
    pub placed: Vec<Placed>,
    /// Detections without one.
    pub misses: Vec<Reject>,
    /// What each view could have seen.
    pub footprints: Footprints,
    /// Names of the classes, sorted; no class first.
    pub classes: Vec<Option<String>>,
    /// The views with their poses corrected, where the method corrects poses.
    pub corrected: Option<Vec<View>>,
}

impl Ground {
    /// The run as publishing takes it.
    pub fn scene<'a>(&'a self, config: &Config, inputs: &'a Inputs) -> Scene<'a> {
        let corrects = config.fusion.pose_correction != PoseCorrection::Off;
        let corrected = self.corrected.as_ref().filter(|_| corrects);
        Scene {
            site: &inputs.site,
            datum: inputs.datum.as_ref(),
            terrain: inputs.terrain.as_ref(),
            views: self.corrected.as_deref().unwrap_or(&inputs.views),
            measured: corrected.map(|_| inputs.views.as_slice()),
            detections: &inputs.detections,
            placed: &self.placed,
            footprints: &self.footprints,
            classes: &self.classes,
            aim: config.view.aim,
        }
    }
}

impl Config {
    /// How marks are read and trusted.
    pub fn projection(&self) -> Settings {
        Settings {
            aim: self.view.aim,
            min_range_m: self.view.min_range_m,
            max_range_m: self.view.max_range_m.unwrap_or(f64::INFINITY),
            min_score: self.view.min_score,
            noise: MarkNoise {
                pixel_px: self.noise.pixel_px,
                range_m: self.noise.range_m,
                bearing: self.noise.bearing_deg.to_radians(),
            },
        }
    }

    /// How far footprints reach.
    pub fn reach(&self) -> Reach {
        Reach {
            min_range_m: self.view.min_range_m,
            max_range_m: self.view.max_range_m.unwrap_or(f64::INFINITY),
            fov: self.view.fov_deg.to_radians(),
        }
    }
}

/// Puts every detection on the ground.
pub(super) fn project(
    config: &Config,
    inputs: &Inputs,
    observer: &dyn Observer,
) -> (Vec<Placed>, Vec<Reject>) {
    observer.begin("project", Some(inputs.detections.len()));
    let settings = config.projection();
    let height_sigma_m = config.terrain.height_sigma_m;
    let terrain = inputs.terrain.as_ref();
    let placed: Vec<Result<Placed, Reject>> = inputs
        .detections
        .par_iter()
        .map(|(view, detection)| {
            let seen_from = (*view, &inputs.views[*view]);
            let placed = project::place(detection, seen_from, terrain, height_sigma_m, &settings);
            observer.step();
            placed.map_err(|miss| Reject {
                file: inputs.detection_files[detection.file].clone(),
                line: Some(detection.line),
                record: detection.key(),
                reason: miss.reason(),
                detail: miss.to_string(),
            })
        })
        .collect();
    let mut hits = Vec::new();
    let mut misses = Vec::new();
    for result in placed {
        match result {
            Ok(hit) => hits.push(hit),
            Err(reject) => misses.push(reject),
        }
    }
    observer.end(&format!(
        "{} on the ground, {} not",
        hits.len(),
        misses.len()
    ));
    (hits, misses)
}

/// Traces what every view could have seen.
pub(super) fn footprint(
    config: &Config,
    inputs: &Inputs,
    (placed, misses): (Vec<Placed>, Vec<Reject>),
    corrected: Option<Vec<View>>,
    observer: &dyn Observer,
) -> Ground {
    let views = corrected.as_deref().unwrap_or(&inputs.views);
    observer.begin("footprint", Some(views.len()));
    let reach = config.reach();
    let sector = sector_reach(reach, inputs, &placed);
    let footprints: Vec<_> = views
        .par_iter()
        .map(|view| {
            let reach = if view.camera.is_some() { reach } else { sector };
            let footprint = trace(view, inputs.terrain.as_ref(), reach);
            observer.step();
            footprint
        })
        .collect();
    let mut classes: Vec<Option<String>> =
        placed.iter().map(|p| p.detection.class.clone()).collect();
    classes.sort_unstable();
    classes.dedup();
    let seeing = footprints
        .iter()
        .filter(|f| !f.ground().0.is_empty())
        .count();
    observer.end(&format!(
        "{seeing} of {} views see ground",
        footprints.len()
    ));
    Ground {
        placed,
        misses,
        footprints: Footprints::new(footprints),
        classes,
        corrected,
    }
}

/// How far sectors reach where the run does not say: as far as any view without a camera has
/// detected anything. A picture ends by itself, a sector does not.
fn sector_reach(reach: Reach, inputs: &Inputs, placed: &[Placed]) -> Reach {
    let blind = placed
        .iter()
        .filter(|p| inputs.views[p.view].camera.is_none());
    let farthest_m = blind.map(|p| p.hit.ground_range_m).max_by(f64::total_cmp);
    match farthest_m {
        Some(farthest_m) if reach.max_range_m.is_infinite() => Reach {
            max_range_m: farthest_m,
            ..reach
        },
        _ => reach,
    }
}

/// Times the stages. What it reads goes to timing.json and the closing table alone: nothing in a
/// map depends on it.
pub struct Clock {
    /// The stages so far.
    pub stages: Vec<Stage>,
}

impl Clock {
    /// No stages yet.
    pub fn start() -> Self {
        Self { stages: Vec::new() }
    }

    /// Runs a stage and notes its time and memory.
    pub(super) fn stage<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let start = Instant::now();
        let result = work();
        self.stages.push(Stage {
            stage: name,
            seconds: start.elapsed().as_secs_f64(),
            peak_memory_mb: peak_memory_mb(),
        });
        result
    }
}

/// The most memory the process has had so far, where the system tells (Linux).
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}
