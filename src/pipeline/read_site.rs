//! The site of a run, what its heights are above, and its ground.

use std::collections::HashSet;
use std::path::PathBuf;

use super::config::{Config, Heights};
use super::digest::{InputFile, digest};
use super::paths::Source;
use super::read::{Faults, Read};
use crate::error::{Error, Fault, Place};
use crate::frame::{DatumError, Geodetic, Site, VerticalDatum};
use crate::pose::PoseFile;
use crate::terrain::{Terrain, datum_of_grid, vertical_datum};

/// The grids that heights are shifted by, each once.
pub(super) fn geoid_files(
    datum: Option<&VerticalDatum>,
    terrain: Option<&Terrain>,
) -> Result<Vec<InputFile>, Error> {
    let own = datum.map_or(&[][..], VerticalDatum::grids);
    let grids = own
        .iter()
        .chain(terrain.map_or(&[][..], Terrain::geoid_grids));
    let mut files = Vec::new();
    let mut seen = HashSet::new();
    for grid in grids {
        if seen.insert(&grid.path) {
            let source = Source {
                path: grid.path.clone(),
                shown: grid.name.clone(),
            };
            files.push(digest("geoid", &source, None)?);
        }
    }
    Ok(files)
}

/// The first pose that has a place on the planet.
pub(super) fn first_place(poses: &[Read<PoseFile>]) -> Option<Geodetic> {
    let mut rows = poses.iter().flat_map(|(_, _, file)| &file.rows);
    rows.find_map(crate::pose::PoseRow::geodetic)
}

/// What heights are above, around the run's origin; `None` for the ellipsoid.
pub(super) fn datum(
    config: &Config,
    poses: &[Read<PoseFile>],
    faults: &mut Faults,
) -> Option<VerticalDatum> {
    let around = config.site.origin.or_else(|| first_place(poses))?;
    let datum = match config.site.height.as_ref()? {
        Heights::Crs(code) => vertical_datum(code, config.site.planet, around),
        Heights::Grid(grid) => datum_of_grid(&grid.path, &grid.shown, config.site.planet, around),
    };
    let told = |error: &_| Fault::new(Place::default(), "site.height", format!("{error}"));
    datum
        .map_err(|error: DatumError| faults.faults.push(told(&error)))
        .ok()
}

/// The origin that the run names, with its height above the ellipsoid; on the way all poses are put
/// into true north and ellipsoidal heights.
pub(super) fn origin(
    config: &Config,
    poses: &mut [Read<PoseFile>],
    datum: Option<&VerticalDatum>,
    faults: &mut Faults,
) -> Option<Geodetic> {
    let origin = match (config.site.origin, datum) {
        (Some(origin), Some(datum)) => match datum.to_ellipsoidal(origin) {
            Ok(origin) => Some(origin),
            Err(error) => {
                let fault = Fault::new(Place::default(), "site.origin", error.to_string());
                faults.faults.push(fault);
                Some(origin)
            }
        },
        (origin, _) => origin,
    };
    let heading = config.heading();
    for (_, shown, file) in poses {
        file.refer(shown, &heading, datum, origin);
    }
    origin
}

/// The site of a run: its named origin, or the first pose.
pub(super) fn site(
    config: &Config,
    origin: Option<Geodetic>,
    poses: &[Read<PoseFile>],
    faults: &mut Faults,
) -> Site {
    if config.site.origin.is_none()
        && let Some((_, shown, _)) = poses.iter().find(|(_, _, file)| file.is_local)
    {
        faults.faults.push(Fault::found(
            Place::file(shown),
            "x_m",
            "offsets from an origin",
            "the run to name it: [site] origin = { lat_deg = ..., lon_deg = ..., height_m = ... }",
        ));
    }
    let origin = origin.or_else(|| first_place(poses));
    let nowhere = Geodetic::from_degrees(0.0, 0.0, 0.0);
    Site::new(config.site.planet, origin.unwrap_or(nowhere))
}

pub(super) fn terrain(
    config: &Config,
    site: Site,
    datum: Option<&VerticalDatum>,
    faults: &mut Faults,
) -> Option<Terrain> {
    let spec = &config.terrain;
    // A surface of one height above a geoid is taken for one above the ellipsoid, as at the origin.
    let plane_m = match (spec.plane_m, datum) {
        (Some(height_m), Some(datum)) => {
            let place = Geodetic {
                height_m,
                ..site.origin()
            };
            let place = datum.to_ellipsoidal(place).map_err(|error| {
                let fault = Fault::new(Place::default(), "terrain.plane_m", error.to_string());
                faults.faults.push(fault);
            });
            Some(place.ok()?.height_m)
        }
        (plane_m, _) => plane_m,
    };
    if spec.path.is_empty() {
        return Some(Terrain::constant_height(site, plane_m?));
    }
    let files: Vec<(PathBuf, String)> = spec
        .path
        .iter()
        .map(|s| (s.path.clone(), s.shown.clone()))
        .collect();
    match Terrain::open(site, &files, plane_m, datum) {
        Ok(terrain) => Some(terrain),
        Err(error) => {
            faults.add(error);
            None
        }
    }
}
