//! A known number of objects from views in which no object is detected twice.
//!
//! The places are found by expectation maximisation whose memberships are the marginals of
//! exclusive association ([`Exclusive`](super::Exclusive)), from several starts. Each start ends in
//! a whole assignment of detections to objects; the one of the greatest evidence is kept.

mod state;
mod views;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use self::state::State;
use self::views::Views;
use super::mixture::LISTED;
use super::{Fusion, Member, Object, Observation, SolverEvidence, Stopped};
use crate::frame::Point;

/// What is known of the objects and the views, and how long is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownCount {
    /// How many objects there are.
    pub n_objects: usize,
    /// Probability that a view detects an object, 0 to 1.
    pub p_detect: f64,
    /// Detections of nothing, by view and square metre.
    pub clutter_per_m2: f64,
    /// A largest change of a membership of no more than this ends the iterations.
    pub tolerance: f64,
    /// The most iterations from each start.
    pub max_iterations: usize,
}

impl KnownCount {
    /// Of so many objects that views hardly miss, and views that hardly invent any: probability
    /// of detection 0.999, clutter 1e-6 a square metre; tolerance 1e-6, 60 iterations.
    pub fn new(n_objects: usize) -> Self {
        Self {
            n_objects,
            p_detect: 0.999,
            clutter_per_m2: 1e-6,
            tolerance: 1e-6,
            max_iterations: 60,
        }
    }
}

/// The covariance is widened by these factors in the first iterations of a start, so that early
/// places, which rest on few views, do not decide.
const ANNEALING: [f64; 4] = [4.0, 2.5, 1.6, 1.25];

/// Starts begin with no more views than this, evenly chosen among them.
const MOST_FIRST_VIEWS: usize = 8;

/// Memberships that change by no more than this are settled enough to take whole assignments from.
const ROUGH: f64 = 0.01;

/// Fuses observations, all taken to be of the first one's class, into at most `n_objects`
/// objects: fewer where there are too few detections for them.
///
/// An observation is its object's place (east, north) with a Gaussian error of its own covariance.
/// In a view each observation is at most one object and each object at most one observation; what
/// is neither is clutter, or a miss. The places have no prior. Starts take the views in turn,
/// beginning with each of them (of more than eight, with eight of them) in either direction, match
/// each to the places so far (see [`assign`](crate::matching::assign)), and iterate with and without
/// annealing the covariances:
///
/// 1. for each view, the places that the *other* views make of the objects, whose covariance
///    together with a detection's own gives the odds of every pair; memberships are the marginals
///    of these odds;
/// 2. once the memberships settle, the best whole assignment of each view given the others, until
///    none changes. Its evidence (the likelihood, the places integrated out) ranks the starts.
///
/// Step 1 from the best assignment then gives the objects. Their covariance is that of the weighted
/// mean, with what the memberships leave open. The time of an iteration grows with the square of the
/// number of views times the pairs of a view; memory with the pairs.
pub fn fuse_known_count(observations: &[Observation], settings: &KnownCount) -> Fusion {
    let Some(first) = observations.first() else {
        return Fusion {
            belief: None,
            objects: Vec::new(),
            solver: Vec::new(),
        };
    };
    let views = Views::new(observations, settings);
    let rough = KnownCount {
        tolerance: settings.tolerance.max(ROUGH),
        ..*settings
    };
    let mut evidence = Vec::new();
    let mut best: Option<(f64, State)> = None;
    for order in orders(views.count()) {
        for annealing in [&ANNEALING[..], &[]] {
            let mut state = State::empty(&views, settings.n_objects);
            state.assign_in(&views, &order);
            state.soften(&views, annealing, &rough);
            state.harden(&views, settings.max_iterations);
            let found = state.evidence(&views);
            // Starts often end in the same assignment; the first counts.
            if best.as_ref().is_none_or(|(most, _)| found > most + 1e-9) {
                best = Some((found, state));
            }
            evidence.push(best.as_ref().map_or(found, |(most, _)| *most));
        }
    }
    let Some((_, mut state)) = best else {
        return Fusion {
            belief: None,
            objects: Vec::new(),
            solver: Vec::new(),
        };
    };
    state.settle_marginals();
    let (iterations, change) = state.soften(&views, &[], settings);
    let converged = change <= settings.tolerance;
    let objects = objects(&views, &state, observations, first.class);
    let solver = SolverEvidence {
        class: first.class,
        n_observations: observations.len(),
        n_clusters: objects.len(),
        iterations,
        converged,
        stopped: if converged {
            Stopped::NothingMoved
        } else {
            Stopped::IterationLimit
        },
        log_likelihood: evidence,
        last_move_m: state.last_move_m,
    };
    Fusion {
        belief: None,
        objects,
        solver: vec![solver],
    }
}

/// The orders in which the starts take the views: from each of them on, or from as many as starts
/// are made with, forwards and backwards.
fn orders(n_views: usize) -> Vec<Vec<usize>> {
    let from = |first: usize| (0..n_views).map(move |step| (first + step) % n_views);
    let n_firsts = n_views.min(MOST_FIRST_VIEWS);
    let firsts = || (0..n_firsts).map(|at| at * n_views / n_firsts);
    let forwards = firsts().map(|first| from(first).collect());
    let backwards = firsts().map(|first| from(first + 1).rev().collect());
    // Of one or two views either direction is the other.
    if n_views > 2 {
        forwards.chain(backwards).collect()
    } else {
        forwards.collect()
    }
}

fn objects(views: &Views, state: &State, all: &[Observation], class: usize) -> Vec<Object> {
    let mut members: Vec<Vec<(usize, f64)>> = vec![Vec::new(); state.n_objects()];
    for edge in state.edges() {
        members[edge.object].push((edge.observation, edge.weight));
    }
    let mut objects: Vec<Object> = members
        .iter()
        .filter(|members| members.iter().map(|m| m.1).sum::<f64>() >= LISTED)
        .map(|members| object(views, members, all, class))
        .collect();
    objects.sort_by_key(|o| o.members.first().map(|m| m.observation));
    objects
}

/// The mean of the memberships' observations: weighted by their inverse covariances to the east and
/// north, by membership alone in height.
fn object(views: &Views, members: &[(usize, f64)], all: &[Observation], class: usize) -> Object {
    let weight: f64 = members.iter().map(|m| m.1).sum();
    let information: Matrix2<f64> = members.iter().map(|&(j, w)| views.information[j] * w).sum();
    let inverse = views::inverse(&information);
    let gain = |j: usize| {
        let mut gain = Matrix3::zeros();
        let horizontal = inverse * views.information[j];
        gain.fixed_view_mut::<2, 2>(0, 0).copy_from(&horizontal);
        gain[(2, 2)] = 1.0 / weight;
        gain
    };
    let mut place = Vector3::zeros();
    let mut covariance = Matrix3::zeros();
    for &(j, w) in members {
        let observation = &all[views.origin[j]];
        place += gain(j) * observation.place.xyz * w;
        covariance += gain(j) * observation.covariance * gain(j).transpose() * w;
    }
    let open = inverse * unsettled(views, members, place.xy()) * inverse;
    let mut horizontal = covariance.fixed_view_mut::<2, 2>(0, 0);
    horizontal += open;
    let mut listed: Vec<Member> = members
        .iter()
        .filter(|&&(_, w)| w >= LISTED)
        .map(|&(j, weight)| Member {
            observation: views.origin[j],
            weight,
        })
        .collect();
    listed.sort_by_key(|m| m.observation);
    Object {
        place: Point::from_xyz(place),
        covariance,
        class,
        weight,
        size_m: None,
        p_class: None,
        p_exist: None,
        members: listed,
    }
}

/// The covariance that is due to open memberships, in the units of information: by the law of total
/// variance, that of each view's pull on the mean, views taken as independent.
fn unsettled(views: &Views, members: &[(usize, f64)], mean: Vector2<f64>) -> Matrix2<f64> {
    let mut sum = Matrix2::zeros();
    for of_view in members.chunk_by(|a, b| views.view_of(a.0) == views.view_of(b.0)) {
        let mut pull = Vector2::zeros();
        for &(j, w) in of_view {
            let one = views.information[j] * (views.points[j] - mean);
            pull += one * w;
            sum += one * one.transpose() * w;
        }
        sum -= pull * pull.transpose();
    }
    sum
}

#[cfg(test)]
mod tests;
