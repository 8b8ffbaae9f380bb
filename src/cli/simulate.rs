//! `rockmap simulate`.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::error::Error;
use crate::simulate::{self, Scene};

const EXAMPLES: &str = "Examples:
  rockmap simulate fixtures/scenes/demo.toml --out outputs/demo-data
  rockmap simulate scene.toml --out /tmp/second-night --seed 2";

/// What `rockmap simulate` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// The scene file
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// The folder the data set is written to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Another seed than the scene file's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Say nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn simulate(args: &Args) -> Result<ExitCode, Error> {
    let mut scene = Scene::read(&args.scene)?;
    scene.seed = args.seed.unwrap_or(scene.seed);
    let simulation = simulate::simulate(&scene);
    simulate::write(&simulation, &args.out)?;
    if !args.quiet {
        let seen = simulation.n_detections().iter().filter(|n| **n > 0).count();
        println!(
            "{} views, {} detections of {seen} of {} rocks, written to {}",
            simulation.views.len(),
            simulation.detections.len(),
            simulation.rocks.len(),
            args.out.display()
        );
    }
    Ok(ExitCode::SUCCESS)
}
