//! `[terrain]`: the ground.

use serde::Serialize;

use super::super::paths::{Paths, Source};
use super::not_negative;
use crate::input::Section;

/// `[terrain]`: the ground.
#[derive(Debug, Clone, Serialize)]
pub struct TerrainConfig {
    /// Ellipsoidal height of a level ground, metres.
    pub plane_m: Option<f64>,
    /// Height models.
    pub path: Vec<Source>,
    /// How far the true ground may deviate, one standard deviation, metres.
    pub height_sigma_m: f64,
}

pub(super) fn terrain(section: Section<'_>, paths: &Paths) -> TerrainConfig {
    let config = TerrainConfig {
        plane_m: section.number("plane_m", .., "a number"),
        path: paths.sources(&section, "path").unwrap_or_default(),
        height_sigma_m: not_negative(&section, "height_sigma_m", 0.02),
    };
    section.finish();
    config
}
