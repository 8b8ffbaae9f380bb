//! GeoJSON as RFC 7946 has it, with the decimals the contract asks for.

use std::fmt::Write as _;

use geo::{Coord, Orient, Polygon, orient::Direction};
use serde_json::{Map, Value as Json};

use super::layer::{DECIMALS, Feature, Field, Geometry, Layer, Value};

/// A layer as the text of a GeoJSON file. One cut feature makes the whole layer Multi.
pub fn text(layer: &Layer) -> String {
    let multi = layer.features.iter().any(needs_multi);
    let mut text = String::from("{\n\"type\": \"FeatureCollection\",\n");
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\"name\": {},", Json::from(layer.name));
    if !layer.planet.is_earth() {
        let code = layer.planet.crs.trim_start_matches("IAU_2015:");
        let urn = format!("urn:ogc:def:crs:IAU:2015:{code}");
        let _ = writeln!(
            text,
            "\"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \"{urn}\"}}}},"
        );
    }
    text.push_str("\"features\": [");
    for (i, feature) in layer.features.iter().enumerate() {
        text.push_str(if i == 0 { "\n" } else { ",\n" });
        let geometry = feature.geometry.as_ref();
        let geometry = geometry.map_or("null".to_owned(), |g| geometry_text(g, multi));
        let _ = write!(
            text,
            "{{\"type\": \"Feature\", \"id\": {}, \"geometry\": {geometry}, \"properties\": {}}}",
            Json::from(feature.id.as_str()),
            Json::Object(properties(&layer.fields, feature))
        );
    }
    text.push_str("\n]\n}\n");
    text
}

fn properties(fields: &[Field], feature: &Feature) -> Map<String, Json> {
    let pairs = fields.iter().zip(&feature.values);
    pairs
        .map(|(field, value)| (field.name.to_owned(), json(value)))
        .collect()
}

/// A value as JSON; numbers that are not counts keep their decimal point.
fn json(value: &Value) -> Json {
    match value {
        Value::Null => Json::Null,
        Value::Text(text) => Json::from(text.as_str()),
        Value::Integer(n) => Json::from(*n),
        Value::Real(x) => Json::from(*x),
        Value::Time(time) => Json::from(time.to_string()),
    }
}

fn needs_multi(feature: &Feature) -> bool {
    match &feature.geometry {
        Some(Geometry::Lines(lines)) => lines.len() > 1,
        Some(Geometry::Polygons(polygons)) => polygons.0.len() > 1,
        Some(Geometry::Point(_)) | None => false,
    }
}

fn geometry_text(geometry: &Geometry, multi: bool) -> String {
    let (kind, parts): (&str, Vec<String>) = match geometry {
        Geometry::Point(at) => {
            return format!("{{\"type\": \"Point\", \"coordinates\": {}}}", position(at));
        }
        Geometry::Lines(lines) => ("LineString", lines.iter().map(|l| positions(l)).collect()),
        Geometry::Polygons(polygons) => (
            "Polygon",
            polygons
                .orient(Direction::Default)
                .iter()
                .map(rings)
                .collect(),
        ),
    };
    match &parts[..] {
        [] => "null".to_owned(),
        [only] if !multi => format!("{{\"type\": \"{kind}\", \"coordinates\": {only}}}"),
        parts => format!(
            "{{\"type\": \"Multi{kind}\", \"coordinates\": [{}]}}",
            parts.join(", ")
        ),
    }
}

fn rings(polygon: &Polygon<f64>) -> String {
    let rings = std::iter::once(polygon.exterior()).chain(polygon.interiors());
    let rings: Vec<String> = rings.map(|ring| positions(&ring.0)).collect();
    format!("[{}]", rings.join(", "))
}

fn positions(coords: &[Coord<f64>]) -> String {
    let all: Vec<String> = coords.iter().map(position).collect();
    format!("[{}]", all.join(", "))
}

fn position(at: &Coord<f64>) -> String {
    format!("[{}, {}]", decimal(at.x), decimal(at.y))
}

fn decimal(x: f64) -> String {
    let text = format!("{x:.DECIMALS$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::super::layer::{Column, Kind};
    use super::*;
    use crate::frame::Planet;

    #[test]
    fn floats_keep_their_point_and_zero_its_sign() {
        assert_eq!(json(&Value::Real(2.0)).to_string(), "2.0");
        assert_eq!(json(&Value::Integer(2)).to_string(), "2");
        assert_eq!(decimal(-1e-12), "0.000000000");
        assert_eq!(decimal(-70.123_456_789_4), "-70.123456789");
    }

    #[test]
    fn one_cut_feature_makes_the_whole_layer_multi() {
        let line = |x: f64| vec![Coord { x, y: 0.0 }, Coord { x, y: 1.0 }];
        let one = ("b".to_owned(), Some(Geometry::Lines(vec![line(1.0)])), ());
        let two = Geometry::Lines(vec![line(1.0), line(2.0)]);
        let layer = Layer::new(("traverse", "", ""), Some(Kind::Line), Planet::EARTH);
        let layer = layer.filled(Vec::new(), [one, ("a".to_owned(), Some(two), ())]);
        let text = text(&layer);
        assert_eq!(text.matches("\"MultiLineString\"").count(), 2);
        assert!(text.find("\"id\": \"a\"") < text.find("\"id\": \"b\""));
        let parsed: Json = serde_json::from_str(&text).unwrap();
        assert!(parsed.get("crs").is_none());
    }

    #[test]
    fn another_planet_is_never_called_wgs84() {
        let layer = Layer::new(("rocks", "", ""), Some(Kind::Point), Planet::MARS);
        let columns = vec![Column::count("n", "", |_: &()| 1)];
        let parsed: Json = serde_json::from_str(&text(&layer.filled(columns, []))).unwrap();
        assert_eq!(
            parsed["crs"]["properties"]["name"],
            "urn:ogc:def:crs:IAU:2015:49900"
        );
    }
}
