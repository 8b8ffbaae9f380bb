//! The map that a PDS3 or VICAR label puts its image on: of the planet, or of a rover's site.

use super::Problem;
use super::label::Group;
use super::map::{Projection, height_shift_m, is_north, metres};
use crate::terrain::grid::GridError;
use crate::terrain::{Affine, HeightGrid, HeightsAbove, Posts, geotiff};

/// Groups that describe a map of the planet.
const MAPS: [&str; 2] = ["IMAGE_MAP_PROJECTION", "MAP"];

/// Groups that describe a map of a site, as pictures from the surface are laid out on.
const SITE_MAPS: [&str; 2] = ["SURFACE_PROJECTION_PARMS", "SURFACE_PROJECTION"];

/// Where the posts of an image stand, and how samples become heights there.
pub(super) struct LabelMap {
    crs: String,
    crs_from_post: Affine,
    above: HeightsAbove,
    /// The radius of the sphere that heights are above, metres, where the label names one.
    radius_m: Option<f64>,
    /// Metres of height in a metre of the samples: -1 where they count down.
    pub sign: f64,
}

impl LabelMap {
    /// The map of an image of that many columns and rows.
    ///
    /// # Errors
    /// Where the label describes none, or one that is not understood.
    pub fn of(root: &Group, size: [usize; 2]) -> Result<Self, Problem> {
        if let Some(map) = root.find(&MAPS) {
            return planetary(&map);
        }
        if let Some(keys) = root.find(&["GEOTIFF"]) {
            return by_geotiff_keys(&keys);
        }
        match root.find(&SITE_MAPS) {
            Some(map) => of_site(root, &map, size),
            None if root.has("X_AXIS_MAXIMUM") => of_site(root, root, size),
            None => Err(Problem::missing(
                MAPS[0],
                "the map the image is on: this group, or SURFACE_PROJECTION_PARMS, or GEOTIFF of a \
                 VICAR label",
            )),
        }
    }

    /// What is added to samples, metres, to make heights of them: those that are radii from the
    /// body's centre become heights above the map's sphere.
    pub fn height_shift_m(&self, shift_m: f64) -> f64 {
        self.radius_m
            .map_or(shift_m, |radius_m| height_shift_m(shift_m, radius_m))
    }

    /// The raster of heights on this map.
    ///
    /// # Errors
    /// As [`HeightGrid::new`].
    pub fn grid(self, [columns, rows]: [usize; 2], posts: Posts) -> Result<HeightGrid, GridError> {
        let grid = HeightGrid::new(columns, rows, posts, self.crs_from_post, self.crs)?;
        Ok(grid.with_heights_above(self.above))
    }
}

/// A map of the planet (PDS Data Dictionary, `IMAGE_MAP_PROJECTION`).
fn planetary(map: &Group) -> Result<LabelMap, Problem> {
    let (projection, radius_m) = projection(map)?;
    Ok(LabelMap {
        crs: projection.definition(radius_m),
        crs_from_post: crs_from_post(map, projection, radius_m)?,
        above: HeightsAbove::Unsaid,
        radius_m: Some(radius_m),
        sign: 1.0,
    })
}

/// The projection, and the radius of its sphere in metres.
fn projection(map: &Group) -> Result<(Projection, f64), Problem> {
    let key = if map.has("MAP_PROJECTION") {
        "MAP_PROJECTION"
    } else {
        "MAP_PROJECTION_TYPE"
    };
    let expected = "EQUIRECTANGULAR, SIMPLE CYLINDRICAL, SINUSOIDAL or POLAR STEREOGRAPHIC";
    let name = map
        .text(key)
        .ok_or_else(|| map.missing(key, expected))?
        .replace('_', " ")
        .to_ascii_uppercase();
    // Labels give lengths in kilometres where they do not say.
    let axis = |key: &str| -> Result<Option<f64>, Problem> {
        let Some(length) = map.number(key)? else {
            return Ok(None);
        };
        let unit = map.unit(key);
        let unit_m = if unit.is_empty() {
            Some(1000.0)
        } else {
            metres(&unit)
        };
        let unit_m = unit_m.ok_or_else(|| map.found(key, unit, "KM or M"))?;
        Ok(Some(length * unit_m))
    };
    let equatorial_m = axis("A_AXIS_RADIUS")?
        .filter(|&radius| radius > 0.0)
        .ok_or_else(|| map.missing("A_AXIS_RADIUS", "the body's radius"))?;
    let direction = map.text("POSITIVE_LONGITUDE_DIRECTION");
    let sign = if direction.is_some_and(|d| d.eq_ignore_ascii_case("WEST")) {
        -1.0
    } else {
        1.0
    };
    let lon_deg = sign * map.required("CENTER_LONGITUDE")?;
    let center = |key: &str| map.required(key);
    let projection = match name.as_str() {
        "EQUIRECTANGULAR" => Projection::Equirectangular {
            true_lat_deg: center("CENTER_LATITUDE")?,
            lon_deg,
        },
        "SIMPLE CYLINDRICAL" => Projection::Equirectangular {
            true_lat_deg: 0.0,
            lon_deg,
        },
        "SINUSOIDAL" => Projection::Sinusoidal { lon_deg },
        "POLAR STEREOGRAPHIC" => {
            let lat_deg = center("CENTER_LATITUDE")?;
            let key = "CENTER_LATITUDE";
            Projection::PolarStereographic {
                is_north: is_north(key, lat_deg)
                    .map_err(|_| map.found(key, lat_deg, "90 or -90, a pole"))?,
                lon_deg,
                scale: 1.0,
            }
        }
        _ => return Err(map.found(key, format!("{name:?}"), expected)),
    };
    let polar_m = axis("C_AXIS_RADIUS")?;
    Ok((projection, projection.radius_m(equatorial_m, polar_m)))
}

/// The first post is a number of steps, the projection offsets, left of and above the map's origin.
fn crs_from_post(map: &Group, projection: Projection, radius_m: f64) -> Result<Affine, Problem> {
    let by_resolution = map
        .number("MAP_RESOLUTION")?
        .map(|pixels| radius_m.to_radians() / pixels);
    let by_scale = scales_m(map, 1000.0)?.map(|[scale, _]| scale);
    // Global maps count in pixels a degree, and their scale is rounded.
    let step_m = match projection {
        Projection::Equirectangular {
            true_lat_deg: 0.0, ..
        } => by_resolution.or(by_scale),
        _ => by_scale.or(by_resolution),
    };
    let step_m = step_m
        .filter(|&step| step > 0.0 && step.is_finite())
        .ok_or_else(|| map.missing("MAP_SCALE", "the length of a pixel"))?;
    let left = map.required("SAMPLE_PROJECTION_OFFSET")?;
    let above = map.required("LINE_PROJECTION_OFFSET")?;
    Ok(Affine::north_up(-left * step_m, above * step_m, step_m))
}

/// `MAP_SCALE` along lines of the image and along samples, metres; one number serves for both.
fn scales_m(map: &Group, default_unit_m: f64) -> Result<Option<[f64; 2]>, Problem> {
    let key = "MAP_SCALE";
    let unit = map.unit(key);
    let length = unit.split('/').next().unwrap_or("");
    let unit_m = if unit.is_empty() {
        Some(default_unit_m)
    } else {
        metres(length)
    };
    let unit_m = unit_m.ok_or_else(|| map.found(key, &unit, "METERS/PIXEL or KM/PIXEL"))?;
    match map.numbers(key)?[..] {
        [] => Ok(None),
        [both] => Ok(Some([both * unit_m; 2])),
        [line, sample, ..] => Ok(Some([line * unit_m, sample * unit_m])),
    }
}

/// A map of a site: x to the north along columns, y to the east along rows, with the edges of the
/// image in metres from the site's origin (`SURFACE_PROJECTION_PARMS` of the labels of rover products).
fn of_site(root: &Group, map: &Group, [columns, rows]: [usize; 2]) -> Result<LabelMap, Problem> {
    let key = "MAP_PROJECTION_TYPE";
    let known = ["ORTHORECTIFIED", "ORTHOGRAPHIC", "VERTICAL"];
    if let Some(name) = map.text(key).filter(|name| !known.contains(&name.as_str())) {
        let expected = "ORTHORECTIFIED, ORTHOGRAPHIC or VERTICAL, a map from above";
        return Err(map.found(key, name, expected));
    }
    let derived = root.find(&["DERIVED_IMAGE_PARMS", "DERIVED_IMAGE"]);
    let key = "REFERENCE_COORD_SYSTEM_NAME";
    for group in [Some(map), derived.as_ref()].into_iter().flatten() {
        let other = group.text(key).filter(|name| name != "SITE_FRAME");
        if let Some(name) = other {
            let expected = "SITE_FRAME, whose origin is that of the run's local frame";
            return Err(group.found(key, name, expected));
        }
    }
    let key = "DERIVED_IMAGE_TYPE";
    let expected = "ELEVATION_MAP (heights count up) or Z_MAP (they count down)";
    let holder = derived.as_ref().unwrap_or(root);
    let sign = match holder.text(key).as_deref() {
        Some("ELEVATION_MAP") => 1.0,
        Some("Z_MAP") => -1.0,
        Some(other) => return Err(holder.found(key, other, expected)),
        None => return Err(holder.missing(key, expected)),
    };
    Ok(LabelMap {
        crs: String::new(),
        crs_from_post: site_from_post(map, [columns, rows])?,
        above: HeightsAbove::SiteOrigin,
        radius_m: None,
        sign,
    })
}

/// East and north of the posts, which are in the middle of their pixels.
fn site_from_post(map: &Group, [columns, rows]: [usize; 2]) -> Result<Affine, Problem> {
    let length = |key: &str| -> Result<Option<f64>, Problem> {
        let unit = map.unit(key);
        let unit_m = if unit.is_empty() {
            Some(1.0)
        } else {
            metres(&unit)
        };
        let unit_m = unit_m.ok_or_else(|| map.found(key, unit, "M or KM"))?;
        Ok(map.number(key)?.map(|length| length * unit_m))
    };
    let scales = scales_m(map, 1.0)?;
    // Of two edges and the size of a pixel any two tell the third.
    #[expect(clippy::cast_precision_loss, reason = "images have under 2^31 lines")]
    let along = |[low, high]: [&str; 2], scale: Option<f64>, pixels: usize| {
        let pixels = pixels as f64;
        let (least, most) = (length(low)?, length(high)?);
        let step = match (least, most, scale) {
            (Some(least), Some(most), None) => (most - least) / pixels,
            (_, _, Some(step)) => step,
            _ => return Err(map.missing("MAP_SCALE", "the length of a pixel")),
        };
        if !(step > 0.0 && step.is_finite()) {
            return Err(map.found("MAP_SCALE", step, "a length above zero"));
        }
        let extent = pixels * step;
        let (least, most) = match (least, most) {
            (Some(least), Some(most)) if (most - least - extent).abs() > step => {
                let expected = format!("{} m, {pixels} pixels from {low}", least + extent);
                return Err(map.found(high, format!("{most} m"), &expected));
            }
            (Some(least), Some(most)) => (least, most),
            (Some(least), None) => (least, least + extent),
            (None, Some(most)) => (most - extent, most),
            (None, None) => return Err(map.missing(high, "an edge of the map in metres")),
        };
        Ok((least, most, step))
    };
    let [line, sample] = scales.map_or([None; 2], |s| s.map(Some));
    let (_, north, down) = along(["X_AXIS_MINIMUM", "X_AXIS_MAXIMUM"], line, rows)?;
    let (west, _, right) = along(["Y_AXIS_MINIMUM", "Y_AXIS_MAXIMUM"], sample, columns)?;
    let first = [west + 0.5 * right, north - 0.5 * down];
    Ok(Affine::north_up_by(first, [right, down]))
}

/// The keys of a GeoTIFF by their names, each a text, as VICAR programs keep them.
fn by_geotiff_keys(keys: &Group) -> Result<LabelMap, Problem> {
    let value = |name: &str| keys.words(name).map(|words| words.join(","));
    let found = geotiff::georeference(&value)
        .map_err(|(field, problem)| Problem::new(&format!("GEOTIFF.{field}"), problem))?;
    Ok(LabelMap {
        crs: found.crs,
        crs_from_post: found.crs_from_post,
        above: found.above,
        radius_m: None,
        sign: found.unit_m,
    })
}
