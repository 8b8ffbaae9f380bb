//! Comma-separated values: any layer, and rejects.csv.

use super::layer::{Field, FieldKind, Geometry, Kind, Layer, Value};
use super::wkt;
use crate::error::Error;
use crate::frame::CrsText;
use crate::input::Reject;

/// A layer as a table: points as `lon_deg, lat_deg`, on a map in metres as `easting_m, northing_m` and
/// on any other as `x, y`, lines and polygons as `wkt`, before the properties.
///
/// # Errors
/// A table that cannot be written.
pub fn bytes(layer: &Layer) -> Result<Vec<u8>, Error> {
    let mut header: Vec<&str> = match layer.geometry {
        Some(Kind::Point) => names(layer)?.to_vec(),
        Some(Kind::Line | Kind::Polygon) => vec!["wkt"],
        None => Vec::new(),
    };
    header.extend(layer.fields.iter().map(|f| f.name));
    let mut csv = Csv::new(&header)?;
    for feature in &layer.features {
        let mut row = feature
            .geometry
            .as_ref()
            .map_or(Vec::new(), |g| place(g, layer.decimals()));
        let values = layer.fields.iter().zip(&feature.values);
        row.extend(values.map(|(field, value)| text(field, value)));
        csv.row(&row)?;
    }
    csv.finish()
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

/// A CSV table in memory.
struct Csv {
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

/// What the coordinates of points are called.
fn names(layer: &Layer) -> Result<[&'static str; 2], Error> {
    let Some(crs) = layer.crs.as_ref().filter(|crs| crs.is_projected()) else {
        return Ok(["lon_deg", "lat_deg"]);
    };
    let text = CrsText::of(crs.definition()).map_err(in_memory)?;
    Ok(if text.is_in_metres {
        ["easting_m", "northing_m"]
    } else {
        ["x", "y"]
    })
}

fn place(geometry: &Geometry, decimals: usize) -> Vec<String> {
    match geometry {
        Geometry::Point(at) => vec![
            format!("{:.decimals$}", at.x),
            format!("{:.decimals$}", at.y),
        ],
        parts => vec![wkt::text(parts, decimals)],
    }
}

fn text(field: &Field, value: &Value) -> String {
    match (value, field.kind) {
        (Value::Null, _) => String::new(),
        (Value::Text(text), _) => text.clone(),
        (Value::Integer(n), _) => n.to_string(),
        (Value::Real(x), FieldKind::Real(decimals)) => format!("{x:.decimals$}"),
        (Value::Real(x), _) => x.to_string(),
        (Value::Time(time), _) => time.to_string(),
    }
}
