//! What every view was expected to see (3.1).

use nalgebra::{Matrix2, Matrix3, Matrix3x6, Matrix6};
use rayon::prelude::*;

use super::{Belief, Prior};
use crate::adjust::{CorrectedPose, Problem, Sight};
use crate::camera::Camera;

/// How far beyond the trusted range an object may still be expected, metres.
const MARGIN_M: f64 = 1.0;
/// Objects nearer than this are not expected in pictures, metres.
const NEAREST_M: f64 = 0.3;
/// Objects less likely in the picture than this are not expected there.
const LEAST_INSIDE: f64 = 1e-3;

/// An object near the footprint of a view.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Index of the view.
    pub view: usize,
    /// Index of the object.
    pub point: usize,
    /// How the view sees the object's estimated place.
    pub sight: Sight,
    /// Covariance of the pixel it is expected at, px^2, without the noise of a reading.
    pub spread: Matrix2<f64>,
    /// Probability that it lies in the picture and in the trusted ranges.
    pub p_inside: f64,
    /// Logarithm of its apparent width, pixels.
    pub log_px: f64,
    /// Probability that it is detected, if it exists.
    pub p_detect: f64,
}

/// All pairs, by view and then by object.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// The pairs.
    pub pairs: Vec<Pair>,
}

impl Pairs {
    /// The pairs of what is believed. Views without a camera expect nothing.
    pub fn expect(belief: &Belief<'_>, prior: &Prior) -> Self {
        let poses = belief.adjustment.corrected(&belief.state.poses);
        let by_view: Vec<Vec<Pair>> = poses
            .par_iter()
            .enumerate()
            .map(|(view, pose)| of_view(belief, prior, view, pose))
            .collect();
        Self {
            pairs: by_view.concat(),
        }
    }

    /// Of every pair the weight with which the view detected the object, at most 1: q of 3.2.
    pub fn detected(&self, belief: &Belief<'_>) -> Vec<f64> {
        let adjustment = &belief.adjustment;
        let mut seen: Vec<((usize, usize), f64)> = adjustment
            .edges
            .iter()
            .map(|e| {
                let view = adjustment.problem.measurements[e.measurement].view;
                ((view, e.point), e.weight)
            })
            .collect();
        seen.sort_by_key(|&(key, _)| key);
        let weights: Vec<((usize, usize), f64)> = seen
            .chunk_by(|a, b| a.0 == b.0)
            .map(|same| (same[0].0, same.iter().map(|s| s.1).sum::<f64>().min(1.0)))
            .collect();
        let find = |pair: &Pair| {
            let found = weights.binary_search_by_key(&(pair.view, pair.point), |w| w.0);
            found.map_or(0.0, |i| weights[i].1)
        };
        self.pairs.iter().map(find).collect()
    }
}

fn of_view(belief: &Belief<'_>, prior: &Prior, view: usize, pose: &CorrectedPose<'_>) -> Vec<Pair> {
    let problem = &belief.adjustment.problem;
    let Some(camera) = problem.views[view].camera.as_deref() else {
        return Vec::new();
    };
    let origin = pose.origin().xyz;
    let reach_m = problem.limit_m() + MARGIN_M;
    let mut pairs = Vec::new();
    for (point, place) in belief.state.points.iter().enumerate() {
        if (place.xy() - origin.xy()).norm() > reach_m {
            continue;
        }
        let Some(sight) = pose
            .sight(problem, *place)
            .filter(|s| s.slant_range_m > NEAREST_M && is_near_picture(camera, s))
        else {
            continue;
        };
        let spread = spread(
            &sight,
            &belief.conditional.points[point],
            &belief.conditional.poses[view],
        );
        let sigma_px = prior.pixel_px * belief.model.noise.reading;
        let predicted = spread + Matrix2::identity() * sigma_px * sigma_px;
        let p_inside = in_picture(camera, &sight, &predicted) * in_range(problem, &sight);
        if p_inside <= LEAST_INSIDE {
            continue;
        }
        let log_px = belief.sizes.log_size[point] + sight.scale_px_per_m.ln();
        pairs.push(Pair {
            view,
            point,
            sight,
            spread,
            p_inside,
            log_px,
            p_detect: (p_inside * belief.model.curve.at(log_px)).clamp(1e-4, 0.995),
        });
    }
    pairs
}

/// Half a picture around the picture: what is farther out cannot come in.
fn is_near_picture(camera: &Camera, sight: &Sight) -> bool {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let (u, v) = (sight.pixel.u + 0.5, sight.pixel.v + 0.5);
    u > -0.5 * width && u < 1.5 * width && v > -0.5 * height && v < 1.5 * height
}

/// `H^p S_i H^p^T + H^x P_k H^x^T`, the upper two rows.
fn spread(sight: &Sight, point: &Matrix3<f64>, pose: &Matrix6<f64>) -> Matrix2<f64> {
    let (by_point, by_pose): (Matrix3<f64>, Matrix3x6<f64>) = (sight.by_point, sight.by_pose);
    let all = by_pose * pose * by_pose.transpose() + by_point * point * by_point.transpose();
    all.fixed_view::<2, 2>(0, 0).into()
}

fn in_picture(camera: &Camera, sight: &Sight, spread: &Matrix2<f64>) -> f64 {
    let within =
        |x: f64, size: f64, sigma: f64| normal_cdf(x / sigma) - normal_cdf((x - size) / sigma);
    within(
        sight.pixel.u + 0.5,
        f64::from(camera.width),
        spread[(0, 0)].sqrt(),
    ) * within(
        sight.pixel.v + 0.5,
        f64::from(camera.height),
        spread[(1, 1)].sqrt(),
    )
}

/// Detectors do not stop at a range to the centimetre: the edge is 5 cm and 2 % of the range soft.
fn in_range(problem: &Problem<'_>, sight: &Sight) -> f64 {
    let range_m = sight.ground_range_m;
    let soft_m = 0.05 + 0.02 * range_m;
    let mut p = 1.0;
    if problem.max_range_m.is_finite() {
        p *= normal_cdf((problem.max_range_m - range_m) / soft_m);
    }
    if problem.min_range_m > 0.0 {
        p *= normal_cdf((range_m - problem.min_range_m) / soft_m);
    }
    p
}

/// The distribution function of the standard normal.
fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values by scipy.special.ndtr.
    #[test]
    fn normal_distribution_function() {
        for (x, expected) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_542_9),
            (-2.5, 0.006_209_665_325_776_132),
            (-8.0, 6.220_960_574_271_785e-16),
        ] {
            assert!((normal_cdf(x) / expected - 1.0).abs() < 1e-13, "{x}");
        }
    }
}
