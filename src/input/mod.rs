//! CSV tables and TOML documents in which every value knows its place, and the records set aside.
//!
//! The readers of `pose`, `camera`, `detection` and `pipeline` stand on these, so that all of them
//! report a fault in the same words.

mod asked;
mod document;
mod reject;
mod rows;
mod section;
mod table;

pub use asked::{Asked, Interval, Takes};
pub use document::Document;
pub use reject::{Reason, Reject};
pub use rows::write_rows;
pub use section::Section;
pub use table::{Row, Table};
