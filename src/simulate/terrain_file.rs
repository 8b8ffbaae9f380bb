//! The model of the ground, as a file.

use std::path::Path;

use crate::error::Error;

use super::Simulation;

/// TODO terrain
pub(super) fn write_terrain(_s: &Simulation, _post_m: f64, path: &Path) -> Result<(), Error> {
    Err(Error::Output(format!("{}: no terrain yet", path.display())))
}
