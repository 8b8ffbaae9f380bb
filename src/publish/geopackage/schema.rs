//! The tables, indices and triggers of a `GeoPackage`, as SQL.

use super::{FieldKind, GEOMETRY, Kind, Layer};

/// What every file has: the format's marks, and the tables that describe the others.
pub(super) const BASE: &str = r#"
PRAGMA page_size = 4096;
PRAGMA application_id = 1196444487;
PRAGMA user_version = 10300;
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL, srs_id INTEGER NOT NULL PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
  description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id));
CREATE TABLE gpkg_extensions (
  table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
CREATE TABLE gpkg_data_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, name TEXT, title TEXT, description TEXT,
  mime_type TEXT, constraint_name TEXT,
  CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
  CONSTRAINT gdc_tn UNIQUE (table_name, name));
CREATE TABLE gpkg_data_column_constraints (
  constraint_name TEXT NOT NULL, constraint_type TEXT NOT NULL, value TEXT, min NUMERIC,
  min_is_inclusive BOOLEAN, max NUMERIC, max_is_inclusive BOOLEAN, description TEXT,
  CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value));
INSERT INTO gpkg_extensions VALUES
  ('gpkg_data_columns', NULL, 'gpkg_schema',
   'http://www.geopackage.org/spec130/#extension_schema', 'read-write'),
  ('gpkg_data_column_constraints', NULL, 'gpkg_schema',
   'http://www.geopackage.org/spec130/#extension_schema', 'read-write');
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined',
   'undefined Cartesian coordinate reference system'),
  ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined',
   'undefined geographic coordinate reference system'),
  ('WGS 84 geodetic', 4326, 'EPSG', 4326,
   'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]',
   'longitude/latitude coordinates in decimal degrees on the WGS 84 spheroid');
"#;

/// Room for well-known text 2, where a system has no well-known text 1.
pub(super) const WKT2: &str = r"
ALTER TABLE gpkg_spatial_ref_sys ADD COLUMN definition_12_063 TEXT NOT NULL DEFAULT 'undefined';
INSERT INTO gpkg_extensions VALUES
  ('gpkg_spatial_ref_sys', 'definition_12_063', 'gpkg_crs_wkt',
   'http://www.geopackage.org/spec130/#extension_crs_wkt', 'read-write');
";

/// The table of styles, as QGIS makes it.
pub(super) const STYLES: &str = r#"
CREATE TABLE layer_styles (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, f_table_catalog TEXT(256),
  f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256),
  styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT,
  owner TEXT(30), ui TEXT(30),
  update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')));
"#;

/// The table of a layer.
pub(super) fn table(layer: &Layer) -> String {
    let key = "fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL".to_owned();
    let geometry = layer
        .geometry
        .map(|kind| format!("{GEOMETRY} {}", geometry_type(kind)));
    let fields = layer.fields.iter().map(|field| {
        let kind = match field.kind {
            FieldKind::Text => "TEXT",
            FieldKind::Integer => "INTEGER",
            FieldKind::Real(_) => "REAL",
            FieldKind::Time => "DATETIME",
        };
        format!("\"{}\" {kind}", field.name)
    });
    let columns: Vec<String> = std::iter::once(key).chain(geometry).chain(fields).collect();
    format!("CREATE TABLE \"{}\" ({});", layer.name, columns.join(", "))
}

/// The declared type of a layer's geometries.
pub(super) fn geometry_type(kind: Kind) -> &'static str {
    match kind {
        Kind::Point => "POINT",
        Kind::Line => "MULTILINESTRING",
        Kind::Polygon => "MULTIPOLYGON",
    }
}

/// The spatial index of a layer, empty.
pub(super) fn index(layer: &str) -> String {
    format!(
        "CREATE VIRTUAL TABLE \"rtree_{layer}_{GEOMETRY}\" \
         USING rtree(id, minx, maxx, miny, maxy); \
         INSERT INTO gpkg_extensions VALUES ('{layer}', '{GEOMETRY}', 'gpkg_rtree_index', \
         'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');"
    )
}

/// The triggers that keep the index true when other programs edit the layer: those of version 1.4
/// (annex F.3), which mend an error in those of 1.3 that shows when rows are written anew.
pub(super) fn triggers(layer: &str) -> String {
    let there = |row: &str| format!("({row}.geom NOTNULL AND NOT ST_IsEmpty({row}.geom))");
    let gone = |row: &str| format!("({row}.geom ISNULL OR ST_IsEmpty({row}.geom))");
    let (new, old) = (there("NEW"), there("OLD"));
    let (no_new, no_old) = (gone("NEW"), gone("OLD"));
    let values = "(NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), \
                  ST_MaxY(NEW.geom))";
    let index = format!("\"rtree_{layer}_{GEOMETRY}\"");
    let insert = format!("INSERT OR REPLACE INTO {index} VALUES {values};");
    let delete = |which: &str| format!("DELETE FROM {index} WHERE id {which};");
    let update = format!(
        "UPDATE {index} SET minx = ST_MinX(NEW.geom), maxx = ST_MaxX(NEW.geom), \
         miny = ST_MinY(NEW.geom), maxy = ST_MaxY(NEW.geom) WHERE id = NEW.fid;"
    );
    let same = "OLD.fid = NEW.fid";
    let other = "OLD.fid != NEW.fid";
    let of_geometry = "UPDATE OF geom";
    let all = [
        ("insert", "INSERT", new.clone(), insert.clone()),
        (
            "update2",
            of_geometry,
            format!("{same} AND {no_new}"),
            delete("= OLD.fid"),
        ),
        (
            "update4",
            "UPDATE",
            format!("{other} AND {no_new}"),
            delete("IN (OLD.fid, NEW.fid)"),
        ),
        (
            "update5",
            "UPDATE",
            format!("{other} AND {new}"),
            format!("{} {insert}", delete("= OLD.fid")),
        ),
        (
            "update6",
            of_geometry,
            format!("{same} AND {new} AND {old}"),
            update,
        ),
        (
            "update7",
            of_geometry,
            format!("{same} AND {new} AND {no_old}"),
            insert,
        ),
        (
            "delete",
            "DELETE",
            "OLD.geom NOTNULL".to_owned(),
            delete("= OLD.fid"),
        ),
    ];
    let trigger = |(name, event, when, action): (&str, &str, String, String)| {
        format!(
            "CREATE TRIGGER \"rtree_{layer}_{GEOMETRY}_{name}\" AFTER {event} ON \"{layer}\" \
             WHEN {when} BEGIN {action} END;\n"
        )
    };
    all.map(trigger).concat()
}
