//! The paper's simulation: objects at regular intervals on the unit circle, seen by several views
//! whose detections carry Gaussian noise (Thompson and Wettergreen 2005, section III.A).

use nalgebra::{Matrix3, Vector2};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

use super::statistics::count;
use crate::frame::Point;
use crate::fuse::{
    Everywhere, Fusion, KnownCount, MixtureSettings, Observation, Start, Weights, fuse_known_count,
    fuse_mixture,
};
use crate::matching::{Pair, assign};

/// The error that an object without an estimate adds: the squared radius of the circle.
const MISSING: f64 = 1.0;

/// The circle and how often it is seen. Lengths are those of the circle, whose radius is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Objects on the circle.
    pub n_objects: usize,
    /// Views of it.
    pub n_views: usize,
    /// Standard deviation of a detection along each axis.
    pub noise: f64,
}

/// A circle as the views saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Where the objects are.
    pub objects: Vec<Vector2<f64>>,
    /// Where each view detected them, in an order that says nothing.
    pub views: Vec<Vec<Vector2<f64>>>,
    /// Which object each detection of a view is, which the methods are not told.
    pub labels: Vec<Vec<usize>>,
}

/// How far a method's estimates are from the objects, two ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The paper's error, [`Trial::error`].
    pub error: f64,
    /// The error of the best pairing, [`Trial::paired_error`].
    pub paired: f64,
}

/// A way to find the objects, told how many there are and how large the noise is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CircleMethod {
    /// The first view's detections as they are.
    SingleView,
    /// Standard EM from the first view's detections, without any view constraint.
    Em,
    /// Multiple-view EM from the first view's detections.
    Paper,
    /// Exclusive association by belief propagation, from all views' detections.
    Belief,
    /// The mean of each object's detections, told which they are: what no method beats.
    Oracle,
}

impl Circle {
    /// The least mean error of any estimate that is not told the circle, all associations known:
    /// `n 2 noise^2 / n_views`.
    pub fn bound(&self) -> f64 {
        count(self.n_objects) * 2.0 * self.noise.powi(2) / count(self.n_views)
    }

    /// Draws a trial. Trials of one seed and index share their random numbers: another noise
    /// scales the same errors, and more views add to the same first ones.
    pub fn trial(&self, seed: u64, index: u64) -> Trial {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(index);
        let objects: Vec<Vector2<f64>> = (0..self.n_objects)
            .map(|k| {
                let angle = std::f64::consts::TAU * count(k) / count(self.n_objects);
                Vector2::new(angle.cos(), angle.sin())
            })
            .collect();
        let normal = |random: &mut ChaCha8Rng| random.sample::<f64, _>(StandardNormal);
        let views = (0..self.n_views).map(|_| {
            let mut view: Vec<(Vector2<f64>, usize)> = objects
                .iter()
                .zip(0..)
                .map(|(object, label)| {
                    let error = Vector2::new(normal(&mut random), normal(&mut random));
                    (object + error * self.noise, label)
                })
                .collect();
            view.shuffle(&mut random);
            view.into_iter().unzip()
        });
        let (views, labels) = views.unzip();
        Trial {
            objects,
            views,
            labels,
        }
    }

    /// The scores of methods over trials, by method and trial.
    pub fn scores(&self, methods: &[CircleMethod], n_trials: usize, seed: u64) -> Vec<Vec<Score>> {
        let trials: Vec<Vec<Score>> = (0..n_trials as u64)
            .into_par_iter()
            .map(|index| {
                let trial = self.trial(seed, index);
                let score = |method: &CircleMethod| trial.score(&method.find(&trial, self.noise));
                methods.iter().map(score).collect()
            })
            .collect();
        (0..methods.len())
            .map(|m| trials.iter().map(|scores| scores[m]).collect())
            .collect()
    }
}

impl Trial {
    /// Both errors.
    pub fn score(&self, estimates: &[Vector2<f64>]) -> Score {
        Score {
            error: self.error(estimates),
            paired: self.paired_error(estimates),
        }
    }

    /// The least sum of squared distances over all ways to pair objects with estimates; an object
    /// farther than one from its estimate, or without any, counts one. The paper's error can be
    /// much larger: where an object takes its neighbour's estimate, that neighbour the next one's,
    /// and so on, the last is left with an estimate across the circle.
    pub fn paired_error(&self, estimates: &[Vector2<f64>]) -> f64 {
        let pair = |(left, object): (usize, &Vector2<f64>)| {
            let pairs = estimates.iter().enumerate();
            let cost = |estimate: &Vector2<f64>| (estimate - object).norm_squared();
            let pairs = pairs.map(|(right, estimate)| Pair {
                left,
                right,
                cost: cost(estimate),
            });
            pairs.collect::<Vec<_>>()
        };
        let pairs: Vec<Pair> = self.objects.iter().enumerate().flat_map(pair).collect();
        // Half for either end of a pair that is not made.
        let matched = assign(self.objects.len(), estimates.len(), &pairs, 0.5 * MISSING);
        let without = count(self.objects.len() - matched.len()) * MISSING;
        matched.iter().map(|pair| pair.cost).sum::<f64>() + without
    }

    /// The mean of each object's detections over the views.
    pub fn averages(&self) -> Vec<Vector2<f64>> {
        let mut sums = vec![Vector2::zeros(); self.objects.len()];
        for (places, labels) in self.views.iter().zip(&self.labels) {
            for (place, &label) in places.iter().zip(labels) {
                sums[label] += place;
            }
        }
        let n_views = count(self.views.len());
        sums.into_iter().map(|sum| sum / n_views).collect()
    }

    /// The paper's error: each object in turn takes the closest remaining estimate, and squared
    /// distances are summed. An object that finds none left counts one.
    pub fn error(&self, estimates: &[Vector2<f64>]) -> f64 {
        let mut left = estimates.to_vec();
        let mut error = 0.0;
        for object in &self.objects {
            let squared = left
                .iter()
                .map(|estimate| (estimate - object).norm_squared());
            let closest = squared.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            error += closest.map_or(MISSING, |(at, squared)| {
                left.swap_remove(at);
                squared
            });
        }
        error
    }
}

impl CircleMethod {
    /// All methods, in the order of figures and tables. A method that joins this list joins every
    /// figure.
    pub const ALL: [Self; 5] = [
        Self::SingleView,
        Self::Em,
        Self::Paper,
        Self::Belief,
        Self::Oracle,
    ];

    /// Those that fuse views without being told which detections belong together.
    pub fn fusing() -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter();
        all.filter(|method| !matches!(method, Self::SingleView | Self::Oracle))
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::SingleView => "single",
            Self::Em => "em",
            Self::Paper => "paper",
            Self::Belief => "belief",
            Self::Oracle => "oracle",
        }
    }

    /// The name in figures.
    pub fn title(self) -> &'static str {
        match self {
            Self::SingleView => "single view",
            Self::Em => "standard EM",
            Self::Paper => "multiple-view EM",
            Self::Belief => "belief propagation",
            Self::Oracle => "associations known",
        }
    }

    /// The places it finds.
    pub fn find(self, trial: &Trial, noise: f64) -> Vec<Vector2<f64>> {
        match self {
            Self::SingleView => trial.views[0].clone(),
            Self::Em => mixture(trial, noise, Weights::Equal),
            Self::Paper => mixture(trial, noise, Weights::Logistic),
            Self::Belief => {
                let settings = KnownCount::new(trial.objects.len());
                places(&fuse_known_count(&observations(trial, noise), &settings))
            }
            Self::Oracle => trial.averages(),
        }
    }
}

/// The detections, as fusion takes them.
fn observations(trial: &Trial, noise: f64) -> Vec<Observation> {
    let observation = |view: usize, place: &Vector2<f64>| Observation {
        view,
        class: 0,
        place: Point::new(place.x, place.y, 0.0),
        covariance: Matrix3::identity() * noise.powi(2),
    };
    let views = trial.views.iter().enumerate();
    views
        .flat_map(|(view, places)| places.iter().map(move |place| observation(view, place)))
        .collect()
}

fn places(fusion: &Fusion) -> Vec<Vector2<f64>> {
    fusion.objects.iter().map(|o| o.place.xyz.xy()).collect()
}

/// EM of a known number of clusters that start on the first view's detections, all pairs
/// considered.
fn mixture(trial: &Trial, noise: f64, weights: Weights) -> Vec<Vector2<f64>> {
    let settings = MixtureSettings {
        start: Start::Given(trial.views[0].clone()),
        width_m: noise,
        gate_widths: f64::INFINITY,
        tolerance_m: 1e-6,
        max_iterations: 500,
        ..MixtureSettings::new(weights)
    };
    let observations = observations(trial, noise);
    places(&fuse_mixture(&observations, &Everywhere, &settings))
}

#[cfg(test)]
mod tests;
