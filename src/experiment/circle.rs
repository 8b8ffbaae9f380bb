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
use crate::fuse::{Everywhere, MixtureSettings, Observation, Start, Weights, fuse_mixture};

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
            let mut view: Vec<Vector2<f64>> = objects
                .iter()
                .map(|object| {
                    object + Vector2::new(normal(&mut random), normal(&mut random)) * self.noise
                })
                .collect();
            view.shuffle(&mut random);
            view
        });
        Trial {
            views: views.collect(),
            objects,
        }
    }

    /// The errors of methods over trials, by method and trial.
    pub fn errors(&self, methods: &[CircleMethod], n_trials: usize, seed: u64) -> Vec<Vec<f64>> {
        let trials: Vec<Vec<f64>> = (0..n_trials as u64)
            .into_par_iter()
            .map(|index| {
                let trial = self.trial(seed, index);
                let error = |method: &CircleMethod| trial.error(&method.find(&trial, self.noise));
                methods.iter().map(error).collect()
            })
            .collect();
        (0..methods.len())
            .map(|m| trials.iter().map(|errors| errors[m]).collect())
            .collect()
    }
}

impl Trial {
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
    pub const ALL: [Self; 3] = [Self::SingleView, Self::Em, Self::Paper];

    /// Those that fuse views.
    pub fn fusing() -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter();
        all.filter(|method| *method != Self::SingleView)
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::SingleView => "single",
            Self::Em => "em",
            Self::Paper => "paper",
        }
    }

    /// The name in figures.
    pub fn title(self) -> &'static str {
        match self {
            Self::SingleView => "single view",
            Self::Em => "standard EM",
            Self::Paper => "multiple-view EM",
        }
    }

    /// The places it finds.
    pub fn find(self, trial: &Trial, noise: f64) -> Vec<Vector2<f64>> {
        match self {
            Self::SingleView => trial.views[0].clone(),
            Self::Em => mixture(trial, noise, Weights::Equal),
            Self::Paper => mixture(trial, noise, Weights::Logistic),
        }
    }
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
    let observation = |view: usize, place: &Vector2<f64>| Observation {
        view,
        class: 0,
        place: Point::new(place.x, place.y, 0.0),
        covariance: Matrix3::identity() * noise.powi(2),
    };
    let observations: Vec<Observation> = trial
        .views
        .iter()
        .enumerate()
        .flat_map(|(view, places)| places.iter().map(move |place| observation(view, place)))
        .collect();
    let fusion = fuse_mixture(&observations, &Everywhere, &settings);
    fusion.objects.iter().map(|o| o.place.xyz.xy()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: u64 = 11;

    fn circle(noise: f64, n_views: usize) -> Circle {
        Circle {
            n_objects: 12,
            n_views,
            noise,
        }
    }

    #[test]
    fn the_papers_score_by_hand() {
        let at = |x: f64| Vector2::new(x, 0.0);
        let trial = Trial {
            objects: vec![at(0.0), at(1.0), at(5.0)],
            views: Vec::new(),
        };
        // The first object takes 0.6, although the second lies nearer to it and is left with -1.
        assert!((trial.error(&[at(-1.0), at(0.6), at(5.5)]) - (0.36 + 4.0 + 0.25)).abs() < 1e-12);
        // Two estimates for three objects: the last in the list goes without.
        assert!((trial.error(&[at(0.0), at(1.5)]) - (0.25 + 1.0)).abs() < 1e-12);
        assert!((trial.error(&[]) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn trials_repeat_and_nest() {
        let trial = circle(0.1, 4).trial(SEED, 3);
        assert_eq!(trial, circle(0.1, 4).trial(SEED, 3));
        assert_ne!(trial.views, circle(0.1, 4).trial(SEED, 4).views);
        assert_eq!(circle(0.1, 2).trial(SEED, 3).views, trial.views[..2]);
        assert!((trial.objects[3] - Vector2::new(0.0, 1.0)).norm() < 1e-12);
    }

    #[test]
    fn without_noise_every_method_is_right() {
        let errors = circle(1e-6, 4).errors(&CircleMethod::ALL, 5, SEED);
        assert!(errors.iter().flatten().all(|e| *e < 1e-10), "{errors:?}");
    }

    #[test]
    fn small_noise_reaches_the_bound() {
        // At noise 0.05 neighbours are ten standard deviations apart: both methods average right.
        let circle = circle(0.05, 4);
        for errors in circle.errors(&[CircleMethod::Em, CircleMethod::Paper], 200, SEED) {
            let mean = errors.iter().sum::<f64>() / 200.0;
            // 24 squared normal errors a trial: relative standard error sqrt(2 / 24 / 200).
            assert!((mean / circle.bound() - 1.0).abs() < 3.0 * 0.0204, "{mean}");
        }
    }

    /// Means over 50 trials of an independent program (numpy, dense equations) with its own random
    /// numbers, within two standard errors of the difference.
    #[test]
    fn means_agree_with_an_independent_program() {
        use super::super::statistics::{Mean, SignTest};
        for (noise, em, paper) in [(0.10, 0.066, 0.064), (0.15, 0.67, 0.40), (0.20, 1.54, 1.12)] {
            let methods = [CircleMethod::Em, CircleMethod::Paper];
            let errors = circle(noise, 4).errors(&methods, 50, SEED);
            for (errors, expected) in errors.iter().zip([em, paper]) {
                let mean = Mean::of(errors).unwrap();
                let two = 2.0 * std::f64::consts::SQRT_2 * mean.standard_error.unwrap();
                assert!((mean.mean - expected).abs() < two, "{noise}: {mean:?}");
            }
            if noise == 0.15 {
                let test = SignTest::of(&errors[1], &errors[0], 1e-12);
                assert!(test.wins >= 38, "{test:?}");
            }
        }
    }
}
