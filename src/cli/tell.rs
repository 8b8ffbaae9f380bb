//! Errors and warnings on standard error, in colour where it is a terminal that wants any.

use anstyle::{AnsiColor, Style};
use serde_json::{Value, json};

use crate::error::{Error, Fault};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();

/// Prints an error, one line a fault.
pub(super) fn error(error: &Error) {
    match error {
        Error::Faults(faults) => faults
            .iter()
            .for_each(|fault| error_line(&fault.to_string())),
        other => error_line(&other.to_string()),
    }
}

/// Prints a line that says why something was not done, or not done cleanly.
pub(super) fn error_line(text: &str) {
    anstream::eprintln!("{ERROR}error:{ERROR:#} {text}");
}

/// Prints a warning.
pub(super) fn warning(text: &str) {
    anstream::eprintln!("{WARNING}warning:{WARNING:#} {text}");
}

/// Prints a record that was set aside.
pub(super) fn rejected(text: &str) {
    anstream::eprintln!("{WARNING}rejected:{WARNING:#} {text}");
}

/// An error as a script takes it: `{"error": ..., "faults": [...]}`.
pub(super) fn json(error: &Error) -> Value {
    let faults: Vec<Value> = match error {
        Error::Faults(faults) => faults.iter().map(fault).collect(),
        _ => Vec::new(),
    };
    json!({"error": error.to_string(), "faults": faults})
}

fn fault(fault: &Fault) -> Value {
    let field = Some(&fault.field).filter(|f| !f.is_empty());
    json!({
        "file": fault.place.file,
        "line": fault.place.line,
        "column": fault.place.column,
        "field": field,
        "problem": fault.problem,
    })
}
