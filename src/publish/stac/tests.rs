use geo::LineString;

use super::super::layer::{Column, Kind};
use super::super::mosaic::MosaicScale;
use super::*;

fn layer(planet: Planet, geometry: Geometry, times: &[&str]) -> Layer {
    let columns: Vec<Column<'_, &str>> =
        vec![Column::time("time", "", |row: &&str| Time::parse(row))];
    let rows = times
        .iter()
        .map(|&t| (t.to_owned(), Some(geometry.clone()), t));
    Layer::new(("footprints", "", ""), Some(Kind::Polygon), planet).filled(columns, rows)
}

fn item(planet: Planet, layers: &[Layer]) -> Option<Json> {
    let files = [
        "rocks.geojson",
        "rocks.qml",
        "rockmap.gpkg",
        "run.json",
        "evidence.csv",
    ];
    let item = Item {
        id: "site-0123".to_owned(),
        title: "site",
        planet,
        layers,
        assets: files.into_iter().filter_map(Asset::of).collect(),
    };
    Some(serde_json::from_str(&text(&item)?).unwrap())
}

fn square(west: f64, east: f64) -> geo::Polygon<f64> {
    Rect::new((west, 10.0), (east, 11.0)).to_polygon()
}

#[test]
fn place_and_time_are_those_of_the_data() {
    let area = Geometry::Polygons(square(20.0, 21.0).into());
    let found = item(
        Planet::EARTH,
        &[layer(Planet::EARTH, area, &["10", "20.5"])],
    )
    .unwrap();
    assert_eq!(found["bbox"], json!([20.0, 10.0, 21.0, 11.0]));
    assert_eq!(found["geometry"]["type"], "Polygon");
    assert_eq!(found["properties"]["datetime"], Json::Null);
    assert_eq!(
        found["properties"]["start_datetime"],
        "1970-01-01T00:00:10Z"
    );
    assert_eq!(
        found["properties"]["end_datetime"],
        "1970-01-01T00:00:20.5Z"
    );
    assert_eq!(found["properties"]["proj:code"], "EPSG:4326");
    let assets = found["assets"].as_object().unwrap();
    assert_eq!(assets.len(), 4);
    assert_eq!(assets["rocks.geojson"]["type"], "application/geo+json");
    assert_eq!(assets["evidence.csv"]["roles"], json!(["metadata"]));
    assert_eq!(assets["rockmap.gpkg"]["href"], "./rockmap.gpkg");
}

#[test]
fn a_map_over_the_antimeridian_has_two_boxes() {
    let parts = vec![square(179.5, 180.0), square(-180.0, -179.75)];
    let area = Geometry::Polygons(parts.into());
    let found = item(Planet::MARS, &[layer(Planet::MARS, area, &["10"])]).unwrap();
    assert_eq!(found["bbox"], json!([179.5, 10.0, -179.75, 11.0]));
    assert_eq!(found["geometry"]["type"], "MultiPolygon");
    assert_eq!(found["properties"]["datetime"], "1970-01-01T00:00:10Z");
    assert_eq!(found["properties"]["ssys:targets"], json!(["Mars"]));
    assert_eq!(found["properties"]["proj:code"], "IAU_2015:49900");
}

#[test]
fn without_time_or_place_there_is_no_item() {
    let area = Geometry::Polygons(square(20.0, 21.0).into());
    assert!(item(Planet::EARTH, &[layer(Planet::EARTH, area, &["never"])]).is_none());
    let nowhere = Geometry::Lines(vec![LineString::<f64>::new(Vec::new()).0]);
    assert!(item(Planet::EARTH, &[layer(Planet::EARTH, nowhere, &["1"])]).is_none());
}

#[test]
fn the_mosaic_names_its_own_system_and_pixels() {
    let files = ["rocks.geojson", "mosaic.tif"];
    let about = |crs: &str| {
        let grid = MosaicGrid {
            crs: crs.to_owned(),
            west_m: 500_000.0,
            north_m: 7_000_000.0,
            scale: MosaicScale { m_per_px: 0.05 },
            columns: 700,
            rows: 300,
        };
        let [rocks, mosaic] = files.map(|f| Asset::of(f).unwrap().on_grid(Some(&grid)).json());
        assert!(rocks.get("proj:shape").is_none() && rocks.get("proj:code").is_none());
        mosaic
    };
    let in_zone = about("EPSG:32719");
    assert_eq!(in_zone["proj:code"], "EPSG:32719");
    assert_eq!(in_zone["proj:shape"], json!([300, 700]));
    assert_eq!(
        in_zone["proj:transform"],
        json!([0.05, 0.0, 500_000.0, 0.0, -0.05, 7_000_000.0])
    );
    let local = about("+proj=tmerc +lat_0=4.5 +lon_0=137.4 +R=3396190 +units=m +type=crs");
    assert_eq!(local["proj:code"], Json::Null);
    assert_eq!(local["proj:projjson"]["type"], "ProjectedCRS");
    let plain = Asset::of("mosaic.tif").unwrap().on_grid(None).json();
    assert!(plain.get("proj:shape").is_none());
}
