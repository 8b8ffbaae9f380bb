//! `[view]`: which point of a box counts, and how far views are trusted.

use serde::Serialize;

use super::{POSITIVE, not_negative, positive};
use crate::detection::Aim;
use crate::input::Section;

/// `[view]`: which point of a box counts, and how far views are trusted.
#[derive(Debug, Clone, Serialize)]
pub struct ViewConfig {
    /// The point of a box taken for the object's place.
    #[serde(serialize_with = "crate::pipeline::paths::aim")]
    pub aim: Aim,
    /// Least ground range, metres.
    pub min_range_m: f64,
    /// Greatest ground range, metres; none if absent.
    pub max_range_m: Option<f64>,
    /// Opening angle of views without a camera, degrees.
    pub fov_deg: f64,
    /// Least score.
    pub min_score: f64,
    /// Longest gap of a pose log to interpolate over, seconds.
    pub max_gap_s: f64,
}

pub(super) fn view(section: Section<'_>) -> ViewConfig {
    let share = section.number_or_word(
        "aim",
        &["center", "bottom"],
        0.0..=1.0,
        "a share from 0 to 1",
    );
    let aim = match share {
        Some(Ok(share)) => Aim::HeightShare(share),
        Some(Err(word)) if word == "bottom" => Aim::BOTTOM,
        _ => Aim::CENTER,
    };
    let config = ViewConfig {
        aim,
        min_range_m: not_negative(&section, "min_range_m", 0.0),
        max_range_m: section.number("max_range_m", f64::MIN_POSITIVE.., POSITIVE),
        fov_deg: section
            .number("fov_deg", f64::MIN_POSITIVE..=360.0, "above 0, to 360")
            .unwrap_or(360.0),
        min_score: section
            .number("min_score", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.0),
        max_gap_s: positive(&section, "max_gap_s", 1.0),
    };
    if let Some(max) = config.max_range_m
        && max <= config.min_range_m
    {
        let expected = format!("more than min_range_m, {}", config.min_range_m);
        section.fault("max_range_m", max, expected);
    }
    section.finish();
    config
}
