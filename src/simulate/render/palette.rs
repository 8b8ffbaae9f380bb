//! The colours of a place, as linear reflectances and radiances.

use nalgebra::Vector3;

use super::super::scene::Palette;

/// Linear red, green and blue.
pub(super) type Colour = Vector3<f64>;

/// The colours of ground, rocks, light and sky.
#[derive(Debug, Clone, Copy)]
pub(super) struct Colours {
    /// Loose dust, which also lies on the rocks.
    pub dust: Colour,
    /// Gravelly ground.
    pub gravel: Colour,
    /// Dark stain of the ground.
    pub stain: Colour,
    /// The darkest rocks.
    pub rock_dark: Colour,
    /// The palest rocks.
    pub rock_pale: Colour,
    /// Sunlight on a surface that faces it.
    pub sun: Colour,
    /// Light of the whole sky on level ground.
    pub sky: Colour,
    /// The sky overhead, as the camera sees it.
    pub zenith: Colour,
    /// The sky at the horizon.
    pub horizon: Colour,
    /// The distance over which the air swallows two thirds of what lies behind, metres.
    pub haze_m: f64,
}

pub(super) fn colours(palette: Palette) -> Colours {
    let c = Colour::new;
    match palette {
        Palette::Desert => Colours {
            dust: c(0.46, 0.335, 0.225),
            gravel: c(0.35, 0.25, 0.17),
            stain: c(0.235, 0.165, 0.115),
            rock_dark: c(0.115, 0.09, 0.075),
            rock_pale: c(0.36, 0.27, 0.205),
            sun: c(2.15, 1.95, 1.65),
            sky: c(0.24, 0.29, 0.38),
            zenith: c(0.16, 0.33, 0.70),
            horizon: c(0.72, 0.76, 0.80),
            haze_m: 5000.0,
        },
        Palette::Mars => Colours {
            dust: c(0.43, 0.225, 0.105),
            gravel: c(0.32, 0.165, 0.085),
            stain: c(0.19, 0.11, 0.07),
            rock_dark: c(0.085, 0.072, 0.066),
            rock_pale: c(0.235, 0.165, 0.125),
            sun: c(1.75, 1.6, 1.4),
            sky: c(0.48, 0.38, 0.28),
            zenith: c(0.52, 0.38, 0.25),
            horizon: c(0.78, 0.60, 0.42),
            haze_m: 2500.0,
        },
        Palette::Moon => Colours {
            dust: c(0.20, 0.195, 0.185),
            gravel: c(0.165, 0.16, 0.155),
            stain: c(0.12, 0.118, 0.115),
            rock_dark: c(0.13, 0.13, 0.128),
            rock_pale: c(0.33, 0.325, 0.315),
            sun: c(3.2, 3.15, 3.1),
            sky: c(0.03, 0.03, 0.03),
            zenith: c(0.0, 0.0, 0.0),
            horizon: c(0.0, 0.0, 0.0),
            haze_m: 1e12,
        },
    }
}

/// From `a` to `b` by a share from 0 to 1.
pub(super) fn mix(a: Colour, b: Colour, share: f64) -> Colour {
    a + (b - a) * share.clamp(0.0, 1.0)
}
