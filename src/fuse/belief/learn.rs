//! What the data say of noise, clutter, density, sizes and detectability (3.5): one round of
//! expectation maximisation.

use super::algebra::{self, Square6};
use super::departure::Departure;
use super::engine::{Engine, Normal, START_CLUTTER, START_TRANSIENTS, Scores};
use super::evidence::{Evidence, probability};
use super::looks::Repeats;
use super::noise::robust_weight;
use super::single::LEAST_SCORE_VARIANCE;

/// The stated noise counts for this many readings.
const NOISE_COUNT: f64 = 10.0;
/// Fewer degrees of freedom say nothing about the noise.
const LEAST_FREEDOM: f64 = 20.0;
/// Factors on the noise are kept between these.
const SCALES: (f64, f64) = (0.3, 3.0);
/// The stated noise of poses counts for this many views.
const POSE_COUNT: f64 = 4.0;
/// Fewer views say nothing about the noise of their poses.
pub(super) const LEAST_VIEWS: usize = 6;
/// Squared factors on the noise of poses are kept between these.
const POSE_SCALES2: (f64, f64) = (0.02, 9.0);
/// Heights are kept between these, metres.
const HEIGHTS_M: (f64, f64) = (0.002, 1.0);
/// The size law that one starts from counts for this many objects.
const SIZE_COUNT: f64 = 5.0;
/// Variances of sizes, and of clutter's, are kept between these.
const SIZE_VARIANCES: (f64, f64) = (0.003, 2.0);
const CLUTTER_VARIANCES: (f64, f64) = (0.05, 2.0);
/// That scores say nothing counts for this many detections of each kind.
const SCORE_COUNT: f64 = 3.0;

/// Weighted moments about a first guess that counts for some weight.
struct Moments {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn new(n: f64, at: f64) -> Self {
        Self {
            n,
            sum: n * at,
            squares: n * at * at,
        }
    }

    fn add(&mut self, weight: f64, x: f64) {
        self.n += weight;
        self.sum += weight * x;
        self.squares += weight * x * x;
    }

    fn mean(&self) -> f64 {
        self.sum / self.n
    }

    fn scatter(&self) -> f64 {
        (self.squares - self.sum * self.sum / self.n).max(0.0)
    }
}

/// How likely objects are detected at all.
struct Chances {
    /// Logarithm of the probability that every view misses it.
    missed: Vec<f64>,
    /// Sum of the views' odds of detecting it.
    odds: Vec<f64>,
}

impl Chances {
    /// Probabilities are taken to be no less than this.
    const LEAST: f64 = 0.2;

    fn new(evidence: &Evidence, n_objects: usize) -> Self {
        let (mut missed, mut odds) = (vec![0.0; n_objects], vec![0.0; n_objects]);
        for (pair, worth) in evidence.expectation.pairs.iter().zip(&evidence.worth) {
            missed[pair.object] += worth * (-pair.p_detect).ln_1p();
            odds[pair.object] += worth * pair.p_detect / (1.0 - pair.p_detect);
        }
        Self { missed, odds }
    }

    /// That a view detects it.
    fn once(&self, object: usize) -> f64 {
        (1.0 - self.missed[object].exp()).clamp(Self::LEAST, 1.0)
    }

    /// That two views do.
    fn twice(&self, object: usize) -> f64 {
        let fewer = self.missed[object].exp() * (1.0 + self.odds[object]);
        (1.0 - fewer).clamp(Self::LEAST, 1.0)
    }
}

impl Engine<'_> {
    /// Sets the model to what the data suggest, given what speaks for each object.
    pub(super) fn learn(&mut self, evidence: &Evidence) {
        let real: Vec<f64> = evidence.log_odds.iter().map(|&l| probability(l)).collect();
        let support = self.support();
        self.learn_noise(&real, &support);
        // A drift that all views share shows in none of their differences, so that its scatter would be
        // taken for less than it is.
        let drifts = self.drift_law().is_some();
        if self.corrects_poses() && !drifts && self.n_views() >= LEAST_VIEWS {
            self.learn_pose_noise(None);
        }
        self.learn_heights(&real, &support);
        self.learn_rates(evidence, &real, &support);
        self.learn_curve(evidence, &real, &support);
        self.learn_border(evidence, &real, &support);
        self.learn_scores(evidence);
        self.looseness = self.looks.iter().map(|l| self.variances(l)).collect();
    }

    /// Noise of the readings, by the residuals of real objects seen more than once and by how many
    /// of them the unknowns use up (`MacKay`'s form).
    fn learn_noise(&mut self, real: &[f64], support: &[f64]) {
        let of: Vec<(usize, usize)> = self
            .edges
            .iter()
            .map(|e| (e.object, self.looks[e.look].view))
            .collect();
        let worth = self.worth(&self.objects, &of, Repeats::Errors);
        let (mut squares, mut freedom) = ([0.0; 4], [0.0; 4]);
        let mut n_good = 0;
        let mut any_bearing = false;
        for (edge, worth) in self.edges.iter().zip(&worth) {
            let (look, k) = (&self.looks[edge.look], edge.object);
            any_bearing |= look.is_bearing();
            let good =
                edge.weight > 0.5 && support[k] > 1.5 && real[k] > 0.5 && look.left.is_none();
            if !good {
                continue;
            }
            let Some(seen) = self.expect(look.view, &self.objects[k]) else {
                continue;
            };
            n_good += 1;
            let e = seen.residual(look);
            let variances = &self.looseness[edge.look];
            let weight = edge.weight * worth * robust_weight(&e, variances, look.n_rows());
            let (by_object, by_pose) = seen.of(look);
            let mut spread = algebra::spread(&by_object, &self.object_cov[k], look.n);
            if self.corrects_poses() {
                let more = algebra::spread(&by_pose, &self.pose_cov[look.view], look.n);
                for r in 0..look.n {
                    spread[r][r] += more[r][r];
                }
            }
            for r in 0..look.n {
                if look.has[r] {
                    squares[r] += weight * e[r] * e[r] / variances[r];
                    freedom[r] += weight * (1.0 - (spread[r][r] / variances[r]).min(0.95));
                }
            }
        }
        if n_good <= 10 {
            return;
        }
        let groups: &[&[usize]] = if any_bearing {
            &[&[0], &[1], &[2], &[3]]
        } else {
            &[&[0, 1], &[2], &[3]]
        };
        for rows in groups {
            let squares: f64 = rows.iter().map(|&r| squares[r]).sum();
            let freedom: f64 = rows.iter().map(|&r| freedom[r]).sum();
            if freedom <= LEAST_FREEDOM {
                continue;
            }
            let scale = self.model.scales[rows[0]];
            let factor = (NOISE_COUNT / (scale * scale) + squares) / (NOISE_COUNT + freedom);
            for &r in *rows {
                let new = self.model.scales[r] * factor.max(0.0).sqrt();
                self.model.scales[r] = new.clamp(SCALES.0, SCALES.1);
            }
        }
    }

    /// Noise of the poses, by their errors and how well those are known: with all else held, as
    /// rounds have it, or all else free, which counts what views share too.
    pub(super) fn learn_pose_noise(&mut self, marginal: Option<&[Square6]>) {
        #[expect(clippy::cast_precision_loss, reason = "a count of views")]
        let n_views = self.n_views() as f64;
        let mut squares = [0.0; 6];
        for (view, platform) in self.platforms.iter().enumerate() {
            for (i, square) in squares.iter_mut().enumerate() {
                let error = self.delta[view][i];
                let cov = marginal.map_or(&self.pose_cov[view], |m| &m[view]);
                let sum = error * error + cov[i][i];
                *square += sum / platform.sigma[i].powi(2) / n_views;
            }
        }
        for group in [&[0usize, 1][..], &[2], &[3], &[4], &[5]] {
            #[expect(clippy::cast_precision_loss, reason = "a count of components")]
            let size = group.len() as f64;
            let mean = group.iter().map(|&i| squares[i]).sum::<f64>() / size;
            let n = n_views * size;
            let scale2 = (n * mean + POSE_COUNT) / (n + POSE_COUNT);
            for &i in group {
                self.model.pose_scale[i] = scale2.clamp(POSE_SCALES2.0, POSE_SCALES2.1).sqrt();
            }
        }
    }

    /// How far objects lie from the terrain.
    fn learn_heights(&mut self, real: &[f64], support: &[f64]) {
        let variance = self.model.height_variance;
        let (mut squares, mut freedom) = (variance, 1.0);
        for (k, x) in self.objects.iter().enumerate() {
            let height_m = self.prior(x).height_m;
            let weight = if support[k] > 1.5 { real[k] } else { 0.0 };
            squares += real[k] * height_m * height_m * f64::from(u8::from(support[k] > 1.5));
            freedom += weight * (1.0 - self.object_cov[k][2][2] / variance).max(0.0);
        }
        let (least, most) = (HEIGHTS_M.0.powi(2), HEIGHTS_M.1.powi(2));
        self.model.height_variance = (squares / freedom).clamp(least, most);
    }

    /// Clutter, transients, density and sizes.
    fn learn_rates(&mut self, evidence: &Evidence, real: &[f64], support: &[f64]) {
        let mut unowned = vec![1.0; self.looks.len()];
        let uniform = |look: usize| {
            let b = &self.background[look];
            (b.uniform - b.clutter).exp()
        };
        let (mut clutter, mut transients) = (START_CLUTTER, START_TRANSIENTS * START_CLUTTER);
        let mut sizes = Vec::new();
        for edge in &self.edges {
            unowned[edge.look] -= edge.weight;
            let weight = edge.weight * (1.0 - real[edge.object]);
            let share = uniform(edge.look);
            clutter += weight * share;
            transients += weight * (1.0 - share);
            if let Some(l) = self.looks[edge.look].log_px {
                sizes.push((weight * share, l));
            }
        }
        for (look, rest) in unowned.iter().enumerate() {
            let share = uniform(look);
            clutter += rest.max(0.0) * share;
            transients += rest.max(0.0) * (1.0 - share);
        }
        #[expect(clippy::cast_precision_loss, reason = "a count of views")]
        let n_views = self.n_views() as f64 + 1.0;
        self.model.clutter = clutter / n_views;
        self.model.transients = transients / n_views / self.view_area_m2;
        let chances = Chances::new(evidence, self.objects.len());
        let whole: Vec<f64> = (0..real.len()).map(|k| real[k] / chances.once(k)).collect();
        self.set_density(whole.iter().sum::<f64>().max(1.0) / self.area_m2);
        if !self.has_sizes {
            return;
        }
        let corroborated: f64 = real
            .iter()
            .zip(support)
            .filter(|(_, s)| **s > 1.5)
            .map(|(r, _)| r)
            .sum();
        if real.iter().sum::<f64>() > 5.0 {
            let weights: Vec<f64> = if corroborated > 10.0 {
                let twice = |k: usize| {
                    if support[k] > 1.5 {
                        real[k] / chances.twice(k)
                    } else {
                        0.0
                    }
                };
                (0..real.len()).map(twice).collect()
            } else {
                whole
            };
            self.learn_sizes(&weights);
        }
        let total: f64 = sizes.iter().map(|s| s.0).sum();
        if total > 5.0 {
            let mean = sizes.iter().map(|(w, l)| w * l).sum::<f64>() / total;
            let scatter = sizes
                .iter()
                .map(|(w, l)| w * (l - mean).powi(2))
                .sum::<f64>();
            self.model.clutter_size.mean = mean;
            self.model.clutter_size.variance =
                (scatter / total + 0.02).clamp(CLUTTER_VARIANCES.0, CLUTTER_VARIANCES.1);
        }
    }

    fn learn_sizes(&mut self, weights: &[f64]) {
        let law = self.model.size;
        let (mut n, mut sum) = (SIZE_COUNT, SIZE_COUNT * law.mean);
        for (weight, x) in weights.iter().zip(&self.objects) {
            n += weight;
            sum += weight * x[3];
        }
        let mean = sum / n;
        let mut scatter = SIZE_COUNT * law.variance;
        for ((weight, x), cov) in weights.iter().zip(&self.objects).zip(&self.object_cov) {
            scatter += weight * ((x[3] - mean).powi(2) + cov[3][3]);
        }
        let size = Normal {
            mean,
            variance: (scatter / n).clamp(SIZE_VARIANCES.0, SIZE_VARIANCES.1),
        };
        let sizes = weights.iter().zip(&self.objects).map(|(w, x)| (*w, x[3]));
        self.model.size_departure = Departure::learnt(&size, sizes);
        self.model.size = size;
    }

    /// Scores of objects and of clutter.
    fn learn_scores(&mut self, evidence: &Evidence) {
        let Some(scores) = self.model.scores else {
            return;
        };
        let overall = 0.5 * (scores.object + scores.clutter);
        let mut object = Moments::new(SCORE_COUNT, overall);
        let mut clutter = Moments::new(SCORE_COUNT, overall);
        let mut unowned = vec![1.0; self.looks.len()];
        for edge in &self.edges {
            let look = &self.looks[edge.look];
            let Some(logit) = look.logit else { continue };
            unowned[edge.look] -= edge.weight;
            let real = probability(evidence.log_odds[edge.object]);
            object.add(edge.weight * real, logit);
            clutter.add(edge.weight * (1.0 - real), logit);
        }
        for (look, rest) in self.looks.iter().zip(&unowned) {
            if let Some(logit) = look.logit {
                clutter.add(rest.max(0.0), logit);
            }
        }
        let (object_mean, clutter_mean) = (object.mean(), clutter.mean());
        let scatter = object.scatter() + clutter.scatter() + SCORE_COUNT * scores.variance;
        let variance = scatter / (object.n + clutter.n - SCORE_COUNT);
        self.model.scores = Some(Scores {
            object: object_mean,
            clutter: clutter_mean,
            variance: variance.max(LEAST_SCORE_VARIANCE),
        });
    }

    /// Hits and misses of objects that other views saw too, by their probability of being real:
    /// leaving the view itself out of the choice keeps it free of bias, and so does asking no more
    /// of an object than that, since one that many views missed is the less believed for it.
    fn learn_curve(&mut self, evidence: &Evidence, real: &[f64], support: &[f64]) {
        let pairs = &evidence.expectation.pairs;
        let chances = pairs
            .iter()
            .zip(&evidence.detected)
            .zip(&evidence.worth)
            .filter(|((pair, q), _)| {
                let k = pair.object;
                support[k] - *q > 0.8 && pair.inside > 0.7
            })
            .map(|((pair, q), worth)| {
                let weight = real[pair.object] * worth;
                (pair.visibility, weight, weight * q)
            });
        let mut curve = self.model.curve.clone();
        curve.learn(chances);
        self.model.curve = curve;
    }
}
