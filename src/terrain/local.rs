//! Rasters that are tied to the site's origin: metres east, north and up in its tangent plane.

use super::grid::{Affine, HeightGrid, HeightsAbove, Posts};
use crate::frame::{Enu, Point, Site};

/// The raster on a map of the planet, with its heights above the ellipsoid, where it was in the plane of
/// the site's origin; any other as it is.
///
/// The map is the orthographic one about the origin, in which lengths are those of the ellipsoid: a place
/// at the origin's height is nearer to it there than in the plane, as the radii of curvature are to
/// those at that height. Places off that height by h are displaced by h/R of their distance from the
/// origin: 3 mm for 10 m of height at 1 km on Mars.
#[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
pub(super) fn on_planet(site: &Site, grid: HeightGrid) -> HeightGrid {
    if *grid.heights_above() != HeightsAbove::SiteOrigin {
        return grid;
    }
    let plane = grid.crs_from_post();
    let mut heights = Vec::with_capacity(grid.columns() * grid.rows());
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let up = grid.height_m(column, row);
            let (east, north) = plane.apply(column as f64, row as f64);
            heights.push(if up.is_nan() {
                f64::NAN
            } else {
                site.height_m(Point::<Enu>::new(east, north, up))
            });
        }
    }
    let (origin, ellipsoid) = (site.origin(), site.planet().ellipsoid);
    let (a, f) = (ellipsoid.a, ellipsoid.f);
    let squared = f * (2.0 - f);
    let w2 = 1.0 - squared * origin.lat.sin().powi(2);
    let across_m = a / w2.sqrt();
    let along_m = across_m * (1.0 - squared) / w2;
    let east = across_m / (across_m + origin.height_m);
    let north = along_m / (along_m + origin.height_m);
    let map = Affine {
        x0: plane.x0 * east,
        x_column: plane.x_column * east,
        x_row: plane.x_row * east,
        y0: plane.y0 * north,
        y_column: plane.y_column * north,
        y_row: plane.y_row * north,
    };
    let crs = format!(
        "+proj=ortho +lat_0={} +lon_0={} +a={a} +b={} +no_defs +type=crs",
        origin.lat_deg(),
        origin.lon_deg(),
        a * (1.0 - f),
    );
    grid.on_map(Posts::F64(heights), map, crs)
        .with_heights_above(HeightsAbove::Ellipsoid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Geodetic, Planet};
    use crate::terrain::Terrain;

    /// A tilted plane of the local frame, 5 cm a metre to the east, is found where it was put.
    #[test]
    fn a_plane_of_the_local_frame_stays_where_it_is() {
        for (planet, height_m) in [(Planet::MARS, -2_600.0), (Planet::EARTH, 4_000.0)] {
            let site = Site::new(planet, Geodetic::from_degrees(-14.6, 175.5, height_m));
            let up = |east: f64| 2.0 + 0.05 * east;
            let map = Affine::north_up(-40.0, 30.0, 0.5);
            let (columns, rows) = (161, 121);
            let posts = (0..columns * rows).map(|i| {
                let column = u32::try_from(i % columns).unwrap();
                up(-40.0 + 0.5 * f64::from(column))
            });
            let grid = HeightGrid::new(columns, rows, Posts::F64(posts.collect()), map, "")
                .unwrap()
                .with_heights_above(HeightsAbove::SiteOrigin);
            let terrain = Terrain::from_grids(site, vec![grid], None).unwrap();
            for (east, north) in [(0.0, 0.0), (38.2, -28.1), (-39.0, 29.9), (12.3, 0.4)] {
                let ground = terrain.ground_at(east, north).unwrap();
                let off = ground.point.xyz.z - up(east);
                assert!(off.abs() < 2e-5, "{east} {north} {off}");
            }
            // The outermost posts are where the raster ends.
            assert!(terrain.ground_at(39.99, 0.0).is_some());
            assert!(terrain.ground_at(40.01, 0.0).is_none());
        }
    }
}
