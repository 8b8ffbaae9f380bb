//! How large objects are.

use super::{Model, Prior};
use crate::adjust::{Adjustment, Prediction, State};

/// Sizes of all objects.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Natural logarithm of every object's width in metres.
    pub log_size: Vec<f64>,
    /// How many measurements of a size each rests on, by weight.
    pub support: Vec<f64>,
}

impl Sizes {
    /// The mean of what the measurements say and what is believed of all objects (3.4):
    /// `s = (sum P (l - ln f/z) + kappa m_s) / (n + kappa)`, `kappa = sigma_s^2 / v_s`.
    pub fn estimate(
        adjustment: &Adjustment<'_>,
        state: &State,
        model: &Model,
        prior: &Prior,
    ) -> Self {
        let predictions = adjustment.predictions(state);
        let mut sum = vec![0.0; state.points.len()];
        let mut support = vec![0.0; state.points.len()];
        for (edge, prediction) in adjustment.edges.iter().zip(&predictions) {
            let measured = adjustment.problem.measurements[edge.measurement].log_size;
            if let Some(log_width) = log_width(measured, prediction.as_ref()) {
                sum[edge.point] += edge.weight * log_width;
                support[edge.point] += edge.weight;
            }
        }
        let kappa = prior.log_size_sigma.powi(2) / model.size.variance;
        let log_size = sum
            .iter()
            .zip(&support)
            .map(|(sum, n)| (sum + kappa * model.size.mean) / (n + kappa))
            .collect();
        Self { log_size, support }
    }
}

/// Logarithm of the width in metres that an apparent width means at the object's depth.
pub(super) fn log_width(log_px: Option<f64>, prediction: Option<&Prediction>) -> Option<f64> {
    Some(log_px? - prediction?.scale_px_per_m?.ln())
}
