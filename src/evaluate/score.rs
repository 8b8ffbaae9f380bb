//! Scores of matched sets: precision, recall, RMSE, GOSPA and OSPA.

use std::collections::BTreeMap;

use serde::Serialize;

use super::comparison::{Comparison, EstimateOutcome, Match, TruthOutcome};

/// How many objects were found, and how well placed; of the matches within the radius.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Detection {
    /// Matches, TP.
    pub n_matched: usize,
    /// Counted true objects matched to nothing, FN.
    pub n_missed: usize,
    /// Counted mapped objects matched to nothing, FP.
    pub n_false: usize,
    /// TP / (TP + FP); `None` where nothing was mapped.
    pub precision: Option<f64>,
    /// TP / (TP + FN); `None` where there is nothing to find.
    pub recall: Option<f64>,
    /// 2 TP / (2 TP + FP + FN); `None` where there is neither.
    pub f1: Option<f64>,
    /// Root of the mean squared distance of the matches, metres.
    pub rmse_m: Option<f64>,
    /// Median distance of the matches, metres.
    pub median_error_m: Option<f64>,
    /// Greatest distance of the matches, metres.
    pub max_error_m: Option<f64>,
    /// Mean error of the matches to the east, metres: what all are off by together.
    pub bias_east_m: Option<f64>,
    /// Mean error of the matches to the north, metres.
    pub bias_north_m: Option<f64>,
}

impl Detection {
    /// From the matches, and how many on either side there are in all.
    pub fn new(matches: &[Match], n_estimates: usize, n_truths: usize) -> Self {
        let n = matches.len();
        let (n_false, n_missed) = (n_estimates - n, n_truths - n);
        let mut distances: Vec<f64> = matches.iter().map(Match::distance_m).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let mean = |of: &dyn Fn(&Match) -> f64| ratio(matches.iter().map(of).sum(), count(n));
        Self {
            n_matched: n,
            n_missed,
            n_false,
            precision: ratio(count(n), count(n_estimates)),
            recall: ratio(count(n), count(n_truths)),
            f1: ratio(2.0 * count(n), count(n_estimates + n_truths)),
            rmse_m: mean(&|m| m.error_m.norm_squared()).map(f64::sqrt),
            median_error_m: median(&distances),
            max_error_m: distances.last().copied(),
            bias_east_m: mean(&|m| m.error_m.x),
            bias_north_m: mean(&|m| m.error_m.y),
        }
    }
}

/// GOSPA with p = 2 and alpha = 2 (Rahmathullah, Garcia-Fernandez, Svensson, Fusion 2017, prop. 1),
/// with its parts: `gospa_m^2 = localisation_m2 + missed_m2 + false_m2`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gospa {
    /// The metric, metres.
    pub gospa_m: f64,
    /// Sum of the squared distances of the matches, m^2.
    pub localisation_m2: f64,
    /// c^2 / 2 for every true object that no match explains, m^2.
    pub missed_m2: f64,
    /// c^2 / 2 for every mapped object that explains nothing, m^2.
    pub false_m2: f64,
    /// Matches nearer than the cut-off.
    pub n_matched: usize,
    /// True objects without a match.
    pub n_missed: usize,
    /// Mapped objects without a match.
    pub n_false: usize,
}

impl Gospa {
    /// From the optimal matches within the cut-off, and how many on either side there are in all.
    pub fn new(matches: &[Match], n_estimates: usize, n_truths: usize, cutoff_m: f64) -> Self {
        let n_matched = matches.len();
        let (n_missed, n_false) = (n_truths - n_matched, n_estimates - n_matched);
        let price = cutoff_m * cutoff_m / 2.0;
        let localisation_m2 = matches.iter().map(|m| m.error_m.norm_squared()).sum();
        let (missed_m2, false_m2) = (price * count(n_missed), price * count(n_false));
        Self {
            gospa_m: f64::sqrt(localisation_m2 + missed_m2 + false_m2),
            localisation_m2,
            missed_m2,
            false_m2,
            n_matched,
            n_missed,
            n_false,
        }
    }
}

/// OSPA with p = 2 (Schuhmacher, Vo, Vo, IEEE Trans. SP 56, 2008, eq. 3), metres; zero where both
/// sets are empty.
///
/// The matches that are optimal for GOSPA with alpha = 2 are so for OSPA of the same cut-off: both
/// sum the gains `c^2 - d^2`.
pub fn ospa_m(matches: &[Match], n_estimates: usize, n_truths: usize, cutoff_m: f64) -> f64 {
    let larger = n_estimates.max(n_truths);
    let placed: f64 = matches.iter().map(|m| m.error_m.norm_squared()).sum();
    let apart = cutoff_m * cutoff_m * count(larger - matches.len());
    ratio(placed + apart, count(larger)).unwrap_or(0.0).sqrt()
}

/// The score of one class.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClassScore {
    /// The class, `None` of what has none. A match belongs to the class of its true object.
    pub class: Option<String>,
    /// Its score.
    pub detection: Detection,
}

/// The scores of every class in map or truth, sorted by name.
pub fn by_class(comparison: &Comparison) -> Vec<ClassScore> {
    let mut parts: BTreeMap<Option<&str>, (Vec<Match>, usize, usize)> = BTreeMap::new();
    for m in &comparison.matches {
        let class = comparison.truths[m.truth].class.as_deref();
        parts.entry(class).or_default().0.push(*m);
    }
    let unmatched = comparison.estimates.iter();
    for estimate in unmatched.filter(|e| e.outcome == EstimateOutcome::False) {
        parts.entry(estimate.class.as_deref()).or_default().1 += 1;
    }
    let missed = comparison.truths.iter();
    for truth in missed.filter(|t| t.outcome == TruthOutcome::Missed) {
        parts.entry(truth.class.as_deref()).or_default().2 += 1;
    }
    let score = |(class, (matches, n_false, n_missed)): (Option<&str>, (Vec<Match>, _, _))| {
        let (estimates, truths) = (matches.len() + n_false, matches.len() + n_missed);
        ClassScore {
            class: class.map(str::to_owned),
            detection: Detection::new(&matches, estimates, truths),
        }
    };
    parts.into_iter().map(score).collect()
}

/// A count as a number.
#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2^53")]
pub(super) fn count(n: usize) -> f64 {
    n as f64
}

/// `part / whole`, `None` of nothing.
pub(super) fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// The median of sorted numbers.
fn median(sorted: &[f64]) -> Option<f64> {
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    match sorted.len() % 2 {
        0 => Some((sorted[middle - 1] + upper) / 2.0),
        _ => Some(upper),
    }
}

#[cfg(test)]
mod tests;
