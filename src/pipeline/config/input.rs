//! `[input]`: the files.

use serde::Serialize;

use super::super::paths::{Paths, Source};
use crate::input::Section;

/// `[input]`: the files.
#[derive(Debug, Clone, Serialize)]
pub struct InputConfig {
    /// The data folder, as written.
    pub data: Option<String>,
    /// Pose logs.
    pub poses: Vec<Source>,
    /// Image lists.
    pub images: Vec<Source>,
    /// Cameras.
    pub cameras: Vec<Source>,
    /// Detections.
    pub detections: Vec<Source>,
    /// The largest share of faulty records at which a run still counts as clean.
    pub max_reject_share: f64,
    /// Degrees clockwise to be added to every heading of the pose logs.
    pub heading_bias_deg: f64,
    /// What the clock of the pose logs shows more than that of the images, seconds.
    pub clock_offset_s: f64,
}

pub(super) fn inputs(section: Section<'_>, paths: &Paths) -> Option<InputConfig> {
    let sources = |key: &str| paths.sources(&section, key);
    let required = |key: &str| {
        let found = sources(key);
        if found.is_none() && !section.has(key) {
            section.fault(key, "nothing", "a file or a list of files");
        }
        found.filter(|list| !list.is_empty())
    };
    let (poses, detections) = (required("poses"), required("detections"));
    let config = InputConfig {
        data: section.text("data"),
        images: sources("images").unwrap_or_default(),
        cameras: sources("cameras").unwrap_or_default(),
        max_reject_share: section
            .number("max_reject_share", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.1),
        heading_bias_deg: section
            .number("heading_bias_deg", -360.0..=360.0, "-360 to 360")
            .unwrap_or(0.0),
        clock_offset_s: section
            .number("clock_offset_s", -1e9..=1e9, "seconds, up to a billion")
            .unwrap_or(0.0),
        poses: poses.unwrap_or_default(),
        detections: detections.unwrap_or_default(),
    };
    section.finish();
    Some(config)
}
