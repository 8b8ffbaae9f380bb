use geo::{Coord, MultiPolygon};

use super::super::layer::Column as LayerColumn;
use super::*;
use crate::frame::CrsText;
use crate::frame::Planet;
use crate::pose::Time;

fn layer(planet: Planet) -> Layer {
    let columns: Vec<LayerColumn<'_, Option<f64>>> = vec![
        LayerColumn::text("name", "", |_| Some("stone".to_owned())),
        LayerColumn::real("size_m", 2, "", |row| *row),
        LayerColumn::time("seen", "", |_| Time::parse("1.5")),
    ];
    let point = |x: f64| Some(Geometry::Point(Coord { x, y: -2.0 }));
    let nothing = Some(Geometry::Polygons(MultiPolygon::new(Vec::new())));
    let rows = [
        ("a".to_owned(), point(1.0), Some(0.25)),
        ("b".to_owned(), nothing, None),
    ];
    Layer::new(("rocks", "Rocks", ""), Some(Kind::Point), planet).filled(columns, rows)
}

fn position(of: &[u8], within: &[u8]) -> Option<usize> {
    within.windows(of.len()).position(|w| w == of)
}

#[test]
fn the_file_is_framed_by_its_marks_and_its_footer() {
    let file = bytes(&layer(Planet::EARTH)).unwrap();
    assert!(file.starts_with(b"PAR1") && file.ends_with(b"PAR1"));
    let end = file.len() - 8;
    let length = u32::from_le_bytes(file[end..end + 4].try_into().unwrap());
    let footer = &file[end - usize::try_from(length).unwrap()..end];
    // Version 2, then a schema of the root, 3 properties, the geometry, the box and its 4 sides.
    assert_eq!(footer[..4], [0x15, 4, 0x19, 0xac]);
    for name in [
        "name", "size_m", "seen", "geometry", "bbox", "xmin", "geo", "rockmap",
    ] {
        assert!(position(name.as_bytes(), footer).is_some(), "{name}");
    }
}

#[test]
fn a_page_holds_which_cells_are_there_and_their_values() {
    let file = bytes(&layer(Planet::EARTH)).unwrap();
    // One present, one absent, as two runs; then 0.25.
    let mut page = vec![4, 0, 0, 0, 2, 1, 2, 0];
    page.extend(0.25f64.to_le_bytes());
    assert!(position(&page, &file).is_some());
    // Both present; 1.5 s in nanoseconds, twice.
    let mut page = vec![2, 0, 0, 0, 4, 1];
    page.extend(1_500_000_000_i64.to_le_bytes().repeat(2));
    assert!(position(&page, &file).is_some());
    let mut point = vec![21, 0, 0, 0];
    point.extend(wkt::binary(&Geometry::Point(Coord { x: 1.0, y: -2.0 })));
    assert!(position(&point, &file).is_some());
}

#[test]
fn the_metadata_name_the_planet() {
    let metadata = |planet: Planet| {
        let crs = CrsText::of(planet.crs).unwrap().projjson;
        geo_metadata(&layer(planet), Kind::Point, crs)
    };
    let earth = metadata(Planet::EARTH);
    assert_eq!(earth["version"], "1.1.0");
    let column = &earth["columns"]["geometry"];
    assert_eq!(
        column["crs"]["id"],
        json!({"authority": "EPSG", "code": 4326})
    );
    assert_eq!(column["bbox"], json!([1.0, -2.0, 1.0, -2.0]));
    let mars = metadata(Planet::MARS);
    let crs = &mars["columns"]["geometry"]["crs"];
    assert_eq!(crs["datum"]["ellipsoid"]["radius"], 3_396_190);
    assert!(!crs.to_string().contains("WGS"));
}

#[test]
fn nothing_still_has_columns() {
    let mut empty = layer(Planet::EARTH);
    empty.features.clear();
    let file = bytes(&empty).unwrap();
    assert!(position(b"size_m", &file).is_some());
    assert_eq!(file, bytes(&empty).unwrap());
}
