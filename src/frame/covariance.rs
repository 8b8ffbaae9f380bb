//! Covariances as a map shows them.

use nalgebra::{Matrix2, SymmetricEigen};

/// The 1-sigma ellipse of a horizontal covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Standard deviation along the long axis, metres.
    pub sigma_major_m: f64,
    /// Standard deviation along the short axis, metres.
    pub sigma_minor_m: f64,
    /// Azimuth of the long axis, radians clockwise from north, in [0, pi).
    pub azimuth: f64,
}

/// The square of the 95 % radius of a two-dimensional standard normal, `-2 ln 0.05`.
pub const CHI2_2D_95: f64 = 5.991_464_547_107_98;

impl Ellipse {
    /// How many sigmas the 95 % ellipse lies out: `sqrt(-2 ln 0.05)` = 2.4477.
    pub fn scale_95() -> f64 {
        CHI2_2D_95.sqrt()
    }
}

/// The 1-sigma ellipse of a covariance over (east, north), m^2.
pub fn covariance_ellipse(cov: Matrix2<f64>) -> Ellipse {
    let eigen = SymmetricEigen::new((cov + cov.transpose()) * 0.5);
    let major = usize::from(eigen.eigenvalues[1] > eigen.eigenvalues[0]);
    let axis = eigen.eigenvectors.column(major);
    let azimuth = axis[0].atan2(axis[1]).rem_euclid(std::f64::consts::PI);
    Ellipse {
        sigma_major_m: eigen.eigenvalues[major].max(0.0).sqrt(),
        sigma_minor_m: eigen.eigenvalues[1 - major].max(0.0).sqrt(),
        azimuth,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_is_clockwise_from_north() {
        let (s, c) = 30f64.to_radians().sin_cos();
        let axis = nalgebra::Vector2::new(s, c); // azimuth 30: mostly north, a little east
        let across = nalgebra::Vector2::new(c, -s);
        let e = covariance_ellipse(axis * axis.transpose() * 4.0 + across * across.transpose());
        assert!((e.azimuth.to_degrees() - 30.0).abs() < 1e-9);
        assert!((e.sigma_major_m - 2.0).abs() < 1e-12 && (e.sigma_minor_m - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_circle_has_equal_axes() {
        let e = covariance_ellipse(Matrix2::identity() * 0.25);
        assert_eq!((e.sigma_major_m, e.sigma_minor_m), (0.5, 0.5));
    }
}
