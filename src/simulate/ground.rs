//! The true ground of a scene, and the model of it that the run is given.

use crate::frame::{Enu, Point, Ray, Site};

use super::noise::SmoothSurface;
use super::random::{Purpose, key};
use super::scene::{GroundPlan, TerrainModel};

/// The true ground: a surface of constant height, sloped and roughened as the scene says.
#[derive(Debug, Clone, Copy)]
pub struct Ground {
    base_m: f64,
    origin_m: f64,
    slope: [f64; 2],
    rough: SmoothSurface,
    model_error: SmoothSurface,
    model_follows: bool,
    /// How far the ellipsoid falls below the tangent plane, by the squares of east and north.
    curvature: [f64; 2],
}

impl Ground {
    /// The ground of a plan at a site.
    pub(super) fn new(site: &Site, plan: &GroundPlan, seed: u64) -> Self {
        let origin_m = site.origin().height_m;
        let fall = |east, north| {
            (site.height_m(Point::new(east, north, 0.0)) - origin_m) / 1e6 // at 1000 m
        };
        let (sin, cos) = plan.slope_azimuth.sin_cos();
        let rise = plan.slope.tan();
        let (error_m, error_length_m) = match plan.model {
            TerrainModel::Plane => (0.0, 1.0),
            TerrainModel::Raster {
                error_m,
                error_length_m,
                ..
            } => (error_m, error_length_m),
        };
        Self {
            base_m: plan.height_m,
            origin_m,
            slope: [rise * sin, rise * cos],
            rough: SmoothSurface::new(
                key(seed, Purpose::Ground),
                plan.roughness_m,
                plan.roughness_length_m,
            ),
            model_error: SmoothSurface::new(
                key(seed, Purpose::TerrainModel),
                error_m,
                error_length_m,
            ),
            model_follows: matches!(plan.model, TerrainModel::Raster { .. }),
            curvature: [fall(1000.0, 0.0), fall(0.0, 1000.0)],
        }
    }

    /// The true height, metres above the ellipsoid, `east_m` and `north_m` from the origin.
    pub fn height_m(&self, east_m: f64, north_m: f64) -> f64 {
        self.base_m
            + self.slope[0] * east_m
            + self.slope[1] * north_m
            + self.rough.height_m(east_m, north_m)
    }

    /// The height the model of the run gives there: with its error, or the surface of constant
    /// height where the run is given nothing better.
    pub fn model_height_m(&self, east_m: f64, north_m: f64) -> f64 {
        if self.model_follows {
            self.height_m(east_m, north_m) + self.model_error.height_m(east_m, north_m)
        } else {
            self.base_m
        }
    }

    /// The point of the true ground, in ENU.
    pub fn point(&self, east_m: f64, north_m: f64) -> Point<Enu> {
        Point::new(east_m, north_m, self.up_m(east_m, north_m))
    }

    /// The true ground's height above the tangent plane, metres.
    pub(super) fn up_m(&self, east_m: f64, north_m: f64) -> f64 {
        self.height_m(east_m, north_m)
            - self.origin_m
            - self.curvature[0] * east_m * east_m
            - self.curvature[1] * north_m * north_m
    }

    /// The true ground's slope by east and north, metres a metre.
    pub fn slope_at(&self, east_m: f64, north_m: f64) -> [f64; 2] {
        self.up_and_slope(east_m, north_m).1
    }

    /// The distance along a ray at which it first meets the true ground, metres; `None` where it
    /// does not within `reach_m`, or starts below the ground.
    ///
    /// Sphere tracing, from where the ray comes as low as the ground can be high, against a slope
    /// that the ground seldom exceeds. Where it does, a step may end below the ground, and bisection
    /// finds the place; what might be missed is the tip of a crest that a grazing ray just touches.
    /// Newton's method ends the search.
    pub(super) fn first_hit_m(&self, ray: Ray<Enu>, reach_m: f64) -> Option<f64> {
        let above = |t: f64| {
            let p = ray.at(t).xyz;
            p.z - self.up_m(p.x, p.y)
        };
        let d = ray.direction.xyz();
        let bend = 2.0 * self.curvature[0].abs().max(self.curvature[1].abs());
        let steepest = self.slope[0].hypot(self.slope[1])
            + SELDOM * self.rough.slope_bound()
            + bend * (reach_m + ray.origin.xyz.xy().norm());
        // How fast the gap may close along the ray.
        let closing = d.xy().norm() * steepest - d.z;
        if above(0.0) <= 0.0 || closing <= 0.0 {
            return None;
        }
        let mut t = self.lowest_m(ray)?;
        let mut previous = 0.0;
        for _ in 0..4096 {
            if t > reach_m {
                return None;
            }
            let gap = above(t);
            if gap <= 0.0 {
                return Some(bisect(above, previous, t));
            }
            if gap < NEAR_M
                && let Some(hit) = self.newton(ray, t)
            {
                return (hit <= reach_m).then_some(hit);
            }
            previous = t;
            // At least a millimetre on, so that grazing rays arrive.
            t += (gap / closing).max(1e-3);
        }
        None
    }

    /// The distance at which a ray comes as low as the ground may be high; `None` where it never
    /// does. The ellipsoid only falls away below its tangent plane.
    fn lowest_m(&self, ray: Ray<Enu>) -> Option<f64> {
        let (o, d) = (ray.origin.xyz, ray.direction.xyz());
        let plane = self.base_m - self.origin_m + self.slope[0] * o.x + self.slope[1] * o.y;
        let gap = o.z - plane - self.rough.bound_m();
        let closing = self.slope[0] * d.x + self.slope[1] * d.y - d.z;
        match (gap > 0.0, closing > 0.0) {
            (false, _) => Some(0.0),
            (true, true) => Some(gap / closing),
            (true, false) => None,
        }
    }

    /// The hit near a point of the ray closely above the ground; `None` where the ray runs along it.
    fn newton(&self, ray: Ray<Enu>, start: f64) -> Option<f64> {
        let d = ray.direction.xyz();
        let mut t = start;
        for _ in 0..8 {
            let p = ray.at(t).xyz;
            let (up_m, slope) = self.up_and_slope(p.x, p.y);
            let gap = p.z - up_m;
            if gap.abs() < 1e-8 {
                return Some(t);
            }
            let rate = d.z - slope[0] * d.x - slope[1] * d.y;
            if rate > -0.01 {
                return None;
            }
            t -= gap / rate;
            if (t - start).abs() > FARTHEST_NEWTON_M {
                return None;
            }
        }
        None
    }

    fn up_and_slope(&self, east_m: f64, north_m: f64) -> (f64, [f64; 2]) {
        let (rough_m, rough) = self.rough.at(east_m, north_m);
        let [ke, kn] = self.curvature;
        let up_m = self.base_m - self.origin_m
            + self.slope[0] * east_m
            + self.slope[1] * north_m
            + rough_m
            - ke * east_m * east_m
            - kn * north_m * north_m;
        let slope = [
            self.slope[0] + rough[0] - 2.0 * ke * east_m,
            self.slope[1] + rough[1] - 2.0 * kn * north_m,
        ];
        (up_m, slope)
    }
}

/// The share of the steepest slope undulations can have that they seldom exceed.
const SELDOM: f64 = 0.35;

/// How near the ground Newton's method takes over, metres.
const NEAR_M: f64 = 0.008;

/// How far along the ray it may go from there.
const FARTHEST_NEWTON_M: f64 = 0.4;

/// Where `above` changes sign between `low` (above) and `high` (at or below), to 1e-9 m.
fn bisect(above: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        if high - low < 1e-9 {
            break;
        }
        let middle = 0.5 * (low + high);
        if above(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Direction, Geodetic, Planet};
    use nalgebra::Vector3;

    fn ground(plan: GroundPlan) -> (Site, Ground) {
        let origin = Geodetic::from_degrees(-24.45, -69.93, 1000.0);
        let site = Site::new(Planet::EARTH, origin);
        (site, Ground::new(&site, &plan, 4))
    }

    #[test]
    fn a_surface_of_constant_height_follows_the_ellipsoid() {
        let (site, ground) = ground(GroundPlan::flat(1003.0));
        for (east, north) in [(0.0, 0.0), (40.0, -15.0), (3000.0, 2000.0)] {
            let height = site.height_m(ground.point(east, north));
            assert!((height - 1003.0).abs() < 1e-4, "{height}");
        }
    }

    #[test]
    fn rays_meet_the_rough_ground_on_it() {
        let (_, ground) = ground(GroundPlan {
            slope: 3f64.to_radians(),
            slope_azimuth: 1.0,
            roughness_m: 0.1,
            roughness_length_m: 4.0,
            ..GroundPlan::flat(1000.0)
        });
        let origin = Point::new(0.0, 0.0, 2.0);
        for down in [0.05, 0.2, 0.7] {
            let direction = Direction::new(Vector3::new(1.0, 0.3, -down)).unwrap();
            let ray = Ray { origin, direction };
            let t = ground.first_hit_m(ray, 500.0).unwrap();
            let p = ray.at(t).xyz;
            assert!((p.z - ground.up_m(p.x, p.y)).abs() < 1e-7);
            for i in 0..1000 {
                let q = ray.at(t * f64::from(i) / 1001.0).xyz;
                assert!(q.z > ground.up_m(q.x, q.y), "nothing before it is lower");
            }
        }
        let up = Direction::new(Vector3::new(1.0, 0.0, 0.3)).unwrap();
        let ray = Ray {
            origin,
            direction: up,
        };
        assert_eq!(ground.first_hit_m(ray, 500.0), None);
    }
}
