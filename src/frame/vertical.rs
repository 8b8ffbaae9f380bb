//! Heights above a geoid or another vertical datum.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::definition::Definition;
use super::proj_3d::{self, Operation, Pipeline};
use super::{CrsError, Geodetic, Planet};

/// How far around a place a way between two datums has to serve, degrees.
const AROUND_DEG: f64 = 0.5;

/// What heights above the ellipsoid of WGS84 are in.
const ELLIPSOIDAL: &str = "EPSG:4979";

/// A vertical coordinate reference system around a site, and the way from its heights to those above
/// the ellipsoid.
///
/// The way is PROJ's: a shift by a geoid grid, and what else the datum asks for. It is chosen once,
/// for a site, among those whose grids are installed, and never one that leaves heights as they are
/// for want of a grid. Like [`super::Crs`] this is only the definition, and every thread keeps its own
/// transformation.
#[derive(Debug, Clone, PartialEq)]
pub struct VerticalDatum {
    name: String,
    pipeline: String,
    grids: Vec<GeoidGrid>,
    unit_m: f64,
}

/// A grid that heights are shifted by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GeoidGrid {
    /// As PROJ calls it.
    pub name: String,
    /// Where it stands.
    pub path: PathBuf,
}

/// Why heights of a vertical datum cannot be understood.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatumError {
    /// No such vertical coordinate reference system.
    #[error(
        "found {found:?}, expected a vertical coordinate reference system known to PROJ, such as \
         EPSG:5773, or a geoid grid in GTX format ({why})"
    )]
    Unknown {
        /// What was given.
        found: String,
        /// What PROJ said.
        why: String,
    },
    /// No way from these heights to those above the planet's ellipsoid.
    #[error(
        "found {found:?}, expected one that PROJ can turn into heights above the ellipsoid here"
    )]
    NoWay {
        /// What was given.
        found: String,
    },
    /// Heights of this datum need a grid that is not installed.
    #[error(
        "found {found:?} without its grid, expected one of {} in {}: set PROJ_DATA to the folder \
         that holds it",
        grids.join(", "),
        if folders.is_empty() { "PROJ's folders" } else { folders.as_str() }
    )]
    NoGrid {
        /// What was given.
        found: String,
        /// The grids of which any serves.
        grids: Vec<String>,
        /// Where PROJ looks for them.
        folders: String,
    },
    /// A grid is there and cannot be used.
    #[error(
        "found {found:?} with the grid {grid}, expected one that can be opened and reaches here ({why})"
    )]
    BadGrid {
        /// What was given.
        found: String,
        /// The grid.
        grid: String,
        /// What went wrong.
        why: String,
    },
    /// A place outside the grid.
    #[error("found a place outside the grid of {datum}, expected one within")]
    OutsideGrid {
        /// The datum.
        datum: String,
    },
}

thread_local! {
    static PIPELINES: RefCell<HashMap<String, Option<Rc<Pipeline>>>> = RefCell::default();
}

impl VerticalDatum {
    /// Whether a code is that of a vertical CRS, and the planet one that has them.
    ///
    /// # Errors
    /// [`DatumError::Unknown`] and [`DatumError::NoWay`]; which grids it takes only shows where a
    /// site is known.
    pub fn check(code: &str, planet: Planet) -> Result<(), DatumError> {
        vertical(code)?;
        if planet.is_earth() {
            Ok(())
        } else {
            Err(DatumError::NoWay {
                found: code.to_owned(),
            })
        }
    }

    /// The vertical CRS of an authority's code (`EPSG:5773`) around a place.
    ///
    /// # Errors
    /// [`DatumError`] where PROJ knows no such CRS, no way from it to heights above the planet's
    /// ellipsoid, or where the grid for it is not at hand.
    pub fn new(code: &str, planet: Planet, around: Geodetic) -> Result<Self, DatumError> {
        Self::check(code, planet)?;
        let (own, unit_m) = vertical(code)?;
        let no_way = || DatumError::NoWay {
            found: code.to_owned(),
        };
        let (lat, lon) = (around.lat_deg(), around.lon_deg());
        let window = [
            lon - AROUND_DEG,
            (lat - AROUND_DEG).max(-90.0),
            lon + AROUND_DEG,
            (lat + AROUND_DEG).min(90.0),
        ];
        let compound = format!("{}+{own}", planet.crs);
        let operations =
            proj_3d::operations(&compound, ELLIPSOIDAL, window).map_err(|_| no_way())?;
        choose(code, unit_m, &operations, around)
    }

    /// Heights above the geoid of a grid file in GTX format, metres above the ellipsoid, around a
    /// place.
    ///
    /// # Errors
    /// [`DatumError::BadGrid`] where the file cannot be read as one or does not reach the place.
    pub fn from_grid(path: &Path, shown: &str, around: Geodetic) -> Result<Self, DatumError> {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let file = absolute.display().to_string();
        let bad = |why: &str| DatumError::BadGrid {
            found: shown.to_owned(),
            grid: path.display().to_string(),
            why: why.to_owned(),
        };
        if file.contains(['"', ',']) {
            return Err(bad("PROJ takes no path with a comma or quotes"));
        }
        let pipeline = format!(
            "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad \
             +step +proj=vgridshift +grids=\"{file}\" +multiplier=1 \
             +step +proj=unitconvert +xy_in=rad +xy_out=deg"
        );
        let datum = Self {
            name: shown.to_owned(),
            pipeline,
            grids: vec![GeoidGrid {
                name: shown.to_owned(),
                path: path.to_owned(),
            }],
            unit_m: 1.0,
        };
        datum.try_at(around).map_err(|why| bad(&why))?;
        Ok(datum)
    }

    /// The code or file it was made from.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The grids it shifts by.
    pub fn grids(&self) -> &[GeoidGrid] {
        &self.grids
    }

    /// The way from these heights to ellipsoidal ones, as PROJ text.
    pub fn pipeline(&self) -> &str {
        &self.pipeline
    }

    /// The place whose height was in this datum, with its height above the ellipsoid.
    ///
    /// # Errors
    /// [`DatumError::OutsideGrid`].
    pub fn to_ellipsoidal(&self, place: Geodetic) -> Result<Geodetic, DatumError> {
        let height = place.height_m / self.unit_m;
        let height_m = self.shifted(place, height, false)?;
        Ok(Geodetic { height_m, ..place })
    }

    /// The height in this datum, metres, of a place whose height is above the ellipsoid.
    ///
    /// # Errors
    /// [`DatumError::OutsideGrid`].
    pub fn height_m(&self, place: Geodetic) -> Result<f64, DatumError> {
        Ok(self.shifted(place, place.height_m, true)? * self.unit_m)
    }

    fn shifted(&self, place: Geodetic, height: f64, back: bool) -> Result<f64, DatumError> {
        self.pipeline_of_this_thread()
            .and_then(|p| p.transform([place.lon_deg(), place.lat_deg(), height], back))
            .map(|[_, _, height]| height)
            .ok_or_else(|| DatumError::OutsideGrid {
                datum: self.name.clone(),
            })
    }

    fn pipeline_of_this_thread(&self) -> Option<Rc<Pipeline>> {
        PIPELINES.with_borrow_mut(|known| {
            if let Some(found) = known.get(&self.pipeline) {
                return found.clone();
            }
            let made = Pipeline::new(&self.pipeline).ok().map(Rc::new);
            known.insert(self.pipeline.clone(), made.clone());
            made
        })
    }

    /// Whether it serves at a place, or why not.
    fn try_at(&self, place: Geodetic) -> Result<(), String> {
        let pipeline = Pipeline::new(&self.pipeline)?;
        pipeline
            .transform([place.lon_deg(), place.lat_deg(), 0.0], false)
            .map(|_| ())
            .ok_or_else(|| "it does not hold the site".to_owned())
    }
}

/// Authority and code of a vertical CRS, and metres in its unit.
fn vertical(code: &str) -> Result<(String, f64), DatumError> {
    let unknown = |why: String| DatumError::Unknown {
        found: code.to_owned(),
        why,
    };
    let definition = Definition::of(code).map_err(|error| match error {
        CrsError::Unknown { why, .. } => unknown(why),
        other => unknown(other.to_string()),
    })?;
    let own = definition
        .vertical_code()
        .filter(|own| own.eq_ignore_ascii_case(code))
        .ok_or_else(|| unknown("not a vertical one".to_owned()))?;
    Ok((own, definition.vertical_unit_m().unwrap_or(1.0)))
}

/// The first way whose grids are at hand and hold the place.
fn choose(
    code: &str,
    unit_m: f64,
    operations: &[Operation],
    around: Geodetic,
) -> Result<VerticalDatum, DatumError> {
    let found = || code.to_owned();
    let mut missing: Vec<String> = Vec::new();
    let mut bad = None;
    for operation in operations {
        let Some(pipeline) = &operation.pipeline else {
            continue;
        };
        let absent = operation.grids.iter().filter(|g| g.path.is_none());
        let absent: Vec<String> = absent.map(|g| g.name.clone()).collect();
        if !absent.is_empty() {
            for name in absent {
                if !missing.contains(&name) {
                    missing.push(name);
                }
            }
            continue;
        }
        let grids = operation.grids.iter().map(|grid| GeoidGrid {
            name: grid.name.clone(),
            path: grid.path.clone().unwrap_or_default().into(),
        });
        let datum = VerticalDatum {
            name: found(),
            pipeline: pipeline.clone(),
            grids: grids.collect(),
            unit_m,
        };
        match datum.try_at(around) {
            Ok(()) => return Ok(datum),
            Err(why) => bad = bad.or(Some((datum, why))),
        }
    }
    Err(match bad {
        Some((datum, why)) => DatumError::BadGrid {
            found: found(),
            grid: datum
                .grids
                .first()
                .map_or_else(String::new, |g| g.path.display().to_string()),
            why,
        },
        None if missing.is_empty() => DatumError::NoWay { found: found() },
        None => DatumError::NoGrid {
            found: found(),
            grids: missing,
            folders: proj_3d::search_path(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A GTX grid (big-endian; NOAA's format as PROJ reads it): south, west, steps, rows, columns,
    /// then heights from the south row on.
    pub(crate) fn gtx(south: f64, west: f64, step: f64, rows: i32, columns: i32) -> Vec<u8> {
        let mut bytes = Vec::new();
        for number in [south, west, step, step] {
            bytes.extend(number.to_be_bytes());
        }
        bytes.extend(rows.to_be_bytes());
        bytes.extend(columns.to_be_bytes());
        for row in 0..rows {
            for column in 0..columns {
                let undulation = 30.0 + 0.5 * f64::from(row) - 2.0 * f64::from(column);
                #[expect(clippy::cast_possible_truncation, reason = "the format is single")]
                bytes.extend((undulation as f32).to_be_bytes());
            }
        }
        bytes
    }

    fn grid() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tiny.gtx");
        std::fs::write(&path, gtx(48.0, 8.0, 0.5, 5, 5)).unwrap();
        (folder, path)
    }

    #[test]
    fn a_grid_file_is_interpolated_both_ways() {
        let (_folder, path) = grid();
        let place = Geodetic::from_degrees(49.2, 8.9, 100.0);
        let datum = VerticalDatum::from_grid(&path, "tiny.gtx", place).unwrap();
        // Bilinear between the posts: row 2.4, column 1.8.
        let undulation = 30.0 + 0.5 * 2.4 - 2.0 * 1.8;
        let up = datum.to_ellipsoidal(place).unwrap();
        assert!((up.height_m - 100.0 - undulation).abs() < 1e-5, "{up:?}");
        assert_eq!((up.lat, up.lon), (place.lat, place.lon));
        assert!((datum.height_m(up).unwrap() - 100.0).abs() < 1e-9);
        assert_eq!(datum.grids()[0].path, path);
        let away = Geodetic::from_degrees(52.0, 8.9, 0.0);
        assert_eq!(
            datum.to_ellipsoidal(away).unwrap_err().to_string(),
            "found a place outside the grid of tiny.gtx, expected one within"
        );
    }

    #[test]
    fn a_grid_that_cannot_serve_is_said() {
        let (folder, path) = grid();
        let far = Geodetic::from_degrees(10.0, 8.9, 100.0);
        let error = VerticalDatum::from_grid(&path, "tiny.gtx", far).unwrap_err();
        let expected = format!(
            "found \"tiny.gtx\" with the grid {}, expected one that can be opened and reaches here \
             (it does not hold the site)",
            path.display()
        );
        assert_eq!(error.to_string(), expected);
        let none = folder.path().join("none.gtx");
        let error = VerticalDatum::from_grid(&none, "none.gtx", far).unwrap_err();
        assert!(matches!(error, DatumError::BadGrid { .. }), "{error}");
    }

    #[test]
    fn what_is_no_vertical_crs_is_said() {
        let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
        for (code, why) in [
            ("EPSG:32632", "(not a vertical one)"),
            ("EPSG:4326+5773", "(not a vertical one)"),
            ("EPSG:99999", "PROJ"),
        ] {
            let error = VerticalDatum::new(code, Planet::EARTH, here)
                .unwrap_err()
                .to_string();
            let start = format!(
                "found \"{code}\", expected a vertical coordinate reference system known to PROJ, \
                 such as EPSG:5773, or a geoid grid in GTX format"
            );
            assert!(error.starts_with(&start) && error.contains(why), "{error}");
        }
        assert_eq!(
            VerticalDatum::new("EPSG:5773", Planet::MARS, here)
                .unwrap_err()
                .to_string(),
            "found \"EPSG:5773\", expected one that PROJ can turn into heights above the ellipsoid \
             here"
        );
    }

    /// Where grids are installed the datum is there, else the grid is named; never a silent nothing.
    #[test]
    fn a_geoid_is_applied_or_its_grid_is_named() {
        let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
        match VerticalDatum::new("EPSG:5773", Planet::EARTH, here) {
            Ok(datum) => {
                let height_m = datum.to_ellipsoidal(here).unwrap().height_m;
                assert!((47.0..50.0).contains(&height_m), "{height_m}");
            }
            Err(error) => {
                let text = error.to_string();
                let start = "found \"EPSG:5773\" without its grid, expected one of \
                             us_nga_egm96_15.tif";
                assert!(
                    text.starts_with(start) && text.contains("PROJ_DATA"),
                    "{text}"
                );
            }
        }
    }
}
