//! Objects that are one (3.3).

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::engine::{Edge, Engine};
use super::evidence::Evidence;
use super::near::Buckets;
use super::pairs::Pair;
use super::single::quantile;
use super::solve::Robust;

/// Pairs of objects farther apart (squared Mahalanobis distance of their places) are two.
const GATE: f64 = 12.0;
/// Pairs are looked for within this many standard deviations, and metres.
const SEARCH: (f64, f64) = (5.0, 6.0);
/// Of the views that detected the less seen object, this share may have seen both.
const SHARED: f64 = 0.2;
/// A view that detected both speaks against a merge by at least this.
const LEAST_COST: f64 = 1.0;

/// Two objects that may be one, and what speaks for it but for views that missed them.
struct Twins {
    a: usize,
    b: usize,
    ln_odds: f64,
}

impl Engine<'_> {
    /// Merges objects where the evidence says that they are one.
    pub(super) fn merge(&mut self) {
        if self.objects.len() < 2 {
            return;
        }
        let twins = self.twins();
        if twins.is_empty() {
            return;
        }
        let evidence = self.weigh(self.expectation());
        let into = self.merged(twins, &evidence);
        if into.iter().enumerate().all(|(k, &to)| k == to) {
            return;
        }
        let mut edges: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for edge in &self.edges {
            let weight = edges.entry((edge.look, into[edge.object])).or_default();
            *weight = (*weight + edge.weight).min(1.0);
        }
        self.edges = edges
            .into_iter()
            .map(|((look, object), weight)| Edge {
                look,
                object,
                weight,
            })
            .collect();
        let keep: Vec<bool> = into.iter().enumerate().map(|(k, &to)| k == to).collect();
        self.compact(&keep);
        self.hear_classes();
        self.adjust(2, Robust::Contaminated, false);
    }

    fn twins(&mut self) -> Vec<Twins> {
        let cov = self.whole(|engine, part| engine.apart_cov(&part));
        let mut sigmas: Vec<f64> = cov
            .iter()
            .map(|c| (c[0][0] + c[1][1]).max(1e-6).sqrt())
            .collect();
        sigmas.sort_by(f64::total_cmp);
        let reach_m = (SEARCH.0 * quantile(&sigmas, 0.95).unwrap_or(0.0)).min(SEARCH.1);
        let near = Buckets::over(reach_m.max(1e-3), self.objects.iter());
        let mut twins = Vec::new();
        for (a, x) in self.objects.iter().enumerate() {
            for b in near.about(x[0], x[1], reach_m) {
                if b <= a {
                    continue;
                }
                let Some(ln_class) = self.one_class(a, b) else {
                    continue;
                };
                let y = &self.objects[b];
                let d = [x[0] - y[0], x[1] - y[1]];
                if d[0] * d[0] + d[1] * d[1] > reach_m * reach_m {
                    continue;
                }
                let c = |i: usize, j: usize| cov[a][i][j] + cov[b][i][j];
                let det = c(0, 0) * c(1, 1) - c(0, 1) * c(0, 1);
                let m2 = (c(1, 1) * d[0] * d[0] - 2.0 * c(0, 1) * d[0] * d[1]
                    + c(0, 0) * d[1] * d[1])
                    / det;
                if m2.is_nan() || m2 >= GATE {
                    continue;
                }
                let mut ln_odds =
                    -0.5 * m2 - (2.0 * PI).ln() - 0.5 * det.ln() - self.model.density.ln()
                        + ln_class;
                if self.has_sizes {
                    let v = c(3, 3);
                    ln_odds += -0.5 * (x[3] - y[3]).powi(2) / v - 0.5 * v.ln()
                        + 0.5 * (2.0 * self.model.size.variance).ln();
                }
                twins.push(Twins { a, b, ln_odds });
            }
        }
        twins.sort_by(|s, t| {
            t.ln_odds
                .total_cmp(&s.ln_odds)
                .then((s.a, s.b).cmp(&(t.a, t.b)))
        });
        twins
    }

    /// What each object is merged into: itself, or one with more support.
    fn merged(&self, twins: Vec<Twins>, evidence: &Evidence) -> Vec<usize> {
        let n = self.objects.len();
        let pairs = &evidence.expectation.pairs;
        let mut missed: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
        for (pair, worth) in pairs.iter().zip(&evidence.worth) {
            missed[pair.object].push((pair.view, missing(pair, *worth)));
        }
        let mut seen_by: Vec<BTreeMap<usize, f64>> = vec![BTreeMap::new(); n];
        for (edge, worth) in self.edges.iter().zip(&evidence.edge_worth) {
            if edge.weight > 0.5 {
                let gain = self.gain(edge).max(LEAST_COST) * worth;
                seen_by[edge.object].insert(self.looks[edge.look].view, gain);
            }
        }
        let support = self.support();
        let mut into: Vec<usize> = (0..n).collect();
        let mut gone = vec![false; n];
        for t in twins {
            let (i, j) = if support[t.b] > support[t.a] {
                (t.b, t.a)
            } else {
                (t.a, t.b)
            };
            if gone[i] || gone[j] {
                continue;
            }
            let (si, sj) = (&seen_by[i], &seen_by[j]);
            let shared: Vec<f64> = si
                .iter()
                .filter_map(|(view, g)| Some(g.min(*sj.get(view)?)))
                .collect();
            #[expect(clippy::cast_precision_loss, reason = "counts of views")]
            let too_many = shared.len() as f64 > SHARED * si.len().min(sj.len()) as f64;
            if too_many {
                continue;
            }
            // Apart, each is missed where the other was seen, and both where neither was.
            let mut odds = t.ln_odds - shared.iter().sum::<f64>();
            for (view, m) in &missed[i] {
                if sj.contains_key(view) || !si.contains_key(view) {
                    odds -= m;
                }
            }
            for (view, m) in &missed[j] {
                if si.contains_key(view) {
                    odds -= m;
                }
            }
            if odds > 0.0 {
                into[j] = i;
                gone[j] = true;
                let more = std::mem::take(&mut seen_by[j]);
                for (view, gain) in more {
                    seen_by[i].entry(view).or_insert(gain);
                }
            }
        }
        for k in 0..n {
            let mut to = into[k];
            while into[to] != to {
                to = into[to];
            }
            into[k] = to;
        }
        into
    }

    /// How much likelier a detection is of its object than of none.
    fn gain(&self, edge: &Edge) -> f64 {
        let look = &self.looks[edge.look];
        let Some(seen) = self.expect(look.view, &self.objects[edge.object]) else {
            return 0.0;
        };
        let (_, by_pose) = seen.of(look);
        let spread = super::algebra::spread(&by_pose, &self.pose_cov[look.view], look.n);
        let found = super::noise::log_likelihood(
            &seen.residual(look),
            &spread,
            &self.looseness[edge.look],
            (look.n, look.n_rows()),
        );
        found.map_or(0.0, |(l, ..)| l - self.background[edge.look].all)
    }
}

/// Logarithm of the probability that the view of a pair misses its object.
fn missing(pair: &Pair, worth: f64) -> f64 {
    worth * (-pair.p_detect).ln_1p()
}
