use geo::{Coord, Rect};
use rusqlite::types::Value as Sql;
use tempfile::NamedTempFile;

use super::super::layer::Column;
use super::*;
use crate::frame::Planet;

/// Two rocks, two ellipses of which one is nothing, and a table.
fn layers(planet: Planet) -> Vec<Layer> {
    type Of = Column<'static, (&'static str, Option<f64>)>;
    let columns = || -> Vec<Of> {
        vec![
            Of::text("name", "its name", |row| Some(row.0.to_owned())),
            Of::real("size_m", 4, "its size, m", |row| row.1),
            Of::count("n", "how many", |_| 7),
            Of::time("seen", "when", |_| Time::parse("1317027600.123456")),
        ]
    };
    let point = |x: f64, y: f64| Some(Geometry::Point(Coord { x, y }));
    let square = Rect::new((10.0, 20.0), (10.5, 21.0)).to_polygon();
    let area = |parts: Vec<geo::Polygon<f64>>| Some(Geometry::Polygons(parts.into()));
    let rocks = [
        ("b".to_owned(), point(10.25, 20.5), ("b", Some(0.123_456))),
        ("a".to_owned(), point(10.75, 20.25), ("a's", None)),
    ];
    let ellipses = [
        ("a".to_owned(), area(vec![square]), ("a", None)),
        ("b".to_owned(), area(Vec::new()), ("b", None)),
    ];
    let rows = [
        (String::new(), None, ("z", None)),
        (String::new(), None, ("y", None)),
    ];
    vec![
        Layer::new(("rocks", "Rocks", "where"), Some(Kind::Point), planet).filled(columns(), rocks),
        Layer::new(
            ("ellipses", "Ellipses", "how well"),
            Some(Kind::Polygon),
            planet,
        )
        .filled(columns(), ellipses),
        Layer::new(("evidence", "Evidence", "why"), None, planet).filled(columns(), rows),
    ]
}

/// The file as `SQLite` opens it from disk.
fn opened(bytes: &[u8]) -> (NamedTempFile, Connection) {
    let file = NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let db = Connection::open(file.path()).unwrap();
    (file, db)
}

fn rows(db: &Connection, sql: &str) -> Vec<Vec<Sql>> {
    let mut statement = db.prepare(sql).unwrap();
    let width = statement.column_count();
    let rows = statement.query_map([], |row| (0..width).map(|i| row.get(i)).collect());
    rows.unwrap().map(Result::unwrap).collect()
}

fn text(value: &str) -> Sql {
    Sql::Text(value.to_owned())
}

#[test]
fn what_was_written_is_read_back() {
    let (_file, db) = opened(&bytes(&layers(Planet::EARTH)).unwrap());
    assert_eq!(rows(&db, "PRAGMA integrity_check"), [[text("ok")]]);
    assert_eq!(
        rows(&db, "PRAGMA application_id"),
        [[Sql::Integer(0x4750_4b47)]]
    );
    assert_eq!(
        rows(&db, "PRAGMA foreign_key_check"),
        Vec::<Vec<Sql>>::new()
    );
    assert_eq!(rows(&db, "PRAGMA freelist_count"), [[Sql::Integer(0)]]);
    let seen = text("2011-09-26T09:00:00.123Z");
    assert_eq!(
        rows(&db, "SELECT fid, name, size_m, n, seen FROM rocks"),
        [
            [
                Sql::Integer(1),
                text("a's"),
                Sql::Null,
                Sql::Integer(7),
                seen.clone()
            ],
            [
                Sql::Integer(2),
                text("b"),
                Sql::Real(0.1235),
                Sql::Integer(7),
                seen.clone()
            ],
        ]
    );
    let order = "SELECT name, typeof(size_m) FROM evidence ORDER BY fid";
    assert_eq!(
        rows(&db, order),
        [[text("z"), text("null")], [text("y"), text("null")]]
    );
    assert_eq!(
        rows(
            &db,
            "SELECT data_type, identifier, last_change, min_x, max_y, srs_id \
                   FROM gpkg_contents WHERE table_name = 'rocks'"
        ),
        [[
            text("features"),
            text("Rocks"),
            seen,
            Sql::Real(10.25),
            Sql::Real(20.5),
            Sql::Integer(4326)
        ]]
    );
    assert_eq!(
        rows(
            &db,
            "SELECT table_name, geometry_type_name FROM gpkg_geometry_columns ORDER BY 1"
        ),
        [
            [text("ellipses"), text("MULTIPOLYGON")],
            [text("rocks"), text("POINT")]
        ]
    );
    assert_eq!(
        rows(
            &db,
            "SELECT description FROM gpkg_data_columns \
                   WHERE table_name = 'rocks' AND column_name = 'size_m'"
        ),
        [[text("its size, m")]]
    );
}

#[test]
fn geometries_have_their_header_and_absent_ones_are_null() {
    let (_file, db) = opened(&bytes(&layers(Planet::EARTH)).unwrap());
    let blobs = rows(&db, "SELECT geom FROM rocks WHERE name = 'b'");
    let Sql::Blob(point) = &blobs[0][0] else {
        panic!("{blobs:?}");
    };
    assert_eq!(point[..8], [b'G', b'P', 0, 1, 0xe6, 0x10, 0, 0]);
    assert_eq!(point[8..13], [1, 1, 0, 0, 0]);
    assert_eq!(point[13..21], 10.25f64.to_le_bytes());
    assert_eq!(point.len(), 8 + 5 + 16);
    let blobs = rows(&db, "SELECT geom FROM ellipses");
    let Sql::Blob(area) = &blobs[0][0] else {
        panic!("{blobs:?}");
    };
    assert_eq!(area[3], 3);
    let side = |i: usize| f64::from_le_bytes(area[8 + 8 * i..16 + 8 * i].try_into().unwrap());
    assert_eq!(
        [side(0), side(1), side(2), side(3)],
        [10.0, 10.5, 20.0, 21.0]
    );
    assert_eq!(blobs[1][0], Sql::Null);
}

#[test]
fn the_spatial_index_finds_what_is_there() {
    let (_file, db) = opened(&bytes(&layers(Planet::EARTH)).unwrap());
    let near = "SELECT id FROM rtree_rocks_geom WHERE minx > 10.5 AND miny > 20.0";
    assert_eq!(rows(&db, near), [[Sql::Integer(1)]]);
    assert_eq!(
        rows(&db, "SELECT count(*) FROM rtree_ellipses_geom"),
        [[Sql::Integer(1)]]
    );
    let extensions = "SELECT table_name, extension_name FROM gpkg_extensions \
                      WHERE column_name = 'geom' ORDER BY table_name";
    let rtree = text("gpkg_rtree_index");
    assert_eq!(
        rows(&db, extensions),
        [[text("ellipses"), rtree.clone()], [text("rocks"), rtree]]
    );
    let triggers = "SELECT count(*) FROM sqlite_master WHERE type = 'trigger'";
    assert_eq!(rows(&db, triggers), [[Sql::Integer(14)]]);
}

#[test]
fn styles_are_applied_by_themselves() {
    let (_file, db) = opened(&bytes(&layers(Planet::EARTH)).unwrap());
    let styles = "SELECT f_table_name, f_geometry_column, useAsDefault, \
                  substr(styleQML, 1, 14) FROM layer_styles ORDER BY id";
    let style = |name| {
        [
            text(name),
            text("geom"),
            Sql::Integer(1),
            text("<!DOCTYPE qgis"),
        ]
    };
    assert_eq!(rows(&db, styles), [style("rocks"), style("ellipses")]);
}

#[test]
fn other_planets_have_their_own_system() {
    for (planet, code) in [(Planet::MOON, 30100), (Planet::MARS, 49900)] {
        let (_file, db) = opened(&bytes(&layers(planet)).unwrap());
        let used = "SELECT DISTINCT srs_id FROM gpkg_geometry_columns";
        assert_eq!(rows(&db, used), [[Sql::Integer(code)]]);
        let system = format!(
            "SELECT organization, definition FROM gpkg_spatial_ref_sys WHERE srs_id = {code}"
        );
        let found = rows(&db, &system);
        assert_eq!(found[0][0], text("IAU_2015"));
        let Sql::Text(wkt) = &found[0][1] else {
            panic!("{found:?}");
        };
        let radius = format!(",{},0]]", planet.ellipsoid.a);
        assert!(wkt.contains(&radius) && !wkt.contains("WGS"), "{wkt}");
    }
}

/// Westward longitudes are written eastwards, in a system that says so; planetocentric latitudes on an
/// ellipsoid, which well-known text 1 has no words for, take the extension for well-known text 2.
#[test]
fn systems_that_are_no_plain_latitude_and_longitude() {
    let system = |name: &str, columns: &str| {
        let planet = Planet::named(name).unwrap();
        let (_file, db) = opened(&bytes(&layers(planet)).unwrap());
        assert_eq!(
            rows(&db, "PRAGMA foreign_key_check"),
            Vec::<Vec<Sql>>::new()
        );
        rows(
            &db,
            &format!(
                "SELECT {columns} FROM gpkg_geometry_columns NATURAL JOIN gpkg_spatial_ref_sys \
                 WHERE table_name = 'rocks'"
            ),
        )
        .remove(0)
    };
    let ographic = system("IAU_2015:49901", "srs_id, organization, definition");
    assert_eq!(ographic[..2], [Sql::Integer(100_000), text("NONE")]);
    let Sql::Text(wkt) = &ographic[2] else {
        panic!("{ographic:?}");
    };
    assert!(wkt.contains("3396190,169.89444722361"), "{wkt}");
    let ocentric = system("IAU_2015:49902", "srs_id, definition, definition_12_063");
    assert_eq!(ocentric[..2], [Sql::Integer(49902), text("undefined")]);
    let Sql::Text(wkt) = &ocentric[2] else {
        panic!("{ocentric:?}");
    };
    assert!(
        wkt.starts_with("GEODCRS[\"Mars (2015) / Ocentric\""),
        "{wkt}"
    );
}

#[test]
fn nothing_still_has_tables_and_the_same_bytes_come_twice() {
    let mut empty = layers(Planet::EARTH);
    for layer in &mut empty {
        layer.features.clear();
    }
    let content = bytes(&empty).unwrap();
    assert_eq!(content, bytes(&empty).unwrap());
    let (_file, db) = opened(&content);
    assert_eq!(
        rows(&db, "SELECT name, size_m, geom FROM rocks"),
        Vec::<Vec<Sql>>::new()
    );
    assert_eq!(
        rows(
            &db,
            "SELECT min_x, srs_id, last_change FROM gpkg_contents \
                   WHERE table_name = 'rocks'"
        ),
        [[Sql::Null, Sql::Integer(4326), text(EPOCH)]]
    );
    let full = layers(Planet::EARTH);
    assert_eq!(bytes(&full).unwrap(), bytes(&full).unwrap());
}

#[test]
fn a_layer_on_a_map_has_its_system() {
    for (code, authority, number) in [
        ("EPSG:32633", "EPSG", 32633),
        ("+proj=laea +lat_0=20 +lon_0=10 +type=crs", "NONE", 100_000),
    ] {
        let crs = crate::frame::Crs::for_map(code, Planet::EARTH).unwrap();
        let on_map = |layer: &Layer| match layer.geometry {
            Some(_) => layer.on_map(&crs).unwrap(),
            None => layer.clone(),
        };
        let layers: Vec<Layer> = layers(Planet::EARTH).iter().map(on_map).collect();
        let (_file, db) = opened(&bytes(&layers).unwrap());
        assert_eq!(
            rows(&db, "PRAGMA foreign_key_check"),
            Vec::<Vec<Sql>>::new()
        );
        let sql = format!(
            "SELECT organization, organization_coordsys_id, substr(definition, 1, 7) FROM \
             gpkg_spatial_ref_sys WHERE srs_id = {number}"
        );
        let expected = [[text(authority), Sql::Integer(number), text("PROJCS[")]];
        assert_eq!(rows(&db, &sql), expected);
        let sql = "SELECT DISTINCT srs_id FROM gpkg_geometry_columns";
        assert_eq!(rows(&db, sql), [[Sql::Integer(number)]]);
        let sql = "SELECT min_x > 1000, max_y > 1000 FROM gpkg_contents WHERE table_name = 'rocks'";
        assert_eq!(rows(&db, sql), [[Sql::Integer(1), Sql::Integer(1)]]);
    }
}
