//! The common shift between two maps, by what most pairs agree on.

use nalgebra::{Matrix2, Vector2};
use serde::Serialize;

use super::Options;
use super::pairs::{Spot, matched, offsets, reach, tree};
use crate::error::{Error, Fault, Place};
use crate::evaluate::agree;

/// Fewest pairs that a shift is believed of: two agree by chance.
const MIN_PAIRS: usize = 3;
/// Most offsets that are tried as the shift. More are thinned out evenly.
const MAX_SEEDS: usize = 20_000;
const MAX_ITERATIONS: usize = 50;
/// Degrees of freedom of Student's distribution, whose weights keep outliers from pulling.
const STUDENT: f64 = 4.0;

/// The common shift of a later map against an earlier one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shift {
    /// To the east, metres.
    pub east_m: f64,
    /// To the north, metres.
    pub north_m: f64,
    /// Standard deviation of the east part, metres.
    pub sigma_east_m: f64,
    /// Standard deviation of the north part, metres.
    pub sigma_north_m: f64,
    /// Pairs of objects that agree on it.
    pub n_pairs: usize,
    /// Iterations it took.
    pub n_iterations: usize,
    /// Whether it had come to rest by then.
    pub converged: bool,
}

impl Shift {
    /// As a vector (east, north), metres.
    pub fn vector(&self) -> Vector2<f64> {
        Vector2::new(self.east_m, self.north_m)
    }
}

/// The shift between two maps, no longer than `reach_m`.
///
/// The offsets of all pairs within reach are drawn as points of a plane. Pairs of the same object
/// heap up at the shift, all others scatter; the densest place (a Gaussian kernel as wide as a
/// typical pair is uncertain) is where it begins. From there, objects are matched and the shift is
/// re-estimated by weighted least squares in turn, with Student's weights, until it rests.
pub(super) fn estimate(
    earlier: &[Spot],
    later: &[Spot],
    reach_m: f64,
    options: &Options,
) -> Result<Shift, Error> {
    let may = |a: &Spot, b: &Spot| !options.by_class || agree(&a.class, b.class.as_deref());
    let offsets = offsets(earlier, later, reach_m, may)?;
    let width_m = typical_sigma_m(earlier, later, options.sigma_m);
    let Some(mut at) = densest(&offsets, width_m) else {
        return Err(too_few(0));
    };
    let mut converged = false;
    let mut n_iterations = 0;
    let mut fit = step(earlier, later, at, options)?;
    while !converged && n_iterations < MAX_ITERATIONS {
        n_iterations += 1;
        converged = (fit.at - at).norm() < 1e-7;
        at = fit.at;
        fit = step(earlier, later, at, options)?;
    }
    if fit.n_pairs < MIN_PAIRS {
        return Err(too_few(fit.n_pairs));
    }
    Ok(Shift {
        east_m: fit.at.x,
        north_m: fit.at.y,
        sigma_east_m: fit.covariance[(0, 0)].max(0.0).sqrt(),
        sigma_north_m: fit.covariance[(1, 1)].max(0.0).sqrt(),
        n_pairs: fit.n_pairs,
        n_iterations,
        converged,
    })
}

fn too_few(n_pairs: usize) -> Error {
    let found = format!("{n_pairs} objects that agree on a shift");
    let expected = format!("at least {MIN_PAIRS}");
    Fault::found(Place::default(), "--align", found, expected).into()
}

/// The median standard deviation of an offset, along one axis.
fn typical_sigma_m(earlier: &[Spot], later: &[Spot], sigma_m: f64) -> f64 {
    let median = |spots: &[Spot]| {
        let mut traces: Vec<f64> = spots.iter().map(|s| s.covariance.trace() / 2.0).collect();
        traces.sort_unstable_by(f64::total_cmp);
        traces.get(traces.len() / 2).copied().unwrap_or(0.0)
    };
    (median(earlier) + median(later) + sigma_m * sigma_m).sqrt()
}

/// The offset with most others about it; of equals the shortest.
fn densest(offsets: &[Vector2<f64>], width_m: f64) -> Option<Vector2<f64>> {
    let tree = tree(offsets.iter().copied());
    let stride = offsets.len().div_ceil(MAX_SEEDS).max(1);
    let reach2 = (3.0 * width_m).powi(2);
    let density = |at: &Vector2<f64>| -> f64 {
        let near = tree.locate_within_distance([at.x, at.y], reach2);
        let mut squares: Vec<f64> = near
            .map(|n| (offsets[n.data] - at).norm_squared())
            .collect();
        // A tree gives its finds in no order that could be relied on; sums have one.
        squares.sort_unstable_by(f64::total_cmp);
        let kernel = |r2: f64| (-0.5 * r2 / (width_m * width_m)).exp();
        squares.into_iter().map(kernel).sum()
    };
    let seeds = offsets.iter().step_by(stride);
    let best = seeds.map(|at| (density(at), at)).max_by(|(d, a), (e, b)| {
        let by_length = b.norm().total_cmp(&a.norm());
        d.total_cmp(e).then(by_length)
    });
    best.map(|(_, at)| *at)
}

/// A shift fitted to the pairs that agree on an earlier one.
struct Fit {
    at: Vector2<f64>,
    covariance: Matrix2<f64>,
    n_pairs: usize,
}

fn step(
    earlier: &[Spot],
    later: &[Spot],
    at: Vector2<f64>,
    options: &Options,
) -> Result<Fit, Error> {
    let shifted: Vec<Spot> = later
        .iter()
        .map(|spot| Spot {
            at: spot.at - at,
            ..spot.clone()
        })
        .collect();
    let a: Vec<&Spot> = earlier.iter().collect();
    let b: Vec<&Spot> = shifted.iter().collect();
    let sigma_m = options.sigma_m;
    let gate = options.gate();
    let cost = |a: &Spot, b: &Spot| {
        let may = !options.by_class || agree(&a.class, b.class.as_deref());
        may.then(|| a.d2(b, sigma_m))
    };
    let reach_m = reach(&a, &b, sigma_m, gate);
    let pairs = matched(&a, &b, reach_m, gate, "--sigma", cost)?;
    let (mut information, mut sum) = (Matrix2::zeros(), Vector2::zeros());
    for pair in &pairs {
        let (a, b) = (a[pair.left], b[pair.right]);
        let Some(inverse) = a.joint(b, sigma_m).try_inverse() else {
            continue;
        };
        let weighted = inverse * ((STUDENT + 2.0) / (STUDENT + pair.cost));
        information += weighted;
        sum += weighted * (b.at - a.at);
    }
    let covariance = information.try_inverse().unwrap_or_else(Matrix2::zeros);
    Ok(Fit {
        at: at + covariance * sum,
        covariance,
        n_pairs: pairs.len(),
    })
}
