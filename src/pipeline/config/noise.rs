//! `[noise]`: one standard deviation, where the data give none.

use serde::Serialize;

use super::{not_negative, positive};
use crate::input::Section;
use crate::pose::PoseSigma;

/// `[noise]`: one standard deviation, where the data give none.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseConfig {
    /// Of a mark's column and row, pixels.
    pub pixel_px: f64,
    /// Of a range, metres.
    pub range_m: f64,
    /// Of a bearing or azimuth, degrees.
    pub bearing_deg: f64,
    /// Of a pose.
    pub pose: PoseSigma,
}

pub(super) fn noise(section: Section<'_>) -> NoiseConfig {
    let pose = section.section("pose");
    let angle = |key, default: f64| not_negative(&pose, key, default).to_radians();
    let config = NoiseConfig {
        pixel_px: positive(&section, "pixel_px", 1.5),
        range_m: positive(&section, "range_m", 0.15),
        bearing_deg: positive(&section, "bearing_deg", 1.0),
        pose: PoseSigma {
            east_m: not_negative(&pose, "east_m", 0.05),
            north_m: not_negative(&pose, "north_m", 0.05),
            up_m: not_negative(&pose, "up_m", 0.02),
            roll: angle("roll_deg", 0.25),
            pitch: angle("pitch_deg", 0.25),
            yaw: angle("yaw_deg", 0.4),
        },
    };
    pose.finish();
    section.finish();
    config
}
