//! Options that several subcommands share.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::console::{Closing, Console};
use crate::error::{Error, Fault, Place};
use crate::pipeline::{Config, Observer, Overrides, Summary};

/// Which pipeline, over which data.
#[derive(Debug, Args)]
pub(super) struct PipelineArgs {
    /// The pipeline file
    #[arg(value_name = "PIPELINE.toml")]
    pipeline: PathBuf,
    /// Take the input files from this folder instead of the pipeline's own
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Override a key of the pipeline file; may be given several times
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Fusion method (belief, em or paper), as --set fusion.method=METHOD
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Threads to work with; as many as the machine has if not given
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

/// A pipeline to be carried out, and where its outputs go.
#[derive(Debug, Args)]
pub(super) struct JobArgs {
    #[command(flatten)]
    pipeline: PipelineArgs,
    /// Write outputs to this folder instead of the pipeline's own
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the outputs of another run
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    closing: Closing,
}

/// A job of the pipeline.
type Job = fn(&Config, bool, &dyn Observer) -> Result<Summary, Error>;

impl JobArgs {
    /// Carries the job out and closes with its table.
    pub(super) fn carry_out(&self, job: Job) -> Result<ExitCode, Error> {
        let console = Console::new(self.closing.quiet);
        self.closing.close(|| {
            let config = self.pipeline.config(self.out.as_ref())?;
            job(&config, self.force, &console)
        })
    }
}

impl PipelineArgs {
    /// The checked configuration; sets up the threads on the way.
    pub(super) fn config(&self, out: Option<&PathBuf>) -> Result<Config, Error> {
        if let Some(threads) = self.threads {
            if threads == 0 {
                let fault = Fault::found(Place::file("--threads"), "", 0, "at least 1");
                return Err(fault.into());
            }
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build_global()
                .map_err(|e| Error::Output(format!("cannot set up {threads} threads: {e}")))?;
        }
        let mut set = self.set.clone();
        set.extend(self.method.iter().map(|m| format!("fusion.method={m}")));
        let overrides = Overrides {
            data: self.data.clone(),
            out: out.cloned(),
            set,
        };
        Config::read(&self.pipeline, &overrides)
    }
}
