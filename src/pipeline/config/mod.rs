//! The pipeline file: what was typed becomes what it means, once, with all faults listed. One file a
//! section.

mod fusion;
mod input;
mod noise;
mod output;
mod site;
mod terrain;
mod view;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use fusion::{FusionConfig, Method};
pub use input::InputConfig;
pub use noise::NoiseConfig;
pub use output::OutputConfig;
pub use site::{Heights, NorthName, SiteConfig};
pub use terrain::TerrainConfig;
pub use view::ViewConfig;

use super::paths::Paths;
use crate::error::{Error, Fault};
use crate::input::{Asked, Document, Section};
use crate::pose::{HeadingReference, North};

/// A checked pipeline file.
#[derive(Debug, Clone, Serialize)]
pub struct Config {
    /// `[site]`.
    pub site: SiteConfig,
    /// `[input]`.
    pub input: InputConfig,
    /// `[terrain]`.
    pub terrain: TerrainConfig,
    /// `[view]`.
    pub view: ViewConfig,
    /// `[noise]`.
    pub noise: NoiseConfig,
    /// `[fusion]`.
    pub fusion: FusionConfig,
    /// `[output]`.
    pub output: OutputConfig,
}

/// What the command line lays over the pipeline file.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// `--data`.
    pub data: Option<PathBuf>,
    /// `--out`.
    pub out: Option<PathBuf>,
    /// `--set KEY.PATH=VALUE`, in order; `--method` is one of them.
    pub set: Vec<String>,
}

impl Config {
    /// Reads and checks a pipeline file.
    ///
    /// # Errors
    /// A file that cannot be read or is not TOML, and all faults of its keys at once.
    pub fn read(path: &Path, overrides: &Overrides) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
        Self::parse(&text, path, overrides)
    }

    /// Checks the text of a pipeline file that stands at `path`.
    ///
    /// # Errors
    /// As [`Config::read`].
    pub fn parse(text: &str, path: &Path, overrides: &Overrides) -> Result<Self, Error> {
        let mut document = Document::parse(text, &path.display().to_string())?;
        let unset = overrides.set.iter().filter_map(|a| document.set(a).err());
        let mut faults: Vec<Fault> = unset.collect();
        let root = document.root();
        let config = Self::sections(&root, path, overrides);
        root.finish();
        faults.extend(document.into_faults());
        match config {
            Some(config) if faults.is_empty() => Ok(config),
            _ => Err(Error::Faults(faults)),
        }
    }

    /// Every key a pipeline file may have, as the reader asks for it.
    pub(super) fn keys() -> Vec<Asked> {
        // Tables that are read only where they are present are present here.
        let probe = "[site]\norigin = { lat_deg = 0, lon_deg = 0 }\n";
        let Ok(document) = Document::parse(probe, "probe") else {
            return Vec::new();
        };
        let here = Path::new("pipeline.toml");
        Self::sections(&document.root(), here, &Overrides::default());
        document.asked()
    }

    fn sections(root: &Section<'_>, path: &Path, overrides: &Overrides) -> Option<Self> {
        let input = root.section("input");
        let paths = Paths::new(&input, path, overrides);
        let site = site::site(root.section("site"), path, &paths);
        let input = input::inputs(input, &paths);
        let terrain = terrain::terrain(root.section("terrain"), &paths);
        let view = view::view(root.section("view"));
        let noise = noise::noise(root.section("noise"));
        let fusion = fusion::fusion(root.section("fusion"));
        let planet = site.as_ref().map(|site| site.planet);
        let output = output::output(root.section("output"), path, overrides, planet);
        // Only now may a fault end it: all sections have told theirs.
        Some(Self {
            site: site?,
            input: input?,
            terrain,
            view,
            noise,
            fusion: fusion?,
            output: output?,
        })
    }

    /// What headings of the pose logs are measured from.
    pub fn heading(&self) -> HeadingReference {
        let declination = self.site.declination_deg.unwrap_or(0.0).to_radians();
        let north = match (self.site.north, &self.site.crs) {
            (NorthName::Grid, Some(crs)) => North::Grid(crs.clone()),
            (NorthName::Magnetic, _) => North::Magnetic { declination },
            _ => North::True,
        };
        HeadingReference {
            north,
            bias: self.input.heading_bias_deg.to_radians(),
        }
    }
}

const POSITIVE: &str = "a number above zero";
const NOT_NEGATIVE: &str = "a number not below zero";

/// A number above zero. The least positive number stands in for the open bound.
fn positive(section: &Section<'_>, key: &str, default: f64) -> f64 {
    let found = section.number(key, f64::MIN_POSITIVE.., POSITIVE);
    found.unwrap_or(default)
}

fn not_negative(section: &Section<'_>, key: &str, default: f64) -> f64 {
    section.number(key, 0.0.., NOT_NEGATIVE).unwrap_or(default)
}
