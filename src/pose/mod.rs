//! Pose logs.

mod writer;

pub use writer::{ImageRecord, PoseRecord, PoseSigma, format_time, write_images, write_poses};
