//! `FlatGeobuf` 3: a layer with a packed spatial index, which can be read over a network in part.

use ::flatgeobuf::geozero::error::Result as GeozeroResult;
use ::flatgeobuf::geozero::{ColumnValue, GeomProcessor, GeozeroGeometry, PropertyProcessor};
use ::flatgeobuf::{ColumnType, FgbCrs, FgbWriter, FgbWriterOptions, GeometryType};
use geo::{Coord, Orient, Polygon, orient::Direction};

use super::layer::{Field, FieldKind, Geometry, Kind, Layer, Value};
use crate::error::Error;
use crate::frame::CrsText;

/// A layer as the bytes of a `FlatGeobuf` file; lines and polygons are always Multi.
///
/// # Errors
/// What the encoder says.
pub fn bytes(layer: &Layer) -> Result<Vec<u8>, Error> {
    let failed = |why: String| Error::Output(format!("cannot write {}.fgb: {why}", layer.name));
    let crs = layer.crs_text().map_err(|e| failed(e.to_string()))?;
    write(layer, &crs).map_err(|e| failed(e.to_string()))
}

fn write(layer: &Layer, crs: &CrsText) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let kind = match layer.geometry {
        Some(Kind::Point) => GeometryType::Point,
        Some(Kind::Line) => GeometryType::MultiLineString,
        Some(Kind::Polygon) => GeometryType::MultiPolygon,
        None => GeometryType::Unknown,
    };
    let options = FgbWriterOptions {
        // An index of nothing is none.
        write_index: !layer.features.is_empty(),
        detect_type: false,
        promote_to_multi: false,
        crs: FgbCrs {
            org: (crs.code > 0).then_some(crs.authority.as_str()),
            code: crs.code,
            name: Some(&crs.name),
            wkt: Some(&crs.wkt2),
            ..FgbCrs::default()
        },
        title: Some(layer.title),
        description: Some(layer.about),
        ..FgbWriterOptions::default()
    };
    let mut file = FgbWriter::create_with_options(layer.name, kind, options)?;
    for field in &layer.fields {
        file.add_column(field.name, column_type(field), |builder, column| {
            column.description = Some(builder.create_string(field.about));
        });
    }
    let nothing = Geometry::Polygons(geo::MultiPolygon::new(Vec::new()));
    for feature in &layer.features {
        let geometry = feature.geometry.as_ref().unwrap_or(&nothing);
        let mut refused = None;
        file.add_feature_geom(Shape(geometry), |properties| {
            for (i, (field, value)) in layer.fields.iter().zip(&feature.values).enumerate() {
                if let Err(error) = set(properties, i, field, value) {
                    refused = Some(error);
                }
            }
        })?;
        if let Some(error) = refused {
            return Err(error.into());
        }
    }
    let mut out = Vec::new();
    file.write(&mut out)?;
    Ok(out)
}

fn column_type(field: &Field) -> ColumnType {
    match field.kind {
        FieldKind::Text => ColumnType::String,
        FieldKind::Integer => ColumnType::Long,
        FieldKind::Real(_) => ColumnType::Double,
        FieldKind::Time => ColumnType::DateTime,
    }
}

/// Sets a property; an absent one is left out.
fn set(
    properties: &mut impl PropertyProcessor,
    index: usize,
    field: &Field,
    value: &Value,
) -> GeozeroResult<()> {
    let time;
    let value = match value {
        Value::Null => return Ok(()),
        Value::Text(text) => ColumnValue::String(text),
        Value::Integer(n) => ColumnValue::Long(*n),
        Value::Real(x) => ColumnValue::Double(*x),
        Value::Time(instant) => {
            time = instant.to_string();
            ColumnValue::DateTime(&time)
        }
    };
    properties.property(index, field.name, &value).map(drop)
}

/// A geometry as the encoder walks it.
struct Shape<'a>(&'a Geometry);

impl GeozeroGeometry for Shape<'_> {
    fn process_geom<P: GeomProcessor>(&self, to: &mut P) -> GeozeroResult<()> {
        match self.0 {
            Geometry::Point(at) => {
                to.point_begin(0)?;
                to.xy(at.x, at.y, 0)?;
                to.point_end(0)
            }
            Geometry::Lines(lines) => {
                to.multilinestring_begin(lines.len(), 0)?;
                for (i, line) in lines.iter().enumerate() {
                    to.linestring_begin(false, line.len(), i)?;
                    walk(to, line)?;
                    to.linestring_end(false, i)?;
                }
                to.multilinestring_end(0)
            }
            Geometry::Polygons(polygons) => {
                to.multipolygon_begin(polygons.0.len(), 0)?;
                for (i, polygon) in polygons.orient(Direction::Default).iter().enumerate() {
                    walk_polygon(to, polygon, i)?;
                }
                to.multipolygon_end(0)
            }
        }
    }
}

fn walk_polygon<P: GeomProcessor>(
    to: &mut P,
    polygon: &Polygon<f64>,
    index: usize,
) -> GeozeroResult<()> {
    to.polygon_begin(false, 1 + polygon.interiors().len(), index)?;
    let rings = std::iter::once(polygon.exterior()).chain(polygon.interiors());
    for (i, ring) in rings.enumerate() {
        to.linestring_begin(false, ring.0.len(), i)?;
        walk(to, &ring.0)?;
        to.linestring_end(false, i)?;
    }
    to.polygon_end(false, index)
}

fn walk<P: GeomProcessor>(to: &mut P, coords: &[Coord<f64>]) -> GeozeroResult<()> {
    for (i, at) in coords.iter().enumerate() {
        to.xy(at.x, at.y, i)?;
    }
    Ok(())
}
