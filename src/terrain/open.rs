//! Height models from files, their heights put above the ellipsoid.

use std::io::Read;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::ascii::{is_ascii_grid, read_ascii_grid};
use super::grid::{HeightGrid, HeightsAbove, Posts};
use super::planetary::{is_pds3, is_pds4, is_vicar, read_pds3, read_pds4, read_vicar};
use super::tile::within_reach;
use super::{Shape, Terrain, read_geotiff, vertical_datum};
use crate::error::{Error, Fault, Place};
use crate::frame::{Crs, DatumError, Geodetic, Point, Site, VerticalDatum};

/// Reads a height model in any of the formats there are, told apart by what the file begins with:
/// GeoTIFF, ESRI ASCII grid with its `.prj` beside it, the labels of PDS3 and PDS4, and VICAR. Messages
/// call the file `shown`.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, and faults where it is none of these or a format's
/// own reader finds fault.
pub fn read_heights(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let mut start = Vec::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(4096).read_to_end(&mut start))
        .map_err(|error| Error::io(path, "read", error))?;
    if is_ascii_grid(&start) {
        read_ascii_grid(path, shown)
    } else if is_pds3(&start) {
        read_pds3(path, shown)
    } else if is_pds4(&start) {
        read_pds4(path, shown)
    } else if is_vicar(&start) {
        read_vicar(path, shown)
    } else {
        read_geotiff(path, shown)
    }
}

impl Terrain {
    /// Height models from files, of which the earlier count where they overlap; each file comes with
    /// the name that messages call it by. The height `outside_m`, metres above the ellipsoid, serves
    /// in holes and outside all models. `datum` is what heights are above in files that do not say,
    /// where it is not the ellipsoid.
    ///
    /// # Errors
    /// Where a file cannot be read, is not a height model in a known CRS of the site's planet, lies
    /// beyond the reach of the site, or has heights that cannot be put above the ellipsoid.
    pub fn open(
        site: Site,
        files: &[(PathBuf, String)],
        outside_m: Option<f64>,
        datum: Option<&VerticalDatum>,
    ) -> Result<Self, Error> {
        let mut faults = Vec::new();
        let mut grids = Vec::with_capacity(files.len());
        let mut geoid_grids = Vec::new();
        for (path, shown) in files {
            let place = Place::file(shown.clone());
            let read = read_heights(path, shown)
                .and_then(|grid| Ok(above_ellipsoid(site, grid, datum, place)?));
            match read {
                Ok((grid, used)) => {
                    grids.push(grid);
                    geoid_grids.extend(used.iter().flat_map(VerticalDatum::grids).cloned());
                }
                Err(Error::Faults(found)) => faults.extend(found),
                Err(error) => return Err(error),
            }
        }
        Error::check(std::mem::take(&mut faults))?;
        let in_file = |number: usize| Place::file(files[number].1.clone());
        let terrain = Self::from_grids(site, grids, outside_m)
            .map_err(|(number, error)| Fault::new(in_file(number), "crs", error.to_string()))?;
        if let Shape::Model(model) = &terrain.shape {
            for tile in &model.tiles {
                let away = tile.distance_m(&site, Point::origin());
                if away.is_none_or(|away| away > Site::REACH_M) {
                    faults.push(Fault::found(
                        in_file(tile.number),
                        "",
                        format!("a model {} the site's origin", far_from(away)),
                        format!("one within {:.0} km", Site::REACH_M / 1000.0),
                    ));
                }
            }
        }
        Error::check(faults)?;
        Ok(Self {
            geoid_grids,
            ..terrain
        })
    }
}

/// The raster with its heights above the ellipsoid, and the datum they came from.
fn above_ellipsoid(
    site: Site,
    grid: HeightGrid,
    run: Option<&VerticalDatum>,
    place: Place,
) -> Result<(HeightGrid, Option<VerticalDatum>), Fault> {
    let named;
    let datum = match (grid.heights_above(), run) {
        (HeightsAbove::Ellipsoid | HeightsAbove::SiteOrigin, _) | (HeightsAbove::Unsaid, None) => {
            return Ok((grid, None));
        }
        (HeightsAbove::Unsaid, Some(datum)) => datum,
        (HeightsAbove::Datum(code), _) => {
            named = vertical_datum(code, site.planet(), site.origin())
                .map_err(|error| Fault::new(place.clone(), "VerticalGeoKey", error.to_string()))?;
            &named
        }
    };
    let crs_fault =
        |error: &dyn std::fmt::Display| Fault::new(place.clone(), "crs", error.to_string());
    let grid = within_reach(&site, grid).map_err(|error| crs_fault(&error))?;
    let crs = Crs::new(grid.crs(), site.planet()).map_err(|error| crs_fault(&error))?;
    let shifted = shifted(&grid, &crs, datum)
        .map_err(|error| Fault::new(place.clone(), "", error.to_string()))?;
    let above = HeightGrid::new(
        grid.columns(),
        grid.rows(),
        Posts::F64(shifted),
        grid.crs_from_post(),
        grid.crs(),
    )
    .map_err(|error| Fault::new(place, "", error.to_string()))?
    .with_heights_above(HeightsAbove::Ellipsoid);
    Ok((above, Some(datum.clone())))
}

/// All heights, row by row, above the ellipsoid.
#[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
fn shifted(grid: &HeightGrid, crs: &Crs, datum: &VerticalDatum) -> Result<Vec<f64>, DatumError> {
    let rows = (0..grid.rows()).into_par_iter().map(|row| {
        let post = |column: usize| {
            let height_m = grid.height_m(column, row);
            if height_m.is_nan() {
                return Ok(f64::NAN);
            }
            let (x, y) = grid.crs_from_post().apply(column as f64, row as f64);
            // A post that the map does not have can never be hit.
            let Ok((lon, lat)) = crs.lon_lat(x, y) else {
                return Ok(f64::NAN);
            };
            let place = Geodetic { lat, lon, height_m };
            datum.to_ellipsoidal(place).map(|place| place.height_m)
        };
        (0..grid.columns())
            .map(post)
            .collect::<Result<Vec<f64>, _>>()
    });
    let rows: Vec<Vec<f64>> = rows.collect::<Result<_, _>>()?;
    Ok(rows.concat())
}

fn far_from(away_m: Option<f64>) -> String {
    match away_m {
        Some(away_m) => format!("{:.1} km from", away_m / 1000.0),
        None => "out of reach of".to_owned(),
    }
}
