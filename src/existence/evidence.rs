//! The evidence that an object is real (3.5).

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::size::log_width;
use super::{Belief, Model, Pairs, Prior};
use crate::adjust::{Measurement, Problem, Reading};

/// Detection probabilities below this are taken for it where there was a detection.
const LEAST_DETECTION: f64 = 0.02;
/// Information that keeps an object without any from breaking the determinant, 1/m^2.
const FAINT: f64 = 1e-9;

/// The probability of log-odds.
pub fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds.clamp(-30.0, 30.0)).exp())
}

/// Logarithm of the intensity of clutter at a measurement: `ln(lambda N(l; m_c, v_c))`, a unit of
/// the reading (px^2, rad m) and of the logarithm of size, where it has one.
pub fn clutter_log_intensity(
    problem: &Problem<'_>,
    measurement: &Measurement,
    model: &Model,
) -> f64 {
    let size = measurement
        .log_size
        .map_or(0.0, |l| model.clutter_size.log_density(l, 0.0));
    (model.clutter_per_view / volume(problem, measurement)).ln() + size
}

/// The space that readings of a view come from: px^2, px^2 m or rad m.
fn volume(problem: &Problem<'_>, measurement: &Measurement) -> f64 {
    let ranges_m = (problem.limit_m() - problem.min_range_m).max(1e-3);
    let camera = problem.views[measurement.view].camera.as_deref();
    let picture = camera.map_or(1.0, |c| f64::from(c.width) * f64::from(c.height));
    match measurement.reading {
        Reading::Pixel { range: None, .. } => picture,
        Reading::Pixel { range: Some(_), .. } => picture * ranges_m,
        Reading::Bearing { .. } => 2.0 * PI * ranges_m,
    }
}

/// Log-odds that each object exists:
///
/// `L_k = ln rho + E_k + sum over views of (q ln p + (1 - q) ln(1 - p))` with
/// `E_k = sum over edges of P (-1/2 e^T R^-1 e - 1/2 ln |2 pi R| - ln c) + 1/2 ln |2 pi C|` and the
/// evidence of the sizes, R the noise of the reading and of the pose, c the intensity of clutter
/// (one a measurement, as [`clutter_log_intensity`]). For one measurement this is the exact odds of
/// an object against clutter. Where heights are free their prior is part of `E_k`.
pub fn log_odds(
    belief: &Belief<'_>,
    pairs: &Pairs,
    detected: &[f64],
    clutter: &[f64],
    prior: &Prior,
) -> Vec<f64> {
    let mut odds = seen(belief, clutter, prior);
    for (pair, q) in pairs.pairs.iter().zip(detected) {
        odds[pair.point] += q * pair.p_detect.max(LEAST_DETECTION).ln();
        odds[pair.point] += (1.0 - q) * (-pair.p_detect).ln_1p();
    }
    let density = belief.model.density_per_m2.ln();
    odds.iter_mut().for_each(|l| *l += density);
    odds
}

/// `E_k` of every object.
fn seen(belief: &Belief<'_>, clutter: &[f64], prior: &Prior) -> Vec<f64> {
    let Belief {
        adjustment, state, ..
    } = belief;
    let problem = &adjustment.problem;
    let ln_2pi = (2.0 * PI).ln();
    let mut information = vec![height_information(problem); state.points.len()];
    let mut evidence: Vec<f64> = state
        .points
        .iter()
        .map(|point| height_evidence(problem, point) + 0.5 * problem.n_unknowns() * ln_2pi)
        .collect();
    let mut sizes = vec![SizeEvidence::default(); state.points.len()];
    let predictions = adjustment.predictions(state);
    for (edge, prediction) in adjustment.edges.iter().zip(&predictions) {
        let Some(p) = prediction else { continue };
        let measurement = &problem.measurements[edge.measurement];
        let pose = &belief.conditional.poses[measurement.view];
        let spread = Matrix3::from_diagonal(&adjustment.row_variance(edge))
            + p.by_pose * pose * p.by_pose.transpose();
        let Some(cholesky) = spread.cholesky() else {
            continue;
        };
        let inverse = cholesky.inverse();
        let rows = f64::from(u8::try_from(measurement.reading.n_rows()).unwrap_or(3));
        let ln_density = -0.5 * (p.residual.transpose() * inverse * p.residual)[0]
            - 0.5 * rows * ln_2pi
            - 0.5 * cholesky.ln_determinant();
        evidence[edge.point] += edge.weight * (ln_density - clutter[edge.measurement]);
        information[edge.point] += p.by_point.transpose() * inverse * p.by_point * edge.weight;
        if let Some(width) = log_width(measurement.log_size, Some(p)) {
            sizes[edge.point].add(width, edge.weight);
        }
    }
    for ((evidence, information), size) in evidence.iter_mut().zip(&information).zip(&sizes) {
        *evidence -= 0.5 * information.determinant().max(f64::MIN_POSITIVE).ln();
        *evidence += size.log_evidence(belief.model, prior);
    }
    evidence
}

/// What is known of a place before any measurement; a pinned height drops out of determinants.
fn height_information(problem: &Problem<'_>) -> Matrix3<f64> {
    let height = if problem.is_pinned() {
        1.0
    } else {
        problem.height_sigma_m.powi(-2)
    };
    Matrix3::from_diagonal(&Vector3::new(FAINT, FAINT, height))
}

fn height_evidence(problem: &Problem<'_>, point: &Vector3<f64>) -> f64 {
    if problem.is_pinned() {
        return 0.0;
    }
    let variance = problem.height_sigma_m.powi(2);
    -0.5 * (2.0 * PI * variance).ln() - 0.5 * point.z * point.z / variance
}

/// Moments of the widths that measurements give an object.
#[derive(Debug, Clone, Copy, Default)]
struct SizeEvidence {
    n: f64,
    sum: f64,
    squares: f64,
}

impl SizeEvidence {
    fn add(&mut self, log_width: f64, weight: f64) {
        self.n += weight;
        self.sum += weight * log_width;
        self.squares += weight * log_width * log_width;
    }

    /// `-(n/2) ln 2 pi s^2 + 1/2 ln(s^2 / (s^2 + n v)) - 1/2 (SS / s^2 + n (mean - m)^2 / (s^2 + n v))`:
    /// widths of one object whose own is normal with mean m and variance v.
    fn log_evidence(&self, model: &Model, prior: &Prior) -> f64 {
        if self.n <= 0.0 {
            return 0.0;
        }
        let variance = prior.log_size_sigma.powi(2);
        let total = variance + self.n * model.size.variance;
        let mean = self.sum / self.n;
        let scatter = (self.squares - self.n * mean * mean).max(0.0);
        let away = mean - model.size.mean;
        -0.5 * self.n * (2.0 * PI * variance).ln() + 0.5 * (variance / total).ln()
            - 0.5 * (scatter / variance + self.n * away * away / total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The evidence of widths is the density of a normal vector with covariance `s^2 I + v 1 1^T`.
    #[test]
    fn size_evidence_is_a_joint_normal_density() {
        let (prior, model) = (Prior::default(), Model::new(&Prior::default()));
        let widths = [-1.6, -1.8, -1.55];
        let mut evidence = SizeEvidence::default();
        widths.iter().for_each(|w| evidence.add(*w, 1.0));
        let variance = prior.log_size_sigma.powi(2);
        let covariance =
            Matrix3::identity() * variance + Matrix3::from_element(model.size.variance);
        let away = Vector3::from(widths).add_scalar(-model.size.mean);
        let expected = -0.5 * (away.transpose() * covariance.try_inverse().unwrap() * away)[0]
            - 0.5 * ((2.0 * PI).powi(3) * covariance.determinant()).ln();
        assert!((evidence.log_evidence(&model, &prior) - expected).abs() < 1e-12);
        assert_eq!(SizeEvidence::default().log_evidence(&model, &prior), 0.0);
    }

    #[test]
    fn odds_are_clipped_before_they_overflow() {
        assert_eq!(probability(0.0), 0.5);
        assert!((probability(2.0) - 0.880_797_077_977_882_3).abs() < 1e-15);
        assert!(probability(-1e300) > 0.0 && probability(f64::MAX) < 1.0);
    }
}
