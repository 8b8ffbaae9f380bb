//! What a view would measure of an object, with the derivatives.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Matrix3x6, RowVector3, Vector3, Vector6};

use super::{Measurement, Problem, Reading};
use crate::camera::{Camera, Lens};
use crate::frame::{self, Body, Enu, LocalEnu, Point, Ray, RigidTransform, Vector, skew};
use crate::project::Range;
use crate::view::View;

/// Objects nearer to a camera than this are not seen by it, metres: a solution on its way through a
/// camera would meet derivatives without bounds.
const NEAREST_M: f64 = 0.05;

/// A view with its pose set right by an estimate of its error.
#[derive(Debug, Clone)]
pub struct CorrectedPose<'a> {
    view: &'a View,
    enu_from_body: RigidTransform<Enu, Body>,
    body_from_camera: RigidTransform<Body, frame::Camera>,
    /// `d Exp(r) = Exp(r) [J dr]x`.
    right_jacobian: Matrix3<f64>,
}

/// How a view sees a place, whatever it measured there.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// The raw pixel.
    pub pixel: frame::Pixel,
    /// Pixels a metre of width at the object: the focal length over the depth.
    pub scale_px_per_m: f64,
    /// Horizontal distance, metres.
    pub ground_range_m: f64,
    /// Distance, metres.
    pub slant_range_m: f64,
    /// Derivative of column and row by the object's east, north and height; the third row is zero.
    pub by_point: Matrix3<f64>,
    /// Derivative of column and row by the six pose errors; the third row is zero.
    pub by_pose: Matrix3x6<f64>,
}

/// What is expected of one measurement. Rows beyond those the reading has are zero.
#[derive(Debug, Clone, Copy)]
pub struct Prediction {
    /// Read less expected.
    pub residual: Vector3<f64>,
    /// Derivative of the expected by the object's east, north and height above the surface; the
    /// last column is zero where objects are pinned to the surface.
    pub by_point: Matrix3<f64>,
    /// Derivative of the expected by the six pose errors.
    pub by_pose: Matrix3x6<f64>,
    /// Pixels a metre of width at the object, where a camera looks.
    pub scale_px_per_m: Option<f64>,
}

impl<'a> CorrectedPose<'a> {
    /// The pose of a view less the error `delta`: position in the site's ENU, metres, and the
    /// rotation vector in body axes with `R = R_measured Exp(delta)`.
    pub fn new(view: &'a View, delta: &Vector6<f64>) -> Self {
        let turn: Vector3<f64> = delta.fixed_rows::<3>(3).into();
        let shift: Vector3<f64> = delta.fixed_rows::<3>(0).into();
        let measured = view.pose.enu_from_body;
        Self {
            view,
            enu_from_body: RigidTransform::new(
                measured.rotation.perturbed(turn),
                measured.translation + Vector::from_xyz(shift),
            ),
            body_from_camera: view
                .body_from_camera()
                .unwrap_or_else(RigidTransform::identity),
            right_jacobian: right_jacobian(turn),
        }
    }

    /// Body axes into the site's ENU.
    pub fn enu_from_body(&self) -> RigidTransform<Enu, Body> {
        self.enu_from_body
    }

    /// Where it looks from.
    pub fn origin(&self) -> Point<Enu> {
        self.enu_from_body * self.body_from_camera.origin()
    }

    /// How its camera sees an object; `None` without a camera, where the lens does not see the
    /// place, or where the ground there is unknown.
    pub fn sight(&self, problem: &Problem<'_>, point: Vector3<f64>) -> Option<Sight> {
        let camera = self.view.camera.as_deref()?;
        let (place, by_state) = place(problem, point)?;
        let in_body = self.enu_from_body.inverse() * place;
        let in_camera = self.body_from_camera.inverse() * in_body;
        if in_camera.xyz.norm() < NEAREST_M {
            return None;
        }
        let (pixel, by_camera) = camera.pixel_with_jacobian(in_camera).ok()?;
        let by_body = by_camera * self.body_from_camera.rotation.matrix().transpose();
        let mut rows = Matrix3::zeros();
        rows.fixed_rows_mut::<2>(0).copy_from(&by_body);
        let (by_point, by_pose) = self.by_unknowns(&rows, in_body, &by_state);
        let origin = self.origin();
        Some(Sight {
            pixel,
            scale_px_per_m: scale(camera, in_camera.xyz, &by_camera),
            ground_range_m: origin.horizontal_distance(place),
            slant_range_m: in_camera.xyz.norm(),
            by_point,
            by_pose,
        })
    }

    /// What is expected of a measurement of an object; `None` as [`CorrectedPose::sight`].
    pub fn predict(
        &self,
        problem: &Problem<'_>,
        measurement: &Measurement,
        point: Vector3<f64>,
    ) -> Option<Prediction> {
        match measurement.reading {
            Reading::Pixel { pixel, range, .. } => {
                let sight = self.sight(problem, point)?;
                let mut prediction = Prediction {
                    residual: Vector3::new(pixel.u - sight.pixel.u, pixel.v - sight.pixel.v, 0.0),
                    by_point: sight.by_point,
                    by_pose: sight.by_pose,
                    scale_px_per_m: Some(sight.scale_px_per_m),
                };
                if let Some(range) = range {
                    self.add_range(problem, point, range, &mut prediction)?;
                }
                Some(prediction)
            }
            Reading::Bearing {
                bearing,
                is_azimuth,
                range,
                ..
            } => self.bearing(problem, point, bearing, is_azimuth, range),
        }
    }

    /// The ray of a pixel reading, or the level one of a bearing, in the site's ENU.
    pub fn ray(&self, reading: &Reading) -> Option<Ray<Enu>> {
        match *reading {
            Reading::Pixel { pixel, .. } => {
                let ray = self.view.camera.as_deref()?.ray(pixel).ok()?;
                Some(self.enu_from_body * (self.body_from_camera * ray))
            }
            Reading::Bearing {
                bearing,
                is_azimuth,
                ..
            } => {
                let (sin, cos) = bearing.sin_cos();
                let along = if is_azimuth {
                    self.view.enu_from_local * Vector::<LocalEnu>::new(sin, cos, 0.0)
                } else {
                    self.enu_from_body.rotation * Vector::<Body>::new(cos, -sin, 0.0)
                };
                Some(Ray {
                    origin: self.origin(),
                    direction: frame::Direction::new(along.xyz)?,
                })
            }
        }
    }

    /// Derivatives by the unknowns, from those by the place in body axes.
    fn by_unknowns(
        &self,
        by_body: &Matrix3<f64>,
        in_body: Point<Body>,
        by_state: &Matrix3<f64>,
    ) -> (Matrix3<f64>, Matrix3x6<f64>) {
        let by_place = by_body * self.enu_from_body.rotation.matrix().transpose();
        let mut by_pose = Matrix3x6::zeros();
        by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-by_place));
        let by_turn = by_body * skew(in_body.xyz) * self.right_jacobian;
        by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_turn);
        (by_place * by_state, by_pose)
    }

    fn add_range(
        &self,
        problem: &Problem<'_>,
        point: Vector3<f64>,
        range: Range,
        prediction: &mut Prediction,
    ) -> Option<()> {
        let (place, by_state) = place(problem, point)?;
        let in_body = self.enu_from_body.inverse() * place;
        let from_camera = in_body - self.body_from_camera.origin();
        let mut rows = Matrix3::zeros();
        rows.set_row(2, &(from_camera.xyz / from_camera.norm()).transpose());
        let (by_point, by_pose) = self.by_unknowns(&rows, in_body, &by_state);
        prediction.residual.z = range.range_m - from_camera.norm();
        prediction.by_point += by_point;
        prediction.by_pose += by_pose;
        Some(())
    }

    /// Bearing and slant range from the line of sight's origin.
    fn bearing(
        &self,
        problem: &Problem<'_>,
        point: Vector3<f64>,
        bearing: f64,
        is_azimuth: bool,
        range: Range,
    ) -> Option<Prediction> {
        let (place, by_state) = place(problem, point)?;
        let in_body = self.enu_from_body.inverse() * place;
        // Forward and right of the line of sight's origin, or north and east of it.
        let (ahead, right, offset) = if is_azimuth {
            let local = self.view.enu_from_local.inverse() * (place - self.origin());
            (Vector3::y(), Vector3::x(), local.xyz)
        } else {
            let offset = in_body - self.body_from_camera.origin();
            (Vector3::x(), -Vector3::y(), offset.xyz)
        };
        let (x, y) = (offset.dot(&ahead), offset.dot(&right));
        let level = x * x + y * y;
        if level < 1e-6 {
            return None;
        }
        let slant = offset.norm();
        let by_bearing: RowVector3<f64> = (right * (x / level) - ahead * (y / level)).transpose();
        let mut rows = Matrix3::zeros();
        rows.set_row(0, &by_bearing);
        rows.set_row(1, &(offset / slant).transpose());
        let (by_point, by_pose) = if is_azimuth {
            // True north does not turn with the platform, nor does the distance.
            let by_place = rows * self.view.enu_from_local.matrix().transpose();
            let mut by_pose = Matrix3x6::zeros();
            by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-by_place));
            (by_place * by_state, by_pose)
        } else {
            self.by_unknowns(&rows, in_body, &by_state)
        };
        let turn = bearing - y.atan2(x);
        let turn = (turn + PI).rem_euclid(TAU) - PI;
        Some(Prediction {
            residual: Vector3::new(turn, range.range_m - slant, 0.0),
            by_point,
            by_pose,
            scale_px_per_m: None,
        })
    }
}

/// The place of an object with its derivative by the unknowns: a pinned height is none.
pub(super) fn place(
    problem: &Problem<'_>,
    point: Vector3<f64>,
) -> Option<(Point<Enu>, Matrix3<f64>)> {
    let (place, mut by_state) = problem.surface.place(point)?;
    if problem.is_pinned() {
        by_state.column_mut(2).fill(0.0);
    }
    Some((place, by_state))
}

/// Pixels a metre of width. In a perspective picture a metre parallel to its rows is `fx / depth`
/// wide everywhere; in a wide one a metre across the line of sight counts.
fn scale(camera: &Camera, point: Vector3<f64>, by_camera: &nalgebra::Matrix2x3<f64>) -> f64 {
    let is_wide = matches!(
        camera.lens,
        Lens::Fisheye(_) | Lens::Equirectangular(_) | Lens::Cahvore(_)
    );
    let sideways = Vector3::y().cross(&point).try_normalize(1e-9);
    match sideways {
        Some(sideways) if is_wide => (by_camera * sideways).norm(),
        _ => by_camera.column(0).norm(),
    }
}

/// `J(r)` with `Exp(r + dr) = Exp(r) Exp(J dr)` to first order (Chirikjian 2012, eq. 10.86).
pub(crate) fn right_jacobian(r: Vector3<f64>) -> Matrix3<f64> {
    let angle = r.norm();
    let k = skew(r);
    let (first, second) = if angle < 1e-4 {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0)
    } else {
        let cube = angle * angle * angle;
        (
            2.0 * (0.5 * angle).sin().powi(2) / (angle * angle),
            (angle - angle.sin()) / cube,
        )
    };
    Matrix3::identity() - k * first + k * k * second
}
