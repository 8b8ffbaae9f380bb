//! JPL's camera model for fisheye lenses.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Matrix2x3, RowVector2, Vector2, Vector3};

use super::angle::{angle_jacobian, direction_of_angle, direction_of_angle_with_jacobian};
use super::cahv::OpticalAxis;
use super::perspective::{product, radial_jacobian};
use super::radial::{Radial, increasing_root};
use super::sensor::Sensor;
use super::{BadLens, Cahv, CahvVectors, LensError, Mount, RayJacobian};
use crate::frame::{self, Direction, Pixel, Point, Ray};

/// How a CAHVORE lens images the angle theta from its axis, before its polynomial: `mtype` and
/// `linearity` of the files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Linearity {
    /// `mtype` 1: `tan theta`.
    Perspective,
    /// `mtype` 2: `theta`.
    Fisheye,
    /// `mtype` 3, with L the linearity: `tan(L theta) / L` above zero, `sin(L theta) / L` below.
    General(f64),
}

impl Linearity {
    /// L.
    pub fn value(self) -> f64 {
        match self {
            Self::Perspective => 1.0,
            Self::Fisheye => 0.0,
            Self::General(linearity) => linearity,
        }
    }
}

/// CAHVORE (Gennery 2006, "Generalized camera calibration including fish-eye lenses", IJCV 68:3):
/// radial distortion in the angle from the optical axis O, and an entrance pupil that moves along O.
///
/// With p the point from C, `zeta = p.O`, `lambda = |p - zeta O|`, the angle theta solves
/// `(zeta - s) sin theta = lambda cos theta`, where
/// `s = (theta / sin theta - 1) (e0 + e1 theta^2 + e2 theta^4)` is the pupil's place; then
/// `chi = ` [`Linearity`]`(theta)`, and the point is seen by the CAHV model in the direction
/// `O + chi (1 + rho0 + rho1 chi^2 + rho2 chi^4) lambda / |lambda|`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cahvore {
    base: Cahv,
    optical: OpticalAxis,
    distortion: [f64; 3],
    pupil: [f64; 3],
    linearity: Linearity,
    radial: Radial,
    sensor: Sensor,
    field_angle: f64,
}

/// Where the field ends at the latest: towards 180 degrees the pupil's shift grows without bound.
const WIDEST_ANGLE: f64 = PI * 179.0 / 180.0;

/// Below this the linearity counts as zero, as in JPL's own code.
const NO_LINEARITY: f64 = 1e-15;

impl Cahvore {
    /// The lens of the CAHV vectors, the optical axis O in the same axes, the coefficients
    /// R = rho0, rho1, rho2 and E = e0, e1, e2 (metres), and the linearity.
    ///
    /// # Errors
    /// As [`super::Cahvor::new`]; [`BadLens::Distortion`] also where E or the linearity is not finite.
    pub fn new(
        vectors: CahvVectors,
        o: [f64; 3],
        r: [f64; 3],
        e: [f64; 3],
        linearity: Linearity,
    ) -> Result<Self, BadLens> {
        let base = Cahv::new(vectors)?;
        let optical = OpticalAxis::new(&base, o)?;
        let sensor = base
            .sensor_along(&optical.lens_from_camera)
            .ok_or(BadLens::Singular)?;
        let finite = e.iter().all(|c| c.is_finite()) && linearity.value().is_finite();
        let radial = Radial::new([1.0 + r[0], r[1], r[2], 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
            .filter(|_| finite)
            .ok_or(BadLens::Distortion)?;
        let mut lens = Self {
            base,
            optical,
            distortion: r,
            pupil: e,
            linearity,
            radial,
            sensor,
            field_angle: WIDEST_ANGLE,
        };
        let quarter = FRAC_PI_2 / linearity.value().abs();
        let turning = lens
            .angle(lens.radial.limit())
            .map_or(quarter, |(theta, _)| theta);
        lens.field_angle = WIDEST_ANGLE.min(quarter).min(turning);
        Ok(lens)
    }

    /// The linear part.
    pub fn linear(&self) -> &Cahv {
        &self.base
    }

    /// O, in the axes of [`Cahv::vectors_on`] this mount.
    pub fn optical_axis_on(&self, mount: &Mount) -> [f64; 3] {
        self.optical.vector_on(&self.base, mount)
    }

    /// R: rho0, rho1, rho2.
    pub fn distortion(&self) -> [f64; 3] {
        self.distortion
    }

    /// E: e0, e1, e2, metres.
    pub fn pupil(&self) -> [f64; 3] {
        self.pupil
    }

    /// The linearity.
    pub fn linearity(&self) -> Linearity {
        self.linearity
    }

    /// The angle from the optical axis up to which the model is used, radians.
    pub fn field_angle(&self) -> f64 {
        self.field_angle
    }

    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        let chi = self.radial.undistort(self.sensor.plane(pixel)?)?;
        let (angle, theta, _) = self.angle_of_chi(chi)?;
        Ok(self.ray_of_angle(theta, direction_of_angle(angle)))
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, RayJacobian), LensError> {
        let (distorted, distorted_by_pixel) = self.sensor.plane_with_jacobian(pixel)?;
        let (chi, by_distorted) = self.radial.undistort_with_jacobian(distorted)?;
        let (angle, theta, by_chi) = self.angle_of_chi(chi)?;
        let (direction, by_angle) = direction_of_angle_with_jacobian(angle);
        let turn = self.optical.lens_from_camera.transpose();
        let angle_by_pixel = product(&by_chi, &product(&by_distorted, &distorted_by_pixel));
        // On the axis, where the angle has no direction, the pupil stands still.
        let theta_by_pixel = if theta > 0.0 {
            product(&(angle / theta).transpose(), &angle_by_pixel)
        } else {
            RowVector2::zeros()
        };
        let along = turn.column(2) * self.pupil_slope(theta);
        let jacobian = RayJacobian {
            origin: product(&along, &theta_by_pixel),
            direction: product(&turn, &product(&by_angle, &angle_by_pixel)),
        };
        Ok((self.ray_of_angle(theta, direction), jacobian))
    }

    /// The ray at an angle from the optical axis, in a direction of lens axes.
    #[inline]
    fn ray_of_angle(&self, theta: f64, direction: Vector3<f64>) -> Ray<frame::Camera> {
        let turn = self.optical.lens_from_camera.transpose();
        Ray {
            origin: Point::from_xyz(turn.column(2) * self.pupil_shift(theta)),
            direction: Direction::from_unit(product(&turn, &direction)),
        }
    }

    /// The angle vector of a place on the undistorted plane, its length, and its derivative.
    #[inline]
    fn angle_of_chi(
        &self,
        chi: Vector2<f64>,
    ) -> Result<(Vector2<f64>, f64, Matrix2<f64>), LensError> {
        let radius = chi.norm();
        let (theta, slope) = self.angle(radius).ok_or(LensError::OutsideField)?;
        if theta >= self.field_angle {
            return Err(LensError::OutsideField);
        }
        let (unit, ratio) = if radius > 0.0 {
            (chi / radius, theta / radius)
        } else {
            (Vector2::x(), 1.0)
        };
        Ok((unit * theta, theta, radial_jacobian(unit, slope, ratio)))
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        let in_lens = product(&self.optical.lens_from_camera, &point.xyz);
        let (angle, _) = self.angle_vector(in_lens)?;
        let theta = angle.norm();
        let ratio = if theta > 0.0 {
            self.image(theta).0 / theta
        } else {
            1.0
        };
        self.sensor.pixel(self.radial.distort(angle * ratio)?)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let turn = self.optical.lens_from_camera;
        let (angle, by_point) = self.angle_vector(product(&turn, &point.xyz))?;
        let theta = angle.norm();
        let (chi, slope) = self.image(theta);
        let (unit, ratio) = if theta > 0.0 {
            (angle / theta, chi / theta)
        } else {
            (Vector2::x(), 1.0)
        };
        let by_angle = radial_jacobian(unit, slope, ratio);
        let (distorted, by_chi) = self.radial.distort_with_jacobian(angle * ratio)?;
        let (pixel, by_distorted) = self.sensor.pixel_with_jacobian(distorted)?;
        let jacobian = product(
            &product(&by_distorted, &product(&by_chi, &by_angle)),
            &product(&by_point, &turn),
        );
        Ok((pixel, jacobian))
    }

    /// The angle vector at which the moved pupil sees a point in lens axes, and its derivative.
    fn angle_vector(
        &self,
        point: Vector3<f64>,
    ) -> Result<(Vector2<f64>, Matrix2x3<f64>), LensError> {
        let (lambda, zeta) = (point.xy().norm(), point.z);
        let distance = point.norm();
        let theta = self.pupil_angle(lambda, zeta, distance)?;
        let (_, growth) = self.pupil_equation(theta, lambda, zeta);
        if growth <= 0.0 {
            return Err(LensError::OutsideField);
        }
        let (sin, cos) = theta.sin_cos();
        let (unit, ratio) = if lambda > 1e-12 * distance {
            (point.xy() / lambda, theta / lambda)
        } else {
            (Vector2::x(), 1.0 / growth)
        };
        let jacobian = angle_jacobian(unit, cos / growth, ratio, -sin / growth);
        Ok((unit * theta, jacobian))
    }

    /// The root of [`Self::pupil_equation`] in the field.
    fn pupil_angle(&self, lambda: f64, zeta: f64, distance: f64) -> Result<f64, LensError> {
        if !(distance > 0.0 && distance.is_finite()) {
            return Err(LensError::BehindCamera);
        }
        if lambda == 0.0 && zeta > 0.0 {
            return Ok(0.0);
        }
        let equation = |theta: f64| self.pupil_equation(theta, lambda, zeta);
        let start = lambda.atan2(zeta);
        let Some(high) = self.beyond_root(equation, start) else {
            let behind = zeta <= 0.0 && self.field_angle <= FRAC_PI_2;
            return Err(if behind {
                LensError::BehindCamera
            } else {
                LensError::OutsideField
            });
        };
        increasing_root(equation, high, start, 2.0 * f64::EPSILON * distance)
            .ok_or(LensError::NoConvergence)
    }

    /// An angle at which the equation is above zero: the field's end, or, where a pupil that moves
    /// far has already turned a near point's equation back there, one on the way to it.
    fn beyond_root(&self, equation: impl Fn(f64) -> (f64, f64), start: f64) -> Option<f64> {
        let end = self.field_angle;
        let above = |theta: &f64| equation(*theta).0 > 0.0;
        if above(&end) {
            return Some(end);
        }
        const STEPS: u32 = 32;
        (0..STEPS)
            .map(|i| start + (end - start) * f64::from(i) / f64::from(STEPS))
            .take_while(|_| start < end)
            .find(above)
    }

    /// `zeta sin theta - lambda cos theta - (theta - sin theta) E(theta)`, which is zero at the angle
    /// the point is seen at, and its derivative by theta.
    #[inline]
    fn pupil_equation(&self, theta: f64, lambda: f64, zeta: f64) -> (f64, f64) {
        let [e0, e1, e2] = self.pupil;
        let (sin, cos) = theta.sin_cos();
        let squared = theta * theta;
        let pupil = e0 + squared * (e1 + squared * e2);
        let slope = 2.0 * theta * (e1 + 2.0 * e2 * squared);
        let lag = theta - sin;
        (
            zeta * sin - lambda * cos - lag * pupil,
            zeta * cos + lambda * sin - (1.0 - cos) * pupil - lag * slope,
        )
    }

    /// How far the entrance pupil has moved along O at an angle, metres.
    #[inline]
    fn pupil_shift(&self, theta: f64) -> f64 {
        let [e0, e1, e2] = self.pupil;
        let squared = theta * theta;
        // Near the axis theta / sin theta - 1 loses its digits; its series starts theta^2 / 6.
        let stretch = if theta < 1e-4 {
            squared / 6.0
        } else {
            theta / theta.sin() - 1.0
        };
        stretch * (e0 + squared * (e1 + squared * e2))
    }

    /// The derivative of [`Self::pupil_shift`] by the angle, metres per radian.
    fn pupil_slope(&self, theta: f64) -> f64 {
        let [e0, e1, e2] = self.pupil;
        let squared = theta * theta;
        let (sin, cos) = theta.sin_cos();
        // As of the shift, with more terms: the difference below loses three powers of theta.
        let (stretch, stretch_slope) = if theta < 1e-2 {
            (
                squared * (1.0 / 6.0 + squared * (7.0 / 360.0)),
                theta * (1.0 / 3.0 + squared * (7.0 / 90.0 + squared * (31.0 / 2520.0))),
            )
        } else {
            (theta / sin - 1.0, (sin - theta * cos) / (sin * sin))
        };
        stretch_slope * (e0 + squared * (e1 + squared * e2))
            + stretch * 2.0 * theta * (e1 + 2.0 * e2 * squared)
    }

    /// chi of theta, and its derivative.
    #[inline]
    fn image(&self, theta: f64) -> (f64, f64) {
        let linearity = self.linearity.value();
        let (sin, cos) = (linearity * theta).sin_cos();
        if linearity.abs() < NO_LINEARITY {
            (theta, 1.0)
        } else if linearity > 0.0 {
            (sin / cos / linearity, 1.0 / (cos * cos))
        } else {
            (sin / linearity, cos)
        }
    }

    /// theta of chi, and its derivative; `None` beyond the largest chi.
    #[inline]
    fn angle(&self, chi: f64) -> Option<(f64, f64)> {
        let linearity = self.linearity.value();
        let scaled = linearity * chi;
        if linearity.abs() < NO_LINEARITY {
            Some((chi, 1.0))
        } else if linearity > 0.0 {
            Some((scaled.atan() / linearity, 1.0 / (1.0 + scaled * scaled)))
        } else {
            let cos = (1.0 - scaled * scaled).sqrt();
            (cos > 0.0).then(|| (scaled.asin() / linearity, 1.0 / cos))
        }
    }
}
