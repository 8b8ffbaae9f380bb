//! The command line: what was typed, and how a run looks on a terminal. No logic of its own.

mod bench_accuracy;
mod camera;
mod check;
mod console;
mod evaluate;
mod import;
mod options;
mod reproduce;
mod simulate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::Error;
use crate::pipeline;

/// Maps of rocks from posed pictures: projects every detection onto the terrain, fuses all views
/// into one map, and draws the fused rocks back into every picture.
#[derive(Debug, Parser)]
#[command(name = "rockmap", version, about, max_term_width = 100, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  rockmap check pipelines/demo.toml              is everything there, and does it fit?
  rockmap run pipelines/demo.toml                make the map
  rockmap run night.toml --data /logs/sol-17 --out /maps/sol-17
  rockmap run night.toml --set view.max_range_m=20 --method em --force

Exit codes: 0 done, 1 done but more records were faulty than the run allows, 2 not done.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Read, project, fuse and publish: the whole job
    Run(options::JobArgs),
    /// The same up to the ground: every detection by itself, with footprints and rejects
    Project(options::JobArgs),
    /// Validate a pipeline and all its inputs, compute nothing, list all faults at once
    Check(check::Args),
    /// Make a data set with known truth from a scene file
    Simulate(simulate::Args),
    /// Hold a map against the truth: precision, recall, GOSPA, calibration
    Evaluate(evaluate::Args),
    /// Turn calibrations and rover labels of others into cameras.toml, images.csv and poses.csv
    Import(import::Args),
    /// Make the figures of Thompson and Wettergreen (2005) anew, with this program's numbers
    Reproduce(reproduce::Args),
    /// Compare methods over many scenes and seeds
    BenchAccuracy(bench_accuracy::Args),
    /// Ask a camera for the rays of pixels or the pixels of points
    Camera(camera::Args),
}

/// Does what the command line says and tells how it went by the exit code: 0 done, 1 done with more
/// faulty records than the run allows, 2 not done.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Command::Run(args) => args.carry_out(pipeline::run),
        Command::Project(args) => args.carry_out(pipeline::project),
        Command::Check(args) => check::check(&args),
        Command::Simulate(args) => simulate::simulate(&args),
        Command::Evaluate(args) => evaluate::evaluate(&args),
        Command::Import(args) => import::import(&args),
        Command::Reproduce(args) => reproduce::reproduce(&args),
        Command::BenchAccuracy(args) => bench_accuracy::bench_accuracy(&args),
        Command::Camera(args) => camera::camera(&args),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            tell(&error);
            ExitCode::from(2)
        }
    }
}

/// Prints an error, one line a fault.
fn tell(error: &Error) {
    match error {
        Error::Faults(faults) => {
            for fault in faults {
                eprintln!("error: {fault}");
            }
        }
        other => eprintln!("error: {other}"),
    }
}
