//! How good a map could be: maps made with the labels that fusion never sees.
//!
//! [`clairvoyant`] is told which detection is of which object and which are clutter; it does the
//! joint least squares of places and poses, and no map of the same data can be expected to be
//! better. [`fair`] is told which detections belong together and nothing else: what is real it
//! decides by the evidence, as a method has to that puts everything together rightly. A method that
//! comes near the second bound has nothing left to gain from better association.
//!
//! Both start from a [`Problem`] and a [`Partition`] of its measurements.

mod clairvoyant;
mod fair;
mod partition;

pub use clairvoyant::clairvoyant;
pub use fair::{Fair, fair};
pub use partition::{Group, Partition};

use nalgebra::{Matrix3, Vector3, Vector6};
use serde::Serialize;

use crate::adjust::{CorrectedPose, Marginals, NoSolution, Problem, Reading, State, Surface};
use crate::existence::Model;
use crate::frame::{Enu, Point, Ray};

/// A bound's map.
#[derive(Debug, Clone)]
pub struct BoundMap {
    /// The objects, in the order of the partition's groups.
    pub objects: Vec<BoundObject>,
    /// The errors of all views' poses as estimated, in the order of
    /// [`crate::pose::PoseSigma::to_vector`]: what to add to the measured pose.
    pub poses: Vec<Vector6<f64>>,
    /// How the solver fared.
    pub evidence: BoundEvidence,
}

/// An object of a bound's map.
#[derive(Debug, Clone)]
pub struct BoundObject {
    /// The true object that the labels name; `None` for clutter.
    pub label: Option<String>,
    /// Where it is.
    pub place: Point<Enu>,
    /// Covariance of the place, m^2.
    pub covariance: Matrix3<f64>,
    /// Probability that it is real.
    pub p_exist: f64,
    /// The measurements it rests on, by index.
    pub observations: Vec<usize>,
}

/// How a bound was solved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoundEvidence {
    /// Gauss-Newton steps done.
    pub iterations: usize,
    /// Longest move of an object in the last step, metres.
    pub last_move_m: f64,
    /// Whether it was below ten nanometres, or for the fair bound a tenth of a millimetre.
    pub converged: bool,
    /// What was learnt of noise, clutter and detectability, where the bound learns.
    #[serde(skip)]
    pub model: Option<Model>,
}

/// Why there is no bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoBound {
    /// The labels name no object of any measurement.
    #[error("found no labelled detection that can be placed, expected at least one")]
    NothingLabelled,
    /// The normal equations have no solution.
    #[error(transparent)]
    Singular(#[from] NoSolution),
    /// What views could have seen is known of cameras alone.
    #[error(
        "found views without a camera, expected a camera for every view: the fair bound weighs what a picture does not show"
    )]
    NoCamera,
}

/// The objects of a solved problem; those on unknown ground are left out.
fn objects(
    problem: &Problem<'_>,
    groups: &[Group],
    state: &State,
    marginals: &Marginals,
    p_exist: &[f64],
) -> Vec<BoundObject> {
    let solved = state.points.iter().zip(&marginals.points);
    let objects = groups.iter().zip(solved).zip(p_exist);
    objects
        .filter_map(|((group, (point, covariance)), &p_exist)| {
            let (place, by_state) = problem.surface.place(*point)?;
            let covariance = by_state * covariance * by_state.transpose();
            Some(BoundObject {
                label: group.label.clone(),
                place,
                covariance: (covariance + covariance.transpose()) * 0.5,
                p_exist,
                observations: group.members.clone(),
            })
        })
        .collect()
}

/// Where every object starts: where its nearest measurement meets the ground, for near ones say
/// most. Groups whose measurements meet none are dropped.
fn starts(problem: &Problem<'_>, groups: &mut Vec<Group>) -> Vec<Vector3<f64>> {
    let still = Vector6::zeros();
    let views = problem.views.iter();
    let poses: Vec<CorrectedPose<'_>> = views.map(|v| CorrectedPose::new(v, &still)).collect();
    let start = |&member: &usize| {
        let measurement = &problem.measurements[member];
        let pose = &poses[measurement.view];
        let ray = pose.ray(&measurement.reading)?;
        let place = match measured_range_m(&measurement.reading) {
            Some(range_m) => ray.at(range_m),
            None => hit(problem.surface, ray, problem.limit_m())?,
        };
        let range_m = ray.origin.horizontal_distance(place);
        Some((range_m, Vector3::new(place.xyz.x, place.xyz.y, 0.0)))
    };
    let mut points = Vec::with_capacity(groups.len());
    groups.retain(|group| {
        let places = group.members.iter().filter_map(start);
        let nearest = places.min_by(|a, b| a.0.total_cmp(&b.0));
        points.extend(nearest.map(|(_, place)| place));
        nearest.is_some()
    });
    points
}

fn measured_range_m(reading: &Reading) -> Option<f64> {
    match reading {
        Reading::Pixel { range, .. } => range.map(|r| r.range_m),
        Reading::Bearing { range, .. } => Some(range.range_m),
    }
}

/// The ground a ray meets, however far; where it meets none, the ground at the limit of what is
/// trusted along its azimuth.
fn hit(surface: &dyn Surface, ray: Ray<Enu>, limit_m: f64) -> Option<Point<Enu>> {
    if let Some(hit) = surface.first_hit(ray, f64::INFINITY) {
        return Some(hit);
    }
    let level = ray.direction.xyz().xy().try_normalize(1e-12)?;
    let at = ray.origin.xyz.xy() + level * limit_m;
    Some(surface.ground_at(at.x, at.y)?.point)
}
