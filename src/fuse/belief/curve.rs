//! How often an object is detected, by its apparent size or its range.

/// What the smooth curve says of a bin counts for this many looks in it ...
const SMOOTH_COUNT: f64 = 6.0;
/// ... and what all bins say together for this many in each, where the smooth curve is sought.
const FLAT_COUNT: f64 = 0.5;
/// Probabilities are kept between these.
const VALUES: (f64, f64) = (0.02, 0.98);
/// Widths of the rise that are tried, in bins.
const WIDTHS: [f64; 7] = [0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8];
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
        let smooth = Rise::best(&n, &y, mean);
        for (bin, value) in self.values.iter_mut().enumerate() {
            let of_bin = (y[bin] + SMOOTH_COUNT * smooth.at(bin)) / (n[bin] + SMOOTH_COUNT);
            *value = of_bin.clamp(VALUES.0, VALUES.1);
        }
    }
}

/// A logistic rise, or fall, from nothing to the most that is ever detected, over bins.
#[derive(Debug, Clone, Copy)]
struct Rise {
    most: f64,
    middle: f64,
    /// Negative where it falls.
    width: f64,
}

impl Rise {
    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    fn at(&self, bin: usize) -> f64 {
        self.most * self.share(bin as f64)
    }

    fn share(&self, bin: f64) -> f64 {
        1.0 / (1.0 + (-(bin - self.middle) / self.width).exp())
    }

    /// The most probable of a grid of them, given looks and detections by bin.
    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    fn best(n: &[f64], y: &[f64], mean: f64) -> Self {
        let bins = n.len() as f64;
        let n: Vec<f64> = n.iter().map(|n| n + FLAT_COUNT).collect();
        let y: Vec<f64> = y.iter().map(|y| y + FLAT_COUNT * mean).collect();
        let detected: f64 = y.iter().sum();
        let flat = Self {
            most: mean,
            middle: f64::NEG_INFINITY,
            width: 1.0,
        };
        let ln_likelihood = |rise: &Self| {
            let terms = n.iter().zip(&y).enumerate().map(|(bin, (n, y))| {
                let p = rise.at(bin).clamp(VALUES.0, VALUES.1);
                y * p.ln() + (n - y) * (-p).ln_1p()
            });
            terms.sum::<f64>()
        };
        let mut best = (ln_likelihood(&flat), flat);
        let middles = (0..=4 * n.len()).map(|i| 0.5 * i as f64 - 0.5 * bins);
        for middle in middles {
            for width in WIDTHS.into_iter().flat_map(|w| [w, -w]) {
                let mut rise = Self {
                    most: 1.0,
                    middle,
                    width,
                };
                let seen = n.iter().enumerate().map(|(bin, n)| n * rise.at(bin));
                rise.most = (detected / seen.sum::<f64>()).clamp(VALUES.0, VALUES.1);
                let ln = ln_likelihood(&rise);
                if ln > best.0 {
                    best = (ln, rise);
                }
            }
        }
        best.1
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
        // What the bins have seen of their own stands before what the rise says.
        let seen = (13.0 + SMOOTH_COUNT * 1.0) / (14.0 + SMOOTH_COUNT);
        assert!((curve.at(1.5) - seen).abs() < 0.05, "{}", curve.at(1.5));
        let middle = 0.5 * (curve.at(1.5) + curve.at(2.5));
        assert!((curve.at(2.0) - middle).abs() < 1e-15);
        assert_eq!(curve.at(-3.0), curve.values()[0]);
        assert_eq!(curve.at(f64::NAN), curve.values()[0]);
        assert_eq!(curve.at(9.0), curve.values()[3]);
    }

    #[test]
    fn a_rise_reaches_on_into_bins_without_looks() {
        // 0.9 / (1 + exp(-(bin - 4) / 0.8)), nothing seen below the fourth bin.
        let law = |bin: f64| 0.9 / (1.0 + (-(bin - 4.0) / 0.8).exp());
        for falls in [false, true] {
            let mut curve = Detectability::new(0.0, 10.0, 10);
            let at = |bin: u32| f64::from(if falls { 9 - bin } else { bin });
            curve.learn((3..10).map(|bin| (at(bin) + 0.5, 200.0, 200.0 * law(f64::from(bin)))));
            for bin in 0..10 {
                let expected = law(f64::from(bin)).max(VALUES.0);
                let found = curve.at(at(bin) + 0.5);
                assert!(
                    (found - expected).abs() < 0.04,
                    "{bin}: {found}, not {expected}"
                );
            }
        }
    }
}
