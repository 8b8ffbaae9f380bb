//! Whether a map knows its own errors: NEES and coverage of its ellipses, reliability of its
//! probabilities.

use serde::Serialize;

use super::comparison::Comparison;
use super::score::{count, ratio};
use crate::frame::Ellipse;

/// How the errors of the matches compare with the covariances the map gives.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Consistency {
    /// Matches whose mapped object has a covariance.
    pub n: usize,
    /// Mean of `e' C^-1 e`, the normalised estimation error squared (Bar-Shalom, Li, Kirubarajan
    /// 2001, eq. 5.4.2-1); 2 for a map that knows its errors, more for one that is overconfident.
    pub nees: Option<f64>,
    /// The same by degree of freedom: 1 is right.
    pub nees_per_dof: Option<f64>,
    /// Where the mean of a consistent map lies in 95 of 100 cases; `None` of fewer than ten.
    pub nees_95: Option<[f64; 2]>,
    /// Share of the matches that lie within the 95 % ellipse; 0.95 is right.
    pub coverage_95: Option<f64>,
}

/// How often objects of a stated probability exist.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Existence {
    /// Mapped objects with a probability, none near an ignored place.
    pub n: usize,
    /// Mean of `(p - x)^2` with x 1 where the object exists, else 0 (Brier 1950).
    pub brier: f64,
    /// Mean over the objects of |mean probability - share that exists| of their bin.
    pub calibration_error: f64,
    /// Ten bins: `[0, 0.1)` to `[0.9, 1]`.
    pub bins: Vec<ReliabilityBin>,
}

/// The objects whose probability lies in one bin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReliabilityBin {
    /// Least probability of the bin.
    pub low: f64,
    /// Greatest probability of the bin.
    pub high: f64,
    /// Objects in it.
    pub n: usize,
    /// Mean of their probabilities.
    pub mean_p: Option<f64>,
    /// Share of them that exist.
    pub exist: Option<f64>,
}

/// The bins of the reliability of `p_exist`.
const BINS: usize = 10;

impl Consistency {
    /// From the matches within the radius.
    pub fn new(comparison: &Comparison) -> Self {
        let squared = |m: &super::Match| {
            let covariance = comparison.estimates[m.estimate].covariance?;
            let solved = covariance.cholesky()?.solve(&m.error_m);
            Some(m.error_m.dot(&solved))
        };
        let errors: Vec<f64> = comparison.matches.iter().filter_map(squared).collect();
        Self::of(&errors)
    }

    /// From normalised squared errors of two degrees of freedom each.
    fn of(errors: &[f64]) -> Self {
        let n = count(errors.len());
        let limit = Ellipse::scale_95().powi(2);
        let inside = errors.iter().filter(|&&e| e <= limit).count();
        let nees = ratio(errors.iter().sum(), n);
        Self {
            n: errors.len(),
            nees,
            nees_per_dof: nees.map(|x| x / 2.0),
            nees_95: (errors.len() >= 10).then(|| mean_nees_interval(n)),
            coverage_95: ratio(count(inside), n),
        }
    }
}

/// The central 95 % of the mean of n chi-squared variables of two degrees of freedom, by Wilson and
/// Hilferty's cube (PNAS 17, 1931), better than 0.2 % from ten on.
fn mean_nees_interval(n: f64) -> [f64; 2] {
    const Z: f64 = 1.959_963_984_540_054;
    let spread = 1.0 / (9.0 * n);
    [-Z, Z].map(|z| 2.0 * (1.0 - spread + z * spread.sqrt()).powi(3))
}

impl Existence {
    /// From all mapped objects with a probability, those below the least existence among them;
    /// `None` where there are none.
    pub fn new(comparison: &Comparison) -> Option<Self> {
        let known = |e: &super::ComparedEstimate| Some((e.p_exist?, e.exists?));
        Self::of(
            &comparison
                .estimates
                .iter()
                .filter_map(known)
                .collect::<Vec<_>>(),
        )
    }

    /// From stated probabilities and what was true.
    fn of(objects: &[(f64, bool)]) -> Option<Self> {
        if objects.is_empty() {
            return None;
        }
        let (mut sums, mut squares) = ([(0usize, 0.0, 0usize); BINS], 0.0);
        for &(p, exists) in objects {
            let bin = (1..BINS).filter(|&i| p >= edge(i)).count();
            sums[bin].0 += 1;
            sums[bin].1 += p;
            sums[bin].2 += usize::from(exists);
            squares += (p - f64::from(u8::from(exists))).powi(2);
        }
        let total = count(objects.len());
        let gap = |&(_, p, exist): &(usize, f64, usize)| (p - count(exist)).abs();
        let bin = |(i, &(n, p, exist)): (usize, &(usize, f64, usize))| ReliabilityBin {
            low: edge(i),
            high: edge(i + 1),
            n,
            mean_p: ratio(p, count(n)),
            exist: ratio(count(exist), count(n)),
        };
        Some(Self {
            n: objects.len(),
            brier: squares / total,
            calibration_error: sums.iter().map(gap).sum::<f64>() / total,
            bins: sums.iter().enumerate().map(bin).collect(),
        })
    }
}

/// The lower edge of a bin, the nearest number to its decimal.
fn edge(bin: usize) -> f64 {
    count(bin) / count(BINS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Squared errors of two normal variables each, `scale` times too large.
    fn simulated(n: usize, scale: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        // The squared norm of two standard normal variables is -2 ln u.
        let error = |_| -2.0 * scale * (1.0 - rng.random::<f64>()).ln();
        (0..n).map(error).collect()
    }

    #[test]
    fn a_consistent_map_scores_two_and_95_percent() {
        let c = Consistency::of(&simulated(200_000, 1.0));
        assert!((c.nees.unwrap() - 2.0).abs() < 0.02, "{c:?}");
        assert!((c.nees_per_dof.unwrap() - 1.0).abs() < 0.01);
        assert!((c.coverage_95.unwrap() - 0.95).abs() < 0.002);
        let [low, high] = c.nees_95.unwrap();
        assert!(low < c.nees.unwrap() && c.nees.unwrap() < high);
    }

    #[test]
    fn an_overconfident_map_is_found_out() {
        // Errors twice what is stated: NEES 8, coverage 1 - 0.05^(1/4).
        let c = Consistency::of(&simulated(200_000, 4.0));
        assert!((c.nees.unwrap() - 8.0).abs() < 0.08, "{c:?}");
        assert!((c.coverage_95.unwrap() - (1.0 - 0.05f64.powf(0.25))).abs() < 0.004);
        assert!(c.nees.unwrap() > c.nees_95.unwrap()[1]);
    }

    /// scipy: `chi2.ppf([0.025, 0.975], 2 n) / n` for n = 10 and 100.
    #[test]
    fn the_interval_is_that_of_scipy() {
        for (n, expected) in [
            (10.0, [0.959077739, 3.416960690]),
            (100.0, [1.627279825, 2.410578955]),
        ] {
            for (found, expected) in mean_nees_interval(n).into_iter().zip(expected) {
                assert!(
                    (found / expected - 1.0).abs() < 2e-3,
                    "{n}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn bins_hold_what_lies_in_them() {
        let objects = [
            (0.0, false),
            (0.05, true),
            (0.3, false),
            (0.7, true),
            (0.75, false),
            (1.0, true),
        ];
        let e = Existence::of(&objects).unwrap();
        let n: Vec<usize> = e.bins.iter().map(|b| b.n).collect();
        assert_eq!(n, [2, 0, 0, 1, 0, 0, 0, 2, 0, 1]);
        assert_eq!(
            (e.bins[0].mean_p, e.bins[0].exist),
            (Some(0.025), Some(0.5))
        );
        assert_eq!((e.bins[1].mean_p, e.bins[1].exist), (None, None));
        assert_eq!(e.bins[7].exist, Some(0.5));
        assert_eq!((e.bins[3].low, e.bins[3].high), (0.3, 0.4));
        // Brier: (0 + 0.9025 + 0.09 + 0.09 + 0.5625 + 0) / 6.
        assert!((e.brier - 1.645 / 6.0).abs() < 1e-12);
        // Gaps: |0.05 - 1| + 0.3 + |1.45 - 1| + 0, over six objects.
        assert!((e.calibration_error - 1.7 / 6.0).abs() < 1e-12);
        assert_eq!(Existence::of(&[]), None);
    }
}
