//! A CSV file written column by column.

use std::path::Path;

use crate::error::Error;

/// Writes columns, each with its name, as a CSV file with a header row. All columns have the same
/// number of values.
///
/// # Errors
/// A file that cannot be written.
pub fn write_rows(path: &Path, columns: &[(&str, Vec<String>)]) -> Result<(), Error> {
    std::fs::write(path, rows_text(columns)?).map_err(|e| Error::io(path, "write", e))
}

/// The same in memory.
///
/// # Errors
/// None that memory could cause.
pub fn rows_text(columns: &[(&str, Vec<String>)]) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::Output(format!("cannot write a table: {e}"));
    let mut bytes = Vec::new();
    {
        let mut writer = csv::Writer::from_writer(&mut bytes);
        let header = columns.iter().map(|(name, _)| *name);
        writer.write_record(header).map_err(failed)?;
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        for row in 0..rows {
            let record = columns.iter().map(|(_, values)| values[row].as_str());
            writer.write_record(record).map_err(failed)?;
        }
        writer.flush().map_err(|e| failed(e.into()))?;
    }
    Ok(bytes)
}
