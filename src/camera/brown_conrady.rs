//! OpenCV's standard distortion model, in full.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2};

use super::perspective::{
    direction_by_plane, direction_of_plane, plane_by_point, plane_of_point, product,
};
use super::radial::Radial;
use super::sensor::Sensor;
use super::{BadLens, Intrinsics, LensError, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// Brown's radial and decentring distortion (Brown 1971) with the rational, thin-prism and tilted
/// sensor terms of OpenCV's `calib3d`. With `x, y` the point on the plane at unit depth and
/// `r^2 = x^2 + y^2`:
///
/// ```text
/// c  = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
/// x' = x c + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
/// y' = y c + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
/// ```
///
/// and, behind a sensor tilted by `tx, ty`, the homography of that tilt; then the camera matrix.
/// A point belongs to the field while its radial part still grows with `r` and the whole map keeps
/// its orientation; beyond that it would fold back into the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct BrownConrady {
    intrinsics: Intrinsics,
    distortion: Vec<f64>,
    radial: Radial,
    /// p1, p2.
    tangential: [f64; 2],
    /// s1, s2, s3, s4.
    prism: [f64; 4],
    /// Whether tangential or prism terms are there at all.
    decentred: bool,
    sensor: Sensor,
}

impl BrownConrady {
    /// How many coefficients the model may have.
    pub const COUNTS: [usize; 5] = [4, 5, 8, 12, 14];

    /// The lens of these intrinsics and coefficients in OpenCV's order:
    /// `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]`, `tx` and `ty` in radians.
    ///
    /// # Errors
    /// [`BadLens::Intrinsics`], [`BadLens::Count`], [`BadLens::Distortion`] where a coefficient is
    /// not finite, [`BadLens::Singular`] where the sensor is seen edge on.
    pub fn new(intrinsics: Intrinsics, distortion: &[f64]) -> Result<Self, BadLens> {
        intrinsics.check()?;
        if !Self::COUNTS.contains(&distortion.len()) {
            return Err(BadLens::Count(distortion.len()));
        }
        let mut all = [0.0; 14];
        all[..distortion.len()].copy_from_slice(distortion);
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tx, ty] = all;
        if !all.iter().all(|c| c.is_finite()) {
            return Err(BadLens::Distortion);
        }
        let radial =
            Radial::new([1.0, k1, k2, k3, 0.0], [1.0, k4, k5, k6]).ok_or(BadLens::Distortion)?;
        let sensor = intrinsics.matrix() * tilt(tx, ty).ok_or(BadLens::Singular)?;
        Ok(Self {
            intrinsics,
            distortion: distortion.to_vec(),
            radial,
            tangential: [p1, p2],
            prism: [s1, s2, s3, s4],
            decentred: [p1, p2, s1, s2, s3, s4].iter().any(|&c| c != 0.0),
            sensor: Sensor::new(sensor).ok_or(BadLens::Singular)?,
        })
    }

    /// Its intrinsics.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// The coefficients it was made from, in OpenCV's order.
    pub fn distortion(&self) -> &[f64] {
        &self.distortion
    }

    /// The undistorted radius at unit depth up to which the model is one to one: the tangent of the
    /// angle from the axis; infinite where it always is.
    pub fn field_radius(&self) -> f64 {
        self.radial.limit()
    }

    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        let distorted = self.sensor.plane(pixel)?;
        let plane = if self.decentred {
            self.undistort(distorted)?.0
        } else {
            self.radial.undistort(distorted)?
        };
        Ok(central_ray(direction_of_plane(plane)))
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (distorted, distorted_by_pixel) = self.sensor.plane_with_jacobian(pixel)?;
        let (plane, by_distorted) = if self.decentred {
            self.undistort(distorted)?
        } else {
            self.radial.undistort_with_jacobian(distorted)?
        };
        let direction = direction_of_plane(plane);
        let jacobian = product(
            &direction_by_plane(direction),
            &product(&by_distorted, &distorted_by_pixel),
        );
        Ok((central_ray(direction), jacobian))
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        let plane = plane_of_point(point.xyz)?;
        let distorted = if self.decentred {
            self.distort_upright(plane)?.0
        } else {
            self.radial.distort(plane)?
        };
        self.sensor.pixel(distorted)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let plane = plane_of_point(point.xyz)?;
        let (distorted, by_plane) = self.distort_upright(plane)?;
        let (pixel, by_distorted) = self.sensor.pixel_with_jacobian(distorted)?;
        let by_point = plane_by_point(plane, point.xyz.z);
        Ok((
            pixel,
            product(&product(&by_distorted, &by_plane), &by_point),
        ))
    }

    /// As [`Self::distort`] where the map keeps its orientation.
    #[inline]
    fn distort_upright(
        &self,
        place: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let (distorted, jacobian) = self.distort(place)?;
        if determinant(&jacobian) > 0.0 {
            Ok((distorted, jacobian))
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// The distorted place of a place on the plane at unit depth, and its derivative.
    #[inline]
    fn distort(&self, place: Vector2<f64>) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let (distorted, jacobian) = self.radial.distort_with_jacobian(place)?;
        if self.decentred {
            let (shift, bend) = self.decentring(place);
            Ok((distorted + shift, jacobian + bend))
        } else {
            Ok((distorted, jacobian))
        }
    }

    /// The tangential and prism terms at a place, and their derivative.
    #[inline]
    fn decentring(&self, place: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let [p1, p2] = self.tangential;
        let [s1, s2, s3, s4] = self.prism;
        let (x, y) = (place.x, place.y);
        let s = place.norm_squared();
        let shift = Vector2::new(
            2.0 * p1 * x * y + p2 * (s + 2.0 * x * x) + s * (s1 + s2 * s),
            p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y + s * (s3 + s4 * s),
        );
        let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * s2 * s), 2.0 * (s3 + 2.0 * s4 * s));
        let bend = Matrix2::new(
            2.0 * p1 * y + 6.0 * p2 * x + prism_x * x,
            2.0 * p1 * x + 2.0 * p2 * y + prism_x * y,
            2.0 * p1 * x + 2.0 * p2 * y + prism_y * x,
            6.0 * p1 * y + 2.0 * p2 * x + prism_y * y,
        );
        (shift, bend)
    }

    /// The place whose distorted place is given, and its derivative.
    #[inline]
    fn undistort(
        &self,
        distorted: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        match self.undistort_nearby(distorted) {
            Some(found) => Ok(found),
            None => self.undistort_anywhere(distorted),
        }
    }

    /// Up to three steps of Newton's method from where the radial part alone would put the place,
    /// the decentring there taken off; `None` where they do not suffice.
    #[inline]
    fn undistort_nearby(&self, distorted: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let without = self.radial.undistort_roughly(distorted)?;
        let (shift, _) = self.decentring(without);
        let mut place = self.radial.undistort_roughly(distorted - shift)?;
        for _ in 0..3 {
            let (seen, jacobian) = self.distort(place).ok()?;
            let inverse = upright_inverse(&jacobian).ok()?;
            let step = product(&inverse, &(distorted - seen));
            place += step;
            if is_last(step, &inverse) {
                return Some((place, inverse));
            }
        }
        None
    }

    /// The place whose distorted place is given, and its derivative: damped Newton steps from where
    /// the radial part alone would put it, never leaving the field.
    #[cold]
    #[inline(never)]
    fn undistort_anywhere(
        &self,
        distorted: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let mut place = self.start(distorted)?;
        let (seen, mut jacobian) = self.distort(place)?;
        let mut miss = distorted - seen;
        let enough = 4.0 * f64::EPSILON * (1.0 + distorted.norm());
        for _ in 0..60 {
            let inverse = upright_inverse(&jacobian)?;
            let step = product(&inverse, &miss);
            if miss.norm() <= enough || is_last(step, &inverse) {
                return Ok((place + step, inverse));
            }
            let mut share = 1.0;
            loop {
                let next = place + step * share;
                // A step out of the field, or one that brings nothing, is halved.
                if let Ok((seen, slope)) = self.distort(next) {
                    let rest = distorted - seen;
                    if slope.determinant() > 0.0 && rest.norm() < miss.norm() {
                        (place, jacobian, miss) = (next, slope, rest);
                        break;
                    }
                }
                share *= 0.5;
                if share < 1e-6 {
                    return self.stalled(place, miss, inverse);
                }
            }
        }
        Err(LensError::NoConvergence)
    }

    /// Where no step improves any more: the answer to rounding, or there is none.
    fn stalled(
        &self,
        place: Vector2<f64>,
        miss: Vector2<f64>,
        inverse: Matrix2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        if miss.norm() <= 1e-12 * (1.0 + place.norm()) {
            Ok((place, inverse))
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// The place by the radial part alone; a little inside the field's edge for what lies beyond
    /// it, since the decentring terms may yet bring it in.
    fn start(&self, distorted: Vector2<f64>) -> Result<Vector2<f64>, LensError> {
        let norm = distorted.norm();
        if norm == 0.0 {
            return Ok(distorted);
        }
        match self.radial.radius(norm, 1e-3) {
            Ok(radius) => Ok(distorted * (radius.min(0.999 * self.radial.limit()) / norm)),
            Err(LensError::OutsideField) if self.radial.limit().is_finite() => {
                Ok(distorted * (0.999 * self.radial.limit() / norm))
            }
            Err(error) => Err(error),
        }
    }
}

/// Whether what a Newton step leaves is rounding: its error is of the order of its square, and a
/// hundred covers the curvature.
#[inline]
fn is_last(step: Vector2<f64>, inverse: &Matrix2<f64>) -> bool {
    let spread = inverse.m11.abs() + inverse.m12.abs() + inverse.m21.abs() + inverse.m22.abs();
    100.0 * step.norm_squared() * spread <= f64::EPSILON
}

#[inline]
fn determinant(m: &Matrix2<f64>) -> f64 {
    m.m11 * m.m22 - m.m12 * m.m21
}

/// The inverse of a derivative that keeps its orientation.
#[inline]
fn upright_inverse(jacobian: &Matrix2<f64>) -> Result<Matrix2<f64>, LensError> {
    let determinant = determinant(jacobian);
    if determinant > 0.0 {
        let scale = 1.0 / determinant;
        let j = jacobian;
        let [a, b, c, d] = [j.m22, -j.m12, -j.m21, j.m11].map(|x| x * scale);
        Ok(Matrix2::new(a, b, c, d))
    } else {
        Err(LensError::OutsideField)
    }
}

/// The homography of a sensor turned by `tx` about x and then by `ty` about y, seen from the lens
/// along its axis: `[R33 0 -R13; 0 R33 -R23; 0 0 1] R` with `R = R(ty) R(tx)` (OpenCV, "Camera
/// calibration and 3D reconstruction", tilted sensor); `None` where it is edge on or turned away.
fn tilt(tx: f64, ty: f64) -> Option<Matrix3<f64>> {
    let (sx, cx) = tx.sin_cos();
    let (sy, cy) = ty.sin_cos();
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cx, sx, 0.0, -sx, cx);
    let about_y = Matrix3::new(cy, 0.0, -sy, 0.0, 1.0, 0.0, sy, 0.0, cy);
    let r = about_y * about_x;
    let project = Matrix3::new(
        r.m33, 0.0, -r.m13, //
        0.0, r.m33, -r.m23, //
        0.0, 0.0, 1.0,
    );
    (cx > 1e-6 && cy > 1e-6).then(|| project * r)
}
