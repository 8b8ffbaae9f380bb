//! `rockmap evaluate`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::error::Error;
use crate::evaluate::{self, Comparison, Options, Report, Sources, Truth, associate, read_labels};
use crate::pipeline::{self, Bound, Config, Overrides, Silent};

const EXAMPLES: &str = "Examples:
  rockmap evaluate outputs/demo/rocks.geojson --truth outputs/demo-data/truth.csv
  rockmap evaluate map/rocks.geojson --truth truth.csv --ignore ignore.csv --radius 0.5 --by-class
  rockmap evaluate map/rocks.geojson --truth truth.csv --labels labels.csv --bound fair --json";

/// What `rockmap evaluate` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// The map, rocks.geojson
    #[arg(value_name = "MAP")]
    map: PathBuf,
    /// The true objects, truth.csv
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Places where an object is neither right nor wrong, ignore.csv
    #[arg(long, value_name = "FILE")]
    ignore: Option<PathBuf>,
    /// Which detection really is which object, labels.csv: scores the associations too
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// The map's evidence.csv, if it does not stand beside the map
    #[arg(long, value_name = "FILE")]
    evidence: Option<PathBuf>,
    /// Distance within which a mapped and a true object may be the same, metres
    #[arg(long, value_name = "M", default_value_t = 0.3)]
    radius: f64,
    /// Cut-off of GOSPA and OSPA, metres
    #[arg(long, value_name = "M", default_value_t = 0.5)]
    cutoff: f64,
    /// True objects in fewer detections are not expected in the map
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_detections: u32,
    /// Mapped objects of less existence probability are not counted
    #[arg(long, value_name = "P", default_value_t = 0.5)]
    min_exist: f64,
    /// Objects match only within their class
    #[arg(long)]
    by_class: bool,
    /// Score the best possible map of the same data too; may be given twice
    #[arg(long, value_name = "BOUND", requires = "labels")]
    bound: Vec<BoundName>,
    /// The pipeline file the bounds take data and noise from; default: pipeline.toml beside the labels
    #[arg(long, value_name = "PIPELINE.toml", requires = "bound")]
    pipeline: Option<PathBuf>,
    /// Take the bounds' input files from this folder instead of the pipeline's own
    #[arg(long, value_name = "DIR", requires = "bound")]
    data: Option<PathBuf>,
    /// Print the scores as JSON
    #[arg(long)]
    json: bool,
    /// Draw map against truth into this SVG file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// A bound, as it is typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum BoundName {
    /// All labels known: joint least squares of places and poses
    Clairvoyant,
    /// Known what belongs together; what is real is decided by the evidence
    Fair,
}

impl From<BoundName> for Bound {
    fn from(name: BoundName) -> Self {
        match name {
            BoundName::Clairvoyant => Self::Clairvoyant,
            BoundName::Fair => Self::Fair,
        }
    }
}

/// The report of a bound, scored as the map is.
fn report_of(
    bound: Bound,
    args: &Args,
    labels: &Path,
    truth: &Truth,
    options: &Options,
) -> Result<Report, Error> {
    let beside = || labels.with_file_name("pipeline.toml");
    let pipeline = args.pipeline.clone().unwrap_or_else(beside);
    let overrides = Overrides {
        data: args.data.clone(),
        ..Overrides::default()
    };
    let config = Config::read(&pipeline, &overrides)?;
    let bounded = pipeline::bound(&config, labels, &truth.objects, bound, &Silent)?;
    let comparison = Comparison::new(&bounded.map, truth, options)?;
    let labels = read_labels(labels, &labels.display().to_string())?;
    let mut report = Report::new(&comparison);
    report.set_association(associate(&comparison, &labels, &bounded.evidence)?);
    Ok(report)
}

pub(super) fn evaluate(args: &Args) -> Result<ExitCode, Error> {
    let sources = Sources {
        map: args.map.clone(),
        truth: args.truth.clone(),
        ignore: args.ignore.clone(),
        labels: args.labels.clone(),
        evidence: args.evidence.clone(),
    };
    let options = Options {
        radius_m: args.radius,
        cutoff_m: args.cutoff,
        min_detections: args.min_detections,
        min_exist: args.min_exist,
        by_class: args.by_class,
    };
    let evaluation = evaluate::evaluate(&sources, &options)?;
    if let Some(path) = &args.svg {
        let drawing = evaluate::picture(&evaluation, &args.map.display().to_string());
        std::fs::write(path, drawing).map_err(|e| Error::io(path, "write", e))?;
    }
    let mut bounds = Vec::new();
    for bound in args.bound.iter().map(|&name| Bound::from(name)) {
        let Some(labels) = &args.labels else {
            continue; // Asked for above: a bound requires them.
        };
        let report = report_of(bound, args, labels, &evaluation.truth, &options)?;
        bounds.push((bound.name(), report));
    }
    if args.json {
        println!("{}", json(&evaluation.report, &bounds)?);
    } else {
        print!("{}", evaluation.report);
        for (name, report) in &bounds {
            print!("\n{name} bound\n{report}");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The map's scores as an object, with those of the bounds in its `bounds`.
fn json(report: &Report, bounds: &[(&str, Report)]) -> Result<String, Error> {
    let failed = |e| Error::Output(format!("cannot write the scores as JSON: {e}"));
    let mut scores = serde_json::to_value(report).map_err(failed)?;
    if !bounds.is_empty() {
        let mut all = serde_json::Map::new();
        for (name, report) in bounds {
            let report = serde_json::to_value(report).map_err(failed)?;
            all.insert((*name).to_owned(), report);
        }
        scores["bounds"] = all.into();
    }
    serde_json::to_string_pretty(&scores).map_err(failed)
}
