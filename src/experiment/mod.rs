//! The experiments.
pub mod circle;
pub mod circle_figures;
mod plot;
pub mod statistics;
