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
