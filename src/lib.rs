//! rockmap: maps of rocks from posed pictures.

pub mod error;
pub mod evaluate;
pub mod frame;
pub mod input;
