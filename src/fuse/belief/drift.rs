//! Pose errors of which a part drifts slowly along the traverse.
//!
//! The drift is an Ornstein-Uhlenbeck process of the way travelled, and a view's error is the drift
//! there and an independent jitter. With the drift of every view as an unknown of its own the normal
//! equations stay sparse; without, the jitter's prior would couple all views.

use nalgebra::{Matrix6, SMatrix, Vector6};

use super::engine::Engine;
use super::learn::LEAST_VIEWS;
use super::solve::Robust;
use super::system::System;

/// The drift of views at one place differs by no less than this share of its variance.
const LEAST_CHANGE: f64 = 1e-4;
/// With more views than this and few objects, these are kept beside all poses ...
const MOST_VIEWS_FOR_FEW_OBJECTS: usize = 60;
/// ... and with more entries than this between them, errors are taken as independent.
const MOST_ENTRIES: usize = 20_000_000;
/// That errors drift is found among at most so many views.
const MOST_VIEWS: usize = 3000;
/// Errors are taken to drift where that makes the data more probable by this factor, in logarithms.
const LEAST_GAIN: f64 = 5.0;
/// What is tried: shares, and lengths as parts of the whole way.
const SHARES: [f64; 3] = [0.8, 0.5, 0.95];
const PARTS: [f64; 2] = [0.5, 0.125];
/// One so much less probable than independent errors need not be followed by others.
const HOPELESS: f64 = 20.0;

/// How a run's pose errors drift.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
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
        let is_large = 12 * n_views * 4 * n_objects > MOST_ENTRIES;
        let drift = self.drift_law()?;
        (!is_large || !few(n_views, n_objects)).then_some(drift)
    }

    pub(super) fn drift_law(&self) -> Option<Drift> {
        self.model.drift
    }

    /// Finds out whether pose errors drift, and how: by the marginal likelihood of some drifts
    /// against independent errors. Where views are many and objects few, poses have no say of their
    /// own, and how errors repeat themselves shows in the design effect instead. Standard deviations
    /// of errors that drift are at least as stated.
    pub(super) fn find_drift(&mut self) -> bool {
        let asks = self.settings.pose_correction == super::PoseCorrection::PerView;
        let n_views = self.n_views();
        let is_asked = asks && !few(n_views, self.objects.len());
        if !is_asked || !(LEAST_VIEWS..=MOST_VIEWS).contains(&n_views) {
            return false;
        }
        let way_m: f64 = self
            .platforms
            .windows(2)
            .map(|p| (p[1].position - p[0].position).norm())
            .sum();
        if way_m <= 0.0 {
            return false;
        }
        let white = self.model.pose_scale;
        let Some(least) = self.ln_marginal() else {
            return false;
        };
        self.model.pose_scale = white.map(|s| s.max(1.0));
        let mut best: Option<(f64, Drift)> = None;
        let try_one = |engine: &mut Self, best: &mut Option<(f64, Drift)>, drift: Drift| {
            engine.model.drift = Some(drift);
            if let Some(l) = engine.ln_marginal()
                && best.is_none_or(|b| l > b.0)
            {
                *best = Some((l, drift));
            }
        };
        for part in PARTS {
            let drift = Drift {
                share: SHARES[0],
                length_m: part * way_m,
            };
            try_one(self, &mut best, drift);
            if best.is_none_or(|b| b.0 < least - HOPELESS) {
                break;
            }
        }
        let is_found =
            |best: &Option<(f64, Drift)>| best.filter(|b| b.0 > least + LEAST_GAIN).map(|b| b.1);
        if let Some(drift) = is_found(&best) {
            for share in &SHARES[1..] {
                let share = *share;
                try_one(self, &mut best, Drift { share, ..drift });
            }
            let share = is_found(&best).map_or(drift.share, |d| d.share);
            for factor in [0.25, 0.5, 2.0] {
                let length_m = factor * drift.length_m;
                try_one(self, &mut best, Drift { share, length_m });
            }
        }
        self.model.drift = is_found(&best);
        if self.model.drift.is_none() {
            self.model.pose_scale = white;
        }
        self.model.drift.is_some()
    }

    /// Logarithm of the marginal likelihood of the data, up to what does not depend on the errors of
    /// poses, by Laplace's method about the present poses and objects.
    fn ln_marginal(&mut self) -> Option<f64> {
        self.drift.fill([0.0; 6]);
        let normal = self.whole(|engine, part| engine.normal(&part, Robust::Contaminated));
        let mut prior = 0.0;
        for view in 0..self.n_views() {
            let variance = self.pose_prior(view);
            for i in 0..6 {
                let v = variance[i][i];
                prior += self.delta[view][i].powi(2) * self.pose_information(view)[i];
                prior += match self.drift_law() {
                    None => v.ln(),
                    Some(drift) => {
                        let before = view.checked_sub(1);
                        let left = before.map_or(0.0, |b| self.left(&drift, b, view));
                        let change = (1.0 - left * left).max(LEAST_CHANGE);
                        ((1.0 - drift.share).max(1e-3) * v).ln() + (drift.share * v * change).ln()
                    }
                };
            }
        }
        let pulls = normal.pull.clone();
        let turns: Vec<Vector6<f64>> = normal.poses.iter().map(|p| p.1).collect();
        let (system, (steps, turned)) = System::new(normal)?;
        let gain = pulls.iter().zip(&steps);
        let gain = gain.map(|(p, s)| p.iter().zip(s).map(|(p, s)| p * s).sum::<f64>());
        let turning = turns.iter().zip(&turned).map(|(p, t)| p.dot(t));
        let gained = gain.sum::<f64>() + turning.sum::<f64>();
        Some(-0.5 * (prior - gained + system.ln_det()))
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

/// Whether views are many and objects so few that these are kept beside the poses.
pub(super) fn few(n_views: usize, n_objects: usize) -> bool {
    4 * n_objects < 6 * n_views && n_views > MOST_VIEWS_FOR_FEW_OBJECTS
}

impl Chain {
    fn add(&mut self, at: usize, information: &Vector6<f64>, pull: Vector6<f64>) {
        let (a, b) = &mut self.blocks[at];
        *a += Matrix6::from_diagonal(information);
        *b += pull;
    }
}
