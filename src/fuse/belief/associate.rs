//! The E-step: which detection is of which object (3.2), births and deaths (3.3).

use rayon::prelude::*;

use super::engine::{Edge, Engine};
use super::evidence::{Evidence, probability};
use super::looks::Repeats;
use super::register::short;
use super::solve::Robust;
use crate::fuse::Exclusive;

/// Exponents are cut to this.
const MOST_EXPONENT: f64 = 60.0;
/// A detection counts this much for an object that it was part of, when the object's existence is
/// asked without it.
const OWN_EVIDENCE: f64 = 2.0;
/// Objects with less support from other views cannot be confirmed by the detection they come from.
const OTHERS: f64 = 0.5;
/// Memberships below this are dropped.
const LEAST_MEMBERSHIP: f64 = 0.01;
/// Objects with less support are dropped.
const LEAST_SUPPORT: f64 = 0.3;
/// Looks less apart than this repeat each other.
const REPEATS: f64 = 0.5;
/// Memberships of which a detection may be the origin of its object.
const ORIGIN: f64 = 0.05;

impl Engine<'_> {
    /// One round: associations, births, deaths, the adjustment and merges.
    pub(super) fn round(&mut self) -> Evidence {
        self.settle();
        self.weigh_background();
        let evidence = self.weigh(self.expectation());
        self.associate(&evidence);
        self.adjust(2, Robust::Contaminated, false);
        self.merge();
        self.settle();
        self.weigh_background();
        self.weigh(self.expectation())
    }

    /// New memberships, with births and deaths.
    fn associate(&mut self, evidence: &Evidence) {
        let expectation = &evidence.expectation;
        let (pairs, candidates) = (&expectation.pairs, &expectation.candidates);
        let support = self.support();
        let before = self.previous(evidence);
        let mut detected = vec![0.0; pairs.len()];
        for (c, w) in candidates.iter().zip(&before) {
            detected[c.pair] += w;
        }
        let odds: Vec<f64> = pairs
            .iter()
            .enumerate()
            .map(|(i, pair)| {
                let own = if detected[i] > 0.5 {
                    OWN_EVIDENCE
                } else {
                    (-pair.p_detect).ln_1p()
                };
                let without = evidence.log_odds[pair.object] - own * evidence.worth[i];
                let p = probability(without.clamp(-20.0, 20.0)) * pair.p_detect;
                p / (1.0 - p)
            })
            .collect();
        let is_own: Vec<bool> = candidates
            .iter()
            .map(|c| support[pairs[c.pair].object] - detected[c.pair] < OTHERS)
            .collect();
        let mut memberships = self.memberships(evidence, &odds, &is_own);
        let mut unexplained = vec![1.0; self.looks.len()];
        let mut has_candidate = vec![false; self.looks.len()];
        let supporters = self.supporters();
        for (c, p) in candidates.iter().zip(&memberships) {
            unexplained[c.look] -= p;
            let pair = &pairs[c.pair];
            has_candidate[c.look] |= self.repeats(&supporters[pair.object], pair.object, pair.view);
        }
        let mut origin: Vec<Option<usize>> = vec![None; self.looks.len()];
        for (i, c) in candidates.iter().enumerate() {
            if is_own[i] && before[i] > ORIGIN {
                let best = &mut origin[c.look];
                if best.is_none_or(|b| before[i] > before[b]) {
                    *best = Some(i);
                }
            }
        }
        for (look, origin) in origin.iter().enumerate() {
            if let Some(i) = *origin {
                memberships[i] = unexplained[look];
            }
        }
        let mut edges: Vec<Edge> = candidates
            .iter()
            .zip(&memberships)
            .filter(|(_, p)| **p > LEAST_MEMBERSHIP)
            .map(|(c, &weight)| Edge {
                look: c.look,
                object: pairs[c.pair].object,
                weight,
            })
            .collect();
        for look in 0..self.looks.len() {
            if !has_candidate[look] && unexplained[look] > 0.5 && origin[look].is_none() {
                edges.push(Edge {
                    look,
                    object: self.objects.len(),
                    weight: unexplained[look],
                });
                self.objects.push(self.singles[look].object);
                self.object_cov.push(self.singles[look].cov);
                self.classes.push(self.class_of(look));
            }
        }
        edges.sort_by_key(|e| (e.look, e.object));
        self.edges = edges;
        let support = self.support();
        let keep: Vec<bool> = support.iter().map(|&s| s > LEAST_SUPPORT).collect();
        self.compact(&keep);
        self.hear_classes();
    }

    /// Of every object the views that detected it, ascending.
    fn supporters(&self) -> Vec<Vec<usize>> {
        let mut views: Vec<Vec<usize>> = vec![Vec::new(); self.objects.len()];
        for edge in &self.edges {
            if edge.weight > 0.5 {
                views[edge.object].push(self.looks[edge.look].view);
            }
        }
        for views in &mut views {
            views.sort_unstable();
            views.dedup();
        }
        views
    }

    /// Whether a view sees an object so shortly before or after another that detected it, that a
    /// detection off the mark is more of the same error than of another object.
    fn repeats(&self, supporters: &[usize], object: usize, view: usize) -> bool {
        let after = supporters.partition_point(|&v| v <= view);
        let before = supporters[..after].iter().rev().find(|&&v| v != view);
        let neighbours = before.into_iter().chain(supporters.get(after));
        let x = &self.objects[object];
        neighbours
            .into_iter()
            .any(|&v| self.apart(x, v, view, Repeats::Errors) < REPEATS)
    }

    /// The weight that each candidate had in the last round.
    fn previous(&self, evidence: &Evidence) -> Vec<f64> {
        let key = |e: &Edge| (e.look, e.object);
        let mut edges: Vec<Edge> = self.edges.clone();
        edges.sort_by_key(key);
        let pairs = &evidence.expectation.pairs;
        let candidates = evidence.expectation.candidates.iter();
        candidates
            .map(|c| {
                let found = edges.binary_search_by_key(&(c.look, pairs[c.pair].object), key);
                found.map_or(0.0, |i| edges[i].weight)
            })
            .collect()
    }

    /// Memberships of all candidates but those of an object's own origin.
    fn memberships(&self, evidence: &Evidence, odds: &[f64], is_own: &[bool]) -> Vec<f64> {
        let expectation = &evidence.expectation;
        let candidates = &expectation.candidates;
        let view_of = |i: usize| self.looks[candidates[i].look].view;
        let indices: Vec<usize> = (0..candidates.len()).collect();
        let by_view: Vec<&[usize]> = indices
            .chunk_by(|&a, &b| view_of(a) == view_of(b))
            .collect();
        let parts: Vec<Vec<f64>> = by_view
            .par_iter()
            .map_init(Exclusive::new, |exclusive, indices| {
                let view = view_of(indices[0]);
                let first_pair = indices
                    .iter()
                    .map(|&i| candidates[i].pair)
                    .min()
                    .unwrap_or(0);
                let last_pair = indices
                    .iter()
                    .map(|&i| candidates[i].pair)
                    .max()
                    .unwrap_or(0);
                let mut edges = Vec::new();
                let mut weights = Vec::new();
                let mut active = Vec::new();
                for (at, &i) in indices.iter().enumerate() {
                    if is_own[i] {
                        continue;
                    }
                    let c = &candidates[i];
                    let exponent =
                        c.ln_likelihood - self.background[c.look].all + odds[c.pair].ln();
                    weights.push(exponent.clamp(-MOST_EXPONENT, MOST_EXPONENT).exp());
                    edges.push((short(c.look - self.start[view]), short(c.pair - first_pair)));
                    active.push(at);
                }
                let mut p = Vec::new();
                exclusive.marginals(
                    self.looks_of(view).len(),
                    last_pair - first_pair + 1,
                    &edges,
                    &weights,
                    &mut p,
                );
                let mut all = vec![0.0; indices.len()];
                for (at, p) in active.iter().zip(&p) {
                    all[*at] = *p;
                }
                all
            })
            .collect();
        parts.concat()
    }

    /// Leaves out objects, with their edges. Returns the new number of each.
    pub(super) fn compact(&mut self, keep: &[bool]) -> Vec<Option<usize>> {
        let mut next = 0;
        let number: Vec<Option<usize>> = keep
            .iter()
            .map(|&kept| {
                kept.then(|| {
                    next += 1;
                    next - 1
                })
            })
            .collect();
        retain(&mut self.objects, keep);
        retain(&mut self.object_cov, keep);
        retain(&mut self.classes, keep);
        self.edges.retain_mut(|edge| match number[edge.object] {
            Some(object) => {
                edge.object = object;
                true
            }
            None => false,
        });
        number
    }

    /// The object that each detection is most probably of, if any is more likely than not.
    pub(super) fn owners(&self) -> Vec<Option<usize>> {
        let mut owners = vec![None; self.looks.len()];
        for edge in &self.edges {
            if edge.weight > 0.5 {
                owners[edge.look] = Some(edge.object);
            }
        }
        owners
    }
}

pub(super) fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut kept = keep.iter();
    items.retain(|_| kept.next().copied().unwrap_or(false));
}
