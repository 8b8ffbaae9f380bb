//! What the views of a map could have seen.

use geo::{BoundingRect, Contains, Coord, LineString, MultiPolygon, Point, Polygon, Rect};
use serde_json::Value;

use crate::error::{Error, Fault, Place};
use crate::frame::Geodetic;

/// The footprints of a map's views, in (longitude, latitude), degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    footprints: Vec<(Rect<f64>, MultiPolygon<f64>)>,
}

impl Coverage {
    /// The coverage of these footprints.
    pub fn new(footprints: impl IntoIterator<Item = MultiPolygon<f64>>) -> Self {
        let boxed = |area: MultiPolygon<f64>| Some((area.bounding_rect()?, area));
        Self {
            footprints: footprints.into_iter().filter_map(boxed).collect(),
        }
    }

    /// The coverage of a GeoJSON file of polygons, such as footprints.geojson. `shown` is the name
    /// faults call the file by.
    ///
    /// # Errors
    /// What is not a GeoJSON collection of polygons.
    pub fn from_bytes(bytes: &[u8], shown: &str) -> Result<Self, Error> {
        let fault = |field: String, found: &str, expected: &str| {
            Error::from(Fault::found(Place::file(shown), field, found, expected))
        };
        let root: Value = serde_json::from_slice(bytes)
            .map_err(|e| Fault::new(Place::file(shown), "", format!("not JSON: {e}")))?;
        let Some(features) = root["features"].as_array() else {
            return Err(fault("features".to_owned(), "no list", "a list"));
        };
        let mut footprints = Vec::with_capacity(features.len());
        for (i, feature) in features.iter().enumerate() {
            let geometry = &feature["geometry"];
            let coordinates = &geometry["coordinates"];
            let area = match geometry["type"].as_str() {
                None if geometry.is_null() => Some(MultiPolygon(Vec::new())),
                Some("Polygon") => polygon(coordinates).map(MultiPolygon::from),
                Some("MultiPolygon") => coordinates
                    .as_array()
                    .and_then(|list| list.iter().map(polygon).collect())
                    .map(MultiPolygon),
                _ => None,
            };
            let found = || fault(format!("features[{i}].geometry"), "none", "a polygon");
            footprints.push(area.ok_or_else(found)?);
        }
        Ok(Self::new(footprints))
    }

    /// How many footprints cover a place.
    pub fn count(&self, place: Geodetic) -> usize {
        let at = Coord {
            x: place.lon_deg(),
            y: place.lat_deg(),
        };
        let covers = |(bounds, area): &&(Rect<f64>, MultiPolygon<f64>)| {
            let (low, high) = (bounds.min(), bounds.max());
            let inside = (low.x..=high.x).contains(&at.x) && (low.y..=high.y).contains(&at.y);
            inside && area.contains(&Point(at))
        };
        self.footprints.iter().filter(covers).count()
    }
}

fn polygon(rings: &Value) -> Option<Polygon<f64>> {
    let rings: Option<Vec<LineString<f64>>> = rings.as_array()?.iter().map(ring).collect();
    let mut rings = rings?.into_iter();
    Some(Polygon::new(rings.next()?, rings.collect()))
}

fn ring(points: &Value) -> Option<LineString<f64>> {
    let corner = |point: &Value| {
        Some(Coord {
            x: point[0].as_f64()?,
            y: point[1].as_f64()?,
        })
    };
    let corners: Option<Vec<Coord<f64>>> = points.as_array()?.iter().map(corner).collect();
    Some(LineString(corners?))
}
