//! The observations by view, with what their odds are made of.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Matrix2, Vector2};

use super::KnownCount;
use crate::fuse::Observation;

/// Probabilities of detection and clutter are kept off one and zero by this much, so that odds stay
/// finite: what can't be otherwise is merely unlikely.
const LEAST: f64 = 1e-12;

/// Observations sorted by view.
pub(super) struct Views {
    /// Index among all observations.
    pub(super) origin: Vec<usize>,
    pub(super) points: Vec<Vector2<f64>>,
    /// Inverse covariances.
    pub(super) information: Vec<Matrix2<f64>>,
    pub(super) covariance: Vec<Matrix2<f64>>,
    view: Vec<usize>,
    ranges: Vec<Range<usize>>,
    /// ln of p / ((1 - p) clutter): the odds of a detection as an object, without its place.
    log_odds: f64,
    /// ln of the density at which an object of which nothing is known is expected anywhere.
    pub(super) log_anywhere: f64,
}

impl Views {
    pub(super) fn new(observations: &[Observation], settings: &KnownCount) -> Self {
        let mut origin: Vec<usize> = (0..observations.len()).collect();
        origin.sort_by_key(|&i| observations[i].view);
        let of = |i: &usize| &observations[*i];
        let points: Vec<Vector2<f64>> = origin.iter().map(|i| of(i).place.xyz.xy()).collect();
        let horizontal = |i: &usize| {
            let full = of(i).covariance;
            let horizontal = full.fixed_view::<2, 2>(0, 0).into_owned();
            // Singular ones are given a width that does not matter.
            horizontal + Matrix2::identity() * (1e-12 * horizontal.trace() + 1e-18)
        };
        let covariance: Vec<Matrix2<f64>> = origin.iter().map(horizontal).collect();
        let view: Vec<usize> = origin.iter().map(|i| of(i).view).collect();
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for same in view.chunk_by(|a, b| a == b) {
            let start = ranges.last().map_or(0, |r| r.end);
            ranges.push(start..start + same.len());
        }
        let p = settings.p_detect.clamp(LEAST, 1.0 - LEAST);
        Self {
            log_odds: (p / (1.0 - p)).ln() - settings.clutter_per_m2.max(LEAST).ln(),
            log_anywhere: -extent(&points, &covariance).ln(),
            information: covariance.iter().map(inverse).collect(),
            covariance,
            points,
            view,
            ranges,
            origin,
        }
    }

    /// How many views there are with an observation.
    pub(super) fn count(&self) -> usize {
        self.ranges.len()
    }

    /// The observations of a view.
    pub(super) fn of(&self, view: usize) -> Range<usize> {
        self.ranges[view].clone()
    }

    /// The view's number, as given.
    pub(super) fn view_of(&self, observation: usize) -> usize {
        self.view[observation]
    }

    /// ln of the odds of an observation as an object expected at a place with this covariance,
    /// against it being clutter and the object missed; `widen` times the covariance of the two
    /// together.
    pub(super) fn log_odds_at(
        &self,
        observation: usize,
        (place, covariance): (Vector2<f64>, Matrix2<f64>),
        widen: f64,
    ) -> f64 {
        let total = (covariance + self.covariance[observation]) * widen;
        let off = self.points[observation] - place;
        let squared = (off.transpose() * inverse(&total) * off)[(0, 0)];
        self.log_odds - 0.5 * squared - log_normaliser(&total)
    }

    /// The same for an object that could be anywhere.
    pub(super) fn log_odds_anywhere(&self) -> f64 {
        self.log_odds + self.log_anywhere
    }

    /// ln of the odds of these observations as one object, against all being clutter: the product
    /// of their Gaussians, the place integrated out.
    pub(super) fn log_odds_together(&self, observations: &[usize]) -> f64 {
        if observations.is_empty() {
            return 0.0;
        }
        let information: Matrix2<f64> = observations.iter().map(|&j| self.information[j]).sum();
        let inverse = inverse(&information);
        let weighted = |&j: &usize| self.information[j] * self.points[j];
        let mean = inverse * observations.iter().map(weighted).sum::<Vector2<f64>>();
        let mut sum = self.log_anywhere + log_normaliser(&inverse);
        for &j in observations {
            let off = self.points[j] - mean;
            let squared = (off.transpose() * self.information[j] * off)[(0, 0)];
            sum += self.log_odds - 0.5 * squared - log_normaliser(&self.covariance[j]);
        }
        sum
    }
}

/// ln of the square root of `det(2 pi C)`.
fn log_normaliser(covariance: &Matrix2<f64>) -> f64 {
    TAU.ln() + 0.5 * covariance.determinant().ln()
}

/// The inverse of a symmetric positive definite matrix.
pub(super) fn inverse(m: &Matrix2<f64>) -> Matrix2<f64> {
    Matrix2::new(m[(1, 1)], -m[(0, 1)], -m[(1, 0)], m[(0, 0)]) / m.determinant()
}

/// The area over which the points spread, with their errors, square metres.
fn extent(points: &[Vector2<f64>], covariance: &[Matrix2<f64>]) -> f64 {
    let reach = |axis: usize| {
        let width = covariance.iter().map(|c| c[(axis, axis)]);
        let width = width.fold(0.0, f64::max).sqrt();
        let at = || points.iter().map(|p| p[axis]);
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min) + 2.0 * width
    };
    reach(0) * reach(1)
}
