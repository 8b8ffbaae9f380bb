//! One E-step of the mixture: the memberships of the observations in the clusters near them.
//!
//! Equations are numbered as in Thompson & Wettergreen, "Multiple-Object Detection in Natural
//! Scenes with Multiple-View Expectation Maximization Clustering", IROS 2005.

use nalgebra::Vector2;

use super::Coverage;
use super::gate::Neighbours;
use crate::frame::Point;

/// How the Gaussians of a view are weighted against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// All alike: standard EM.
    Equal,
    /// By the logistic of how much of the view each already accounts for: the paper's eq. 5.
    Logistic,
}

/// The mixing weight of a view that says nothing about a cluster, beta(S = 1).
pub(super) const NEUTRAL: f64 = 0.5;

/// The mixing weights of one cluster: beta by view, ascending, for the views that have an
/// observation near it.
pub(super) type Betas = Vec<(usize, f64)>;

/// Observations and clusters near each other, cluster by cluster.
pub(super) struct Edges {
    /// Where each cluster's edges start; one more at the end.
    starts: Vec<usize>,
    /// The observation of each edge; ascending within a cluster, hence grouped by view.
    pub(super) observation: Vec<usize>,
    /// ln G of each edge (eq. 1), without the Gaussian's constant.
    log_g: Vec<f64>,
    /// The largest `log_g` of each observation, subtracted before exponentials are taken.
    row_max: Vec<f64>,
}

impl Edges {
    /// All pairs within `gate_m` of each other. `points` are sorted by view.
    pub(super) fn new(
        points: &[Vector2<f64>],
        tree: &Neighbours,
        means: &[Vector2<f64>],
        width_m: f64,
        gate_m: f64,
    ) -> Self {
        let near = tree.within_each(means, gate_m);
        let mut starts = vec![0];
        let mut observation = Vec::new();
        let mut log_g = Vec::new();
        let mut row_max = vec![f64::NEG_INFINITY; points.len()];
        for (mean, near) in means.iter().zip(&near) {
            for &j in near {
                let g = -(points[j] - mean).norm_squared() / (2.0 * width_m * width_m);
                row_max[j] = row_max[j].max(g);
                observation.push(j);
                log_g.push(g);
            }
            starts.push(observation.len());
        }
        Self {
            starts,
            observation,
            log_g,
            row_max,
        }
    }

    /// The edges of a cluster.
    pub(super) fn of(&self, cluster: usize) -> std::ops::Range<usize> {
        self.starts[cluster]..self.starts[cluster + 1]
    }

    /// Memberships under a mixing weight an edge (eq. 4; eq. 2 where all are equal), and the log
    /// likelihood.
    fn memberships(&self, beta: &[f64]) -> (Vec<f64>, f64) {
        let mut sums = vec![0.0; self.row_max.len()];
        let weighted: Vec<f64> = (0..beta.len())
            .map(|e| beta[e] * (self.log_g[e] - self.row_max[self.observation[e]]).exp())
            .collect();
        for (w, &j) in weighted.iter().zip(&self.observation) {
            sums[j] += w;
        }
        let shares = weighted.iter().zip(&self.observation);
        let shares = shares.map(|(w, &j)| w / sums[j]).collect();
        let rows = sums.iter().zip(&self.row_max).filter(|(s, _)| **s > 0.0);
        (shares, rows.map(|(s, max)| s.ln() + max).sum())
    }

    /// The paper's three steps on the current means: memberships under the mixing weights so far,
    /// new mixing weights from them, memberships again. `betas` goes in as left by the last
    /// iteration and comes out updated. For standard EM all weights stay equal.
    pub(super) fn expectation(
        &self,
        weights: Weights,
        views: &[usize],
        means: &[Vector2<f64>],
        coverage: &dyn Coverage,
        betas: &mut [Betas],
    ) -> (Vec<f64>, f64) {
        let mut beta = vec![NEUTRAL; self.observation.len()];
        if weights == Weights::Equal {
            return self.memberships(&beta);
        }
        for (k, known) in betas.iter().enumerate() {
            for e in self.of(k) {
                let view = views[self.observation[e]];
                if let Ok(at) = known.binary_search_by_key(&view, |&(v, _)| v) {
                    beta[e] = known[at].1;
                }
            }
        }
        let (shares, _) = self.memberships(&beta);
        for (k, betas) in betas.iter_mut().enumerate() {
            *betas = self.updated(k, &shares, views, means[k], coverage, &mut beta);
        }
        self.memberships(&beta)
    }

    /// Equation 5 for one cluster: beta = 1 / (1 + exp(S - 1)), S the sum of its memberships in a
    /// view. It lowers beta where S exceeds 1, as the formula (and not the prose around it) says.
    /// A view whose footprint does not cover the cluster owes it nothing and stays neutral.
    fn updated(
        &self,
        cluster: usize,
        shares: &[f64],
        views: &[usize],
        mean: Vector2<f64>,
        coverage: &dyn Coverage,
        beta: &mut [f64],
    ) -> Betas {
        let mut betas = Betas::new();
        let mut edges = self.of(cluster);
        while let Some(first) = edges.next() {
            let view = views[self.observation[first]];
            let mut last = first;
            while last + 1 < edges.end && views[self.observation[last + 1]] == view {
                last += 1;
                edges.next();
            }
            let sum: f64 = shares[first..=last].iter().sum();
            let place = Point::new(mean.x, mean.y, 0.0);
            let updated = if coverage.covers(view, place) {
                1.0 / (1.0 + (sum - 1.0).exp())
            } else {
                NEUTRAL
            };
            beta[first..=last].fill(updated);
            betas.push((view, updated));
        }
        betas
    }
}
