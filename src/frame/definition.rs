//! What PROJ says a coordinate reference system is made of.

use proj::Proj;
use serde_json::Value;

use super::{CrsError, Ellipsoid};

/// A coordinate reference system taken apart, as PROJJSON.
#[derive(Debug)]
pub(super) struct Definition {
    root: Value,
}

impl Definition {
    /// Of a definition PROJ understands.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ does not.
    pub fn of(definition: &str) -> Result<Self, CrsError> {
        let unknown = |why: String| CrsError::Unknown {
            found: definition.to_owned(),
            why,
        };
        let crs = Proj::new(definition).map_err(|error| unknown(error.to_string()))?;
        let json = crs.to_projjson(Some(false), None, None);
        let root = json
            .ok()
            .and_then(|text| serde_json::from_str::<Value>(&text).ok())
            .filter(|root| {
                root["type"]
                    .as_str()
                    .is_some_and(|kind| kind.ends_with("CRS"))
            })
            .ok_or_else(|| unknown("not a coordinate reference system".to_owned()))?;
        Ok(Self { root })
    }

    /// As PROJJSON.
    pub fn into_json(self) -> Value {
        self.root
    }

    /// Its horizontal part: itself, or the first of a compound one.
    fn horizontal(&self) -> &Value {
        let mut part = &self.root;
        loop {
            part = match part["type"].as_str() {
                Some("CompoundCRS") => &part["components"][0],
                Some("BoundCRS") => &part["source_crs"],
                _ => return part,
            };
        }
    }

    /// Its vertical part, where it is compound or vertical.
    fn vertical(&self) -> Option<&Value> {
        let part = match self.root["type"].as_str() {
            Some("CompoundCRS") => &self.root["components"][1],
            _ => &self.root,
        };
        let part = match part["type"].as_str() {
            Some("BoundCRS") => &part["source_crs"],
            _ => part,
        };
        (part["type"] == "VerticalCRS").then_some(part)
    }

    /// Authority and code of its vertical part.
    pub fn vertical_code(&self) -> Option<String> {
        let id = &self.vertical()?["id"];
        let code = match &id["code"] {
            Value::String(code) => code.clone(),
            code => code.as_u64()?.to_string(),
        };
        Some(format!("{}:{code}", id["authority"].as_str()?))
    }

    /// Metres in the unit of its heights.
    pub fn vertical_unit_m(&self) -> Option<f64> {
        unit(&self.vertical()?["coordinate_system"]["axis"][0]["unit"])
    }

    /// Whether its places are longitudes and latitudes.
    pub fn is_geodetic(&self) -> bool {
        let kind = self.horizontal()["type"].as_str();
        let axes = self.axes();
        matches!(kind, Some("GeographicCRS" | "GeodeticCRS")) && axes["subtype"] != "Cartesian"
    }

    /// Whether its places are on a map.
    pub fn is_projected(&self) -> bool {
        self.horizontal()["type"] == "ProjectedCRS"
    }

    /// Whether its latitudes are angles at the planet's centre.
    pub fn is_ocentric(&self) -> bool {
        self.axes()["subtype"] == "spherical"
    }

    /// Whether its longitudes grow westwards.
    pub fn is_west_positive(&self) -> bool {
        let axes = self.axes()["axis"].as_array();
        axes.is_some_and(|axes| axes.iter().any(|axis| axis["direction"] == "west"))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        self.root["name"].as_str().unwrap_or("unknown")
    }

    /// Whether it gives places in two dimensions: a map projection, or latitude and longitude.
    pub fn is_horizontal(&self) -> bool {
        let is_kind = self.root["type"] == "ProjectedCRS" || self.root["type"] == "GeographicCRS";
        let axes = self.root["coordinate_system"]["axis"].as_array();
        is_kind && axes.is_some_and(|axes| axes.len() == 2)
    }

    /// Whether both axes count metres.
    pub fn is_in_metres(&self) -> bool {
        let axes = self.root["coordinate_system"]["axis"].as_array();
        axes.is_some_and(|axes| axes.iter().all(|axis| unit(&axis["unit"]) == Some(1.0)))
    }

    /// Its ellipsoid; `None` where the body is none of revolution.
    pub fn ellipsoid(&self) -> Option<Ellipsoid> {
        let mut crs = self.horizontal();
        while crs["base_crs"].is_object() {
            crs = &crs["base_crs"];
        }
        let datum = [&crs["datum"], &crs["datum_ensemble"]];
        let ellipsoid = datum.into_iter().find_map(|d| d.get("ellipsoid"))?;
        if let Some(radius) = length(&ellipsoid["radius"]) {
            return Some(Ellipsoid::sphere(radius));
        }
        if ellipsoid.get("semi_median_axis").is_some() {
            return None;
        }
        let a = length(&ellipsoid["semi_major_axis"])?;
        let f = match ellipsoid["inverse_flattening"].as_f64() {
            Some(inverse) if inverse > 0.0 => 1.0 / inverse,
            Some(_) => 0.0,
            None => 1.0 - length(&ellipsoid["semi_minor_axis"])? / a,
        };
        Some(Ellipsoid { a, f })
    }

    fn axes(&self) -> &Value {
        &self.horizontal()["coordinate_system"]
    }
}

/// Metres in a length with or without a unit of its own.
fn length(value: &Value) -> Option<f64> {
    match value.as_f64() {
        Some(metres) => Some(metres),
        None => Some(value["value"].as_f64()? * unit(&value["unit"])?),
    }
}

fn unit(unit: &Value) -> Option<f64> {
    match unit.as_str() {
        Some("metre") => Some(1.0),
        _ => unit["conversion_factor"].as_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_told_apart() {
        let utm = Definition::of("EPSG:32719").unwrap();
        assert!(utm.is_projected() && !utm.is_geodetic());
        assert_eq!(utm.vertical_code(), None);
        let ellipsoid = utm.ellipsoid().unwrap();
        assert!((ellipsoid.a - 6_378_137.0).abs() < 1e-9);
        assert!((1.0 / ellipsoid.f - 298.257_223_563).abs() < 1e-9);
        let compound = Definition::of("EPSG:32719+5773").unwrap();
        assert!(compound.is_projected());
        assert_eq!(compound.vertical_code().as_deref(), Some("EPSG:5773"));
        let feet = Definition::of("EPSG:6360").unwrap();
        assert_eq!(feet.vertical_code().as_deref(), Some("EPSG:6360"));
        assert!((feet.vertical_unit_m().unwrap() - 1200.0 / 3937.0).abs() < 1e-9);
    }

    #[test]
    fn planetary_latitudes_and_longitudes_are_told_apart() {
        let ographic = Definition::of("IAU_2015:49901").unwrap();
        assert!(ographic.is_geodetic() && ographic.is_west_positive() && !ographic.is_ocentric());
        assert!((ographic.ellipsoid().unwrap().f - 1.0 / 169.894_447_223_612).abs() < 1e-12);
        let ocentric = Definition::of("IAU_2015:49902").unwrap();
        assert!(ocentric.is_geodetic() && !ocentric.is_west_positive() && ocentric.is_ocentric());
        let sphere = Definition::of("IAU_2015:30100").unwrap();
        assert_eq!(sphere.ellipsoid(), Some(Ellipsoid::sphere(1_737_400.0)));
    }

    #[test]
    fn what_is_no_crs_is_said() {
        assert!(Definition::of("EPSG:999999").is_err());
        assert_eq!(
            Definition::of("+proj=utm +zone=32")
                .unwrap_err()
                .to_string(),
            "found \"+proj=utm +zone=32\", expected a coordinate reference system known to PROJ, such \
             as EPSG:32719 (not a coordinate reference system)"
        );
    }
}
