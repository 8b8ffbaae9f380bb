//! GeoJSON as RFC 7946 has it, with the decimals the contract asks for.

use std::fmt::Write as _;

use geo::{Coord, MapCoords, MultiPolygon, Orient, Polygon, orient::Direction};
use serde_json::{Map, Value};

use crate::frame::{Geodetic, Planet};

/// A layer: features of one kind of geometry, with the same properties in each.
pub struct Layer {
    name: &'static str,
    planet: Planet,
    features: Vec<Feature>,
}

/// A feature.
struct Feature {
    id: String,
    geometry: Geometry,
    properties: Map<String, Value>,
}

/// A geometry in (longitude, latitude), degrees.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A place.
    Point(Coord<f64>),
    /// Lines; one where nothing cuts them.
    Lines(Vec<Vec<Coord<f64>>>),
    /// Polygons; one where nothing cuts them. None is a feature without a geometry.
    Polygons(MultiPolygon<f64>),
}

/// Decimals of coordinates: a tenth of a millimetre on Earth.
const DECIMALS: usize = 9;

impl Layer {
    /// An empty layer.
    pub fn new(name: &'static str, planet: Planet) -> Self {
        Self {
            name,
            planet,
            features: Vec::new(),
        }
    }

    /// Adds a feature. Features come out sorted by id.
    pub fn add(&mut self, id: String, geometry: Geometry, properties: Map<String, Value>) {
        self.features.push(Feature {
            id,
            geometry,
            properties,
        });
    }

    /// The file's text.
    pub fn to_text(mut self) -> String {
        self.features.sort_by(|a, b| a.id.cmp(&b.id));
        let multi = self.features.iter().any(|f| f.geometry.needs_multi());
        let mut text = String::from("{\n\"type\": \"FeatureCollection\",\n");
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\"name\": {},", Value::from(self.name));
        if !self.planet.is_earth() {
            let code = self.planet.crs.trim_start_matches("IAU_2015:");
            let urn = format!("urn:ogc:def:crs:IAU:2015:{code}");
            let _ = writeln!(
                text,
                "\"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \"{urn}\"}}}},"
            );
        }
        text.push_str("\"features\": [");
        for (i, feature) in self.features.into_iter().enumerate() {
            text.push_str(if i == 0 { "\n" } else { ",\n" });
            let _ = write!(
                text,
                "{{\"type\": \"Feature\", \"id\": {}, \"geometry\": {}, \"properties\": {}}}",
                Value::from(feature.id),
                feature.geometry.of_files(self.planet).to_text(multi),
                Value::Object(feature.properties)
            );
        }
        text.push_str("\n]\n}\n");
        text
    }
}

impl Geometry {
    fn needs_multi(&self) -> bool {
        match self {
            Self::Point(_) => false,
            Self::Lines(lines) => lines.len() > 1,
            Self::Polygons(polygons) => polygons.0.len() > 1,
        }
    }

    /// The same with latitudes as the planet's files have them.
    fn of_files(self, planet: Planet) -> Self {
        let planet = planet.eastward();
        if planet.is_plain() {
            return self;
        }
        let at = |at: Coord<f64>| {
            let (y, x) = planet.lat_lon_deg(Geodetic::from_degrees(at.y, at.x, 0.0));
            Coord { x, y }
        };
        match self {
            Self::Point(point) => Self::Point(at(point)),
            Self::Lines(mut lines) => {
                for point in lines.iter_mut().flatten() {
                    *point = at(*point);
                }
                Self::Lines(lines)
            }
            Self::Polygons(polygons) => Self::Polygons(polygons.map_coords(at)),
        }
    }

    fn to_text(&self, multi: bool) -> String {
        let (kind, parts): (&str, Vec<String>) = match self {
            Self::Point(at) => {
                return format!("{{\"type\": \"Point\", \"coordinates\": {}}}", position(at));
            }
            Self::Lines(lines) => ("LineString", lines.iter().map(|l| positions(l)).collect()),
            Self::Polygons(polygons) => (
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

/// A number rounded to `decimals` places, always written with a decimal point.
pub fn number(x: f64, decimals: i32) -> Value {
    let scale = 10f64.powi(decimals);
    // Adding zero turns a negative zero into zero.
    Value::from((x * scale).round() / scale + 0.0)
}

/// A number that may be absent.
pub fn optional(x: Option<f64>, decimals: i32) -> Value {
    x.map_or(Value::Null, |x| number(x, decimals))
}

/// A place as (longitude, latitude), degrees.
pub fn lon_lat(place: Geodetic) -> Coord<f64> {
    Coord {
        x: place.lon_deg(),
        y: place.lat_deg(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_keep_their_point_and_zero_its_sign() {
        assert_eq!(number(2.0, 3).to_string(), "2.0");
        assert_eq!(number(-0.0001, 3).to_string(), "0.0");
        assert_eq!(number(1.23456, 3).to_string(), "1.235");
        assert_eq!(decimal(-1e-12), "0.000000000");
        assert_eq!(decimal(-70.123_456_789_4), "-70.123456789");
    }

    #[test]
    fn one_cut_feature_makes_the_whole_layer_multi() {
        let line = |x: f64| vec![Coord { x, y: 0.0 }, Coord { x, y: 1.0 }];
        let mut layer = Layer::new("traverse", Planet::EARTH);
        layer.add("b".into(), Geometry::Lines(vec![line(1.0)]), Map::new());
        layer.add(
            "a".into(),
            Geometry::Lines(vec![line(1.0), line(2.0)]),
            Map::new(),
        );
        let text = layer.to_text();
        assert_eq!(text.matches("\"MultiLineString\"").count(), 2);
        assert!(text.find("\"id\": \"a\"") < text.find("\"id\": \"b\""));
        let parsed: Value = serde_json::from_str(&text).unwrap();
        assert!(parsed.get("crs").is_none());
    }

    #[test]
    fn another_planet_is_never_called_wgs84() {
        let text = Layer::new("rocks", Planet::MARS).to_text();
        let parsed: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            parsed["crs"]["properties"]["name"],
            "urn:ogc:def:crs:IAU:2015:49900"
        );
    }
}
