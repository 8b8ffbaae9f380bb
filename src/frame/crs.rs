//! Coordinate reference systems, by PROJ.

use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::rc::Rc;

use proj::Proj;

use super::definition::Definition;
use super::{Ellipsoid, Geodetic, Planet};

/// A two-dimensional coordinate reference system known to PROJ, over a planet's geographic one.
///
/// PROJ's objects belong to one thread; this type is only the definition, and every thread keeps
/// its own converter, so it can be shared freely.
#[derive(Debug, Clone, PartialEq)]
pub struct Crs {
    definition: String,
    /// What PROJ is asked for.
    asked: String,
    geographic: &'static str,
    planet: Ellipsoid,
    /// Its own latitudes are geodetic on an ellipsoid of this flattening; `None` where they are the
    /// planet's.
    own_flattening: Option<f64>,
    is_projected: bool,
    /// Its longitudes grow westwards. PROJ does not put such axes in order, nor planetocentric ones,
    /// and is asked for geodetic latitudes and eastward longitudes instead.
    is_westward: bool,
    /// Its latitudes are planetocentric, on an ellipsoid of this flattening.
    ocentric: Option<f64>,
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
    /// A system of another body.
    #[error(
        "found {found:?} ({own}, of {radius_km:.1} km), expected one of {body}, of {body_km:.1} km"
    )]
    OtherBody {
        /// What was given.
        found: String,
        /// Its name.
        own: String,
        /// The radius of its body's equator, kilometres.
        radius_km: f64,
        /// The body it is to be of.
        body: &'static str,
        /// The radius of that body's equator, kilometres.
        body_km: f64,
    },
    /// Not one that places of a map are written in.
    #[error(
        "found {found:?} ({own}), expected a map projection, or latitudes and eastward longitudes, \
         without heights"
    )]
    NotHorizontal {
        /// What was given.
        found: String,
        /// Its name.
        own: String,
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
        let parts = Definition::of(definition)?;
        if let Some(own) = parts.ellipsoid()
            && !is_of_size(own, planet.ellipsoid)
        {
            return Err(CrsError::OtherBody {
                found: definition.to_owned(),
                own: parts.name().to_owned(),
                radius_km: own.a / 1000.0,
                body: planet.name,
                body_km: planet.ellipsoid.a / 1000.0,
            });
        }
        // On other bodies maps on a sphere and on an ellipsoid stand side by side, and PROJ takes the
        // latitude of the one for that of the other. On Earth it knows the ways between datums.
        let flattening = parts.ellipsoid().map(|ellipsoid| ellipsoid.f);
        let own =
            flattening.filter(|f| !planet.is_earth() && (f - planet.ellipsoid.f).abs() > 1e-7);
        let is_westward = parts.is_geodetic() && parts.is_west_positive();
        let is_ocentric = parts.is_geodetic() && parts.is_ocentric();
        let ocentric = flattening.filter(|_| is_ocentric);
        let asked = match parts.ellipsoid().filter(|_| is_westward || is_ocentric) {
            Some(Ellipsoid { a, f }) => {
                format!(
                    "+proj=longlat +a={a} +b={} +no_defs +type=crs",
                    a * (1.0 - f)
                )
            }
            None => definition.to_owned(),
        };
        let crs = Self {
            definition: definition.to_owned(),
            geographic: planet.longlat,
            planet: planet.ellipsoid,
            own_flattening: own,
            is_projected: parts.is_projected(),
            is_westward,
            ocentric,
            key: format!("{} {asked}", planet.longlat),
            asked,
        };
        crs.converter()?;
        Ok(crs)
    }

    /// The system of a definition, where places of a map can be written in it: two-dimensional, either
    /// projected or with latitudes and eastward longitudes.
    ///
    /// # Errors
    /// As [`Crs::new`], and [`CrsError::NotHorizontal`].
    pub fn for_map(definition: &str, planet: Planet) -> Result<Self, CrsError> {
        let parts = Definition::of(definition)?;
        if !parts.is_horizontal() || (parts.is_geodetic() && parts.is_west_positive()) {
            return Err(CrsError::NotHorizontal {
                found: definition.to_owned(),
                own: parts.name().to_owned(),
            });
        }
        Self::new(definition, planet)
    }

    /// Whether a definition is one that PROJ understands, on whatever planet.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where it is not.
    pub fn check(definition: &str) -> Result<(), CrsError> {
        Definition::of(definition).map(|_| ())
    }

    /// Whether its coordinates are on a map, rather than longitudes and latitudes.
    pub fn is_projected(&self) -> bool {
        self.is_projected
    }

    /// The meridian convergence at a place: the azimuth of grid north, the way of growing northings,
    /// radians clockwise from true north. It is positive where grid north lies east of true north.
    ///
    /// # Errors
    /// [`CrsError::OutsideDomain`] where the projection does not reach.
    pub fn convergence(&self, place: Geodetic) -> Result<f64, CrsError> {
        // Long enough for rounding, short enough for the map's own bend, which cancels.
        const STEP: f64 = 1.0;
        let (x, y) = self.xy(place.lon, place.lat)?;
        let ((lon_0, lat_0), (lon_1, lat_1)) =
            (self.lon_lat(x, y - STEP)?, self.lon_lat(x, y + STEP)?);
        let lon = (lon_1 - lon_0 + PI).rem_euclid(2.0 * PI) - PI;
        let [across, meridian] = self.planet.radii(place.lat);
        let east_m = lon * across * place.lat.cos();
        let north_m = (lat_1 - lat_0) * meridian;
        Ok(east_m.atan2(north_m))
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
        let (east, north) = self.turned(x, y, |lat, f| geodetic_latitude(lat, 0.0, f));
        let (lon, lat) = self
            .converter()?
            .project((east, north), true)
            .map_err(|_| outside())?;
        let lat = self
            .own_flattening
            .map_or(lat, |own| geodetic_latitude(lat, own, self.planet.f));
        finite(lon, lat).ok_or_else(outside)
    }

    /// Planar coordinates of a longitude and latitude, radians.
    ///
    /// # Errors
    /// [`CrsError::OutsideDomain`] where the projection does not reach.
    pub fn xy(&self, lon: f64, lat: f64) -> Result<(f64, f64), CrsError> {
        let outside = || self.outside(lon.to_degrees(), lat.to_degrees());
        let lat = self
            .own_flattening
            .map_or(lat, |own| geodetic_latitude(lat, self.planet.f, own));
        let (x, y) = self
            .converter()?
            .project((lon, lat), false)
            .map_err(|_| outside())?;
        let (x, y) = self.turned(x, y, |lat, f| geodetic_latitude(lat, f, 0.0));
        finite(x, y).ok_or_else(outside)
    }

    /// Degrees between the axes of this CRS and those PROJ is asked for.
    fn turned(&self, x: f64, y: f64, latitude: impl Fn(f64, f64) -> f64) -> (f64, f64) {
        let x = if self.is_westward { -x } else { x };
        let y = self
            .ocentric
            .map_or(y, |f| latitude(y.to_radians(), f).to_degrees());
        (x, y)
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
                Proj::new_known_crs(self.geographic, &self.asked, None).map_err(|error| {
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

/// The geodetic latitude on the ellipsoid of another flattening that has the same angle at the centre.
fn geodetic_latitude(lat: f64, from: f64, to: f64) -> f64 {
    let (sin, cos) = lat.sin_cos();
    (sin * (1.0 - from).powi(2)).atan2(cos * (1.0 - to).powi(2))
}

/// Whether an ellipsoid is of a body's size: datums of one body differ by less than a hundredth, and so do
/// spheres of its equatorial and of its polar radius from either.
fn is_of_size(own: Ellipsoid, body: Ellipsoid) -> bool {
    let polar = body.a * (1.0 - body.f);
    [body.a, polar]
        .into_iter()
        .any(|radius| (own.a / radius - 1.0).abs() < 0.01)
}

fn finite(x: f64, y: f64) -> Option<(f64, f64)> {
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

#[cfg(test)]
mod tests;
