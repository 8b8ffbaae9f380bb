//! The whole method, and what comes of it.

use nalgebra::{DMatrix, Matrix3, Matrix6, Vector6};
use rayon::prelude::*;
use serde::Serialize;

use super::BeliefSettings;
use super::algebra::{Square4, Square6, to_matrix6};
use super::bias::{Bias, Term};
use super::drift::Drift;
use super::effect::Repetition;
use super::engine::Engine;
use super::evidence::probability;
use super::learn::LEAST_VIEWS;
use super::solve::Robust;
use crate::adjust::Problem;
use crate::frame::{Enu, Point};
use crate::fuse::Member;

/// Registration is tried again where more than this share of the detections changed company.
const DOUBT: f64 = 0.015;
/// Rounds of association and learning after errors of poses were found to drift.
const DRIFT_ROUNDS: usize = 3;
/// Steps at most that look for biases.
const BIAS_STEPS: usize = 4;

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
    /// The probability that it is of that class, where the detector takes classes for each other.
    pub p_class: Option<f64>,
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
    /// Orders of the views that were tried.
    pub n_starts: usize,
    /// The share of detections that the rounds gave other company than registration.
    pub doubt: f64,
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
    /// What sensors read too much, where the data say so.
    pub biases: Vec<Bias>,
    /// How the errors of consecutive views repeat themselves.
    pub repetition: Repetition,
    /// How pose errors drift, stated or found.
    pub drift: Option<Drift>,
}

/// Covariances of objects and of poses, everything else free.
type Covariances = (Vec<Square4>, Vec<Square6>);

/// Errors that views share.
#[derive(Default)]
struct Shared {
    repetition: Repetition,
    /// Biases, and a standard deviation of each.
    biases: Vec<(Term, f64)>,
}

/// Fuses measurements of many views into one map.
///
/// Where the rounds of association undo much of what registration did, registration is tried again
/// with what was learnt, in both directions, and the most probable of the three maps is taken.
pub fn fuse_belief(problem: &Problem<'_>, settings: &BeliefSettings) -> Belief {
    let fresh = Engine::new(problem, settings);
    let forward: Vec<usize> = (0..fresh.n_views()).collect();
    let backward: Vec<usize> = forward.iter().rev().copied().collect();
    let mut best = Start::new(fresh.clone(), &forward);
    let mut n_starts = 1;
    if best.doubt > DOUBT && fresh.corrects_poses() {
        let model = best.engine.model.clone();
        let again: Vec<Start<'_>> = [forward, backward]
            .par_iter()
            .map(|order| {
                let mut engine = fresh.clone();
                engine.model = model.clone();
                engine.reset_pose_cov();
                engine.settle();
                engine.weigh_background();
                Start::new(engine, order)
            })
            .collect();
        for start in again {
            n_starts += 1;
            if start.objective > best.objective {
                best = start;
            }
        }
    }
    best.outcome(problem, n_starts)
}

/// A map from one order of the views.
struct Start<'a> {
    engine: Engine<'a>,
    rounds: usize,
    converged: bool,
    /// The share of detections that the rounds gave other company than registration.
    doubt: f64,
    /// Logarithm of the posterior.
    objective: f64,
}

impl<'a> Start<'a> {
    fn new(mut engine: Engine<'a>, order: &[usize]) -> Self {
        engine.sequence(order);
        let before = engine.partners();
        let (evidence, rounds, converged) = engine.refine();
        let after = engine.partners();
        let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let doubt = changed as f64 / before.len().max(1) as f64;
        Self {
            objective: engine.objective(&evidence),
            engine,
            rounds,
            converged,
            doubt,
        }
    }

    fn outcome(mut self, problem: &Problem<'_>, n_starts: usize) -> Belief {
        let mut belief = self.engine.outcome(problem, self.rounds, self.converged);
        belief.evidence.n_starts = n_starts;
        belief.evidence.doubt = self.doubt;
        belief
    }
}

impl Engine<'_> {
    /// The adjustment that covariances are taken of, and what errors views turned out to share.
    fn last_adjustment(&mut self) -> (Option<Covariances>, Shared) {
        let Some(mut marginal) = self.settled() else {
            return (None, Shared::default());
        };
        if self.find_drift() {
            for _ in 0..DRIFT_ROUNDS {
                let evidence = self.round();
                self.learn(&evidence);
            }
            if let Some(settled) = self.settled() {
                marginal = settled;
            }
        }
        self.readings = self.looks.iter().map(|l| l.values).collect();
        self.terms = self.terms();
        let none = (Vec::new(), DMatrix::zeros(0, 0));
        let Some(mut survey) = self.survey() else {
            return (Some(marginal), Shared::default());
        };
        let mut shared = Shared {
            repetition: self.repetition(&survey, &marginal.0, &none),
            biases: Vec::new(),
        };
        let mut any = false;
        for _ in 0..BIAS_STEPS {
            if !self.find_biases(&survey, shared.repetition.design_effect) {
                break;
            }
            any = true;
            if let Some(settled) = self.settled() {
                marginal = settled;
            }
            let Some(next) = self.survey() else { break };
            survey = next;
            let mut wide = marginal.clone();
            let on = self.biases_on(&survey, 1.0);
            survey.widen(&on.0, &on.1, &mut wide);
            shared.repetition = self.repetition(&survey, &wide.0, &on);
        }
        if any {
            let (on, covariance) = self.biases_on(&survey, 1.0);
            survey.widen(&on, &covariance, &mut marginal);
            shared.biases = on
                .iter()
                .enumerate()
                .map(|(i, &t)| {
                    let sigma = (covariance[(i, i)] * shared.repetition.design_effect).sqrt();
                    (self.terms[t], sigma)
                })
                .collect();
        }
        let support = self.support();
        for (cov, looks) in marginal.0.iter_mut().zip(&support) {
            let factor = shared.repetition.of(*looks);
            for x in cov.iter_mut().flatten() {
                *x *= factor;
            }
        }
        (Some(marginal), shared)
    }

    /// The last steps and marginal covariances. What is learnt of the poses' noise on the way
    /// leaves out errors that views share; the covariances shall not.
    fn settled(&mut self) -> Option<Covariances> {
        let mut marginal = self.adjust(3, Robust::Contaminated, true)?.marginal;
        let learns = self.corrects_poses() && self.drift_law().is_none();
        if learns && self.n_views() >= LEAST_VIEWS {
            for _ in 0..2 {
                let Some(poses) = marginal.as_ref().map(|m| &m.1) else {
                    break;
                };
                self.learn_pose_noise(Some(poses));
                marginal = self.adjust(1, Robust::Contaminated, true)?.marginal;
            }
        }
        marginal
    }

    fn outcome(&mut self, problem: &Problem<'_>, rounds: usize, converged: bool) -> Belief {
        let (marginal, shared) = self.last_adjustment();
        self.weigh_background();
        let evidence = self.weigh(self.expectation());
        let log_odds = evidence.final_log_odds();
        let (cov, pose_cov) = marginal.unwrap_or_else(|| (self.object_cov.clone(), Vec::new()));
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
                let (class, p_class) = self.best_class(k);
                let mut members = std::mem::take(&mut members[k]);
                members.sort_by_key(|m| m.observation);
                BeliefObject {
                    place: Point::new(x[0], x[1], x[2]),
                    covariance: place_cov(&cov[k]),
                    size_m: self.has_sizes.then(|| x[3].exp()),
                    class,
                    p_class,
                    p_exist: probability(log_odds[k]),
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
                n_starts: 1,
                doubt: 0.0,
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
                biases: self.biases(problem, &shared.biases),
                repetition: shared.repetition,
                drift: m.drift,
            },
        }
    }

    fn biases(&self, problem: &Problem<'_>, biases: &[(Term, f64)]) -> Vec<Bias> {
        let order = super::data::order(problem.views);
        let of_sensor = |sensor: usize| {
            let at = self.platforms.iter().position(|p| p.sensor == sensor)?;
            problem.views.get(order[at])
        };
        let bias = |(term, sigma): &(Term, f64)| {
            let view = of_sensor(term.sensor);
            Bias {
                platform: view.and_then(|v| v.platform.as_deref()).map(str::to_owned),
                camera: view
                    .and_then(|v| v.camera.as_deref())
                    .map(|c| c.name.to_string()),
                of: term.of,
                value: term.value,
                sigma: *sigma,
            }
        };
        biases.iter().map(bias).collect()
    }
}

fn place_cov(cov: &Square4) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| 0.5 * (cov[i][j] + cov[j][i]))
}
