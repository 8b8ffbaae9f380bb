//! The whole method, and what comes of it.

use nalgebra::{Matrix3, Matrix6, Vector6};
use serde::Serialize;

use super::algebra::{Square4, to_matrix6};
use super::engine::Engine;
use super::evidence::{Evidence, probability};
use super::solve::Robust;
use super::BeliefSettings;
use crate::adjust::Problem;
use crate::frame::{Enu, Point};
use crate::fuse::Member;

/// Rounds of association and learning at most.
const ROUNDS: usize = 12;
/// And at least.
const LEAST_ROUNDS: usize = 3;
/// They are over where no object moves farther, metres.
const STILL_M: f64 = 1e-3;
/// Squared scales of the robust steps between registration and association.
const SCHEDULE: [f64; 7] = [400.0, 100.0, 100.0, 25.0, 25.0, 9.0, 9.0];

/// The fused map with everything that is believed.
#[derive(Debug, Clone)]
pub struct Belief {
    /// Objects, candidates of little probability among them.
    pub objects: Vec<BeliefObject>,
    /// Errors of the views' poses, by view: what to add to the measured pose, metres and radians.
    pub poses: Vec<Vector6<f64>>,
    /// Their covariances.
    pub pose_covariances: Vec<Matrix6<f64>>,
    /// What each measurement says by itself.
    pub singles: Vec<Single>,
    /// How it went.
    pub evidence: BeliefEvidence,
}

/// An object as it is believed.
#[derive(Debug, Clone)]
pub struct BeliefObject {
    /// Where it is.
    pub place: Point<Enu>,
    /// Covariance of the place, m^2, poses and associations uncertain.
    pub covariance: Matrix3<f64>,
    /// Its size, metres, where measurements say one.
    pub size_m: Option<f64>,
    /// Its class.
    pub class: usize,
    /// Probability that it is real.
    pub p_exist: f64,
    /// The sum of its memberships.
    pub weight: f64,
    /// Measurements that belong to it.
    pub members: Vec<Member>,
}

/// Where a measurement by itself places its object.
#[derive(Debug, Clone, Copy)]
pub struct Single {
    /// The place.
    pub place: Point<Enu>,
    /// Its covariance, m^2.
    pub covariance: Matrix3<f64>,
    /// Whether it lies in the trusted ranges; others take no part.
    pub is_trusted: bool,
}

/// What was learnt, and how it went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeliefEvidence {
    /// Measurements used.
    pub n_observations: usize,
    /// Candidates when it stopped.
    pub n_objects: usize,
    /// Rounds done.
    pub rounds: usize,
    /// Whether nothing changed any more.
    pub converged: bool,
    /// Factors on the standard deviations of readings: column or bearing, row, size, range.
    pub noise_scales: [f64; 4],
    /// Factors on those of poses.
    pub pose_scales: [f64; 6],
    /// Standard deviation of heights above the terrain, metres.
    pub height_sigma_m: f64,
    /// Clutter a view.
    pub clutter_per_view: f64,
    /// Things a view that look like objects and are gone in the next.
    pub transients_per_view: f64,
    /// Objects, 1/m^2.
    pub density_per_m2: f64,
    /// Mean logits of the scores of objects and of clutter, and their variance.
    pub scores: Option<[f64; 3]>,
    /// Probability of detection by apparent size or range.
    pub detectability: Vec<f64>,
}

/// Fuses measurements of many views into one map.
pub fn fuse_belief(problem: &Problem<'_>, settings: &BeliefSettings) -> Belief {
    let fresh = Engine::new(problem, settings);
    let order: Vec<usize> = (0..fresh.n_views()).collect();
    let mut engine = fresh.clone();
    engine.sequence(&order);
    let at_first = engine.partners();
    let (mut evidence, mut rounds, mut converged) = engine.refine();
    let at_last = engine.partners();
    let doubt = at_first.iter().zip(&at_last).filter(|(a, b)| a != b).count() as f64 / at_first.len().max(1) as f64;
    if std::env::var("DEBUGJ").is_ok() { eprintln!("doubt {doubt:.3} q {:.3} psc {:?}", engine.model.scales[0], engine.model.pose_scale.map(|x| (x*100.0).round()/100.0)); }
    let mut best = engine.objective(&evidence);
    let debug = std::env::var("DEBUGJ").is_ok();
    if debug { eprintln!("J first {best:.1}"); }
    let n_pass = super::learn::knob(4, 1.0) as usize;
    for pass in 1..n_pass {
        let mut again = fresh.clone();
        again.model = engine.model.clone();
        again.reset_pose_cov();
        again.settle();
        again.weigh_background();
        let mut order = order.clone();
        if pass == 2 { order.reverse(); }
        again.sequence(&order);
        let (e, r, c) = again.refine();
        let j = again.objective(&e);
        if debug { eprintln!("J pass {pass} {j:.1}"); }
        if j > best {
            best = j;
            engine = again;
            evidence = e;
            rounds = r;
            converged = c;
        }
    }
    engine.outcome(problem, evidence, (rounds, converged))
}

impl Engine<'_> {
    /// Of every look the look before it of the same object.
    fn partners(&self) -> Vec<Option<usize>> {
        let owners = self.owners();
        let mut last = vec![None; self.objects.len()];
        owners
            .iter()
            .enumerate()
            .map(|(look, owner)| {
                let before = &mut last[(*owner)?];
                let found = *before;
                *before = Some(look);
                found
            })
            .collect()
    }

    /// Stage B: rounds of association, adjustment and learning.
    fn refine(&mut self) -> (Evidence, usize, bool) {
        for c2 in SCHEDULE {
            let robust = if self.corrects_poses() {
                Robust::Scale(c2)
            } else {
                Robust::Contaminated
            };
            self.adjust(1, robust, false);
        }
        let mut evidence = Evidence::default();
        for round in 0..ROUNDS {
            let before = (self.owners(), self.objects.clone());
            evidence = self.round();
            self.learn(&evidence);
            let same = before.0 == self.owners() && before.1.len() == self.objects.len();
            let moved = before.1.iter().zip(&self.objects).map(|(a, b)| {
                let far = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                far.fold(0.0, f64::max)
            });
            if same && moved.fold(0.0, f64::max) < STILL_M && round >= LEAST_ROUNDS {
                return (evidence, round + 1, true);
            }
        }
        (evidence, ROUNDS, false)
    }

    /// Logarithm of the posterior, up to a constant: every detection clutter, what each object adds
    /// to that, and the poses.
    fn objective(&self, evidence: &Evidence) -> f64 {
        let clutter: f64 = self.background.iter().map(|b| b.clutter).sum();
        let objects: f64 = evidence
            .log_odds
            .iter()
            .map(|&l| super::noise::ln_add(0.0, l.clamp(-50.0, 500.0)))
            .sum();
        let scores: f64 = self.model.scores.map_or(0.0, |scores| {
            let logits = self.looks.iter().filter_map(|l| l.logit);
            logits.map(|x| scores.ln_object(x)).sum()
        });
        let mut poses = scores;
        if self.corrects_poses() {
            for view in 0..self.n_views() {
                let information = self.pose_information(view);
                for (d, i) in self.delta[view].iter().zip(&information) {
                    poses -= 0.5 * d * d * i;
                }
                poses -= self.model.pose_scale.iter().map(|s| s.ln()).sum::<f64>();
                if let Some((_, ln_det)) = super::algebra::inverse6(&self.pose_cov[view]) {
                    poses += 0.5 * ln_det;
                }
            }
        }
        clutter + objects + poses
    }

    fn outcome(
        &mut self,
        problem: &Problem<'_>,
        _: Evidence,
        (rounds, converged): (usize, bool),
    ) -> Belief {
        let stepped = self.adjust(3, Robust::Contaminated, true);
        self.weigh_background();
        let evidence = self.weigh(self.expectation());
        let (cov, pose_cov) = stepped
            .and_then(|s| s.marginal)
            .unwrap_or_else(|| (self.object_cov.clone(), Vec::new()));
        let mut members: Vec<Vec<Member>> = vec![Vec::new(); self.objects.len()];
        for edge in &self.edges {
            members[edge.object].push(Member {
                observation: self.looks[edge.look].measurement,
                weight: edge.weight,
            });
        }
        let support = self.support();
        let objects = (0..self.objects.len())
            .map(|k| {
                let x = &self.objects[k];
                let mut members = std::mem::take(&mut members[k]);
                members.sort_by_key(|m| m.observation);
                BeliefObject {
                    place: Point::new(x[0], x[1], x[2]),
                    covariance: place_cov(&cov[k]),
                    size_m: self.has_sizes.then(|| x[3].exp()),
                    class: self.classes[k],
                    p_exist: probability(evidence.log_odds[k]),
                    weight: support[k],
                    members,
                }
            })
            .collect();
        let order = super::data::order(problem.views);
        let mut poses = vec![Vector6::zeros(); order.len()];
        let mut pose_covariances = vec![Matrix6::zeros(); order.len()];
        for (i, &view) in order.iter().enumerate() {
            poses[view] = Vector6::from(self.delta[i]);
            let cov = pose_cov.get(i).unwrap_or(&self.pose_cov[i]);
            pose_covariances[view] = to_matrix6(cov);
        }
        let trusted = self.looks.iter().zip(&self.singles);
        let trusted = trusted.map(|(look, single)| (look.measurement, single, true));
        let others = self.untrusted.iter().map(|(m, single)| (*m, single, false));
        let mut singles: Vec<(usize, Single)> = trusted
            .chain(others)
            .map(|(measurement, single, is_trusted)| {
                let x = single.object;
                let single = Single {
                    place: Point::new(x[0], x[1], x[2]),
                    covariance: place_cov(&single.cov),
                    is_trusted,
                };
                (measurement, single)
            })
            .collect();
        singles.sort_by_key(|s| s.0);
        let singles = singles.into_iter().map(|s| s.1).collect();
        let m = &self.model;
        Belief {
            objects,
            poses,
            pose_covariances,
            singles,
            evidence: BeliefEvidence {
                n_observations: self.looks.len(),
                n_objects: self.objects.len(),
                rounds,
                converged,
                noise_scales: m.scales,
                pose_scales: m.pose_scale,
                height_sigma_m: m.height_variance.sqrt(),
                clutter_per_view: m.clutter,
                transients_per_view: m.transients * self.view_area_m2,
                density_per_m2: m.density,
                scores: m.scores.map(|s| [s.object, s.clutter, s.variance]),
                detectability: m.curve.values().to_vec(),
            },
        }
    }
}

fn place_cov(cov: &Square4) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| 0.5 * (cov[i][j] + cov[j][i]))
}
