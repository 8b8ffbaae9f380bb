//! Registration of one view against the objects known so far (3.6).

use super::algebra::{self, Factor4, Square4, Square6, add_information, inverse6};
use super::data::Look;
use super::engine::Engine;
use super::noise::with_noise;
use super::pairs::{Candidates, ViewExpectation, struck};
use crate::fuse::Exclusive;

/// Candidates that are tried as the one right match.
const FIRST_MATCHES: usize = 60;
/// The best of them, which are tried with a second match ...
const EXTENDED: usize = 3;
/// ... out of this many candidates ...
const SECOND_MATCHES: usize = 40;
/// ... whose squared Mahalanobis distance is below this.
const SECOND_GATE: f64 = 9.0;
/// Rounds of association and correction after the best hypothesis.
const ROUNDS: usize = 4;
/// Exponents are cut to this.
const MOST_EXPONENT: f64 = 50.0;

/// A view's pose as registration found it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Registered {
    pub(super) score: f64,
    pub(super) delta: [f64; 6],
    pub(super) cov: Square6,
}

/// A candidate as hypotheses score it.
struct Match {
    /// Which of the view's looks it is.
    look: usize,
    n: usize,
    e: [f64; 4],
    by_pose: [[f64; 6]; 4],
    /// Noise of the reading and the object's spread.
    without_pose: Square4,
    /// Logarithm of the odds at a density of one.
    base: f64,
    /// How many candidates its look has.
    ambiguity: usize,
}

/// A hypothesis about a pose: a shift and what is uncertain of it.
#[derive(Clone, Copy)]
struct Hypothesis {
    shift: [f64; 6],
    cov: Square6,
}

impl Engine<'_> {
    /// Where a view stands, given the objects known so far, its pose as it is believed and the
    /// covariance that belief has.
    pub(super) fn register(
        &mut self,
        view: usize,
        among: &Candidates<'_>,
        prior: &Square6,
        exclusive: &mut Exclusive,
    ) -> Registered {
        let before = self.delta[view];
        let none = Registered {
            score: f64::NEG_INFINITY,
            delta: before,
            cov: *prior,
        };
        let found = self.expectation_of(view, among, prior);
        let Some((information, ln_det)) = inverse6(prior) else {
            return none;
        };
        if found.candidates.is_empty() {
            return none;
        }
        let matches = self.matches(view, &found);
        let best = self.best_hypothesis(view, &matches, prior, &information);
        let mut cov = best.cov;
        self.set_delta(view, added(&before, &best.shift));
        let mut score = f64::NEG_INFINITY;
        for _ in 0..ROUNDS {
            let found = self.expectation_of(view, among, &cov);
            if found.candidates.is_empty() {
                score = f64::NEG_INFINITY;
                break;
            }
            let p = self.associate_view(view, &found, exclusive);
            let shift = subtracted(&self.delta[view], &before);
            let mut a = information;
            let mut b: [f64; 6] = std::array::from_fn(|i| -dot(&information[i], &shift));
            for (c, &p) in found.candidates.iter().zip(&p) {
                let pair = &found.pairs[c.candidate.pair];
                let look = &self.looks[c.candidate.look];
                let Some(factor) = noise_without_pose(pair, c, look) else {
                    continue;
                };
                let (_, by_pose) = pair.seen.of(look);
                add_information(&mut a, &by_pose, &factor.inverse(), look.n, p);
                let weighted = factor.solve(&c.e);
                for r in 0..look.n {
                    for (b, h) in b.iter_mut().zip(&by_pose[r]) {
                        *b += p * h * weighted[r];
                    }
                }
            }
            let Some((posterior, ln_det_information)) = inverse6(&a) else {
                break;
            };
            cov = posterior;
            let step: [f64; 6] = std::array::from_fn(|i| dot(&cov[i], &b));
            let delta = added(&self.delta[view], &step);
            self.set_delta(view, delta);
            let shift = subtracted(&delta, &before);
            score = self.evidence(view, &found)
                - 0.5 * quadratic(&information, &shift)
                - 0.5 * ln_det
                - 0.5 * ln_det_information;
        }
        let out = Registered {
            score,
            delta: self.delta[view],
            cov,
        };
        self.set_delta(view, before);
        out
    }

    /// Membership of each candidate, where no object is detected twice.
    pub(super) fn associate_view(
        &self,
        view: usize,
        found: &ViewExpectation,
        exclusive: &mut Exclusive,
    ) -> Vec<f64> {
        let first = self.start[view];
        let mut pairs = Vec::with_capacity(found.candidates.len());
        let mut odds = Vec::with_capacity(found.candidates.len());
        for c in &found.candidates {
            let candidate = c.candidate;
            let pair = &found.pairs[candidate.pair];
            let p = pair.exists * pair.pair.p_detect;
            let exponent = candidate.ln_likelihood - self.background[candidate.look].all;
            let exponent = exponent.clamp(-MOST_EXPONENT, MOST_EXPONENT);
            odds.push(exponent.exp() * p / (1.0 - p));
            pairs.push((short(candidate.look - first), short(candidate.pair)));
        }
        let mut p = Vec::new();
        let n_looks = self.looks_of(view).len();
        exclusive.marginals(n_looks, found.pairs.len(), &pairs, &odds, &mut p);
        p
    }

    /// How much better the view's detections are explained with the objects than without.
    fn evidence(&self, view: usize, found: &ViewExpectation) -> f64 {
        let first = self.start[view];
        let mut sums = vec![0.0; self.looks_of(view).len()];
        for c in &found.candidates {
            let candidate = c.candidate;
            let exponent = candidate.ln_likelihood - self.background[candidate.look].all;
            let odds = exponent.clamp(-MOST_EXPONENT, MOST_EXPONENT).exp();
            let pair = &found.pairs[candidate.pair];
            sums[candidate.look - first] += odds * pair.exists * pair.pair.p_detect;
        }
        sums.iter().map(|s: &f64| s.ln_1p()).sum()
    }

    fn matches(&self, view: usize, found: &ViewExpectation) -> Vec<Match> {
        let first = self.start[view];
        let mut count = vec![0; self.looks_of(view).len()];
        for c in &found.candidates {
            count[c.candidate.look - first] += 1;
        }
        let unit = 0.5 * (2.0 * std::f64::consts::PI).ln();
        found
            .candidates
            .iter()
            .map(|c| {
                let pair = &found.pairs[c.candidate.pair];
                let look = &self.looks[c.candidate.look];
                let (_, by_pose) = pair.seen.of(look);
                let local = c.candidate.look - first;
                Match {
                    look: local,
                    n: look.n,
                    e: c.e,
                    by_pose,
                    without_pose: spread_without_pose(pair, c, look),
                    base: (pair.exists * pair.pair.p_detect).ln() + c.ln_class
                        - self.background[c.candidate.look].all
                        - unit * look.n_rows(),
                    ambiguity: count[local],
                }
            })
            .collect()
    }

    /// The best of: no match, one match, two matches.
    fn best_hypothesis(
        &self,
        view: usize,
        matches: &[Match],
        prior: &Square6,
        information: &Square6,
    ) -> Hypothesis {
        let mut order: Vec<usize> = (0..matches.len()).collect();
        order.sort_by_key(|&i| (matches[i].ambiguity, matches[i].look, i));
        order.truncate(FIRST_MATCHES);
        let n_looks = self.looks_of(view).len();
        let none = Hypothesis {
            shift: [0.0; 6],
            cov: *prior,
        };
        let mut best = (
            Scoring::new(matches, &none, n_looks).score_of_none(information),
            none,
        );
        let mut scoring = Scoring::new(matches, &none, n_looks);
        let mut first: Vec<(f64, Hypothesis)> = order
            .iter()
            .filter_map(|&o| scoring.with(o, information))
            .collect();
        first.sort_by(|a, b| b.0.total_cmp(&a.0));
        if first.first().is_none_or(|f| f.0 <= best.0) {
            return best.1;
        }
        best = first[0];
        for (_, hypothesis) in first.iter().take(EXTENDED) {
            let mut scoring = Scoring::new(matches, hypothesis, n_looks);
            let second: Vec<usize> = order
                .iter()
                .copied()
                .filter(|&o| scoring.mahalanobis2(o) < SECOND_GATE)
                .take(SECOND_MATCHES)
                .collect();
            for o in second {
                if let Some(found) = scoring.with(o, information)
                    && found.0 > best.0
                {
                    best = found;
                }
            }
        }
        best.1
    }
}

/// Scores hypotheses that extend one by a match.
struct Scoring<'a> {
    matches: &'a [Match],
    base: Hypothesis,
    /// Residuals and spreads under the hypothesis that is extended, and `H cov`.
    e: Vec<[f64; 4]>,
    spread: Vec<Square4>,
    gain: Vec<[[f64; 6]; 4]>,
    sums: Vec<f64>,
}

impl<'a> Scoring<'a> {
    fn new(matches: &'a [Match], base: &Hypothesis, n_looks: usize) -> Self {
        let mut scoring = Self {
            matches,
            base: *base,
            e: Vec::with_capacity(matches.len()),
            spread: Vec::with_capacity(matches.len()),
            gain: Vec::with_capacity(matches.len()),
            sums: vec![0.0; n_looks],
        };
        for m in matches {
            let mut e = m.e;
            let mut gain = [[0.0; 6]; 4];
            for r in 0..m.n {
                e[r] -= dot(&m.by_pose[r], &base.shift);
                for (h, row) in m.by_pose[r].iter().zip(&base.cov) {
                    for (g, c) in gain[r].iter_mut().zip(row) {
                        *g += h * c;
                    }
                }
            }
            let mut spread = algebra::spread(&m.by_pose, &base.cov, m.n);
            for (row, more) in spread.iter_mut().zip(&m.without_pose) {
                for (s, x) in row.iter_mut().zip(more) {
                    *s += x;
                }
            }
            scoring.e.push(e);
            scoring.spread.push(spread);
            scoring.gain.push(gain);
        }
        scoring
    }

    fn mahalanobis2(&self, o: usize) -> f64 {
        Factor4::new(&self.spread[o], self.matches[o].n)
            .map_or(f64::INFINITY, |f| f.mahalanobis2(&self.e[o]))
    }

    fn score_of_none(&mut self, information: &Square6) -> f64 {
        self.sums.fill(0.0);
        for (i, m) in self.matches.iter().enumerate() {
            if let Some(factor) = Factor4::new(&self.spread[i], m.n) {
                let exponent =
                    -0.5 * factor.mahalanobis2(&self.e[i]) - 0.5 * factor.ln_det + m.base;
                self.sums[m.look] += exponent.clamp(-60.0, 60.0).exp();
            }
        }
        self.total(&self.base.shift, information)
    }

    fn total(&self, shift: &[f64; 6], information: &Square6) -> f64 {
        let explained: f64 = self.sums.iter().map(|s| s.ln_1p()).sum();
        explained - 0.5 * quadratic(information, shift)
    }

    /// The hypothesis extended by a match, with its score.
    fn with(&mut self, o: usize, information: &Square6) -> Option<(f64, Hypothesis)> {
        let chosen = &self.matches[o];
        let n = chosen.n;
        let inverse = Factor4::new(&self.spread[o], n)?.inverse();
        let pull: [f64; 4] = std::array::from_fn(|r| dot(&inverse[r], &self.e[o]));
        self.sums.fill(0.0);
        for (i, m) in self.matches.iter().enumerate() {
            // Covariance between the two residuals, and what the match takes off mean and spread.
            let mut e = self.e[i];
            let mut spread = self.spread[i];
            let mut cross = [[0.0; 4]; 4];
            let mut left = [[0.0; 4]; 4];
            for a in 0..m.n {
                for b in 0..n {
                    cross[a][b] = dot(&self.gain[i][a], &chosen.by_pose[b]);
                }
                for c in 0..n {
                    left[a][c] = dot(&cross[a], &inverse[c]);
                }
                e[a] -= dot(&cross[a], &pull);
                for b in 0..=a {
                    spread[a][b] -= dot(&left[a], &cross[b]);
                }
            }
            if let Some(factor) = Factor4::new(&spread, m.n) {
                let exponent = -0.5 * factor.mahalanobis2(&e) - 0.5 * factor.ln_det + m.base;
                self.sums[m.look] += exponent.clamp(-60.0, 60.0).exp();
            }
        }
        let gain = &self.gain[o];
        let shift: [f64; 6] = std::array::from_fn(|i| {
            self.base.shift[i] + (0..n).map(|r| gain[r][i] * pull[r]).sum::<f64>()
        });
        let mut cov = self.base.cov;
        for i in 0..6 {
            for j in 0..6 {
                for r in 0..n {
                    for s in 0..n {
                        cov[i][j] -= gain[r][i] * inverse[r][s] * gain[s][j];
                    }
                }
            }
        }
        Some((self.total(&shift, information), Hypothesis { shift, cov }))
    }
}

/// Spread of the readings without the pose's share, with their noise.
fn spread_without_pose(
    pair: &super::pairs::PairInFull,
    c: &super::pairs::CandidateInFull,
    look: &Look,
) -> Square4 {
    let mut spread = pair.spread;
    for (row, less) in spread.iter_mut().zip(&pair.by_pose) {
        for (s, l) in row.iter_mut().zip(less) {
            *s -= l;
        }
    }
    let spread = pair.seen.spread_of_ends(look, &spread);
    with_noise(&struck(&spread, &look.has), &c.variances, 1.0)
}

fn noise_without_pose(
    pair: &super::pairs::PairInFull,
    c: &super::pairs::CandidateInFull,
    look: &Look,
) -> Option<Factor4> {
    Factor4::new(&spread_without_pose(pair, c, look), look.n)
}

#[inline]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

fn quadratic(a: &Square6, x: &[f64; 6]) -> f64 {
    a.iter().zip(x).map(|(row, x_i)| x_i * dot(row, x)).sum()
}

fn added(a: &[f64; 6], b: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| a[i] + b[i])
}

fn subtracted(a: &[f64; 6], b: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// Views have fewer looks and pairs than four thousand million.
pub(super) fn short(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}
