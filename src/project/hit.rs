//! Sightings on the ground, with their derivatives.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

use super::{LineOfSight, Miss, Range, Settings, Sighting};
use crate::frame::{Body, Direction, Enu, LocalEnu, Point, Ray, Vector, skew};
use crate::terrain::Terrain;
use crate::view::View;

/// Where a sighting lies on the ground, and how that depends on everything uncertain.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// The place.
    pub point: Point<Enu>,
    /// From the sensor to the place, metres.
    pub slant_range_m: f64,
    /// The same in the horizontal plane, metres.
    pub ground_range_m: f64,
    /// Covariance from the mark's own noise, m^2.
    pub mark_covariance: Matrix3<f64>,
    /// Derivative of the place by the six pose errors in the order of
    /// [`crate::pose::PoseSigma::to_vector`]: metres by metre and metres by radian.
    pub by_pose: Matrix3x6<f64>,
    /// Derivative of the place by the height of the ground there; zero where a range alone
    /// places it.
    pub by_ground_height: Vector3<f64>,
}

impl Hit {
    /// Covariance of the place, m^2: mark, pose and height of the ground together, taken as
    /// independent.
    pub fn covariance(&self, pose: &Matrix6<f64>, ground_height_sigma_m: f64) -> Matrix3<f64> {
        let height = self.by_ground_height * ground_height_sigma_m;
        let covariance = self.mark_covariance
            + self.by_pose * pose * self.by_pose.transpose()
            + height * height.transpose();
        (covariance + covariance.transpose()) * 0.5
    }
}

/// Puts a sighting on the ground.
///
/// A ray goes to its first hit with the terrain, or to its measured range, which needs no terrain.
/// A bearing with a range goes to the place of the terrain at that slant range; without a terrain
/// it is taken to lie in the body's own x-y plane.
///
/// # Errors
/// A ray that misses the terrain, or a place outside the ranges the run trusts.
pub fn meet(
    sighting: &Sighting,
    view: &View,
    terrain: Option<&Terrain>,
    settings: &Settings,
) -> Result<Hit, Miss> {
    let hit = match (sighting.line_of_sight, sighting.range) {
        (LineOfSight::Ray { .. }, Some(range)) => at_range(sighting, view, range),
        (LineOfSight::Ray { ray, .. }, None) => {
            let terrain = terrain.ok_or(Miss::NoTerrain)?;
            on_terrain(sighting, view, ray, terrain, settings)
        }
        (LineOfSight::Bearing { .. }, Some(range)) => {
            at_range_on_terrain(sighting, view, range, terrain)
        }
        (LineOfSight::Bearing { .. }, None) => Err(Miss::NoTerrain),
    }?;
    let range_m = hit.ground_range_m;
    let (min_range_m, max_range_m) = (settings.min_range_m, settings.max_range_m);
    if range_m < min_range_m {
        return Err(Miss::TooNear {
            range_m,
            min_range_m,
        });
    }
    if range_m > max_range_m {
        return Err(Miss::TooFar {
            range_m,
            max_range_m,
        });
    }
    Ok(hit)
}

/// Derivative of a point fixed in body axes by the six pose errors: it moves with the position,
/// and by `R (delta x b) = -R [b]x delta` with the attitude.
fn rigid_by_pose(view: &View, point: Point<Enu>) -> Matrix3x6<f64> {
    let enu_from_body = view.pose.enu_from_body;
    let in_body = enu_from_body.inverse() * point;
    let mut by_pose = Matrix3x6::zeros();
    by_pose.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    let by_turn = -enu_from_body.rotation.matrix() * skew(in_body.xyz);
    by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_turn);
    by_pose
}

/// Keeps a displacement on the surface with normal `n` by moving along `free`:
/// `I - free n^T / (n . free)`.
fn onto_surface(free: Vector3<f64>, normal: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - free * normal.transpose() / normal.dot(&free)
}

/// What the noise of a ray's pixel does to a place at this distance, before it is kept on a
/// surface.
fn pixel_spread(sighting: &Sighting, view: &View, distance_m: f64) -> Matrix3<f64> {
    let LineOfSight::Ray {
        by_pixel, sigma_px, ..
    } = sighting.line_of_sight
    else {
        return Matrix3::zeros();
    };
    let rotation = view.pose.enu_from_body.rotation.matrix();
    let mut spread = rotation * (by_pixel.origin + by_pixel.direction * distance_m);
    spread.column_mut(0).scale_mut(sigma_px.x);
    spread.column_mut(1).scale_mut(sigma_px.y);
    spread * spread.transpose()
}

fn at_range(sighting: &Sighting, view: &View, range: Range) -> Result<Hit, Miss> {
    let LineOfSight::Ray { ray, .. } = sighting.line_of_sight else {
        return Err(Miss::NoCamera);
    };
    let ray = view.pose.enu_from_body * ray;
    let point = ray.at(range.range_m);
    let along = ray.direction.xyz() * range.sigma_m;
    Ok(Hit {
        point,
        slant_range_m: range.range_m,
        ground_range_m: ray.origin.horizontal_distance(point),
        mark_covariance: pixel_spread(sighting, view, range.range_m) + along * along.transpose(),
        by_pose: rigid_by_pose(view, point),
        by_ground_height: Vector3::zeros(),
    })
}

fn on_terrain(
    sighting: &Sighting,
    view: &View,
    ray: Ray<Body>,
    terrain: &Terrain,
    settings: &Settings,
) -> Result<Hit, Miss> {
    let ray = view.pose.enu_from_body * ray;
    let ground = terrain
        .first_hit(ray, settings.max_range_m)
        .map_err(Miss::Terrain)?;
    let (direction, normal) = (ray.direction.xyz(), ground.normal.xyz());
    let keep = onto_surface(direction, normal);
    let spread = pixel_spread(sighting, view, ground.distance_m);
    Ok(Hit {
        point: ground.point,
        slant_range_m: ground.distance_m,
        ground_range_m: ray.origin.horizontal_distance(ground.point),
        mark_covariance: keep * spread * keep.transpose(),
        by_pose: keep * rigid_by_pose(view, ground.point),
        by_ground_height: direction * (normal.z / normal.dot(&direction)),
    })
}

/// A bearing and range before its elevation is known: the arc of places it may be.
struct Arc {
    origin: Point<Enu>,
    /// Level directions along the bearing and to its right, and the axis elevation turns towards.
    along: Vector3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    range_m: f64,
}

impl Arc {
    fn new(view: &View, origin: Point<Body>, bearing: f64, is_azimuth: bool, range_m: f64) -> Self {
        let (sin, cos) = bearing.sin_cos();
        // Body axes are forward, left, up; local ones east, north, up.
        let (along, right) = if is_azimuth {
            ([sin, cos, 0.0], [cos, -sin, 0.0])
        } else {
            ([cos, -sin, 0.0], [-sin, -cos, 0.0])
        };
        let turn = |v: [f64; 3]| {
            if is_azimuth {
                (view.enu_from_local * Vector::<LocalEnu>::from_xyz(v.into())).xyz
            } else {
                (view.pose.enu_from_body.rotation * Vector::<Body>::from_xyz(v.into())).xyz
            }
        };
        Self {
            origin: view.pose.enu_from_body * origin,
            along: turn(along),
            right: turn(right),
            up: turn([0.0, 0.0, 1.0]),
            range_m,
        }
    }

    fn at(&self, elevation: f64) -> Point<Enu> {
        let (sin, cos) = elevation.sin_cos();
        self.origin + Vector::from_xyz((self.along * cos + self.up * sin) * self.range_m)
    }

    /// Derivative of the place by the elevation.
    fn by_elevation(&self, elevation: f64) -> Vector3<f64> {
        let (sin, cos) = elevation.sin_cos();
        (self.up * cos - self.along * sin) * self.range_m
    }

    /// The elevation at which the arc meets the terrain, nearest to level, with the terrain's
    /// normal there.
    fn meet(&self, terrain: &Terrain) -> Option<(f64, Vector3<f64>)> {
        let above = |elevation: f64| {
            let point = self.at(elevation);
            let ground = terrain.ground_at(point.xyz.x, point.xyz.y)?;
            Some((point.xyz.z - ground.point.xyz.z, ground.normal.xyz()))
        };
        let mut elevation: f64 = 0.0;
        for _ in 0..30 {
            let (height, normal) = above(elevation)?;
            if height.abs() < 1e-9 * self.range_m.max(1.0) {
                return Some((elevation, normal));
            }
            let slope = normal.dot(&self.by_elevation(elevation)) / normal.z;
            if slope <= 0.1 * self.range_m {
                break;
            }
            elevation = (elevation - height / slope).clamp(-1.5, 1.5);
        }
        self.bisect(above)
    }

    /// The sign change nearest to level, where Newton's steps did not settle.
    fn bisect(
        &self,
        above: impl Fn(f64) -> Option<(f64, Vector3<f64>)>,
    ) -> Option<(f64, Vector3<f64>)> {
        const STEPS: i32 = 90;
        let at = |i: i32| f64::from(i) * std::f64::consts::FRAC_PI_2 / f64::from(STEPS);
        let crosses = |i: i32| {
            let (low, high) = (above(at(i))?.0, above(at(i + 1))?.0);
            (low <= 0.0 && high > 0.0).then_some((at(i), at(i + 1)))
        };
        let mut nearest = (0..STEPS).flat_map(|i| [-i - 1, i]);
        let (mut low, mut high) = nearest.find_map(crosses)?;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if above(middle)?.0 <= 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some((high, above(high)?.1))
    }
}

fn at_range_on_terrain(
    sighting: &Sighting,
    view: &View,
    range: Range,
    terrain: Option<&Terrain>,
) -> Result<Hit, Miss> {
    let LineOfSight::Bearing {
        origin,
        bearing,
        is_azimuth,
        sigma,
    } = sighting.line_of_sight
    else {
        return Err(Miss::NoTerrain);
    };
    let range_m = range.range_m;
    let arc = Arc::new(view, origin, bearing, is_azimuth, range_m);
    let too_short = Miss::RangeTooShort { range_m };
    let (elevation, normal) = match terrain {
        Some(terrain) => {
            let (elevation, normal) = arc.meet(terrain).ok_or(too_short)?;
            (elevation, Some(normal))
        }
        None => (0.0, None),
    };
    let point = arc.at(elevation);
    let free = arc.by_elevation(elevation);
    let keep = normal.map_or(Matrix3::identity(), |normal| onto_surface(free, normal));
    let by_ground_height = normal.map_or(Vector3::zeros(), |n| free * (n.z / n.dot(&free)));
    let sideways = arc.right * (range_m * elevation.cos() * sigma);
    let along = (point - arc.origin).xyz * (range.sigma_m / range_m);
    let spread = sideways * sideways.transpose() + along * along.transpose();
    let mut by_pose = rigid_by_pose(view, point);
    if is_azimuth {
        // True north does not turn with the platform.
        by_pose.fixed_view_mut::<3, 3>(0, 3).fill(0.0);
    }
    Ok(Hit {
        point,
        slant_range_m: range_m,
        ground_range_m: arc.origin.horizontal_distance(point),
        mark_covariance: keep * spread * keep.transpose(),
        by_pose: keep * by_pose,
        by_ground_height,
    })
}

/// The direction a level look along a bearing has, for footprints of views without a camera.
pub(crate) fn level_direction(view: &View, bearing: f64) -> Option<Direction<Enu>> {
    let arc = Arc::new(view, Point::origin(), bearing, false, 1.0);
    Direction::new(arc.along)
}
