//! Height models as planetary archives have them: a label that says what stands where in a plain
//! image, and which map it is on (PDS3, PDS4, VICAR).

mod image;
mod label;
mod label_map;
mod map;
mod pds3;
mod pds4;
mod vicar;

#[cfg(test)]
mod tests;

use crate::error::{Fault, Place};

pub(super) use pds3::{is_pds3, read_pds3};
pub(super) use pds4::{is_pds4, read_pds4};
pub(super) use vicar::{is_vicar, read_vicar};

/// What is wrong with a label: in which field, and how.
#[derive(Debug)]
struct Problem {
    /// Where in the label, if that is known.
    place: Option<Place>,
    field: String,
    problem: String,
}

impl Problem {
    fn new(field: &str, problem: impl std::fmt::Display) -> Self {
        Self {
            place: None,
            field: field.to_owned(),
            problem: problem.to_string(),
        }
    }

    fn found(field: &str, found: impl std::fmt::Display, expected: &str) -> Self {
        Self::new(field, format!("found {found}, expected {expected}"))
    }

    fn missing(field: &str, expected: &str) -> Self {
        Self::found(field, "nothing", expected)
    }

    fn fault(self, shown: &str) -> Fault {
        let place = self.place.unwrap_or_else(|| Place::file(shown));
        Fault::new(place, self.field, self.problem)
    }
}
