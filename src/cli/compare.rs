//! `rockmap compare`.

use std::path::PathBuf;
use std::process::ExitCode;

use super::console::print_json;
use super::tell;
use crate::compare::{self, Epoch, Options};
use crate::error::Error;

const EXAMPLES: &str = "Examples:
  rockmap compare maps/night-1 maps/night-2 --out changes
  rockmap compare maps/night-1 maps/night-2 --out changes --align 2 --sigma 0.05
  rockmap compare em/rocks.geojson paper/rocks.geojson --out methods --sigma 0.01 --json";

/// What `rockmap compare` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// The earlier map: the folder of a run, a GeoJSON file of points or a GeoPackage
    #[arg(value_name = "A")]
    before: PathBuf,
    /// The later map, likewise
    #[arg(value_name = "B")]
    after: PathBuf,
    /// The folder the comparison is written to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Uncertainty of the registration of one map with the other, one standard deviation, metres
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    sigma: f64,
    /// Share of the truly same objects that are to be recognised as the same
    #[arg(long, value_name = "P", default_value_t = 0.99)]
    confidence: f64,
    /// Distance within which an object may have moved, metres
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    radius: f64,
    /// Estimate a common shift between the maps of at most so many metres, and take it out
    #[arg(long, value_name = "M", num_args = 0..=1, default_missing_value = "2")]
    align: Option<f64>,
    /// Objects of less existence probability are neither new, gone nor moved
    #[arg(long, value_name = "P", default_value_t = 0.5)]
    min_exist: f64,
    /// Objects match only within their class
    #[arg(long)]
    by_class: bool,
    /// Replace the outputs of another comparison
    #[arg(long)]
    force: bool,
    /// Say nothing but errors
    #[arg(long, short)]
    quiet: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn compare(args: &Args) -> Result<ExitCode, Error> {
    let done = carry_out(args);
    if let (Err(error), true) = (&done, args.json) {
        print_json(&tell::json(error))?;
    }
    done
}

fn carry_out(args: &Args) -> Result<ExitCode, Error> {
    let options = Options {
        sigma_m: args.sigma,
        confidence: args.confidence,
        radius_m: args.radius,
        min_exist: args.min_exist,
        by_class: args.by_class,
        align_m: args.align,
    };
    options.check()?;
    let (before, after) = (Epoch::read(&args.before)?, Epoch::read(&args.after)?);
    let changes = compare::compare(&before, &after, &options)?;
    compare::write(&changes, &before, &after, &args.out, args.force)?;
    if args.json {
        print_json(&compare::summary(&changes, &before, &after))?;
    } else if !args.quiet {
        print!("{changes}");
    }
    Ok(ExitCode::SUCCESS)
}
