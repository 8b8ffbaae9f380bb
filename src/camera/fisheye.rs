//! OpenCV's fisheye model.

use std::f64::consts::PI;

use nalgebra::{Matrix2x3, Matrix3x2, Vector3};

use super::angle::{
    angle_of_point, angle_of_point_with_jacobian, direction_of_angle,
    direction_of_angle_with_jacobian,
};
use super::lanes::Central;
use super::perspective::product;
use super::radial::Radial;
use super::sensor::Sensor;
use super::{BadLens, Intrinsics, LensError, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// An equidistant lens with a polynomial in the angle from the axis (Kannala and Brandt 2006, as
/// OpenCV's `fisheye` module has it):
/// `theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`,
/// `u = fx theta_d x / hypot(x, y) + cx`, `v` likewise.
///
/// `theta` is taken from 0 to 180 degrees; points beside and behind the plane of the camera are in
/// the field where the polynomial still grows.
#[derive(Debug, Clone, PartialEq)]
pub struct Fisheye {
    intrinsics: Intrinsics,
    distortion: [f64; 4],
    radial: Radial,
    sensor: Sensor,
}

impl Fisheye {
    /// The lens of these intrinsics and k1, k2, k3, k4.
    ///
    /// # Errors
    /// [`BadLens::Intrinsics`], [`BadLens::Distortion`].
    pub fn new(intrinsics: Intrinsics, distortion: [f64; 4]) -> Result<Self, BadLens> {
        intrinsics.check()?;
        let [k1, k2, k3, k4] = distortion;
        let radial = Radial::up_to(PI, [1.0, k1, k2, k3, k4], [1.0, 0.0, 0.0, 0.0])
            .ok_or(BadLens::Distortion)?;
        Ok(Self {
            intrinsics,
            distortion,
            radial,
            sensor: Sensor::new(intrinsics.matrix()).ok_or(BadLens::Singular)?,
        })
    }

    /// Its intrinsics.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// k1, k2, k3, k4.
    pub fn distortion(&self) -> [f64; 4] {
        self.distortion
    }

    /// The angle from the axis up to which the model is one to one, radians.
    pub fn field_angle(&self) -> f64 {
        self.radial.limit()
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (distorted, distorted_by_pixel) = self.sensor.plane_with_jacobian(pixel)?;
        let (angle, by_distorted) = self.radial.undistort_with_jacobian(distorted)?;
        let (direction, by_angle) = direction_of_angle_with_jacobian(angle);
        let jacobian = product(&by_angle, &product(&by_distorted, &distorted_by_pixel));
        Ok((central_ray(direction), jacobian))
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        let angle = angle_of_point(point.xyz)?;
        self.sensor.pixel(self.radial.distort(angle)?)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let (angle, by_point) = angle_of_point_with_jacobian(point.xyz)?;
        let (distorted, by_angle) = self.radial.distort_with_jacobian(angle)?;
        let (pixel, by_distorted) = self.sensor.pixel_with_jacobian(distorted)?;
        Ok((
            pixel,
            product(&product(&by_distorted, &by_angle), &by_point),
        ))
    }
}

impl Central for Fisheye {
    #[inline(always)]
    fn directions<const N: usize>(&self, pixels: &[Pixel; N]) -> [Vector3<f64>; N] {
        let angles = self.radial.undistort_nearby(&self.sensor.planes(pixels));
        std::array::from_fn(|i| direction_of_angle(angles.get(i)))
    }

    fn searched_direction(&self, pixel: Pixel) -> Result<Vector3<f64>, LensError> {
        let angle = self.radial.undistort(self.sensor.plane(pixel)?)?;
        Ok(direction_of_angle(angle))
    }
}
