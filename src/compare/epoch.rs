//! A map as it is compared: its objects, and where its views looked.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::Coverage;
use crate::error::Error;
use crate::evaluate::{RockMap, map_from_bytes};
use crate::pipeline::hexadecimal;

/// A map of one time.
#[derive(Debug, Clone)]
pub struct Epoch {
    /// What it is called.
    pub name: String,
    /// Its objects.
    pub map: RockMap,
    /// What its views could have seen, where that is known.
    pub coverage: Option<Coverage>,
    /// SHA-256 of the files it was read from, hexadecimal; empty where it was not.
    pub sha256: String,
}

impl Epoch {
    /// Reads a map: the folder of a run, whose rocks.geojson and footprints.geojson are taken, or a
    /// GeoJSON file of points with footprints.geojson beside it, if there is one.
    ///
    /// # Errors
    /// Files that cannot be read, and their faults.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let rocks = if path.is_dir() {
            path.join("rocks.geojson")
        } else {
            path.to_owned()
        };
        let read = |path: &Path| std::fs::read(path).map_err(|e| Error::io(path, "read", e));
        let shown = |path: &Path| path.display().to_string();
        let content = read(&rocks)?;
        let mut digest = Sha256::new_with_prefix(&content);
        let map = map_from_bytes(&content, &shown(&rocks))?;
        let footprints: PathBuf = rocks.with_file_name("footprints.geojson");
        let coverage = if footprints.exists() && footprints != rocks {
            let content = read(&footprints)?;
            digest.update(&content);
            Some(Coverage::from_bytes(&content, &shown(&footprints))?)
        } else {
            None
        };
        Ok(Self {
            name: shown(path),
            map,
            coverage,
            sha256: hexadecimal(&digest.finalize()),
        })
    }
}
