//! From the observations of many views to one map of objects, without being told which observation
//! is which object.
//!
//! This module knows no files, images or geodesy: views are indices, places are points of the
//! site's ENU, and what a view could have seen is asked of a [`Coverage`]. It can be used by
//! itself:
//!
//! ```
//! use nalgebra::Matrix3;
//! use rockmap::frame::Point;
//! use rockmap::fuse::{Everywhere, MixtureSettings, Observation, Weights, fuse_mixture};
//!
//! // One rock seen by two views, and a second one that only view 1 saw.
//! let observation = |view, east_m| Observation {
//!     view,
//!     class: 0,
//!     place: Point::new(east_m, 0.0, 0.0),
//!     covariance: Matrix3::identity() * 0.01,
//! };
//! let observations = [observation(0, 0.0), observation(1, 0.1), observation(1, 3.0)];
//! let settings = MixtureSettings { min_weight: 0.5, ..MixtureSettings::new(Weights::Logistic) };
//! let map = fuse_mixture(&observations, &Everywhere, &settings);
//! assert_eq!(map.objects.len(), 2);
//! assert!((map.objects[0].place.xyz.x - 0.05).abs() < 0.01);
//! ```
//!
//! [`belief`] does without places: it takes what views measured, and finds the errors of their poses
//! with the map.

mod assignment;
pub mod belief;
mod exclusive;
mod gate;
mod known_count;
mod merge;
mod mixture;

pub use assignment::Weights;
pub use exclusive::{Exclusive, Settled};
pub use known_count::{KnownCount, fuse_known_count};
pub use mixture::{MixtureSettings, Start, fuse_mixture};

use nalgebra::Matrix3;
use serde::Serialize;

use crate::footprint::Footprints;
use crate::frame::{Enu, Point};

/// One detection on the ground, as fusion sees it.
#[derive(Debug, Clone, Copy)]
pub struct Observation {
    /// The view that made it.
    pub view: usize,
    /// What it is; only observations of one class are the same object.
    pub class: usize,
    /// Where it lies.
    pub place: Point<Enu>,
    /// Covariance of the place, m^2, with the pose's share.
    pub covariance: Matrix3<f64>,
}

/// What the views could have seen.
pub trait Coverage: Sync {
    /// Whether this view's footprint covers the place.
    fn covers(&self, view: usize, place: Point<Enu>) -> bool;
}

/// The coverage of views that see everything.
#[derive(Debug, Clone, Copy)]
pub struct Everywhere;

impl Coverage for Footprints {
    fn covers(&self, view: usize, place: Point<Enu>) -> bool {
        self.of(view).covers(place.xyz.x, place.xyz.y)
    }
}

impl Coverage for Everywhere {
    fn covers(&self, _view: usize, _place: Point<Enu>) -> bool {
        true
    }
}

/// An object of the map and the observations it rests on.
#[derive(Debug, Clone)]
pub struct Object {
    /// Where it is.
    pub place: Point<Enu>,
    /// Covariance of the place, m^2.
    pub covariance: Matrix3<f64>,
    /// Its class.
    pub class: usize,
    /// Probability that it is of that class, where the detector takes classes for each other.
    pub p_class: Option<f64>,
    /// How many observations it accounts for: the sum of its memberships.
    pub weight: f64,
    /// Its size, metres, from methods that say.
    pub size_m: Option<f64>,
    /// Probability that it is real, from methods that say.
    pub p_exist: Option<f64>,
    /// The observations that belong to it with probability 0.01 or more, in their order.
    pub members: Vec<Member>,
}

/// A membership.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Index of the observation.
    pub observation: usize,
    /// Probability that the object is what was observed.
    pub weight: f64,
}

/// The fused map, and how the solver came to it.
#[derive(Debug, Clone)]
pub struct Fusion {
    /// The objects, in the order of their first members.
    pub objects: Vec<Object>,
    /// Evidence of the solver, one entry a class.
    pub solver: Vec<SolverEvidence>,
    /// What belief fusion learnt.
    pub belief: Option<Box<belief::BeliefEvidence>>,
}

/// How a solver fared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SolverEvidence {
    /// The class solved for.
    pub class: usize,
    /// Observations of that class.
    pub n_observations: usize,
    /// Clusters when it stopped, before those of too little weight are left out.
    pub n_clusters: usize,
    /// Iterations done.
    pub iterations: usize,
    /// Whether nothing moved any more.
    pub converged: bool,
    /// Why it stopped.
    pub stopped: Stopped,
    /// Logarithm of the mixture's likelihood (up to a constant) before each update of the means; of
    /// [`fuse_known_count`], of the best evidence so far after each start.
    pub log_likelihood: Vec<f64>,
    /// The largest move of the last iteration, metres.
    pub last_move_m: f64,
}

/// Why a solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stopped {
    /// There was nothing to fuse.
    NoObservations,
    /// No cluster moved or merged.
    NothingMoved,
    /// The iterations ran out.
    IterationLimit,
}
