//! CSV tables and documents (TOML, YAML, JSON, XML, ODL and VICAR labels) in which every value knows
//! its place, and the records set aside.
//!
//! The readers of `pose`, `camera`, `detection` and `pipeline` stand on these, so that all of them
//! report a fault in the same words.

mod asked;
mod builder;
mod document;
mod head;
mod json;
mod lists;
mod odl;
mod reject;
mod rows;
mod section;
mod table;
mod vicar;
mod xml;
mod yaml;

pub use asked::{Asked, Interval, Takes};
pub use document::Document;
pub(crate) use head::{first_character, image_id_of, text};
pub use reject::{Reason, Reject};
pub(crate) use rows::rows_text;
pub use rows::write_rows;
pub use section::Section;
pub use table::{Row, Table};
