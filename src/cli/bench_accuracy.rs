//! `rockmap bench-accuracy`.

use std::path::PathBuf;
use std::process::ExitCode;

use super::console::Console;
use crate::error::Error;
use crate::evaluate;
use crate::experiment::bench::{BenchOptions, Contender, bench_accuracy as carry_out, parse_seeds};

const EXAMPLES: &str = "Examples:
  rockmap bench-accuracy fixtures/scenes/default.toml --seeds 1..20
  rockmap bench-accuracy fixtures/scenes/*.toml --seeds 1..5 --methods fair --out /tmp/accuracy";

/// What `rockmap bench-accuracy` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// Scene files
    #[arg(value_name = "SCENE.toml", required = true)]
    scenes: Vec<PathBuf>,
    /// Seeds, both ends included
    #[arg(long, value_name = "A..B")]
    seeds: String,
    /// Methods to compare, separated by commas: em, paper, belief, and the bounds clairvoyant and fair
    #[arg(long, value_name = "METHODS", default_value = "em,paper,belief")]
    methods: String,
    /// Override a key of every pipeline file; may be given several times
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// The folder results are kept in; those that stand there are not computed again
    #[arg(long, value_name = "DIR", default_value = "outputs/accuracy")]
    out: PathBuf,
    /// Say nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn bench_accuracy(args: &Args) -> Result<ExitCode, Error> {
    let options = BenchOptions {
        scenes: args.scenes.clone(),
        seeds: parse_seeds(&args.seeds)?,
        contenders: Contender::parse_list(&args.methods)?,
        set: args.set.clone(),
        scoring: evaluate::Options::default(),
        out: args.out.clone(),
    };
    let table = carry_out(&options, &Console::new(args.quiet))?;
    if !args.quiet {
        print!("{}", table.to_markdown());
    }
    Ok(ExitCode::SUCCESS)
}
