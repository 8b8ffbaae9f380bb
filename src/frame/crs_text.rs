//! What other programs call a coordinate reference system, by PROJ's database.

use proj::wkt::WktVersion;
use proj::{Proj, ProjError};

use super::definition::Definition;
use super::{CrsError, Ellipsoid, Planet};

/// A coordinate reference system in the words of files.
#[derive(Debug, Clone, PartialEq)]
pub struct CrsText {
    /// Its authority, such as `EPSG` or `IAU_2015`; empty where it has none.
    pub authority: String,
    /// Its code there; 0 where it has none.
    pub code: i32,
    /// Its name.
    pub name: String,
    /// Well-known text 2 (ISO 19162:2019), on one line.
    pub wkt2: String,
    /// Well-known text 2 as OGC 12-063r5 has it, on one line.
    pub wkt2_2015: String,
    /// Whether it is a map whose axes both count metres.
    pub is_in_metres: bool,
    ellipsoid: Option<Ellipsoid>,
    projected_wkt1: Option<String>,
    /// PROJJSON.
    pub projjson: serde_json::Value,
}

impl CrsText {
    /// The words for `AUTHORITY:CODE` or a PROJ string.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ does not know it.
    pub fn of(definition: &str) -> Result<Self, CrsError> {
        let (authority, code) = definition
            .split_once(':')
            .and_then(|(authority, code)| Some((authority.to_owned(), code.parse().ok()?)))
            .unwrap_or_default();
        let text = Self::without_code(definition)?;
        Ok(Self {
            authority,
            code,
            ..text
        })
    }

    /// The words for the system that a planet's map is written in: the planet's own, but with longitudes
    /// that grow eastwards, which programs expect whatever the axis says; then it has no code.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ does not know it.
    pub fn of_map(planet: Planet) -> Result<Self, CrsError> {
        if planet.eastward() == planet {
            return Self::of(planet.crs);
        }
        let mut crs = Definition::of(planet.crs)?.into_json();
        let name = crs["name"].as_str().unwrap_or(planet.crs);
        crs["name"] = format!("{name}, east positive").into();
        if let Some(axes) = crs["coordinate_system"]["axis"].as_array_mut() {
            for axis in axes.iter_mut().filter(|axis| axis["direction"] == "west") {
                axis["direction"] = "east".into();
            }
        }
        if let Some(crs) = crs.as_object_mut() {
            crs.shift_remove("id");
        }
        Self::without_code(&crs.to_string())
    }

    fn without_code(definition: &str) -> Result<Self, CrsError> {
        let unknown = |error: ProjError| CrsError::Unknown {
            found: definition.to_owned(),
            why: error.to_string(),
        };
        let parts = Definition::of(definition)?;
        let ellipsoid = parts.ellipsoid();
        let crs = Proj::new(definition).map_err(|error| CrsError::Unknown {
            found: definition.to_owned(),
            why: error.to_string(),
        })?;
        // Without a version PROJ writes the newest it knows, WKT2:2019.
        let wkt2 = crs.as_wkt(None, None).map_err(unknown)?;
        let wkt2_2015 = crs.as_wkt(Some(WktVersion::Wkt2_2015), None);
        let wkt1 = crs.as_wkt(Some(WktVersion::Wkt1_Gdal), None);
        let projected_wkt1 = wkt1.ok().map(|wkt| one_line(&wkt));
        let is_in_metres = parts.is_in_metres();
        let projjson = parts.into_json();
        Ok(Self {
            authority: String::new(),
            code: 0,
            name: projjson["name"].as_str().unwrap_or(definition).to_owned(),
            wkt2: one_line(&wkt2),
            wkt2_2015: one_line(&wkt2_2015.map_err(unknown)?),
            is_in_metres,
            ellipsoid,
            projected_wkt1: projected_wkt1.filter(|wkt| wkt.starts_with("PROJCS[")),
            projjson,
        })
    }

    /// Whether it is latitude and longitude, in degrees.
    pub fn is_geographic(&self) -> bool {
        self.projjson["type"] != "ProjectedCRS"
    }

    /// Well-known text 1 (OGC 01-009), on one line; `None` where it has no words for the system.
    pub fn wkt1(&self) -> Option<String> {
        self.geographic_wkt1().or(self.projected_wkt1.clone())
    }

    /// Well-known text 1 of a geographic one; `None` of others, and of planetocentric latitudes on an ellipsoid, which it has no words for.
    fn geographic_wkt1(&self) -> Option<String> {
        let crs = &self.projjson;
        if crs["type"] != "GeographicCRS" {
            return None;
        }
        let datum = crs.get("datum").or_else(|| crs.get("datum_ensemble"))?;
        let Ellipsoid { a, f } = self.ellipsoid?;
        let flattening = if f == 0.0 { 0.0 } else { 1.0 / f };
        let meridian = &datum["prime_meridian"]["name"];
        let authority = if self.code > 0 {
            format!(",AUTHORITY[\"{}\",\"{}\"]", self.authority, self.code)
        } else {
            String::new()
        };
        Some(format!(
            "GEOGCS[{},DATUM[{},SPHEROID[{},{a},{flattening}]],PRIMEM[\"{}\",0],\
             UNIT[\"degree\",0.0174532925199433]{authority}]",
            crs["name"],
            datum["name"],
            datum["ellipsoid"]["name"],
            meridian.as_str().unwrap_or("Reference Meridian"),
        ))
    }
}

fn one_line(wkt: &str) -> String {
    wkt.lines().map(str::trim_start).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earth_moon_and_mars_in_their_own_words() {
        let earth = CrsText::of("EPSG:4326").unwrap();
        assert_eq!((earth.authority.as_str(), earth.code), ("EPSG", 4326));
        assert_eq!(earth.name, "WGS 84");
        assert!(earth.wkt2.starts_with("GEOGCRS[\"WGS 84\","));
        assert_eq!(earth.projjson["id"]["code"], 4326);
        for (code, radius) in [("IAU_2015:30100", "1737400"), ("IAU_2015:49900", "3396190")] {
            let text = CrsText::of(code).unwrap();
            assert_eq!(text.authority, "IAU_2015");
            let wkt1 = text.wkt1().unwrap();
            assert!(wkt1.contains(&format!("Sphere\",{radius},0]]")), "{wkt1}");
            assert!(wkt1.ends_with(&format!("AUTHORITY[\"IAU_2015\",\"{}\"]]", text.code)));
            assert!(!wkt1.contains("WGS") && !text.wkt2.contains("WGS"));
            assert_eq!(text.projjson["type"], "GeographicCRS");
        }
    }

    #[test]
    fn a_local_system_has_a_text_and_no_code() {
        let text = CrsText::of("+proj=aeqd +lat_0=10 +lon_0=20 +R=1737400 +type=crs").unwrap();
        assert_eq!((text.authority.as_str(), text.code), ("", 0));
        assert!(text.wkt2.starts_with("PROJCRS["), "{}", text.wkt2);
        assert_eq!(text.geographic_wkt1(), None);
        assert!(CrsText::of("EPSG:999999").is_err());
        let utm = CrsText::of("EPSG:32633").unwrap();
        let wkt1 = utm.wkt1().unwrap();
        assert!(
            wkt1.starts_with("PROJCS[\"WGS 84 / UTM zone 33N\",GEOGCS["),
            "{wkt1}"
        );
        assert!(wkt1.ends_with("AUTHORITY[\"EPSG\",\"32633\"]]"), "{wkt1}");
        assert!(utm.is_in_metres && !utm.is_geographic() && text.is_in_metres);
        let feet = CrsText::of("EPSG:2277").unwrap();
        assert!(!feet.is_in_metres && !feet.is_geographic());
        assert!(CrsText::of("EPSG:4258").unwrap().is_geographic());
    }

    /// Longitudes of a map grow eastwards, and its system says so.
    #[test]
    fn westward_longitudes_are_turned() {
        let planet = Planet::named("IAU_2015:49901").unwrap();
        let text = CrsText::of_map(planet).unwrap();
        assert_eq!((text.authority.as_str(), text.code), ("", 0));
        assert_eq!(text.name, "Mars (2015) / Ographic, east positive");
        assert!(text.wkt2.contains(",east,") && !text.wkt2.contains(",west,"));
        assert!(!text.wkt2.contains("49901") && text.projjson.get("id").is_none());
        let wkt1 = text.wkt1().unwrap();
        assert!(wkt1.contains("3396190,169.8944472236"), "{wkt1}");
        assert!(!wkt1.contains("AUTHORITY"));
        let mars = CrsText::of_map(Planet::MARS).unwrap();
        assert_eq!(mars, CrsText::of("IAU_2015:49900").unwrap());
    }

    #[test]
    fn planetocentric_latitudes_on_an_ellipsoid_have_well_known_text_2_only() {
        let text = CrsText::of("IAU_2015:49902").unwrap();
        assert_eq!(text.geographic_wkt1(), None);
        assert!(text.wkt2_2015.starts_with("GEODCRS["), "{}", text.wkt2_2015);
        assert!(text.wkt2_2015.contains("spherical"));
    }
}
