//! What speaks for each object being real, and against (3.5).

use std::f64::consts::PI;

use super::algebra::{self, Factor4, Square4, add_information, inverse4};
use super::engine::Engine;
use super::looks::Repeats;
use super::noise::{ln_add, log_likelihood, with_noise};
use super::pairs::{Expectation, Pair};

/// Detection probabilities below this are taken for it where there was a detection.
const LEAST_DETECTION: f64 = 0.02;

/// What all views say of all objects.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    pub(super) expectation: Expectation,
    /// Of every pair the weight with which the view detected the object, at most one.
    pub(super) detected: Vec<f64>,
    /// How many independent chances every pair is worth.
    pub(super) worth: Vec<f64>,
    /// How many independent detections every edge is worth.
    pub(super) edge_worth: Vec<f64>,
    /// Log-odds that each object exists, against clutter.
    pub(super) log_odds: Vec<f64>,
    /// Log-odds of a thing that is seldom detected against each object.
    seldom: Vec<f64>,
}

impl Evidence {
    /// Log-odds that each object exists, against clutter and things that are seldom detected.
    ///
    /// While fusion is on its way, detection probabilities are rough, and objects that they do not
    /// fit would be lost; so this is asked at the end.
    pub(super) fn final_log_odds(&self) -> Vec<f64> {
        let seldom = self.log_odds.iter().zip(&self.seldom);
        seldom.map(|(l, s)| l - ln_add(0.0, l + s)).collect()
    }
}

/// One in so many things that stand still and are detected is none of the objects: seldom seen, by
/// an odd angle or light, and not what the detector was made for.
const SELDOM: f64 = 0.01;
/// How often such a thing is detected: a Beta distribution, one look in ten in the mean.
const SELDOM_RATE: (f64, f64) = (1.0, 9.0);

/// How often an object was detected, and what that is worth if it is one.
#[derive(Debug, Clone, Copy, Default)]
struct Rate {
    hits: f64,
    misses: f64,
    ln_object: f64,
}

impl Rate {
    fn hit(&mut self, weight: f64, ln: f64) {
        self.hits += weight;
        self.ln_object += ln;
    }

    fn miss(&mut self, weight: f64, ln: f64) {
        self.misses += weight;
        self.ln_object += ln;
    }

    /// Log-odds of a thing that is seldom detected against an object.
    fn seldom(&self) -> f64 {
        let (a, b) = SELDOM_RATE;
        let seen = ln_beta(a + self.hits, b + self.misses) - ln_beta(a, b);
        SELDOM.ln() + seen - self.ln_object
    }
}

/// Logarithm of Euler's beta function.
fn ln_beta(a: f64, b: f64) -> f64 {
    libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b)
}

/// The probability of log-odds.
pub(super) fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds.clamp(-30.0, 30.0)).exp())
}

/// The pair of a view and an object, among pairs by view and object.
pub(super) fn find(pairs: &[Pair], view: usize, object: usize) -> Option<usize> {
    pairs
        .binary_search_by_key(&(view, object), |p| (p.view, p.object))
        .ok()
}

impl Engine<'_> {
    /// Weighs the evidence, given what views expect.
    pub(super) fn weigh(&self, expectation: Expectation) -> Evidence {
        let pairs = &expectation.pairs;
        let of_pairs: Vec<(usize, usize)> = pairs.iter().map(|p| (p.object, p.view)).collect();
        let worth = self.worth(&self.objects, &of_pairs, Repeats::Detection);
        let of_edges: Vec<(usize, usize)> = self
            .edges
            .iter()
            .map(|e| (e.object, self.looks[e.look].view))
            .collect();
        let edge_worth = self.worth(&self.objects, &of_edges, Repeats::Detection);
        let mut detected = vec![0.0; pairs.len()];
        let mut log_odds = vec![self.model.density.ln(); self.objects.len()];
        let mut rates = vec![Rate::default(); self.objects.len()];
        let mut information: Vec<Square4> = Vec::with_capacity(self.objects.len());
        for (k, (x, l)) in self.objects.iter().zip(&mut log_odds).enumerate() {
            let prior = self.prior(x);
            *l += prior.ln_density + 2.0 * (2.0 * PI).ln();
            *l += self.class_evidence(k);
            information.push(prior.information);
        }
        for (edge, worth) in self.edges.iter().zip(&edge_worth) {
            let (look, k) = (&self.looks[edge.look], edge.object);
            let pair = find(pairs, look.view, k);
            if let Some(pair) = pair {
                detected[pair] += edge.weight;
            }
            let weight = edge.weight * worth;
            let p = pair.map_or(0.0, |p| pairs[p].p_detect);
            let for_hit = weight * p.max(LEAST_DETECTION).ln();
            log_odds[k] += for_hit;
            rates[k].hit(weight, for_hit);
            let Some(seen) = self.expect(look.view, &self.objects[k]) else {
                continue;
            };
            let (by_object, by_pose) = seen.of(look);
            let e = seen.residual(look);
            let spread = algebra::spread(&by_pose, &self.pose_cov[look.view], look.n);
            let variances = &self.looseness[edge.look];
            let rows = (look.n, look.n_rows());
            let factor = Factor4::new(&with_noise(&spread, variances, 1.0), look.n);
            let likelihood = log_likelihood(&e, &spread, variances, rows);
            if let (Some(factor), Some((ln_likelihood, ..))) = (factor, likelihood) {
                log_odds[k] += weight * (ln_likelihood - self.background[edge.look].clutter);
                let m = factor.inverse();
                add_information(&mut information[k], &by_object, &m, look.n, weight);
            }
        }
        for (l, a) in log_odds.iter_mut().zip(&information) {
            *l -= 0.5 * inverse4(a).map_or(0.0, |(_, ln_det)| ln_det);
        }
        for ((pair, q), worth) in pairs.iter().zip(&mut detected).zip(&worth) {
            *q = q.min(1.0);
            let weight = worth * (1.0 - *q);
            let for_miss = weight * (-pair.p_detect).ln_1p();
            log_odds[pair.object] += for_miss;
            rates[pair.object].miss(weight * pair.inside, for_miss);
        }

        let seldom = rates.iter().map(Rate::seldom).collect();
        Evidence {
            expectation,
            seldom,
            detected,
            worth,
            edge_worth,
            log_odds,
        }
    }
}
