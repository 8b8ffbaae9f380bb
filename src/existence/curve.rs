//! How often an object of some apparent size is detected.

/// How many bins the curve has.
const BINS: usize = 12;
/// The apparent sizes it spans, pixels.
const SPAN_PX: (f64, f64) = (6.0, 120.0);
/// How many detections or misses the curve one starts from counts for, in each bin.
const PRIOR_COUNT: f64 = 8.0;

/// Probability that an object in the picture is detected, by the logarithm of its apparent width in
/// pixels: values in the middle of bins, linear between and constant beyond them.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionCurve {
    values: [f64; BINS],
    start: [f64; BINS],
}

impl Default for DetectionCurve {
    /// A detector that finds 92 % of large objects and half as many of 25 pixels.
    fn default() -> Self {
        Self::logistic(0.92, 25.0, 6.0)
    }
}

impl DetectionCurve {
    /// `most / (1 + exp(-(w - half) / width))` of the apparent width w, pixels.
    pub fn logistic(most: f64, half_px: f64, width_px: f64) -> Self {
        let values = std::array::from_fn(|i| {
            let px = Self::middle(i).exp();
            (most / (1.0 + (-(px - half_px) / width_px).exp())).clamp(0.02, 0.98)
        });
        Self {
            values,
            start: values,
        }
    }

    /// The values in the middle of the bins.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Probability of detection at a logarithm of apparent width.
    pub fn at(&self, log_px: f64) -> f64 {
        let step = Self::step();
        let x = (log_px - Self::middle(0)) / step;
        let last = f64::from(u32::try_from(BINS - 1).unwrap_or(u32::MAX));
        if x.is_nan() || x <= 0.0 {
            return self.values[0];
        }
        if x >= last {
            return self.values[BINS - 1];
        }
        let i = Self::index(x);
        let share = (log_px - Self::middle(i)) / step;
        self.values[i] + share * (self.values[i + 1] - self.values[i])
    }

    /// The bin that a logarithm of apparent width falls in; the outer ones are open.
    pub fn bin(log_px: f64) -> usize {
        let x = (log_px - SPAN_PX.0.ln()) / Self::step();
        Self::index(x).min(BINS - 1)
    }

    /// Learns from chances and detections, each a bin and a weight: every bin becomes the mean of a
    /// Beta distribution that started as the first curve with a few counts.
    pub fn learn(&mut self, chances: impl IntoIterator<Item = (usize, f64, f64)>) {
        let (mut n, mut y) = ([0.0; BINS], [0.0; BINS]);
        for (bin, chance, detected) in chances {
            n[bin] += chance;
            y[bin] += detected;
        }
        for i in 0..BINS {
            let mean = (y[i] + PRIOR_COUNT * self.start[i]) / (n[i] + PRIOR_COUNT);
            self.values[i] = mean.clamp(0.01, 0.99);
        }
    }

    fn step() -> f64 {
        (SPAN_PX.1 / SPAN_PX.0).ln() / 12.0
    }

    fn middle(bin: usize) -> f64 {
        let bin = f64::from(u32::try_from(bin).unwrap_or(u32::MAX));
        SPAN_PX.0.ln() + (bin + 0.5) * Self::step()
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to a few bins; NaN becomes the first"
    )]
    fn index(x: f64) -> usize {
        x.floor().clamp(0.0, 1e6) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_logistic_between_its_ends() {
        let curve = DetectionCurve::default();
        for px in [10.0f64, 25.0, 40.0, 90.0] {
            let exact = (0.92 / (1.0 + (-(px - 25.0) / 6.0).exp())).clamp(0.02, 0.98);
            assert!((curve.at(px.ln()) - exact).abs() < 0.03, "{px}");
        }
        assert_eq!(curve.at(0.0), curve.values()[0]);
        assert_eq!(curve.at(9.0), curve.values()[11]);
        assert_eq!(curve.at(f64::NAN), curve.values()[0]);
    }

    #[test]
    fn learns_a_bin_as_a_beta_mean() {
        let mut curve = DetectionCurve::logistic(0.9, 1.0, 0.1);
        let bin = DetectionCurve::bin(30f64.ln());
        curve.learn((0..24).map(|i| (bin, 1.0, f64::from(i % 2))));
        let expected = (12.0 + 8.0 * 0.9) / (24.0 + 8.0);
        assert!((curve.values()[bin] - expected).abs() < 1e-12);
        assert!((curve.values()[0] - 0.9).abs() < 1e-12);
        assert_eq!(DetectionCurve::bin(1.0), 0);
        assert_eq!(DetectionCurve::bin(120f64.ln() + 1.0), 11);
    }
}
