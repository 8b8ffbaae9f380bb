//! What the files of a run are made of.

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::paths::Source;
use crate::error::Error;

/// A file that was read.
#[derive(Debug, Clone, Serialize)]
pub struct InputFile {
    /// What it was read as: `poses`, `images`, `cameras`, `detections`, `terrain`.
    pub kind: &'static str,
    /// As the run names it.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
    /// Its records, where it is a table.
    pub rows: Option<usize>,
}

/// The digest of an input file.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn digest(
    kind: &'static str,
    source: &Source,
    rows: Option<usize>,
) -> Result<InputFile, Error> {
    let content = std::fs::read(&source.path).map_err(|e| Error::io(&source.path, "read", e))?;
    Ok(InputFile {
        kind,
        file: source.shown.clone(),
        bytes: content.len() as u64,
        sha256: hexadecimal(&Sha256::digest(&content)),
        rows,
    })
}

/// Bytes as lower-case hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
