//! rockmap: maps of rocks from posed pictures.

pub mod camera;
pub mod detection;
pub mod error;
pub mod frame;
pub mod input;
pub mod pose;
pub mod simulate;
pub mod terrain;
