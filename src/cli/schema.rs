//! `rockmap schema`.

use std::process::ExitCode;

use crate::error::Error;
use crate::pipeline;

const EXAMPLES: &str = "Examples:
  rockmap schema > rockmap.schema.json
  then, as the first line of a pipeline file, for editors that know TOML:
  #:schema ./rockmap.schema.json";

/// What `rockmap schema` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {}

pub(super) fn schema(_: &Args) -> Result<ExitCode, Error> {
    let text = serde_json::to_string_pretty(&pipeline::schema())
        .map_err(|e| Error::Output(format!("cannot write the schema: {e}")))?;
    println!("{text}");
    Ok(ExitCode::SUCCESS)
}
