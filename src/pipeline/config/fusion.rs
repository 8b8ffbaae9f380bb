//! `[fusion]`: the method.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{POSITIVE, not_negative, positive};
use crate::fuse::belief::{PoseCorrection, SizeRule};
use crate::input::Section;

/// `[fusion]`: the method.
#[derive(Debug, Clone, Serialize)]
pub struct FusionConfig {
    /// The method.
    pub method: Method,
    /// `em`, `paper`: the one width of the Gaussians, metres.
    pub width_m: f64,
    /// `em`, `paper`: clusters of no more total membership are not reported.
    pub min_weight: f64,
    /// `belief`: how poses are corrected.
    pub pose_correction: PoseCorrection,
    /// `belief`: whether the detector's scores count.
    pub scores: bool,
    /// `belief`: the share of the variance of pose errors that drifts.
    pub drift_share: f64,
    /// `belief`: the way over which it drifts, metres.
    pub drift_length_m: f64,
    /// `belief`: which side of a box says how large an object is.
    pub size_from: SizeRule,
    /// `belief`: standard deviation of the logarithm of an apparent size.
    pub log_size_sigma: f64,
    /// `belief`: where on an object a box sits, as a share of its size.
    pub shape: f64,
    /// `belief`: how far an object's middle lies behind its marked face, metres.
    pub radius_m: f64,
    /// `belief`: mean and standard deviation of the objects' sizes, metres.
    pub size_m: Option<(f64, f64)>,
    /// `belief`: which classes the detector takes for which: for each true class the classes it says,
    /// with their probabilities.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub confusion: BTreeMap<String, BTreeMap<String, f64>>,
    /// `belief`: errors of looks at one object fade in this time, seconds.
    pub geometry_time_s: f64,
    /// `belief`: whether an object is detected depends on the last look for this time, seconds.
    pub event_time_s: f64,
}

/// A fusion method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Standard EM, without any view constraint.
    Em,
    /// Multiple-view EM (Thompson & Wettergreen 2005).
    Paper,
    /// Exclusive association by belief propagation, with evidence for and against every object and
    /// correction of the poses.
    Belief,
}

impl Method {
    /// All methods there are.
    pub const ALL: [Self; 3] = [Self::Em, Self::Paper, Self::Belief];

    /// Its name in pipeline files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Em => "em",
            Self::Paper => "paper",
            Self::Belief => "belief",
        }
    }
}

pub(super) fn fusion(section: Section<'_>) -> Option<FusionConfig> {
    let method = match section
        .word("method", &["em", "paper", "belief"])
        .as_deref()
    {
        Some("em") => Some(Method::Em),
        Some("paper") => Some(Method::Paper),
        _ => Some(Method::Belief),
    };
    let words = ["off", "per-view", "drift"];
    let config = method.map(|method: Method| FusionConfig {
        method,
        width_m: positive(&section, "width_m", 0.2),
        min_weight: not_negative(&section, "min_weight", 1.5),
        pose_correction: match section.word("pose_correction", &words).as_deref() {
            Some("off") => PoseCorrection::Off,
            Some("drift") => PoseCorrection::Drift,
            _ => PoseCorrection::PerView,
        },
        scores: section.boolean("scores").unwrap_or(true),
        drift_share: section
            .number("drift_share", 0.0..=1.0, "0 to 1")
            .unwrap_or(0.8),
        drift_length_m: positive(&section, "drift_length_m", 16.0),
        size_from: match section.word("size_from", &["width", "height"]).as_deref() {
            Some("height") => SizeRule::Height,
            _ => SizeRule::Width,
        },
        log_size_sigma: positive(&section, "log_size_sigma", 0.15),
        shape: not_negative(&section, "shape", 0.0),
        radius_m: not_negative(&section, "radius_m", 0.0),
        size_m: size_m(&section),
        confusion: confusion(&section),
        geometry_time_s: positive(&section, "geometry_time_s", 1.5),
        event_time_s: positive(&section, "event_time_s", 0.5),
    });
    section.finish();
    config
}

/// The sizes of the objects, where the run knows them: their standard deviation is a tenth of the
/// mean unless it is stated.
fn size_m(section: &Section<'_>) -> Option<(f64, f64)> {
    let mean = section.number("size_m", f64::MIN_POSITIVE.., POSITIVE);
    let sigma = section.number("size_sigma_m", f64::MIN_POSITIVE.., POSITIVE);
    if let (None, Some(sigma)) = (mean, sigma) {
        let expected = "no such key without size_m, the mean that it is about";
        section.fault("size_sigma_m", sigma, expected);
    }
    mean.map(|mean| (mean, sigma.unwrap_or(0.1 * mean)))
}

/// Probabilities add up to one this closely.
const SUM: f64 = 1e-3;

/// Which classes the detector takes for which; a class without a line is never taken for another.
fn confusion(section: &Section<'_>) -> BTreeMap<String, BTreeMap<String, f64>> {
    let table = section.section("confusion");
    let mut all = BTreeMap::new();
    for (class, row) in table.sections() {
        let said = row.keys();
        let probabilities: BTreeMap<String, f64> = said
            .into_iter()
            .filter_map(|said| {
                let p = row.number(&said, 0.0..=1.0, "0 to 1")?;
                Some((said, p))
            })
            .collect();
        let sum: f64 = probabilities.values().sum();
        if probabilities.len() == row.keys().len() && (sum - 1.0).abs() > SUM {
            let found = format!("probabilities that add up to {sum:.3}");
            table.fault(&class, found, "1, the sum over what the detector may say");
        }
        row.finish();
        all.insert(class, probabilities);
    }
    table.finish();
    all
}
