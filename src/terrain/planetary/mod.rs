//! Height models as planetary archives have them: a label that says what stands where in a plain
//! image, and which map it is on (PDS3, PDS4).

mod image;
mod map;
mod odl;
mod pds3;
mod pds4;

#[cfg(test)]
mod tests;

use crate::error::{Fault, Place};

pub(super) use pds3::{is_pds3, read_pds3};
pub(super) use pds4::{is_pds4, read_pds4};

/// What is wrong with a label: in which field, and how.
#[derive(Debug)]
struct Problem {
    field: String,
    problem: String,
}

impl Problem {
    fn found(field: &str, found: impl std::fmt::Display, expected: &str) -> Self {
        Self {
            field: field.to_owned(),
            problem: format!("found {found}, expected {expected}"),
        }
    }

    fn missing(field: &str, expected: &str) -> Self {
        Self::found(field, "nothing", expected)
    }

    fn fault(self, shown: &str) -> Fault {
        Fault::new(Place::file(shown), self.field, self.problem)
    }
}
