//! Reads a map of rocks, this program's or another's.

use std::path::Path;

use serde_json::{Map, Value};

use crate::error::{Error, Fault, Place};
use crate::frame::{Ellipse, Geodetic, Planet};

/// A map of rocks, as a GeoJSON file of points gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct RockMap {
    /// The planet it is drawn on.
    pub planet: Planet,
    /// The objects, in the order of the file.
    pub estimates: Vec<Estimate>,
}

/// One mapped object.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// `rock_id`, else the feature's own id, else `#` and its number in the file, from 1.
    pub rock_id: String,
    /// What it is, where the map says.
    pub class: Option<String>,
    /// Where it is; heights play no part, and are zero.
    pub place: Geodetic,
    /// The probability that it exists, where the map says.
    pub p_exist: Option<f64>,
    /// The 1-sigma ellipse of its place, where the map gives one that is not flat.
    pub ellipse: Option<Ellipse>,
}

/// Reads a GeoJSON `FeatureCollection` of points.
///
/// Only the geometry is required. Of the properties `rock_id`, `class`, `p_exist`, `sigma_major_m`,
/// `sigma_minor_m` and `sigma_az_deg` are read, and each may be null or missing. The planet is
/// Earth, or the one a legacy `crs` member `urn:ogc:def:crs:IAU:2015:<code>` names. `shown` is the
/// name faults call the file by.
///
/// # Errors
/// A file that cannot be read, what is not GeoJSON, a feature that is not a point on the planet, a
/// number outside its domain, a rock id that stands twice.
pub fn read_map(path: &Path, shown: &str) -> Result<RockMap, Error> {
    let text = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    map_from_bytes(&text, shown)
}

/// As [`read_map`], from the bytes of a file.
///
/// # Errors
/// As [`read_map`].
pub fn map_from_bytes(bytes: &[u8], shown: &str) -> Result<RockMap, Error> {
    let root: Value = serde_json::from_slice(bytes).map_err(|e| syntax_fault(&e, shown))?;
    let fault = |field: &str, found: String, expected: &str| {
        Fault::found(Place::file(shown), field, found, expected)
    };
    if root["type"] != "FeatureCollection" {
        let found = described(&root["type"]);
        return Err(fault("type", found, "\"FeatureCollection\"").into());
    }
    let planet = planet_of(&root["crs"])
        .map_err(|found| fault("crs", found, "WGS84, or urn:ogc:def:crs:IAU:2015:<code>"))?;
    let Some(features) = root["features"].as_array() else {
        let found = described(&root["features"]);
        return Err(fault("features", found, "a list").into());
    };
    let mut estimates = Vec::with_capacity(features.len());
    let mut faults = Vec::new();
    for (index, feature) in features.iter().enumerate() {
        let reader = FeatureReader {
            shown,
            index,
            planet,
        };
        match reader.estimate(feature) {
            Ok(estimate) => estimates.push(estimate),
            Err(fault) => faults.push(fault),
        }
    }
    faults.extend(first_repeat(&estimates, shown));
    Error::check(faults)?;
    Ok(RockMap { planet, estimates })
}

/// One feature of a file, whose faults name it.
struct FeatureReader<'a> {
    shown: &'a str,
    index: usize,
    planet: Planet,
}

impl FeatureReader<'_> {
    fn fault(&self, field: &str, found: impl std::fmt::Display, expected: &str) -> Fault {
        let field = format!("features[{}].{field}", self.index);
        Fault::found(Place::file(self.shown), field, found, expected)
    }

    fn estimate(&self, feature: &Value) -> Result<Estimate, Fault> {
        let none = Map::new();
        let properties = feature["properties"].as_object().unwrap_or(&none);
        let number = |key: &str, low: f64, high: f64, expected: &str| match properties.get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => match value.as_f64() {
                Some(x) if (low..=high).contains(&x) => Ok(Some(x)),
                _ => Err(self.fault(&format!("properties.{key}"), described(value), expected)),
            },
        };
        let sigma = |key| number(key, 0.0, f64::MAX, "a number not below zero");
        let p_exist = number("p_exist", 0.0, 1.0, "0 to 1")?;
        let (major, minor) = (sigma("sigma_major_m")?, sigma("sigma_minor_m")?);
        let azimuth_deg = number("sigma_az_deg", f64::MIN, f64::MAX, "a number")?;
        let id = [properties.get("rock_id"), feature.get("id")];
        Ok(Estimate {
            rock_id: id
                .into_iter()
                .flatten()
                .find_map(name)
                .unwrap_or_else(|| format!("#{}", self.index + 1)),
            class: properties.get("class").and_then(name),
            place: self.place(&feature["geometry"])?,
            p_exist,
            ellipse: ellipse(major, minor, azimuth_deg),
        })
    }

    fn place(&self, geometry: &Value) -> Result<Geodetic, Fault> {
        let coordinates = &geometry["coordinates"];
        let pair = match geometry["type"].as_str() {
            Some("Point") => coordinates,
            Some("MultiPoint") if coordinates.as_array().is_some_and(|c| c.len() == 1) => {
                &coordinates[0]
            }
            _ => {
                let found = match geometry["type"].as_str() {
                    Some(kind) => kind.to_owned(),
                    None => described(geometry),
                };
                return Err(self.fault("geometry", found, "Point"));
            }
        };
        let (Some(lon_deg), Some(lat_deg)) = (pair[0].as_f64(), pair[1].as_f64()) else {
            let expected = "longitude and latitude";
            return Err(self.fault("geometry.coordinates", pair, expected));
        };
        if !(-90.0..=90.0).contains(&lat_deg) || !(-360.0..=360.0).contains(&lon_deg) {
            let expected = "longitude and latitude in degrees";
            return Err(self.fault("geometry.coordinates", pair, expected));
        }
        Ok(self.planet.eastward().place(lat_deg, lon_deg, 0.0))
    }
}

/// A flat or missing ellipse says nothing that errors could be measured by.
fn ellipse(major: Option<f64>, minor: Option<f64>, azimuth_deg: Option<f64>) -> Option<Ellipse> {
    let (major, minor) = (major?, minor?);
    let azimuth = azimuth_deg.or((major == minor).then_some(0.0))?;
    (minor > 0.0 && major > 0.0).then(|| Ellipse {
        sigma_major_m: major,
        sigma_minor_m: minor,
        azimuth: azimuth.to_radians(),
    })
}

/// A name given as text or as a number.
fn name(value: &Value) -> Option<String> {
    match value {
        Value::String(text) if !text.is_empty() => Some(text.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}

fn described(value: &Value) -> String {
    match value {
        Value::Null => "nothing".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "an object".to_owned(),
        simple => simple.to_string(),
    }
}

/// The planet of a legacy `crs` member, or what it names instead.
fn planet_of(crs: &Value) -> Result<Planet, String> {
    if crs.is_null() {
        return Ok(Planet::EARTH);
    }
    let Some(urn) = crs["properties"]["name"].as_str() else {
        return Err(described(crs));
    };
    let earth = ["OGC:1.3:CRS84", "OGC::CRS84", "EPSG::4326", "EPSG:4326"];
    if earth.iter().any(|known| urn.ends_with(known)) {
        return Ok(Planet::EARTH);
    }
    urn.strip_prefix("urn:ogc:def:crs:IAU:2015:")
        .and_then(|code| Planet::named(&format!("IAU_2015:{code}")))
        .ok_or_else(|| format!("{urn:?}"))
}

fn syntax_fault(error: &serde_json::Error, shown: &str) -> Fault {
    let text = error.to_string();
    let what = text.split(" at line ").next().unwrap_or(&text);
    let place = Place {
        file: shown.to_owned(),
        line: u64::try_from(error.line()).ok().filter(|&line| line > 0),
        column: u64::try_from(error.column()).ok().filter(|&c| c > 0),
    };
    Fault::new(place, "", format!("not JSON: {what}"))
}

fn first_repeat(estimates: &[Estimate], shown: &str) -> Option<Fault> {
    let mut ids: Vec<&str> = estimates.iter().map(|e| e.rock_id.as_str()).collect();
    ids.sort_unstable();
    let twice = ids.windows(2).find(|pair| pair[0] == pair[1])?[0];
    let found = format!("{twice} twice");
    Some(Fault::found(
        Place::file(shown),
        "rock_id",
        found,
        "it once",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collection(features: &str) -> Result<RockMap, Error> {
        let text = format!("{{\"type\":\"FeatureCollection\",\"features\":[{features}]}}");
        map_from_bytes(text.as_bytes(), "rocks.geojson")
    }

    fn point(properties: &str) -> String {
        format!(
            "{{\"type\":\"Feature\",\"id\":\"a\",\"properties\":{properties},\
             \"geometry\":{{\"type\":\"Point\",\"coordinates\":[8.4,49.0,115.2]}}}}"
        )
    }

    fn message(result: Result<RockMap, Error>) -> String {
        result.unwrap_err().to_string()
    }

    #[test]
    fn reads_the_properties_of_the_format() {
        let feature = point(
            "{\"rock_id\":\"r7\",\"class\":\"rock\",\"p_exist\":0.75,\"sigma_major_m\":0.2,\
             \"sigma_minor_m\":0.1,\"sigma_az_deg\":90.0}",
        );
        let map = collection(&feature).unwrap();
        let rock = &map.estimates[0];
        assert_eq!(map.planet, Planet::EARTH);
        assert_eq!((rock.rock_id.as_str(), rock.p_exist), ("r7", Some(0.75)));
        assert_eq!(rock.class.as_deref(), Some("rock"));
        assert_eq!(rock.place, Geodetic::from_degrees(49.0, 8.4, 0.0));
        let ellipse = rock.ellipse.unwrap();
        assert_eq!((ellipse.sigma_major_m, ellipse.sigma_minor_m), (0.2, 0.1));
        assert_eq!(ellipse.azimuth, 90f64.to_radians());
    }

    #[test]
    fn maps_of_other_tools_lack_what_they_lack() {
        let bare = collection(&point("null")).unwrap();
        let rock = &bare.estimates[0];
        assert_eq!(rock.rock_id, "a");
        assert_eq!((rock.p_exist, rock.ellipse), (None, None));
        let flat = collection(&point(
            "{\"rock_id\":12,\"p_exist\":null,\"sigma_major_m\":0.0,\"sigma_minor_m\":0.0}",
        ));
        assert_eq!(flat.as_ref().unwrap().estimates[0].rock_id, "12");
        assert_eq!(flat.unwrap().estimates[0].ellipse, None);
        let unnamed = "{\"geometry\":{\"type\":\"MultiPoint\",\"coordinates\":[[8.4,49.0]]}}";
        assert_eq!(collection(unnamed).unwrap().estimates[0].rock_id, "#1");
    }

    #[test]
    fn another_planet_is_named_by_its_crs() {
        let text = "{\"type\":\"FeatureCollection\",\"crs\":{\"type\":\"name\",\"properties\":\
                    {\"name\":\"urn:ogc:def:crs:IAU:2015:49900\"}},\"features\":[]}";
        let map = map_from_bytes(text.as_bytes(), "rocks.geojson").unwrap();
        assert_eq!(map.planet, Planet::MARS);
        let text = text.replace("IAU:2015:49900", "EPSG::32632");
        assert_eq!(
            message(map_from_bytes(text.as_bytes(), "rocks.geojson")),
            "rocks.geojson: crs: found \"urn:ogc:def:crs:EPSG::32632\", expected WGS84, or \
             urn:ogc:def:crs:IAU:2015:<code>"
        );
    }

    #[test]
    fn faults_name_the_feature() {
        assert_eq!(
            message(collection(&point("{\"p_exist\":1.5}"))),
            "rocks.geojson: features[0].properties.p_exist: found 1.5, expected 0 to 1"
        );
        assert_eq!(
            message(collection(&point("{\"sigma_minor_m\":\"small\"}"))),
            "rocks.geojson: features[0].properties.sigma_minor_m: found \"small\", expected a \
             number not below zero"
        );
        assert_eq!(
            message(collection("{\"geometry\":{\"type\":\"Polygon\"}}, {}")),
            "rocks.geojson: features[0].geometry: found Polygon, expected Point\n\
             rocks.geojson: features[1].geometry: found nothing, expected Point"
        );
        let projected = point("{}").replace("8.4,49.0", "456114.6,5427629.2");
        assert_eq!(
            message(collection(&projected)),
            "rocks.geojson: features[0].geometry.coordinates: found \
             [456114.6,5427629.2,115.2], expected longitude and latitude in degrees"
        );
        let twice = format!("{},{}", point("{}"), point("{}"));
        assert_eq!(
            message(collection(&twice)),
            "rocks.geojson: rock_id: found a twice, expected it once"
        );
    }

    #[test]
    fn what_is_not_geojson_is_said() {
        let not = |text: &str| message(map_from_bytes(text.as_bytes(), "m.geojson"));
        assert_eq!(
            not("{\n \"type\" 1}"),
            "m.geojson:2:9: not JSON: expected `:`"
        );
        assert_eq!(
            not("{\"type\":\"Feature\"}"),
            "m.geojson: type: found \"Feature\", expected \"FeatureCollection\""
        );
        assert_eq!(
            not("{\"type\":\"FeatureCollection\"}"),
            "m.geojson: features: found nothing, expected a list"
        );
    }
}
