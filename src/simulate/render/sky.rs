//! The sky, and the hills before it.

use nalgebra::Vector3;

use super::super::noise::value_noise;
use super::palette::{Colour, Colours, mix};
use super::studio::Surface;

/// What a ray sees that meets no ground.
pub(super) fn sky(colours: &Colours, key: u64, direction: Vector3<f64>) -> (Colour, Surface) {
    let azimuth = direction.y.atan2(direction.x);
    let elevation = direction.z.clamp(-1.0, 1.0).asin();
    for (range, (rise, share)) in (0u64..).zip([(0.016, 0.55), (0.026, 0.80)]) {
        if elevation < rise * ridge(key.wrapping_add(400 + range), azimuth) {
            let hill = colours
                .stain
                .component_mul(&(colours.sun * 0.45 + colours.sky * 0.5));
            return (mix(hill, haze(colours, direction), share), Surface::Hill);
        }
    }
    (haze(colours, direction), Surface::Sky)
}

/// The sky's colour in a direction.
pub(super) fn haze(colours: &Colours, direction: Vector3<f64>) -> Colour {
    let height = direction.z.max(0.0);
    mix(colours.horizon, colours.zenith, 1.0 - (-4.0 * height).exp())
}

/// The height of a ridge, 0 to 1, by azimuth.
fn ridge(key: u64, azimuth: f64) -> f64 {
    let octaves = [(3.0, 0.5), (9.0, 0.28), (31.0, 0.15), (97.0, 0.07)];
    let sum: f64 = octaves
        .iter()
        .map(|&(frequency, amplitude)| amplitude * value_noise(key, azimuth * frequency, 0.5).0)
        .sum();
    0.5 + 0.5 * sum
}
