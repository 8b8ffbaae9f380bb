//! `[site]`: where on which planet.

use std::path::Path;

use serde::Serialize;

use super::super::paths::{Paths, Source};
use crate::frame::{Crs, Geodetic, Planet, VerticalDatum};
use crate::input::Section;

/// `[site]`: where on which planet.
#[derive(Debug, Clone, Serialize)]
pub struct SiteConfig {
    /// Name of the site; default: the file's name.
    pub name: String,
    /// Origin of the local frame; default: the first pose.
    #[serde(serialize_with = "crate::pipeline::paths::origin")]
    pub origin: Option<Geodetic>,
    /// CRS of easting and northing columns.
    #[serde(serialize_with = "crate::pipeline::paths::crs")]
    pub crs: Option<Crs>,
    /// The planet.
    #[serde(rename = "body", serialize_with = "crate::pipeline::paths::planet")]
    pub planet: Planet,
    /// What heights are above, where it is not the ellipsoid.
    pub height: Option<Heights>,
    /// The north that headings of pose logs count from.
    pub north: NorthName,
    /// Azimuth of magnetic north, degrees.
    pub declination_deg: Option<f64>,
}

/// What heights are above.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Heights {
    /// The zero of a vertical CRS, by its code.
    Crs(String),
    /// The geoid of a grid file.
    Grid(Source),
}

/// The north that headings count from, as the pipeline file names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NorthName {
    /// True north.
    True,
    /// The grid north of the site's CRS.
    Grid,
    /// Magnetic north.
    Magnetic,
}

pub(super) fn site(section: Section<'_>, path: &Path, paths: &Paths) -> Option<SiteConfig> {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let planet = match section.text("body") {
        None => Some(Planet::EARTH),
        Some(name) => {
            let planet = Planet::named(&name);
            if planet.is_none() {
                let known = "earth, moon, mars, or the code of a geographic CRS by the IAU, such as \
                             IAU_2015:49900";
                section.fault("body", format!("{name:?}"), known);
            }
            planet
        }
    };
    let crs = section.text("crs").zip(planet).and_then(|(text, planet)| {
        let crs = Crs::new(&text, planet);
        crs.map_err(|e| section.problem("crs", e.to_string())).ok()
    });
    let height = heights(&section, paths, planet);
    let (north, declination_deg) = north(&section, crs.as_ref());
    let origin = origin(section.section("origin"), planet.unwrap_or(Planet::EARTH));
    let name = section.text("name").or(stem).unwrap_or_default();
    let config = planet.map(|planet| SiteConfig {
        name,
        origin,
        crs,
        planet,
        height,
        north,
        declination_deg,
    });
    section.finish();
    config
}

/// The vertical CRS of heights. Which grids it takes shows only where the site is known.
fn heights(section: &Section<'_>, paths: &Paths, planet: Option<Planet>) -> Option<Heights> {
    let text = section.text("height")?;
    let name = text.to_ascii_lowercase();
    if [".gtx", ".tif", ".tiff"]
        .iter()
        .any(|end| name.ends_with(end))
    {
        let grids = paths.sources(section, "height")?;
        return grids.into_iter().next().map(Heights::Grid);
    }
    match VerticalDatum::check(&text, planet?) {
        Ok(()) => Some(Heights::Crs(text)),
        Err(error) => {
            section.problem("height", error.to_string());
            None
        }
    }
}

/// The north of headings, and the declination where it is magnetic.
fn north(section: &Section<'_>, crs: Option<&Crs>) -> (NorthName, Option<f64>) {
    let word = section.word("north", &["true", "grid", "magnetic"]);
    let declination = section.number("declination_deg", -180.0..=180.0, "-180 to 180");
    let north = match word.as_deref() {
        Some("grid") => NorthName::Grid,
        Some("magnetic") => NorthName::Magnetic,
        _ => NorthName::True,
    };
    if north == NorthName::Grid && !section.has("crs") {
        let expected = "site.crs, a map whose north it is";
        section.fault("north", "\"grid\" without site.crs", expected);
    }
    if let (NorthName::Grid, Some(crs)) = (north, crs)
        && !crs.is_projected()
    {
        let found = format!("\"grid\" with {}, which is no map", crs.definition());
        section.fault("north", found, "a projected site.crs, such as EPSG:32719");
    }
    match (north, section.has("declination_deg")) {
        (NorthName::Magnetic, false) => {
            let expected = "site.declination_deg, the azimuth of magnetic north";
            section.fault("north", "\"magnetic\" without a declination", expected);
        }
        (NorthName::True | NorthName::Grid, true) => {
            let found = "a declination, and headings that are not magnetic";
            section.fault("declination_deg", found, "site.north = \"magnetic\"");
        }
        _ => {}
    }
    (north, declination)
}

/// The origin's height is as the run's heights are.
fn origin(section: Section<'_>, planet: Planet) -> Option<Geodetic> {
    if !section.is_present() {
        return None;
    }
    let lat = section.number("lat_deg", -90.0..=90.0, "-90 to 90");
    let lon = section.number("lon_deg", -180.0..=360.0, "-180 to 360");
    for key in ["lat_deg", "lon_deg"] {
        if !section.has(key) {
            section.fault(key, "nothing", "a number");
        }
    }
    let height_m = section.number("height_m", .., "a number").unwrap_or(0.0);
    section.finish();
    Some(planet.place(lat?, lon?, height_m))
}
