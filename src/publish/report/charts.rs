//! The distributions of a run.

use std::f64::consts::PI;

use serde::Serialize;

/// The most points a curve is drawn by.
const MAX_POINTS: usize = 200;

/// How many values fall between each two edges.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Histogram {
    /// One more than there are counts. A value on an edge counts above it, the last edge's below.
    pub(super) edges: Vec<f64>,
    pub(super) counts: Vec<usize>,
}

impl Histogram {
    /// Of numbers not below 0, in `bins` bins up to the 99th percentile made round; greater ones
    /// are in the last bin. `None` where there are no numbers.
    pub(super) fn of(values: &[f64], bins: u32) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let high = *sorted.get(sorted.len().checked_sub(1)? * 99 / 100)?;
        // A hair more, so that the value itself is below the last edge.
        let width = round_up((1.000_001 * high / f64::from(bins)).max(1e-9));
        Some(Self::in_steps(&sorted, width, bins))
    }

    /// Of shares from 0 to 1.
    pub(super) fn of_shares(values: &[f64]) -> Option<Self> {
        (!values.is_empty()).then(|| Self::in_steps(values, 0.05, 20))
    }

    /// Of counts, one bin each; bins are wider where there are more than `max_bins` of them.
    pub(super) fn of_counts(values: &[usize], max_bins: usize) -> Option<Self> {
        let most = *values.iter().max()?;
        let width = (most + 1).div_ceil(max_bins);
        let mut counts = vec![0; most / width + 1];
        for value in values {
            counts[value / width] += 1;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts of a run")]
        let edges = (0..=counts.len())
            .map(|i| (i * width) as f64 - 0.5)
            .collect();
        Some(Self { edges, counts })
    }

    fn in_steps(values: &[f64], width: f64, bins: u32) -> Self {
        let mut counts = vec![0; bins as usize];
        let last = counts.len() - 1;
        for value in values {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "cut to the bins there are"
            )]
            let bin = (value / width) as usize;
            counts[bin.min(last)] += 1;
        }
        let edges = (0..=bins).map(|i| f64::from(i) * width).collect();
        Self { edges, counts }
    }
}

/// The next of 1, 2 and 5 times a power of ten.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let enough = steps.into_iter().find(|s| s * power >= x * (1.0 - 1e-9));
    enough.unwrap_or(10.0) * power
}

/// How many rocks are at least so large, and what share of the ground seen they cover.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SizeFrequency {
    /// Diameters, ascending, metres.
    pub(super) diameter_m: Vec<f64>,
    /// Rocks of each diameter or more, by m^2 of ground seen.
    pub(super) per_m2: Vec<f64>,
    /// Share of the ground seen that they cover, each as a disc of its diameter.
    pub(super) area_share: Vec<f64>,
    /// Rocks with a diameter.
    pub(super) n_rocks: usize,
    /// The ground seen, m^2.
    pub(super) seen_m2: f64,
    /// The law that fits the larger half best.
    pub(super) law: Option<RockAbundance>,
}

/// The size-frequency law of Golombek and Rapp (1997), "Size-frequency distributions of rocks on
/// Mars and Earth analog sites", J. Geophys. Res. 102(E2), equations 1 and 2:
/// `F(D) = k exp(-q(k) D)` with `q(k) = 1.79 + 0.152 / k`, where `F` is the share of the ground
/// covered by rocks of diameter `D` (metres) or more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct RockAbundance {
    /// The share that rocks of all sizes cover.
    pub(super) k: f64,
    /// Its decay, 1/m.
    pub(super) q: f64,
}

impl RockAbundance {
    pub(super) fn new(k: f64) -> Self {
        Self {
            k,
            q: 1.79 + 0.152 / k,
        }
    }

    /// The share of the ground covered by rocks of this diameter (metres) or more.
    pub(super) fn area_share(&self, diameter_m: f64) -> f64 {
        self.k * (-self.q * diameter_m).exp()
    }

    /// The abundance between 0.001 and 0.6 whose logarithm fits these shares best in the least
    /// squares; `None` for fewer than five.
    fn fit(diameter_m: &[f64], area_share: &[f64]) -> Option<Self> {
        if diameter_m.len() < 5 {
            return None;
        }
        let misfit = |law: &Self| -> f64 {
            let terms = diameter_m.iter().zip(area_share);
            terms
                .map(|(&d, &share)| (law.area_share(d) / share).ln().powi(2))
                .sum()
        };
        // Steps of 0.5 %: finer than any count of rocks tells.
        let candidates = (0..1280).map(|i| Self::new(0.001 * (0.005 * f64::from(i)).exp()));
        candidates.min_by(|a, b| misfit(a).total_cmp(&misfit(b)))
    }
}

impl SizeFrequency {
    /// Of diameters (metres) on so much ground (m^2); `None` where either is absent.
    pub(super) fn of(diameters_m: impl IntoIterator<Item = f64>, seen_m2: f64) -> Option<Self> {
        let mut sorted: Vec<f64> = diameters_m.into_iter().filter(|d| *d > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        if sorted.is_empty() || seen_m2 <= 0.0 {
            return None;
        }
        let mut area_m2 = 0.0;
        let mut n = 0.0;
        let mut curve: Vec<(f64, f64, f64)> = sorted
            .iter()
            .rev()
            .map(|&d| {
                area_m2 += 0.25 * PI * d * d;
                n += 1.0;
                (d, n / seen_m2, area_m2 / seen_m2)
            })
            .collect();
        curve.reverse();
        // The smaller half is thinned out by what the pictures resolve, not by nature.
        let larger: Vec<_> = curve[curve.len() / 2..].to_vec();
        let diameters: Vec<f64> = larger.iter().map(|p| p.0).collect();
        let shares: Vec<f64> = larger.iter().map(|p| p.2).collect();
        let law = RockAbundance::fit(&diameters, &shares);
        let stride = curve.len().div_ceil(MAX_POINTS);
        let last = curve.len() - 1;
        let drawn = curve
            .iter()
            .enumerate()
            .filter(|(i, _)| i % stride == 0 || *i == last);
        let drawn: Vec<_> = drawn.map(|(_, point)| *point).collect();
        Some(Self {
            diameter_m: drawn.iter().map(|p| p.0).collect(),
            per_m2: drawn.iter().map(|p| p.1).collect(),
            area_share: drawn.iter().map(|p| p.2).collect(),
            n_rocks: sorted.len(),
            seen_m2,
            law,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_one_bin() {
        let values: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
        let histogram = Histogram::of(&values, 20).unwrap();
        assert_eq!(histogram.counts.iter().sum::<usize>(), 1000);
        assert_eq!(histogram.edges.len(), 21);
        assert_eq!(histogram.edges[1], 0.5);
        assert!(histogram.counts.iter().all(|&n| n == 50), "{histogram:?}");
        let far = [vec![1.0; 299], vec![1e6]].concat();
        assert_eq!(
            Histogram::of(&far, 10).unwrap().counts,
            [0, 0, 0, 0, 0, 299, 0, 0, 0, 1]
        );
        assert_eq!(Histogram::of(&[], 10), None);
    }

    #[test]
    fn counts_have_bins_of_their_own() {
        let histogram = Histogram::of_counts(&[0, 2, 2, 3], 10).unwrap();
        assert_eq!(histogram.counts, [1, 0, 2, 1]);
        assert_eq!(histogram.edges, [-0.5, 0.5, 1.5, 2.5, 3.5]);
        let wide = Histogram::of_counts(&[0, 99], 10).unwrap();
        assert_eq!(wide.counts, [1, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
        let shares = Histogram::of_shares(&[0.0, 0.5, 0.51, 1.0]).unwrap();
        assert_eq!(
            (shares.counts[0], shares.counts[10], shares.counts[19]),
            (1, 2, 1)
        );
    }

    #[test]
    fn the_law_is_the_papers() {
        let law = RockAbundance::new(0.1);
        assert!((law.q - 3.31).abs() < 1e-12);
        // At D = 1 m: 0.1 exp(-3.31).
        assert!((law.area_share(1.0) - 0.003_651_617).abs() < 1e-8);
        let diameters: Vec<f64> = (1..40).map(|i| 0.05 * f64::from(i)).collect();
        let shares: Vec<f64> = diameters.iter().map(|&d| law.area_share(d)).collect();
        let found = RockAbundance::fit(&diameters, &shares).unwrap();
        assert!((found.k - 0.1).abs() < 0.001, "{found:?}");
    }

    #[test]
    fn sizes_accumulate_from_the_largest() {
        let sizes = SizeFrequency::of([0.2, 1.0, 0.4], 10.0).unwrap();
        assert_eq!(sizes.diameter_m, [0.2, 0.4, 1.0]);
        assert_eq!(sizes.per_m2, [0.3, 0.2, 0.1]);
        let disc = |d: f64| PI * d * d / 4.0;
        let all = (disc(0.2) + disc(0.4) + disc(1.0)) / 10.0;
        assert!((sizes.area_share[0] - all).abs() < 1e-15);
        assert_eq!(sizes.law, None);
        assert_eq!(SizeFrequency::of([0.2], 0.0), None);
        let many = SizeFrequency::of((1..=5000).map(|i| 1e-3 * f64::from(i)), 10.0).unwrap();
        assert!(many.diameter_m.len() <= MAX_POINTS + 1);
        assert_eq!(many.diameter_m.last(), Some(&5.0));
    }
}
