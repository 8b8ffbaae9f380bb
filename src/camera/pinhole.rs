//! The ideal camera.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2};

use super::sensor::Sensor;
use super::{BadLens, LensError};
use crate::frame::{self, Pixel, Point, Ray};

/// Focal lengths and principal point, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the columns, pixels, above zero.
    pub fx: f64,
    /// Focal length along the rows, pixels, above zero.
    pub fy: f64,
    /// Column of the principal point.
    pub cx: f64,
    /// Row of the principal point.
    pub cy: f64,
}

impl Intrinsics {
    /// The camera matrix K.
    pub fn matrix(&self) -> Matrix3<f64> {
        let Self { fx, fy, cx, cy } = *self;
        Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    }

    pub(super) fn check(&self) -> Result<(), BadLens> {
        let positive = |f: f64| f > 0.0 && f.is_finite();
        let Self { fx, fy, cx, cy } = *self;
        if positive(fx) && positive(fy) && cx.is_finite() && cy.is_finite() {
            Ok(())
        } else {
            Err(BadLens::Intrinsics { fx, fy, cx, cy })
        }
    }
}

/// A camera without distortion: `u = fx x / z + cx`, `v = fy y / z + cy`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    intrinsics: Intrinsics,
    sensor: Sensor,
}

impl Pinhole {
    /// The camera of these intrinsics.
    ///
    /// # Errors
    /// [`BadLens::Intrinsics`].
    pub fn new(intrinsics: Intrinsics) -> Result<Self, BadLens> {
        intrinsics.check()?;
        let sensor = Sensor::new(intrinsics.matrix()).ok_or(BadLens::Singular)?;
        Ok(Self { intrinsics, sensor })
    }

    /// Its intrinsics.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        self.sensor.perspective_ray(pixel)
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        self.sensor.perspective_ray_with_jacobian(pixel)
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        self.sensor.perspective_pixel(point)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        self.sensor.perspective_pixel_with_jacobian(point)
    }
}
