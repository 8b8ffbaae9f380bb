//! Coordinate reference systems, by PROJ.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use proj::Proj;

use super::Planet;

/// A two-dimensional coordinate reference system known to PROJ, over a planet's geographic one.
///
/// PROJ's objects belong to one thread; this type is only the definition, and every thread keeps
/// its own converter, so it can be shared freely.
#[derive(Debug, Clone, PartialEq)]
pub struct Crs {
    definition: String,
    geographic: &'static str,
    /// What this thread's converter is kept under.
    key: String,
}

/// A definition PROJ does not know, or a place it cannot convert.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CrsError {
    /// No such CRS.
    #[error(
        "found {found:?}, expected a coordinate reference system known to PROJ, such as EPSG:32719 ({why})"
    )]
    Unknown {
        /// The definition given.
        found: String,
        /// What PROJ said.
        why: String,
    },
    /// A place outside the CRS's domain.
    #[error("({x}, {y}) lies outside the domain of {crs}")]
    OutsideDomain {
        /// First coordinate given.
        x: f64,
        /// Second coordinate given.
        y: f64,
        /// The CRS's definition.
        crs: String,
    },
}

thread_local! {
    static CONVERTERS: RefCell<HashMap<String, Rc<Proj>>> = RefCell::default();
}

impl Crs {
    /// The CRS of a definition PROJ understands: `AUTHORITY:CODE`, WKT, PROJ string.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ cannot relate it to the planet's geographic CRS.
    pub fn new(definition: &str, planet: Planet) -> Result<Self, CrsError> {
        let crs = Self {
            definition: definition.to_owned(),
            geographic: planet.crs,
            key: format!("{} {definition}", planet.crs),
        };
        crs.converter()?;
        Ok(crs)
    }

    /// The definition it was made from.
    pub fn definition(&self) -> &str {
        &self.definition
    }

    /// Longitude and latitude, radians, of planar (or, for a geographic CRS, degree) coordinates.
    ///
    /// # Errors
    /// [`CrsError::OutsideDomain`] where the projection has no such place.
    pub fn lon_lat(&self, x: f64, y: f64) -> Result<(f64, f64), CrsError> {
        let outside = || self.outside(x, y);
        let (lon, lat) = self
            .converter()?
            .project((x, y), true)
            .map_err(|_| outside())?;
        finite(lon, lat).ok_or_else(outside)
    }

    /// Planar coordinates of a longitude and latitude, radians.
    ///
    /// # Errors
    /// [`CrsError::OutsideDomain`] where the projection does not reach.
    pub fn xy(&self, lon: f64, lat: f64) -> Result<(f64, f64), CrsError> {
        let outside = || self.outside(lon.to_degrees(), lat.to_degrees());
        let (x, y) = self
            .converter()?
            .project((lon, lat), false)
            .map_err(|_| outside())?;
        finite(x, y).ok_or_else(outside)
    }

    fn outside(&self, x: f64, y: f64) -> CrsError {
        CrsError::OutsideDomain {
            x,
            y,
            crs: self.definition.clone(),
        }
    }

    fn converter(&self) -> Result<Converter, CrsError> {
        CONVERTERS.with_borrow_mut(|known| {
            if let Some(found) = known.get(&self.key) {
                return Ok(Converter(Rc::clone(found)));
            }
            let made =
                Proj::new_known_crs(self.geographic, &self.definition, None).map_err(|error| {
                    CrsError::Unknown {
                        found: self.definition.clone(),
                        why: error.to_string(),
                    }
                })?;
            let made = Rc::new(made);
            known.insert(self.key.clone(), Rc::clone(&made));
            Ok(Converter(made))
        })
    }
}

/// One thread's converter from the geographic CRS (longitude, latitude) to the other.
struct Converter(Rc<Proj>);

impl Converter {
    /// Forward takes and inverse gives radians; PROJ itself speaks degrees here, because it puts
    /// both ends in the order and unit of a map display.
    fn project(&self, point: (f64, f64), inverse: bool) -> Result<(f64, f64), proj::ProjError> {
        if inverse {
            let (lon, lat) = self.0.project(point, true)?;
            return Ok((lon.to_radians(), lat.to_radians()));
        }
        self.0
            .project((point.0.to_degrees(), point.1.to_degrees()), false)
    }
}

fn finite(x: f64, y: f64) -> Option<(f64, f64)> {
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value by pyproj.
    #[test]
    fn utm_agrees_with_pyproj_both_ways() {
        let utm = Crs::new("EPSG:32632", Planet::EARTH).unwrap();
        let (lon, lat) = (8.4f64.to_radians(), 49f64.to_radians());
        let (x, y) = utm.xy(lon, lat).unwrap();
        assert!((x - 456_114.595_9).abs() < 1e-3 && (y - 5_427_629.203_9).abs() < 1e-3);
        let (lon2, lat2) = utm.lon_lat(x, y).unwrap();
        assert!((lon - lon2).abs() < 1e-12 && (lat - lat2).abs() < 1e-12);
    }

    #[test]
    fn a_geographic_crs_gives_degrees() {
        let crs = Crs::new("EPSG:4326", Planet::EARTH).unwrap();
        let (x, y) = crs.xy(0.1, 0.2).unwrap();
        assert!((x - 0.1f64.to_degrees()).abs() < 1e-9 && (y - 0.2f64.to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn mars_has_its_own() {
        let crs = Crs::new("IAU_2015:49910", Planet::MARS).unwrap();
        let (x, _) = crs.xy(0.01, 0.0).unwrap();
        assert!((x - 33_961.9).abs() < 1e-3);
    }

    #[test]
    fn unknown_ones_are_named() {
        let error = Crs::new("EPSG:999999", Planet::EARTH).unwrap_err();
        assert!(error.to_string().starts_with(
            "found \"EPSG:999999\", expected a coordinate reference system known to PROJ"
        ));
    }
}
