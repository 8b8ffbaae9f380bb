//! How large the rocks of a scene are.

use std::f64::consts::PI;

use rand_chacha::ChaCha8Rng;

use super::random::uniform;

/// A law of rock diameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DiameterLaw {
    /// `min_m` and an exponentially distributed excess of mean `mean_excess_m`, metres.
    Exponential {
        /// The smallest diameter, metres.
        min_m: f64,
        /// The mean of what exceeds it, metres.
        mean_excess_m: f64,
    },
    /// Golombek and Rapp, Size-frequency distributions of rocks on Mars and Earth analog sites
    /// (Journal of Geophysical Research 102, 1997): rocks of diameter `D` and more cover the
    /// fraction `F(D) = k exp(-q D)` of the ground, with `q = 1.79 + 0.152 / k`.
    GolombekRapp {
        /// The fraction `k` of the ground that rocks of all sizes cover.
        coverage: f64,
        /// The smallest diameter of the scene, metres.
        min_m: f64,
        /// The largest diameter of the scene, metres.
        max_m: f64,
    },
}

impl DiameterLaw {
    /// Rocks a square metre, where the law knows.
    pub fn density_per_m2(&self) -> Option<f64> {
        match *self {
            Self::Exponential { .. } => None,
            Self::GolombekRapp { .. } => Table::new(self).map(|t| t.density_per_m2()),
        }
    }

    /// Draws `number` diameters, metres.
    pub(super) fn draw(&self, number: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let table = Table::new(self);
        let mut one = || match *self {
            Self::Exponential {
                min_m,
                mean_excess_m,
            } => min_m - mean_excess_m * (1.0 - uniform(rng)).ln(),
            Self::GolombekRapp { min_m, .. } => {
                let u = uniform(rng);
                table.as_ref().map_or(min_m, |t| t.diameter_at(u))
            }
        };
        (0..number).map(|_| one()).collect()
    }
}

/// The fraction of the ground that rocks of diameter `d_m` and more cover.
pub fn golombek_rapp_coverage(coverage: f64, d_m: f64) -> f64 {
    coverage * (-golombek_rapp_rate(coverage) * d_m).exp()
}

/// `q(k) = 1.79 + 0.152 / k`, a metre.
fn golombek_rapp_rate(coverage: f64) -> f64 {
    1.79 + 0.152 / coverage
}

/// The cumulative number law, tabulated over the logarithm of the diameter.
///
/// A rock of diameter `D` covers `pi D^2 / 4`, so there are `-F'(D) / (pi D^2 / 4) dD` rocks a
/// square metre between `D` and `D + dD`.
struct Table {
    diameters_m: Vec<f64>,
    /// Rocks a square metre from the smallest diameter up to each.
    cumulative_per_m2: Vec<f64>,
}

/// Steps of the table: the trapezoidal rule is then good to 1e-6.
const STEPS: u32 = 4096;

impl Table {
    fn new(law: &DiameterLaw) -> Option<Self> {
        let DiameterLaw::GolombekRapp {
            coverage,
            min_m,
            max_m,
        } = *law
        else {
            return None;
        };
        let rate = golombek_rapp_rate(coverage);
        let step = (max_m / min_m).ln() / f64::from(STEPS);
        let diameters_m: Vec<f64> = (0..=STEPS)
            .map(|i| min_m * (step * f64::from(i)).exp())
            .collect();
        // By ln D the density is 4 k q / (pi D) exp(-q D).
        let density = |d: f64| 4.0 * coverage * rate / (PI * d) * (-rate * d).exp();
        let mut sum = 0.0;
        let mut cumulative_per_m2 = vec![0.0];
        for pair in diameters_m.windows(2) {
            sum += 0.5 * step * (density(pair[0]) + density(pair[1]));
            cumulative_per_m2.push(sum);
        }
        Some(Self {
            diameters_m,
            cumulative_per_m2,
        })
    }

    fn density_per_m2(&self) -> f64 {
        self.cumulative_per_m2.last().copied().unwrap_or(0.0)
    }

    /// The diameter below which the share `u` of all rocks lies.
    fn diameter_at(&self, u: f64) -> f64 {
        let target = u * self.density_per_m2();
        let above = self.cumulative_per_m2.partition_point(|&c| c <= target);
        let above = above.clamp(1, self.diameters_m.len() - 1);
        let (c0, c1) = (
            self.cumulative_per_m2[above - 1],
            self.cumulative_per_m2[above],
        );
        let (d0, d1) = (self.diameters_m[above - 1], self.diameters_m[above]);
        let share = if c1 > c0 {
            (target - c0) / (c1 - c0)
        } else {
            0.0
        };
        d0 + (d1 - d0) * share
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Purpose, stream};
    use super::*;

    /// The number density integrated another way: Simpson's rule over D itself.
    #[test]
    fn density_agrees_with_simpson() {
        let law = DiameterLaw::GolombekRapp {
            coverage: 0.1,
            min_m: 0.1,
            max_m: 1.5,
        };
        let q = 1.79 + 0.152 / 0.1;
        let f = |d: f64| 4.0 * 0.1 * q * (-q * d).exp() / (PI * d * d);
        let n = 20_000u32;
        let h = 1.4 / f64::from(n);
        let mut sum = f(0.1) + f(1.5);
        for i in 1..n {
            sum += f(0.1 + h * f64::from(i)) * if i % 2 == 1 { 4.0 } else { 2.0 };
        }
        let simpson = sum * h / 3.0;
        assert!((law.density_per_m2().unwrap() / simpson - 1.0).abs() < 1e-6);
    }

    #[test]
    fn drawn_rocks_cover_what_the_law_says() {
        let (k, min_m, max_m) = (0.1, 0.1, 1.5);
        let law = DiameterLaw::GolombekRapp {
            coverage: k,
            min_m,
            max_m,
        };
        let number = 200_000;
        let ground_m2 = 200_000.0 / law.density_per_m2().unwrap();
        let drawn = law.draw(number, &mut stream(5, Purpose::Rocks, 0));
        for d in [0.1, 0.2, 0.4, 0.8] {
            let areas: Vec<f64> = drawn
                .iter()
                .filter(|&&x| x >= d)
                .map(|x| PI * x * x / 4.0)
                .collect();
            let covered = areas.iter().sum::<f64>() / ground_m2;
            // The sampling error of a sum of independent areas.
            let error = areas.iter().map(|a| a * a).sum::<f64>().sqrt() / ground_m2;
            let law = golombek_rapp_coverage(k, d) - golombek_rapp_coverage(k, max_m);
            assert!((covered - law).abs() < 4.0 * error, "{d}: {covered} {law}");
        }
        assert!(drawn.iter().all(|d| (min_m..=max_m).contains(d)));
    }

    #[test]
    fn exponential_diameters_have_their_mean() {
        let law = DiameterLaw::Exponential {
            min_m: 0.08,
            mean_excess_m: 0.12,
        };
        let drawn = law.draw(100_000, &mut stream(5, Purpose::Rocks, 0));
        let mean = drawn.iter().sum::<f64>() / 1e5;
        assert!((mean - 0.2).abs() < 4.0 * 0.12 / 1e5f64.sqrt());
    }
}
