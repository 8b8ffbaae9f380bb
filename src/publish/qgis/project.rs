//! A QGIS project that shows the layers, wherever the folder lies.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use geo::Rect;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::super::format::Format;
use super::super::layer::{Kind, Layer, union};
use super::style;
use super::xml::escaped;
use crate::error::Error;
use crate::frame::{Crs, CrsError, CrsText, Geodetic, Planet, Site};

/// What a project shows.
pub struct Project<'a> {
    /// Its title.
    pub title: &'a str,
    /// The layers, the uppermost first; those without a geometry are left out.
    pub layers: &'a [Layer],
    /// The format of the files that hold them.
    pub format: Format,
    /// The site, which the project's coordinate reference system is centred on.
    pub site: &'a Site,
    /// The system of the ground mosaic, where one lies beside the project; it is drawn under everything else.
    pub mosaic: Option<Crs>,
}

/// Layers from the top of the map to its bottom; those first that others must not cover.
const ORDER: [&str; 6] = [
    "ellipses",
    "rocks",
    "detections",
    "views",
    "traverse",
    "footprints",
];

/// What the ids of layers begin with: QGIS ignores ids of ten characters or fewer.
const ID: &str = "rockmap_";

/// The file of the ground mosaic.
const MOSAIC: &str = "mosaic.tif";

/// What a style says of a layer that hides what is under it.
const OPAQUE: &str = "<layerOpacity>1</layerOpacity>";

/// The least extent of the map, metres.
const LEAST_EXTENT_M: f64 = 10.0;

/// The project as the bytes of a QGZ file.
///
/// # Errors
/// A planet that PROJ does not know.
pub fn qgz(project: &Project<'_>) -> Result<Vec<u8>, Error> {
    let failed = |why: String| Error::Output(format!("cannot write rockmap.qgz: {why}"));
    let text = qgs(project).map_err(|e| failed(e.to_string()))?;
    packed(&text).map_err(|e| failed(e.to_string()))
}

/// A ZIP archive with the project as its only file, and with no time of its own.
fn packed(text: &str) -> Result<Vec<u8>, zip::result::ZipError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    archive.start_file("rockmap.qgs", options)?;
    archive.write_all(text.as_bytes())?;
    Ok(archive.finish()?.into_inner())
}

fn qgs(project: &Project<'_>) -> Result<String, CrsError> {
    let planet = project.site.planet();
    let geographic = CrsText::of_map(planet)?;
    let definition = local_crs(project.site);
    let mut local = CrsText::of(&definition)?;
    if local.code == 0 {
        let name = format!("{}, about the site", geographic.name);
        local.wkt2 = local.wkt2.replacen("unknown", &name, 1);
        local.name = name;
    }
    let local = system(&local, false);
    let rank = |l: &&Layer| ORDER.iter().position(|name| *name == l.name);
    let mut layers: Vec<&Layer> = project
        .layers
        .iter()
        .filter(|l| l.geometry.is_some())
        .collect();
    layers.sort_by_key(rank);
    let extent = extent(project, &layers, &definition, planet)?;
    let title = escaped(project.title);
    let mut text = format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n\
         <qgis version=\"3.22.0\" projectname=\"{title}\">\n<homePath path=\"\"/>\n\
         <title>{title}</title>\n<projectCrs>\n{local}</projectCrs>\n<layer-tree-group>\n"
    );
    let has_rocks = layers.iter().any(|l| l.name == "rocks");
    // Footprints would tint the mosaic, whose own outline shows what was seen.
    let is_hidden = |layer: &Layer| match layer.name {
        "detections" => has_rocks,
        "footprints" => project.mosaic.is_some(),
        _ => false,
    };
    // Writing to a String cannot fail.
    for layer in &layers {
        let _ = writeln!(
            text,
            "<layer-tree-layer id=\"{ID}{0}\" name=\"{1}\" providerKey=\"ogr\" source=\"{2}\" \
             checked=\"{3}\" expanded=\"{4}\"/>",
            layer.name,
            escaped(layer.title),
            escaped(&source(project.format, layer)),
            if is_hidden(layer) {
                "Qt::Unchecked"
            } else {
                "Qt::Checked"
            },
            i32::from(layer.name == "rocks"),
        );
    }
    if project.mosaic.is_some() {
        let _ = writeln!(
            text,
            "<layer-tree-layer id=\"{ID}mosaic\" name=\"Mosaic\" providerKey=\"gdal\" \
             source=\"./{MOSAIC}\" checked=\"Qt::Checked\" expanded=\"0\"/>"
        );
    }
    let _ = write!(
        text,
        "</layer-tree-group>\n<mapcanvas name=\"theMapCanvas\">\n<units>meters</units>\n\
         <extent>\n{}</extent>\n<rotation>0</rotation>\n<destinationsrs>\n{local}\
         </destinationsrs>\n</mapcanvas>\n<projectlayers>\n",
        corners(&extent)
    );
    for layer in &layers {
        let mut shown = map_layer(project.format, layer, &layer.crs_text()?);
        if project.mosaic.is_some() && layer.name == "rocks" {
            // So that the rocks of the pictures show through their discs.
            shown = shown.replace(OPAQUE, "<layerOpacity>0.5</layerOpacity>");
        }
        text.push_str(&shown);
    }
    if let Some(crs) = &project.mosaic {
        let own = if crs.definition() == definition {
            local.clone()
        } else {
            system(&CrsText::of(crs.definition())?, false)
        };
        text.push_str(&mosaic_layer(&own));
    }
    text.push_str(&properties(&extent, &local));
    Ok(text)
}

/// What stands at a project's end: relative paths, its background, and where it opens.
fn properties(extent: &Rect<f64>, local: &str) -> String {
    let (min, max) = (extent.min(), extent.max());
    format!(
        "</projectlayers>\n<properties>\n<Paths>\n<Absolute type=\"bool\">false</Absolute>\n\
         </Paths>\n<Gui>\n<CanvasColorRedPart type=\"int\">247</CanvasColorRedPart>\n\
         <CanvasColorGreenPart type=\"int\">244</CanvasColorGreenPart>\n\
         <CanvasColorBluePart type=\"int\">238</CanvasColorBluePart>\n</Gui>\n\
         <SpatialRefSys>\n<ProjectionsEnabled type=\"int\">1</ProjectionsEnabled>\n\
         </SpatialRefSys>\n</properties>\n\
         <ProjectViewSettings UseProjectScales=\"0\">\n<DefaultViewExtent xmin=\"{:.3}\" \
         ymin=\"{:.3}\" xmax=\"{:.3}\" ymax=\"{:.3}\">\n{local}</DefaultViewExtent>\n\
         </ProjectViewSettings>\n</qgis>\n",
        min.x, min.y, max.x, max.y
    )
}

/// The system a map of the site is shown in, so that a circle is round: UTM on Earth, and where
/// there is none, a transverse Mercator about the site's origin.
pub(in crate::publish) fn local_crs(site: &Site) -> String {
    let (origin, planet) = (site.origin(), site.planet());
    let (lat, lon) = (origin.lat_deg(), origin.lon_deg());
    if planet.is_earth() && (-80.0..84.0).contains(&lat) {
        let zone = (((lon + 180.0) / 6.0).floor() + 1.0).clamp(1.0, 60.0);
        let half = if lat < 0.0 { 700.0 } else { 600.0 };
        return format!("EPSG:{}", 32_000.0 + half + zone);
    }
    let ellipsoid = planet.ellipsoid;
    let shape = if ellipsoid.f > 0.0 {
        format!("+a={} +rf={}", ellipsoid.a, 1.0 / ellipsoid.f)
    } else {
        format!("+R={}", ellipsoid.a)
    };
    format!(
        "+proj=tmerc +lat_0={lat:.6} +lon_0={lon:.6} +k=1 +x_0=0 +y_0=0 {shape} +units=m +no_defs +type=crs"
    )
}

/// The box around the layers in the local system, with a margin.
fn extent(
    project: &Project<'_>,
    layers: &[&Layer],
    definition: &str,
    planet: Planet,
) -> Result<Rect<f64>, CrsError> {
    let crs = Crs::new(definition, planet)?;
    let place = |at: Geodetic| crs.xy(at.lon, at.lat);
    let origin = place(project.site.origin())?;
    let corners = layers.iter().flat_map(|l| {
        let geometries = l.features.iter().filter_map(|f| f.geometry.as_ref());
        let boxes = geometries.filter_map(super::super::layer::Geometry::bounds);
        boxes.flat_map(|b| [(b.min(), l.crs.as_ref()), (b.max(), l.crs.as_ref())])
    });
    // A place that the projection does not reach, over a pole, does not count.
    let boxes = corners.filter_map(|(c, layer_crs)| {
        let (x, y) = place(layer_place(c.x, c.y, layer_crs, planet)?).ok()?;
        Some(Rect::new((x, y), (x, y)))
    });
    let all = boxes.reduce(union).unwrap_or(Rect::new(origin, origin));
    let margin = 0.05 * all.width().max(all.height()).max(LEAST_EXTENT_M);
    let (min, max) = (all.min(), all.max());
    Ok(Rect::new(
        (min.x - margin, min.y - margin),
        (max.x + margin, max.y + margin),
    ))
}

/// The place of a layer's coordinates.
fn layer_place(x: f64, y: f64, crs: Option<&Crs>, planet: Planet) -> Option<Geodetic> {
    let Some(crs) = crs else {
        return Some(planet.eastward().place(y, x, 0.0));
    };
    let (lon, lat) = crs.lon_lat(x, y).ok()?;
    let height_m = 0.0;
    Some(Geodetic { lat, lon, height_m })
}

fn corners(extent: &Rect<f64>) -> String {
    let (min, max) = (extent.min(), extent.max());
    format!(
        "<xmin>{:.3}</xmin>\n<ymin>{:.3}</ymin>\n<xmax>{:.3}</xmax>\n<ymax>{:.3}</ymax>\n",
        min.x, min.y, max.x, max.y
    )
}

/// Where a layer's data are, relative to the project.
fn source(format: Format, layer: &Layer) -> String {
    let file = format.file_of(layer.name);
    if format == Format::GeoPackage {
        format!("./{file}|layername={}", layer.name)
    } else {
        format!("./{file}")
    }
}

fn map_layer(format: Format, layer: &Layer, crs: &CrsText) -> String {
    let geometry = match layer.geometry {
        Some(Kind::Point) => "Point",
        Some(Kind::Line) => "Line",
        Some(Kind::Polygon) => "Polygon",
        None => "No geometry",
    };
    format!(
        "<maplayer type=\"vector\" geometry=\"{geometry}\" hasScaleBasedVisibilityFlag=\"0\" \
         labelsEnabled=\"1\">\n<id>{ID}{}</id>\n<datasource>{}</datasource>\n\
         <layername>{}</layername>\n<srs>\n{}</srs>\n\
         <provider encoding=\"UTF-8\">ogr</provider>\n{}</maplayer>\n",
        layer.name,
        escaped(&source(format, layer)),
        escaped(layer.title),
        system(crs, crs.is_geographic()),
        style(layer)
    )
}

/// The mosaic as a layer: its red, green and blue as they are, what no picture shows clear.
fn mosaic_layer(own: &str) -> String {
    format!(
        "<maplayer type=\"raster\" hasScaleBasedVisibilityFlag=\"0\">\n<id>{ID}mosaic</id>\n\
         <datasource>./{MOSAIC}</datasource>\n<layername>Mosaic</layername>\n<srs>\n{own}</srs>\n\
         <provider>gdal</provider>\n<pipe>\n\
         <provider><resampling enabled=\"false\" zoomedInResamplingMethod=\"nearestNeighbour\" \
         zoomedOutResamplingMethod=\"nearestNeighbour\" maxOversampling=\"2\"/></provider>\n\
         <rasterrenderer type=\"multibandcolor\" redBand=\"1\" greenBand=\"2\" blueBand=\"3\" \
         alphaBand=\"4\" opacity=\"1\" nodataColor=\"\"><rasterTransparency/></rasterrenderer>\n\
         <brightnesscontrast brightness=\"0\" contrast=\"0\" gamma=\"1\"/>\n\
         <huesaturation saturation=\"0\" grayscaleMode=\"0\" colorizeOn=\"0\"/>\n\
         <rasterresampler maxOversampling=\"2\" zoomedOutResampler=\"bilinear\"/>\n\
         </pipe>\n<blendMode>0</blendMode>\n</maplayer>\n"
    )
}

fn system(crs: &CrsText, is_geographic: bool) -> String {
    let id = if crs.code > 0 {
        format!("{}:{}", crs.authority, crs.code)
    } else {
        String::new()
    };
    let srid = if crs.authority == "EPSG" { crs.code } else { 0 };
    format!(
        "<spatialrefsys nativeFormat=\"Wkt\">\n<wkt>{}</wkt>\n<srid>{srid}</srid>\n\
         <authid>{}</authid>\n<description>{}</description>\n\
         <geographicflag>{is_geographic}</geographicflag>\n</spatialrefsys>\n",
        escaped(&crs.wkt2),
        escaped(&id),
        escaped(&crs.name)
    )
}
