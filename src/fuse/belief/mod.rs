//! Belief fusion.
mod algebra;
mod curve;
mod data;
mod engine;
mod evidence;
mod expect;
mod footprint;
mod ground;
mod learn;
mod looks;
mod merge;
mod near;
mod noise;
mod outcome;
mod pairs;
mod register;
mod sequence;
mod single;
mod associate;
mod solve;
#[cfg(test)]
mod tests;

pub use outcome::{fuse_belief, Belief, BeliefObject, BeliefEvidence, Single};

/// How poses are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoseCorrection {
    /// Not at all: their errors count as noise of the readings.
    Off,
    /// Every view has an error of its own.
    PerView,
    /// Part of the error drifts slowly along the traverse.
    Drift,
}

/// Which side of a box says how large an object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SizeRule {
    /// Its width.
    Width,
    /// Its height: things that stand upright are as high from all sides.
    Height,
}

/// What a run states of its data and its wishes.
#[derive(Debug, Clone, PartialEq)]
pub struct BeliefSettings {
    /// How poses are corrected.
    pub pose_correction: PoseCorrection,
    /// Which side of a box says how large an object is.
    pub size_rule: SizeRule,
    /// Standard deviation of the logarithm of an apparent size.
    pub log_size_sigma: f64,
    /// Where on an object a box sits, one standard deviation as a share of its size.
    pub shape: f64,
    /// How far an object's middle lies behind the face that is marked, metres.
    pub radius_m: f64,
    /// Mean and standard deviation of the objects' sizes, metres, where they are known beforehand.
    pub size_m: Option<(f64, f64)>,
    /// Opening angle of views without a camera, radians.
    pub fov: f64,
    /// Errors of readings of one object fade in this time, seconds.
    pub geometry_time_s: f64,
    /// Whether an object is detected again depends on the last look for this time, seconds.
    pub event_time_s: f64,
    /// Errors of readings fade with this share of the range travelled.
    pub look_share: f64,
}

impl Default for BeliefSettings {
    fn default() -> Self {
        Self {
            pose_correction: PoseCorrection::PerView,
            size_rule: SizeRule::Width,
            log_size_sigma: 0.15,
            shape: 0.0,
            radius_m: 0.0,
            size_m: None,
            fov: std::f64::consts::TAU,
            geometry_time_s: 1.5,
            event_time_s: 0.5,
            look_share: 0.06,
        }
    }
}
