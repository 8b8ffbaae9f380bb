//! Heights above a geoid or another vertical datum.

mod choice;

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use super::geoid::GeoidRaster;
use super::proj_3d::{self, Pipeline};
use super::{Geodetic, Planet};
use choice::{choose, vertical};

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
    way: Way,
    grids: Vec<GeoidGrid>,
    unit_m: f64,
}

/// How heights come above the ellipsoid.
#[derive(Debug, Clone, PartialEq)]
enum Way {
    /// By PROJ, as PROJ text.
    Pipeline(String),
    /// By the undulations of a raster.
    Raster(Arc<GeoidRaster>),
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
         EPSG:5773, or a geoid grid in GTX or GeoTIFF format ({why})"
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
    /// The grid is a GeoTIFF, which PROJ as it is built in does not read: see
    /// [`VerticalDatum::from_raster`].
    #[error("found {found:?} with the grid {} in GeoTIFF, expected one in GTX format", grid.path.display())]
    RasterGrid {
        /// What was given.
        found: String,
        /// The grid.
        grid: GeoidGrid,
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
            way: Way::Pipeline(pipeline),
            grids: vec![GeoidGrid {
                name: shown.to_owned(),
                path: path.to_owned(),
            }],
            unit_m: 1.0,
        };
        datum.try_at(around).map_err(|why| bad(&why))?;
        Ok(datum)
    }

    /// Heights above the geoid whose undulations a raster has, around a place.
    ///
    /// # Errors
    /// [`DatumError::BadGrid`] where the raster does not reach the place.
    pub fn from_raster(
        name: &str,
        grid: GeoidGrid,
        raster: GeoidRaster,
        around: Geodetic,
    ) -> Result<Self, DatumError> {
        if raster.undulation_m(around).is_none() {
            return Err(DatumError::BadGrid {
                found: name.to_owned(),
                grid: grid.path.display().to_string(),
                why: "it does not hold the site".to_owned(),
            });
        }
        Ok(Self {
            name: name.to_owned(),
            way: Way::Raster(Arc::new(raster)),
            grids: vec![grid],
            unit_m: 1.0,
        })
    }

    /// The code or file it was made from.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The grids it shifts by.
    pub fn grids(&self) -> &[GeoidGrid] {
        &self.grids
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
        let shifted = match &self.way {
            Way::Raster(raster) => raster
                .undulation_m(place)
                .map(|n| if back { height - n } else { height + n }),
            Way::Pipeline(text) => pipeline_of_this_thread(text)
                .and_then(|p| p.transform([place.lon_deg(), place.lat_deg(), height], back))
                .map(|[_, _, height]| height),
        };
        shifted.ok_or_else(|| DatumError::OutsideGrid {
            datum: self.name.clone(),
        })
    }

    /// Whether it serves at a place, or why not.
    fn try_at(&self, place: Geodetic) -> Result<(), String> {
        let reached = match &self.way {
            Way::Raster(raster) => raster.undulation_m(place),
            Way::Pipeline(text) => Pipeline::new(text)?
                .transform([place.lon_deg(), place.lat_deg(), 0.0], false)
                .map(|[_, _, height]| height),
        };
        reached
            .map(|_| ())
            .ok_or_else(|| "it does not hold the site".to_owned())
    }
}

fn pipeline_of_this_thread(text: &str) -> Option<Rc<Pipeline>> {
    PIPELINES.with_borrow_mut(|known| {
        if let Some(found) = known.get(text) {
            return found.clone();
        }
        let made = Pipeline::new(text).ok().map(Rc::new);
        known.insert(text.to_owned(), made.clone());
        made
    })
}
