//! Small symmetric algebra on at most four rows of a measurement.
//!
//! Measurements have two to four rows, most of them three; the hot loops of fusion factor millions
//! of such matrices, and loops over the rows there are cost less than matrices of fixed size.

use nalgebra::{Matrix4, Matrix6, SMatrix};

/// Four by four, row by row.
pub(super) type Square4 = [[f64; 4]; 4];
/// Derivatives of four rows by the six errors of a pose.
pub(super) type ByPose = [[f64; 6]; 4];
/// Six by six, row by row.
pub(super) type Square6 = [[f64; 6]; 6];

/// `h s h^T` of the first `n` rows: the spread that N uncertain unknowns give the rows.
#[inline]
pub(super) fn spread<const N: usize>(h: &[[f64; N]; 4], s: &[[f64; N]; N], n: usize) -> Square4 {
    let mut out = [[0.0; 4]; 4];
    for a in 0..n {
        let mut left = [0.0; N];
        for (value, row) in h[a].iter().zip(s) {
            for (l, x) in left.iter_mut().zip(row) {
                *l += value * x;
            }
        }
        for b in 0..=a {
            let mut dot = 0.0;
            for (l, x) in left.iter().zip(&h[b]) {
                dot += l * x;
            }
            out[a][b] = dot;
            out[b][a] = dot;
        }
    }
    out
}

/// The lower Cholesky factor of the first `n` rows, with the logarithm of the determinant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factor4 {
    lower: Square4,
    /// Reciprocals of the diagonal.
    pivots: [f64; 4],
    pub(super) ln_det: f64,
    n: usize,
}

impl Factor4 {
    /// `None` where the matrix is not positive definite.
    #[inline]
    pub(super) fn new(s: &Square4, n: usize) -> Option<Self> {
        let mut lower = [[0.0; 4]; 4];
        let mut pivots = [1.0; 4];
        let mut det = 1.0;
        for i in 0..n {
            for j in 0..=i {
                let mut rest = s[i][j];
                for k in 0..j {
                    rest -= lower[i][k] * lower[j][k];
                }
                if i == j {
                    if rest.is_nan() || rest <= 0.0 {
                        return None;
                    }
                    det *= rest;
                    lower[i][i] = rest.sqrt();
                    pivots[i] = 1.0 / lower[i][i];
                } else {
                    lower[i][j] = rest * pivots[j];
                }
            }
        }
        Some(Self {
            lower,
            pivots,
            ln_det: det.ln(),
            n,
        })
    }

    /// `e^T s^-1 e`.
    #[inline]
    pub(super) fn mahalanobis2(&self, e: &[f64; 4]) -> f64 {
        let mut white = [0.0; 4];
        let mut sum = 0.0;
        for i in 0..self.n {
            let mut rest = e[i];
            for k in 0..i {
                rest -= self.lower[i][k] * white[k];
            }
            white[i] = rest * self.pivots[i];
            sum += white[i] * white[i];
        }
        sum
    }

    /// `s^-1 b`.
    #[inline]
    pub(super) fn solve(&self, b: &[f64; 4]) -> [f64; 4] {
        let mut x = [0.0; 4];
        for i in 0..self.n {
            let mut rest = b[i];
            for k in 0..i {
                rest -= self.lower[i][k] * x[k];
            }
            x[i] = rest * self.pivots[i];
        }
        for i in (0..self.n).rev() {
            let mut rest = x[i];
            for k in i + 1..self.n {
                rest -= self.lower[k][i] * x[k];
            }
            x[i] = rest * self.pivots[i];
        }
        x
    }

    /// `s^-1`; zeros beyond the rows there are.
    #[inline]
    pub(super) fn inverse(&self) -> Square4 {
        let mut out = [[0.0; 4]; 4];
        for c in 0..self.n {
            let mut unit = [0.0; 4];
            unit[c] = 1.0;
            out[c] = self.solve(&unit);
        }
        out
    }
}

/// `a += w h^T m h`, of the first `n` rows: the information that the rows give N unknowns.
#[inline]
pub(super) fn add_information<const N: usize>(
    a: &mut [[f64; N]; N],
    h: &[[f64; N]; 4],
    m: &Square4,
    n: usize,
    w: f64,
) {
    for r in 0..n {
        let mut left = [0.0; N];
        for s in 0..n {
            for (l, x) in left.iter_mut().zip(&h[s]) {
                *l += m[r][s] * x;
            }
        }
        for (i, row) in a.iter_mut().enumerate() {
            let scale = w * h[r][i];
            for (x, l) in row.iter_mut().zip(&left) {
                *x += scale * l;
            }
        }
    }
}

/// The inverse of a positive definite matrix whose rows have different units, with the logarithm of
/// its determinant.
pub(super) fn inverse4(a: &Square4) -> Option<(Square4, f64)> {
    let scale: [f64; 4] = std::array::from_fn(|i| 1.0 / a[i][i].sqrt());
    let scaled: Square4 =
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] * scale[i] * scale[j]));
    let factor = Factor4::new(&scaled, 4)?;
    let inverse = factor.inverse();
    let out = std::array::from_fn(|i| std::array::from_fn(|j| inverse[i][j] * scale[i] * scale[j]));
    let ln_scale: f64 = scale.iter().map(|s| s.ln()).sum();
    Some((out, factor.ln_det - 2.0 * ln_scale))
}

/// The same of six rows.
pub(super) fn inverse6(a: &Square6) -> Option<(Square6, f64)> {
    let scale: [f64; 6] = std::array::from_fn(|i| 1.0 / a[i][i].sqrt());
    let scaled = Matrix6::from_fn(|i, j| a[i][j] * scale[i] * scale[j]);
    let factor = scaled.cholesky()?;
    let inverse = factor.inverse();
    let out =
        std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)] * scale[i] * scale[j]));
    let ln_scale: f64 = scale.iter().map(|s| s.ln()).sum();
    Some((out, factor.ln_determinant() - 2.0 * ln_scale))
}

/// As the algebra library has it.
pub(super) fn to_matrix4(a: &Square4) -> Matrix4<f64> {
    Matrix4::from_fn(|i, j| a[i][j])
}

/// As the algebra library has it.
pub(super) fn to_matrix6(a: &Square6) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| a[i][j])
}

/// From the algebra library's.
pub(super) fn from_matrix<const N: usize>(a: &SMatrix<f64, N, N>) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: Square4 = [
        [4.0, 1.0, 0.5, 0.2],
        [1.0, 3.0, 0.1, -0.4],
        [0.5, 0.1, 2.0, 0.3],
        [0.2, -0.4, 0.3, 1.5],
    ];

    #[test]
    fn factor_agrees_with_the_library() {
        let e = [1.0, -2.0, 0.5, 0.7];
        for n in 2..=4 {
            let whole = to_matrix4(&S);
            let block = whole.view((0, 0), (n, n)).into_owned();
            let inverse = block.clone().try_inverse().unwrap();
            let factor = Factor4::new(&S, n).unwrap();
            assert!((factor.ln_det - block.determinant().ln()).abs() < 1e-14);
            let v = nalgebra::DVector::from_column_slice(&e[..n]);
            let expected = (v.transpose() * &inverse * &v)[0];
            assert!((factor.mahalanobis2(&e) - expected).abs() < 1e-13);
            let found = factor.inverse();
            for i in 0..n {
                for j in 0..n {
                    assert!((found[i][j] - inverse[(i, j)]).abs() < 1e-14);
                }
            }
        }
        let (inverse, ln_det) = inverse4(&S).unwrap();
        let expected = to_matrix4(&S).try_inverse().unwrap();
        assert!((to_matrix4(&inverse) - expected).amax() < 1e-14);
        assert!((ln_det - to_matrix4(&S).determinant().ln()).abs() < 1e-14);
        assert!(Factor4::new(&[[-1.0; 4]; 4], 2).is_none());
    }

    #[test]
    fn spreads_are_congruences() {
        let h: Square4 = std::array::from_fn(|i| std::array::from_fn(|j| (i * 4 + j) as f64 * 0.3));
        let expected = to_matrix4(&h) * to_matrix4(&S) * to_matrix4(&h).transpose();
        assert!((to_matrix4(&spread(&h, &S, 4)) - expected).amax() < 1e-12);
        let mut a = [[0.0; 4]; 4];
        add_information(&mut a, &h, &S, 4, 0.5);
        let expected = to_matrix4(&h).transpose() * to_matrix4(&S) * to_matrix4(&h) * 0.5;
        assert!((to_matrix4(&a) - expected).amax() < 1e-11);
        let by_pose: ByPose = std::array::from_fn(|i| std::array::from_fn(|j| (i + j) as f64));
        let covariance = Matrix6::from_fn(|i, j| if i == j { 2.0 } else { 0.1 });
        let rows = SMatrix::<f64, 4, 6>::from_fn(|i, j| by_pose[i][j]);
        let expected = rows * covariance * rows.transpose();
        let found = spread(&by_pose, &from_matrix(&covariance), 4);
        assert!((to_matrix4(&found) - expected).amax() < 1e-11);
        let (inverse, _) = inverse6(&from_matrix(&covariance)).unwrap();
        let identity = to_matrix6(&inverse) * covariance;
        assert!((identity - Matrix6::identity()).amax() < 1e-13);
    }
}
