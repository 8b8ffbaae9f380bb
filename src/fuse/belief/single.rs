//! What one detection says by itself, and what is set from that before anything is fused.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::algebra::{self, Factor4, Square4, add_information, inverse4};
use super::curve::Detectability;
use super::data::Look;
use super::engine::{Engine, Normal, START_CLUTTER, START_TRANSIENTS, Scores};
use super::noise::with_noise;
use crate::frame::{Direction, Enu, Pixel, Point, Ray};

/// At most this many steps to the place a detection suggests.
const STEPS: usize = 8;
/// Detections are trusted up to their own uncertainty beyond the greatest range, and no more than
/// this share of it.
const SLACK: f64 = 0.05;
/// Where the trusted ranges end: from this share of the greatest on.
const NEAR_END: f64 = 0.8;
/// Steps are over below this, metres.
const STILL_M: f64 = 1e-7;
/// Rays that meet no ground within this many times the trusted range meet none.
const FAR: (f64, f64) = (1.5, 20.0);
/// A first guess of the logarithm of sizes counts for no less variance.
const LEAST_SIZE_VARIANCE: f64 = 0.02;
/// Logits of scores scatter no less than this.
pub(super) const LEAST_SCORE_VARIANCE: f64 = 0.05;

/// The object that one detection suggests: the most probable one under all its rows and the priors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Singleton {
    pub(super) object: [f64; 4],
    pub(super) cov: Square4,
    /// Logarithm of the density of the detection, the object integrated out, without the density of
    /// objects and their detectability.
    pub(super) ln_evidence: f64,
    /// Horizontal distance, metres.
    pub(super) range_m: f64,
    /// Where its detectability is read off the curve.
    pub(super) visibility: f64,
}

impl Engine<'_> {
    /// Everything that is set from single detections: where they lie, how large objects are, how
    /// much ground is seen. Detections outside the trusted ranges leave the looks.
    pub(super) fn begin(&mut self) {
        let hits: Vec<Option<Vector3<f64>>> =
            self.looks.par_iter().map(|l| self.ground_hit(l)).collect();
        self.fallback_up_m = median(hits.iter().flatten().map(|p| p.z).collect())
            .or_else(|| median(self.poses.iter().map(|p| p.origin.z).collect()))
            .unwrap_or(0.0);
        let guesses: Vec<Vector3<f64>> = self
            .looks
            .iter()
            .zip(&hits)
            .map(|(look, hit)| hit.unwrap_or_else(|| self.at_the_limit(look)))
            .collect();
        self.guess_sizes(&hits);
        let mean = self.model.size.mean;
        let starts = guesses.iter().map(|p| [p.x, p.y, p.z, mean]);
        self.singles = starts.map(Singleton::at).collect();
        self.settle();
        if !self.ranges_m.1.is_finite() {
            let farthest_m = self.singles.iter().map(|s| s.range_m);
            self.reach_m = 1.1 * farthest_m.fold(1.0, f64::max);
        }
        self.keep_trusted();
        self.set_blur();
        self.set_curve();
        self.begin_scores();
        self.measure_ground();
        let n = self.n_views().max(1);
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let per_view = self.looks.len() as f64 / n as f64;
        self.set_density(0.5 * per_view / self.view_area_m2);
        self.model.transients = START_TRANSIENTS * START_CLUTTER / self.view_area_m2;
        self.weigh_background();
    }

    /// Where a detection by itself meets the ground.
    fn ground_hit(&self, look: &Look) -> Option<Vector3<f64>> {
        let pose = &self.poses[look.view];
        if look.has[3] {
            let along = self.direction(look)?;
            let level = along.xy().norm().max(1e-6);
            let mut place = pose.origin + along * look.values[3];
            if look.is_bearing() {
                place.z = self.ground(place.x, place.y).0;
            } else if level < 1e-3 {
                return Some(place);
            }
            return Some(self.behind(look, place));
        }
        let direction = Direction::new(self.direction(look)?)?;
        let ray = Ray::<Enu> {
            origin: Point::from_xyz(pose.origin),
            direction,
        };
        let most_m = self.ranges_m.1;
        let far_m = if most_m.is_finite() {
            FAR.0 * most_m + FAR.1
        } else {
            f64::INFINITY
        };
        let hit = self.surface.first_hit(ray, far_m)?;
        Some(self.behind(look, hit.xyz))
    }

    fn direction(&self, look: &Look) -> Option<Vector3<f64>> {
        let (platform, pose) = (&self.platforms[look.view], &self.poses[look.view]);
        if look.is_bearing() {
            return Some(platform.along(pose, look.values[0]));
        }
        let pixel = Pixel::new(look.mark[0], look.mark[1]);
        let ray = platform.camera.as_deref()?.ray(pixel).ok()?;
        Some(pose.from_camera * ray.direction.xyz())
    }

    /// From an object's near face to its middle.
    fn behind(&self, look: &Look, face: Vector3<f64>) -> Vector3<f64> {
        let radius_m = self.settings.radius_m;
        if radius_m <= 0.0 {
            return face;
        }
        let level = (face - self.poses[look.view].origin).xy();
        let at = face.xy() + level.try_normalize(1e-9).unwrap_or(level) * radius_m;
        Vector3::new(at.x, at.y, self.ground(at.x, at.y).0)
    }

    /// The ground at the end of what is trusted, for rays that meet none.
    fn at_the_limit(&self, look: &Look) -> Vector3<f64> {
        let pose = &self.poses[look.view];
        let limit_m = if self.ranges_m.1.is_finite() {
            self.ranges_m.1
        } else {
            crate::footprint::Reach::UNBOUNDED_M
        };
        let along = self.direction(look).unwrap_or_else(Vector3::x);
        let level = along.xy().try_normalize(1e-12).unwrap_or_default();
        let at = pose.origin.xy() + level * limit_m;
        Vector3::new(at.x, at.y, self.ground(at.x, at.y).0)
    }

    /// How large objects are, before anything is fused.
    fn guess_sizes(&mut self, hits: &[Option<Vector3<f64>>]) {
        let all: Vec<f64> = self.looks.iter().filter_map(|l| l.log_px).collect();
        self.model.clutter_size = clutter_size(&all);
        if let Some((mean_m, sigma_m)) = self.settings.size_m {
            self.model.size = Normal {
                mean: mean_m.ln(),
                variance: (sigma_m / mean_m).powi(2),
            };
            return;
        }
        let sizes: Vec<f64> = self
            .looks
            .iter()
            .zip(hits)
            .filter_map(|(look, hit)| {
                let at = (*hit)?;
                let log_px = look.log_px.filter(|_| look.left.is_none())?;
                let seen = self.expect(look.view, &[at.x, at.y, at.z, 0.0])?;
                (seen.range_m < self.ranges_m.1).then_some(log_px - seen.log_scale)
            })
            .collect();
        if sizes.len() > 5
            && let Some(mean) = median(sizes.clone())
            && let Some(spread) = median(sizes.iter().map(|s| (s - mean).abs()).collect())
        {
            let variance = (1.4826 * spread).powi(2).max(LEAST_SIZE_VARIANCE);
            self.model.size = Normal { mean, variance };
        }
    }

    /// Moves every singleton to the most probable place, from where it was.
    pub(super) fn settle(&mut self) {
        let singles: Vec<Singleton> = self
            .looks
            .par_iter()
            .zip(&self.singles)
            .map(|(look, single)| self.single(look, &single.object))
            .collect();
        self.singles = singles;
    }

    /// The object that a detection suggests, found from a first guess by damped Gauss-Newton steps.
    pub(super) fn single(&self, look: &Look, guess: &[f64; 4]) -> Singleton {
        let mut x = *guess;
        let variances = self.variances(look);
        let mut best = Singleton::at(x);
        for _ in 0..STEPS {
            let Some(seen) = self.expect(look.view, &x) else {
                return best;
            };
            let e = seen.residual(look);
            let (by_object, by_pose) = seen.of(look);
            let spread = algebra::spread(&by_pose, &self.pose_cov[look.view], look.n);
            let noise = with_noise(&spread, &variances, 1.0);
            let Some(factor) = Factor4::new(&noise, look.n) else {
                return best;
            };
            let prior = self.prior(&x);
            let mut a = prior.information;
            add_information(&mut a, &by_object, &factor.inverse(), look.n, 1.0);
            let weighted = factor.solve(&e);
            let b: [f64; 4] = std::array::from_fn(|i| {
                prior.pull[i] + (0..4).map(|r| by_object[r][i] * weighted[r]).sum::<f64>()
            });
            let Some((cov, ln_det)) = inverse4(&a) else {
                return best;
            };
            let ln_2pi = (2.0 * PI).ln();
            best = Singleton {
                object: x,
                cov,
                ln_evidence: -0.5 * factor.mahalanobis2(&e)
                    - 0.5 * factor.ln_det
                    - 0.5 * look.n_rows() * ln_2pi
                    + prior.ln_density
                    + 2.0 * ln_2pi
                    - 0.5 * ln_det,
                range_m: seen.range_m,
                visibility: self.visibility(&x, &seen),
            };
            let step: [f64; 4] = std::array::from_fn(|i| dot(&cov[i], &b));
            let length = (step[0] * step[0] + step[1] * step[1] + step[2] * step[2]).sqrt();
            if length < STILL_M && step[3].abs() < STILL_M {
                break;
            }
            let limit = (0.25 * seen.range_m).max(0.3);
            let share = (limit / length.max(1e-9)).min(1.0);
            for (x, s) in x.iter_mut().zip(step) {
                *x += s * share;
            }
        }
        best
    }

    /// Leaves out detections whose object lies outside the trusted ranges.
    fn keep_trusted(&mut self) {
        let (least_m, most_m) = self.ranges_m;
        let keep: Vec<bool> = self
            .looks
            .iter()
            .zip(&self.singles)
            .map(|(look, single)| {
                let along_m = self.along_m(look, single);
                let slack = if most_m.is_finite() {
                    along_m.min(SLACK * most_m)
                } else {
                    0.0
                };
                single.range_m.is_finite()
                    && single.range_m - slack <= most_m
                    && single.range_m >= 0.98 * least_m
            })
            .collect();
        let untrusted = self.looks.iter().zip(&self.singles).zip(&keep);
        self.untrusted = untrusted
            .filter(|(_, kept)| !**kept)
            .map(|((look, single), _)| (look.measurement, *single))
            .collect();
        let mut kept = keep.iter();
        self.looks.retain(|_| kept.next().copied().unwrap_or(true));
        let mut kept = keep.iter();
        self.singles
            .retain(|_| kept.next().copied().unwrap_or(true));
        self.index();
        let all: Vec<f64> = self.looks.iter().filter_map(|l| l.log_px).collect();
        self.model.clutter_size = clutter_size(&all);
    }

    /// How well single detections near the end of the trusted ranges say their range: that decides
    /// which are taken.
    fn set_blur(&mut self) {
        let most_m = self.ranges_m.1;
        if !most_m.is_finite() {
            return;
        }
        let singles = self.looks.iter().zip(&self.singles);
        let along = singles
            .filter(|(_, single)| single.range_m > NEAR_END * most_m)
            .map(|(look, single)| self.along_m(look, single));
        let along_m = median(along.collect()).unwrap_or(0.0);
        self.blur_m = (along_m, along_m.min(SLACK * most_m));
    }

    /// Standard deviation of a single detection's range, metres.
    fn along_m(&self, look: &Look, single: &Singleton) -> f64 {
        let origin = self.poses[look.view].origin;
        let away = [single.object[0] - origin.x, single.object[1] - origin.y];
        let range_m = single.range_m.max(0.1);
        let u = away.map(|a| a / range_m);
        let c = &single.cov;
        let along = u[0] * u[0] * c[0][0] + 2.0 * u[0] * u[1] * c[0][1] + u[1] * u[1] * c[1][1];
        along.max(0.0).sqrt()
    }

    /// Before anything is fused scores say nothing; but how they scatter is known.
    fn begin_scores(&mut self) {
        let logits: Vec<f64> = self.looks.iter().filter_map(|l| l.logit).collect();
        if logits.len() < 2 {
            return;
        }
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let n = logits.len() as f64;
        let mean = logits.iter().sum::<f64>() / n;
        let variance = logits.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        self.model.scores = Some(Scores {
            object: mean,
            clutter: mean,
            variance: variance.max(LEAST_SCORE_VARIANCE),
        });
    }

    fn set_curve(&mut self) {
        self.model.curve = if self.has_sizes {
            let mut sizes: Vec<f64> = self.looks.iter().filter_map(|l| l.log_px).collect();
            sizes.sort_by(f64::total_cmp);
            let low = quantile(&sizes, 0.01).unwrap_or(0.0);
            let high = quantile(&sizes, 0.99).unwrap_or(1.0).max(low + 0.5);
            Detectability::new(low, high, 10)
        } else {
            let low = self.ranges_m.0.max(0.3).ln();
            Detectability::new(low, self.reach_m.ln().max(low + 0.5), 8)
        };
    }
}

impl Singleton {
    fn at(object: [f64; 4]) -> Self {
        let mut cov = [[0.0; 4]; 4];
        for (i, row) in cov.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        Self {
            object,
            cov,
            ln_evidence: -60.0,
            range_m: f64::INFINITY,
            visibility: 0.0,
        }
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn clutter_size(log_px: &[f64]) -> Normal {
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let n = log_px.len().max(1) as f64;
    let mean = log_px.iter().sum::<f64>() / n;
    let variance = log_px.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n;
    Normal {
        mean: median(log_px.to_vec()).unwrap_or(0.0),
        variance: variance.max(0.1),
    }
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

/// A quantile of sorted values, linear between them.
pub(super) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let at = share * last as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between zero and a count"
    )]
    let low = at.floor() as usize;
    let high = (low + 1).min(last);
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let rest = at - low as f64;
    Some(sorted[low] + rest * (sorted[high] - sorted[low]))
}
