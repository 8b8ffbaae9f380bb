//! A map against the truth: what was found, what was missed, what was made up, and how well the
//! map knows its own errors.
//!
//! [`evaluate`] reads the files and compares them; [`Comparison`] says what became of every object;
//! [`Report`] holds the scores, and shows as an aligned table; [`picture`] draws the comparison as
//! SVG. Every score is defined where it is computed, and for users in `docs/src/evaluate.md`.
//!
//! Of the mapped objects those count whose `p_exist` is at least the least existence (an object
//! without one counts), and of the true objects those in enough detections. The two are matched
//! optimally within a radius. A mapped object that is matched to nothing is not counted where it
//! lies within the radius of an ignored place, or of a true object in too few detections: it is
//! neither right nor wrong.

mod association;
mod comparison;
mod consistency;
mod map;
mod picture;
mod report;
mod score;
mod truth;

pub use crate::matching::{Pair, assign};
pub use association::{Association, associate};
pub use comparison::{
    ComparedEstimate, ComparedTruth, Comparison, EstimateOutcome, Match, TruthOutcome,
};
pub(crate) use comparison::{agree, at_height, spread};
pub use consistency::{Consistency, Existence, ReliabilityBin};
pub use map::{Estimate, RockMap, map_from_bytes, read_map};
pub use picture::picture;
pub use report::{Counts, Report};
pub use score::{ClassScore, Detection, Gospa};
pub use truth::{
    DetectionKey, Evidence, IgnoredPlace, Labels, Membership, TrueObject, read_evidence,
    read_ignored, read_labels, read_truth,
};

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::{Domain, Error};
use crate::frame::{Geodetic, Planet};

/// What counts, and how far is too far.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// Distance within which a mapped and a true object may be the same, metres.
    pub radius_m: f64,
    /// The cut-off c of GOSPA and OSPA, metres.
    pub cutoff_m: f64,
    /// True objects in fewer detections are not expected in the map.
    pub min_detections: u32,
    /// Mapped objects whose existence is less probable are not counted.
    pub min_exist: f64,
    /// Whether objects match only within their class.
    pub by_class: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            radius_m: 0.3,
            cutoff_m: 0.5,
            min_detections: 1,
            min_exist: 0.5,
            by_class: false,
        }
    }
}

impl Options {
    /// Checks that every number lies in its domain.
    ///
    /// # Errors
    /// Every option that does not, named as on the command line.
    pub fn check(&self) -> Result<(), Error> {
        Error::check_options(&[
            ("--radius", self.radius_m, Domain::AboveZero),
            ("--cutoff", self.cutoff_m, Domain::AboveZero),
            ("--min-exist", self.min_exist, Domain::Share),
        ])
    }
}

/// The files of an evaluation.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The map, GeoJSON.
    pub map: PathBuf,
    /// truth.csv.
    pub truth: PathBuf,
    /// ignore.csv, if any.
    pub ignore: Option<PathBuf>,
    /// labels.csv, if associations are to be scored.
    pub labels: Option<PathBuf>,
    /// evidence.csv; where labels are given and this is not, the one beside the map.
    pub evidence: Option<PathBuf>,
}

/// What is known of the truth.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    /// The true objects.
    pub objects: Vec<TrueObject>,
    /// Places where a mapped object is neither right nor wrong.
    pub ignored: Vec<IgnoredPlace>,
}

impl Truth {
    /// With latitudes and longitudes understood as the planet's files have them.
    fn on(mut self, planet: Planet) -> Self {
        let read = |p: Geodetic| planet.place(p.lat.to_degrees(), p.lon.to_degrees(), p.height_m);
        if !planet.is_plain() {
            for object in &mut self.objects {
                object.place = read(object.place);
            }
            for ignored in &mut self.ignored {
                ignored.place = read(ignored.place);
            }
        }
        self
    }
}

/// A map held against the truth.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// The truth it was held against.
    pub truth: Truth,
    /// What became of every object.
    pub comparison: Comparison,
    /// The scores.
    pub report: Report,
}

/// Reads a map and the truth, compares them and scores the map. Faults call the files by their
/// paths as given.
///
/// # Errors
/// Faults in the files or options, and those of [`Comparison::new`].
pub fn evaluate(sources: &Sources, options: &Options) -> Result<Evaluation, Error> {
    options.check()?;
    let map = read_map(&sources.map, &shown(&sources.map))?;
    let objects = read_truth(&sources.truth, &shown(&sources.truth))?;
    let ignored = match &sources.ignore {
        Some(path) => read_ignored(path, &shown(path))?,
        None => Vec::new(),
    };
    let truth = Truth { objects, ignored }.on(map.planet);
    let comparison = Comparison::new(&map, &truth, options)?;
    let mut report = Report::new(&comparison);
    if let Some(path) = &sources.labels {
        let labels = read_labels(path, &shown(path))?;
        let beside = || sources.map.with_file_name("evidence.csv");
        let evidence = sources.evidence.clone().unwrap_or_else(beside);
        let evidence = read_evidence(&evidence, &shown(&evidence))?;
        report.set_association(associate(&comparison, &labels, &evidence)?);
    }
    Ok(Evaluation {
        truth,
        comparison,
        report,
    })
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}
