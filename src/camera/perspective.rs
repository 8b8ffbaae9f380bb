//! The plane at unit depth: points and directions in front of a camera as `(x / z, y / z)`.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, SMatrix, Vector2, Vector3};

use super::LensError;

/// Where the line to `point` meets the plane z = 1.
///
/// # Errors
/// [`LensError::BehindCamera`] where z is not above zero.
#[inline]
pub(super) fn plane_of_point(point: Vector3<f64>) -> Result<Vector2<f64>, LensError> {
    if point.z > 0.0 && point.iter().all(|c| c.is_finite()) {
        Ok(point.xy() * (1.0 / point.z))
    } else {
        Err(LensError::BehindCamera)
    }
}

/// The derivative of [`plane_of_point`] at a point of depth `z` seen at `plane`.
#[inline]
pub(super) fn plane_by_point(plane: Vector2<f64>, z: f64) -> Matrix2x3<f64> {
    let inverse = 1.0 / z;
    Matrix2x3::new(
        inverse,
        0.0,
        -plane.x * inverse,
        0.0,
        inverse,
        -plane.y * inverse,
    )
}

/// The unit direction to a place on the plane z = 1.
#[inline(always)]
pub(super) fn direction_of_plane(plane: Vector2<f64>) -> Vector3<f64> {
    let inverse = 1.0 / (1.0 + plane.norm_squared()).sqrt();
    Vector3::new(plane.x * inverse, plane.y * inverse, inverse)
}

/// The derivative of [`direction_of_plane`] by the place, where it gives `unit`.
#[inline]
pub(super) fn direction_by_plane(unit: Vector3<f64>) -> Matrix3x2<f64> {
    let bend = unit.xy() * unit.z;
    Matrix3x2::new(
        unit.z - unit.x * bend.x,
        -unit.x * bend.y,
        -unit.y * bend.x,
        unit.z - unit.y * bend.y,
        -unit.z * bend.x,
        -unit.z * bend.y,
    )
}

/// The derivative of a radial map of the plane at a place in the direction `unit` from its centre:
/// `along` is the derivative of the new radius by the old one, `across` their ratio.
#[inline]
pub(super) fn radial_jacobian(unit: Vector2<f64>, along: f64, across: f64) -> Matrix2<f64> {
    let bend = unit * (along - across);
    let mixed = unit.x * bend.y;
    Matrix2::new(
        across + unit.x * bend.x,
        mixed,
        mixed,
        across + unit.y * bend.y,
    )
}

/// The product of two small matrices, the chain rule's step.
///
/// The library's own product goes through memory element by element, and chains of it wait for the
/// stores: most models run about twice as fast with this one.
#[inline(always)]
pub(super) fn product<const R: usize, const K: usize, const C: usize>(
    a: &SMatrix<f64, R, K>,
    b: &SMatrix<f64, K, C>,
) -> SMatrix<f64, R, C> {
    let mut product = SMatrix::<f64, R, C>::zeros();
    for j in 0..C {
        for i in 0..R {
            let mut sum = 0.0;
            for k in 0..K {
                sum += a.data.0[k][i] * b.data.0[j][k];
            }
            product.data.0[j][i] = sum;
        }
    }
    product
}
