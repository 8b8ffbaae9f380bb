//! images.csv: which picture was taken when, by which camera.

use std::path::Path;

use crate::error::{Error, Fault};
use crate::input::{Reject, Row, Table};
use crate::pose::{self, Time};

/// One row of images.csv.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageRow {
    /// Line of the file.
    pub line: u64,
    /// The image.
    pub image_id: String,
    /// When it was taken.
    pub time: Option<Time>,
    /// Its camera.
    pub camera: Option<String>,
    /// Its picture, relative to the file.
    pub path: Option<String>,
    /// Which of several robots.
    pub platform: Option<String>,
    /// Pan and tilt of the camera's head, radians.
    pub pan_tilt: [f64; 2],
}

/// What an images.csv holds.
#[derive(Debug)]
pub struct ImageFile {
    /// The rows that could be read, in the order of the file.
    pub rows: Vec<ImageRow>,
    /// The rows that could not.
    pub rejects: Vec<Reject>,
    /// Columns that mean nothing here.
    pub unknown_columns: Vec<String>,
}

const KNOWN: [&str; 7] = [
    "image_id", "time", "camera", "path", "platform", "pan_deg", "tilt_deg",
];

/// Reads images.csv; `needs_time` where the poses are a log.
///
/// # Errors
/// A file that cannot be read, or a missing column; bad rows are set aside in the result.
pub fn read_images(path: &Path, shown: &str, needs_time: bool) -> Result<ImageFile, Error> {
    let mut table = Table::open(path, shown)?;
    table.require(if needs_time {
        &["image_id", "time"]
    } else {
        &["image_id"]
    })?;
    let mut file = ImageFile {
        rows: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: table.unknown(&KNOWN),
    };
    while let Some(row) = table.next_row() {
        let record = match &row {
            Ok(row) => row.text("image_id").unwrap_or("").to_owned(),
            Err(_) => String::new(),
        };
        match row.and_then(|row| image_row(&row, needs_time)) {
            Ok(row) => file.rows.push(row),
            Err(fault) => file.rejects.push(Reject::from_fault(fault, record)),
        }
    }
    Ok(file)
}

fn image_row(row: &Row<'_>, needs_time: bool) -> Result<ImageRow, Fault> {
    if needs_time {
        row.required_text("time")?;
    }
    let text = |column| row.text(column).map(str::to_owned);
    Ok(ImageRow {
        line: row.line(),
        image_id: row.required_text("image_id")?.to_owned(),
        time: pose::time(row)?,
        camera: text("camera"),
        path: text("path"),
        platform: text("platform"),
        pan_tilt: pose::pan_tilt(row)?,
    })
}
