//! Means, boxes and the sign test.

use serde::Serialize;

/// A mean and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its standard error, from the sample's standard deviation; `None` of fewer than two numbers.
    pub standard_error: Option<f64>,
    /// Of how many.
    pub n: usize,
}

impl Mean {
    /// Of these numbers; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let n = count(values.len());
        let mean = (!values.is_empty()).then(|| values.iter().sum::<f64>() / n)?;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        let standard_error = (values.len() > 1).then(|| (squares / (n - 1.0) / n).sqrt());
        Some(Self {
            mean,
            standard_error,
            n: values.len(),
        })
    }
}

/// What a notched box plot draws of a sample (McGill, Tukey and Larsen, Variations of box plots,
/// The American Statistician 32, 1978).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxStatistics {
    /// The median.
    pub median: f64,
    /// The quarter below, by linear interpolation between order statistics.
    pub lower_quartile: f64,
    /// The quarter above.
    pub upper_quartile: f64,
    /// The median's 95 % confidence interval, `median -/+ 1.57 IQR / sqrt(n)`.
    pub notch: [f64; 2],
    /// The outermost numbers within 1.5 IQR of the box.
    pub whiskers: [f64; 2],
    /// The numbers beyond, ascending.
    pub outliers: Vec<f64>,
}

impl BoxStatistics {
    /// Of these numbers; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let [lower_quartile, median, upper_quartile] = [
            quantile(&sorted, 0.25)?,
            quantile(&sorted, 0.5)?,
            quantile(&sorted, 0.75)?,
        ];
        let range = upper_quartile - lower_quartile;
        let reach = 1.5 * range;
        let inside = |x: &f64| (lower_quartile - reach..=upper_quartile + reach).contains(x);
        let half = 1.57 * range / count(sorted.len()).sqrt();
        let within: Vec<f64> = sorted.iter().copied().filter(inside).collect();
        Some(Self {
            median,
            lower_quartile,
            upper_quartile,
            notch: [median - half, median + half],
            whiskers: [*within.first()?, *within.last()?],
            outliers: sorted.iter().copied().filter(|x| !inside(x)).collect(),
        })
    }
}

/// The value below which this share of sorted numbers lies, by linear interpolation between order
/// statistics (Hyndman and Fan, Sample quantiles in statistical packages, 1996, definition 7).
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = share * count(last);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and at most the last index"
    )]
    let below = at.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (at - at.floor()) * (sorted[above] - sorted[below]))
}

/// Whether one method has the lower error more often than chance, trial by trial.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SignTest {
    /// Trials in which the first method's error is lower.
    pub wins: usize,
    /// Trials in which the second's is.
    pub losses: usize,
    /// Trials in which neither's is; they take no part.
    pub ties: usize,
    /// Pearson's chi-square over both cells, wins and losses, against one half each; one degree of
    /// freedom.
    pub chi_square: f64,
    /// The wins' cell of it alone, which is what Thompson and Wettergreen (2005) print: 11.56 for
    /// 42 of 50, where both cells make 23.12.
    pub chi_square_one_cell: f64,
    /// Probability of a split at least as uneven by chance, from the binomial law, two-sided.
    pub p_value: f64,
}

impl SignTest {
    /// Of the errors of two methods in the same trials. Differences within `tolerance` are ties.
    pub fn of(first: &[f64], second: &[f64], tolerance: f64) -> Self {
        let pairs = || first.iter().zip(second);
        let wins = pairs().filter(|(a, b)| **a < **b - tolerance).count();
        let losses = pairs().filter(|(a, b)| **b < **a - tolerance).count();
        Self::of_counts(wins, losses, pairs().count() - wins - losses)
    }

    /// Of how many trials went which way.
    pub fn of_counts(wins: usize, losses: usize, ties: usize) -> Self {
        let half = count(wins + losses) / 2.0;
        let one_cell = if half > 0.0 {
            (count(wins) - half).powi(2) / half
        } else {
            0.0
        };
        Self {
            wins,
            losses,
            ties,
            // Both cells are off by the same number.
            chi_square: 2.0 * one_cell,
            chi_square_one_cell: one_cell,
            p_value: two_sided(wins, losses),
        }
    }
}

/// The two-sided p-value of a split under the binomial law with probability one half.
fn two_sided(wins: usize, losses: usize) -> f64 {
    let n = count(wins + losses);
    let mut log_term = -n * std::f64::consts::LN_2;
    let mut tail = 0.0;
    for k in 0..=wins.min(losses) {
        if k > 0 {
            log_term += ((n - count(k) + 1.0) / count(k)).ln();
        }
        tail += log_term.exp();
    }
    f64::min(1.0, 2.0 * tail)
}

/// A count as a number.
#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2^53")]
pub(super) fn count(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, expected: f64) -> bool {
        (found - expected).abs() <= 1e-12 * expected.abs().max(1.0)
    }

    #[test]
    fn means_know_their_errors() {
        let mean = Mean::of(&[1.0, 2.0, 3.0, 6.0]).unwrap();
        assert!(near(mean.mean, 3.0));
        // Squared deviations 4 + 1 + 0 + 9 = 14; sqrt(14 / 3 / 4).
        assert!(near(
            mean.standard_error.unwrap(),
            f64::sqrt(14.0 / 3.0 / 4.0)
        ));
        assert_eq!(Mean::of(&[5.0]).unwrap().standard_error, None);
        assert_eq!(Mean::of(&[]), None);
    }

    #[test]
    fn boxes_by_hand() {
        // Of 1..=8 and 30 the quartiles are the 3rd, 5th and 7th number; 1.5 IQR reaches to 13.
        let values = [30.0, 1.0, 2.0, 8.0, 7.0, 3.0, 4.0, 6.0, 5.0];
        let found = BoxStatistics::of(&values).unwrap();
        assert_eq!(
            (found.lower_quartile, found.median, found.upper_quartile),
            (3.0, 5.0, 7.0)
        );
        assert!(near(found.notch[0], 5.0 - 1.57 * 4.0 / 3.0));
        assert!(near(found.notch[1], 5.0 + 1.57 * 4.0 / 3.0));
        assert_eq!(found.whiskers, [1.0, 8.0]);
        assert_eq!(found.outliers, [30.0]);
        // Between order statistics: of 1, 2, 3, 4 the quartiles are 1.75, 2.5, 3.25.
        let found = BoxStatistics::of(&[4.0, 3.0, 2.0, 1.0]).unwrap();
        assert_eq!(
            (found.lower_quartile, found.median, found.upper_quartile),
            (1.75, 2.5, 3.25)
        );
        assert_eq!(BoxStatistics::of(&[]), None);
    }

    #[test]
    fn the_papers_sign_test() {
        let test = SignTest::of_counts(42, 8, 0);
        assert!(near(test.chi_square_one_cell, 11.56));
        assert!(near(test.chi_square, 23.12));
        // 2 (C(50,0) + ... + C(50,8)) / 2^50, with the binomials from a table.
        let sum: f64 = [
            1.0,
            50.0,
            1225.0,
            19_600.0,
            230_300.0,
            2_118_760.0,
            15_890_700.0,
            99_884_400.0,
            536_878_650.0,
        ]
        .iter()
        .sum();
        assert!(near(test.p_value * 1e6, 2e6 * sum / f64::powi(2.0, 50)));
        assert_eq!(SignTest::of_counts(5, 5, 3).p_value, 1.0);
        assert_eq!(SignTest::of_counts(0, 0, 3).chi_square, 0.0);
    }

    #[test]
    fn ties_take_no_part() {
        let test = SignTest::of(&[1.0, 2.0, 3.0, 4.0], &[1.0, 3.0, 2.0, 5.0], 1e-12);
        assert_eq!((test.wins, test.losses, test.ties), (2, 1, 1));
        assert!(near(test.chi_square, 1.0 / 3.0));
    }
}
