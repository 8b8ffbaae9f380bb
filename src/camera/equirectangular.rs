//! A panorama.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2x3, Matrix3x2, Vector3};

use super::{LensError, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// A panorama whose columns are equal steps of azimuth over 360 degrees and whose rows are equal
/// steps of elevation over 180 degrees.
///
/// The centre of the picture looks forward along z, azimuth grows to the right and the first row
/// lies at the zenith (against y). The picture's left and right borders, at -0.5 and
/// `width - 0.5`, are the same direction, straight backward; columns beyond them go on around.
/// Exactly at its poles every column is the same direction, so a point there has no pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equirectangular {
    columns: f64,
    rows: f64,
}

impl Equirectangular {
    /// The panorama of a picture of this size.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            columns: f64::from(width.max(1)),
            rows: f64::from(height.max(1)),
        }
    }

    // Discarded derivatives are a handful of products beside four trigonometric functions.
    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        Ok(self.ray_with_jacobian(pixel)?.0)
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (by_column, by_row) = self.steps();
        let azimuth = (pixel.u - 0.5 * (self.columns - 1.0)) * by_column;
        let elevation = (pixel.v - 0.5 * (self.rows - 1.0)) * by_row;
        // The border itself is the pole, whatever the rounding.
        let on_sphere = elevation.abs() <= FRAC_PI_2 * (1.0 + 1e-12);
        if !azimuth.is_finite() || !on_sphere {
            return Err(LensError::OutsideField);
        }
        let (sin_a, cos_a) = azimuth.sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        let direction = Vector3::new(cos_e * sin_a, -sin_e, cos_e * cos_a);
        let jacobian = Matrix3x2::new(
            cos_e * cos_a * by_column,
            -sin_e * sin_a * by_row,
            0.0,
            -cos_e * by_row,
            -cos_e * sin_a * by_column,
            -sin_e * cos_a * by_row,
        );
        Ok((central_ray(direction), jacobian))
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        Ok(self.pixel_with_jacobian(point)?.0)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let [x, y, z] = point.xyz.into();
        let (by_column, by_row) = self.steps();
        let across = x.hypot(z);
        let squared = point.xyz.norm_squared();
        if !(across > 0.0 && squared.is_finite()) {
            return Err(LensError::OutsideField);
        }
        let azimuth = x.atan2(z);
        let elevation = (-y).atan2(across);
        let pixel = Pixel::new(
            azimuth / by_column + 0.5 * (self.columns - 1.0),
            elevation / by_row + 0.5 * (self.rows - 1.0),
        );
        let turn = 1.0 / (across * across * by_column);
        let lift = 1.0 / (squared * by_row);
        let jacobian = Matrix2x3::new(
            z * turn,
            0.0,
            -x * turn,
            x * y / across * lift,
            -across * lift,
            z * y / across * lift,
        );
        Ok((pixel, jacobian))
    }

    /// Azimuth per column and elevation per row, radians.
    #[inline]
    fn steps(&self) -> (f64, f64) {
        (2.0 * PI / self.columns, -PI / self.rows)
    }
}
