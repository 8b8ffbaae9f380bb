//! Pose errors of which a part drifts slowly along the traverse.
//!
//! The drift is an Ornstein-Uhlenbeck process of the way travelled, and a view's error is the drift
//! there and an independent jitter. With the drift of every view as an unknown of its own the normal
//! equations stay sparse; without, the jitter's prior would couple all views.

use nalgebra::{Matrix6, SMatrix, Vector6};

use super::engine::Engine;

/// The drift of views at one place differs by no less than this share of its variance.
const LEAST_CHANGE: f64 = 1e-4;
/// Where views are many and objects few, objects are kept and views eliminated; then drift would
/// couple what is eliminated.
const MOST_VIEWS_FOR_FEW_OBJECTS: usize = 60;

/// How a run's pose errors drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// The share of the variance of a pose error that drifts.
    pub share: f64,
    /// The way after which its correlation has fallen to 1/e, metres.
    pub length_m: f64,
}

/// Information of views and their drifts, each view before its drift.
pub(super) struct Chain {
    pub(super) blocks: Vec<(Matrix6<f64>, Vector6<f64>)>,
    pub(super) links: Vec<(usize, usize, SMatrix<f64, 6, 6>)>,
}

impl Engine<'_> {
    /// The drift, where it can be solved for with so many views and objects.
    pub(super) fn drifts(&self, n_views: usize, n_objects: usize) -> Option<Drift> {
        let drift = self.drift_law()?;
        let few = 4 * n_objects < 6 * n_views && n_views > MOST_VIEWS_FOR_FEW_OBJECTS;
        (!few).then_some(drift)
    }

    pub(super) fn drift_law(&self) -> Option<Drift> {
        match self.settings.pose_correction {
            super::PoseCorrection::Drift => Some(self.settings.drift),
            _ => None,
        }
    }

    /// How much of the drift of one view is left at another.
    fn left(&self, drift: &Drift, a: usize, b: usize) -> f64 {
        let way_m = (self.platforms[a].position - self.platforms[b].position).norm();
        (-way_m / drift.length_m).exp()
    }

    /// What is known of a view's pose error from a view before it: mean and variances.
    pub(super) fn drift_from(&self, before: Option<usize>, view: usize) -> ([f64; 6], [f64; 6]) {
        let prior = self.pose_prior(view);
        let variance: [f64; 6] = std::array::from_fn(|i| prior[i][i]);
        let (Some(drift), Some(before)) = (self.drift_law(), before) else {
            return ([0.0; 6], variance);
        };
        let left = self.left(&drift, before, view);
        let change = 1.0 - drift.share + drift.share * (1.0 - left * left).max(LEAST_CHANGE);
        // What the drift before it is known to, roughly: as well as that view's pose.
        let unsure = drift.share * left * left;
        let mean = self.drift[before].map(|d| d * left);
        let known: [f64; 6] = std::array::from_fn(|i| {
            let pose = self.pose_cov[before][i][i];
            change * variance[i] + (unsure * variance[i]).min(pose)
        });
        (mean, known)
    }

    /// Information of the poses and drifts of views, ascending, before any look.
    pub(super) fn chain(&self, drift: &Drift, views: &[usize]) -> Chain {
        let zero = (Matrix6::zeros(), Vector6::zeros());
        let mut chain = Chain {
            blocks: vec![zero; 2 * views.len()],
            links: Vec::new(),
        };
        for (p, &view) in views.iter().enumerate() {
            let prior = self.pose_prior(view);
            let variance = Vector6::from_fn(|i, _| prior[i][i]);
            let (delta, d) = (self.delta[view], self.drift[view]);
            let jitter = variance.map(|v| 1.0 / ((1.0 - drift.share).max(1e-3) * v));
            let off = Vector6::from_fn(|i, _| delta[i] - d[i]);
            let pull = jitter.component_mul(&off);
            chain.add(2 * p, &jitter, -pull);
            chain.add(2 * p + 1, &jitter, pull);
            chain
                .links
                .push((2 * p + 1, 2 * p, Matrix6::from_diagonal(&-jitter)));
            let before = p.checked_sub(1).map(|q| views[q]);
            let outside = view
                .checked_sub(1)
                .filter(|v| before.is_none() && self.is_settled[*v]);
            let own = drift.share * variance;
            let Some(previous) = before.or(outside) else {
                let information = own.map(|v| 1.0 / v);
                let at = Vector6::from(d);
                chain.add(2 * p + 1, &information, -information.component_mul(&at));
                continue;
            };
            let left = self.left(drift, previous, view);
            let information = own.map(|v| 1.0 / (v * (1.0 - left * left).max(LEAST_CHANGE)));
            let behind = self.drift[previous];
            let off = Vector6::from_fn(|i, _| d[i] - left * behind[i]);
            let pull = information.component_mul(&off);
            chain.add(2 * p + 1, &information, -pull);
            if before.is_some() {
                chain.add(2 * p - 1, &(information * left * left), pull * left);
                let link = Matrix6::from_diagonal(&(information * -left));
                chain.links.push((2 * p + 1, 2 * p - 1, link));
            }
        }
        chain
    }
}

impl Chain {
    fn add(&mut self, at: usize, information: &Vector6<f64>, pull: Vector6<f64>) {
        let (a, b) = &mut self.blocks[at];
        *a += Matrix6::from_diagonal(information);
        *b += pull;
    }
}
