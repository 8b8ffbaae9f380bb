//! `rockmap check`.

use std::process::ExitCode;

use super::console::{self, Console};
use super::options::PipelineArgs;
use crate::error::Error;
use crate::pipeline;

/// What `rockmap check` takes.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pipeline: PipelineArgs,
    /// Say nothing but faults and warnings
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn check(args: &Args) -> Result<ExitCode, Error> {
    let config = args.pipeline.config(None)?;
    let console = Console::new(args.quiet);
    let summary = pipeline::check(&config, &console)?;
    for reject in &summary.rejects {
        eprintln!("rejected: {reject}");
    }
    Ok(console::close(&summary, args.quiet))
}
