//! The ground as the adjustment needs it.

use nalgebra::{Matrix3, Vector3};
use rstar::primitives::GeomWithData;

use crate::frame::{Direction, Enu, Point, Ray};
use crate::terrain::{Ground, Terrain};
use crate::view::View;

/// Ground that objects lie on, or near.
pub trait Surface: Sync {
    /// The ground on the vertical line at an east and a north, metres; `None` where it is unknown.
    fn ground_at(&self, east_m: f64, north_m: f64) -> Option<Ground>;

    /// Whether it bends no more than a planet does: then heights between places some metres apart
    /// may be interpolated, to micrometres.
    fn is_smooth(&self) -> bool {
        false
    }

    /// Where a ray first meets the ground within a ground range; `None` where it does not.
    fn first_hit(&self, ray: Ray<Enu>, max_ground_range_m: f64) -> Option<Point<Enu>>;

    /// The place at a height above the ground, with its derivative by east, north and height; `None`
    /// where the ground is unknown.
    fn place(&self, east_north_height: Vector3<f64>) -> Option<(Point<Enu>, Matrix3<f64>)> {
        let [east, north, height]: [f64; 3] = east_north_height.into();
        let ground = self.ground_at(east, north)?;
        let normal = ground.normal.xyz();
        let (by_east, by_north) = (-normal.x / normal.z, -normal.y / normal.z);
        let derivative = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, by_east, by_north, 1.0);
        Some((
            Point::new(east, north, ground.point.xyz.z + height),
            derivative,
        ))
    }
}

impl Surface for Terrain {
    fn ground_at(&self, east_m: f64, north_m: f64) -> Option<Ground> {
        Terrain::ground_at(self, east_m, north_m)
    }

    fn is_smooth(&self) -> bool {
        self.is_constant_height()
    }

    fn first_hit(&self, ray: Ray<Enu>, max_ground_range_m: f64) -> Option<Point<Enu>> {
        let hit = Terrain::first_hit(self, ray, max_ground_range_m).ok()?;
        Some(hit.point)
    }
}

/// Ground as high as the platforms that stand on it: where nothing is known of the terrain, objects
/// are taken to lie level with the nearest view.
#[derive(Debug, Clone)]
pub struct PlatformLevel {
    views: rstar::RTree<GeomWithData<[f64; 2], f64>>,
}

impl PlatformLevel {
    /// Level with where each view looks from.
    pub fn new(views: &[View]) -> Self {
        let places = views.iter().map(|view| {
            let at = view.origin().xyz;
            GeomWithData::new([at.x, at.y], at.z)
        });
        Self {
            views: rstar::RTree::bulk_load(places.collect()),
        }
    }
}

impl Surface for PlatformLevel {
    fn ground_at(&self, east_m: f64, north_m: f64) -> Option<Ground> {
        let nearest = self.views.nearest_neighbor(&[east_m, north_m])?;
        Some(Ground {
            point: Point::new(east_m, north_m, nearest.data),
            normal: Direction::new(Vector3::z())?,
        })
    }

    /// Rays that rise or sink meet no ground that is only known to be level.
    fn first_hit(&self, _ray: Ray<Enu>, _max_ground_range_m: f64) -> Option<Point<Enu>> {
        None
    }
}

/// A plane of the site's ENU: `up = slope_east east + slope_north north`. Unlike a surface of
/// constant height it does not curve with the planet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LevelPlane {
    /// Rise by metre of east.
    pub slope_east: f64,
    /// Rise by metre of north.
    pub slope_north: f64,
}

impl LevelPlane {
    fn upwards(&self) -> Vector3<f64> {
        Vector3::new(-self.slope_east, -self.slope_north, 1.0)
    }
}

impl Surface for LevelPlane {
    fn ground_at(&self, east_m: f64, north_m: f64) -> Option<Ground> {
        let up = self.slope_east * east_m + self.slope_north * north_m;
        Some(Ground {
            point: Point::new(east_m, north_m, up),
            normal: Direction::new(self.upwards())?,
        })
    }

    fn first_hit(&self, ray: Ray<Enu>, max_ground_range_m: f64) -> Option<Point<Enu>> {
        let upwards = self.upwards();
        let sinking = -ray.direction.xyz().dot(&upwards);
        let above = ray.origin.xyz.dot(&upwards);
        let point = (sinking > 0.0 && above > 0.0).then(|| ray.at(above / sinking))?;
        (point.horizontal_distance(ray.origin) <= max_ground_range_m).then_some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Geodetic, Planet, Site};

    #[test]
    fn a_slope_is_met_and_followed() {
        let plane = LevelPlane {
            slope_east: 0.1,
            slope_north: -0.2,
        };
        let ray = Ray {
            origin: Point::new(1.0, 2.0, 3.0),
            direction: Direction::new(Vector3::new(1.0, 1.0, -1.0)).unwrap(),
        };
        let hit = plane.first_hit(ray, 100.0).unwrap();
        assert!((hit.xyz.z - (0.1 * hit.xyz.x - 0.2 * hit.xyz.y)).abs() < 1e-12);
        assert!(plane.first_hit(ray, 1.0).is_none());
        let (place, by) = plane.place(Vector3::new(5.0, 1.0, 0.25)).unwrap();
        assert!(place.distance(Point::new(5.0, 1.0, 0.55)) < 1e-12);
        assert!((by.row(2) - nalgebra::RowVector3::new(0.1, -0.2, 1.0)).norm() < 1e-12);
    }

    #[test]
    fn terrain_slopes_as_its_normal_says() {
        let site = Site::new(Planet::MOON, Geodetic::from_degrees(10.0, 20.0, 0.0));
        let terrain = Terrain::constant_height(site, 0.0);
        // At 20 km the Moon's surface has dropped by x^2 / 2R and sinks by x / R a metre.
        let (place, by) = terrain.place(Vector3::new(20_000.0, 0.0, 1.0)).unwrap();
        let drop = 20_000.0f64.powi(2) / (2.0 * 1_737_400.0);
        assert!((place.xyz.z - 1.0 + drop).abs() < 0.01);
        assert!((by[(2, 0)] + 20_000.0 / 1_737_400.0).abs() < 1e-5);
    }
}
