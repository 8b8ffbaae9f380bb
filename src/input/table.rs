//! A CSV file read row by row.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::{Error, Fault, Place, suggestion};

/// A CSV file with a header row.
pub struct Table {
    file: String,
    columns: Vec<String>,
    reader: csv::Reader<Box<dyn Read + Send>>,
}

/// One record of a [`Table`].
pub struct Row<'a> {
    file: &'a str,
    columns: &'a [String],
    record: StringRecord,
    line: u64,
}

impl Table {
    /// Opens the file and reads its header. `shown` is the name faults call it by.
    ///
    /// # Errors
    /// A file that cannot be read, a header that is not text, a column that stands twice.
    pub fn open(path: &Path, shown: &str) -> Result<Self, Error> {
        let file = File::open(path).map_err(|e| Error::io(path, "read", e))?;
        if file.metadata().is_ok_and(|m| m.is_dir()) {
            let is_folder = std::io::Error::from(std::io::ErrorKind::IsADirectory);
            return Err(Error::io(path, "read", is_folder));
        }
        Self::new(Box::new(BufReader::new(file)), shown)
    }

    /// Reads a table from bytes, for tests and for sources that are not files.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub fn from_bytes(bytes: &[u8], shown: &str) -> Result<Self, Error> {
        Self::new(Box::new(std::io::Cursor::new(bytes.to_vec())), shown)
    }

    /// Reads a table from any source, such as standard input.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub fn from_reader(source: Box<dyn Read + Send>, shown: &str) -> Result<Self, Error> {
        Self::new(source, shown)
    }

    fn new(source: Box<dyn Read + Send>, shown: &str) -> Result<Self, Error> {
        let mut reader = ReaderBuilder::new()
            .trim(Trim::All)
            .comment(Some(b'#'))
            .from_reader(source);
        let header = reader
            .headers()
            .map_err(|e| Fault::new(Place::line(shown, 1), "", csv_problem(&e)))?;
        let columns: Vec<String> = header.iter().map(str::to_owned).collect();
        let twice = (1..columns.len())
            .find(|&i| !columns[i].is_empty() && columns[..i].contains(&columns[i]));
        if let Some(i) = twice {
            let place = Place::line(shown, 1);
            return Err(Fault::found(place, &columns[i], "the column twice", "it once").into());
        }
        Ok(Self {
            file: shown.to_owned(),
            columns,
            reader,
        })
    }

    /// The name faults call the file by.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The header's columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Whether the file has this column.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|c| c == column)
    }

    /// Checks that all of these columns are there.
    ///
    /// # Errors
    /// The first that is missing, with what was found in its stead.
    pub fn require(&self, columns: &[&str]) -> Result<(), Fault> {
        match columns.iter().find(|c| !self.has(c)) {
            None => Ok(()),
            Some(missing) => Err(self.missing(missing, &format!("a column {missing}"))),
        }
    }

    /// The fault of a missing column: what is there, and what was `expected`.
    pub fn missing(&self, column: &str, expected: &str) -> Fault {
        let unnamed = self.columns.iter().all(String::is_empty);
        let found = match &self.columns[..] {
            _ if unnamed => "no header".to_owned(),
            columns => format!("columns {}", columns.join(", ")),
        };
        let near = suggestion(column, self.columns.iter().map(String::as_str))
            .filter(|near| !near.is_empty())
            .map(|near| format!(" (is {near} meant?)"))
            .unwrap_or_default();
        Fault::found(
            Place::line(&self.file, 1),
            column,
            found,
            format!("{expected}{near}"),
        )
    }

    /// The columns that none of `known` names, for the one warning a file.
    pub fn unknown(&self, known: &[&str]) -> Vec<String> {
        let unknown = |c: &&String| !c.is_empty() && !known.contains(&c.as_str());
        self.columns.iter().filter(unknown).cloned().collect()
    }

    /// The next record: `None` at the end, a fault where the line is not a record of this table.
    pub fn next_row(&mut self) -> Option<Result<Row<'_>, Fault>> {
        let mut record = StringRecord::new();
        let read = self.reader.read_record(&mut record);
        let line = match &read {
            Ok(_) => record.position().map(csv::Position::line),
            Err(e) => e.position().map(csv::Position::line),
        };
        let line = line.unwrap_or_else(|| self.reader.position().line());
        match read {
            Ok(false) => None,
            Ok(true) => Some(Ok(Row {
                file: &self.file,
                columns: &self.columns,
                record,
                line,
            })),
            Err(e) => Some(Err(Fault::new(
                Place::line(&self.file, line),
                "",
                csv_problem(&e),
            ))),
        }
    }
}

fn csv_problem(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("found {len} fields, expected {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "found bytes that are not UTF-8, expected text".to_owned(),
        csv::ErrorKind::Io(e) => format!("cannot read: {e}"),
        _ => error.to_string(),
    }
}

impl Row<'_> {
    /// The line it starts on, from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// Where it stands.
    pub fn place(&self) -> Place {
        Place::line(self.file, self.line)
    }

    /// The text of a column; `None` where the column is absent or the field empty.
    pub fn text(&self, column: &str) -> Option<&str> {
        let index = self.columns.iter().position(|c| c == column)?;
        self.record.get(index).filter(|t| !t.is_empty())
    }

    /// The text of a column that must not be empty.
    ///
    /// # Errors
    /// An empty field.
    pub fn required_text(&self, column: &str) -> Result<&str, Fault> {
        self.text(column)
            .ok_or_else(|| self.fault(column, "nothing", "a value"))
    }

    /// The number in a column; `None` where the column is absent or the field empty.
    ///
    /// # Errors
    /// What is not a finite number.
    pub fn number(&self, column: &str) -> Result<Option<f64>, Fault> {
        let Some(text) = self.text(column) else {
            return Ok(None);
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            Ok(_) => Err(self.fault(column, text, "a finite number")),
            Err(_) => Err(self.fault(column, format!("{text:?}"), "a number")),
        }
    }

    /// The number in a column that must not be empty.
    ///
    /// # Errors
    /// An empty field, or what is not a finite number.
    pub fn required_number(&self, column: &str) -> Result<f64, Fault> {
        self.number(column)?
            .ok_or_else(|| self.fault(column, "nothing", "a number"))
    }

    /// A number that must lie between two bounds, both included.
    ///
    /// # Errors
    /// As [`Row::number`], and a number outside the bounds.
    pub fn number_within(&self, column: &str, low: f64, high: f64) -> Result<Option<f64>, Fault> {
        match self.number(column)? {
            Some(x) if !(low..=high).contains(&x) => {
                Err(self.fault(column, x, format!("{low} to {high}")))
            }
            other => Ok(other),
        }
    }

    /// A number that must not be negative, and above zero where `positive`.
    ///
    /// # Errors
    /// As [`Row::number`], and a number below the bound.
    pub fn number_above_zero(&self, column: &str, positive: bool) -> Result<Option<f64>, Fault> {
        match self.number(column)? {
            Some(x) if x < 0.0 => Err(self.fault(column, x, "a number not below zero")),
            Some(0.0) if positive => Err(self.fault(column, "0", "a number above zero")),
            other => Ok(other),
        }
    }

    /// A fault in one of this row's fields.
    pub fn fault(
        &self,
        column: &str,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
    ) -> Fault {
        Fault::found(self.place(), column, found, expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        Table::from_bytes(text.as_bytes(), "poses.csv").unwrap()
    }

    #[test]
    fn faults_name_line_and_column() {
        let mut t = table("time,lat_deg\n1,2x\n2,NaN\n3\n4,95\n");
        let mut faults = Vec::new();
        while let Some(row) = t.next_row() {
            let read = row.and_then(|r| r.number_within("lat_deg", -90.0, 90.0));
            faults.push(read.unwrap_err().to_string());
        }
        assert_eq!(
            faults,
            [
                "poses.csv:2: lat_deg: found \"2x\", expected a number",
                "poses.csv:3: lat_deg: found NaN, expected a finite number",
                "poses.csv:4: found 1 fields, expected 2",
                "poses.csv:5: lat_deg: found 95, expected -90 to 90",
            ]
        );
    }

    #[test]
    fn a_missing_column_says_what_is_there() {
        let t = table("tme,lat_deg\n");
        assert_eq!(
            t.require(&["lat_deg", "time"]).unwrap_err().to_string(),
            "poses.csv:1: time: found columns tme, lat_deg, expected a column time (is tme meant?)"
        );
        assert_eq!(
            table("").require(&["time"]).unwrap_err().to_string(),
            "poses.csv:1: time: found no header, expected a column time"
        );
    }

    #[test]
    fn byte_order_mark_and_blanks_do_no_harm() {
        let mut t = table("\u{feff}time , lat_deg\r\n 1 , 2 \r\n");
        assert!(t.has("time") && t.has("lat_deg"));
        let row = t.next_row().unwrap().unwrap();
        assert_eq!(row.number("time").unwrap(), Some(1.0));
    }

    #[test]
    fn a_column_twice_is_a_fault() {
        let error = Table::from_bytes(b"a,b,a\n", "x.csv").err().unwrap();
        assert_eq!(
            error.to_string(),
            "x.csv:1: a: found the column twice, expected it once"
        );
    }
}
