//! OpenCV's standard distortion model, in full.

mod search;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

use super::lanes::{Central, Places};
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
    has_prism: bool,
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
            has_prism: [s1, s2, s3, s4].iter().any(|&c| c != 0.0),
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
    #[inline(always)]
    fn decentring(&self, place: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        self.decentring_if(self.has_prism, place)
    }

    /// The same, with prism terms or without: a constant, where many places are taken side by side.
    #[inline(always)]
    fn decentring_if(&self, prism: bool, place: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let [p1, p2] = self.tangential;
        let (x, y) = (place.x, place.y);
        let s = place.norm_squared();
        // With m = 2 (p1 y + p2 x) the tangential terms are x m + p2 s and y m + p1 s.
        let (half, mixed) = (p1 * y + p2 * x, 2.0 * (p1 * x + p2 * y));
        let mut shift = Vector2::new(2.0 * x * half + p2 * s, 2.0 * y * half + p1 * s);
        let mut bend = Matrix2::new(
            2.0 * half + 4.0 * p2 * x,
            mixed,
            mixed,
            2.0 * half + 4.0 * p1 * y,
        );
        if prism {
            let [s1, s2, s3, s4] = self.prism;
            shift += Vector2::new(s * (s1 + s2 * s), s * (s3 + s4 * s));
            let prism = Vector2::new(2.0 * (s1 + 2.0 * s2 * s), 2.0 * (s3 + 2.0 * s4 * s));
            bend += Matrix2::new(prism.x * x, prism.x * y, prism.y * x, prism.y * y);
        }
        (shift, bend)
    }

    /// The place whose distorted place is given, and its derivative.
    #[inline]
    fn undistort(
        &self,
        distorted: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let place = self
            .undistort_nearby(&Places::<1>::from_fn(|_| distorted))
            .get(0);
        if place.x.is_nan() {
            return self.undistort_anywhere(distorted);
        }
        Ok((place, upright_inverse(&self.distort(place)?.1)?))
    }

    /// The places whose distorted places are given: where the radial part alone would put them, the
    /// decentring there taken off, twice, and Newton's method from there. Each of the former brings
    /// the answer nearer by about the share of the decentring in the picture, a thousand times or
    /// so; then a step with its own derivative and one more with the same. Not numbers where that
    /// does not suffice.
    #[inline(always)]
    fn undistort_nearby<const N: usize>(&self, distorted: &Places<N>) -> Places<N> {
        // What a lens is made of is asked once for all lanes: in the loops over them it would keep
        // the compiler from taking several side by side.
        match (self.has_prism, self.radial.is_polynomial()) {
            (false, false) => self.undistort_nearby_of::<N, false, false>(distorted),
            (false, true) => self.undistort_nearby_of::<N, false, true>(distorted),
            (true, false) => self.undistort_nearby_of::<N, true, false>(distorted),
            (true, true) => self.undistort_nearby_of::<N, true, true>(distorted),
        }
    }

    /// The same, with prism terms or without, with a denominator or without.
    #[inline(always)]
    fn undistort_nearby_of<const N: usize, const PRISM: bool, const POLYNOMIAL: bool>(
        &self,
        distorted: &Places<N>,
    ) -> Places<N> {
        let mut near = self.radial.undistort_roughly(distorted);
        for _ in 0..2 {
            let mut radial = *distorted;
            for i in 0..N {
                let shift = self.decentring_if(PRISM, near.get(i)).0;
                radial.set(i, distorted.get(i) - shift);
            }
            near = self.radial.undistort_roughly(&radial);
        }
        let mut settled = [false; N];
        // A loop, not a closure, which the compiler may leave out of line.
        for (i, settled) in settled.iter_mut().enumerate() {
            let (place, is_settled) =
                self.polished::<PRISM, POLYNOMIAL>(near.get(i), distorted.get(i));
            near.set(i, place);
            *settled = is_settled;
        }
        for (i, _) in settled.iter().enumerate().filter(|(_, s)| !**s) {
            near.set(i, self.polished_again(near.get(i), distorted.get(i)));
        }
        near
    }

    /// Another two steps, which strong decentring takes; not numbers where these do not suffice either.
    #[inline(never)]
    fn polished_again(&self, near: Vector2<f64>, distorted: Vector2<f64>) -> Vector2<f64> {
        let (place, is_settled) = match (self.has_prism, self.radial.is_polynomial()) {
            (false, false) => self.polished::<false, false>(near, distorted),
            (false, true) => self.polished::<false, true>(near, distorted),
            (true, false) => self.polished::<true, false>(near, distorted),
            (true, true) => self.polished::<true, true>(near, distorted),
        };
        if is_settled {
            place
        } else {
            Vector2::repeat(f64::NAN)
        }
    }

    /// Two steps of Newton's method with one derivative, and whether these suffice.
    #[inline(always)]
    fn polished<const PRISM: bool, const POLYNOMIAL: bool>(
        &self,
        near: Vector2<f64>,
        distorted: Vector2<f64>,
    ) -> (Vector2<f64>, bool) {
        let (seen, jacobian) = self.distort_unbounded::<PRISM, POLYNOMIAL>(near);
        let determinant = determinant(&jacobian);
        let inverse = adjugate(&jacobian) * (1.0 / determinant);
        let first = product(&inverse, &(distorted - seen));
        let place = near + first;
        let (seen, _) = self.distort_unbounded::<PRISM, POLYNOMIAL>(place);
        let second = product(&inverse, &(distorted - seen));
        // What is left is of the order of the product of the two; a hundred covers the curvature.
        let left = 1e4 * first.norm_squared() * second.norm_squared() * norm_squared(&inverse);
        let small = left <= f64::EPSILON * f64::EPSILON;
        let place = place + second;
        let upright = determinant > 0.0;
        (place, small & upright & self.radial.is_inside(place))
    }

    /// As [`Self::distort`], in the field or not.
    #[inline(always)]
    fn distort_unbounded<const PRISM: bool, const POLYNOMIAL: bool>(
        &self,
        place: Vector2<f64>,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        let (distorted, jacobian) = self.radial.distort_unbounded_of::<POLYNOMIAL>(place);
        let (shift, bend) = self.decentring_if(PRISM, place);
        (distorted + shift, jacobian + bend)
    }
}

impl Central for BrownConrady {
    #[inline(always)]
    fn directions<const N: usize>(&self, pixels: &[Pixel; N]) -> [Vector3<f64>; N] {
        let distorted = self.sensor.planes(pixels);
        let places = if self.decentred {
            self.undistort_nearby(&distorted)
        } else {
            self.radial.undistort_nearby(&distorted)
        };
        places.directions()
    }

    #[cold]
    fn searched_direction(&self, pixel: Pixel) -> Result<Vector3<f64>, LensError> {
        let distorted = self.sensor.plane(pixel)?;
        let place = if self.decentred {
            self.undistort_anywhere(distorted)?.0
        } else {
            self.radial.undistort(distorted)?
        };
        Ok(direction_of_plane(place))
    }
}

#[inline(always)]
fn determinant(m: &Matrix2<f64>) -> f64 {
    m.m11 * m.m22 - m.m12 * m.m21
}

#[inline(always)]
fn norm_squared(m: &Matrix2<f64>) -> f64 {
    m.m11 * m.m11 + m.m12 * m.m12 + m.m21 * m.m21 + m.m22 * m.m22
}

/// The inverse times the determinant.
#[inline(always)]
fn adjugate(m: &Matrix2<f64>) -> Matrix2<f64> {
    Matrix2::new(m.m22, -m.m12, -m.m21, m.m11)
}

/// The inverse of a derivative that keeps its orientation.
#[inline]
fn upright_inverse(jacobian: &Matrix2<f64>) -> Result<Matrix2<f64>, LensError> {
    let determinant = determinant(jacobian);
    if determinant > 0.0 {
        Ok(adjugate(jacobian) * (1.0 / determinant))
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
