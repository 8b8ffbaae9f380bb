//! From light to 8 bits: lens blur and fall-off, exposure, tone curve, the sensor's noise.

use image::{Rgb, RgbImage};
use rayon::prelude::*;

use super::super::random::{lattice, share};
use super::palette::Colour;

/// What a grey of middle reflectance in the sun is exposed to.
const EXPOSURE: f64 = 1.55;

/// How dark the corners are.
const FALL_OFF: f64 = 0.22;

pub(super) fn develop(rows: &[Vec<Colour>], noise: f64, key: u64) -> RgbImage {
    let height = rows.len();
    let width = rows.first().map_or(0, Vec::len);
    let developed: Vec<Vec<u8>> = (0..height)
        .into_par_iter()
        .map(|v| {
            (0..width)
                .flat_map(|u| pixel(rows, u, v, noise, key))
                .collect()
        })
        .collect();
    let size = |n: usize| u32::try_from(n).unwrap_or(0);
    let mut bytes = developed.into_iter().flatten();
    RgbImage::from_fn(size(width), size(height), |_, _| {
        Rgb(std::array::from_fn(|_| bytes.next().unwrap_or(0)))
    })
}

fn pixel(rows: &[Vec<Colour>], u: usize, v: usize, noise: f64, key: u64) -> [u8; 3] {
    let light = blurred(rows, u, v) * (EXPOSURE * fall_off(rows, u, v));
    let signed = |n: usize| i64::try_from(n).unwrap_or(0);
    std::array::from_fn(|channel| {
        let bits = lattice(key.wrapping_add(channel as u64), signed(u), signed(v));
        // Three uniform numbers make a fair normal one: their sum has variance 1/4.
        let normal = 2.0 * (share(bits, 0) + share(bits, 1) + share(bits, 2) - 1.5);
        let grey = 255.0 * encoded(tone(light[channel]));
        // Shot noise grows with the light.
        let sigma = noise * (0.6 + 0.4 * (grey / 128.0).sqrt());
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped"
        )]
        let byte = (grey + sigma * normal).round().clamp(0.0, 255.0) as u8;
        byte
    })
}

/// A lens's blur of a third of a pixel or so, symmetric, so that nothing moves.
fn blurred(rows: &[Vec<Colour>], u: usize, v: usize) -> Colour {
    const WEIGHTS: [f64; 3] = [0.09, 0.82, 0.09];
    let (last_v, last_u) = (rows.len() - 1, rows[v].len() - 1);
    let mut sum = Colour::zeros();
    for (i, wv) in WEIGHTS.iter().enumerate() {
        let row = &rows[(v + i).saturating_sub(1).min(last_v)];
        for (j, wu) in WEIGHTS.iter().enumerate() {
            sum += row[(u + j).saturating_sub(1).min(last_u)] * (wv * wu);
        }
    }
    sum
}

fn fall_off(rows: &[Vec<Colour>], u: usize, v: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "pictures have few columns")]
    let centred = |i: usize, n: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
    let (x, y) = (centred(u, rows[v].len()), centred(v, rows.len()));
    1.0 - FALL_OFF * 0.5 * (x * x + y * y)
}

/// A shoulder that keeps bright ground from burning out.
fn tone(light: f64) -> f64 {
    let light = light.max(0.0);
    light * (1.0 + light / 4.0) / (1.0 + light)
}

/// The sRGB transfer function (IEC 61966-2-1).
fn encoded(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}
