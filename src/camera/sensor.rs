//! The projective map between the distorted image plane and the pixels.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2};

use super::perspective::{direction_of_plane, plane_of_point, product};
use super::{LensError, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// A homography from the distorted image plane at unit depth to pixels: a camera matrix, one behind
/// a tilted sensor, or the three vectors H, V, A of a CAHV model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sensor {
    pixel_from_plane: Matrix3<f64>,
    plane_from_pixel: Matrix3<f64>,
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
        pixel_from_plane.try_inverse().map(|plane_from_pixel| Self {
            pixel_from_plane,
            plane_from_pixel,
        })
    }

    /// The pixel of a place on the distorted plane, and its derivative.
    ///
    /// # Errors
    /// [`LensError::BehindCamera`] where the sensor's depth of the place is not above zero.
    #[inline]
    pub(super) fn pixel(&self, plane: Vector2<f64>) -> Result<(Pixel, Matrix2<f64>), LensError> {
        let (pixel, jacobian) =
            transfer(&self.pixel_from_plane, plane).ok_or(LensError::BehindCamera)?;
        Ok((pixel.into(), jacobian))
    }

    /// The place on the distorted plane that a pixel shows, and its derivative.
    ///
    /// # Errors
    /// [`LensError::OutsideField`] where there is none in front of the plane's axis.
    #[inline]
    pub(super) fn plane(&self, pixel: Pixel) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        transfer(&self.plane_from_pixel, pixel.to_vector()).ok_or(LensError::OutsideField)
    }
}

#[inline(always)]
fn transfer(matrix: &Matrix3<f64>, place: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let seen = product(matrix, &place.push(1.0));
    let inverse = 1.0 / seen.z;
    let image = seen.xy() * inverse;
    // A place whose square overflows has no direction in these numbers.
    let ahead = seen.z > 0.0 && image.norm_squared().is_finite();
    ahead.then(|| {
        let [x, y] = [image.x, image.y];
        let m = matrix;
        let slope = Matrix2::new(
            (m.m11 - x * m.m31) * inverse,
            (m.m12 - x * m.m32) * inverse,
            (m.m21 - y * m.m31) * inverse,
            (m.m22 - y * m.m32) * inverse,
        );
        (image, slope)
    })
}

/// The two ways through a lens without distortion.
impl Sensor {
    /// The ray of a pixel, with the derivative of its direction.
    #[inline]
    pub(super) fn perspective_ray(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (plane, plane_by_pixel) = self.plane(pixel)?;
        let (direction, by_plane) = direction_of_plane(plane);
        Ok((central_ray(direction), product(&by_plane, &plane_by_pixel)))
    }

    /// The pixel of a point, with its derivative.
    #[inline]
    pub(super) fn perspective_pixel(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let (plane, by_point) = plane_of_point(point.xyz)?;
        let (pixel, by_plane) = self.pixel(plane)?;
        Ok((pixel, product(&by_plane, &by_point)))
    }
}
