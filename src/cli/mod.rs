//! The command line: what was typed, and how a run looks on a terminal. No logic of its own.

mod bench_accuracy;
mod camera;
mod check;
mod compare;
mod completions;
mod console;
mod evaluate;
mod import;
mod man;
mod options;
mod reproduce;
mod schema;
mod simulate;
mod tell;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

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

const RUN_EXAMPLES: &str = "Examples:
  rockmap run pipelines/demo.toml
  rockmap run night.toml --data /logs/sol-17 --out /maps/sol-17 --force
  rockmap run night.toml --set view.max_range_m=20 --set noise.pose.yaw_deg=0.8
  rockmap run night.toml --json | jq .n_objects

Exit codes: 0 done, 1 done but more records were faulty than the run allows, 2 not done.";

const PROJECT_EXAMPLES: &str = "Examples:
  rockmap project pipelines/demo.toml --out outputs/demo-single
  rockmap project night.toml --data /logs/sol-17 --json | jq .rejected

Exit codes: 0 done, 1 done but more records were faulty than the run allows, 2 not done.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Read, project, fuse and publish: the whole job
    #[command(after_help = RUN_EXAMPLES)]
    Run(options::JobArgs),
    /// The same up to the ground: every detection by itself, with footprints and rejects
    #[command(after_help = PROJECT_EXAMPLES)]
    Project(options::JobArgs),
    /// Validate a pipeline and all its inputs, compute nothing, list all faults at once
    Check(check::Args),
    /// Make a data set with known truth from a scene file
    Simulate(simulate::Args),
    /// Hold a map against the truth: precision, recall, GOSPA, calibration
    Evaluate(evaluate::Args),
    /// Turn calibrations and rover labels of others into cameras.toml, images.csv and poses.csv
    Import(import::Args),
    /// Hold two maps of one place against each other: what is the same, new, gone, moved
    Compare(compare::Args),
    /// Make the figures of Thompson and Wettergreen (2005) anew, with this program's numbers
    Reproduce(reproduce::Args),
    /// Compare methods over many scenes and seeds
    BenchAccuracy(bench_accuracy::Args),
    /// Ask a camera for the rays of pixels or the pixels of points
    Camera(camera::Args),
    /// Print a script that lets a shell complete commands and options
    Completions(completions::Args),
    /// Print the manual page, or write those of all commands
    Man(man::Args),
    /// Print the JSON Schema of the pipeline file, for editors
    Schema(schema::Args),
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
        Command::Compare(args) => compare::compare(&args),
        Command::Completions(args) => completions::completions(&args),
        Command::Man(args) => man::man(&args),
        Command::Schema(args) => schema::schema(&args),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            tell::error(&error);
            ExitCode::from(2)
        }
    }
}
