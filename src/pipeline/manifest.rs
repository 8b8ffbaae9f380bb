//! run.json and timing.json: what a run was made from, and what it took.

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::config::Config;
use super::digest::hexadecimal;
use super::read::Inputs;
use super::summary::{Stage, Summary};
use crate::frame::VerticalDatum;
use crate::fuse::Fusion;

/// The program's version, part of what a run is.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Names a run by what it is made from: command, version, configuration and content of the inputs.
pub(super) fn run_id(command: &str, config: &Config, inputs: &Inputs) -> String {
    let identity = json!({
        "command": command,
        "version": VERSION,
        "config": config,
        "inputs": inputs.files,
        "pictures": inputs.pictures,
    });
    let digest = Sha256::digest(identity.to_string());
    hexadecimal(&digest)[..16].to_owned()
}

/// run.json.
pub(super) fn run_json(
    config: &Config,
    inputs: &Inputs,
    fusion: Option<&Fusion>,
    run_id: &str,
    summary: &Summary,
    outputs: &[String],
) -> Value {
    let origin = inputs.site.origin();
    let (lat_deg, lon_deg) = inputs.site.planet().lat_lon_deg(origin);
    let datum = inputs.datum.as_ref();
    json!({
        "run_id": run_id,
        "program": "rockmap",
        "version": VERSION,
        "site": {
            "body": inputs.site.planet().name,
            "crs": inputs.site.planet().crs,
            "origin": {
                "lat_deg": lat_deg,
                "lon_deg": lon_deg,
                "height_m": origin.height_m,
            },
            "heights": datum.map_or("ellipsoid", VerticalDatum::name),
        },
        "config": config,
        "inputs": inputs.files,
        "pictures": inputs.pictures,
        "counts": {
            "files": summary.files,
            "rejected": summary.rejected(),
            "views": summary.n_views,
            "detections_placed": summary.n_placed,
            "objects": summary.n_objects,
            "pictures_annotated": summary.n_annotated,
        },
        "outputs": outputs,
        "warnings": summary.warnings,
        "solver": fusion.map(solver),
    })
}

/// timing.json.
pub(super) fn timing_json(stages: &[Stage], threads: usize) -> String {
    pretty(&json!({ "threads": threads, "stages": stages }))
}

/// A JSON file.
pub(super) fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

/// How fusing went.
fn solver(fusion: &Fusion) -> serde_json::Value {
    match &fusion.belief {
        Some(belief) => json!([belief]),
        None => json!(fusion.solver),
    }
}
