//! The numbers that are learnt from the data, and what is believed of them before.

use std::f64::consts::PI;

use serde::Serialize;

use super::DetectionCurve;
use crate::adjust::Noise;

/// A normal distribution of logarithms of sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LogNormal {
    /// Mean of the natural logarithm.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
}

impl LogNormal {
    /// Logarithm of the density at a logarithm of size, with more variance added.
    pub fn log_density(&self, log_size: f64, more_variance: f64) -> f64 {
        let variance = self.variance + more_variance;
        let away = log_size - self.mean;
        -0.5 * away * away / variance - 0.5 * (2.0 * PI * variance).ln()
    }
}

/// What is believed before any data, and what is not learnt.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Standard deviation of pixels that the pairs are predicted with.
    pub pixel_px: f64,
    /// Expected clutter of a whole picture.
    pub clutter_per_view: f64,
    /// Objects a square metre.
    pub density_per_m2: f64,
    /// Widths of objects, metres.
    pub size: LogNormal,
    /// Apparent widths of clutter, pixels.
    pub clutter_size: LogNormal,
    /// Standard deviation of the logarithm of an apparent width.
    pub log_size_sigma: f64,
    /// How often objects are detected.
    pub curve: DetectionCurve,
}

impl Default for Prior {
    fn default() -> Self {
        Self {
            pixel_px: 1.5,
            clutter_per_view: 3.0,
            density_per_m2: 0.5,
            size: LogNormal {
                mean: 0.18f64.ln(),
                variance: 0.36,
            },
            clutter_size: LogNormal {
                mean: 30f64.ln(),
                variance: 0.25,
            },
            log_size_sigma: 0.15,
            curve: DetectionCurve::default(),
        }
    }
}

/// How much the views could have seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// Ground that at least one view could have seen, m^2.
    pub area_m2: f64,
    /// Of every view, the share of its picture that shows ground in the trusted ranges.
    pub shares: Vec<f64>,
}

/// What is learnt (3.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// How the noise differs from what the data state.
    pub noise: Noise,
    /// Expected clutter of a whole picture.
    pub clutter_per_view: f64,
    /// Objects a square metre.
    pub density_per_m2: f64,
    /// Widths of objects, metres.
    pub size: LogNormal,
    /// Apparent widths of clutter, pixels.
    pub clutter_size: LogNormal,
    /// How often objects are detected.
    pub curve: DetectionCurve,
}

impl Model {
    /// The model before any data.
    pub fn new(prior: &Prior) -> Self {
        Self {
            noise: Noise::default(),
            clutter_per_view: prior.clutter_per_view,
            density_per_m2: prior.density_per_m2,
            size: prior.size,
            clutter_size: prior.clutter_size,
            curve: prior.curve.clone(),
        }
    }
}
