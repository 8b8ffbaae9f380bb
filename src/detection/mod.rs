//! Detector outputs.

mod writer;

pub use writer::{DetectionRecord, MeasurementRecord, write_detections};
