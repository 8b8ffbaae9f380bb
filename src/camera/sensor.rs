//! The projective map between the distorted image plane and the pixels.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, RowVector3, Vector2};

use super::lanes::Places;
use super::perspective::{
    direction_by_plane, direction_of_plane, plane_by_point, plane_of_point, product,
};
use super::{LensError, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// A homography from the distorted image plane at unit depth to pixels: a camera matrix, one behind
/// a tilted sensor, or the three vectors H, V, A of a CAHV model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sensor {
    pixel_from_plane: Matrix3<f64>,
    plane_from_pixel: Matrix3<f64>,
    /// Whether the depth is one everywhere.
    is_affine: bool,
}

impl Sensor {
    /// From the matrix whose rows give column, row and depth; `None` where it has no inverse.
    pub(super) fn new(pixel_from_plane: Matrix3<f64>) -> Option<Self> {
        // Rows in pixels and in ones differ by thousands: the determinant is judged beside them.
        let scale: f64 = pixel_from_plane.row_iter().map(|r| r.norm()).product();
        let determinant = pixel_from_plane.determinant();
        let spans = determinant.abs() > 1e-12 * scale;
        if !spans || !scale.is_finite() {
            return None;
        }
        let depth = RowVector3::new(0.0, 0.0, 1.0);
        let is_affine = pixel_from_plane.row(2) == depth;
        let mut plane_from_pixel = pixel_from_plane.try_inverse()?;
        if is_affine {
            plane_from_pixel.set_row(2, &depth);
        }
        Some(Self {
            pixel_from_plane,
            plane_from_pixel,
            is_affine,
        })
    }

    /// The pixel of a place on the distorted plane.
    ///
    /// # Errors
    /// [`LensError::BehindCamera`] where the sensor's depth of the place is not above zero.
    #[inline]
    pub(super) fn pixel(&self, plane: Vector2<f64>) -> Result<Pixel, LensError> {
        self.transfer(&self.pixel_from_plane, plane)
            .map(Pixel::from)
            .ok_or(LensError::BehindCamera)
    }

    /// As [`Sensor::pixel`], with the derivative.
    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        plane: Vector2<f64>,
    ) -> Result<(Pixel, Matrix2<f64>), LensError> {
        let pixel = self.pixel(plane)?;
        let matrix = &self.pixel_from_plane;
        Ok((pixel, slope(matrix, plane, pixel.to_vector())))
    }

    /// The place on the distorted plane that a pixel shows.
    ///
    /// # Errors
    /// [`LensError::OutsideField`] where there is none in front of the plane's axis.
    #[inline]
    pub(super) fn plane(&self, pixel: Pixel) -> Result<Vector2<f64>, LensError> {
        self.transfer(&self.plane_from_pixel, pixel.to_vector())
            .ok_or(LensError::OutsideField)
    }

    /// The places on the distorted plane that pixels show; not numbers where there is none.
    #[inline(always)]
    pub(super) fn planes<const N: usize>(&self, pixels: &[Pixel; N]) -> Places<N> {
        let m = &self.plane_from_pixel;
        Places::from_fn(|i| {
            let Pixel { u, v } = pixels[i];
            let x = m.m11 * u + m.m12 * v + m.m13;
            let y = m.m21 * u + m.m22 * v + m.m23;
            if self.is_affine {
                return Vector2::new(x, y);
            }
            let depth = m.m31 * u + m.m32 * v + m.m33;
            let scale = if depth > 0.0 { 1.0 / depth } else { f64::NAN };
            Vector2::new(x, y) * scale
        })
    }

    /// As [`Sensor::plane`], with the derivative.
    #[inline]
    pub(super) fn plane_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let plane = self.plane(pixel)?;
        let matrix = &self.plane_from_pixel;
        Ok((plane, slope(matrix, pixel.to_vector(), plane)))
    }

    /// Where a homography takes a place; `None` where it is behind, or too far out for numbers.
    #[inline(always)]
    fn transfer(&self, m: &Matrix3<f64>, place: Vector2<f64>) -> Option<Vector2<f64>> {
        let x = m.m11 * place.x + m.m12 * place.y + m.m13;
        let y = m.m21 * place.x + m.m22 * place.y + m.m23;
        let image = if self.is_affine {
            Vector2::new(x, y)
        } else {
            let depth = m.m31 * place.x + m.m32 * place.y + m.m33;
            let ahead = depth > 0.0;
            if !ahead {
                return None;
            }
            Vector2::new(x, y) * (1.0 / depth)
        };
        // A place whose square overflows has no direction in these numbers.
        image.norm_squared().is_finite().then_some(image)
    }
}

/// The derivative of a homography at a place whose image is given.
#[inline(always)]
fn slope(m: &Matrix3<f64>, place: Vector2<f64>, image: Vector2<f64>) -> Matrix2<f64> {
    let inverse = 1.0 / (m.m31 * place.x + m.m32 * place.y + m.m33);
    let [x, y] = [image.x, image.y];
    Matrix2::new(
        (m.m11 - x * m.m31) * inverse,
        (m.m12 - x * m.m32) * inverse,
        (m.m21 - y * m.m31) * inverse,
        (m.m22 - y * m.m32) * inverse,
    )
}

/// The two ways through a lens without distortion.
impl Sensor {
    /// The ray of a pixel.
    #[inline]
    pub(super) fn perspective_ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        Ok(central_ray(direction_of_plane(self.plane(pixel)?)))
    }

    /// The ray of a pixel, with the derivative of its direction.
    #[inline]
    pub(super) fn perspective_ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (plane, plane_by_pixel) = self.plane_with_jacobian(pixel)?;
        let direction = direction_of_plane(plane);
        let by_plane = direction_by_plane(direction);
        Ok((central_ray(direction), product(&by_plane, &plane_by_pixel)))
    }

    /// The pixel of a point.
    #[inline]
    pub(super) fn perspective_pixel(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<Pixel, LensError> {
        self.pixel(plane_of_point(point.xyz)?)
    }

    /// The pixel of a point, with its derivative.
    #[inline]
    pub(super) fn perspective_pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let plane = plane_of_point(point.xyz)?;
        let (pixel, by_plane) = self.pixel_with_jacobian(plane)?;
        let by_point = plane_by_point(plane, point.xyz.z);
        Ok((pixel, product(&by_plane, &by_point)))
    }
}
