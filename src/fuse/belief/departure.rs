//! How a density departs from a normal one.

use super::engine::{Normal, normal_cdf};

/// Nodes stand half a standard deviation apart, three to either side of the mean.
const NODES: usize = 13;
const STEP: f64 = 0.5;
/// That a density is normal counts for this many values at every node.
const NORMAL_COUNT: f64 = 3.0;
/// Densities are taken to be at most this many times as great or as small as normal ones.
const MOST: f64 = 10.0;

/// Logarithm of the ratio of a density to the normal one of its moments: values at nodes, linear
/// between them, flat beyond. Sizes of rocks begin at what the detector takes for one and fall off
/// like an exponential or a power law; a normal law of their logarithms makes the smallest, of which
/// there are most, too rare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Departure {
    ln_ratios: [f64; NODES],
}

impl Departure {
    /// That of a normal density.
    pub(super) const NORMAL: Self = Self {
        ln_ratios: [0.0; NODES],
    };

    /// Learns from weighted values, given the normal density of their moments.
    pub(super) fn learnt(law: &Normal, values: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut seen = [0.0; NODES];
        let mut total = 0.0;
        for (weight, x) in values {
            let (node, share) = place(law, x);
            seen[node] += weight * (1.0 - share);
            seen[node + 1] += weight * share;
            total += weight;
        }
        let mut ln_ratios = [0.0; NODES];
        for (node, ln) in ln_ratios.iter_mut().enumerate() {
            let expected = total * normal_share(node);
            let ratio = (seen[node] + NORMAL_COUNT) / (expected + NORMAL_COUNT);
            *ln = ratio.clamp(1.0 / MOST, MOST).ln();
        }
        Self { ln_ratios }
    }

    /// The logarithm of the ratio at a value.
    pub(super) fn ln_ratio(&self, law: &Normal, x: f64) -> f64 {
        let (node, share) = place(law, x);
        let (a, b) = (self.ln_ratios[node], self.ln_ratios[node + 1]);
        a + share * (b - a)
    }
}

/// The node at or below a value, and how far it is on the way to the next.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "clamped to a few nodes"
)]
fn place(law: &Normal, x: f64) -> (usize, f64) {
    const LAST: usize = NODES - 2;
    let middle = 0.5 * (NODES - 1) as f64;
    let at = (x - law.mean) / law.variance.sqrt() / STEP + middle;
    if at.is_nan() {
        return (0, 0.0);
    }
    let node = (at.floor().clamp(0.0, LAST as f64) as usize).min(LAST);
    (node, (at - node as f64).clamp(0.0, 1.0))
}

/// The share of a standard normal density that falls to a node.
#[expect(clippy::cast_precision_loss, reason = "a few nodes")]
fn normal_share(node: usize) -> f64 {
    // The integral of the distribution function, whose second differences are integrals of hats.
    let integral = |z: f64| {
        let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        z * normal_cdf(z) + density
    };
    let z = STEP * (node as f64 - 0.5 * (NODES - 1) as f64);
    let below = if node == 0 {
        0.0
    } else {
        (integral(z) - integral(z - STEP)) / STEP
    };
    let above = if node == NODES - 1 {
        1.0
    } else {
        (integral(z + STEP) - integral(z)) / STEP
    };
    above - below
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Normal = Normal {
        mean: -1.0,
        variance: 0.25,
    };

    #[test]
    fn shares_of_the_nodes_are_one_together() {
        let shares: Vec<f64> = (0..NODES).map(normal_share).collect();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // The hat about the mean: its integral by Simpson's rule on 2000 parts.
        let phi = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let n = 2000u32;
        let h = STEP / f64::from(n);
        let simpson: f64 = (0..=n)
            .map(|i| {
                let z = f64::from(i) * h;
                let end = i == 0 || i == n;
                let weight = match (end, i % 2) {
                    (true, _) => 1.0,
                    (_, 1) => 4.0,
                    _ => 2.0,
                };
                weight * phi(z) * (1.0 - z / STEP) * h / 3.0
            })
            .sum();
        assert!((shares[NODES / 2] - 2.0 * simpson).abs() < 1e-12);
    }

    #[test]
    fn an_exponential_law_is_told_from_a_normal_one() {
        // Quantiles of logarithms of 0.08 m and an exponential excess of mean 0.12 m.
        let values: Vec<f64> = (0..4000)
            .map(|i| {
                let u = (f64::from(i) + 0.5) / 4000.0;
                (0.08 - 0.12 * (1.0 - u).ln()).ln()
            })
            .collect();
        let n = 4000.0;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let law = Normal { mean, variance };
        let shape = Departure::learnt(&law, values.iter().map(|&x| (1.0, x)));
        for size in [0.1f64, 0.12, 0.2, 0.4] {
            let density = size / 0.12 * (-(size - 0.08) / 0.12).exp();
            let found = law.ln(size.ln()) + shape.ln_ratio(&law, size.ln());
            assert!(
                (found - density.ln()).abs() < 0.15,
                "{size}: {found}, not {}",
                density.ln()
            );
        }
        // Half as large as any.
        let far = shape.ln_ratio(&law, 0.04f64.ln());
        assert!(far < -1.5, "{far}");
    }

    #[test]
    fn few_values_leave_it_normal() {
        let shape = Departure::learnt(&LAW, [(0.1, -1.0), (0.1, 0.4)].into_iter());
        assert!(shape.ln_ratios.iter().all(|r| r.abs() < 0.05));
        assert_eq!(Departure::NORMAL.ln_ratio(&LAW, 3.0), 0.0);
        assert_eq!(shape.ln_ratio(&LAW, f64::NAN), shape.ln_ratios[0]);
    }
}
