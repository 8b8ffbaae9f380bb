//! Undulations of a geoid in a raster of latitudes and longitudes.

use std::path::Path;

use super::Geodetic;

/// How far a geoid is above the ellipsoid, at the posts of a regular raster in latitude and longitude; at
/// other places bilinear, as PROJ has it.
#[derive(Debug, Clone, PartialEq)]
pub struct GeoidRaster {
    columns: usize,
    rows: usize,
    west_deg: f64,
    north_deg: f64,
    step_lon_deg: f64,
    step_lat_deg: f64,
    undulations_m: Vec<f64>,
}

impl GeoidRaster {
    /// From metres at the posts, row by row from the north-west on; unknown ones are NaN. `first_deg` is
    /// longitude and latitude of the first post, `step_deg` the way to the next in each. `None` where
    /// there are fewer than 2 x 2 posts or as many numbers, or where a step is not above zero.
    pub fn new(
        [columns, rows]: [usize; 2],
        first_deg: [f64; 2],
        step_deg: [f64; 2],
        undulations_m: Vec<f64>,
    ) -> Option<Self> {
        let all = first_deg.iter().chain(&step_deg);
        let is_sound = columns > 1
            && rows > 1
            && columns.checked_mul(rows) == Some(undulations_m.len())
            && all.clone().all(|x| x.is_finite())
            && step_deg.iter().all(|&step| step > 0.0);
        is_sound.then_some(Self {
            columns,
            rows,
            west_deg: first_deg[0],
            north_deg: first_deg[1],
            step_lon_deg: step_deg[0],
            step_lat_deg: step_deg[1],
            undulations_m,
        })
    }

    /// The height of the geoid above the ellipsoid at a place, metres; `None` outside the raster and
    /// next to an unknown post.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "columns and rows are checked to be within the raster"
    )]
    pub fn undulation_m(&self, place: Geodetic) -> Option<f64> {
        let row = (self.north_deg - place.lat_deg()) / self.step_lat_deg;
        let column = (place.lon_deg() - self.west_deg).rem_euclid(360.0) / self.step_lon_deg;
        // A raster may hold one meridian at both of its ends, or lead round to its first.
        let is_round = self.columns as f64 * self.step_lon_deg > 360.0 - 1e-6 * self.step_lon_deg;
        let last = if is_round {
            self.columns as f64
        } else {
            (self.columns - 1) as f64
        };
        let edge = 1e-9;
        let is_within =
            row >= -edge && row <= (self.rows - 1) as f64 + edge && column <= last + edge;
        if !is_within {
            return None;
        }
        let top = (row.max(0.0) as usize).min(self.rows - 2);
        let left = if is_round {
            column as usize
        } else {
            (column as usize).min(self.columns - 2)
        };
        let (down, right) = (row - top as f64, column - left as f64);
        let post = |row: usize, column: usize| {
            self.undulations_m[row * self.columns + column % self.columns]
        };
        let across = |row: usize| (1.0 - right) * post(row, left) + right * post(row, left + 1);
        let undulation = (1.0 - down) * across(top) + down * across(top + 1);
        undulation.is_finite().then_some(undulation)
    }
}

/// Whether a file is a GeoTIFF by its name.
pub fn is_geotiff(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    extension.is_some_and(|e| e == "tif" || e == "tiff")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Undulation 2 per degree north, 0.5 per degree east, from 10 at latitude 0, longitude 0.
    fn plane(lon_deg: f64, lat_deg: f64) -> f64 {
        10.0 + 2.0 * lat_deg + 0.5 * lon_deg
    }

    #[test]
    fn a_plane_is_interpolated_exactly() {
        let posts = (0..3).flat_map(|row| {
            (0..4).map(move |column| plane(-1.0 + 0.5 * f64::from(column), 1.0 - f64::from(row)))
        });
        let raster = GeoidRaster::new([4, 3], [-1.0, 1.0], [0.5, 1.0], posts.collect()).unwrap();
        for (lat, lon) in [(1.0, -1.0), (0.25, -0.3), (-1.0, 0.5), (-0.9, 0.49)] {
            let found = raster.undulation_m(Geodetic::from_degrees(lat, lon, 5.0));
            assert!(
                (found.unwrap() - plane(lon, lat)).abs() < 1e-12,
                "{lat} {lon}"
            );
        }
        for (lat, lon) in [
            (1.1, 0.0),
            (-1.1, 0.0),
            (0.0, 0.51),
            (0.0, -1.01),
            (0.0, 180.0),
        ] {
            assert_eq!(
                raster.undulation_m(Geodetic::from_degrees(lat, lon, 0.0)),
                None
            );
        }
    }

    #[test]
    fn a_raster_round_the_planet_has_no_seam() {
        // From longitude 0 to 359 or to 360 in steps of one degree.
        for columns in [360, 361] {
            let row = (0..columns).map(|column| f64::from(column).to_radians().sin());
            let row: Vec<f64> = row.collect();
            let posts = [row.clone(), row].concat();
            let size = [usize::try_from(columns).unwrap(), 2];
            let raster = GeoidRaster::new(size, [0.0, 10.0], [1.0, 10.0], posts).unwrap();
            for lon in [-0.5, 179.5, -179.5, 0.0, -90.0] {
                let found = raster.undulation_m(Geodetic::from_degrees(3.0, lon, 0.0));
                let expected = f64::to_radians(lon).sin();
                assert!((found.unwrap() - expected).abs() < 1e-4, "{columns} {lon}");
            }
        }
    }

    #[test]
    fn what_is_no_raster_or_unknown_is_told() {
        assert!(GeoidRaster::new([2, 2], [0.0; 2], [1.0; 2], vec![0.0; 3]).is_none());
        assert!(GeoidRaster::new([2, 2], [0.0; 2], [1.0, -1.0], vec![0.0; 4]).is_none());
        let posts = vec![1.0, 1.0, f64::NAN, 1.0];
        let raster = GeoidRaster::new([2, 2], [0.0, 1.0], [1.0; 2], posts).unwrap();
        let inside = Geodetic::from_degrees(0.5, 0.5, 0.0);
        assert_eq!(raster.undulation_m(inside), None);
    }
}
