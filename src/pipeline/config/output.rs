//! `[output]`: what is written, and where.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::super::formats::formats;
use super::{Overrides, POSITIVE};
use crate::frame::{Crs, Planet};
use crate::input::Section;
use crate::publish::{Format, Layout, Picture, picture};

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
    /// What the annotated pictures show.
    #[serde(skip_serializing_if = "is_default")]
    pub annotate_layout: Layout,
    /// The images that are annotated; all where the list is empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub annotate_only: Vec<String>,
    /// The format of annotated pictures; that of their originals if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture_format: Option<picture::Format>,
    /// The quality of annotated JPEG pictures.
    #[serde(skip_serializing_if = "is_default_quality")]
    pub picture_quality: u8,
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
        annotate_layout: layout(&section),
        annotate_only: section.texts("annotate_only").unwrap_or_default(),
        picture_format: picture_format(&section),
        picture_quality: section
            .integer("picture_quality", 1..=100)
            .and_then(|quality| u8::try_from(quality).ok())
            .unwrap_or(Picture::JPEG_QUALITY),
        report: section.boolean("report").unwrap_or(true),
        detections: section.boolean("detections").unwrap_or(false),
        mosaic: section.boolean("mosaic").unwrap_or(false),
        mosaic_m_per_px: section.number("mosaic_m_per_px", f64::MIN_POSITIVE.., POSITIVE),
    };
    section.finish();
    formats.map(|_| config)
}

fn layout(section: &Section<'_>) -> Layout {
    let words = Layout::ALL.map(Layout::name);
    let word = section.word("annotate_layout", &words);
    let named = |layout: &Layout| word.as_deref() == Some(layout.name());
    Layout::ALL.into_iter().find(named).unwrap_or_default()
}

fn picture_format(section: &Section<'_>) -> Option<picture::Format> {
    let words = ["same", "jpeg", "png", "tiff"];
    match section.word("picture_format", &words).as_deref() {
        Some("jpeg") => Some(picture::Format::Jpeg),
        Some("png") => Some(picture::Format::Png),
        Some("tiff") => Some(picture::Format::Tiff),
        _ => None,
    }
}

fn is_default(layout: &Layout) -> bool {
    *layout == Layout::default()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_default_quality(quality: &u8) -> bool {
    *quality == Picture::JPEG_QUALITY
}
