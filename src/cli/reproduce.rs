//! `rockmap reproduce`.

use std::path::PathBuf;
use std::process::ExitCode;

use super::console::Console;
use crate::error::Error;
use crate::experiment::{ReproduceOptions, reproduce as carry_out};

const EXAMPLES: &str = "Examples:
  rockmap reproduce
  rockmap reproduce --trials 200 --seed 7 --out /tmp/reproduction";

/// What `rockmap reproduce` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// The folder figures and numbers are written to
    #[arg(long, value_name = "DIR", default_value = "outputs/reproduction")]
    out: PathBuf,
    /// Seed of the experiments
    #[arg(long, value_name = "N", default_value_t = ReproduceOptions::SEED)]
    seed: u64,
    /// Trials of each simulated figure
    #[arg(long, value_name = "N", default_value_t = ReproduceOptions::N_TRIALS)]
    trials: usize,
    /// Replace the outputs of another run
    #[arg(long)]
    force: bool,
    /// Say nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn reproduce(args: &Args) -> Result<ExitCode, Error> {
    let mut options = ReproduceOptions::new(args.out.clone());
    options.seed = args.seed;
    options.n_trials = args.trials;
    options.force = args.force;
    let reproduction = carry_out(&options, &Console::new(args.quiet))?;
    if !args.quiet {
        print!("{reproduction}");
    }
    Ok(ExitCode::SUCCESS)
}
