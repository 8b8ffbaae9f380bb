//! The lens models against other implementations, against their own derivatives, and there and back.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod batches;
mod jacobians;
mod random;
mod readouts;
mod rows;
mod tables;
mod trips;

use rockmap::camera::{Cameras, cameras_from_toml};

/// One camera of every kind.
fn cameras() -> Cameras {
    cameras_from_toml(include_str!("cameras.toml"), "cameras.toml").unwrap()
}
