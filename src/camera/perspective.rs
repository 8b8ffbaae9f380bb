//! The plane at unit depth: points and directions in front of a camera as `(x / z, y / z)`.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::LensError;

/// Where the line to `point` meets the plane z = 1, and its derivative by the point.
///
/// # Errors
/// [`LensError::BehindCamera`] where z is not above zero.
#[inline]
pub(super) fn plane_of_point(
    point: Vector3<f64>,
) -> Result<(Vector2<f64>, Matrix2x3<f64>), LensError> {
    if point.z > 0.0 && point.iter().all(|c| c.is_finite()) {
        let inverse = 1.0 / point.z;
        let plane = point.xy() * inverse;
        let jacobian = Matrix2x3::new(
            inverse,
            0.0,
            -plane.x * inverse,
            0.0,
            inverse,
            -plane.y * inverse,
        );
        Ok((plane, jacobian))
    } else {
        Err(LensError::BehindCamera)
    }
}

/// The unit direction to a place on the plane z = 1, and its derivative by that place.
#[inline]
pub(super) fn direction_of_plane(plane: Vector2<f64>) -> (Vector3<f64>, Matrix3x2<f64>) {
    let inverse = 1.0 / (1.0 + plane.norm_squared()).sqrt();
    let unit = Vector3::new(plane.x, plane.y, 1.0) * inverse;
    let along = unit * plane.transpose() * (inverse * inverse);
    let jacobian = Matrix3x2::new(inverse, 0.0, 0.0, inverse, 0.0, 0.0) - along;
    (unit, jacobian)
}

/// The derivative of a radial map of the plane at a place in the direction `unit` from its centre:
/// `along` is the derivative of the new radius by the old one, `across` their ratio.
#[inline]
pub(super) fn radial_jacobian(unit: Vector2<f64>, along: f64, across: f64) -> Matrix2<f64> {
    Matrix2::from_diagonal_element(across) + unit * unit.transpose() * (along - across)
}
