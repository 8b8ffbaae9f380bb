//! Vertical datums whose geoid grid is a GeoTIFF, as PROJ's own grids are.

use std::path::Path;

use super::{HeightGrid, read_geotiff};
use crate::frame::{
    Crs, DatumError, Geodetic, GeoidGrid, GeoidRaster, Planet, VerticalDatum, is_geotiff,
};

/// The vertical CRS of an authority's code around a place, as [`VerticalDatum::new`] has it, with grids in
/// GeoTIFF too.
///
/// # Errors
/// [`DatumError`] as there, and where a grid in GeoTIFF cannot be read.
pub fn vertical_datum(
    code: &str,
    planet: Planet,
    around: Geodetic,
) -> Result<VerticalDatum, DatumError> {
    match VerticalDatum::new(code, planet, around) {
        Err(DatumError::RasterGrid { found, grid }) => from_geotiff(&found, grid, planet, around),
        other => other,
    }
}

/// Heights above the geoid of a grid file, GTX or GeoTIFF, around a place; messages call it `shown`.
///
/// # Errors
/// [`DatumError::BadGrid`] where the file cannot be read or does not reach the place.
pub fn datum_of_grid(
    path: &Path,
    shown: &str,
    planet: Planet,
    around: Geodetic,
) -> Result<VerticalDatum, DatumError> {
    if is_geotiff(path) {
        let grid = GeoidGrid {
            name: shown.to_owned(),
            path: path.to_owned(),
        };
        from_geotiff(shown, grid, planet, around)
    } else {
        VerticalDatum::from_grid(path, shown, around)
    }
}

fn from_geotiff(
    name: &str,
    grid: GeoidGrid,
    planet: Planet,
    around: Geodetic,
) -> Result<VerticalDatum, DatumError> {
    let bad = |why: String| DatumError::BadGrid {
        found: name.to_owned(),
        grid: grid.path.display().to_string(),
        why,
    };
    let read = read_geotiff(&grid.path, &grid.name).map_err(|error| bad(error.to_string()))?;
    let raster = raster(&read, planet).map_err(bad)?;
    VerticalDatum::from_raster(name, grid, raster, around)
}

fn raster(grid: &HeightGrid, planet: Planet) -> Result<GeoidRaster, String> {
    let crs = Crs::new(grid.crs(), planet).map_err(|error| error.to_string())?;
    if crs.is_projected() {
        let found = grid.crs();
        return Err(format!("found {found:?}, expected latitude and longitude"));
    }
    let map = grid.crs_from_post();
    let is_north_up = map.x_row == 0.0 && map.y_column == 0.0;
    let posts = (0..grid.posts().len()).map(|i| grid.posts().get(i));
    let size = [grid.columns(), grid.rows()];
    let raster = GeoidRaster::new(
        size,
        [map.x0, map.y0],
        [map.x_column, -map.y_row],
        posts.collect(),
    );
    raster
        .filter(|_| is_north_up)
        .ok_or_else(|| "found a raster that is not north up, expected one that is".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{Affine, Posts, write_geotiff};

    /// The same undulations as GTX, which PROJ reads, and as GeoTIFF give the same heights.
    #[test]
    fn a_geotiff_and_a_gtx_of_one_geoid_agree() {
        let folder = tempfile::tempdir().unwrap();
        let (columns, rows, step) = (5u16, 4u16, 0.25);
        let undulation = |row: u16, column: u16| {
            40.0f32 + 0.7 * f32::from(row) - 1.3 * f32::from(column) * f32::from(row)
        };
        // GTX has its southern row first.
        let mut gtx = Vec::new();
        for number in [48.0f64, 8.0, step, step] {
            gtx.extend(number.to_be_bytes());
        }
        gtx.extend(i32::from(rows).to_be_bytes());
        gtx.extend(i32::from(columns).to_be_bytes());
        let mut posts = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                gtx.extend(undulation(row, column).to_be_bytes());
                posts.push(undulation(rows - 1 - row, column));
            }
        }
        let paths = ["tiny.gtx", "tiny.tif"].map(|name| folder.path().join(name));
        std::fs::write(&paths[0], gtx).unwrap();
        let map = Affine::north_up(8.0, 48.75, step);
        let grid = HeightGrid::new(5, 4, Posts::F32(posts), map, "EPSG:4326").unwrap();
        write_geotiff(&paths[1], &grid, Planet::EARTH).unwrap();
        let here = Geodetic::from_degrees(48.3, 8.4, 100.0);
        let datums = paths
            .each_ref()
            .map(|path| datum_of_grid(path, "tiny", Planet::EARTH, here).unwrap());
        for (lat, lon) in [(48.3, 8.4), (48.0, 8.0), (48.7, 8.99), (48.26, 8.51)] {
            let place = Geodetic::from_degrees(lat, lon, 100.0);
            let [a, b] = datums.each_ref().map(|d| d.to_ellipsoidal(place).unwrap());
            assert!((a.height_m - b.height_m).abs() < 1e-5, "{lat} {lon}");
            assert!((datums[1].height_m(b).unwrap() - 100.0).abs() < 1e-9);
        }
        assert_eq!(datums[1].grids()[0].path, paths[1]);
        let away = Geodetic::from_degrees(52.0, 8.4, 0.0);
        assert_eq!(
            datums[1].to_ellipsoidal(away).unwrap_err().to_string(),
            "found a place outside the grid of tiny, expected one within"
        );
        let error = datum_of_grid(&paths[1], "tiny.tif", Planet::EARTH, away).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "found \"tiny.tif\" with the grid {}, expected one that can be opened and reaches \
                 here (it does not hold the site)",
                paths[1].display()
            )
        );
    }

    #[test]
    fn a_geotiff_that_is_no_geoid_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("utm.tif");
        let map = Affine::north_up(456_000.0, 5_427_000.0, 10.0);
        let grid = HeightGrid::new(2, 2, Posts::F32(vec![1.0; 4]), map, "EPSG:32632").unwrap();
        write_geotiff(&path, &grid, Planet::EARTH).unwrap();
        let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
        let error = datum_of_grid(&path, "utm.tif", Planet::EARTH, here).unwrap_err();
        let expected = "(found \"EPSG:32632\", expected latitude and longitude)";
        assert!(error.to_string().ends_with(expected), "{error}");
    }
}
