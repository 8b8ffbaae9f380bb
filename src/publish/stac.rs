//! A `SpatioTemporal` Asset Catalog item (STAC 1.0.0) of a run, by which catalogues find it.

use geo::{Coord, Rect};
use serde_json::{Map, Value as Json, json};

use super::format::Format;
use super::layer::{Geometry, Layer, Value, union};
use super::mosaic::MosaicGrid;
use crate::frame::{Crs, CrsText, Planet};
use crate::pose::Time;

/// What an item says.
pub struct Item<'a> {
    /// Its name, the same for the same run.
    pub id: String,
    /// The site.
    pub title: &'a str,
    /// The planet.
    pub planet: Planet,
    /// The map.
    pub layers: &'a [Layer],
    /// Its files: name, what it is, media type, roles.
    pub assets: Vec<Asset>,
}

/// A file of the output folder.
pub struct Asset {
    /// Its name, relative to the item.
    pub file: String,
    /// What it is.
    pub title: String,
    /// Its media type.
    pub media_type: &'static str,
    /// What it is for: `data`, `metadata`.
    pub role: &'static str,
    /// Its coordinate reference system, where it is not the planet's own.
    pub crs: Option<String>,
    /// Where its pixels are, if it has any.
    pub grid: Option<MosaicGrid>,
}

/// The media type of the ground mosaic.
const MOSAIC: &str = "image/tiff; application=geotiff; profile=cloud-optimized";

impl Asset {
    /// The asset that a file of the output folder is; `None` for a style, which goes with its
    /// layer.
    pub fn of(file: &str) -> Option<Self> {
        let (name, extension) = file.rsplit_once('.')?;
        let (media_type, role) = match (name, extension) {
            (_, "qml") => return None,
            (_, "qgz") => ("application/vnd.qgis.qgz", "visual"),
            (_, "tif") => (MOSAIC, "visual"),
            ("run" | "timing", "json") => ("application/json", "metadata"),
            ("rejects" | "evidence", _) => ("text/csv", "metadata"),
            (_, extension) => {
                let is_it = |f: &Format| f.file_of("layer").ends_with(&format!(".{extension}"));
                (Format::ALL.into_iter().find(is_it)?.media_type(), "data")
            }
        };
        Some(Self {
            file: file.to_owned(),
            title: name.to_owned(),
            media_type,
            role,
            crs: None,
            grid: None,
        })
    }

    /// The same, where its layers are in the system of that code.
    #[must_use]
    pub fn on_map(self, crs: Option<&Crs>) -> Self {
        let is_map = self.role == "data" && self.media_type != Format::GeoJson.media_type();
        let crs = crs
            .filter(|_| is_map)
            .map(|crs| crs.definition().to_owned());
        Self { crs, ..self }
    }

    /// The same, where the mosaic has that grid.
    #[must_use]
    pub fn on_grid(self, grid: Option<&MosaicGrid>) -> Self {
        let grid = grid.filter(|_| self.media_type == MOSAIC).cloned();
        Self {
            crs: grid.as_ref().map(|grid| grid.crs.clone()).or(self.crs),
            grid,
            ..self
        }
    }

    /// What the item says of it.
    fn json(&self) -> Json {
        let mut about = json!({
            "href": format!("./{}", self.file),
            "title": self.title,
            "type": self.media_type,
            "roles": [self.role],
        });
        let crs = self.crs.as_ref().and_then(|crs| CrsText::of(crs).ok());
        match crs {
            Some(crs) if crs.code > 0 => {
                about["proj:code"] = json!(format!("{}:{}", crs.authority, crs.code));
            }
            Some(crs) => {
                about["proj:code"] = Json::Null;
                about["proj:projjson"] = crs.projjson;
            }
            None => {}
        }
        if let Some(grid) = &self.grid {
            let step = grid.scale.m_per_px;
            about["proj:shape"] = json!([grid.rows, grid.columns]);
            // Two rows of a matrix: from column, row and one to easting and northing.
            about["proj:transform"] = json!([step, 0.0, grid.west_m, 0.0, -step, grid.north_m]);
        }
        about
    }
}

/// The item's text; `None` where the data bear no time or no place, which an item must have.
pub fn text(item: &Item<'_>) -> Option<String> {
    let (start, end) = times(item.layers)?;
    let boxes = boxes(item.layers);
    let bounds = boxes.iter().copied().reduce(|a, b| Extent {
        west: a.west,
        south: a.south.min(b.south),
        east: b.east,
        north: a.north.max(b.north),
    })?;
    let mut properties = Map::new();
    properties.insert("title".to_owned(), json!(item.title));
    let instant = (start == end).then(|| start.to_string());
    properties.insert("datetime".to_owned(), json!(instant));
    properties.insert("start_datetime".to_owned(), json!(start.to_string()));
    properties.insert("end_datetime".to_owned(), json!(end.to_string()));
    let mut extensions = vec!["https://stac-extensions.github.io/projection/v2.0.0/schema.json"];
    let crs = CrsText::of_map(item.planet).ok()?;
    if crs.code > 0 {
        properties.insert("proj:code".to_owned(), json!(item.planet.crs));
    } else {
        properties.insert("proj:code".to_owned(), Json::Null);
        properties.insert("proj:projjson".to_owned(), crs.projjson);
    }
    if !item.planet.is_earth() {
        extensions.push("https://stac-extensions.github.io/ssys/v1.1.0/schema.json");
        // Systems of the IAU are called after their body: "Europa (2015) - Sphere / Ocentric".
        let body = crs.name.split(" (").next();
        properties.insert("ssys:targets".to_owned(), json!([body]));
    }
    let assets = item.assets.iter().map(|a| (a.file.clone(), a.json()));
    let value = json!({
        "type": "Feature",
        "stac_version": "1.0.0",
        "stac_extensions": extensions,
        "id": item.id,
        "geometry": geometry(&boxes),
        "bbox": [bounds.west, bounds.south, bounds.east, bounds.north],
        "properties": properties,
        "links": [],
        "assets": assets.collect::<Map<String, Json>>(),
    });
    Some(format!("{value:#}\n"))
}

/// The first and the last time in the layers.
fn times(layers: &[Layer]) -> Option<(Time, Time)> {
    let values = layers
        .iter()
        .flat_map(|l| &l.features)
        .flat_map(|f| &f.values);
    let times = values.filter_map(|value| match value {
        Value::Time(time) => Some(*time),
        _ => None,
    });
    Some((times.clone().min()?, times.max()?))
}

/// A box of the map; where the map is cut, the western box first.
#[derive(Debug, Clone, Copy)]
struct Extent {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
}

/// The boxes around everything: two where the map reaches the antimeridian from both sides and
/// is nowhere near the meridian in between, or else one.
fn boxes(layers: &[Layer]) -> Vec<Extent> {
    let geometries = layers
        .iter()
        .flat_map(|l| &l.features)
        .filter_map(|f| f.geometry.as_ref());
    let parts: Vec<Rect<f64>> = geometries.flat_map(parts).collect();
    let around = |parts: &mut dyn Iterator<Item = Rect<f64>>| {
        parts.reduce(union).map(|b| Extent {
            west: b.min().x,
            south: b.min().y,
            east: b.max().x,
            north: b.max().y,
        })
    };
    let cut = parts.iter().any(|b| b.max().x > 179.0) && parts.iter().any(|b| b.min().x < -179.0);
    let whole = parts.iter().any(|b| b.width() > 90.0);
    if !cut || whole {
        return around(&mut parts.into_iter()).into_iter().collect();
    }
    let (eastern, western): (Vec<Rect<f64>>, Vec<Rect<f64>>) =
        parts.into_iter().partition(|b| b.center().x > 0.0);
    let sides = [eastern, western];
    sides
        .into_iter()
        .filter_map(|side| around(&mut side.into_iter()))
        .collect()
}

/// The boxes around the parts of a geometry.
fn parts(geometry: &Geometry) -> Vec<Rect<f64>> {
    match geometry {
        Geometry::Point(_) => geometry.bounds().into_iter().collect(),
        Geometry::Lines(lines) => {
            let alone = |line: &Vec<Coord<f64>>| Geometry::Lines(vec![line.clone()]).bounds();
            lines.iter().filter_map(alone).collect()
        }
        Geometry::Polygons(polygons) => {
            let alone = |p: &geo::Polygon<f64>| Geometry::Polygons(p.clone().into()).bounds();
            polygons.iter().filter_map(alone).collect()
        }
    }
}

/// The boxes as polygons, counter-clockwise.
fn geometry(boxes: &[Extent]) -> Json {
    let ring = |b: &Extent| {
        json!([[
            [b.west, b.south],
            [b.east, b.south],
            [b.east, b.north],
            [b.west, b.north],
            [b.west, b.south]
        ]])
    };
    match boxes {
        [only] => json!({ "type": "Polygon", "coordinates": ring(only) }),
        several => {
            let rings: Vec<Json> = several.iter().map(ring).collect();
            json!({ "type": "MultiPolygon", "coordinates": rings })
        }
    }
}

#[cfg(test)]
mod tests;
