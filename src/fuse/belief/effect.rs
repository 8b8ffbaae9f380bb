//! How much less many views say than as many independent ones: the design effect.
//!
//! The adjustment takes the errors of views as independent. Where those of consecutive views are
//! alike, its covariances are too small. How alike they are shows in what each view does to the map:
//! with s the score of a view (what its residuals pull at the objects) its influence is `H^-1 s`, and
//! the covariance of the map is, whatever the errors are, the sum of the covariances of influences of
//! all pairs of views (Huber 1967; Liang and Zeger 1986). The sum over pairs up to a lag, in the
//! window of Newey and West (1987), over that of each view with itself is the design effect (Kish
//! 1965).

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector4};
use rayon::prelude::*;
use serde::Serialize;

use super::algebra::Square4;
use super::bias::Survey;
use super::engine::Engine;

/// So many influences are told apart; views farther from each other share one, with signs by chance.
const MOST_INFLUENCES: usize = 256;
/// And so many where there are more views than this.
const FEW_INFLUENCES: usize = 64;
const MANY_VIEWS: usize = 20_000;
/// Windows reach over at most this share of them.
const WIDEST: usize = 4;
/// So many objects are asked, at most.
const MOST_OBJECTS: usize = 400;
/// Objects with less support say nothing.
const LEAST_SUPPORT: f64 = 2.5;
/// That views are independent counts for this many windows.
const WHITE_COUNT: f64 = 4.0;

/// How the errors of consecutive views repeat themselves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repetition {
    /// How many views are worth one independent view.
    pub design_effect: f64,
    /// Over how many views their errors are alike.
    pub window: usize,
    /// The correlation of the influences of views one, two, four ... views apart.
    pub correlations: Vec<f64>,
}

impl Default for Repetition {
    fn default() -> Self {
        Self {
            design_effect: 1.0,
            window: 1,
            correlations: Vec::new(),
        }
    }
}

impl Repetition {
    /// The greatest design effect among windows of 1, 2, 4 ... lags, each drawn toward one.
    /// `covariances` are those of influences by lag, of `n_views` views.
    fn new(covariances: &[f64], n_views: usize) -> Self {
        let mut best = Self::default();
        let Some(&own) = covariances.first().filter(|c| **c > 0.0) else {
            return best;
        };
        let mut window = 1;
        #[expect(clippy::cast_precision_loss, reason = "counts of views")]
        while window < covariances.len() {
            best.correlations.push(covariances[window] / own);
            window *= 2;
            let within = covariances.iter().enumerate().skip(1).take(window - 1);
            let pairs = within.map(|(lag, c)| (1.0 - lag as f64 / window as f64) * c / own);
            let raw = 2.0 * pairs.sum::<f64>();
            let n_windows = n_views as f64 / window as f64;
            let effect = 1.0 + raw * n_windows / (n_windows + WHITE_COUNT);
            if effect > best.design_effect {
                best.design_effect = effect;
                best.window = window;
            }
        }
        best
    }

    /// What it comes to for an object of so many looks: a single look repeats nothing. As if their
    /// errors were a first-order autoregressive process of this design effect.
    pub(super) fn of(&self, n_looks: f64) -> f64 {
        let d = self.design_effect;
        let r = (d - 1.0) / (d + 1.0);
        let n = n_looks.max(1.0);
        let ends = 2.0 * r * (1.0 - r.powf(n)) / (n * (1.0 - r) * (1.0 - r));
        (d - ends).max(1.0)
    }
}

impl Engine<'_> {
    /// How the errors of consecutive views repeat themselves, with marginal covariances of objects
    /// and the biases that are solved for, with theirs.
    pub(super) fn repetition(
        &self,
        survey: &Survey,
        covariances: &[Square4],
        (on, bias_covariance): &(Vec<usize>, DMatrix<f64>),
    ) -> Repetition {
        let n_views = self.n_views();
        let asked = self.asked_objects(covariances);
        if asked.is_empty() || n_views < 2 {
            return Repetition::default();
        }
        let period = if n_views > MANY_VIEWS {
            FEW_INFLUENCES
        } else {
            MOST_INFLUENCES.min(n_views)
        };
        let influences: Vec<Vec<Vector2<f64>>> = (0..period)
            .into_par_iter()
            .map(|phase| {
                let mut objects = vec![Vector4::zeros(); self.objects.len()];
                let mut biases = DVector::zeros(survey.bias_pulls.nrows());
                for view in (phase..n_views).step_by(period) {
                    let sign = sign(view / period);
                    let from = survey.pulls.partition_point(|p| p.0 < view);
                    for (_, object, pull) in survey.pulls[from..].iter().take_while(|p| p.0 == view)
                    {
                        objects[*object] += pull * sign;
                    }
                    biases.axpy(sign, &survey.bias_pulls.column(view), 1.0);
                }
                let steps = survey.again(&objects, on, bias_covariance, &biases);
                let whitened = asked.iter().map(|(k, root)| root * steps[*k].xy());
                whitened.collect()
            })
            .collect();
        let n_lags = (period / WIDEST).max(2);
        let covariances: Vec<f64> = (0..n_lags)
            .map(|lag| {
                let pairs = influences.iter().zip(influences.iter().skip(lag));
                let sum: f64 = pairs
                    .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>())
                    .sum();
                #[expect(clippy::cast_precision_loss, reason = "counts of views")]
                let missing = if period < n_views {
                    period as f64 / (period - lag) as f64
                } else {
                    1.0
                };
                sum * missing
            })
            .collect();
        Repetition::new(&covariances, n_views)
    }

    /// Objects that several looks support, with what whitens their places in the plane.
    fn asked_objects(&self, covariances: &[Square4]) -> Vec<(usize, Matrix2<f64>)> {
        let support = self.support();
        let good: Vec<usize> = (0..self.objects.len())
            .filter(|&k| support[k] >= LEAST_SUPPORT)
            .collect();
        let step = good.len().div_ceil(MOST_OBJECTS).max(1);
        good.iter()
            .step_by(step)
            .filter_map(|&k| {
                let c = &covariances[k];
                let plane = Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]);
                let root = plane.cholesky()?.l().try_inverse()?;
                Some((k, root))
            })
            .collect()
    }
}

/// One or minus one, as by chance.
fn sign(n: usize) -> f64 {
    let mixed = (n as u64)
        .wrapping_add(1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    if (mixed >> 40) & 1 == 0 { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fading(r: f64, n: i32) -> Vec<f64> {
        (0..n).map(|lag| 2.0 * r.powi(lag)).collect()
    }

    /// A first-order autoregressive process has (1 + r) / (1 - r).
    #[test]
    fn autoregressive_errors_have_their_known_effect() {
        for (r, effect) in [(0.5, 3.0), (0.8, 9.0)] {
            let found = Repetition::new(&fading(r, 1000), 1_000_000);
            let off = (found.design_effect / effect - 1.0).abs();
            assert!(off < 0.01, "{r}: {}", found.design_effect);
            assert!((found.correlations[0] - r).abs() < 1e-12);
            assert!((found.correlations[2] - r.powi(4)).abs() < 1e-12);
        }
    }

    #[test]
    fn few_views_say_white() {
        let of = |n_views| Repetition::new(&fading(0.5, 16), n_views).design_effect;
        assert!(of(4) < 1.45 && of(40) < of(400) && of(400) < 3.0);
    }

    #[test]
    fn what_alternates_does_not_narrow() {
        let none = Repetition::default();
        assert_eq!(
            Repetition::new(&[2.0, 0.0, 0.0, 0.0], 100).design_effect,
            1.0
        );
        assert_eq!(Repetition::new(&fading(-0.5, 64), 100).design_effect, 1.0);
        assert_eq!(Repetition::new(&[], 100), none);
        assert_eq!(Repetition::new(&[0.0], 100), none);
    }

    /// The mean of n values of such a process: for two, 1 + r.
    #[test]
    fn one_look_repeats_nothing() {
        let repetition = Repetition {
            design_effect: 3.0,
            window: 8,
            correlations: Vec::new(),
        };
        assert!((repetition.of(1.0) - 1.0).abs() < 1e-12);
        assert!((repetition.of(2.0) - 1.5).abs() < 1e-12);
        assert!((repetition.of(1e9) - 3.0).abs() < 1e-6);
        assert!((Repetition::default().of(7.0) - 1.0).abs() < 1e-12);
    }
}
