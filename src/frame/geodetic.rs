//! Planets as ellipsoids, and places on them.

use std::f64::consts::FRAC_PI_2;

use super::{Ecef, Point};

/// A place by latitude, longitude and height above the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// Geodetic latitude (planetocentric on a sphere), radians, north positive.
    pub lat: f64,
    /// Longitude, radians, east positive.
    pub lon: f64,
    /// Height above the ellipsoid, metres.
    pub height_m: f64,
}

impl Geodetic {
    /// From degrees and metres, as files give them.
    pub fn from_degrees(lat_deg: f64, lon_deg: f64, height_m: f64) -> Self {
        Self {
            lat: lat_deg.to_radians(),
            lon: lon_deg.to_radians(),
            height_m,
        }
    }

    /// Latitude, degrees.
    pub fn lat_deg(&self) -> f64 {
        self.lat.to_degrees()
    }

    /// Longitude, degrees in [-180, 180].
    pub fn lon_deg(&self) -> f64 {
        let lon = self.lon.to_degrees();
        if (-180.0..=180.0).contains(&lon) {
            lon
        } else {
            (lon + 180.0).rem_euclid(360.0) - 180.0
        }
    }
}

/// An ellipsoid of revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// Equatorial radius, metres.
    pub a: f64,
    /// Flattening, 0 for a sphere.
    pub f: f64,
}

impl Ellipsoid {
    /// WGS84.
    pub const WGS84: Self = Self {
        a: 6_378_137.0,
        f: 1.0 / 298.257_223_563,
    };

    /// A sphere of this radius, metres.
    pub const fn sphere(radius: f64) -> Self {
        Self { a: radius, f: 0.0 }
    }

    /// The square of the first eccentricity.
    fn e2(&self) -> f64 {
        self.f * (2.0 - self.f)
    }

    /// Radii of curvature at a latitude, metres: across the meridian and along it (Snyder 1987,
    /// eqs. 4-18 to 4-20).
    pub fn radii(&self, lat: f64) -> [f64; 2] {
        let w2 = 1.0 - self.e2() * lat.sin().powi(2);
        let across = self.a / w2.sqrt();
        [across, across * (1.0 - self.e2()) / w2]
    }

    /// Planet-centred place of a geodetic one; closed form.
    pub fn to_ecef(&self, g: Geodetic) -> Point<Ecef> {
        let (sin_lat, cos_lat) = g.lat.sin_cos();
        let (sin_lon, cos_lon) = g.lon.sin_cos();
        let e2 = self.e2();
        let n = self.a / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        let p = (n + g.height_m) * cos_lat;
        Point::new(
            p * cos_lon,
            p * sin_lon,
            (n * (1.0 - e2) + g.height_m) * sin_lat,
        )
    }

    /// Geodetic place of a planet-centred one.
    ///
    /// Bowring's formula (Survey Review 23, 1976) with two refinements of the parametric latitude:
    /// under 1e-9 m from the centre's third part to ten thousand kilometres up.
    pub fn to_geodetic(&self, ecef: Point<Ecef>) -> Geodetic {
        let (x, y, z) = (ecef.xyz.x, ecef.xyz.y, ecef.xyz.z);
        // Lengths of a planet's size neither overflow nor vanish: no need for a careful hypotenuse.
        let p = (x * x + y * y).sqrt();
        let e2 = self.e2();
        let b = self.a * (1.0 - self.f);
        let ep2 = e2 / (1.0 - e2);
        // Tangent of the parametric latitude as a (sine, cosine) pair: no trouble at the poles.
        let (mut sb, mut cb) = unit(z, (1.0 - self.f) * p);
        let (mut sl, mut cl) = (sb, cb);
        for _ in 0..3 {
            (sl, cl) = unit(z + ep2 * b * sb * sb * sb, p - e2 * self.a * cb * cb * cb);
            (sb, cb) = unit((1.0 - self.f) * sl, cl);
        }
        Geodetic {
            lat: sl.atan2(cl).clamp(-FRAC_PI_2, FRAC_PI_2),
            lon: if p > 0.0 { y.atan2(x) } else { 0.0 },
            height_m: p * cl + z * sl - self.a * (1.0 - e2 * sl * sl).sqrt(),
        }
    }
}

/// `(s, c)` scaled to length one; (0, 1) where both vanish.
fn unit(s: f64, c: f64) -> (f64, f64) {
    let norm = (s * s + c * c).sqrt();
    if norm > 0.0 {
        (s / norm, c / norm)
    } else {
        (0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Planet;

    #[test]
    fn round_trip_at_all_latitudes_and_heights() {
        for planet in Planet::ALL {
            for lat in [-90.0, -89.999_999, -45.0, -1e-7, 0.0, 12.3, 89.9, 90.0] {
                for height in [-5_000.0, 0.0, 8_000.0, 400_000.0] {
                    let g = Geodetic::from_degrees(lat, -123.4, height);
                    let ecef = planet.ellipsoid.to_ecef(g);
                    let back = planet.ellipsoid.to_geodetic(ecef);
                    assert!((back.height_m - height).abs() < 5e-9, "{lat} {height}");
                    assert!((back.lat - g.lat).abs() < 2e-15, "{lat} {height}");
                    assert!(planet.ellipsoid.to_ecef(back).distance(ecef) < 5e-9);
                }
            }
        }
    }
}
