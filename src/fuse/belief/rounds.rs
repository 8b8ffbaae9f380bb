//! Stage B: rounds of association, adjustment and learning, until next to nothing changes.

use super::engine::Engine;
use super::evidence::Evidence;
use super::solve::Robust;

/// Rounds of association and learning at most.
const ROUNDS: usize = 12;
/// And at least.
const LEAST_ROUNDS: usize = 3;
/// They are over where next to no detection changes company or has its object move farther than this
/// many of its standard deviations: one that wavers between two objects would else keep the longest
/// traverse going.
const STILL: f64 = 0.2;
/// What "next to no" is, as a share of the detections.
const WAVERING: f64 = 5e-3;
/// Squared scales of the robust steps between registration and association.
const SCHEDULE: [f64; 7] = [400.0, 100.0, 100.0, 25.0, 25.0, 9.0, 9.0];

/// Which looks belong together, and where their objects are.
struct Company {
    /// Of every look its object.
    owners: Vec<Option<usize>>,
    /// The look before it of the same object.
    partners: Vec<Option<usize>>,
    /// And where that object is.
    places: Vec<Option<[f64; 4]>>,
}

impl Engine<'_> {
    /// Of every look the look before it of the same object.
    pub(super) fn partners(&self) -> Vec<Option<usize>> {
        self.partners_by(&self.owners())
    }

    fn partners_by(&self, owners: &[Option<usize>]) -> Vec<Option<usize>> {
        let mut last = vec![None; self.objects.len()];
        owners
            .iter()
            .enumerate()
            .map(|(look, owner)| {
                let before = &mut last[(*owner)?];
                let found = *before;
                *before = Some(look);
                found
            })
            .collect()
    }

    fn company(&self) -> Company {
        let owners = self.owners();
        let places = owners.iter().map(|o| o.map(|k| self.objects[k]));
        Company {
            places: places.collect(),
            partners: self.partners_by(&owners),
            owners,
        }
    }

    /// The share of looks that changed company until now, or whose object moved.
    fn unrest(&self, before: &Company, now: &Company) -> f64 {
        let still = |look: usize| match (before.places[look], now.places[look], now.owners[look]) {
            (Some(was), Some(is), Some(k)) => {
                let cov = &self.object_cov[k];
                (0..4).all(|i| (is[i] - was[i]).powi(2) <= STILL * STILL * cov[i][i])
            }
            (was, is, _) => was.is_none() && is.is_none(),
        };
        let same = |look: usize| before.partners[look] == now.partners[look];
        let n = now.owners.len();
        let restless = (0..n).filter(|&look| !same(look) || !still(look));
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        let share = restless.count() as f64 / n.max(1) as f64;
        share
    }

    /// Stage B: rounds of association, adjustment and learning.
    pub(super) fn refine(&mut self) -> (Evidence, usize, bool) {
        for c2 in SCHEDULE {
            let robust = if self.corrects_poses() {
                Robust::Scale(c2)
            } else {
                Robust::Contaminated
            };
            self.adjust(1, robust, false);
        }
        let mut evidence = Evidence::default();
        let (mut last, mut before_last) = (self.company(), None);
        let mut objective = f64::NEG_INFINITY;
        for round in 0..ROUNDS {
            evidence = self.round();
            self.learn(&evidence);
            let now = self.company();
            let is_late = round >= LEAST_ROUNDS;
            if is_late && self.unrest(&last, &now) <= WAVERING {
                return (evidence, round + 1, true);
            }
            // Two maps that follow upon each other for ever: the more probable one is taken.
            let worse = std::mem::replace(&mut objective, self.objective(&evidence));
            let swings = |b: Company| self.unrest(&b, &now) <= WAVERING;
            if is_late && objective >= worse && before_last.is_some_and(swings) {
                return (evidence, round + 1, true);
            }
            before_last = Some(std::mem::replace(&mut last, now));
        }
        (evidence, ROUNDS, false)
    }

    /// Logarithm of the posterior, up to a constant: every detection clutter, what each object adds
    /// to that, and the poses.
    pub(super) fn objective(&self, evidence: &Evidence) -> f64 {
        let clutter: f64 = self.background.iter().map(|b| b.clutter).sum();
        let objects: f64 = evidence
            .log_odds
            .iter()
            .map(|&l| super::noise::ln_add(0.0, l.clamp(-50.0, 500.0)))
            .sum();
        let scores: f64 = self.model.scores.map_or(0.0, |scores| {
            let logits = self.looks.iter().filter_map(|l| l.logit);
            logits.map(|x| scores.ln_object(x)).sum()
        });
        let mut poses = scores;
        if self.corrects_poses() {
            for view in 0..self.n_views() {
                let information = self.pose_information(view);
                for (d, i) in self.delta[view].iter().zip(&information) {
                    poses -= 0.5 * d * d * i;
                }
                poses -= self.model.pose_scale.iter().map(|s| s.ln()).sum::<f64>();
                if let Some((_, ln_det)) = super::algebra::inverse6(&self.pose_cov[view]) {
                    poses += 0.5 * ln_det;
                }
            }
        }
        clutter + objects + poses
    }
}
