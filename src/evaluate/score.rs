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
mod tests {
    use super::*;
    use crate::evaluate::{Pair, assign};
    use nalgebra::Vector2;

    type Points = &'static [[f64; 2]];
    /// Estimates, truth, cut-off, radius; GOSPA with its parts, OSPA, F1.
    type Case = (Points, Points, f64, f64, [f64; 4], f64, f64);

    fn matches(estimates: Points, truths: Points, reach_m: f64) -> Vec<Match> {
        let error = |e: usize, t: usize| Vector2::from(estimates[e]) - Vector2::from(truths[t]);
        let pairs: Vec<Pair> = (0..estimates.len())
            .flat_map(|left| (0..truths.len()).map(move |right| (left, right)))
            .map(|(left, right)| Pair {
                left,
                right,
                cost: error(left, right).norm_squared(),
            })
            .collect();
        let price = reach_m * reach_m / 2.0;
        assign(estimates.len(), truths.len(), &pairs, price)
            .iter()
            .map(|pair| Match {
                estimate: pair.left,
                truth: pair.right,
                error_m: error(pair.left, pair.right),
            })
            .collect()
    }

    /// GOSPA and its parts by Stone Soup 1.9.1, OSPA over all permutations, F1 by scipy's assignment:
    /// `tests/reference/stonesoup_metrics.py`.
    #[test]
    fn gospa_ospa_and_f1_are_those_of_stone_soup() {
        for (case, (estimates, truths, cutoff, radius, gospa, ospa, f1)) in
            CASES.iter().copied().enumerate()
        {
            let (n, m) = (estimates.len(), truths.len());
            let close = matches(estimates, truths, cutoff);
            let g = Gospa::new(&close, n, m, cutoff);
            let found = [g.gospa_m, g.localisation_m2, g.missed_m2, g.false_m2];
            for (x, expected) in found.into_iter().zip(gospa) {
                assert!((x - expected).abs() < 1e-9, "{case}: {found:?} {gospa:?}");
            }
            assert!((ospa_m(&close, n, m, cutoff) - ospa).abs() < 1e-9, "{case}");
            let near = matches(estimates, truths, radius);
            let found = Detection::new(&near, n, m).f1.unwrap();
            assert!((found - f1).abs() < 1e-9, "{case}: {found} {f1}");
        }
    }

    /// By hand: errors (0.3, 0) and (0, -0.4) of three mapped and four true objects.
    #[test]
    fn detection_scores_are_those_by_hand() {
        let error = |x, y, truth| Match {
            estimate: truth,
            truth,
            error_m: Vector2::new(x, y),
        };
        let d = Detection::new(&[error(0.3, 0.0, 0), error(0.0, -0.4, 1)], 3, 4);
        assert_eq!((d.n_matched, d.n_false, d.n_missed), (2, 1, 2));
        let close = |x: Option<f64>, expected: f64| (x.unwrap() - expected).abs() < 1e-12;
        assert!(close(d.precision, 2.0 / 3.0) && close(d.recall, 0.5) && close(d.f1, 4.0 / 7.0));
        assert!(close(d.rmse_m, 0.125f64.sqrt()) && close(d.median_error_m, 0.35));
        assert!(close(d.max_error_m, 0.4));
        assert!(close(d.bias_east_m, 0.15) && close(d.bias_north_m, -0.2));
    }

    #[test]
    fn of_nothing_there_is_no_score() {
        let d = Detection::new(&[], 0, 0);
        assert_eq!(
            (d.precision, d.recall, d.f1, d.rmse_m),
            (None, None, None, None)
        );
        assert_eq!(Detection::new(&[], 0, 3).f1, Some(0.0));
        assert_eq!(ospa_m(&[], 0, 0, 0.5), 0.0);
        assert_eq!(Gospa::new(&[], 0, 0, 0.5).gospa_m, 0.0);
    }

    const CASES: [Case; 20] = [
        (
            &[],
            &[[0.0, 0.0]],
            0.5,
            0.3,
            [0.3535533905932738, 0.0, 0.125, 0.0],
            0.5,
            0.0,
        ),
        (
            &[[0.0, 0.0]],
            &[],
            0.5,
            0.3,
            [0.3535533905932738, 0.0, 0.0, 0.125],
            0.5,
            0.0,
        ),
        (
            &[[0.1, 0.0]],
            &[[0.0, 0.0]],
            0.5,
            0.3,
            [0.1, 0.010000000000000002, 0.0, 0.0],
            0.1,
            1.0,
        ),
        (
            &[[0.4, 0.0]],
            &[[0.0, 0.0]],
            0.5,
            0.3,
            [0.4, 0.16000000000000003, 0.0, 0.0],
            0.4,
            0.0,
        ),
        (
            &[[0.6, 0.0]],
            &[[0.0, 0.0]],
            0.5,
            0.3,
            [0.5, 0.0, 0.125, 0.125],
            0.5,
            0.0,
        ),
        (
            &[[0.1, 0.0], [0.2, 0.0]],
            &[[0.0, 0.0]],
            0.5,
            0.3,
            [0.3674234614174767, 0.010000000000000002, 0.0, 0.125],
            0.36055512754639896,
            0.6666666666666666,
        ),
        (
            &[[0.1, 0.0], [0.2, 0.0]],
            &[[0.0, 0.0], [0.3, 0.0]],
            0.5,
            0.3,
            [0.1414213562373095, 0.019999999999999997, 0.0, 0.0],
            0.09999999999999999,
            1.0,
        ),
        (
            &[[0.25, 0.0], [0.75, 0.0]],
            &[[0.0, 0.0], [0.5, 0.0]],
            0.5,
            0.3,
            [0.3535533905932738, 0.125, 0.0, 0.0],
            0.25,
            1.0,
        ),
        (
            &[[0.0, 0.0], [5.0, 5.0]],
            &[[0.1, 0.1], [9.0, 9.0]],
            0.5,
            0.3,
            [0.5196152422706632, 0.02, 0.125, 0.125],
            0.3674234614174767,
            0.5,
        ),
        (
            &[[0.0, 0.2], [0.0, -0.2]],
            &[[0.0, 0.0]],
            1.0,
            0.25,
            [0.7348469228349535, 0.04000000000000001, 0.0, 0.5],
            0.7211102550927979,
            0.6666666666666666,
        ),
        (
            &[[1.15, 0.3], [1.31, 1.02], [0.18, 0.25]],
            &[[2.47, 1.74], [1.12, 1.6], [0.68, 0.75]],
            0.5,
            0.3,
            [0.8660254037844386, 0.0, 0.375, 0.375],
            0.5,
            0.0,
        ),
        (
            &[[0.06, 0.97], [0.98, 0.01], [0.4, 0.11], [0.56, 0.74]],
            &[[0.66, 0.16], [0.84, 0.74]],
            0.5,
            0.3,
            [0.6312685640834652, 0.14849999999999997, 0.0, 0.25],
            0.4026474885057648,
            0.6666666666666666,
        ),
        (
            &[[0.36, 1.1], [0.1, 0.17]],
            &[
                [0.45, 0.31],
                [0.74, 0.83],
                [0.84, 0.93],
                [0.21, 0.9],
                [0.3, 0.64],
            ],
            0.5,
            0.3,
            [0.7613146524269713, 0.20460000000000003, 0.375, 0.0],
            0.43694393232999584,
            0.2857142857142857,
        ),
        (
            &[
                [0.97, 0.13],
                [0.52, 0.76],
                [0.84, 0.11],
                [1.18, 0.35],
                [0.54, 0.36],
                [0.05, 0.29],
            ],
            &[
                [0.39, 0.69],
                [0.08, 1.12],
                [0.24, 0.64],
                [0.43, 0.43],
                [1.09, 1.07],
                [0.73, 0.34],
            ],
            0.5,
            0.3,
            [0.8731551981177229, 0.2624000000000001, 0.25, 0.25],
            0.35646411694119606,
            0.5,
        ),
        (
            &[[1.16, 0.42]],
            &[
                [1.24, 0.18],
                [0.04, 1.33],
                [0.98, 2.49],
                [0.94, 1.33],
                [0.97, 1.93],
                [0.94, 0.64],
                [1.14, 2.01],
            ],
            0.5,
            0.3,
            [0.9022194854911969, 0.06400000000000002, 0.75, 0.0],
            0.4726823155445647,
            0.25,
        ),
        (
            &[
                [0.41, 0.36],
                [0.14, 0.29],
                [0.23, 0.48],
                [0.16, 0.49],
                [0.21, 0.2],
                [0.55, 0.52],
                [0.32, 0.5],
            ],
            &[[0.52, 0.46]],
            1.0,
            0.3,
            [1.7333493589002766, 0.0045000000000000005, 0.0, 3.0],
            0.9261672172376402,
            0.25,
        ),
        (
            &[
                [0.44, 0.03],
                [0.2, 0.31],
                [0.07, 0.12],
                [0.11, 0.14],
                [0.22, 0.17],
            ],
            &[
                [0.56, 0.01],
                [0.34, 0.38],
                [0.41, 0.19],
                [0.59, 0.36],
                [0.42, 0.04],
            ],
            1.0,
            0.3,
            [0.6585590330410782, 0.4336999999999999, 0.0, 0.0],
            0.2945165530152762,
            0.6,
        ),
        (
            &[
                [0.6, 2.2],
                [0.9, 0.59],
                [2.11, 0.46],
                [0.99, 2.28],
                [0.06, 0.39],
                [1.25, 1.13],
                [2.43, 2.23],
                [1.62, 0.08],
            ],
            &[
                [0.46, 1.39],
                [1.07, 2.41],
                [1.15, 2.38],
                [0.47, 2.13],
                [1.61, 2.15],
                [1.77, 1.56],
            ],
            0.5,
            0.3,
            [1.1380246043034394, 0.04510000000000014, 0.5, 0.75],
            0.43947411755415133,
            0.2857142857142857,
        ),
        (
            &[
                [0.05, 0.04],
                [0.09, 0.14],
                [0.14, 0.13],
                [0.27, 0.39],
                [0.52, 0.54],
                [0.11, 0.58],
            ],
            &[
                [0.39, 0.18],
                [0.46, 0.15],
                [0.4, 0.18],
                [0.33, 0.05],
                [0.55, 0.05],
                [0.45, 0.16],
                [0.14, 0.58],
                [0.1, 0.47],
            ],
            0.5,
            0.3,
            [0.8220097323024832, 0.4257000000000001, 0.25, 0.0],
            0.3401654009448933,
            0.5714285714285714,
        ),
        (
            &[
                [0.75, 0.35],
                [2.37, 1.47],
                [2.2, 1.15],
                [0.74, 1.76],
                [1.79, 1.01],
                [1.19, 1.21],
                [2.37, 0.26],
                [1.59, 1.19],
                [2.06, 0.54],
            ],
            &[
                [2.35, 1.96],
                [1.93, 2.18],
                [0.51, 0.61],
                [0.24, 1.57],
                [2.41, 0.46],
                [0.51, 1.24],
                [2.43, 1.57],
                [1.85, 1.37],
                [1.89, 1.53],
            ],
            1.0,
            0.3,
            [1.650696822557068, 1.7248, 0.5, 0.5],
            0.5502322741856893,
            0.2222222222222222,
        ),
    ];
}
