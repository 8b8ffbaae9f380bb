//! `GeoPackage` 1.3 (OGC 12-128r17): all layers in one `SQLite` file, with spatial indices, the
//! meaning of every column, and the styles that QGIS applies by itself.
//!
//! The file is made in memory and bears no time of its own, so the same layers give the same bytes.

mod schema;

use rusqlite::types::{ToSql, ToSqlOutput, ValueRef};
use rusqlite::{Connection, MAIN_DB, params, params_from_iter};

use super::layer::{Feature, FieldKind, Geometry, Kind, Layer, Value};
use super::qgis;
use super::wkt;
use crate::error::Error;
use crate::frame::CrsText;
use crate::pose::Time;

/// The column of geometries.
const GEOMETRY: &str = "geom";

/// The number of a system without a code.
const OWN_CODE: i32 = 100_000;

/// When the contents last changed, where no layer knows a time.
const EPOCH: &str = "1970-01-01T00:00:00.000Z";

/// The layers as the bytes of a `GeoPackage`. Lines and polygons are always Multi.
///
/// # Errors
/// What `SQLite` says, which is nothing short of no memory.
pub fn bytes(layers: &[Layer]) -> Result<Vec<u8>, Error> {
    write(layers).map_err(|e| Error::Output(format!("cannot write rockmap.gpkg: {e}")))
}

fn write(layers: &[Layer]) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut db = Connection::open_in_memory()?;
    db.execute_batch(schema::BASE)?;
    let transaction = db.transaction()?;
    let changed = last_change(layers);
    for layer in layers {
        let srs_id = add_crs(&transaction, &layer.crs_text()?)?;
        add_layer(&transaction, layer, srs_id, &changed)?;
    }
    add_styles(&transaction, layers, &changed)?;
    transaction.commit()?;
    // Packs the pages in the order of the tables and leaves none free.
    db.execute_batch("VACUUM;")?;
    Ok(db.serialize(MAIN_DB)?.to_vec())
}

/// Enters a system; gives the number it goes by in the file.
fn add_crs(db: &Connection, crs: &CrsText) -> rusqlite::Result<i32> {
    let (authority, code) = if crs.code > 0 {
        (crs.authority.as_str(), crs.code)
    } else {
        ("NONE", OWN_CODE)
    };
    let wkt1 = crs.wkt1();
    let has_wkt1 = wkt1.is_some();
    let definition = wkt1.unwrap_or("undefined".to_owned());
    let sql = "INSERT OR IGNORE INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, NULL)";
    let row = params![crs.name, code, authority, code, definition];
    if has_wkt1 {
        db.execute(sql, row)?;
        return Ok(code);
    }
    let is_known = "SELECT count(*) FROM gpkg_spatial_ref_sys WHERE srs_id = ?";
    let known: i64 = db.query_row(is_known, params![code], |row| row.get(0))?;
    if known == 0 {
        db.execute(sql, row)?;
        db.execute_batch(schema::WKT2)?;
        let sql = "UPDATE gpkg_spatial_ref_sys SET definition_12_063 = ? WHERE srs_id = ?";
        db.execute(sql, params![crs.wkt2_2015, code])?;
    }
    Ok(code)
}

fn add_layer(db: &Connection, layer: &Layer, srs_id: i32, changed: &str) -> rusqlite::Result<()> {
    db.execute_batch(&schema::table(layer))?;
    let bounds = layer.bounds();
    let kind = if layer.geometry.is_some() {
        "features"
    } else {
        "attributes"
    };
    db.execute(
        "INSERT INTO gpkg_contents VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        params![
            layer.name,
            kind,
            layer.title,
            layer.about,
            changed,
            bounds.map(|b| b.min().x),
            bounds.map(|b| b.min().y),
            bounds.map(|b| b.max().x),
            bounds.map(|b| b.max().y),
            layer.geometry.map(|_| srs_id),
        ],
    )?;
    let describe = "INSERT INTO gpkg_data_columns VALUES (?, ?, NULL, NULL, ?, NULL, NULL)";
    for field in &layer.fields {
        db.execute(describe, params![layer.name, field.name, field.about])?;
    }
    add_rows(db, layer, srs_id)?;
    if let Some(kind) = layer.geometry {
        let sql = "INSERT INTO gpkg_geometry_columns VALUES (?, ?, ?, ?, 0, 0)";
        let row = params![layer.name, GEOMETRY, schema::geometry_type(kind), srs_id];
        db.execute(sql, row)?;
        db.execute_batch(&schema::index(layer.name))?;
        let sql = format!(
            "INSERT INTO \"rtree_{}_{GEOMETRY}\" VALUES (?, ?, ?, ?, ?)",
            layer.name
        );
        let mut insert = db.prepare(&sql)?;
        for (fid, feature) in (1_i64..).zip(&layer.features) {
            if let Some(b) = feature.geometry.as_ref().and_then(Geometry::bounds) {
                insert.execute(params![fid, b.min().x, b.max().x, b.min().y, b.max().y])?;
            }
        }
        // The triggers call functions that only its readers have: they come after the rows.
        db.execute_batch(&schema::triggers(layer.name))?;
    }
    Ok(())
}

fn add_rows(db: &Connection, layer: &Layer, srs_id: i32) -> rusqlite::Result<()> {
    let columns = 1 + usize::from(layer.geometry.is_some()) + layer.fields.len();
    let marks = vec!["?"; columns].join(", ");
    let mut insert = db.prepare(&format!("INSERT INTO \"{}\" VALUES ({marks})", layer.name))?;
    for (fid, feature) in (1_i64..).zip(&layer.features) {
        let mut row = vec![Cell::Value(Value::Integer(fid))];
        if layer.geometry.is_some() {
            row.push(blob(feature, srs_id).map_or(Cell::Value(Value::Null), Cell::Blob));
        }
        row.extend(feature.values.iter().cloned().map(Cell::Value));
        insert.execute(params_from_iter(row))?;
    }
    Ok(())
}

fn add_styles(db: &Connection, layers: &[Layer], changed: &str) -> rusqlite::Result<()> {
    db.execute_batch(schema::STYLES)?;
    let contents = "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, \
                    last_change) VALUES ('layer_styles', 'attributes', 'layer_styles', \
                    'styles by which QGIS shows the layers', ?)";
    db.execute(contents, params![changed])?;
    let sql = "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, \
               f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, \
               owner, ui, update_time) VALUES ('', '', ?, ?, ?, ?, '', 1, ?, '', NULL, ?)";
    for layer in layers.iter().filter(|l| l.geometry.is_some()) {
        let qml = qgis::qml(layer);
        db.execute(
            sql,
            params![layer.name, GEOMETRY, layer.name, qml, layer.about, changed],
        )?;
    }
    Ok(())
}

/// The latest time in the layers, or the start of 1970: no clock reaches a map.
fn last_change(layers: &[Layer]) -> String {
    let features = layers.iter().flat_map(|l| &l.features);
    let times = features
        .flat_map(|f| &f.values)
        .filter_map(|value| match value {
            Value::Time(time) => Some(*time),
            _ => None,
        });
    times.max().map_or(EPOCH.to_owned(), milliseconds)
}

/// A time as `GeoPackage` has it: RFC 3339 with exactly three decimals.
fn milliseconds(time: Time) -> String {
    format!("{time:.3}")
}

/// A geometry in `GeoPackage`'s own binary: a header with the box around it, then well-known binary.
fn blob(feature: &Feature, srs_id: i32) -> Option<Vec<u8>> {
    let geometry = feature.geometry.as_ref().filter(|g| !g.is_empty())?;
    let bounds = geometry.bounds()?;
    let is_point = matches!(geometry, Geometry::Point(_));
    // Little-endian; with a box for what is not a point.
    let flags = if is_point { 0b0000_0001 } else { 0b0000_0011 };
    let mut out = vec![b'G', b'P', 0, flags];
    out.extend(srs_id.to_le_bytes());
    if !is_point {
        let (min, max) = (bounds.min(), bounds.max());
        for x in [min.x, max.x, min.y, max.y] {
            out.extend(x.to_le_bytes());
        }
    }
    out.extend(wkt::binary(geometry));
    Some(out)
}

/// What goes into a cell of a table.
enum Cell {
    Value(Value),
    Blob(Vec<u8>),
}

impl ToSql for Cell {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        Ok(match self {
            Self::Value(Value::Null) => ToSqlOutput::Borrowed(ValueRef::Null),
            Self::Value(Value::Text(text)) => ToSqlOutput::from(text.as_str()),
            Self::Value(Value::Integer(n)) => ToSqlOutput::from(*n),
            Self::Value(Value::Real(x)) => ToSqlOutput::from(*x),
            Self::Value(Value::Time(time)) => ToSqlOutput::from(milliseconds(*time)),
            Self::Blob(bytes) => ToSqlOutput::Borrowed(ValueRef::Blob(bytes)),
        })
    }
}

#[cfg(test)]
mod tests;
