//! The surface of constant height above the ellipsoid.
//!
//! Along a straight line the height above a convex body is a convex function, so Newton's method
//! from a point above the surface approaches the first crossing from its own side and never steps
//! over it.

use crate::frame::{Enu, Ray, Site};

/// Where a Newton step stops, metres along the ray.
const STEP_M: f64 = 1e-9;

/// Height above the ellipsoid at `t` metres along a ray, and how it grows there, metres a metre.
pub(super) fn height_along(site: &Site, ray: Ray<Enu>, t: f64) -> (f64, f64) {
    let place = site.geodetic(ray.at(t));
    (
        place.height_m,
        site.up(place).xyz().dot(&ray.direction.xyz()),
    )
}

/// The first distance along a ray, from `from` on, at which it is not above a height; `None` where
/// it stays above for good.
pub(super) fn first_not_above(site: &Site, ray: Ray<Enu>, height_m: f64, from: f64) -> Option<f64> {
    let mut t = from;
    // A tangent ray converges linearly, halving its error: 100 steps exhaust a double.
    for _ in 0..100 {
        let (h, slope) = height_along(site, ray, t);
        let above = h - height_m;
        if above <= 0.0 {
            return Some(t);
        }
        if slope >= 0.0 {
            return None;
        }
        let step = above / -slope;
        t += step;
        if step < STEP_M {
            return Some(t);
        }
        if !t.is_finite() {
            return None;
        }
    }
    Some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Direction, Ellipsoid, Geodetic, Planet, Point};
    use nalgebra::Vector3;

    fn ray(origin: [f64; 3], azimuth_deg: f64, down_deg: f64) -> Ray<Enu> {
        let (sa, ca) = azimuth_deg.to_radians().sin_cos();
        let (sd, cd) = down_deg.to_radians().sin_cos();
        Ray {
            origin: Point::from_xyz(Vector3::from(origin)),
            direction: Direction::from_unit(Vector3::new(sa * cd, ca * cd, -sd)),
        }
    }

    /// On a sphere the hit is the near root of a quadratic.
    #[test]
    fn on_a_sphere_the_closed_form_holds() {
        let site = Site::new(Planet::MOON, Geodetic::from_degrees(-45.0, 12.0, 500.0));
        let radius = 1_737_400.0 + 480.0;
        for (up, down_deg) in [
            (1.5, 1.0),
            (1.5, 0.5),
            (800.0, 30.0),
            (60_000.0, 16.0),
            (3.0, 90.0),
        ] {
            let ray = ray([300.0, -4000.0, up], 77.0, down_deg);
            let centre = Vector3::new(0.0, 0.0, -(1_737_400.0 + 500.0));
            let m = ray.origin.xyz - centre;
            let b = m.dot(&ray.direction.xyz());
            let c = m.norm_squared() - radius * radius;
            let expected = -b - (b * b - c).sqrt();
            let found = first_not_above(&site, ray, 480.0, 0.0).unwrap();
            assert!(
                (found - expected).abs() < 1e-6,
                "{down_deg}: {found} {expected}"
            );
        }
    }

    /// On an ellipsoid itself (height 0) the hit is the near root of a quadratic in scaled axes.
    #[test]
    fn on_the_ellipsoid_the_closed_form_holds() {
        let mut oblate = Planet::EARTH;
        oblate.ellipsoid = Ellipsoid { a: 6.0e6, f: 0.05 };
        for planet in [Planet::EARTH, oblate] {
            let site = Site::new(planet, Geodetic::from_degrees(38.0, -100.0, 20.0));
            let b = planet.ellipsoid.a * (1.0 - planet.ellipsoid.f);
            let scale = Vector3::new(1.0 / planet.ellipsoid.a, 1.0 / planet.ellipsoid.a, 1.0 / b);
            for down_deg in [0.2, 1.0, 25.0, 89.0] {
                let ray = ray([5000.0, 900.0, 3.0], 200.0, down_deg);
                let ecef = |t| planet.ellipsoid.to_ecef(site.geodetic(ray.at(t))).xyz;
                // The direction from two far points: the line is straight in any frame.
                let direction = (ecef(1e5) - ecef(0.0)) / 1e5;
                let (o, d) = (
                    ecef(0.0).component_mul(&scale),
                    direction.component_mul(&scale),
                );
                let (qa, qb, qc) = (d.dot(&d), o.dot(&d), o.dot(&o) - 1.0);
                let expected = qc / (-qb + (qb * qb - qa * qc).sqrt());
                let found = first_not_above(&site, ray, 0.0, 0.0).unwrap();
                assert!(
                    (found - expected).abs() < 2e-6,
                    "{down_deg}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn over_the_horizon_there_is_no_ground() {
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0));
        // The horizon's dip from 2 m is sqrt(2 h / R) = 0.0454 degrees.
        let dip =
            |down_deg| first_not_above(&site, ray([0.0, 0.0, 2.0], 10.0, down_deg), 115.0, 0.0);
        assert!(dip(0.044).is_none());
        let at = dip(0.047).unwrap();
        assert!(at > 3000.0 && at < 5100.0);
        assert!(dip(-5.0).is_none());
    }

    #[test]
    fn the_tangent_plane_is_31_metres_off_at_20_kilometres() {
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(0.0, 0.0, 0.0));
        let t = first_not_above(&site, ray([0.0, 20_000.0, 10.0], 0.0, 90.0), 0.0, 0.0).unwrap();
        assert!((t - 10.0 - 31.57).abs() < 0.05, "{t}");
    }
}
