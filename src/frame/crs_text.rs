//! What other programs call a coordinate reference system, by PROJ's database.

use proj::Proj;

use super::CrsError;

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
    /// PROJJSON.
    pub projjson: serde_json::Value,
}

impl CrsText {
    /// Well-known text 1 (OGC 01-009), on one line, of a geographic one; `None` of others.
    pub fn geographic_wkt1(&self) -> Option<String> {
        let crs = &self.projjson;
        if crs["type"] != "GeographicCRS" {
            return None;
        }
        let datum = crs.get("datum").or_else(|| crs.get("datum_ensemble"))?;
        let ellipsoid = &datum["ellipsoid"];
        let radius = ellipsoid
            .get("radius")
            .or(ellipsoid.get("semi_major_axis"))?;
        let flattening = ellipsoid.get("inverse_flattening");
        let flattening = flattening.map_or("0".to_owned(), ToString::to_string);
        let meridian = &datum["prime_meridian"]["name"];
        Some(format!(
            "GEOGCS[{},DATUM[{},SPHEROID[{},{radius},{flattening}]],PRIMEM[\"{}\",0],\
             UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"{}\",\"{}\"]]",
            crs["name"],
            datum["name"],
            ellipsoid["name"],
            meridian.as_str().unwrap_or("Greenwich"),
            self.authority,
            self.code
        ))
    }

    /// The words for `AUTHORITY:CODE` or a PROJ string.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ does not know it.
    pub fn of(definition: &str) -> Result<Self, CrsError> {
        let unknown = |why: String| CrsError::Unknown {
            found: definition.to_owned(),
            why,
        };
        let crs = Proj::new(definition).map_err(|e| unknown(e.to_string()))?;
        // Without a version PROJ writes the newest it knows, WKT2:2019.
        let wkt2 = crs.as_wkt(None, None).map_err(|e| unknown(e.to_string()))?;
        let json = crs.to_projjson(Some(false), None, None);
        let json = json.map_err(|e| unknown(e.to_string()))?;
        let projjson: serde_json::Value =
            serde_json::from_str(&json).map_err(|e| unknown(e.to_string()))?;
        let (authority, code) = definition
            .split_once(':')
            .and_then(|(authority, code)| Some((authority.to_owned(), code.parse().ok()?)))
            .unwrap_or_default();
        Ok(Self {
            authority,
            code,
            name: projjson["name"].as_str().unwrap_or(definition).to_owned(),
            wkt2: one_line(&wkt2),
            projjson,
        })
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
            let wkt1 = text.geographic_wkt1().unwrap();
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
    }
}
