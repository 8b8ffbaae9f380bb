//! Smooth random surfaces without an edge or a table: value noise on lattices.

use super::random::share;

/// The mean square of two-dimensional value noise with lattice values of variance one, over a
/// cell: the square of the integral of `(1 - s)^2 + s^2` with `s = t^3 (6 t^2 - 15 t + 10)`.
const MEAN_SQUARE: f64 = (181.0 / 231.0) * (181.0 / 231.0);

/// Value noise and its gradient at a place given in units of the lattice: values uniform between
/// -1 and 1 at the lattice points, between them Perlin's quintic (Improving noise, 2002), so that
/// slope and curvature are continuous.
pub(super) fn value_noise(key: u64, x: f64, y: f64) -> (f64, [f64; 2]) {
    let (i, sx, dx) = split(x);
    let (j, sy, dy) = split(y);
    let columns = [mixed(i, COLUMN), mixed(i + 1, COLUMN)];
    let rows = [mixed(j, ROW), mixed(j + 1, ROW)];
    let at = |column: usize, row: usize| corner(key ^ columns[column] ^ rows[row]);
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    let (low, high) = (a + (b - a) * sx, c + (d - c) * sx);
    let slope_x = ((b - a) * (1.0 - sy) + (d - c) * sy) * dx;
    (low + (high - low) * sy, [slope_x, (high - low) * dy])
}

/// The value of [`value_noise`] alone.
fn value(key: u64, x: f64, y: f64) -> f64 {
    let (i, sx, _) = split(x);
    let (j, sy, _) = split(y);
    let columns = [mixed(i, COLUMN), mixed(i + 1, COLUMN)];
    let rows = [mixed(j, ROW), mixed(j + 1, ROW)];
    let at = |column: usize, row: usize| corner(key ^ columns[column] ^ rows[row]);
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    let (low, high) = (a + (b - a) * sx, c + (d - c) * sx);
    low + (high - low) * sy
}

/// Odd numbers that spread the bits of a lattice line.
const COLUMN: u64 = 0x9e37_79b9_7f4a_7c15;
const ROW: u64 = 0xc2b2_ae3d_27d4_eb4f;

/// The lattice line below a coordinate, and the quintic of the rest with its slope.
fn split(x: f64) -> (i64, f64, f64) {
    #[expect(clippy::cast_possible_truncation, reason = "a site spans few cells")]
    let toward_zero = x as i64;
    #[expect(clippy::cast_precision_loss, reason = "a site spans few cells")]
    let below = toward_zero - i64::from(x < toward_zero as f64);
    #[expect(clippy::cast_precision_loss, reason = "a site spans few cells")]
    let (s, slope) = quintic(x - below as f64);
    (below, s, slope)
}

#[expect(clippy::cast_sign_loss, reason = "the bits alone matter")]
fn mixed(line: i64, factor: u64) -> u64 {
    (line as u64).wrapping_mul(factor)
}

/// The value at a lattice point, -1 to 1: one round of mixing, for there are many.
fn corner(bits: u64) -> f64 {
    let z = (bits ^ (bits >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    let z = (z ^ (z >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    2.0 * share(z ^ (z >> 32), 0) - 1.0
}

fn quintic(t: f64) -> (f64, f64) {
    let s = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let slope = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    (s, slope)
}

/// A smooth random surface: three octaves of value noise, the finer ones a quarter of the variance
/// of the next coarser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothSurface {
    key: u64,
    amplitude_m: f64,
    length_m: f64,
}

const OCTAVES: [(f64, f64); 3] = [(1.0, 1.0), (2.1, 0.5), (4.3, 0.25)];

impl SmoothSurface {
    /// A surface of root mean square `rms_m` whose coarsest lattice has spacing `length_m`.
    pub(super) fn new(key: u64, rms_m: f64, length_m: f64) -> Self {
        let squares: f64 = OCTAVES.iter().map(|(_, a)| a * a).sum();
        // Uniform between -1 and 1: variance 1/3.
        let rms_of_unit = (squares * MEAN_SQUARE / 3.0).sqrt();
        Self {
            key,
            amplitude_m: rms_m / rms_of_unit,
            length_m,
        }
    }

    /// Height, metres, and its slope by east and north.
    pub fn at(&self, east_m: f64, north_m: f64) -> (f64, [f64; 2]) {
        let (mut height, mut slope) = (0.0, [0.0; 2]);
        if self.amplitude_m == 0.0 {
            return (height, slope);
        }
        for (octave, (frequency, amplitude)) in (0u64..).zip(OCTAVES) {
            let f = frequency / self.length_m;
            let (h, s) = value_noise(self.key.wrapping_add(octave), east_m * f, north_m * f);
            height += self.amplitude_m * amplitude * h;
            slope[0] += self.amplitude_m * amplitude * s[0] * f;
            slope[1] += self.amplitude_m * amplitude * s[1] * f;
        }
        (height, slope)
    }

    /// The height of [`SmoothSurface::at`] alone, metres.
    pub(super) fn height_m(&self, east_m: f64, north_m: f64) -> f64 {
        if self.amplitude_m == 0.0 {
            return 0.0;
        }
        let octaves = (0u64..).zip(OCTAVES);
        octaves.fold(0.0, |height, (octave, (frequency, amplitude))| {
            let f = frequency / self.length_m;
            let h = value(self.key.wrapping_add(octave), east_m * f, north_m * f);
            height + self.amplitude_m * amplitude * h
        })
    }

    /// No height is farther from zero than this, metres.
    pub(super) fn bound_m(&self) -> f64 {
        self.amplitude_m * OCTAVES.iter().map(|(_, a)| a).sum::<f64>()
    }

    /// No slope is steeper than this: the quintic rises by at most 15/8 a cell.
    pub(super) fn slope_bound(&self) -> f64 {
        let steepest: f64 = OCTAVES.iter().map(|(f, a)| f * a).sum();
        // Both axes at their steepest: 2 (the range of values) times 15/8 times sqrt 2.
        self.amplitude_m * steepest / self.length_m * 2.0 * 1.875 * std::f64::consts::SQRT_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_mean_square_is_as_asked_and_bounds_hold() {
        let surface = SmoothSurface::new(3, 0.2, 5.0);
        let mut square = 0.0;
        for i in 0..400 {
            for j in 0..400 {
                let (h, slope) = surface.at(f64::from(i) * 1.37, f64::from(j) * 1.31);
                square += h * h / 160_000.0;
                assert!(
                    (h - surface.height_m(f64::from(i) * 1.37, f64::from(j) * 1.31)).abs() < 1e-15
                );
                assert!(h.abs() <= surface.bound_m());
                assert!(slope[0].hypot(slope[1]) <= surface.slope_bound());
            }
        }
        // About 109 x 105 independent coarse cells: the mean square is good to 2 %.
        assert!(
            (square.sqrt() / 0.2 - 1.0).abs() < 0.04,
            "{}",
            square.sqrt()
        );
    }

    #[test]
    fn slope_is_the_derivative_of_height() {
        let surface = SmoothSurface::new(9, 0.3, 2.0);
        let step = 1e-6;
        for (x, y) in [(0.3, 0.4), (-7.2, 3.3), (15.01, -0.7)] {
            let slope = surface.at(x, y).1;
            let by_x = (surface.at(x + step, y).0 - surface.at(x - step, y).0) / (2.0 * step);
            let by_y = (surface.at(x, y + step).0 - surface.at(x, y - step).0) / (2.0 * step);
            assert!((slope[0] - by_x).abs() < 1e-8 && (slope[1] - by_y).abs() < 1e-8);
        }
    }
}
