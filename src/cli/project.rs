//! `rockmap project`.

use std::process::ExitCode;

use super::console::{self, Console};
use super::options::{OutputArgs, PipelineArgs};
use crate::error::Error;
use crate::pipeline;

/// What `rockmap project` takes.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pipeline: PipelineArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn project(args: &Args) -> Result<ExitCode, Error> {
    let config = args.pipeline.config(args.output.out.as_ref())?;
    let console = Console::new(args.output.quiet);
    let summary = pipeline::project(&config, args.output.force, &console)?;
    Ok(console::close(&summary, args.output.quiet))
}
