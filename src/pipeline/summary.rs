//! What a run says of itself at its end.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::config::Config;
use super::read::Inputs;
use crate::input::{Reason, Reject};

/// The end of a run.
#[derive(Debug, Clone)]
pub struct Summary {
    /// The run.
    pub run_id: Option<String>,
    /// Where its outputs are.
    pub folder: Option<PathBuf>,
    /// Every table that was read, with what became of its rows.
    pub files: Vec<FileCount>,
    /// Views of the run.
    pub n_views: usize,
    /// Detections with a place on the ground.
    pub n_placed: usize,
    /// Objects of the map; `None` where nothing was fused.
    pub n_objects: Option<usize>,
    /// Pictures annotated.
    pub n_annotated: usize,
    /// Those of them that an earlier run had drawn alike.
    pub n_carried: usize,
    /// Records set aside.
    pub rejects: Vec<Reject>,
    /// What was odd and did no harm.
    pub warnings: Vec<String>,
    /// Times.
    pub stages: Vec<Stage>,
    /// Whether more records were faulty than the run allows.
    pub too_many_rejects: bool,
}

/// What became of the rows of a file.
#[derive(Debug, Clone, Serialize)]
pub struct FileCount {
    /// What it was read as.
    pub kind: &'static str,
    /// As the run names it.
    pub file: String,
    /// Its rows.
    pub read: usize,
    /// Those that went into the result.
    pub used: usize,
    /// Those that did not, by reason.
    pub rejected: BTreeMap<Reason, usize>,
}

/// What a stage took.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// The stage.
    pub stage: &'static str,
    /// Its time.
    pub seconds: f64,
    /// The most memory the process had by its end, MiB, where the system tells.
    pub peak_memory_mb: Option<f64>,
}

impl Summary {
    /// The summary of inputs that were only read.
    pub(super) fn of_inputs(config: &Config, inputs: &Inputs) -> Self {
        Self::new(config, inputs, inputs.rejects.clone())
    }

    pub(super) fn new(config: &Config, inputs: &Inputs, mut rejects: Vec<Reject>) -> Self {
        sort(&mut rejects, inputs);
        let files = counts(inputs, &rejects);
        let read: usize = files.iter().map(|f| f.read).sum();
        let faulty = rejects.iter().filter(|r| r.reason.is_fault()).count();
        #[expect(clippy::cast_precision_loss, reason = "counts of records")]
        let too_many_rejects = faulty as f64 > config.input.max_reject_share * read as f64;
        Self {
            run_id: None,
            folder: None,
            files,
            n_views: inputs.views.len(),
            n_placed: 0,
            n_objects: None,
            n_annotated: 0,
            n_carried: 0,
            rejects,
            warnings: inputs.warnings.clone(),
            stages: Vec::new(),
            too_many_rejects,
        }
    }

    /// Records set aside, by reason.
    pub fn rejected(&self) -> BTreeMap<Reason, usize> {
        let mut by_reason = BTreeMap::new();
        for reject in &self.rejects {
            *by_reason.entry(reject.reason).or_insert(0) += 1;
        }
        by_reason
    }
}

/// In the order in which the run names its files, and by line.
fn sort(rejects: &mut [Reject], inputs: &Inputs) {
    let order = |file: &str| inputs.files.iter().position(|f| f.file == file);
    rejects.sort_by_cached_key(|r| (order(&r.file), r.line, r.record.clone()));
}

fn counts(inputs: &Inputs, rejects: &[Reject]) -> Vec<FileCount> {
    let tables = inputs.files.iter().filter_map(|f| Some((f, f.rows?)));
    tables
        .map(|(file, read)| {
            let mut rejected = BTreeMap::new();
            for reject in rejects.iter().filter(|r| r.file == file.file) {
                *rejected.entry(reject.reason).or_insert(0) += 1;
            }
            let lost: usize = rejected.values().sum();
            FileCount {
                kind: file.kind,
                file: file.file.clone(),
                read,
                used: read.saturating_sub(lost),
                rejected,
            }
        })
        .collect()
}
