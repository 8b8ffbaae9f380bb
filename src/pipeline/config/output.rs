//! `[output]`: what is written, and where.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::super::formats::formats;
use super::{Overrides, POSITIVE};
use crate::frame::{Crs, Planet};
use crate::input::Section;
use crate::publish::Format;

/// `[output]`: what is written, and where.
#[derive(Debug, Clone, Serialize)]
pub struct OutputConfig {
    /// `belief`: candidates of less existence probability are not written.
    pub min_exist: f64,
    /// The folder. Not part of what the run is, so no output names it.
    #[serde(skip)]
    pub dir: PathBuf,
    /// Map formats.
    pub formats: Vec<Format>,
    /// The system that maps other than GeoJSON are written in; default: the planet's own.
    #[serde(
        serialize_with = "crate::pipeline::paths::crs",
        skip_serializing_if = "Option::is_none"
    )]
    pub crs: Option<Crs>,
    /// Whether pictures are annotated.
    pub annotate: bool,
    /// Whether report.html is written.
    pub report: bool,
    /// Whether every detection is written by itself too.
    pub detections: bool,
    /// Whether the pictures are laid on the ground as a mosaic.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub mosaic: bool,
    /// Side of the mosaic's pixels, metres; chosen from the data if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mosaic_m_per_px: Option<f64>,
}

pub(super) fn output(
    section: Section<'_>,
    path: &Path,
    overrides: &Overrides,
    planet: Option<Planet>,
) -> Option<OutputConfig> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let stem = path.file_stem().unwrap_or_default();
    let written = section.text("dir").map(|dir| folder.join(dir));
    let dir = written.unwrap_or_else(|| folder.join("../outputs").join(stem));
    let formats = formats(&section);
    let crs = section.text("crs").zip(planet).and_then(|(text, planet)| {
        let crs = Crs::for_map(&text, planet);
        crs.map_err(|e| section.problem("crs", e.to_string())).ok()
    });
    let config = OutputConfig {
        min_exist: section
            .number("min_exist", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.05),
        dir: overrides.out.clone().unwrap_or(dir),
        formats: formats.clone().unwrap_or_default(),
        crs,
        annotate: section.boolean("annotate").unwrap_or(true),
        report: section.boolean("report").unwrap_or(true),
        detections: section.boolean("detections").unwrap_or(false),
        mosaic: section.boolean("mosaic").unwrap_or(false),
        mosaic_m_per_px: section.number("mosaic_m_per_px", f64::MIN_POSITIVE.., POSITIVE),
    };
    section.finish();
    formats.map(|_| config)
}
