//! Options that several subcommands share.

use std::path::PathBuf;

use clap::Args;

use crate::error::{Error, Fault, Place};
use crate::pipeline::{Config, Overrides};

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
    /// Fusion method, as --set fusion.method=METHOD
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Threads to work with; as many as the machine has if not given
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

/// Where outputs go.
#[derive(Debug, Args)]
pub(super) struct OutputArgs {
    /// Write outputs to this folder instead of the pipeline's own
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Replace the outputs of another run
    #[arg(long)]
    pub(super) force: bool,
    /// Say nothing but errors and warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
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
