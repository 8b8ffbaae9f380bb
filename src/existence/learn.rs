//! What the data say of noise, clutter, density, sizes and detectability (3.5): one round of
//! expectation maximisation.

use super::{Belief, DetectionCurve, Exposure, LogNormal, Model, Pairs, Prior, probability};
use crate::adjust::Prediction;

/// How many measurements of the stated noise the noise starts from.
const NOISE_COUNT: f64 = 10.0;
/// Fewer degrees of freedom say nothing about the noise.
const LEAST_FREEDOM: f64 = 20.0;
/// How many views of the stated noise the poses' noise starts from, in each component.
const POSE_COUNT: f64 = 4.0;
/// Fewer views say nothing about the noise of their poses.
const LEAST_VIEWS: usize = 6;
/// How much clutter the clutter starts from.
const CLUTTER_COUNT: f64 = 5.0;

/// A round of learning: what is believed, with the pairs and the weight of detection in each, and
/// the log-odds of existence.
struct Round<'a> {
    belief: Belief<'a>,
    pairs: &'a Pairs,
    detected: &'a [f64],
    /// Probability that each object exists.
    real: Vec<f64>,
    /// Weight of the edges of each object.
    support: Vec<f64>,
    predictions: Vec<Option<Prediction>>,
}

/// The model that the data suggest, from the one of the belief, given the [`Pairs`] with their weights of
/// detection and the log-odds that each object exists.
pub fn learn(
    belief: &Belief<'_>,
    pairs: &Pairs,
    detected: &[f64],
    log_odds: &[f64],
    (prior, exposure): (&Prior, &Exposure),
) -> Model {
    let mut support = vec![0.0; log_odds.len()];
    for edge in belief.adjustment.edges {
        support[edge.point] += edge.weight;
    }
    let round = Round {
        belief: *belief,
        pairs,
        detected,
        real: log_odds.iter().map(|&l| probability(l)).collect(),
        support,
        predictions: belief.adjustment.predictions(belief.state),
    };
    let mut model = belief.model.clone();
    if let Some(scale) = round.reading_noise() {
        model.noise.reading = scale;
    }
    round.pose_noise(&mut model);
    let clutter: f64 = round.clutter().map(|(weight, _)| weight).sum();
    let exposed = exposure.shares.iter().sum::<f64>() + CLUTTER_COUNT / prior.clutter_per_view;
    model.clutter_per_view = (clutter + CLUTTER_COUNT) / exposed;
    let whole = round.undetected_too();
    model.density_per_m2 = whole.iter().sum::<f64>().max(1.0) / exposure.area_m2;
    round.sizes(&whole, &mut model);
    round.curve(&mut model.curve);
    model
}

impl Round<'_> {
    /// `q^2 = (10 + sum w e^2 / sigma^2) / (10 + rows - unknowns)` over measurements of real objects
    /// seen more than once; `None` where there are too few. A view is taken to use up three
    /// degrees of freedom.
    fn reading_noise(&self) -> Option<f64> {
        let adjustment = &self.belief.adjustment;
        let (mut squares, mut rows) = (0.0, 0.0);
        let mut used = vec![false; self.real.len()];
        for (edge, prediction) in adjustment.edges.iter().zip(&self.predictions) {
            let k = edge.point;
            let is_good = edge.weight > 0.5 && self.support[k] > 1.5 && self.real[k] > 0.5;
            let (Some(p), true) = (prediction, is_good) else {
                continue;
            };
            let reading = &adjustment.problem.measurements[edge.measurement].reading;
            let normalised = p.residual.component_div(&reading.sigmas());
            squares += edge.weight * normalised.norm_squared();
            rows += edge.weight * f64::from(u8::try_from(reading.n_rows()).unwrap_or(3));
            used[k] = true;
        }
        let freedom = rows - 2.0 * count(&used) - 3.0 * length(adjustment.problem.views);
        let scale = (NOISE_COUNT + squares) / (NOISE_COUNT + freedom);
        (freedom > LEAST_FREEDOM).then(|| scale.clamp(0.09, 9.0).sqrt())
    }

    /// `s^2 = (m x + 4) / (m + 4)`, x the mean over the views of `(d^2 + S) / sigma^2`; east and
    /// north share one.
    fn pose_noise(&self, model: &mut Model) {
        let (views, state) = (self.belief.adjustment.problem.views, self.belief.state);
        if views.len() < LEAST_VIEWS {
            return;
        }
        let stated = |i: usize, q: usize| views[i].pose.sigma.to_vector()[q].max(1e-9);
        let groups: [&[usize]; 5] = [&[0, 1], &[2], &[3], &[4], &[5]];
        for group in groups {
            let (mut sum, mut n) = (0.0, 0.0);
            for &q in group {
                for i in 0..views.len() {
                    let covariance = &self.belief.conditional.poses[i];
                    let square = state.poses[i][q].powi(2) + covariance[(q, q)];
                    sum += square / stated(i, q).powi(2);
                    n += 1.0;
                }
            }
            let scale = ((sum + POSE_COUNT) / (n + POSE_COUNT)).clamp(0.02, 9.0);
            for &q in group {
                model.noise.pose[q] = scale.sqrt();
            }
        }
    }

    /// The weight with which every measurement is clutter, and its apparent size.
    fn clutter(&self) -> impl Iterator<Item = (f64, Option<f64>)> {
        let adjustment = &self.belief.adjustment;
        adjustment.edges.iter().map(|edge| {
            let size = adjustment.problem.measurements[edge.measurement].log_size;
            (edge.weight * (1.0 - self.real[edge.point]), size)
        })
    }

    /// How many objects like each there are, those that no view detected among them: its
    /// probability over that of being detected at all.
    fn undetected_too(&self) -> Vec<f64> {
        let mut missed = vec![0.0; self.real.len()];
        for pair in &self.pairs.pairs {
            missed[pair.point] += (-pair.p_detect).ln_1p();
        }
        let missed = missed.iter().map(|m| (1.0 - m.exp()).clamp(0.2, 1.0));
        self.real.iter().zip(missed).map(|(r, p)| r / p).collect()
    }

    /// Moments of the sizes of objects and of the apparent sizes of clutter.
    fn sizes(&self, whole: &[f64], model: &mut Model) {
        let sizes = self.belief.sizes;
        let sized = |k: usize| sizes.support[k] > 0.0;
        let real: f64 = (0..whole.len())
            .filter(|&k| sized(k))
            .map(|k| self.real[k])
            .sum();
        if real <= 10.0 {
            return;
        }
        let weighted = whole.iter().enumerate().filter(|&(k, _)| sized(k));
        let objects: Vec<(f64, f64)> = weighted.map(|(k, &w)| (w, sizes.log_size[k])).collect();
        if let Some(moments) = moments(&objects, 0.0) {
            model.size = moments;
        }
        let clutter: Vec<(f64, f64)> = self
            .clutter()
            .filter_map(|(weight, size)| Some((weight, size?)))
            .collect();
        if clutter.iter().map(|c| c.0).sum::<f64>() > 5.0
            && let Some(moments) = moments(&clutter, 0.02)
        {
            model.clutter_size = moments;
        }
    }

    /// Hits and misses of real objects that other views saw too: leaving the view itself out of the
    /// choice keeps it free of bias.
    fn curve(&self, curve: &mut DetectionCurve) {
        let chances = self.pairs.pairs.iter().zip(self.detected);
        curve.learn(chances.filter_map(|(pair, q)| {
            let k = pair.point;
            let by_others = self.support[k] - q;
            let is_used = by_others > 0.8 && self.real[k] > 0.5 && pair.p_inside > 0.7;
            let bin = DetectionCurve::bin(pair.log_px);
            is_used.then(|| (bin, self.real[k] * pair.p_inside, self.real[k] * q))
        }));
    }
}

/// Mean and variance of weighted values, with more variance added.
fn moments(values: &[(f64, f64)], more_variance: f64) -> Option<LogNormal> {
    let total: f64 = values.iter().map(|v| v.0).sum();
    let mean = values.iter().map(|(w, x)| w * x).sum::<f64>() / total;
    let squares = values.iter().map(|(w, x)| w * (x - mean).powi(2));
    let variance = squares.sum::<f64>() / total + more_variance;
    (total > 0.0).then(|| LogNormal {
        mean,
        variance: variance.clamp(0.05, 2.0),
    })
}

fn count(flags: &[bool]) -> f64 {
    flags.iter().map(|&f| f64::from(u8::from(f))).sum()
}

fn length<T>(items: &[T]) -> f64 {
    items.iter().map(|_| 1.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_weighted() {
        let found = moments(&[(1.0, 0.0), (3.0, 2.0)], 0.5).unwrap();
        assert!((found.mean - 1.5).abs() < 1e-15);
        assert!((found.variance - (0.25 * 2.25 + 0.75 * 0.25 + 0.5)).abs() < 1e-15);
        assert!(moments(&[], 0.0).is_none());
    }
}
