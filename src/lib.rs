//! rockmap: maps of rocks from posed pictures.

pub mod camera;
pub mod error;
pub mod frame;
pub mod input;
