//! The `rockmap` program.
fn main() {}
