//! What can go wrong at the program's edges, and how it is said.
//!
//! A fault in an input names the file, the line, the field, what was found and what was expected,
//! in lower case and without a full stop, so that whoever wrote the file can mend it:
//! `detections.csv:97: score: found 1.83, expected 0 to 1`.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in an input something stands.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Place {
    /// The file, as the user named it; empty for what was typed on the command line.
    pub file: String,
    /// Line, from 1.
    pub line: Option<u64>,
    /// Column, from 1, where one line holds several things.
    pub column: Option<u64>,
}

impl Place {
    /// A whole file.
    pub fn file(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            line: None,
            column: None,
        }
    }

    /// A line of a file.
    pub fn line(file: impl Into<String>, line: u64) -> Self {
        Self {
            line: Some(line),
            ..Self::file(file)
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        for number in [self.line, self.column].into_iter().flatten() {
            write!(f, ":{number}")?;
        }
        Ok(())
    }
}

/// One thing wrong with an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where it stands.
    pub place: Place,
    /// The column or key, empty where the fault is not in one.
    pub field: String,
    /// What is wrong: `found 1.83, expected 0 to 1`.
    pub problem: String,
}

impl Fault {
    /// A fault in a field.
    pub fn new(place: Place, field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            place,
            field: field.into(),
            problem: problem.into(),
        }
    }

    /// A fault that says what was found and what was expected.
    pub fn found(
        place: Place,
        field: impl Into<String>,
        found: impl fmt::Display,
        expected: impl fmt::Display,
    ) -> Self {
        Self::new(place, field, format!("found {found}, expected {expected}"))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.place.to_string();
        for part in [place.as_str(), self.field.as_str()] {
            if !part.is_empty() {
                write!(f, "{part}: ")?;
            }
        }
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Fault {}

/// Why a run could not go on.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder that cannot be read or written.
    #[error("{}: cannot {doing}: {}", path.display(), io_problem(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`, `create`.
        doing: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// Faults in the inputs, all that were found.
    #[error("{}", list(.0))]
    Faults(Vec<Fault>),
    /// A result that cannot be written as asked.
    #[error("{0}")]
    Output(String),
}

impl Error {
    /// A system error on a path.
    pub fn io(path: &Path, doing: &'static str, source: std::io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            doing,
            source,
        }
    }

    /// `Ok` where there are no faults.
    ///
    /// # Errors
    /// [`Error::Faults`] with all of them.
    pub fn check(faults: Vec<Fault>) -> Result<(), Self> {
        if faults.is_empty() {
            Ok(())
        } else {
            Err(Self::Faults(faults))
        }
    }

    /// `Ok` where every number that was typed as an option lies in its domain.
    ///
    /// # Errors
    /// [`Error::Faults`] with every option that does not.
    pub fn check_options(options: &[(&str, f64, Domain)]) -> Result<(), Self> {
        let wrong = options.iter().filter(|(_, x, domain)| !domain.has(*x));
        let fault = |(option, x, domain): &(&str, f64, Domain)| {
            Fault::found(Place::default(), *option, x, domain)
        };
        Self::check(wrong.map(fault).collect())
    }
}

/// Where a number may lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Above zero, and finite.
    AboveZero,
    /// 0 to 1, both included.
    Share,
    /// 0 to 1, neither included.
    InnerShare,
}

impl Domain {
    fn has(self, x: f64) -> bool {
        match self {
            Self::AboveZero => x > 0.0 && x.is_finite(),
            Self::Share => (0.0..=1.0).contains(&x),
            Self::InnerShare => x > 0.0 && x < 1.0,
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AboveZero => "a number above zero",
            Self::Share => "0 to 1",
            Self::InnerShare => "above 0, below 1",
        })
    }
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        Self::Faults(vec![fault])
    }
}

/// The system's words without its error number.
fn io_problem(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file or folder".to_owned(),
        std::io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        std::io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        std::io::ErrorKind::NotADirectory => "it is not a folder".to_owned(),
        _ => error.to_string(),
    }
}

fn list(faults: &[Fault]) -> String {
    let lines: Vec<String> = faults.iter().map(Fault::to_string).collect();
    lines.join("\n")
}

/// The one of `known` nearest to a mistyped `word`, if any is near enough to be meant.
pub fn suggestion<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(word, candidate), candidate))
        .filter(|&(distance, candidate)| distance <= candidate.len().max(word.len()).div_ceil(3))
        .min()
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_reads_as_the_house_style_says() {
        let fault = Fault::found(Place::line("detections.csv", 97), "score", "1.83", "0 to 1");
        assert_eq!(
            fault.to_string(),
            "detections.csv:97: score: found 1.83, expected 0 to 1"
        );
    }

    #[test]
    fn a_missing_file_is_named_without_numbers() {
        let path = Path::new("no/such/file.csv");
        let source = std::fs::read(path).unwrap_err();
        assert_eq!(
            Error::io(path, "read", source).to_string(),
            "no/such/file.csv: cannot read: no such file or folder"
        );
    }

    #[test]
    fn suggestions_are_near_or_none() {
        let known = ["min_range_m", "max_range_m", "aim"];
        assert_eq!(suggestion("max_rnge_m", known), Some("max_range_m"));
        assert_eq!(suggestion("colour", known), None);
    }
}
