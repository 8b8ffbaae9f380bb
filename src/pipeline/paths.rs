//! Where the files of a run are, and how its settings are written down.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};

use super::Overrides;
use crate::detection::Aim;
use crate::frame::{Crs, Geodetic, Planet};
use crate::input::Section;

/// An input file: where it is, and the name the run calls it by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Where to open it.
    pub path: PathBuf,
    /// As the pipeline file names it.
    pub shown: String,
}

impl Serialize for Source {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.shown)
    }
}

/// Where real data stand when `ROCKMAP_DATA` does not say.
pub const DEFAULT_DATA: &str = "../shared/data";

/// Turns the paths of a pipeline file into files.
pub(super) struct Paths {
    folder: PathBuf,
}

impl Paths {
    /// `--data` comes first, then `[input] data`, then the pipeline file's own folder.
    pub(super) fn new(input: &Section<'_>, file: &Path, overrides: &Overrides) -> Self {
        let home = file.parent().unwrap_or(Path::new("")).to_owned();
        let written = input.text("data");
        let folder = match (&overrides.data, written) {
            (Some(folder), _) => folder.clone(),
            (None, None) => home,
            (None, Some(text)) => match expanded(&text) {
                // What a variable holds is relative to the working folder, as in a shell.
                Ok(path) if text.starts_with('$') => PathBuf::from(path),
                Ok(path) => home.join(path),
                Err(variable) => {
                    let found = format!("${variable}, which is not set");
                    input.fault("data", found, "a variable of the environment");
                    home
                }
            },
        };
        Self { folder }
    }

    /// The files of a key, `None` where it is absent or no text.
    pub(super) fn sources(&self, section: &Section<'_>, key: &str) -> Option<Vec<Source>> {
        let texts = section.texts(key)?;
        let source = |text: String| match expanded(&text) {
            Ok(path) => Some(Source {
                path: self.folder.join(path),
                shown: text,
            }),
            Err(variable) => {
                let found = format!("${variable}, which is not set");
                section.fault(key, found, "a variable of the environment");
                None
            }
        };
        Some(texts.into_iter().filter_map(source).collect())
    }
}

/// `$NAME` and `${NAME}` replaced by the environment's values.
///
/// # Errors
/// The name of a variable that is not set.
fn expanded(text: &str) -> Result<String, String> {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let name = match rest.strip_prefix('{').and_then(|r| r.split_once('}')) {
            Some((name, after)) => {
                rest = after;
                name
            }
            None => {
                let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
                let (name, after) = rest.split_at(end);
                rest = after;
                name
            }
        };
        match std::env::var(name) {
            Ok(value) => out.push_str(&value),
            Err(_) if name == "ROCKMAP_DATA" => out.push_str(DEFAULT_DATA),
            Err(_) => return Err(name.to_owned()),
        }
    }
    out.push_str(rest);
    Ok(out)
}

#[expect(clippy::ref_option, reason = "serde's signature")]
pub(super) fn origin<S: Serializer>(origin: &Option<Geodetic>, s: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Degrees {
        lat_deg: f64,
        lon_deg: f64,
        height_m: f64,
    }
    let degrees = origin.map(|o| Degrees {
        lat_deg: o.lat_deg(),
        lon_deg: o.lon_deg(),
        height_m: o.height_m,
    });
    degrees.serialize(s)
}

#[expect(clippy::ref_option, reason = "serde's signature")]
pub(super) fn crs<S: Serializer>(crs: &Option<Crs>, s: S) -> Result<S::Ok, S::Error> {
    crs.as_ref().map(Crs::definition).serialize(s)
}

pub(super) fn planet<S: Serializer>(planet: &Planet, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(planet.name)
}

pub(super) fn aim<S: Serializer>(aim: &Aim, s: S) -> Result<S::Ok, S::Error> {
    match *aim {
        Aim::CENTER => s.serialize_str("center"),
        Aim::BOTTOM => s.serialize_str("bottom"),
        Aim::HeightShare(share) => s.serialize_f64(share),
    }
}
