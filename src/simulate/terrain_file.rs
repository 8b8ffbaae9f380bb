//! The model of the ground, as a file.

use std::path::Path;

use rayon::prelude::*;

use crate::error::Error;
use crate::frame::{Geodetic, Point};
use crate::terrain::{Affine, HeightGrid, Posts, write_geotiff};

use super::Simulation;
use super::scene::Area;

/// How far beyond the detector's range the model reaches, metres.
const MARGIN_M: f64 = 10.0;

/// The most posts of a model: 256 MB of heights.
const MOST_POSTS: usize = 1 << 26;

/// Writes the model of the ground about the rocks and the traverse as a GeoTIFF in the planet's
/// geographic CRS, with posts about `post_m` apart.
///
/// # Errors
/// A file that cannot be written, or a model of too many posts.
pub(super) fn write_terrain(
    simulation: &Simulation,
    post_m: f64,
    path: &Path,
) -> Result<(), Error> {
    let grid = height_grid(simulation, post_m)?;
    write_geotiff(path, &grid, simulation.scene.site.planet())
}

fn height_grid(simulation: &Simulation, post_m: f64) -> Result<HeightGrid, Error> {
    let scene = &simulation.scene;
    let site = &scene.site;
    let area = extent(simulation);
    let height_m = scene.ground.height_m;
    let up_m = height_m - site.origin().height_m;
    let corner = |east, north| site.geodetic(Point::new(east, north, up_m));
    let north_west = corner(area.west_m, area.north_m);
    let south_east = corner(area.east_m, area.south_m);
    let columns = posts(area.east_m - area.west_m, post_m);
    let rows = posts(area.north_m - area.south_m, post_m);
    if columns.saturating_mul(rows) > MOST_POSTS {
        return Err(Error::Output(format!(
            "found a terrain model of {columns} x {rows} posts, expected at most {MOST_POSTS}: \
             ground.model.post_m is too small for the scene"
        )));
    }
    #[expect(clippy::cast_precision_loss, reason = "at most 2^26 posts")]
    let step = |from: f64, to: f64, n: usize| (to - from) / (n - 1) as f64;
    let crs_from_post = Affine {
        x0: north_west.lon_deg(),
        x_column: step(north_west.lon_deg(), south_east.lon_deg(), columns),
        x_row: 0.0,
        y0: north_west.lat_deg(),
        y_column: 0.0,
        y_row: step(north_west.lat_deg(), south_east.lat_deg(), rows),
    };
    let at = |column: usize, row: usize| {
        #[expect(clippy::cast_precision_loss, reason = "at most 2^26 posts")]
        let (c, r) = (column as f64, row as f64);
        let lon_deg = crs_from_post.x0 + crs_from_post.x_column * c;
        let lat_deg = crs_from_post.y0 + crs_from_post.y_row * r;
        let p = site
            .enu(Geodetic::from_degrees(lat_deg, lon_deg, height_m))
            .xyz;
        simulation.ground.model_height_m(p.x, p.y)
    };
    let heights: Vec<f64> = (0..rows)
        .into_par_iter()
        .flat_map_iter(|row| (0..columns).map(move |column| at(column, row)))
        .collect();
    let crs = site.planet().crs;
    HeightGrid::new(columns, rows, Posts::F64(heights), crs_from_post, crs)
        .map_err(|e| Error::Output(e.to_string()))
}

/// Posts over a length, at least two.
fn posts(length_m: f64, post_m: f64) -> usize {
    let intervals = (length_m / post_m).ceil().clamp(1.0, 1e9);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped"
    )]
    let posts = intervals as usize + 1;
    posts
}

/// The rocks and whatever the views may look at within the detector's range.
fn extent(simulation: &Simulation) -> Area {
    let scene = &simulation.scene;
    // A detector without a limit does not look at the whole planet.
    let reach_m = scene.detector.max_range_m.min(500.0) + MARGIN_M;
    let mut area = scene.rocks.area;
    for view in &simulation.views {
        let p = view.enu_from_body.translation.xyz;
        area.west_m = area.west_m.min(p.x - reach_m);
        area.east_m = area.east_m.max(p.x + reach_m);
        area.south_m = area.south_m.min(p.y - reach_m);
        area.north_m = area.north_m.max(p.y + reach_m);
    }
    area
}

#[cfg(test)]
mod tests {
    use super::super::{Scene, simulate};
    use super::*;
    use crate::terrain::Terrain;

    #[test]
    fn the_model_that_is_written_reads_as_the_scene_says() {
        let text = "[ground]\nslope_deg = 4\nslope_azimuth_deg = 30\nroughness_m = 0.05\n\
                    [ground.model]\nkind = \"raster\"\nerror_m = 0.03\npost_m = 0.25\n\
                    [rocks]\nnumber = 3\n";
        let simulation = simulate(&Scene::parse(text, "scene.toml").unwrap());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("terrain.tif");
        write_terrain(&simulation, 0.25, &path).unwrap();
        let site = simulation.scene.site;
        let terrain = Terrain::open(site, &[(path, "terrain.tif".to_owned())], None, None).unwrap();
        let mut error = 0.0;
        for i in 0..40 {
            let (east, north) = (f64::from(i) * 0.713, 3.0 - f64::from(i) * 0.27);
            let read = terrain.ground_at(east, north).unwrap().point;
            let model = simulation.ground.model_height_m(east, north);
            // Bilinear between posts 0.25 m apart: a few millimetres of the undulations are lost.
            assert!((site.height_m(read) - model).abs() < 0.01);
            error += (model - simulation.ground.height_m(east, north)).powi(2) / 40.0;
        }
        assert!((0.01..0.06).contains(&error.sqrt()), "{}", error.sqrt());
    }
}
