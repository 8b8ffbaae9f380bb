//! The joint adjustment of objects and poses (3.4).

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use super::arrow::{Arrow, Solved};
use super::{CorrectedPose, Prediction, Problem};

/// Information that keeps an object without any from breaking the solution, 1/m^2: a kilometre.
const FAINT: f64 = 1e-6;
/// The longest step of an object, metres: the first linearisation may lie far off.
const MAX_STEP_M: f64 = 1.0;
/// Standard deviations of poses that are taken as exact, metres and radians.
const EXACT: f64 = 1e-9;

/// That a measurement is of an object, with a weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Index of the measurement.
    pub measurement: usize,
    /// Index of the object.
    pub point: usize,
    /// Probability, 0 to 1.
    pub weight: f64,
}

/// How the standard deviations of measurements and poses differ from those that they state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Factor on the standard deviations of readings.
    pub reading: f64,
    /// Factors on those of poses, in the order of [`crate::pose::PoseSigma::to_vector`].
    pub pose: Vector6<f64>,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            reading: 1.0,
            pose: Vector6::repeat(1.0),
        }
    }
}

/// The unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// East, north and height above the surface of every object, metres.
    pub points: Vec<Vector3<f64>>,
    /// The six errors of every view's pose: position, metres, and rotation vector, radians.
    pub poses: Vec<Vector6<f64>>,
}

/// The problem with its edges and noise.
#[derive(Clone, Copy)]
pub struct Adjustment<'a> {
    /// What was measured.
    pub problem: Problem<'a>,
    /// Which measurement is of which object.
    pub edges: &'a [Edge],
    /// The noise.
    pub noise: Noise,
}

/// What one step, or the last of several, came to.
#[derive(Debug, Clone)]
pub struct Step {
    /// The longest move of an object before it was shortened, metres.
    pub move_m: f64,
    /// What every edge expected, where the step was linearised; `None` where the view does not see
    /// the object.
    pub predictions: Vec<Option<Prediction>>,
    /// Marginal covariances there, where they were asked for.
    pub marginals: Option<Marginals>,
}

/// Covariances of each unknown with all others free.
#[derive(Debug, Clone)]
pub struct Marginals {
    /// Of objects: east, north and height, m^2; pinned heights have no variance.
    pub points: Vec<Matrix3<f64>>,
    /// Of pose errors.
    pub poses: Vec<Matrix6<f64>>,
}

/// Covariances of each unknown with the others held.
///
/// Marginals would count the error that all poses share twice, where a view's place is compared with
/// that of an object.
#[derive(Debug, Clone)]
pub struct Conditional {
    /// Of objects, the poses held; pinned heights have a one on the diagonal, and no derivative.
    pub points: Vec<Matrix3<f64>>,
    /// Of pose errors, the objects known as other views know them.
    pub poses: Vec<Matrix6<f64>>,
}

/// Normal equations that have no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the normal equations of points and poses are singular")]
pub struct NoSolution;

impl<'a> Adjustment<'a> {
    /// The views with their poses set right.
    pub fn corrected(&self, poses: &[Vector6<f64>]) -> Vec<CorrectedPose<'a>> {
        let views = self.problem.views;
        let pairs = views.iter().zip(poses);
        pairs.map(|(v, d)| CorrectedPose::new(v, d)).collect()
    }

    /// What every edge expects of its measurement.
    pub fn predictions(&self, state: &State) -> Vec<Option<Prediction>> {
        let poses = self.corrected(&state.poses);
        self.edges
            .par_iter()
            .map(|edge| {
                let measurement = &self.problem.measurements[edge.measurement];
                let pose = &poses[measurement.view];
                pose.predict(&self.problem, measurement, state.points[edge.point])
            })
            .collect()
    }

    /// Information of the rows of an edge's measurement; nothing of rows it does not have.
    pub fn row_information(&self, edge: &Edge) -> Vector3<f64> {
        let reading = &self.problem.measurements[edge.measurement].reading;
        let sigmas = reading.sigmas() * self.noise.reading;
        let n_rows = reading.n_rows();
        Vector3::from_fn(|i, _| if i < n_rows { sigmas[i].powi(-2) } else { 0.0 })
    }

    /// Variances of the rows; ones of rows it does not have.
    pub fn row_variance(&self, edge: &Edge) -> Vector3<f64> {
        self.row_information(edge)
            .map(|x| if x > 0.0 { 1.0 / x } else { 1.0 })
    }

    /// Standard deviations of a view's pose errors.
    pub fn pose_sigma(&self, view: usize) -> Vector6<f64> {
        let sigma = self.problem.views[view].pose.sigma.to_vector();
        sigma.component_mul(&self.noise.pose).map(|s| s.max(EXACT))
    }

    /// What is known of objects before any measurement: information on the diagonal.
    pub fn point_prior(&self) -> Matrix3<f64> {
        let height = if self.problem.is_pinned() {
            1.0
        } else {
            self.problem.height_sigma_m.powi(-2)
        };
        Matrix3::from_diagonal(&Vector3::new(FAINT, FAINT, height))
    }

    /// One Gauss-Newton step from `state`, which it moves.
    ///
    /// # Errors
    /// [`NoSolution`] where the normal equations are singular or not finite.
    pub fn step(&self, state: &mut State, marginals: bool) -> Result<Step, NoSolution> {
        let predictions = self.predictions(state);
        let normal = Normal::new(self, state, &predictions);
        let (points, poses, marginals) = normal.solve(marginals).ok_or(NoSolution)?;
        let moved = points.iter().all(|x| x.iter().all(|c| c.is_finite()));
        if !moved {
            return Err(NoSolution);
        }
        let mut move_m = 0.0f64;
        for (point, mut step) in state.points.iter_mut().zip(points) {
            if self.problem.is_pinned() {
                step.z = 0.0;
            }
            let length = step.norm();
            move_m = move_m.max(length);
            *point += step * (MAX_STEP_M / length.max(1e-9)).min(1.0);
        }
        for (pose, step) in state.poses.iter_mut().zip(poses) {
            *pose += step;
        }
        let marginals = marginals.map(|(mut points, poses)| {
            if self.problem.is_pinned() {
                for cov in &mut points {
                    cov.row_mut(2).fill(0.0);
                    cov.column_mut(2).fill(0.0);
                }
            }
            Marginals { points, poses }
        });
        Ok(Step {
            move_m,
            predictions,
            marginals,
        })
    }

    /// Steps until no object moves by `tolerance_m` or more, at most `limit` of them; returns the
    /// last and how many there were.
    ///
    /// # Errors
    /// As [`Adjustment::step`].
    pub fn iterate(
        &self,
        state: &mut State,
        limit: usize,
        tolerance_m: f64,
        marginals: bool,
    ) -> Result<(Step, usize), NoSolution> {
        let mut step = self.step(state, marginals)?;
        let mut done = 1;
        while done < limit && step.move_m >= tolerance_m {
            step = self.step(state, marginals)?;
            done += 1;
        }
        Ok((step, done))
    }

    /// The conditional covariances of 3.4 at what a step's edges expected.
    pub fn conditional(&self, n_points: usize, step: &Step) -> Conditional {
        let mut information = vec![self.point_prior(); n_points];
        let mut support = vec![0.0; n_points];
        let rows = self.edges.iter().zip(&step.predictions);
        for (edge, prediction) in rows.clone() {
            support[edge.point] += edge.weight;
            if let Some(p) = prediction {
                let rows = Matrix3::from_diagonal(&(self.row_information(edge) * edge.weight));
                information[edge.point] += p.by_point.transpose() * rows * p.by_point;
            }
        }
        let points: Vec<Matrix3<f64>> = information
            .iter()
            .map(|a| a.try_inverse().unwrap_or_else(Matrix3::identity))
            .collect();
        let mut poses: Vec<Matrix6<f64>> = (0..self.problem.views.len())
            .map(|view| Matrix6::from_diagonal(&self.pose_sigma(view).map(|s| s.powi(-2))))
            .collect();
        for (edge, prediction) in rows {
            // Only objects that other views support say anything about this one's pose.
            let (Some(p), true) = (prediction, support[edge.point] - edge.weight > 0.5) else {
                continue;
            };
            let spread = p.by_point * points[edge.point] * p.by_point.transpose()
                + Matrix3::from_diagonal(&self.row_variance(edge));
            let Some(inverse) = spread.try_inverse() else {
                continue;
            };
            let view = self.problem.measurements[edge.measurement].view;
            poses[view] += p.by_pose.transpose() * inverse * p.by_pose * edge.weight;
        }
        let poses = poses
            .iter()
            .map(|c| c.try_inverse().unwrap_or_else(Matrix6::zeros))
            .collect();
        Conditional { points, poses }
    }
}

type Diagonals = (Vec<Matrix3<f64>>, Vec<Matrix6<f64>>);

/// The normal equations of one linearisation.
struct Normal {
    points: Vec<(Matrix3<f64>, Vector3<f64>)>,
    poses: Vec<(Matrix6<f64>, Vector6<f64>)>,
    /// Object, view, and the derivative product between them; in the order of the edges.
    couplings: Vec<(usize, usize, Matrix3x6<f64>)>,
}

impl Normal {
    fn new(adjustment: &Adjustment<'_>, state: &State, predictions: &[Option<Prediction>]) -> Self {
        let prior = adjustment.point_prior();
        let pinned = adjustment.problem.is_pinned();
        let mut points: Vec<_> = state
            .points
            .iter()
            .map(|point| {
                let height = if pinned { 0.0 } else { point.z };
                (prior, Vector3::new(0.0, 0.0, -prior[(2, 2)] * height))
            })
            .collect();
        let mut poses: Vec<_> = state
            .poses
            .iter()
            .enumerate()
            .map(|(view, pose)| {
                let information = adjustment.pose_sigma(view).map(|s| s.powi(-2));
                let pull = -information.component_mul(pose);
                (Matrix6::from_diagonal(&information), pull)
            })
            .collect();
        let mut couplings = Vec::with_capacity(predictions.len());
        for (edge, prediction) in adjustment.edges.iter().zip(predictions) {
            let Some(p) = prediction else { continue };
            let view = adjustment.problem.measurements[edge.measurement].view;
            let rows = adjustment.row_information(edge) * edge.weight;
            let rows = Matrix3::from_diagonal(&rows);
            let point = p.by_point.transpose() * rows;
            let pose = p.by_pose.transpose() * rows;
            points[edge.point].0 += point * p.by_point;
            points[edge.point].1 += point * p.residual;
            poses[view].0 += pose * p.by_pose;
            poses[view].1 += pose * p.residual;
            couplings.push((edge.point, view, point * p.by_pose));
        }
        Self {
            points,
            poses,
            couplings,
        }
    }

    /// The steps of objects and poses, and the diagonal blocks of the inverse where asked for.
    #[expect(clippy::type_complexity, reason = "three parts of one solution")]
    fn solve(
        self,
        covariances: bool,
    ) -> Option<(Vec<Vector3<f64>>, Vec<Vector6<f64>>, Option<Diagonals>)> {
        // The family with fewer unknowns is kept, as what is left of it has to be factored.
        if 3 * self.points.len() < 6 * self.poses.len() {
            let mut couplings: Vec<_> = self
                .couplings
                .iter()
                .map(|(point, view, block)| (*view, *point, block.transpose()))
                .collect();
            couplings.sort_by_key(|&(view, _, _)| view);
            let arrow = Arrow {
                kept: self.points,
                eliminated: self.poses,
                couplings,
                links: Vec::new(),
            };
            let solved: Solved<3, 6> = arrow.solve()?;
            let diagonals = covariances.then(|| solved.covariances());
            return Some((solved.kept, solved.eliminated, diagonals));
        }
        let mut couplings = self.couplings;
        couplings.sort_by_key(|&(point, _, _)| point);
        let arrow = Arrow {
            kept: self.poses,
            eliminated: self.points,
            couplings,
            links: Vec::new(),
        };
        let solved: Solved<6, 3> = arrow.solve()?;
        let diagonals = covariances.then(|| {
            let (poses, points) = solved.covariances();
            (points, poses)
        });
        Some((solved.eliminated, solved.kept, diagonals))
    }
}
