//! Looks that follow closely upon each other repeat each other's errors.

use super::engine::Engine;

/// Looks are worth at least this.
const LEAST: f64 = 1e-3;

/// What repeats itself in consecutive looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repeats {
    /// The errors of readings.
    Errors,
    /// Whether the object is detected.
    Detection,
}

impl Engine<'_> {
    /// How many independent looks each of several looks is worth: the information of a first-order
    /// autoregressive process about its mean. With gaps g in units of the correlation length a
    /// look is worth `(tanh(g_before / 2) + tanh(g_after / 2)) / 2`, a half for the side it ends
    /// the row on.
    ///
    /// `of` are pairs of object and view; equal pairs count as apart.
    pub(super) fn worth(
        &self,
        objects: &[[f64; 4]],
        of: &[(usize, usize)],
        repeats: Repeats,
    ) -> Vec<f64> {
        let mut order: Vec<usize> = (0..of.len()).collect();
        order.sort_by_key(|&i| (of[i], i));
        let mut worth = vec![1.0; of.len()];
        let mut before = 1.0;
        for (at, &i) in order.iter().enumerate() {
            let after = order
                .get(at + 1)
                .filter(|&&next| of[next].0 == of[i].0)
                .map_or(1.0, |&next| {
                    self.apart(&objects[of[i].0], of[i].1, of[next].1, repeats)
                });
            worth[i] = (0.5 * (before + after)).max(LEAST);
            before = after;
        }
        worth
    }

    /// How far apart two looks at an object are: 0 the same, 1 independent.
    pub(super) fn apart(&self, object: &[f64; 4], a: usize, b: usize, repeats: Repeats) -> f64 {
        if a == b {
            return 1.0;
        }
        let (pa, pb) = (&self.poses[a].origin, &self.poses[b].origin);
        let range = |p: &nalgebra::Vector3<f64>| {
            let d = [p.x - object[0], p.y - object[1], p.z - object[2]];
            (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
        };
        let s = self.settings;
        let seconds = self.platforms[a]
            .time_s
            .zip(self.platforms[b].time_s)
            .map(|(ta, tb)| (tb - ta).abs());
        let moved = || {
            let range_m = (0.5 * (range(pa) + range(pb))).max(0.1);
            (pa - pb).norm() / (s.look_share * range_m)
        };
        let gap = match (repeats, seconds) {
            (Repeats::Errors, Some(t)) => moved().min(t / s.geometry_time_s),
            (Repeats::Detection, Some(t)) => t / s.event_time_s,
            (_, None) => moved(),
        };
        (0.5 * gap).tanh()
    }
}
