use std::io::{Cursor, Read as _};

use geo::Coord;

use super::super::format::Format;
use super::super::layer::{Column, Geometry};
use super::*;
use crate::frame::{Crs, Geodetic, Planet, Site};

type Row = (&'static str, Option<f64>);

fn rocks(planet: Planet, rows: &[Row]) -> Layer {
    type Of = Column<'static, Row>;
    let columns: Vec<Of> = vec![
        Of::text("class", "its class", |row| Some(row.0.to_owned())),
        Of::real("p_exist", 4, "whether it <exists>", |row| row.1),
        Of::count("n_views", "views", |_| 3),
    ];
    let at = Geometry::Point(Coord { x: 8.4, y: 49.0 });
    let rows = rows
        .iter()
        .map(|&row| ("a".to_owned(), Some(at.clone()), row));
    Layer::new(("rocks", "Rocks", ""), Some(Kind::Point), planet).filled(columns, rows)
}

fn filters(rows: &[Row]) -> Vec<String> {
    let rules = rules(&rocks(Planet::EARTH, rows));
    rules.into_iter().map(|rule| rule.filter).collect()
}

#[test]
fn colours_mean_existence_or_class_or_views() {
    let by_existence = filters(&[("rock", Some(0.9))]);
    assert!(
        by_existence.iter().all(|f| f.contains("p_exist")),
        "{by_existence:?}"
    );
    assert_eq!(
        filters(&[("it's", None), ("car", None)]),
        ["\"class\" = 'car'", "\"class\" = 'it''s'", "ELSE"]
    );
    let by_views = filters(&[("rock", None)]);
    assert_eq!(by_views[2], "\"n_views\" = 2");
    assert_eq!(filters(&[]), by_views);
}

#[test]
fn a_style_is_well_formed_and_escaped() {
    let text = qml(&rocks(Planet::EARTH, &[("rock", None)]));
    assert!(text.contains("name=\"whether it &lt;exists&gt;\""));
    assert!(text.contains("filter=\"&quot;n_views&quot; &gt;= 5\""));
    assert!(text.contains("coalesce(&quot;diameter_m&quot;, 0.2)"));
    assert!(text.contains("scaleMax=\"75\""));
    for tag in [
        "qgis",
        "renderer-v2",
        "symbol",
        "layer",
        "labeling",
        "data_defined_properties",
    ] {
        let opened =
            text.matches(&format!("<{tag} ")).count() + text.matches(&format!("<{tag}>")).count();
        assert_eq!(opened, text.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

fn project(planet: Planet, place: Geodetic, format: Format) -> String {
    project_over(planet, place, format, None)
}

fn project_over(planet: Planet, place: Geodetic, format: Format, mosaic: Option<Crs>) -> String {
    let layers = [rocks(planet, &[])];
    let site = Site::new(planet, place);
    let project = Project {
        title: "A & B",
        layers: &layers,
        format,
        site: &site,
        mosaic,
    };
    unpacked(&project)
}

fn unpacked(project: &Project<'_>) -> String {
    let bytes = qgz(project).unwrap();
    assert_eq!(bytes, qgz(project).unwrap());
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    assert_eq!(archive.len(), 1);
    let mut text = String::new();
    archive
        .by_name("rockmap.qgs")
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    text
}

#[test]
fn a_project_names_its_files_relative_to_itself() {
    let karlsruhe = Geodetic::from_degrees(49.0, 8.4, 0.0);
    let text = project(Planet::EARTH, karlsruhe, Format::GeoPackage);
    assert!(text.contains("<datasource>./rockmap.gpkg|layername=rocks</datasource>"));
    assert!(text.contains("<title>A &amp; B</title>"));
    assert!(text.contains("<authid>EPSG:32632</authid>"));
    assert!(text.contains("<authid>EPSG:4326</authid>"));
    let text = project(Planet::EARTH, karlsruhe, Format::GeoJson);
    assert!(text.contains("<datasource>./rocks.geojson</datasource>"));
    let south = Geodetic::from_degrees(-24.45, -69.93, 0.0);
    let text = project(Planet::EARTH, south, Format::GeoPackage);
    assert!(text.contains("<authid>EPSG:32719</authid>"));
}

#[test]
fn other_planets_and_poles_are_shown_about_their_own_site() {
    let pole = Geodetic::from_degrees(-89.5, 30.0, 0.0);
    for (planet, radius) in [(Planet::MOON, "1737400"), (Planet::EARTH, "298.257223563")] {
        let text = project(planet, pole, Format::GeoPackage);
        assert!(
            text.contains("Transverse Mercator") && text.contains(radius),
            "{planet:?}"
        );
    }
    let moon = project(Planet::MOON, pole, Format::GeoPackage);
    assert!(moon.contains("Sphere / Ocentric, about the site"));
    assert!(moon.contains("<authid>IAU_2015:30100</authid>") && !moon.contains("WGS"));
}

#[test]
fn the_mosaic_lies_under_everything_else() {
    let place = Geodetic::from_degrees(49.0, 8.4, 0.0);
    let alone = project(Planet::EARTH, place, Format::GeoPackage);
    assert!(!alone.contains("mosaic") && !alone.contains("<layerOpacity>0.5"));
    let site = Site::new(Planet::EARTH, place);
    let over = |wanted: Option<&Crs>| {
        let crs = crate::publish::mosaic::system(&site, wanted).unwrap();
        project_over(Planet::EARTH, place, Format::GeoPackage, Some(crs))
    };
    let text = over(None);
    let tree = text.split("</layer-tree-group>").next().unwrap();
    let last = tree.rsplit("<layer-tree-layer ").next().unwrap();
    assert!(last.contains("source=\"./mosaic.tif\""), "{last}");
    assert!(text.contains(
        "type=\"multibandcolor\" redBand=\"1\" greenBand=\"2\" blueBand=\"3\" alphaBand=\"4\""
    ));
    let system = |text: &str| {
        let layer = text.split("<datasource>./mosaic.tif").nth(1).unwrap();
        let id = layer.split("<authid>").nth(1).unwrap();
        id.split('<').next().unwrap().to_owned()
    };
    assert_eq!(system(&text), "EPSG:32632");
    // Degrees are no map, and feet are not metres.
    for (wanted, expected) in [
        ("EPSG:25833", "EPSG:25833"),
        ("EPSG:4258", "EPSG:32632"),
        ("EPSG:2263", "EPSG:32632"),
        ("EPSG:2053", "EPSG:32632"), // Counts westwards and southwards.
    ] {
        let wanted = Crs::for_map(wanted, Planet::EARTH).unwrap();
        assert_eq!(
            system(&over(Some(&wanted))),
            expected,
            "{}",
            wanted.definition()
        );
    }
}

/// Layers of another system than the planet's own say so, and the project opens where they are.
#[test]
fn layers_on_a_map_name_its_system() {
    let karlsruhe = Geodetic::from_degrees(49.0, 8.4, 0.0);
    let crs = Crs::for_map("EPSG:25833", Planet::EARTH).unwrap();
    let layer = rocks(Planet::EARTH, &[("rock", None)]);
    let layers = [layer.on_map(&crs).unwrap()];
    let site = Site::new(Planet::EARTH, karlsruhe);
    let project = Project {
        title: "A",
        layers: &layers,
        format: Format::GeoPackage,
        site: &site,
        mosaic: None,
    };
    let text = unpacked(&project);
    assert!(
        text.contains("<srid>25833</srid>\n<authid>EPSG:25833</authid>"),
        "{text}"
    );
    assert!(!text.contains("EPSG:4326"));
    assert!(text.contains("<geographicflag>false</geographicflag>"));
    // The extent is in UTM zone 32, about the place.
    assert!(text.contains("<xmin>456114.096</xmin>"), "{text}");
}
