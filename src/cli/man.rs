//! `rockmap man`.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::CommandFactory as _;
use clap_mangen::Man;

use crate::error::Error;

const EXAMPLES: &str = "Examples:
  rockmap man | man -l -                         read the page of rockmap itself
  rockmap man --to ~/.local/share/man/man1       install the pages of all commands";

/// What `rockmap man` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// Write a page for every command to this folder instead of the main page to standard output
    #[arg(long, value_name = "DIR")]
    to: Option<PathBuf>,
}

pub(super) fn man(args: &Args) -> Result<ExitCode, Error> {
    let command = super::Cli::command().disable_help_subcommand(true);
    let Some(folder) = &args.to else {
        let standard_output = Path::new("standard output");
        let mut page = Vec::new();
        let rendered = Man::new(command).render(&mut page);
        rendered
            .and_then(|()| std::io::stdout().write_all(&page))
            .map_err(|e| Error::io(standard_output, "write", e))?;
        return Ok(ExitCode::SUCCESS);
    };
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    clap_mangen::generate_to(command, folder).map_err(|e| Error::io(folder, "write", e))?;
    Ok(ExitCode::SUCCESS)
}
