//! From a pipeline file to a map.
//!
//! The top functions read as the walk of a night's data: [`run`], [`project`] and [`check`].

mod annotated;
mod bound;
mod checks;
mod config;
mod digest;
mod formats;
mod fuse;
mod manifest;
mod observer;
mod paths;
mod pictures;
mod publish;
mod read;
mod read_site;
mod schema;
mod stages;
mod summary;

pub use bound::{Bound, Bounded, bound};
pub use config::{
    Config, FusionConfig, InputConfig, Method, NoiseConfig, OutputConfig, Overrides, SiteConfig,
    TerrainConfig, ViewConfig,
};
pub use digest::InputFile;
pub(crate) use digest::hexadecimal;
pub use fuse::{Mapped, map};
pub use observer::{Observer, Silent};
pub use paths::{DEFAULT_DATA, Source};
pub use pictures::PictureDigest;
pub(crate) use publish::may_replace;
pub use read::{Inputs, read};
pub use schema::schema;
pub use stages::{Clock, Ground, Settings};
pub use summary::{FileCount, Stage, Summary};

use crate::error::Error;
use crate::publish::Folder;

/// The whole job: reads, projects, traces footprints, fuses and publishes.
///
/// # Errors
/// All faults of the inputs at once, or an output that cannot be written; then nothing is.
pub fn run(config: &Config, force: bool, observer: &dyn Observer) -> Result<Summary, Error> {
    let folder = Folder::claim(&config.output.dir)?;
    let mut clock = Clock::start();
    let inputs = clock.stage("read", || read::read(config, observer))?;
    let run_id = manifest::run_id("run", config, &inputs);
    publish::may_replace(&folder, &run_id, force)?;
    let Mapped { ground, fusion } = fuse::map(config, &inputs, &mut clock, observer)?;
    let map = publish::Map::new(config, &inputs, &ground, &fusion, run_id);
    let written = clock.stage("publish", || map.write(&folder, observer))?;
    map.finish(folder, written, clock)
}

/// Puts the detections of a run on the ground and traces what its views could have seen: the stages
/// between [`read()`] and fusing, in memory.
pub fn place(config: &Config, inputs: &Inputs, observer: &dyn Observer) -> Ground {
    let placed = stages::project(config, inputs, observer);
    stages::footprint(config, inputs, placed, None, observer)
}

/// The same up to the ground: every detection by itself, with footprints and rejects.
///
/// # Errors
/// As [`run`].
pub fn project(config: &Config, force: bool, observer: &dyn Observer) -> Result<Summary, Error> {
    let folder = Folder::claim(&config.output.dir)?;
    let mut clock = Clock::start();
    let inputs = clock.stage("read", || read::read(config, observer))?;
    let run_id = manifest::run_id("project", config, &inputs);
    publish::may_replace(&folder, &run_id, force)?;
    let placed = clock.stage("project", || Ok(stages::project(config, &inputs, observer)))?;
    let ground = clock.stage("footprint", || {
        Ok(stages::footprint(config, &inputs, placed, None, observer))
    })?;
    let map = publish::Map::single_view(config, &inputs, &ground, run_id);
    let written = clock.stage("publish", || map.write(&folder, observer))?;
    map.finish(folder, written, clock)
}

/// Validates everything and computes nothing: the pipeline file, every input, and how they fit.
///
/// # Errors
/// All faults that would keep the run from starting, at once.
pub fn check(config: &Config, observer: &dyn Observer) -> Result<Summary, Error> {
    let inputs = read::read(config, observer)?;
    Ok(Summary::of_inputs(config, &inputs))
}
