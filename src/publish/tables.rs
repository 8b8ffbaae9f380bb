//! evidence.csv and rejects.csv.

use super::Scene;
use super::rock::Rock;
use crate::error::Error;
use crate::input::Reject;

/// A CSV table in memory.
pub(super) struct Csv {
    writer: csv::Writer<Vec<u8>>,
}

impl Csv {
    fn new(header: &[&str]) -> Result<Self, Error> {
        let mut csv = Self {
            writer: csv::Writer::from_writer(Vec::new()),
        };
        csv.row(header)?;
        Ok(csv)
    }

    fn row<T: AsRef<[u8]>>(&mut self, fields: &[T]) -> Result<(), Error> {
        self.writer.write_record(fields).map_err(in_memory)
    }

    fn finish(self) -> Result<Vec<u8>, Error> {
        self.writer.into_inner().map_err(in_memory)
    }
}

fn in_memory(error: impl std::fmt::Display) -> Error {
    Error::Output(format!("cannot write a table: {error}"))
}

fn optional(x: Option<f64>, decimals: usize) -> String {
    x.map_or(String::new(), |x| format!("{x:.decimals$}"))
}

impl Scene<'_> {
    /// evidence.csv: every membership of at least 0.01.
    pub(super) fn evidence(&self, rocks: &[Rock]) -> Result<Vec<u8>, Error> {
        let header = [
            "rock_id",
            "image_id",
            "det_id",
            "weight",
            "residual_px",
            "residual_m",
        ];
        let mut csv = Csv::new(&header)?;
        for rock in rocks {
            for e in &rock.evidence {
                let detection = &self.placed[e.placed].detection;
                csv.row(&[
                    rock.rock_id.clone(),
                    detection.image_id.clone(),
                    detection.det_id.clone(),
                    format!("{:.6}", e.weight),
                    optional(e.residual_px, 3),
                    format!("{:.4}", e.residual_m),
                ])?;
            }
        }
        csv.finish()
    }
}

/// rejects.csv, in the order of files and lines.
pub(super) fn rejects(rejects: &[Reject]) -> Result<Vec<u8>, Error> {
    let mut csv = Csv::new(&["file", "line", "record", "reason", "detail"])?;
    for reject in rejects {
        let line = reject.line.map_or(String::new(), |l| l.to_string());
        csv.row(&[
            reject.file.as_str(),
            &line,
            &reject.record,
            reject.reason.as_str(),
            &reject.detail,
        ])?;
    }
    csv.finish()
}
