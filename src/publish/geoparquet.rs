//! `GeoParquet` 1.1: a layer as columns, with geometries as well-known binary and the box around
//! each; a table without geometries as plain Parquet.

mod parquet;
mod thrift;

use geo::Rect;
use serde_json::{Value as Json, json};

use self::parquet::{Cell, Column, Type};
use super::layer::{Field, FieldKind, Geometry, Kind, Layer, Value};
use super::wkt;
use crate::error::Error;

/// The column of geometries.
const GEOMETRY: &str = "geometry";
/// The column of boxes around them.
const BOX: &str = "bbox";

/// A layer as the bytes of a Parquet file; lines and polygons are always Multi.
///
/// # Errors
/// A planet that PROJ does not know.
pub fn bytes(layer: &Layer) -> Result<Vec<u8>, Error> {
    let mut columns: Vec<Column> = Vec::new();
    for (i, field) in layer.fields.iter().enumerate() {
        columns.push(property(layer, field, i));
    }
    let mut metadata = Vec::new();
    if let Some(kind) = layer.geometry {
        columns.push(geometries(layer));
        columns.extend(boxes(layer));
        let crs = layer
            .crs_text()
            .map_err(|e| Error::Output(format!("cannot write {}.parquet: {e}", layer.name)))?;
        metadata.push(("geo", geo_metadata(layer, kind, crs.projjson).to_string()));
    }
    Ok(parquet::bytes(&columns, layer.features.len(), &metadata))
}

fn property(layer: &Layer, field: &Field, index: usize) -> Column {
    let kind = match field.kind {
        FieldKind::Text => Type::Text,
        FieldKind::Integer => Type::Integer,
        FieldKind::Real(_) => Type::Real,
        FieldKind::Time => Type::Time,
    };
    let cell = |value: &Value| match value {
        Value::Null => None,
        Value::Text(text) => Some(Cell::Bytes(text.clone().into_bytes())),
        Value::Integer(n) => Some(Cell::Integer(*n)),
        Value::Real(x) => Some(Cell::Real(*x)),
        Value::Time(time) => Some(Cell::Integer(time.nanoseconds())),
    };
    let cells = layer.features.iter().map(|f| cell(&f.values[index]));
    Column::new(vec![field.name], kind, cells.collect())
}

fn geometries(layer: &Layer) -> Column {
    let cell = |geometry: &Option<Geometry>| {
        let geometry = geometry.as_ref().filter(|g| !g.is_empty())?;
        Some(Cell::Bytes(wkt::binary(geometry)))
    };
    let cells = layer.features.iter().map(|f| cell(&f.geometry)).collect();
    Column::new(vec![GEOMETRY], Type::Bytes, cells)
}

fn boxes(layer: &Layer) -> [Column; 4] {
    let bounds = |geometry: &Option<Geometry>| geometry.as_ref().and_then(Geometry::bounds);
    let side = |name: &'static str, of: fn(Rect<f64>) -> f64| {
        let features = layer.features.iter();
        let cells = features.map(|f| bounds(&f.geometry).map(|b| Cell::Real(of(b))));
        Column::new(vec![BOX, name], Type::Real, cells.collect())
    };
    [
        side("xmin", |b| b.min().x),
        side("ymin", |b| b.min().y),
        side("xmax", |b| b.max().x),
        side("ymax", |b| b.max().y),
    ]
}

fn geo_metadata(layer: &Layer, kind: Kind, crs: Json) -> Json {
    let name = match kind {
        Kind::Point => "Point",
        Kind::Line => "MultiLineString",
        Kind::Polygon => "MultiPolygon",
    };
    let path = |side: &str| json!([BOX, side]);
    let mut column = json!({
        "encoding": "WKB",
        "geometry_types": [name],
        "crs": crs,
        "orientation": "counterclockwise",
        "edges": "planar",
        "covering": { "bbox": {
            "xmin": path("xmin"),
            "ymin": path("ymin"),
            "xmax": path("xmax"),
            "ymax": path("ymax"),
        } },
    });
    if let Some(bounds) = layer.bounds() {
        let (min, max) = (bounds.min(), bounds.max());
        column["bbox"] = json!([min.x, min.y, max.x, max.y]);
    }
    json!({
        "version": "1.1.0",
        "primary_column": GEOMETRY,
        "columns": { GEOMETRY: column },
    })
}

#[cfg(test)]
mod tests;
