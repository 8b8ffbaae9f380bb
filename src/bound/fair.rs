//! The bound of a method that puts everything together rightly and still has to say what is real.

use nalgebra::{Vector3, Vector6};

use super::clairvoyant::edges;
use super::{BoundEvidence, BoundMap, NoBound, Partition, objects, starts};
use crate::adjust::{Adjustment, Conditional, Edge, NoSolution, Problem, State, Step};
use crate::existence::{
    Belief, Exposure, Model, Pairs, Prior, Sizes, clutter_log_intensity, learn, log_odds,
    probability,
};

/// Steps of one adjustment are over where no object moves farther, metres.
const STILL_M: f64 = 1e-5;
/// Rounds of learning.
const ROUNDS: usize = 4;

/// The fair bound of a problem.
#[derive(Clone, Copy)]
pub struct Fair<'a> {
    /// What was measured.
    pub problem: &'a Problem<'a>,
    /// How much the views could have seen.
    pub exposure: &'a Exposure,
    /// What is believed before the data.
    pub prior: &'a Prior,
}

/// The map whose groups are those of the labels, a group each clutter detection, with the
/// probability that each is real by the evidence of 3.5; noise, clutter, density, sizes and
/// detectability are learnt. All groups are in the map: what is reported is what has `p_exist` of
/// one half or more.
///
/// # Errors
/// [`NoBound`] where no detection is labelled, a view has no camera or the equations are singular.
pub fn fair(data: &Fair<'_>, partition: &Partition) -> Result<BoundMap, NoBound> {
    if data.problem.views.iter().any(|v| v.camera.is_none()) {
        return Err(NoBound::NoCamera);
    }
    let mut groups = partition.groups.clone();
    let points = starts(data.problem, &mut groups);
    if groups.is_empty() {
        return Err(NoBound::NothingLabelled);
    }
    let edges = edges(&groups);
    let mut solver = Solver::new(data, &edges, points)?;
    for _ in 0..ROUNDS {
        solver.round()?;
    }
    let (step, p_exist) = solver.finish()?;
    let marginals = step.marginals.ok_or(NoSolution)?;
    Ok(BoundMap {
        objects: objects(data.problem, &groups, &solver.state, &marginals, &p_exist),
        poses: solver.state.poses,
        evidence: BoundEvidence {
            iterations: solver.iterations,
            last_move_m: step.move_m,
            converged: step.move_m < 1e-4,
            model: Some(solver.model),
        },
    })
}

/// The unknowns and everything learnt, on the way.
struct Solver<'a> {
    data: Fair<'a>,
    edges: &'a [Edge],
    state: State,
    conditional: Conditional,
    sizes: Sizes,
    model: Model,
    /// Intensity of clutter at every measurement, as the latest round has it.
    clutter: Vec<f64>,
    iterations: usize,
}

impl<'a> Solver<'a> {
    fn new(
        data: &Fair<'a>,
        edges: &'a [Edge],
        points: Vec<Vector3<f64>>,
    ) -> Result<Self, NoSolution> {
        let model = Model::new(data.prior);
        let adjustment = Adjustment {
            problem: *data.problem,
            edges,
            noise: model.noise,
        };
        let mut state = State {
            points,
            poses: vec![Vector6::zeros(); data.problem.views.len()],
        };
        let (step, iterations) = adjustment.iterate(&mut state, 5, STILL_M, false)?;
        Ok(Self {
            conditional: adjustment.conditional(state.points.len(), &step),
            sizes: Sizes::estimate(&adjustment, &state, &model, data.prior),
            data: *data,
            edges,
            state,
            model,
            clutter: Vec::new(),
            iterations,
        })
    }

    fn adjustment(&self) -> Adjustment<'a> {
        Adjustment {
            problem: *self.data.problem,
            edges: self.edges,
            noise: self.model.noise,
        }
    }

    fn belief(&self) -> Belief<'_> {
        Belief {
            adjustment: self.adjustment(),
            state: &self.state,
            conditional: &self.conditional,
            sizes: &self.sizes,
            model: &self.model,
        }
    }

    /// What is real, what that says of the model, and where everything is then.
    fn round(&mut self) -> Result<(), NoSolution> {
        let problem = self.data.problem;
        let measurements = problem.measurements.iter();
        self.clutter = measurements
            .map(|m| clutter_log_intensity(problem, m, &self.model))
            .collect();
        let belief = self.belief();
        let pairs = Pairs::expect(&belief, self.data.prior);
        let detected = pairs.detected(&belief);
        let odds = log_odds(&belief, &pairs, &detected, &self.clutter, self.data.prior);
        let before = (self.data.prior, self.data.exposure);
        self.model = learn(&belief, &pairs, &detected, &odds, before);
        self.adjust(2, false)?;
        Ok(())
    }

    fn adjust(&mut self, limit: usize, marginals: bool) -> Result<Step, NoSolution> {
        let adjustment = self.adjustment();
        let (step, done) = adjustment.iterate(&mut self.state, limit, STILL_M, marginals)?;
        self.iterations += done;
        self.conditional = adjustment.conditional(self.state.points.len(), &step);
        Ok(step)
    }

    /// The last adjustment, with covariances, and the probability that each object is real. The
    /// intensity of clutter is still that of the last round, which the odds were learnt with.
    fn finish(&mut self) -> Result<(Step, Vec<f64>), NoSolution> {
        let step = self.adjust(3, true)?;
        let belief = self.belief();
        let pairs = Pairs::expect(&belief, self.data.prior);
        let detected = pairs.detected(&belief);
        let odds = log_odds(&belief, &pairs, &detected, &self.clutter, self.data.prior);
        Ok((step, odds.into_iter().map(probability).collect()))
    }
}
