//! `rockmap completions`.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::error::Error;

const EXAMPLES: &str = "Examples:
  rockmap completions bash > ~/.local/share/bash-completion/completions/rockmap
  rockmap completions zsh > ~/.zfunc/_rockmap
  rockmap completions fish > ~/.config/fish/completions/rockmap.fish";

/// What `rockmap completions` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

pub(super) fn completions(args: &Args) -> Result<ExitCode, Error> {
    // Made in memory: the generator panics where its output is closed early.
    let mut script = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut super::Cli::command(),
        "rockmap",
        &mut script,
    );
    let written = std::io::stdout().write_all(&script);
    written.map_err(|e| Error::io(Path::new("standard output"), "write", e))?;
    Ok(ExitCode::SUCCESS)
}
