//! Directions as vectors whose length is the angle from the optical axis.
//!
//! A direction at the angle `theta` from z is `theta` times the unit vector of its part across z,
//! which, unlike the plane at unit depth, reaches past 90 degrees.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::LensError;
use super::perspective::radial_jacobian;

/// The angle vector of the direction to `point`, radians.
///
/// # Errors
/// [`LensError::BehindCamera`] straight behind the camera, where the azimuth is undefined.
#[inline]
pub(super) fn angle_of_point(point: Vector3<f64>) -> Result<Vector2<f64>, LensError> {
    let across = point.xy().norm();
    let squared = point.norm_squared();
    if !(squared > 0.0 && squared.is_finite()) || (across == 0.0 && point.z < 0.0) {
        return Err(LensError::BehindCamera);
    }
    if across == 0.0 {
        return Ok(Vector2::zeros());
    }
    // Half as long as the arctangent of two arguments.
    let theta = if point.z > 0.0 {
        (across / point.z).atan()
    } else {
        across.atan2(point.z)
    };
    Ok(point.xy() * (theta / across))
}

/// As [`angle_of_point`], with the derivative by the point.
///
/// # Errors
/// As [`angle_of_point`].
#[inline]
pub(super) fn angle_of_point_with_jacobian(
    point: Vector3<f64>,
) -> Result<(Vector2<f64>, Matrix2x3<f64>), LensError> {
    let angle = angle_of_point(point)?;
    let across = point.xy().norm();
    let squared = point.norm_squared();
    if across == 0.0 {
        let inverse = 1.0 / point.z;
        let jacobian = Matrix2x3::new(inverse, 0.0, 0.0, 0.0, inverse, 0.0);
        return Ok((angle, jacobian));
    }
    let unit = point.xy() / across;
    let ratio = angle.norm() / across;
    let jacobian = angle_jacobian(unit, point.z / squared, ratio, -across / squared);
    Ok((angle, jacobian))
}

/// The derivative of an angle vector `theta * unit` by a point whose part across z has the direction
/// `unit`: `by_across` and `by_depth` are the derivatives of theta by the point's distance from the
/// axis and by its depth, `ratio` is theta over that distance.
#[inline]
pub(super) fn angle_jacobian(
    unit: Vector2<f64>,
    by_across: f64,
    ratio: f64,
    by_depth: f64,
) -> Matrix2x3<f64> {
    let plane = radial_jacobian(unit, by_across, ratio);
    let depth = unit * by_depth;
    Matrix2x3::from_columns(&[plane.column(0).into(), plane.column(1).into(), depth])
}

/// The unit direction of an angle vector.
#[inline]
pub(super) fn direction_of_angle(angle: Vector2<f64>) -> Vector3<f64> {
    let theta = angle.norm();
    if theta == 0.0 {
        return Vector3::z();
    }
    let (sin, cos) = theta.sin_cos();
    let across = angle * (sin / theta);
    Vector3::new(across.x, across.y, cos)
}

/// As [`direction_of_angle`], with the derivative by the vector.
#[inline]
pub(super) fn direction_of_angle_with_jacobian(
    angle: Vector2<f64>,
) -> (Vector3<f64>, Matrix3x2<f64>) {
    let direction = direction_of_angle(angle);
    let theta = angle.norm();
    if theta == 0.0 {
        return (direction, Matrix3x2::identity());
    }
    let unit = angle / theta;
    let (sin, cos) = theta.sin_cos();
    let plane = radial_jacobian(unit, cos, sin / theta);
    let jacobian = Matrix3x2::new(
        plane.m11,
        plane.m12,
        plane.m21,
        plane.m22,
        -sin * unit.x,
        -sin * unit.y,
    );
    (direction, jacobian)
}
