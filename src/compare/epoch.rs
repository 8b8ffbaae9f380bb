//! A map as it is compared: its objects, and where its views looked.

use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{Coverage, geopackage};
use crate::error::{Error, Fault, Place};
use crate::evaluate::{RockMap, map_from_bytes};
use crate::pipeline::hexadecimal;
use crate::publish::report;

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
    /// What the report of its run holds, where it is a folder with one.
    pub report: Option<Value>,
}

impl Epoch {
    /// Reads a map: the folder of a run, whose rocks.geojson and footprints.geojson are taken, or
    /// without them rockmap.gpkg; a GeoJSON file of points with footprints.geojson beside it, if
    /// there is one; or a `GeoPackage` with its layers `rocks` and `footprints`, or its first layer of
    /// points.
    ///
    /// # Errors
    /// Files that cannot be read, and their faults.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let rocks = if path.is_dir() {
            let (text, package) = (path.join("rocks.geojson"), path.join("rockmap.gpkg"));
            if !text.exists() && package.exists() {
                package
            } else {
                text
            }
        } else {
            path.to_owned()
        };
        let shown = |path: &Path| path.display().to_string();
        let is_package = rocks.extension().is_some_and(|e| e == "gpkg");
        let (content, footprints) = if is_package {
            layers(&rocks)?
        } else {
            files(&rocks)?
        };
        let mut digest = Sha256::new_with_prefix(&content);
        let map = map_from_bytes(&content, &shown(&rocks))?;
        let coverage = match footprints {
            Some((file, content)) => {
                digest.update(&content);
                Some(Coverage::from_bytes(&content, &shown(&file))?)
            }
            None => None,
        };
        let report = std::fs::read_to_string(path.join("report.html")).ok();
        let report = report.as_deref().and_then(report::held);
        if let Some(report) = &report {
            digest.update(report["manifest"]["run_id"].to_string());
        }
        Ok(Self {
            name: shown(path),
            map,
            coverage,
            sha256: hexadecimal(&digest.finalize()),
            report,
        })
    }
}

/// The text of the rocks, and of the footprints with the file they are from.
type Texts = (Vec<u8>, Option<(PathBuf, Vec<u8>)>);

fn files(rocks: &Path) -> Result<Texts, Error> {
    let read = |path: &Path| std::fs::read(path).map_err(|e| Error::io(path, "read", e));
    let content = read(rocks)?;
    let footprints = rocks.with_file_name("footprints.geojson");
    if !footprints.exists() || footprints == rocks {
        return Ok((content, None));
    }
    let outlines = read(&footprints)?;
    Ok((content, Some((footprints, outlines))))
}

fn layers(package: &Path) -> Result<Texts, Error> {
    let Some(rocks) = geopackage::layer(package, "rocks", Some("POINT"))? else {
        let place = Place::file(package.display().to_string());
        return Err(Fault::found(place, "", "no layer of points", "a layer rocks").into());
    };
    let footprints = geopackage::layer(package, "footprints", None)?;
    let footprints = footprints.map(|text| (package.to_owned(), text.into_bytes()));
    Ok((rocks.into_bytes(), footprints))
}
