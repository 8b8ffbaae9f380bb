//! The colour and the small relief of bare ground.

use nalgebra::Vector3;

use super::super::noise::value_noise;
use super::palette::{Colour, Colours, mix};

/// What a place of the ground looks like.
pub(super) struct Look {
    pub albedo: Colour,
    pub normal: Vector3<f64>,
}

/// Relief and grains: scale in metres, slope, depth of the change of brightness.
const RELIEF: [(f64, f64, f64); 6] = [
    (1.9, 0.035, 0.05),
    (0.62, 0.05, 0.08),
    (0.21, 0.07, 0.10),
    (0.075, 0.10, 0.12),
    (0.026, 0.16, 0.14),
    (0.009, 0.20, 0.16),
];

/// The look of a place whose large-scale slope is given. Detail finer than twice `sharpness_m` fades
/// away rather than flicker.
pub(super) fn at(
    key: u64,
    colours: &Colours,
    [x, y]: [f64; 2],
    slope: [f64; 2],
    sharpness_m: f64,
) -> Look {
    let noise = |layer: u64, scale: f64| value_noise(key.wrapping_add(layer), x / scale, y / scale);
    let mut gradient = [-slope[0], -slope[1]];
    let mut brightness = 1.0;
    for (layer, (scale, steep, depth)) in (100u64..).zip(RELIEF) {
        let shown = fade(scale, sharpness_m);
        if shown > 0.0 {
            let (height, by) = noise(layer, scale);
            gradient[0] -= by[0] * steep * shown;
            gradient[1] -= by[1] * steep * shown;
            brightness += depth * shown * height;
        }
    }
    // Drifts of dust between pavements of gravel, and dark stains.
    let drift = noise(300, 5.5).0 * 0.6 + noise(301, 1.4).0 * 0.4;
    let stain = noise(302, 2.7).0 * 0.55 + noise(303, 0.9).0 * 0.45;
    let albedo = mix(colours.gravel, colours.dust, 0.5 + 1.1 * drift);
    let albedo = mix(albedo, colours.stain, 0.9 * (stain - 0.15).max(0.0));
    Look {
        albedo: albedo * brightness,
        normal: Vector3::new(gradient[0], gradient[1], 1.0).normalize(),
    }
}

/// 1 where a scale spans four pixels and more, 0 where it spans one and less.
fn fade(scale_m: f64, sharpness_m: f64) -> f64 {
    ((scale_m / sharpness_m - 1.0) / 3.0).clamp(0.0, 1.0)
}
