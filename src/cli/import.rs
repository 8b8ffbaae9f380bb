//! `rockmap import`.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::error::{Error, Fault, Place};
use crate::frame::{Body, Enu, Rotation};
use crate::{camera, import};

const EXAMPLES: &str = "Examples:
  rockmap import calibration.yaml --to night            a calibration of ROS, Kalibr or OpenCV
  rockmap import sparse/cameras.txt sparse/images.txt --to night
  rockmap import labels/*.LBL --to sol-17 --force       pictures of a rover, with their poses";

/// What `rockmap import` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// Calibrations, reconstructions, labels or JSON of rover pictures
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The folder cameras.toml, images.csv and poses.csv are written to
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
    /// The rover's attitude for records without one: quaternion, scalar first, as NASA writes it
    #[arg(
        long,
        value_name = "W,X,Y,Z",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    attitude: Vec<f64>,
    /// Replace files that stand in the folder
    #[arg(long)]
    force: bool,
    /// Say nothing but errors and notes
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn import(args: &Args) -> Result<ExitCode, Error> {
    let imported = import::read(&args.files, attitude(&args.attitude)?)?;
    for note in &imported.notes {
        eprintln!("note: {note}");
    }
    let written = import::write(&imported, &args.to, args.force)?;
    if !args.quiet {
        println!(
            "{} cameras, {} pictures: {} written to {}",
            imported.cameras.len(),
            imported.images.len(),
            written.join(", "),
            args.to.display()
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn attitude(numbers: &[f64]) -> Result<Option<Rotation<Enu, Body>>, Error> {
    if numbers.is_empty() {
        return Ok(None);
    }
    let four = <[f64; 4]>::try_from(numbers).ok();
    let attitude = four.and_then(camera::attitude_of_ned);
    let fault = || {
        let found = format!("{numbers:?}");
        let place = Place::file("--attitude");
        Fault::found(place, "", found, "the four numbers of a unit quaternion")
    };
    attitude.map(Some).ok_or_else(|| fault().into())
}
