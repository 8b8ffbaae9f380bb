//! Which of PROJ's ways from a vertical datum to the ellipsoid serves.

use super::super::definition::Definition;
use super::super::geoid::is_geotiff;
use super::super::proj_3d::{self, Operation};
use super::super::{CrsError, Geodetic};
use super::{DatumError, GeoidGrid, VerticalDatum, Way};

/// Authority and code of a vertical CRS, and metres in its unit.
pub(super) fn vertical(code: &str) -> Result<(String, f64), DatumError> {
    let unknown = |why: String| DatumError::Unknown {
        found: code.to_owned(),
        why,
    };
    let definition = Definition::of(code).map_err(|error| match error {
        CrsError::Unknown { why, .. } => unknown(why),
        other => unknown(other.to_string()),
    })?;
    let own = definition
        .vertical_code()
        .filter(|own| own.eq_ignore_ascii_case(code))
        .ok_or_else(|| unknown("not a vertical one".to_owned()))?;
    Ok((own, definition.vertical_unit_m().unwrap_or(1.0)))
}

/// The first way whose grids are at hand and hold the place.
pub(super) fn choose(
    code: &str,
    unit_m: f64,
    operations: &[Operation],
    around: Geodetic,
) -> Result<VerticalDatum, DatumError> {
    let found = || code.to_owned();
    let mut missing: Vec<String> = Vec::new();
    let mut bad = None;
    let mut raster = None;
    for operation in operations {
        let Some(pipeline) = &operation.pipeline else {
            continue;
        };
        let absent = operation.grids.iter().filter(|g| g.path.is_none());
        let absent: Vec<String> = absent.map(|g| g.name.clone()).collect();
        if !absent.is_empty() {
            for name in absent {
                if !missing.contains(&name) {
                    missing.push(name);
                }
            }
            continue;
        }
        let grids = operation.grids.iter().map(|grid| GeoidGrid {
            name: grid.name.clone(),
            path: grid.path.clone().unwrap_or_default().into(),
        });
        let datum = VerticalDatum {
            name: found(),
            way: Way::Pipeline(pipeline.clone()),
            grids: grids.collect(),
            unit_m,
        };
        match datum.try_at(around) {
            Ok(()) => return Ok(datum),
            Err(why) => {
                raster = raster.or_else(|| sole_raster(pipeline, &datum.grids));
                bad = bad.or(Some((datum, why)));
            }
        }
    }
    if let Some(grid) = raster {
        let found = found();
        return Err(DatumError::RasterGrid { found, grid });
    }
    Err(match bad {
        Some((datum, why)) => DatumError::BadGrid {
            found: found(),
            grid: datum
                .grids
                .first()
                .map_or_else(String::new, |g| g.path.display().to_string()),
            why,
        },
        None if missing.is_empty() => DatumError::NoWay { found: found() },
        None => DatumError::NoGrid {
            found: found(),
            grids: missing,
            folders: proj_3d::search_path(),
        },
    })
}

/// The GeoTIFF that a way shifts heights by, where it does nothing else: PROJ as it is built in does not
/// read these.
fn sole_raster(pipeline: &str, grids: &[GeoidGrid]) -> Option<GeoidGrid> {
    let [grid] = grids else {
        return None;
    };
    let is_plain = |step: &str| {
        let words: Vec<&str> = step.split_whitespace().collect();
        match words[..] {
            ["+proj=vgridshift", _, "+multiplier=1"] => true,
            ["+proj=unitconvert", from, to] => {
                from.starts_with("+xy_in") && to.starts_with("+xy_out")
            }
            ["+proj=axisswap", _] => true,
            _ => false,
        }
    };
    let steps = pipeline.strip_prefix("+proj=pipeline")?.split("+step");
    let mut steps = steps.map(str::trim).filter(|step| !step.is_empty());
    let is_tiff = is_geotiff(&grid.path);
    (is_tiff && steps.all(is_plain)).then(|| grid.clone())
}
