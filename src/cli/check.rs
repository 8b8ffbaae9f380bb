//! `rockmap check`.

use std::process::ExitCode;

use super::console::{Closing, Console};
use super::options::PipelineArgs;
use super::tell;
use crate::error::Error;
use crate::pipeline;

const EXAMPLES: &str = "Examples:
  rockmap check pipelines/demo.toml
  rockmap check night.toml --data /logs/sol-17
  rockmap check night.toml --json | jq '.faults[].problem'

Exit codes: 0 all well, 1 more records are faulty than the run allows, 2 a run could not start.";

/// What `rockmap check` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(flatten)]
    pipeline: PipelineArgs,
    #[command(flatten)]
    closing: Closing,
}

pub(super) fn check(args: &Args) -> Result<ExitCode, Error> {
    let console = Console::new(args.closing.quiet);
    args.closing.close(|| {
        let config = args.pipeline.config(None)?;
        let summary = pipeline::check(&config, &console)?;
        for reject in &summary.rejects {
            tell::rejected(&reject.to_string());
        }
        Ok(summary)
    })
}
