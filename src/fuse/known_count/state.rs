//! Memberships, and the two ways to renew those of a view given the other views.

use nalgebra::{Matrix2, Vector2};

use super::KnownCount;
use super::views::{Views, inverse};
use crate::fuse::Exclusive;
use crate::matching::{Pair, assign};

/// An object that rests on no more than this much membership in other views is not known to a view.
const UNKNOWN: f64 = 0.5;
/// ln of the largest odds that go into the marginals; larger ones are lowered together.
const MOST_LOG_ODDS: f64 = 60.0;
/// Memberships below this are forgotten.
const FORGOTTEN: f64 = 1e-9;

/// A membership.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// Index among the observations sorted by view.
    pub(super) observation: usize,
    pub(super) object: usize,
    pub(super) weight: f64,
}

/// What some views say of an object.
#[derive(Debug, Clone, Copy)]
struct Known {
    weight: f64,
    information: Matrix2<f64>,
    /// Information times place.
    weighted: Vector2<f64>,
}

impl Known {
    const NOTHING: Self = Self {
        weight: 0.0,
        information: Matrix2::new(0.0, 0.0, 0.0, 0.0),
        weighted: Vector2::new(0.0, 0.0),
    };

    /// Place and covariance; `None` where too little is known.
    fn place(&self) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        (self.weight > UNKNOWN).then(|| {
            let covariance = inverse(&self.information);
            (covariance * self.weighted, covariance)
        })
    }
}

/// The memberships of all observations.
pub(super) struct State {
    /// By view; ascending by observation, then object.
    by_view: Vec<Vec<Edge>>,
    n_objects: usize,
    /// The largest move of a place in the last iteration, metres.
    pub(super) last_move_m: f64,
    marginals: Exclusive,
}

impl State {
    /// No memberships.
    pub(super) fn empty(views: &Views, n_objects: usize) -> Self {
        Self {
            by_view: vec![Vec::new(); views.count()],
            n_objects,
            last_move_m: 0.0,
            marginals: Exclusive::new(),
        }
    }

    /// From now on lets messages settle: objects that overlap on all sides take longer to agree than
    /// a search needs.
    pub(super) fn settle_marginals(&mut self) {
        self.marginals.max_iterations = 100;
    }

    pub(super) fn n_objects(&self) -> usize {
        self.n_objects
    }

    /// All memberships, ascending by view and observation.
    pub(super) fn edges(&self) -> impl Iterator<Item = Edge> {
        self.by_view.iter().flatten().copied()
    }

    /// What the views but one say of the objects.
    fn without(&self, views: &Views, view: Option<usize>) -> Vec<Known> {
        let mut known = vec![Known::NOTHING; self.n_objects];
        for (other, edges) in self.by_view.iter().enumerate() {
            if Some(other) == view {
                continue;
            }
            for edge in edges {
                let object = &mut known[edge.object];
                let information = views.information[edge.observation] * edge.weight;
                object.weight += edge.weight;
                object.information += information;
                object.weighted += information * views.points[edge.observation];
            }
        }
        known
    }

    /// Assigns view after view, each to what those before it say.
    pub(super) fn assign_in(&mut self, views: &Views, order: &[usize]) {
        for &view in order {
            self.assign(views, view);
        }
    }

    /// The best whole assignment of a view given the others. Whether it changed.
    fn assign(&mut self, views: &Views, view: usize) -> bool {
        let known = self.without(views, Some(view));
        let places: Vec<_> = known.iter().map(Known::place).collect();
        let observations = views.of(view);
        let mut pairs = Vec::with_capacity(observations.len() * places.len());
        for (left, observation) in observations.clone().enumerate() {
            for (right, place) in places.iter().enumerate() {
                let log_odds = place.map_or_else(
                    || views.log_odds_anywhere(),
                    |place| views.log_odds_at(observation, place, 1.0),
                );
                pairs.push(Pair {
                    left,
                    right,
                    cost: -log_odds,
                });
            }
        }
        let matched = assign(observations.len(), places.len(), &pairs, 0.0);
        let edge = |pair: &Pair| Edge {
            observation: observations.start + pair.left,
            object: pair.right,
            weight: 1.0,
        };
        let edges: Vec<Edge> = matched.iter().map(edge).collect();
        let ends = |edges: &[Edge]| -> Vec<(usize, usize)> {
            edges.iter().map(|e| (e.observation, e.object)).collect()
        };
        let changed = ends(&edges) != ends(&self.by_view[view]);
        self.by_view[view] = edges;
        changed
    }

    /// Whole assignments, of one view after the other given the rest, until none changes. From the
    /// second round on each raises the evidence or leaves it.
    pub(super) fn harden(&mut self, views: &Views, max_iterations: usize) {
        for _ in 0..max_iterations {
            let mut changed = false;
            for view in 0..views.count() {
                changed |= self.assign(views, view);
            }
            if !changed {
                return;
            }
        }
    }

    /// ln of the evidence of a whole assignment, against all observations being clutter.
    pub(super) fn evidence(&self, views: &Views) -> f64 {
        let mut members = vec![Vec::new(); self.n_objects];
        for edge in self.edges() {
            members[edge.object].push(edge.observation);
        }
        let together = members.iter().map(|m| views.log_odds_together(m));
        together.sum()
    }

    /// Memberships by marginals, of one view after the other given the rest, until they settle. The
    /// iterations and the last one's largest change of a membership.
    pub(super) fn soften(
        &mut self,
        views: &Views,
        annealing: &[f64],
        settings: &KnownCount,
    ) -> (usize, f64) {
        let mut change = f64::INFINITY;
        for iteration in 0..settings.max_iterations {
            let widen = annealing.get(iteration).copied().unwrap_or(1.0);
            let before = self.without(views, None);
            change = 0.0;
            for view in 0..views.count() {
                change = change.max(self.share(views, view, widen));
            }
            let after = self.without(views, None);
            self.last_move_m = largest_move(&before, &after);
            if change <= settings.tolerance && iteration >= annealing.len() {
                return (iteration + 1, change);
            }
        }
        (settings.max_iterations, change)
    }

    /// The memberships of a view by the marginals of its odds given the other views. An object that
    /// no other view knows can't be told from the observation it rests on: it keeps what the others
    /// leave of that one.
    fn share(&mut self, views: &Views, view: usize, widen: f64) -> f64 {
        let known = self.without(views, Some(view));
        let observations = views.of(view);
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        let mut odds: Vec<f64> = Vec::new();
        for (k, known) in (0..).zip(&known) {
            let Some(place) = known.place() else { continue };
            for (j, observation) in (0..).zip(observations.clone()) {
                pairs.push((j, k));
                odds.push(views.log_odds_at(observation, place, widen));
            }
        }
        let most = odds.iter().copied().fold(MOST_LOG_ODDS, f64::max);
        for odds in &mut odds {
            *odds = (*odds - (most - MOST_LOG_ODDS)).exp();
        }
        let mut shares = Vec::new();
        let (n_j, n_k) = (observations.len(), self.n_objects);
        self.marginals
            .marginals(n_j, n_k, &pairs, &odds, &mut shares);
        let mut weights = vec![0.0; n_j * n_k];
        for (&(j, k), &share) in pairs.iter().zip(&shares) {
            weights[j as usize * n_k + k as usize] = share;
        }
        for (k, j) in self.rests(view, &known, observations.start) {
            weights[j * n_k + k] = self.marginals.unassigned()[j];
        }
        self.replace(view, observations.start, &weights)
    }

    /// The objects that rest on this view alone, each with the observation it rests on most.
    fn rests(&self, view: usize, known: &[Known], start: usize) -> Vec<(usize, usize)> {
        let mut most: Vec<Option<Edge>> = vec![None; self.n_objects];
        for edge in &self.by_view[view] {
            let alone = known[edge.object].weight <= UNKNOWN;
            let best = &mut most[edge.object];
            if alone && best.is_none_or(|b| edge.weight > b.weight) {
                *best = Some(*edge);
            }
        }
        let mut taken = Vec::new();
        for (k, edge) in most.iter().enumerate() {
            if let Some(edge) = edge {
                let j = edge.observation - start;
                if !taken.iter().any(|&(_, other)| other == j) {
                    taken.push((k, j));
                }
            }
        }
        taken
    }

    /// Puts a view's memberships in, given by observation and object. The largest change of one.
    fn replace(&mut self, view: usize, start: usize, weights: &[f64]) -> f64 {
        let n_k = self.n_objects;
        let mut change = vec![0.0; weights.len()];
        for edge in &self.by_view[view] {
            change[(edge.observation - start) * n_k + edge.object] = -edge.weight;
        }
        let kept = weights.iter().map(|&w| if w < FORGOTTEN { 0.0 } else { w });
        let mut edges = Vec::new();
        for (at, weight) in kept.enumerate() {
            change[at] += weight;
            if weight > 0.0 {
                edges.push(Edge {
                    observation: start + at / n_k,
                    object: at % n_k,
                    weight,
                });
            }
        }
        self.by_view[view] = edges;
        change.iter().fold(0.0, |most, c: &f64| most.max(c.abs()))
    }
}

fn largest_move(before: &[Known], after: &[Known]) -> f64 {
    let moved = before.iter().zip(after);
    let moved = moved.filter_map(|(a, b)| Some((b.place()?.0 - a.place()?.0).amax()));
    moved.fold(0.0, f64::max)
}
