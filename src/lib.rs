//! rockmap: maps of rocks from posed pictures.

pub mod error;
pub mod frame;
pub mod input;
pub mod terrain;
