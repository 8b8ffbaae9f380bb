//! The tangent plane everything is fused in, tied to its planet.

use nalgebra::{Matrix3, Vector3};

use super::{Direction, Ecef, Enu, Geodetic, LocalEnu, Planet, Point, RigidTransform, Rotation};

/// A site: a planet and the origin of the local east-north-up frame on it.
///
/// A site is as large as a tangent plane serves; [`Site::REACH_M`] bounds what may belong to it.
#[derive(Debug, Clone, Copy)]
pub struct Site {
    planet: Planet,
    origin: Geodetic,
    ecef_from_enu: RigidTransform<Ecef, Enu>,
}

impl Site {
    /// How far a pose may lie from the site's origin, metres.
    pub const REACH_M: f64 = 100_000.0;

    /// The site with its local frame at `origin`.
    pub fn new(planet: Planet, origin: Geodetic) -> Self {
        let translation = planet.ellipsoid.to_ecef(origin) - Point::<Ecef>::origin();
        Self {
            planet,
            origin,
            ecef_from_enu: RigidTransform::new(
                Rotation::from_matrix(enu_axes(origin)),
                translation,
            ),
        }
    }

    /// The planet.
    pub fn planet(&self) -> Planet {
        self.planet
    }

    /// The origin of the local frame.
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// The place in the site's ENU, metres.
    pub fn enu(&self, place: Geodetic) -> Point<Enu> {
        self.ecef_from_enu.inverse() * self.planet.ellipsoid.to_ecef(place)
    }

    /// Latitude, longitude and ellipsoidal height of a place in the site's ENU.
    pub fn geodetic(&self, place: Point<Enu>) -> Geodetic {
        self.planet
            .ellipsoid
            .to_geodetic(self.ecef_from_enu * place)
    }

    /// Height above the ellipsoid of a place in the site's ENU, metres.
    pub fn height_m(&self, place: Point<Enu>) -> f64 {
        self.geodetic(place).height_m
    }

    /// The vertical at `place`, the ellipsoid's normal, in the site's ENU.
    pub fn up(&self, place: Geodetic) -> Direction<Enu> {
        let (sin_lat, cos_lat) = place.lat.sin_cos();
        let (sin_lon, cos_lon) = place.lon.sin_cos();
        let up = Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
        self.ecef_from_enu.rotation.inverse() * Direction::<Ecef>::from_unit(up)
    }

    /// Turns the east-north-up axes at `place` into the site's.
    pub fn enu_from_local(&self, place: Geodetic) -> Rotation<Enu, LocalEnu> {
        let ecef_from_local = Rotation::<Ecef, LocalEnu>::from_matrix(enu_axes(place));
        self.ecef_from_enu.rotation.inverse() * ecef_from_local
    }
}

/// Columns: the unit vectors east, north, up at a place, in planet-centred axes.
fn enu_axes(place: Geodetic) -> Matrix3<f64> {
    let (sin_lat, cos_lat) = place.lat.sin_cos();
    let (sin_lon, cos_lon) = place.lon.sin_cos();
    Matrix3::new(
        -sin_lon,
        -sin_lat * cos_lon,
        cos_lat * cos_lon,
        cos_lon,
        -sin_lat * sin_lon,
        cos_lat * sin_lon,
        0.0,
        cos_lat,
        sin_lat,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vector;

    /// Values by pyproj (PROJ's `cart`): geodetic, ECEF and the ENU offsets of a second place.
    #[test]
    fn agrees_with_pyproj() {
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0));
        let ecef = Planet::EARTH.ellipsoid.to_ecef(site.origin());
        let expected = Point::<Ecef>::new(4_147_534.529_8, 612_454.614_4, 4_790_645.539_1);
        assert!(ecef.distance(expected) < 1e-4);
        let second = Geodetic::from_degrees(49.005_834_646_8, 8.406_683_338_1, 118.2);
        let enu = site.enu(second);
        assert!(enu.distance(Point::new(488.983_75, 648.903_39, 3.148_25)) < 1e-3);
    }

    #[test]
    fn round_trip_over_the_whole_reach() {
        let site = Site::new(
            Planet::EARTH,
            Geodetic::from_degrees(-24.45, -69.93, 1000.0),
        );
        for p in [
            Point::<Enu>::new(0.0, 0.0, 0.0),
            Point::new(70_000.0, -70_000.0, 900.0),
            Point::new(-12.5, 3e4, -40.0),
        ] {
            assert!(site.enu(site.geodetic(p)).distance(p) < 5e-9);
        }
    }

    #[test]
    fn local_axes_turn_with_longitude() {
        // Meridians converge: 0.01 rad of longitude at latitude 60 turns north by 0.01 sin 60.
        let site = Site::new(Planet::MOON, Geodetic::from_degrees(60.0, 0.0, 0.0));
        let mut place = site.origin();
        place.lon = 0.01;
        let north = site.enu_from_local(place) * Vector::<LocalEnu>::new(0.0, 1.0, 0.0);
        let azimuth = north.xyz.x.atan2(north.xyz.y);
        assert!((azimuth + 0.01 * 60f64.to_radians().sin()).abs() < 1e-6);
        let up = site.enu_from_local(place) * Vector::<LocalEnu>::new(0.0, 0.0, 1.0);
        assert!((site.up(place).xyz() - up.xyz).norm() < 1e-15);
    }
}
