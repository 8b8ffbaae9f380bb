//! The experiments.
pub mod circle;
pub mod circle_figures;
pub mod field;
mod field_map;
mod plot;
pub mod statistics;
