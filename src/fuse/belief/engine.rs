//! Everything fusion believes at one moment.

use std::f64::consts::PI;
use std::sync::Arc;

use super::algebra::{Square4, Square6};
use super::bias::Term;
use super::classes::{Class, Kinds};
use super::curve::Detectability;
use super::cut::Shape;
use super::data::{Look, Platform, PoseNow, looks, order, platforms};
use super::departure::Departure;
use super::drift::Drift;
use super::expect::{Expected, expect};
use super::ground::SmoothGround;
use super::noise::{Scales, ln_add, variances};
use super::single::Singleton;
use super::{BeliefSettings, PoseCorrection};
use crate::adjust::{Problem, Surface};

/// Clutter of a view before any data.
pub(super) const START_CLUTTER: f64 = 1.0;
/// Transients of a view before any data, as a share of the clutter.
pub(super) const START_TRANSIENTS: f64 = 0.1;
/// Densities are kept from running away, 1/m^2.
const DENSITIES: (f64, f64) = (1e-4, 1e3);

/// A normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Normal {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl Normal {
    pub(super) fn ln(&self, x: f64) -> f64 {
        -0.5 * (x - self.mean).powi(2) / self.variance - 0.5 * (2.0 * PI * self.variance).ln()
    }
}

/// Logits of the scores of objects and of clutter: normal, of one variance, so that a higher score
/// never speaks against an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scores {
    pub(super) object: f64,
    pub(super) clutter: f64,
    pub(super) variance: f64,
}

impl Scores {
    /// A score alone says no more than this, for or against.
    const MOST: f64 = 5.0;

    /// Log-odds of object against clutter at a logit.
    pub(super) fn odds(&self, logit: f64) -> f64 {
        let slope = ((self.object - self.clutter) / self.variance).max(0.0);
        let middle = 0.5 * (self.object + self.clutter);
        (slope * (logit - middle)).clamp(-Self::MOST, Self::MOST)
    }

    /// Logarithm of the density at an object's logit.
    pub(super) fn ln_object(&self, logit: f64) -> f64 {
        Normal {
            mean: self.object,
            variance: self.variance,
        }
        .ln(logit)
    }
}

/// What is learnt (3.5).
#[derive(Debug, Clone)]
pub(super) struct Model {
    /// Factors on the standard deviations of readings.
    pub(super) scales: Scales,
    /// Factors on those of pose errors.
    pub(super) pose_scale: [f64; 6],
    /// How pose errors drift, where they do.
    pub(super) drift: Option<Drift>,
    /// Variance of the height of objects above the terrain, m^2.
    pub(super) height_variance: f64,
    /// Logarithms of sizes of objects, metres.
    pub(super) size: Normal,
    /// How they depart from it.
    pub(super) size_departure: Departure,
    /// Logarithms of apparent sizes of clutter, pixels.
    pub(super) clutter_size: Normal,
    /// Clutter a view.
    pub(super) clutter: f64,
    /// Things that look like objects and are gone in the next view, 1/m^2 a view.
    pub(super) transients: f64,
    /// Objects, 1/m^2.
    pub(super) density: f64,
    pub(super) curve: Detectability,
    /// How much of that holds for an object whose aim point lies beyond the picture's border, while
    /// part of it lies within.
    pub(super) border: f64,
    /// Logits of scores, where detections have them.
    pub(super) scores: Option<Scores>,
}

/// That a detection is of an object, with a probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    pub(super) look: usize,
    pub(super) object: usize,
    pub(super) weight: f64,
}

/// Logarithms of the intensities of what a detection may be, other than a known object.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Background {
    /// Uniform clutter.
    pub(super) uniform: f64,
    /// Uniform clutter and transients.
    pub(super) clutter: f64,
    /// An object not yet known.
    pub(super) new: f64,
    /// Any of them, or an object not yet known.
    pub(super) all: f64,
}

/// The state of fusion.
#[derive(Clone)]
pub(super) struct Engine<'a> {
    pub(super) surface: &'a dyn Surface,
    /// The ground, where it is smooth.
    pub(super) smooth: Option<Arc<SmoothGround>>,
    /// Height of the ground where the surface does not say, metres.
    pub(super) fallback_up_m: f64,
    pub(super) settings: &'a BeliefSettings,
    pub(super) ranges_m: (f64, f64),
    /// How far any view reaches, metres.
    pub(super) reach_m: f64,
    pub(super) platforms: Vec<Platform>,
    pub(super) poses: Vec<PoseNow>,
    pub(super) delta: Vec<[f64; 6]>,
    /// What of them drifts, and whose views have been taken in.
    pub(super) drift: Vec<[f64; 6]>,
    pub(super) is_settled: Vec<bool>,
    /// Conditional covariances of the pose errors.
    pub(super) pose_cov: Vec<Square6>,
    pub(super) looks: Vec<Look>,
    /// What they read, biases and all; and the biases that may be. Empty until those are asked for.
    pub(super) readings: Vec<[f64; 4]>,
    pub(super) terms: Vec<Term>,
    /// The looks of view i are `start[i]..start[i + 1]`.
    pub(super) start: Vec<usize>,
    pub(super) singles: Vec<Singleton>,
    /// Measurements outside the trusted ranges.
    pub(super) untrusted: Vec<(usize, Singleton)>,
    pub(super) background: Vec<Background>,
    pub(super) has_sizes: bool,
    /// How long boxes are along and down.
    pub(super) shape: Shape,
    /// Where in boxes the aim points lie, as shares of their lengths.
    pub(super) aim: [f64; 2],
    /// How well a single detection near the end of the trusted ranges says its range, one standard
    /// deviation, and how far beyond the end it is still trusted, metres.
    pub(super) blur_m: (f64, f64),
    /// Which classes are taken for which, where they are.
    pub(super) kinds: Option<Arc<Kinds>>,
    pub(super) model: Model,
    /// Variances of the rows of every look.
    pub(super) looseness: Vec<[f64; 4]>,
    /// Standard deviations of the first two rows, typically.
    pub(super) typical: [f64; 2],
    /// Space of the readings of a view within its ranges.
    pub(super) volumes: Vec<f64>,
    /// Ground seen by any view, and by a view in the mean, m^2.
    pub(super) area_m2: f64,
    pub(super) view_area_m2: f64,
    // Objects.
    pub(super) objects: Vec<[f64; 4]>,
    pub(super) classes: Vec<Class>,
    /// Their covariances, the poses held.
    pub(super) object_cov: Vec<Square4>,
    pub(super) edges: Vec<Edge>,
    /// How often each edge counts for the class of its object; empty without a table of confusion.
    pub(super) class_times: Vec<f64>,
}

impl<'a> Engine<'a> {
    pub(super) fn new(problem: &Problem<'a>, settings: &'a BeliefSettings) -> Self {
        let order = order(problem.views);
        let platforms = platforms(problem, &order, settings.fov);
        let shape = Shape::of(problem.measurements, settings.size_rule);
        let looks = looks(problem, &order, settings, &shape);
        let n = platforms.len();
        let delta = vec![[0.0; 6]; n];
        let poses: Vec<PoseNow> = platforms.iter().map(|p| p.at(&[0.0; 6])).collect();
        let pose_cov: Vec<Square6> = platforms.iter().map(|p| p.prior(&[1.0; 6])).collect();
        let has_sizes = looks.iter().any(|l| l.log_px.is_some());
        let kinds = settings.confusion.as_ref().map(|confusion| {
            let said = looks.iter().map(|l| l.class);
            Arc::new(Kinds::new(confusion, said))
        });
        let model = Model {
            scales: [1.0; 4],
            pose_scale: [1.0; 6],
            drift: match settings.pose_correction {
                PoseCorrection::Drift => Some(settings.drift),
                _ => None,
            },
            height_variance: problem.height_sigma_m.max(2e-3).powi(2),
            size: Normal {
                mean: 0.0,
                variance: 0.4,
            },
            size_departure: Departure::NORMAL,
            clutter_size: Normal {
                mean: 0.0,
                variance: 1.0,
            },
            clutter: START_CLUTTER,
            transients: 0.0,
            density: 1.0,
            curve: Detectability::new(0.0, 1.0, 1),
            scores: None,
            border: super::cut::START_BORDER,
        };
        let mut engine = Self {
            surface: problem.surface,
            smooth: None,
            fallback_up_m: 0.0,
            settings,
            ranges_m: (problem.min_range_m, problem.max_range_m),
            reach_m: problem.max_range_m,
            start: Vec::new(),
            platforms,
            poses,
            delta,
            drift: vec![[0.0; 6]; n],
            is_settled: vec![false; n],
            pose_cov,
            looks,
            readings: Vec::new(),
            terms: Vec::new(),
            singles: Vec::new(),
            untrusted: Vec::new(),
            background: Vec::new(),
            has_sizes,
            shape,
            aim: super::cut::aim(problem.measurements),
            blur_m: (0.0, 0.0),
            kinds,
            model,
            looseness: Vec::new(),
            typical: [1.0; 2],
            volumes: Vec::new(),
            area_m2: 1.0,
            view_area_m2: 1.0,
            objects: Vec::new(),
            classes: Vec::new(),
            object_cov: Vec::new(),
            edges: Vec::new(),
            class_times: Vec::new(),
        };
        let places = engine.poses.iter().map(|p| (p.origin.x, p.origin.y));
        engine.smooth = SmoothGround::new(problem.surface, places).map(Arc::new);
        engine.index();
        engine.begin();
        engine
    }

    /// Where the looks of each view stand.
    pub(super) fn index(&mut self) {
        let n = self.platforms.len();
        let looks = &self.looks;
        self.start = (0..=n)
            .map(|view| looks.partition_point(|l| l.view < view))
            .collect();
    }

    pub(super) fn n_views(&self) -> usize {
        self.platforms.len()
    }

    pub(super) fn corrects_poses(&self) -> bool {
        self.settings.pose_correction != PoseCorrection::Off
    }

    pub(super) fn looks_of(&self, view: usize) -> std::ops::Range<usize> {
        self.start[view]..self.start[view + 1]
    }

    pub(super) fn set_delta(&mut self, view: usize, delta: [f64; 6]) {
        self.delta[view] = delta;
        self.poses[view] = self.platforms[view].at(&delta);
    }

    pub(super) fn expect(&self, view: usize, object: &[f64; 4]) -> Option<Expected> {
        expect(
            &self.platforms[view],
            &self.poses[view],
            object,
            self.settings.radius_m,
        )
    }

    pub(super) fn variances(&self, look: &Look) -> [f64; 4] {
        variances(look, &self.model.scales, self.settings.shape)
    }

    /// Covariance of a view's pose as measured.
    pub(super) fn pose_prior(&self, view: usize) -> Square6 {
        self.platforms[view].prior(&self.model.pose_scale)
    }

    /// Its inverse: a diagonal.
    pub(super) fn pose_information(&self, view: usize) -> [f64; 6] {
        let sigma = &self.platforms[view].sigma;
        // Given its drift, a pose has only its jitter left.
        let share = self.drift_law().map_or(1.0, |d| (1.0 - d.share).max(1e-3));
        std::array::from_fn(|i| (sigma[i] * self.model.pose_scale[i]).powi(-2) / share)
    }

    /// Where an object's detectability is read off the curve.
    pub(super) fn visibility(&self, object: &[f64; 4], seen: &Expected) -> f64 {
        if self.has_sizes {
            object[3] + seen.log_scale
        } else {
            seen.range_m.max(0.05).ln()
        }
    }

    /// What a view has for and against an object at a horizontal distance: its ranges are 5 cm and
    /// 2 % of the distance soft, and which detections lie within the greatest is told by each one's
    /// own range.
    pub(super) fn in_range(&self, range_m: f64) -> f64 {
        let soft_m = 0.05 + 0.02 * range_m;
        let (blur_m, slack_m) = self.blur_m;
        let (least_m, most_m) = (self.ranges_m.0, self.reach_m);
        let mut p = 1.0;
        if most_m.is_finite() {
            p *= normal_cdf((most_m + slack_m - range_m) / soft_m.hypot(blur_m));
        }
        p * normal_cdf((range_m - least_m) / soft_m)
    }

    /// The ground below a place: its height and its slopes by east and north.
    pub(super) fn ground(&self, east_m: f64, north_m: f64) -> (f64, f64, f64) {
        if let Some(ground) = self.smooth.as_ref().and_then(|s| s.at(east_m, north_m)) {
            return ground;
        }
        match self.surface.ground_at(east_m, north_m) {
            Some(ground) => {
                let n = ground.normal.xyz();
                (ground.point.xyz.z, -n.x / n.z, -n.y / n.z)
            }
            None => (self.fallback_up_m, 0.0, 0.0),
        }
    }

    /// What is believed of an object before any look: information, its pull, the logarithm of the
    /// density, and the height above the ground.
    pub(super) fn prior(&self, x: &[f64; 4]) -> Prior {
        let (up, by_east, by_north) = self.ground(x[0], x[1]);
        let n = [-by_east, -by_north, 1.0, 0.0];
        let height_m = x[2] - up;
        let (vz, vs) = (self.model.height_variance, self.model.size.variance);
        let mut information = [[0.0; 4]; 4];
        let mut pull = [0.0; 4];
        for i in 0..3 {
            for j in 0..3 {
                information[i][j] = n[i] * n[j] / vz;
            }
            pull[i] = -n[i] * height_m / vz;
        }
        let away = x[3] - self.model.size.mean;
        information[3][3] = 1.0 / vs;
        pull[3] = -away / vs;
        information[0][0] += FAINT;
        information[1][1] += FAINT;
        let size = &self.model.size;
        let ln_size = size.ln(x[3]) + self.model.size_departure.ln_ratio(size, x[3]);
        let ln_density = -0.5 * height_m * height_m / vz - 0.5 * (2.0 * PI * vz).ln() + ln_size;
        Prior {
            information,
            pull,
            ln_density,
            height_m,
        }
    }

    /// Intensities of everything a detection may be but a known object.
    pub(super) fn weigh_background(&mut self) {
        self.looseness = self.looks.iter().map(|l| self.variances(l)).collect();
        self.background = self
            .looks
            .iter()
            .zip(&self.singles)
            .map(|(look, single)| self.background_of(look, single))
            .collect();
    }

    fn background_of(&self, look: &Look, single: &Singleton) -> Background {
        let m = &self.model;
        let size = look.log_px.map_or(0.0, |l| m.clutter_size.ln(l));
        let score = self.score_odds(look);
        let uniform = (m.clutter / self.volumes[look.view]).ln() + size - score;
        let detected = m.curve.at(single.visibility).clamp(1e-3, 1.0).ln();
        let transient = m.transients.ln() + detected + single.ln_evidence;
        let clutter = ln_add(uniform, transient);
        let new = m.density.ln() + detected + single.ln_evidence;
        Background {
            uniform,
            clutter,
            new,
            all: ln_add(clutter, new),
        }
    }

    /// What the detector's score says for an object against clutter.
    pub(super) fn score_odds(&self, look: &Look) -> f64 {
        let scores = self.model.scores.as_ref().zip(look.logit);
        scores.map_or(0.0, |(scores, x)| scores.odds(x))
    }

    pub(super) fn set_density(&mut self, density: f64) {
        self.model.density = density.clamp(DENSITIES.0, DENSITIES.1);
    }

    /// How much weight each object's edges have.
    pub(super) fn support(&self) -> Vec<f64> {
        let mut support = vec![0.0; self.objects.len()];
        for edge in &self.edges {
            support[edge.object] += edge.weight;
        }
        support
    }

    pub(super) fn reset_pose_cov(&mut self) {
        for view in 0..self.n_views() {
            self.pose_cov[view] = self.pose_prior(view);
        }
    }
}

/// What is believed of an object before any look.
pub(super) struct Prior {
    pub(super) information: Square4,
    pub(super) pull: [f64; 4],
    pub(super) ln_density: f64,
    pub(super) height_m: f64,
}

/// Information that keeps an object without any from breaking a solution, 1/m^2: a kilometre.
const FAINT: f64 = 1e-6;

/// The distribution function of the standard normal.
pub(super) fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}
