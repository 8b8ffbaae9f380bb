//! What a view would read of an object, with the derivatives.

use nalgebra::{Matrix2x3, Matrix3, Vector3};

use super::algebra::{ByPose, Square4};
use super::data::{Look, Platform, PoseNow};
use crate::frame::{Point, skew};

/// Objects nearer to a camera than this are not seen by it, metres: a solution on its way through
/// the camera would meet derivatives without bounds.
const NEAREST_M: f64 = 0.05;

/// The readings expected of an object: column (or bearing), row, logarithm of apparent size and
/// slant range. Rows that a view does not read are zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub(super) values: [f64; 4],
    /// By east, north, up and the logarithm of the size.
    pub(super) by_object: Square4,
    /// By the six errors of the pose.
    pub(super) by_pose: ByPose,
    /// Horizontal distance, metres.
    pub(super) range_m: f64,
    /// Logarithm of the pixels a metre of width; zero without a camera.
    pub(super) log_scale: f64,
}

impl Expected {
    /// What was read less what is expected; zero of rows that were not read.
    #[inline]
    pub(super) fn residual(&self, look: &Look) -> [f64; 4] {
        let mut e = [0.0; 4];
        let values = self.of_ends(look).map_or(self.values, |ends| ends.values);
        for r in 0..look.n {
            if look.has[r] {
                e[r] = look.values[r] - values[r];
            }
        }
        if look.is_bearing() {
            e[0] = wrapped(e[0]);
        }
        e
    }

    /// The derivatives with rows that were not read struck out.
    #[inline]
    pub(super) fn of(&self, look: &Look) -> (Square4, ByPose) {
        let ends = self.of_ends(look);
        let (mut object, mut pose) = ends.map_or((self.by_object, self.by_pose), |ends| {
            (ends.by_object, ends.by_pose)
        });
        for r in 0..4 {
            if !look.has[r] {
                object[r] = [0.0; 4];
                pose[r] = [0.0; 6];
            }
        }
        (object, pose)
    }
}

pub(super) fn wrapped(angle: f64) -> f64 {
    (angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI
}

/// What a view expects of an object (east, north, up, logarithm of size), whose near face stands
/// `radius_m` before its middle; `None` where the view does not see it.
pub(super) fn expect(
    platform: &Platform,
    pose: &PoseNow,
    object: &[f64; 4],
    radius_m: f64,
) -> Option<Expected> {
    let place = Vector3::new(object[0], object[1], object[2]);
    let away = place.xy() - pose.origin.xy();
    let range_m = away.norm();
    let (face, by_place) = near_face(place, away, range_m, radius_m);
    let in_body = pose.rotation.tr_mul(&(face - pose.position));
    let mut rows = Rows::default();
    let mut log_scale = 0.0;
    if let Some(camera) = platform.camera.as_deref() {
        let in_camera = platform.body_from_camera.tr_mul(&(in_body - platform.arm));
        let distance = in_camera.norm();
        if distance < NEAREST_M || in_camera.z < NEAREST_M && !platform.is_wide {
            return None;
        }
        let (pixel, by_camera) = camera
            .pixel_with_jacobian(Point::from_xyz(in_camera))
            .ok()?;
        rows.values[0] = pixel.u;
        rows.values[1] = pixel.v;
        let unit = in_camera / distance;
        // A metre parallel to the rows of a perspective picture is as wide at one depth; in a wide
        // picture, at one distance.
        let (scale, shrinks) = if platform.is_wide {
            (across(&by_camera, &in_camera), -unit / distance)
        } else {
            let by_x = by_camera.column(0).norm();
            (by_x, Vector3::new(0.0, 0.0, -1.0 / in_camera.z))
        };
        log_scale = scale.ln();
        rows.values[2] = object[3] + log_scale;
        rows.values[3] = distance;
        let turn = platform.body_from_camera;
        rows.set(0, turn * by_camera.row(0).transpose());
        rows.set(1, turn * by_camera.row(1).transpose());
        rows.set(2, turn * shrinks);
        rows.set(3, turn * unit);
        return Some(rows.expected(platform, pose, in_body, &by_place, range_m, log_scale));
    }
    bearing(platform, pose, face, in_body, &mut rows)?;
    Some(rows.expected(platform, pose, in_body, &by_place, range_m, log_scale))
}

/// Bearing and slant range from the line of sight's origin.
fn bearing(
    platform: &Platform,
    pose: &PoseNow,
    face: Vector3<f64>,
    in_body: Vector3<f64>,
    rows: &mut Rows,
) -> Option<()> {
    let (offset, ahead, right) = if platform.is_azimuth {
        let local = platform.local.tr_mul(&(face - pose.origin));
        (local, Vector3::y(), Vector3::x())
    } else {
        (in_body - platform.arm, Vector3::x(), -Vector3::y())
    };
    let (x, y) = (offset.dot(&ahead), offset.dot(&right));
    let level = x * x + y * y;
    if level < 1e-6 {
        return None;
    }
    let slant = offset.norm();
    rows.values[0] = y.atan2(x);
    rows.values[3] = slant;
    rows.set(0, right * (x / level) - ahead * (y / level));
    rows.set(3, offset / slant);
    Some(())
}

/// The near face of an upright cylinder, and its derivative by the middle.
fn near_face(
    place: Vector3<f64>,
    away: nalgebra::Vector2<f64>,
    range_m: f64,
    radius_m: f64,
) -> (Vector3<f64>, Matrix3<f64>) {
    if radius_m <= 0.0 {
        return (place, Matrix3::identity());
    }
    let range_m = range_m.max(0.1);
    let before = radius_m.min(0.7 * range_m);
    let u = away / range_m;
    let mut by_place = Matrix3::identity();
    let across = nalgebra::Matrix2::identity() - u * u.transpose();
    let mut corner = by_place.fixed_view_mut::<2, 2>(0, 0);
    corner -= across * (before / range_m);
    (place - Vector3::new(u.x, u.y, 0.0) * before, by_place)
}

/// Pixels a metre across the line of sight, level.
fn across(by_camera: &Matrix2x3<f64>, in_camera: &Vector3<f64>) -> f64 {
    let sideways = Vector3::y().cross(in_camera).try_normalize(1e-9);
    sideways.map_or_else(|| by_camera.column(0).norm(), |s| (by_camera * s).norm())
}

/// Rows with their derivatives by the place in body axes (or, of azimuths, in local ones).
#[derive(Default)]
struct Rows {
    values: [f64; 4],
    by_body: [Option<Vector3<f64>>; 4],
}

impl Rows {
    fn set(&mut self, row: usize, by_body: Vector3<f64>) {
        self.by_body[row] = Some(by_body);
    }

    fn expected(
        &self,
        platform: &Platform,
        pose: &PoseNow,
        in_body: Vector3<f64>,
        by_place: &Matrix3<f64>,
        range_m: f64,
        log_scale: f64,
    ) -> Expected {
        let (mut by_object, mut by_pose) = ([[0.0; 4]; 4], [[0.0; 6]; 4]);
        let turning = skew(in_body) * pose.right_jacobian;
        // A camera off the body's origin moves as the body turns, and with it the near face.
        let swings = pose.rotation * skew(platform.arm) * pose.right_jacobian;
        let face_follows = Matrix3::identity() - by_place;
        for (r, by_body) in self.by_body.iter().enumerate() {
            let Some(by_body) = by_body else { continue };
            // True north does not turn with the platform.
            let (axes, turns) = if platform.is_azimuth {
                (&platform.local, false)
            } else {
                (&pose.rotation, true)
            };
            let by_face = axes * by_body;
            let by_middle = by_place.tr_mul(&by_face);
            for i in 0..3 {
                by_object[r][i] = by_middle[i];
                // View and object moved alike read the same.
                by_pose[r][i] = -by_middle[i];
            }
            if turns {
                let by_turn =
                    turning.tr_mul(by_body) - swings.tr_mul(&face_follows.tr_mul(&by_face));
                for i in 0..3 {
                    by_pose[r][3 + i] = by_turn[i];
                }
            }
        }
        if self.by_body[2].is_some() {
            by_object[2][3] = 1.0;
        }
        Expected {
            values: self.values,
            by_object,
            by_pose,
            range_m,
            log_scale,
        }
    }
}
