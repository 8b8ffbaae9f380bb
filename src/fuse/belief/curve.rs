//! How often an object is detected, by its apparent size or its range.

/// What a bin and its neighbours say counts for this many looks in the bin ...
const PRIOR_COUNT: f64 = 6.0;
/// ... and what all bins say for this many in it and its neighbours.
const NEAR_COUNT: f64 = 2.0;
/// The share that is detected, before any data.
const START: f64 = 0.5;

/// Probability of detection of an object that is in the picture: values in the middles of bins of a
/// logarithm (of apparent size in pixels, or of range in metres), linear between them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detectability {
    low: f64,
    step: f64,
    values: Vec<f64>,
}

impl Detectability {
    pub(super) fn new(low: f64, high: f64, bins: u8) -> Self {
        Self {
            low,
            step: (high - low) / f64::from(bins),
            values: vec![START; usize::from(bins)],
        }
    }

    /// A curve of known values, in bins of one width.
    #[cfg(test)]
    pub(super) fn of(low: f64, high: f64, values: Vec<f64>) -> Self {
        let bins = u8::try_from(values.len()).unwrap();
        Self {
            values,
            ..Self::new(low, high, bins)
        }
    }

    /// The lower end of the first bin, and the width of each.
    #[cfg(test)]
    pub(super) fn bins(&self) -> (f64, f64) {
        (self.low, self.step)
    }

    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to a few bins; NaN becomes the first"
    )]
    fn index(&self, x: f64) -> usize {
        (x.floor().clamp(0.0, 1e3) as usize).min(self.values.len() - 1)
    }

    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    pub(super) fn at(&self, x: f64) -> f64 {
        let last = self.values.len() - 1;
        let t = (x - self.low) / self.step - 0.5;
        if t.is_nan() || t <= 0.0 {
            return self.values[0];
        }
        if t >= last as f64 {
            return self.values[last];
        }
        let i = self.index(t);
        self.values[i] + (t - i as f64) * (self.values[i + 1] - self.values[i])
    }

    /// Learns from chances: where, of how much weight, and how much of it was detected.
    pub(super) fn learn(&mut self, chances: impl Iterator<Item = (f64, f64, f64)>) {
        let (mut n, mut y) = (vec![0.0; self.values.len()], vec![0.0; self.values.len()]);
        for (x, weight, detected) in chances {
            let bin = self.index((x - self.low) / self.step);
            n[bin] += weight;
            y[bin] += detected;
        }
        let mean = (y.iter().sum::<f64>() + 2.0 * START) / (n.iter().sum::<f64>() + 2.0);
        for (bin, value) in self.values.iter_mut().enumerate() {
            let near = bin.saturating_sub(1)..(bin + 2).min(n.len());
            let (looks, detected) = (&n[near.clone()], &y[near]);
            let start = (detected.iter().sum::<f64>() + NEAR_COUNT * mean)
                / (looks.iter().sum::<f64>() + NEAR_COUNT);
            let of_bin = (y[bin] + PRIOR_COUNT * start) / (n[bin] + PRIOR_COUNT);
            *value = of_bin.clamp(0.02, 0.98);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_linear_between_the_middles_of_bins() {
        let mut curve = Detectability::new(0.0, 4.0, 4);
        assert_eq!(curve.at(1.3), 0.5);
        // 14 looks in the second bin, 13 of them detections; nothing elsewhere.
        curve.learn((0..14).map(|i| (1.5, 1.0, if i == 0 { 0.0 } else { 1.0 })));
        let mean = (13.0 + 1.0) / (14.0 + 2.0);
        // The third bin has its neighbours' share, and the fourth that of all.
        let near = (13.0 + 2.0 * mean) / 16.0;
        let second = (13.0 + 6.0 * near) / 20.0;
        assert!((curve.at(1.5) - second).abs() < 1e-15);
        assert!((curve.at(2.0) - 0.5 * (second + near)).abs() < 1e-15);
        assert!((curve.at(3.5) - mean).abs() < 1e-15);
        assert_eq!(curve.at(-3.0), curve.values()[0]);
        assert_eq!(curve.at(f64::NAN), curve.values()[0]);
        assert_eq!(curve.at(9.0), curve.values()[3]);
    }
}
