//! The inverse where a few steps from a good guess do not lead to it.

use nalgebra::{Matrix2, Vector2};

use super::{BrownConrady, norm_squared, product, upright_inverse};
use crate::camera::LensError;

impl BrownConrady {
    /// The place whose distorted place is given, and its derivative: damped Newton steps from where
    /// the radial part alone would put it, never leaving the field.
    #[cold]
    #[inline(never)]
    pub(super) fn undistort_anywhere(
        &self,
        distorted: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let mut place = self.start(distorted)?;
        let (seen, mut jacobian) = self.distort(place)?;
        let mut miss = distorted - seen;
        let enough = 4.0 * f64::EPSILON * (1.0 + distorted.norm());
        // The error of a step is of the order of its square; a hundred covers the curvature.
        let is_last = |step: Vector2<f64>, inverse: &Matrix2<f64>| {
            1e4 * step.norm_squared().powi(2) * norm_squared(inverse) <= f64::EPSILON * f64::EPSILON
        };
        for _ in 0..60 {
            let inverse = upright_inverse(&jacobian)?;
            let step = product(&inverse, &miss);
            if miss.norm() <= enough || is_last(step, &inverse) {
                return Ok((place + step, inverse));
            }
            let mut share = 1.0;
            loop {
                let next = place + step * share;
                // A step out of the field, or one that brings nothing, is halved.
                if let Ok((seen, slope)) = self.distort(next) {
                    let rest = distorted - seen;
                    if slope.determinant() > 0.0 && rest.norm() < miss.norm() {
                        (place, jacobian, miss) = (next, slope, rest);
                        break;
                    }
                }
                share *= 0.5;
                if share < 1e-6 {
                    return self.stalled(place, miss, inverse);
                }
            }
        }
        Err(LensError::NoConvergence)
    }

    /// Where no step improves any more: the answer to rounding, or there is none.
    fn stalled(
        &self,
        place: Vector2<f64>,
        miss: Vector2<f64>,
        inverse: Matrix2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        if miss.norm() <= 1e-12 * (1.0 + place.norm()) {
            Ok((place, inverse))
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// The place by the radial part alone; a little inside the field's edge for what lies beyond
    /// it, since the decentring terms may yet bring it in.
    fn start(&self, distorted: Vector2<f64>) -> Result<Vector2<f64>, LensError> {
        let norm = distorted.norm();
        if norm == 0.0 {
            return Ok(distorted);
        }
        match self.radial.radius(norm, 1e-3) {
            Ok(radius) => Ok(distorted * (radius.min(0.999 * self.radial.limit()) / norm)),
            Err(LensError::OutsideField) if self.radial.limit().is_finite() => {
                Ok(distorted * (0.999 * self.radial.limit() / norm))
            }
            Err(error) => Err(error),
        }
    }
}
