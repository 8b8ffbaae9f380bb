//! What views expect to see, and which detections may be of it (3.1).

use nalgebra::Vector3;
use rayon::prelude::*;

use super::algebra::{self, ByPose, Square4, Square6};
use super::classes::{Class, Given};
use super::data::Platform;
use super::engine::{Engine, normal_cdf};
use super::expect::Expected;
use super::near::Buckets;
use super::noise::{WIDE, log_likelihood};

/// Detections this far from the expected (squared Mahalanobis distance under the wide noise) cannot
/// be of the object.
pub(super) const GATE: f64 = 16.0;
/// Objects less likely in the picture than this are not expected.
const LEAST_INSIDE: f64 = 1e-3;
/// Objects nearer than this are not expected, metres.
const NEAREST_M: f64 = 0.3;
/// Objects of which less is in the picture, as a share of a side, are not detected.
const LEAST_LEFT: f64 = 0.25;
/// How far beyond the reach objects may still be expected: a factor and metres.
const MARGIN: (f64, f64) = (1.05, 1.0);

/// An object near the footprint of a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) view: usize,
    pub(super) object: usize,
    /// Probability that it is in the picture and in the ranges.
    pub(super) inside: f64,
    /// Probability that its aim point lies beyond the picture's border and enough of it within, and
    /// that it is in the ranges.
    pub(super) beyond: f64,
    /// Probability that it is detected, if it exists.
    pub(super) p_detect: f64,
    /// Where its detectability is read off the curve.
    pub(super) visibility: f64,
}

/// A pair with everything that comparing detections with it needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairInFull {
    pub(super) pair: Pair,
    pub(super) seen: Expected,
    /// The pose's share of the spread of its readings.
    pub(super) by_pose: Square4,
    /// Pose and object together.
    pub(super) spread: Square4,
    /// Probability that the object exists.
    pub(super) exists: f64,
}

/// A detection that may be of an object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) look: usize,
    /// Index of its pair.
    pub(super) pair: usize,
    pub(super) ln_likelihood: f64,
}

/// A candidate with its residual, its derivatives and its noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct CandidateInFull {
    pub(super) candidate: Candidate,
    pub(super) e: [f64; 4],
    pub(super) variances: [f64; 4],
    /// What of the likelihood comes of the class.
    pub(super) ln_class: f64,
}

/// What all views expect.
#[derive(Debug, Clone, Default)]
pub(super) struct Expectation {
    /// By view, and then by object.
    pub(super) pairs: Vec<Pair>,
    /// By pair, and then by look.
    pub(super) candidates: Vec<Candidate>,
}

/// What one view expects.
#[derive(Debug, Clone, Default)]
pub(super) struct ViewExpectation {
    pub(super) pairs: Vec<PairInFull>,
    pub(super) candidates: Vec<CandidateInFull>,
}

/// The objects that views are compared with.
#[derive(Clone, Copy)]
pub(super) struct Candidates<'a> {
    pub(super) objects: &'a [[f64; 4]],
    pub(super) cov: &'a [Square4],
    pub(super) classes: &'a [Class],
    /// Which detections made them what they are, the view's own among them.
    pub(super) given: Given<'a>,
    /// Probabilities that they exist; all do where there are none.
    pub(super) exist: &'a [f64],
    pub(super) near: &'a Buckets,
}

impl Engine<'_> {
    /// How far from a view objects are looked for, metres.
    pub(super) fn search_m(&self) -> f64 {
        MARGIN.0 * self.reach_m + MARGIN.1
    }

    /// What every view expects of the objects as they are believed now.
    pub(super) fn expectation(&self) -> Expectation {
        let near = Buckets::over(self.bucket_m(), self.objects.iter());
        let among = Candidates {
            objects: &self.objects,
            cov: &self.object_cov,
            classes: &self.classes,
            given: Given {
                edges: &self.edges,
                times: &self.class_times,
            },
            exist: &[],
            near: &near,
        };
        let views: Vec<(Vec<Pair>, Vec<Candidate>)> = (0..self.n_views())
            .into_par_iter()
            .map(|view| {
                let found = self.expectation_of(view, &among, &self.pose_cov[view]);
                let pairs = found.pairs.iter().map(|p| p.pair).collect();
                let candidates = found.candidates.iter().map(|c| c.candidate).collect();
                (pairs, candidates)
            })
            .collect();
        let mut all = Expectation::default();
        for (pairs, candidates) in views {
            let offset = all.pairs.len();
            all.pairs.extend(pairs);
            all.candidates.extend(candidates.iter().map(|c| Candidate {
                pair: c.pair + offset,
                ..*c
            }));
        }
        all
    }

    pub(super) fn bucket_m(&self) -> f64 {
        (0.5 * self.search_m()).max(1e-3)
    }

    /// What one view expects, its pose known with a covariance.
    pub(super) fn expectation_of(
        &self,
        view: usize,
        among: &Candidates<'_>,
        pose_cov: &Square6,
    ) -> ViewExpectation {
        let mut found = ViewExpectation::default();
        let origin = self.poses[view].origin;
        let reach_m = self.search_m();
        for k in among.near.about(origin.x, origin.y, reach_m) {
            let x = &among.objects[k];
            let away2 = (x[0] - origin.x).powi(2) + (x[1] - origin.y).powi(2);
            if away2 > reach_m * reach_m || self.is_aside(view, x) {
                continue;
            }
            if let Some(mut pair) = self.pair(view, k, x, &among.cov[k], pose_cov) {
                pair.exists = among.exist.get(k).copied().unwrap_or(1.0);
                found.pairs.push(pair);
            }
        }
        for p in 0..found.pairs.len() {
            let pair = &found.pairs[p];
            let object = pair.pair.object;
            let joins = self.joins(view, object, &among.classes[object], among.given);
            for look in self.looks_of(view) {
                if let Some(ln_class) = joins(self.looks[look].class)
                    && let Some(mut candidate) = self.candidate(look, p, pair)
                {
                    candidate.candidate.ln_likelihood += ln_class;
                    candidate.ln_class = ln_class;
                    found.candidates.push(candidate);
                }
            }
        }
        found
    }

    /// Whether an object lies so far off a camera's axis that its reading need not be computed:
    /// most of those in reach do.
    fn is_aside(&self, view: usize, x: &[f64; 4]) -> bool {
        let (platform, pose) = (&self.platforms[view], &self.poses[view]);
        // The near face may stand at another angle than the middle.
        if platform.least_cosine <= -1.0 || self.settings.radius_m > 0.0 {
            return false;
        }
        let away = Vector3::new(x[0], x[1], x[2]) - pose.origin;
        let depth = pose.from_camera.column(2).dot(&away);
        depth < platform.least_cosine * away.norm()
    }

    fn pair(
        &self,
        view: usize,
        object: usize,
        x: &[f64; 4],
        cov: &Square4,
        pose_cov: &Square6,
    ) -> Option<PairInFull> {
        let seen = self.expect(view, x)?;
        if seen.values[3] < NEAREST_M || !is_near(&self.platforms[view], &seen) {
            return None;
        }
        let (by_object, by_pose): (&Square4, &ByPose) = (&seen.by_object, &seen.by_pose);
        let by_pose = algebra::spread(by_pose, pose_cov, 4);
        let mut spread = algebra::spread(by_object, cov, 4);
        for (row, more) in spread.iter_mut().zip(&by_pose) {
            for (s, m) in row.iter_mut().zip(more) {
                *s += m;
            }
        }
        let (inside, beyond) = self.in_picture(view, &seen, &spread);
        let in_range = self.in_range(seen.range_m);
        let (inside, beyond) = (inside * in_range, beyond * in_range);
        let seen_at_all = inside + self.model.border * beyond;
        if seen_at_all.is_nan() || seen_at_all <= LEAST_INSIDE {
            return None;
        }
        let visibility = self.visibility(x, &seen);
        let p_detect = (seen_at_all * self.model.curve.at(visibility)).clamp(1e-4, 0.99);
        Some(PairInFull {
            pair: Pair {
                view,
                object,
                inside,
                beyond,
                p_detect,
                visibility,
            },
            seen,
            by_pose,
            spread,
            exists: 1.0,
        })
    }

    /// Probability that the object's reading lies in the picture, or in the sector; and that it lies
    /// beyond the picture's border while enough of the object is within.
    fn in_picture(&self, view: usize, seen: &Expected, spread: &Square4) -> (f64, f64) {
        let platform = &self.platforms[view];
        let sigma = |r: usize| {
            let noise = self.typical[r] * self.model.scales[r];
            (spread[r][r] + noise * noise).sqrt()
        };
        let within = |x: f64, low: f64, high: f64, sigma: f64| {
            normal_cdf((x - low) / sigma) - normal_cdf((x - high) / sigma)
        };
        match platform.camera.as_deref() {
            Some(camera) => {
                let (width, height) = (f64::from(camera.width), f64::from(camera.height));
                let inside = within(seen.values[0], -0.5, width - 0.5, sigma(0))
                    * within(seen.values[1], -0.5, height - 0.5, sigma(1));
                if !self.has_sizes {
                    return (inside, 0.0);
                }
                let lengths = self.shape.lengths_px(seen.values[2].exp());
                let mut any = 1.0;
                for (r, side) in [width, height].into_iter().enumerate() {
                    let before = lengths[r] * (1.0 - self.aim[r] - LEAST_LEFT).max(0.0);
                    let after = lengths[r] * (self.aim[r] - LEAST_LEFT).max(0.0);
                    any *= within(seen.values[r], -0.5 - before, side - 0.5 + after, sigma(r));
                }
                (inside, (any - inside).max(0.0))
            }
            None => {
                let (low, high) = platform.sector;
                let inside = if high - low >= std::f64::consts::TAU - 1e-9 {
                    1.0
                } else {
                    within(seen.values[0], low, high, sigma(0))
                };
                (inside, 0.0)
            }
        }
    }

    fn candidate(&self, look: usize, index: usize, pair: &PairInFull) -> Option<CandidateInFull> {
        let detection = &self.looks[look];
        let ends = pair.seen.of_ends(detection);
        let (expected, spread) = match &ends {
            Some(ends) => (
                &ends.values,
                &pair.seen.spread_of_ends(detection, &pair.spread),
            ),
            None => (&pair.seen.values, &pair.spread),
        };
        // The column alone rules most detections out.
        let mut e = [0.0; 4];
        e[0] = detection.values[0] - expected[0];
        if detection.is_bearing() {
            e[0] = super::expect::wrapped(e[0]);
        }
        let loose = self.looseness[look];
        if e[0] * e[0] > GATE * (spread[0][0] + WIDE * loose[0]) {
            return None;
        }
        for r in 1..detection.n {
            if detection.has[r] {
                e[r] = detection.values[r] - expected[r];
                if e[r] * e[r] > GATE * (spread[r][r] + WIDE * loose[r]) {
                    return None;
                }
            }
        }
        let spread = struck(spread, &detection.has);
        let rows = (detection.n, detection.n_rows());
        let (ln_likelihood, m2) = log_likelihood(&e, &spread, &loose, rows)?;
        (m2 < GATE).then_some(CandidateInFull {
            candidate: Candidate {
                look,
                pair: index,
                ln_likelihood,
            },
            e,
            variances: loose,
            ln_class: 0.0,
        })
    }
}

/// A spread without the rows that were not read.
#[inline]
pub(super) fn struck(spread: &Square4, has: &[bool; 4]) -> Square4 {
    let mut out = *spread;
    for r in 0..4 {
        if !has[r] {
            out[r] = [0.0; 4];
            for row in &mut out {
                row[r] = 0.0;
            }
        }
    }
    out
}

/// Half a picture around the picture: what is farther out cannot come in.
fn is_near(platform: &Platform, seen: &Expected) -> bool {
    let Some(camera) = platform.camera.as_deref() else {
        return true;
    };
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let (u, v) = (seen.values[0] + 0.5, seen.values[1] + 0.5);
    u > -0.5 * width && u < 1.5 * width && v > -0.5 * height && v < 1.5 * height
}
