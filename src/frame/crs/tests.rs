//! Values by pyproj and by closed forms.

use super::*;

/// Value by pyproj.
#[test]
fn utm_agrees_with_pyproj_both_ways() {
    let utm = Crs::new("EPSG:32632", Planet::EARTH).unwrap();
    let (lon, lat) = (8.4f64.to_radians(), 49f64.to_radians());
    let (x, y) = utm.xy(lon, lat).unwrap();
    assert!((x - 456_114.595_9).abs() < 1e-3 && (y - 5_427_629.203_9).abs() < 1e-3);
    let (lon2, lat2) = utm.lon_lat(x, y).unwrap();
    assert!((lon - lon2).abs() < 1e-12 && (lat - lat2).abs() < 1e-12);
}

#[test]
fn a_geographic_crs_gives_degrees() {
    let crs = Crs::new("EPSG:4326", Planet::EARTH).unwrap();
    let (x, y) = crs.xy(0.1, 0.2).unwrap();
    assert!((x - 0.1f64.to_degrees()).abs() < 1e-9 && (y - 0.2f64.to_degrees()).abs() < 1e-9);
}

#[test]
fn mars_has_its_own() {
    let crs = Crs::new("IAU_2015:49910", Planet::MARS).unwrap();
    let (x, _) = crs.xy(0.01, 0.0).unwrap();
    assert!((x - 33_961.9).abs() < 1e-3);
}

/// A map on a sphere has planetocentric latitudes, whatever the run's ellipsoid is.
#[test]
fn maps_on_a_sphere_and_on_an_ellipsoid_agree_on_places() {
    let planet = Planet::named("IAU_2015:49901").unwrap();
    let sphere = Crs::new("IAU_2015:49910", planet).unwrap();
    let (lat_c, _) = Planet::named("IAU_2015:49902")
        .unwrap()
        .lat_lon_deg(planet.place(20.0, -77.0, 0.0));
    let place = planet.place(20.0, -77.0, 0.0);
    let (x, y) = sphere.xy(place.lon, place.lat).unwrap();
    assert!((x - 77f64.to_radians() * 3_396_190.0).abs() < 1e-6);
    assert!((y - lat_c.to_radians() * 3_396_190.0).abs() < 1e-6);
    let (lon, lat) = sphere.lon_lat(x, y).unwrap();
    assert!((lon - place.lon).abs() < 1e-14 && (lat - place.lat).abs() < 1e-14);
}

/// On a sphere `tan c = tan(lon) sin(lat)` (Snyder 1987, eq. 8-9).
#[test]
fn convergence_of_a_transverse_mercator() {
    let crs = Crs::new("+proj=tmerc +R=3396190 +lon_0=10 +type=crs", Planet::MARS).unwrap();
    for (lat, lon) in [(60.0, 12.5), (-35.0, 8.0), (0.0, 14.0), (80.0, 10.0)] {
        let place = Geodetic::from_degrees(lat, lon, 0.0);
        let expected = ((lon - 10.0).to_radians().tan() * place.lat.sin()).atan();
        let found = crs.convergence(place).unwrap();
        assert!(
            (found - expected).abs() < 1e-8,
            "{lat} {lon}: {found} {expected}"
        );
    }
}

/// On a polar map grid north is a longitude's distance from true north.
#[test]
fn convergence_near_a_pole() {
    let crs = Crs::new("IAU_2015:30135", Planet::MOON).unwrap();
    for lon in [-170.0, -90.0, 0.0, 30.0, 120.0] {
        let place = Geodetic::from_degrees(-89.0, lon, 0.0);
        let turn = crs.convergence(place).unwrap() + f64::to_radians(lon);
        assert!(turn.sin().abs() < 1e-8 && turn.cos() > 0.0, "{lon}: {turn}");
    }
}

#[test]
fn systems_of_another_body_are_told_by_name() {
    for (code, planet, expected) in [
        (
            "IAU_2015:30135",
            Planet::MARS,
            "found \"IAU_2015:30135\" (Moon (2015) - Sphere / Ocentric / South Polar, of 1737.4 km), \
             expected one of mars, of 3396.2 km",
        ),
        (
            "EPSG:32633",
            Planet::MOON,
            "found \"EPSG:32633\" (WGS 84 / UTM zone 33N, of 6378.1 km), expected one of moon, of \
             1737.4 km",
        ),
        (
            "IAU_2015:49910",
            Planet::EARTH,
            "found \"IAU_2015:49910\" (Mars (2015) - Sphere / Ocentric / Equirectangular, clon = 0, of \
             3396.2 km), expected one of earth, of 6378.1 km",
        ),
    ] {
        assert_eq!(Crs::new(code, planet).unwrap_err().to_string(), expected);
    }
    // Old datums and the spheres of old maps are of the body all the same.
    for code in ["EPSG:4267", "+proj=sinu +R=6371007.181 +type=crs"] {
        assert!(Crs::new(code, Planet::EARTH).is_ok());
    }
    assert!(Crs::new("+proj=stere +lat_0=90 +R=3376200 +type=crs", Planet::MARS).is_ok());
}

#[test]
fn maps_are_written_in_two_dimensions() {
    for code in [
        "EPSG:32633",
        "EPSG:4326",
        "EPSG:2193",
        "+proj=laea +lat_0=50 +type=crs",
    ] {
        assert!(Crs::for_map(code, Planet::EARTH).is_ok(), "{code}");
    }
    for (code, name) in [
        ("EPSG:4979", "WGS 84"),
        ("EPSG:4978", "WGS 84"),
        ("EPSG:5773", "EGM96 height"),
        ("EPSG:32633+5773", "WGS 84 / UTM zone 33N + EGM96 height"),
    ] {
        assert_eq!(
            Crs::for_map(code, Planet::EARTH).unwrap_err().to_string(),
            format!(
                "found \"{code}\" ({name}), expected a map projection, or latitudes and eastward \
                 longitudes, without heights"
            )
        );
    }
    let westward = Planet::named("IAU_2015:49901").unwrap();
    assert!(Crs::for_map("IAU_2015:49901", westward).is_err());
}

#[test]
fn unknown_ones_are_named() {
    let error = Crs::new("EPSG:999999", Planet::EARTH).unwrap_err();
    assert!(error.to_string().starts_with(
        "found \"EPSG:999999\", expected a coordinate reference system known to PROJ"
    ));
}
