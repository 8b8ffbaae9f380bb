//! Noise of readings: a contaminated normal.

use super::algebra::{Factor4, Square4};
use super::data::Look;

/// Share of readings that err more.
pub(super) const CONTAMINATION: f64 = 0.03;
/// How many times their variance.
pub(super) const WIDE: f64 = 25.0;
/// Factors on the standard deviations of the four rows, learnt.
pub(super) type Scales = [f64; 4];

/// Variances of the rows of a detection; ones of rows it does not have. Where on an object a box sits
/// is uncertain by a share of its size, `shape`.
pub(super) fn variances(look: &Look, scales: &Scales, shape: f64) -> [f64; 4] {
    let mut r: [f64; 4] = std::array::from_fn(|i| {
        if look.has[i] {
            (look.sigmas[i] * scales[i]).powi(2)
        } else {
            1.0
        }
    });
    if let Some(log_px) = look.log_px {
        let px = look.left.map_or(log_px.exp(), |left| left.size_px());
        let scale = 0.5 * (scales[0] + scales[1]);
        let own = (shape * px * scale).powi(2);
        r[0] += own;
        r[1] += own * 0.25;
    }
    if let Some(left) = &look.left {
        for (r, more) in r.iter_mut().zip(left.variances()) {
            *r += more;
        }
    }
    r
}

/// A spread with `factor` times the variances on its diagonal.
#[inline]
pub(super) fn with_noise(spread: &Square4, variances: &[f64; 4], factor: f64) -> Square4 {
    let mut s = *spread;
    for i in 0..4 {
        s[i][i] += factor * variances[i];
    }
    s
}

/// Logarithm of the density of a residual, and its squared Mahalanobis distance under the wide
/// component, which gates. `has` names the rows that count.
#[inline]
pub(super) fn log_likelihood(
    e: &[f64; 4],
    spread: &Square4,
    variances: &[f64; 4],
    (n, n_rows): (usize, f64),
) -> Option<(f64, f64)> {
    let unit = 0.5 * n_rows * (2.0 * std::f64::consts::PI).ln();
    let narrow = Factor4::new(&with_noise(spread, variances, 1.0), n)?;
    let (wide, gap) = wide_factor(spread, variances, (n, n_rows))?;
    let m2 = wide.mahalanobis2(e);
    let a = (1.0 - CONTAMINATION).ln() - 0.5 * narrow.mahalanobis2(e) - 0.5 * narrow.ln_det;
    let b = CONTAMINATION.ln() - 0.5 * m2 - 0.5 * (wide.ln_det - gap);
    Some((ln_add(a, b) - unit, m2))
}

/// The factor of the wide component, and what rows without a reading add to its determinant.
#[inline]
pub(super) fn wide_factor(
    spread: &Square4,
    variances: &[f64; 4],
    (n, n_rows): (usize, f64),
) -> Option<(Factor4, f64)> {
    let factor = Factor4::new(&with_noise(spread, variances, WIDE), n)?;
    let missing = f64::from(u8::try_from(n).unwrap_or(4)) - n_rows;
    Some((factor, missing * WIDE.ln()))
}

/// The share of a residual's weight that the narrow component has: what the robust adjustment
/// multiplies its information by.
pub(super) fn robust_weight(e: &[f64; 4], variances: &[f64; 4], n_rows: f64) -> f64 {
    let m2: f64 = e.iter().zip(variances).map(|(e, r)| e * e / r).sum();
    let a = (1.0 - CONTAMINATION) * (-0.5 * m2).exp();
    let b = CONTAMINATION * WIDE.powf(-0.5 * n_rows) * (-0.5 * m2 / WIDE).exp() + 1e-300;
    (a + b / WIDE) / (a + b)
}

/// `ln(e^a + e^b)`.
#[inline]
pub(super) fn ln_add(a: f64, b: f64) -> f64 {
    let (high, low) = if a >= b { (a, b) } else { (b, a) };
    if high == f64::NEG_INFINITY {
        return high;
    }
    high + (low - high).exp().ln_1p()
}
