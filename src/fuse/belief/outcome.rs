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
    /// Probability of detection by apparent size or range.
    pub detectability: Vec<f64>,
}

/// Fuses measurements of many views into one map.
pub fn fuse_belief(problem: &Problem<'_>, settings: &BeliefSettings) -> Belief {
    let mut engine = Engine::new(problem, settings);
    let order: Vec<usize> = (0..engine.n_views()).collect();
    engine.sequence(&order);
    let (evidence, rounds, converged) = engine.refine();
    engine.outcome(problem, evidence, (rounds, converged))
}

impl Engine<'_> {
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
                detectability: m.curve.values().to_vec(),
            },
        }
    }
}

fn place_cov(cov: &Square4) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| 0.5 * (cov[i][j] + cov[j][i]))
}
