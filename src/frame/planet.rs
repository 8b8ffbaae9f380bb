//! Planets: their ellipsoids, and what their latitudes and longitudes mean in files.

use std::collections::BTreeSet;
use std::sync::Mutex;

use super::definition::Definition;
use super::{Ellipsoid, Geodetic};

/// A planet or moon: its ellipsoid and the coordinate reference system its maps are in.
///
/// Inside the program latitudes are geodetic and longitudes grow eastwards on every planet. Files
/// have them as the planet's coordinate reference system does: [`Planet::place`] and
/// [`Planet::lat_lon_deg`] are the way in and out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planet {
    /// Lower-case English name, as `[site] body` gives it, or the code of its CRS.
    pub name: &'static str,
    /// Its ellipsoid.
    pub ellipsoid: Ellipsoid,
    /// Authority and code of its geographic CRS, as PROJ knows it.
    pub crs: &'static str,
    /// The CRS of geodetic latitudes and eastward longitudes on its ellipsoid, for PROJ.
    pub(super) longlat: &'static str,
    /// Whether latitudes in files are angles at the planet's centre.
    is_ocentric: bool,
    /// Whether longitudes in files grow westwards.
    is_west_positive: bool,
}

impl Planet {
    /// Earth, WGS84.
    pub const EARTH: Self = Self::with_geodetic("earth", Ellipsoid::WGS84, "EPSG:4326");
    /// The Moon: sphere of the IAU 2015 report, planetocentric latitude, east positive.
    pub const MOON: Self =
        Self::with_geodetic("moon", Ellipsoid::sphere(1_737_400.0), "IAU_2015:30100");
    /// Mars: sphere of the IAU 2015 report, planetocentric latitude, east positive.
    pub const MARS: Self =
        Self::with_geodetic("mars", Ellipsoid::sphere(3_396_190.0), "IAU_2015:49900");

    /// All planets known by name.
    pub const ALL: [Self; 3] = [Self::EARTH, Self::MOON, Self::MARS];

    /// A planet whose files have geodetic latitudes and eastward longitudes, as is.
    const fn with_geodetic(name: &'static str, ellipsoid: Ellipsoid, crs: &'static str) -> Self {
        Self {
            name,
            ellipsoid,
            crs,
            longlat: crs,
            is_ocentric: false,
            is_west_positive: false,
        }
    }

    /// The planet of a name (`earth`, `moon`, `mars`), or of the code of a geographic CRS of the
    /// IAU's 2015 report that PROJ knows, such as `IAU_2015:49902`; `None` for anything else, and
    /// for bodies that are no ellipsoids of revolution.
    ///
    /// Codes of the IAU end in 00 for a sphere, 01 for planetographic latitudes (with longitudes
    /// that grow against the body's rotation) and 02 for planetocentric ones on the ellipsoid.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|p| p.name.eq_ignore_ascii_case(name) || p.crs.eq_ignore_ascii_case(name))
            .or_else(|| Self::of_iau_code(name))
    }

    fn of_iau_code(name: &str) -> Option<Self> {
        let code = name.to_ascii_uppercase();
        let digits = code.strip_prefix("IAU_2015:")?;
        if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        let definition = Definition::of(&code).ok()?;
        if !definition.is_geodetic() {
            return None;
        }
        let ellipsoid = definition.ellipsoid()?;
        let crs = kept(code);
        let is_ocentric = definition.is_ocentric() && ellipsoid.f != 0.0;
        let is_west_positive = definition.is_west_positive();
        let longlat = if definition.is_ocentric() || is_west_positive {
            let b = ellipsoid.a * (1.0 - ellipsoid.f);
            kept(format!(
                "+proj=longlat +a={} +b={b} +no_defs +type=crs",
                ellipsoid.a
            ))
        } else {
            crs
        };
        Some(Self {
            name: crs,
            ellipsoid,
            crs,
            longlat,
            is_ocentric,
            is_west_positive,
        })
    }

    /// Whether this is Earth, whose maps are WGS84.
    pub fn is_earth(&self) -> bool {
        self.name == "earth"
    }

    /// The same, with longitudes that grow eastwards in files too: GeoJSON's own convention, which
    /// GDAL keeps whatever the coordinate reference system says.
    #[must_use]
    pub fn eastward(self) -> Self {
        Self {
            is_west_positive: false,
            ..self
        }
    }

    /// Whether latitudes and longitudes in its files are as inside the program: geodetic, and
    /// eastward.
    pub fn is_plain(&self) -> bool {
        !self.is_ocentric && !self.is_west_positive
    }

    /// The place of a latitude and longitude as this planet's files have them, degrees, and a
    /// height above the ellipsoid, metres.
    pub fn place(&self, lat_deg: f64, lon_deg: f64, height_m: f64) -> Geodetic {
        let mut place = Geodetic::from_degrees(lat_deg, lon_deg, height_m);
        if self.is_ocentric {
            let (sin, cos) = place.lat.sin_cos();
            place.lat = sin.atan2(cos * self.squared_axes_ratio());
        }
        if self.is_west_positive {
            place.lon = -place.lon;
        }
        place
    }

    /// Latitude and longitude of a place as this planet's files have them, degrees; the longitude in
    /// [-180, 180].
    pub fn lat_lon_deg(&self, place: Geodetic) -> (f64, f64) {
        let mut lat = place.lat;
        if self.is_ocentric {
            let (sin, cos) = lat.sin_cos();
            lat = (sin * self.squared_axes_ratio()).atan2(cos);
        }
        let lon_deg = place.lon_deg();
        let sign = if self.is_west_positive { -1.0 } else { 1.0 };
        (lat.to_degrees(), sign * lon_deg)
    }

    /// `tan(ocentric) = (b / a)^2 tan(geodetic)` for a place on the ellipsoid (Snyder 1987, eq. 3-28).
    fn squared_axes_ratio(&self) -> f64 {
        (1.0 - self.ellipsoid.f).powi(2)
    }
}

/// The text, kept for good. There are as many as codes named in a run.
fn kept(text: String) -> &'static str {
    static KEPT: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut kept = KEPT
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(&known) = kept.get(text.as_str()) {
        return known;
    }
    let text: &'static str = Box::leak(text.into_boxed_str());
    kept.insert(text);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Crs;

    #[test]
    fn planets_are_found_by_name_and_code() {
        assert_eq!(Planet::named("Mars"), Some(Planet::MARS));
        assert_eq!(Planet::named("IAU_2015:30100"), Some(Planet::MOON));
        assert_eq!(Planet::named("pluto"), None);
        assert_eq!(Planet::named("IAU_2015:49910"), None, "a map, no planet");
        assert_eq!(Planet::named("IAU_2015:"), None);
        assert_eq!(Planet::named("IAU_2015:1234567"), None);
        let europa = Planet::named("iau_2015:50200").unwrap();
        assert_eq!(europa.crs, "IAU_2015:50200");
        assert!(europa.ellipsoid.f == 0.0 && (europa.ellipsoid.a - 1_560_800.0).abs() < 1e-6);
        assert!(!europa.is_earth());
        assert_eq!(Planet::named("IAU_2015:50200"), Some(europa));
    }

    /// Against PROJ, which knows what the codes mean.
    #[test]
    fn files_have_latitudes_and_longitudes_as_the_code_says() {
        for (code, sign) in [("IAU_2015:49901", -1.0), ("IAU_2015:49902", 1.0)] {
            let planet = Planet::named(code).unwrap();
            let place = planet.place(-30.0, 100.0, 12.0);
            assert!((place.lon_deg() - sign * 100.0).abs() < 1e-12);
            let own = Crs::new(code, planet).unwrap();
            let (x, y) = own.xy(place.lon, place.lat).unwrap();
            let (lat_deg, lon_deg) = planet.lat_lon_deg(place);
            assert!((lat_deg + 30.0).abs() < 1e-12 && (lon_deg - 100.0).abs() < 1e-12);
            assert!((x - lon_deg).abs() < 1e-9, "{code} {x}");
            assert!((y - lat_deg).abs() < 1e-9, "{code} {y}");
        }
        // By hand: tan(29.70794) = (1 - 1/169.894)^2 tan(30).
        let ographic = Planet::named("IAU_2015:49901").unwrap();
        let ocentric = Planet::named("IAU_2015:49902").unwrap();
        let (lat_deg, _) = ocentric.lat_lon_deg(ographic.place(30.0, 0.0, 0.0));
        assert!((lat_deg - 29.707_94).abs() < 1e-5, "{lat_deg}");
        let pole = ocentric.place(90.0, 0.0, 0.0);
        assert!((pole.lat_deg() - 90.0).abs() < 1e-12);
    }
}
