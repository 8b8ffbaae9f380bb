//! `rockmap evaluate`.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::error::Error;
use crate::evaluate::{self, Options, Sources};

/// What `rockmap evaluate` takes.
#[derive(Debug, clap::Args)]
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
    /// Print the scores as JSON
    #[arg(long)]
    json: bool,
    /// Draw map against truth into this SVG file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
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
    if args.json {
        let json = serde_json::to_string_pretty(&evaluation.report)
            .map_err(|e| Error::Output(format!("cannot write the scores as JSON: {e}")))?;
        println!("{json}");
    } else {
        print!("{}", evaluation.report);
    }
    Ok(ExitCode::SUCCESS)
}
