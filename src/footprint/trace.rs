//! From a view to its footprint.

use std::f64::consts::TAU;

use geo::algorithm::bool_ops::FillRule;
use geo::{BooleanOps, Coord, LineString, MultiPolygon, Polygon};
use nalgebra::Vector3;

use super::clip::{disc, sector, to_ranges};
use super::{Footprint, Reach, border};
use crate::camera::Camera;
use crate::frame::{self, Enu, Pixel, Point, Ray, RigidTransform};
use crate::project::level_direction;
use crate::terrain::{Miss, Terrain};
use crate::view::View;

/// The trace is made out to this many times the greatest range and then clipped to it: where it runs
/// to and fro along its rim, slivers between its chords stay outside.
const BEYOND: f64 = 1.02;

/// The footprint of a view.
///
/// Without a terrain only views without a camera have one: their sector does not need it.
pub fn trace(view: &View, terrain: Option<&Terrain>, reach: Reach) -> Footprint {
    let origin = view.origin();
    let seen = match (&view.camera, view.enu_from_camera(), terrain) {
        (Some(camera), Some(enu_from_camera), Some(terrain)) => {
            let eye = Eye {
                camera,
                enu_from_camera,
                terrain,
                limit_m: reach.limit_m() * BEYOND,
            };
            eye.footprint()
        }
        (Some(_), _, _) => None,
        (None, _, _) => whole_sector(view, reach),
    };
    seen.map_or_else(Footprint::empty, |area| {
        Footprint::new(to_ranges(&area, origin, reach))
    })
}

fn whole_sector(view: &View, reach: Reach) -> Option<MultiPolygon<f64>> {
    let (origin, limit_m) = (view.origin(), reach.limit_m());
    if reach.fov >= TAU {
        return Some(disc(origin, limit_m).into());
    }
    let forward = level_direction(view, 0.0)?.xyz();
    let azimuth = forward.x.atan2(forward.y);
    Some(sector(origin, limit_m, azimuth, reach.fov).into())
}

/// A camera over a terrain.
struct Eye<'a> {
    camera: &'a Camera,
    enu_from_camera: RigidTransform<Enu, frame::Camera>,
    terrain: &'a Terrain,
    limit_m: f64,
}

impl Eye<'_> {
    /// The trace of the picture's border on the ground encloses the footprint, except where the
    /// picture shows the zenith: then it encloses the ground that is not seen.
    ///
    /// Rays that meet no ground within the limit are lowered to it at their azimuth. On the sphere
    /// of directions that is the picture's border pressed onto the rim of the part below the
    /// horizon, so the trace of a picture that looks above the horizon bounds its lower part.
    fn footprint(&self) -> Option<MultiPolygon<f64>> {
        let origin = self.enu_from_camera.origin();
        let tolerance_m = |at: Coord<f64>| {
            let range_m = (at.x - origin.xyz.x).hypot(at.y - origin.xyz.y);
            (0.002 * range_m).max(0.005)
        };
        let to_ground = |pixel: Pixel| self.landing(pixel);
        let ring = border::walk(self.camera, &to_ground, &tolerance_m)?;
        let traced = Polygon::new(LineString::new(ring), Vec::new());
        // A union with nothing resolves the crossings that the rim and steps of the terrain cause:
        // whatever the trace winds around counts, in whichever sense.
        let nothing = MultiPolygon::new(Vec::new());
        let enclosed = MultiPolygon::from(traced).union_with_fill_rule(&nothing, FillRule::NonZero);
        let up = Point::from_xyz(origin.xyz + Vector3::z());
        if self.shows(up) {
            return Some(MultiPolygon::from(disc(origin, self.limit_m)).difference(&enclosed));
        }
        Some(enclosed)
    }

    fn shows(&self, place: Point<Enu>) -> bool {
        let pixel = self.camera.pixel(self.enu_from_camera.inverse() * place);
        pixel.is_ok_and(|p| p.is_inside(self.camera.width, self.camera.height))
    }

    /// Where a border pixel's ray lands: its first hit, or the limit at its azimuth.
    fn landing(&self, pixel: Pixel) -> Option<Coord<f64>> {
        let ray = self.enu_from_camera * self.nearest_ray(pixel)?;
        match self.terrain.first_hit(ray, self.limit_m) {
            Ok(hit) => Some(Coord {
                x: hit.point.xyz.x,
                y: hit.point.xyz.y,
            }),
            Err(Miss::OffTerrain) => self.at_edge(ray),
            Err(_) => at_range(ray, self.limit_m),
        }
    }

    /// The ray of a pixel, or of the nearest one towards the picture's middle that has one: the
    /// field of a fisheye may not fill its picture.
    fn nearest_ray(&self, pixel: Pixel) -> Option<Ray<frame::Camera>> {
        if let Ok(ray) = self.camera.ray(pixel) {
            return Some(ray);
        }
        let middle = Pixel::new(
            0.5 * (f64::from(self.camera.width) - 1.0),
            0.5 * (f64::from(self.camera.height) - 1.0),
        );
        let towards = |share: f64| {
            let v = middle.to_vector().lerp(&pixel.to_vector(), share);
            self.camera.ray(v.into()).ok()
        };
        let (mut seen, mut unseen) = (0.0, 1.0);
        let mut ray = towards(seen)?;
        for _ in 0..40 {
            let share = 0.5 * (seen + unseen);
            match towards(share) {
                Some(found) => (seen, ray) = (share, found),
                None => unseen = share,
            }
        }
        Some(ray)
    }

    /// The last known ground along a ray's azimuth that ends before the limit.
    fn at_edge(&self, ray: Ray<Enu>) -> Option<Coord<f64>> {
        const STEPS: u32 = 64;
        let is_known = |range_m: f64| {
            let at = at_range(ray, range_m)?;
            self.terrain.ground_at(at.x, at.y).map(|_| ())
        };
        let step = self.limit_m / f64::from(STEPS);
        let last = (0..=STEPS)
            .rev()
            .find(|&i| is_known(step * f64::from(i)).is_some());
        let (mut known, mut unknown) = match last {
            Some(STEPS) => return at_range(ray, self.limit_m),
            Some(i) => (step * f64::from(i), step * f64::from(i + 1)),
            None => return at_range(ray, 0.0),
        };
        for _ in 0..30 {
            let middle = 0.5 * (known + unknown);
            if is_known(middle).is_some() {
                known = middle;
            } else {
                unknown = middle;
            }
        }
        at_range(ray, known)
    }
}

/// The place at a ground range along a ray's azimuth; `None` for a vertical ray, which has none.
fn at_range(ray: Ray<Enu>, range_m: f64) -> Option<Coord<f64>> {
    let level = ray.direction.xyz().xy().try_normalize(1e-12)?;
    Some(Coord {
        x: ray.origin.xyz.x + level.x * range_m,
        y: ray.origin.xyz.y + level.y * range_m,
    })
}
