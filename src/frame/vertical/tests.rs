//! Datums of small grids, and what is said of those that do not serve.

use super::*;

/// A GTX grid (big-endian; NOAA's format as PROJ reads it): south, west, steps, rows, columns,
/// then heights from the south row on.
fn gtx(south: f64, west: f64, step: f64, rows: i32, columns: i32) -> Vec<u8> {
    let mut bytes = Vec::new();
    for number in [south, west, step, step] {
        bytes.extend(number.to_be_bytes());
    }
    bytes.extend(rows.to_be_bytes());
    bytes.extend(columns.to_be_bytes());
    for row in 0..rows {
        for column in 0..columns {
            let undulation = 30.0 + 0.5 * f64::from(row) - 2.0 * f64::from(column);
            #[expect(clippy::cast_possible_truncation, reason = "the format is single")]
            bytes.extend((undulation as f32).to_be_bytes());
        }
    }
    bytes
}

fn grid() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiny.gtx");
    std::fs::write(&path, gtx(48.0, 8.0, 0.5, 5, 5)).unwrap();
    (folder, path)
}

#[test]
fn a_grid_file_is_interpolated_both_ways() {
    let (_folder, path) = grid();
    let place = Geodetic::from_degrees(49.2, 8.9, 100.0);
    let datum = VerticalDatum::from_grid(&path, "tiny.gtx", place).unwrap();
    // Bilinear between the posts: row 2.4, column 1.8.
    let undulation = 30.0 + 0.5 * 2.4 - 2.0 * 1.8;
    let up = datum.to_ellipsoidal(place).unwrap();
    assert!((up.height_m - 100.0 - undulation).abs() < 1e-5, "{up:?}");
    assert_eq!((up.lat, up.lon), (place.lat, place.lon));
    assert!((datum.height_m(up).unwrap() - 100.0).abs() < 1e-9);
    assert_eq!(datum.grids()[0].path, path);
    let away = Geodetic::from_degrees(52.0, 8.9, 0.0);
    assert_eq!(
        datum.to_ellipsoidal(away).unwrap_err().to_string(),
        "found a place outside the grid of tiny.gtx, expected one within"
    );
}

#[test]
fn a_grid_that_cannot_serve_is_said() {
    let (folder, path) = grid();
    let far = Geodetic::from_degrees(10.0, 8.9, 100.0);
    let error = VerticalDatum::from_grid(&path, "tiny.gtx", far).unwrap_err();
    let expected = format!(
        "found \"tiny.gtx\" with the grid {}, expected one that can be opened and reaches here \
         (it does not hold the site)",
        path.display()
    );
    assert_eq!(error.to_string(), expected);
    let none = folder.path().join("none.gtx");
    let error = VerticalDatum::from_grid(&none, "none.gtx", far).unwrap_err();
    assert!(matches!(error, DatumError::BadGrid { .. }), "{error}");
}

#[test]
fn what_is_no_vertical_crs_is_said() {
    let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
    for (code, why) in [
        ("EPSG:32632", "(not a vertical one)"),
        ("EPSG:4326+5773", "(not a vertical one)"),
        ("EPSG:99999", "PROJ"),
    ] {
        let error = VerticalDatum::new(code, Planet::EARTH, here)
            .unwrap_err()
            .to_string();
        let start = format!(
            "found \"{code}\", expected a vertical coordinate reference system known to PROJ, \
             such as EPSG:5773, or a geoid grid in GTX or GeoTIFF format"
        );
        assert!(error.starts_with(&start) && error.contains(why), "{error}");
    }
    assert_eq!(
        VerticalDatum::new("EPSG:5773", Planet::MARS, here)
            .unwrap_err()
            .to_string(),
        "found \"EPSG:5773\", expected one that PROJ can turn into heights above the ellipsoid \
         here"
    );
}

/// Where grids are installed the datum is there, else the grid is named; never a silent nothing.
#[test]
fn a_geoid_is_applied_or_its_grid_is_named() {
    let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
    match VerticalDatum::new("EPSG:5773", Planet::EARTH, here) {
        Ok(datum) => {
            let height_m = datum.to_ellipsoidal(here).unwrap().height_m;
            assert!((47.0..50.0).contains(&height_m), "{height_m}");
        }
        Err(error) => {
            let text = error.to_string();
            let start = "found \"EPSG:5773\" without its grid, expected one of \
                         us_nga_egm96_15.tif";
            assert!(
                text.starts_with(start) && text.contains("PROJ_DATA"),
                "{text}"
            );
        }
    }
}
