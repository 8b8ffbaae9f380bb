//! From the keys of a GeoTIFF to a definition PROJ understands.

use super::keys::{
    CITATION, GEOG_ANGULAR_UNITS, GEOG_CITATION, GEOG_ELLIPSOID, GEOG_INV_FLATTENING,
    GEOG_PRIME_MERIDIAN, GEOG_SEMI_MAJOR, GEOG_SEMI_MINOR, GEOGRAPHIC_TYPE, GeoKeys, KeyFault,
    MODEL_TYPE, PROJ_COORD_TRANS, PROJ_LINEAR_UNIT_SIZE, PROJ_LINEAR_UNITS, PROJECTED_CITATION,
    PROJECTED_TYPE, USER_DEFINED, metres,
};

/// Model types of the standard.
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;

/// The coordinate reference system of the keys: `EPSG:CODE`, another authority's code from a
/// citation, or a PROJ string for one that the keys define themselves.
///
/// # Errors
/// Which key does not serve, what was found in it and what was expected.
pub(super) fn crs(keys: &GeoKeys) -> Result<String, KeyFault> {
    match keys.code(MODEL_TYPE) {
        Some(PROJECTED) => projected(keys),
        Some(GEOGRAPHIC) => geographic(keys),
        Some(other) if other != 0 && other != USER_DEFINED => Err(KeyFault::new(
            "GTModelTypeGeoKey",
            format!("found {other}, expected 1 (projected) or 2 (geographic)"),
        )),
        _ if keys.code(PROJECTED_TYPE).is_some() => projected(keys),
        _ if keys.code(GEOGRAPHIC_TYPE).is_some() => geographic(keys),
        _ => Err(KeyFault::new(
            "GeoKeyDirectory",
            "found no coordinate reference system, expected ProjectedCRSGeoKey or GeodeticCRSGeoKey",
        )),
    }
}

fn projected(keys: &GeoKeys) -> Result<String, KeyFault> {
    if let Some(code) = epsg(keys, PROJECTED_TYPE) {
        return Ok(code);
    }
    let Some(method) = keys.code(PROJ_COORD_TRANS) else {
        return cited(keys, &[CITATION, PROJECTED_CITATION]).ok_or_else(|| {
            KeyFault::new(
                "ProjectedCRSGeoKey",
                "found a user-defined one without ProjMethodGeoKey, expected an EPSG code, \
                 ProjMethodGeoKey, or a citation such as IAU_2015:49910",
            )
        });
    };
    let unit = linear_unit_m(keys)?;
    Ok(format!(
        "+proj={} {} +to_meter={unit} +no_defs +type=crs",
        conversion(keys, method, unit)?,
        ellipsoid(keys)?
    ))
}

fn geographic(keys: &GeoKeys) -> Result<String, KeyFault> {
    match keys.code(GEOG_ANGULAR_UNITS) {
        None | Some(9102) => {}
        Some(unit) => {
            return Err(KeyFault::new(
                "GeogAngularUnitsGeoKey",
                format!("found unit {unit}, expected 9102 (degree)"),
            ));
        }
    }
    if let Some(code) = epsg(keys, GEOGRAPHIC_TYPE) {
        return Ok(code);
    }
    match cited(keys, &[CITATION, GEOG_CITATION]) {
        Some(code) => Ok(code),
        None => Ok(format!(
            "+proj=longlat {} +no_defs +type=crs",
            ellipsoid(keys)?
        )),
    }
}

fn epsg(keys: &GeoKeys, key: u16) -> Option<String> {
    keys.code(key)
        .filter(|&code| code != 0 && code != USER_DEFINED)
        .map(|code| format!("EPSG:{code}"))
}

/// An authority's code within the words of a citation.
fn cited(keys: &GeoKeys, citations: &[u16]) -> Option<String> {
    citations
        .iter()
        .filter_map(|&key| keys.text(key))
        .find_map(|text| {
            ["IAU_2015:", "EPSG:", "ESRI:"]
                .into_iter()
                .find_map(|authority| {
                    let code = &text[text.find(authority)? + authority.len()..];
                    let end = code
                        .find(|c: char| !c.is_ascii_digit())
                        .unwrap_or(code.len());
                    (end > 0).then(|| format!("{authority}{}", &code[..end]))
                })
        })
}

fn linear_unit_m(keys: &GeoKeys) -> Result<f64, KeyFault> {
    let Some(unit) = keys.code(PROJ_LINEAR_UNITS) else {
        return Ok(1.0);
    };
    let size = if unit == USER_DEFINED {
        keys.number(PROJ_LINEAR_UNIT_SIZE)
    } else {
        metres(unit)
    };
    size.ok_or_else(|| {
        KeyFault::new(
            "ProjLinearUnitsGeoKey",
            format!("found unit {unit}, expected 9001 (metre), 9002 or 9003 (foot), or its size"),
        )
    })
}

fn ellipsoid(keys: &GeoKeys) -> Result<String, KeyFault> {
    let meridian = match keys.number(GEOG_PRIME_MERIDIAN) {
        Some(degrees) if degrees != 0.0 => format!(" +pm={degrees}"),
        _ => String::new(),
    };
    let shape = match (
        keys.number(GEOG_SEMI_MAJOR),
        keys.number(GEOG_SEMI_MINOR),
        keys.number(GEOG_INV_FLATTENING),
    ) {
        (Some(a), Some(b), _) => format!("+a={a} +b={b}"),
        (Some(a), None, Some(rf)) if rf != 0.0 => format!("+a={a} +rf={rf}"),
        (Some(a), None, _) => format!("+a={a} +b={a}"),
        _ => match (keys.code(GEOGRAPHIC_TYPE), keys.code(GEOG_ELLIPSOID)) {
            (Some(4326), _) | (_, Some(7030)) => "+datum=WGS84".to_owned(),
            (Some(4258 | 4269), _) | (_, Some(7019)) => "+ellps=GRS80".to_owned(),
            (code, _) => {
                return Err(KeyFault::new(
                    "GeodeticCRSGeoKey",
                    match code {
                        Some(code) => format!(
                            "found {code} under a user-defined projection, expected its ellipsoid's axes"
                        ),
                        None => "found none, expected one or its ellipsoid's axes".to_owned(),
                    },
                ));
            }
        },
    };
    Ok(shape + &meridian)
}

/// PROJ's name and parameters of a conversion (Annex C of the standard). Offsets are in the linear
/// unit in the keys, and in metres in a PROJ string.
fn conversion(keys: &GeoKeys, method: u16, unit_m: f64) -> Result<String, KeyFault> {
    let first = |options: &[u16]| options.iter().find_map(|&key| keys.number(key));
    let offset = |options: &[u16]| first(options).unwrap_or(0.0) * unit_m;
    // Of the natural origin, the false origin or the centre, whichever the writer has chosen.
    let lon = first(&[3080, 3084, 3088, 3095]).unwrap_or(0.0);
    let lat = first(&[3081, 3085, 3089]).unwrap_or(0.0);
    let scale = first(&[3092, 3093]).unwrap_or(1.0);
    let (parallel_1, parallel_2) = (first(&[3078]), first(&[3079]));
    let (x, y) = (offset(&[3082, 3086, 3090]), offset(&[3083, 3087, 3091]));
    let (lat_1, lat_2) = (parallel_1.unwrap_or(lat), parallel_2.unwrap_or(lat));
    let name = match method {
        1 => format!("tmerc +lat_0={lat} +k={scale}"),
        7 => match parallel_1 {
            Some(lat_ts) => format!("merc +lat_ts={lat_ts}"),
            None => format!("merc +k={scale}"),
        },
        8 => format!("lcc +lat_1={lat_1} +lat_2={lat_2} +lat_0={lat}"),
        9 => format!("lcc +lat_1={lat} +lat_0={lat} +k_0={scale}"),
        10 => format!("laea +lat_0={lat}"),
        11 => format!("aea +lat_1={lat_1} +lat_2={lat_2} +lat_0={lat}"),
        12 => format!("aeqd +lat_0={lat}"),
        14 => format!("stere +lat_0={lat} +k={scale}"),
        15 if lat.abs() >= 90.0 => format!("stere +lat_0={lat} +k={scale}"),
        // Variant B: the latitude is that of true scale.
        15 => format!("stere +lat_0={} +lat_ts={lat}", 90f64.copysign(lat)),
        16 => format!("sterea +lat_0={lat} +k={scale}"),
        17 => format!("eqc +lat_ts={} +lat_0={lat}", parallel_1.unwrap_or(0.0)),
        20 => format!("gnom +lat_0={lat}"),
        21 => format!("ortho +lat_0={lat}"),
        24 => "sinu".to_owned(),
        28 => format!("cea +lat_ts={}", parallel_1.unwrap_or(0.0)),
        _ => {
            return Err(KeyFault::new(
                "ProjMethodGeoKey",
                format!(
                    "found method {method}, expected one of 1, 7 to 12, 14 to 17, 20, 21, 24, 28"
                ),
            ));
        }
    };
    Ok(format!("{name} +lon_0={lon} +x_0={x} +y_0={y}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Crs, Planet};

    fn definition(
        codes: &[(u16, u16)],
        numbers: &[(u16, f64)],
        citation: &str,
    ) -> Result<String, String> {
        let total = codes.len() + numbers.len() + usize::from(!citation.is_empty());
        let mut directory = vec![1, 1, 0, u16::try_from(total).unwrap()];
        for &(key, code) in codes {
            directory.extend([key, 0, 1, code]);
        }
        for (i, &(key, _)) in numbers.iter().enumerate() {
            directory.extend([key, 34736, 1, u16::try_from(i).unwrap()]);
        }
        if !citation.is_empty() {
            directory.extend([CITATION, 34737, u16::try_from(citation.len()).unwrap(), 0]);
        }
        let doubles: Vec<f64> = numbers.iter().map(|n| n.1).collect();
        let keys = GeoKeys::parse(&directory, &doubles, citation).unwrap();
        crs(&keys).map_err(|fault| format!("{}: {}", fault.key, fault.problem))
    }

    #[test]
    fn codes_and_citations_are_taken_as_they_are() {
        let utm = definition(&[(1024, 1), (3072, 32632)], &[], "");
        assert_eq!(utm.as_deref(), Ok("EPSG:32632"));
        let degrees = definition(&[(1024, 2), (2048, 4326), (2054, 9102)], &[], "");
        assert_eq!(degrees.as_deref(), Ok("EPSG:4326"));
        let mars = definition(
            &[(1024, 1), (3072, 32767)],
            &[],
            "IAU_2015:49910 (equirectangular)",
        );
        assert_eq!(mars.as_deref(), Ok("IAU_2015:49910"));
    }

    /// The keys that GDAL 3.6 writes for the IAU's codes, against PROJ's own definition of these.
    #[test]
    fn planetary_definitions_agree_with_their_codes() {
        let mars = [
            (3078, 0.0),
            (3088, 0.0),
            (3089, 0.0),
            (3082, 0.0),
            (3083, 0.0),
        ];
        let mars_axes = [(2057, 3_396_190.0), (2058, 3_396_190.0), (2061, 0.0)];
        let moon = [
            (3081, -90.0),
            (3095, 0.0),
            (3092, 1.0),
            (3082, 0.0),
            (3083, 0.0),
        ];
        let moon_axes = [(2057, 1_737_400.0), (2058, 1_737_400.0), (2061, 0.0)];
        for (planet, code, method, numbers, axes, (lon, lat)) in [
            (
                Planet::MARS,
                "IAU_2015:49910",
                17,
                mars,
                mars_axes,
                (1.3, 0.4),
            ),
            (
                Planet::MOON,
                "IAU_2015:30135",
                15,
                moon,
                moon_axes,
                (0.7, -1.5),
            ),
        ] {
            let codes = [
                (1024, 1),
                (2048, 32767),
                (3072, 32767),
                (3075, method),
                (3076, 9001),
            ];
            let numbers: Vec<(u16, f64)> = numbers.into_iter().chain(axes).collect();
            let found = Crs::new(&definition(&codes, &numbers, "").unwrap(), planet).unwrap();
            let expected = Crs::new(code, planet).unwrap().xy(lon, lat).unwrap();
            let (x, y) = found.xy(lon, lat).unwrap();
            assert!((x - expected.0).hypot(y - expected.1) < 1e-6, "{code}");
        }
    }

    #[test]
    fn user_defined_lambert_in_feet_agrees_with_its_code() {
        // EPSG:2277, NAD83 / Texas Central (US survey feet), by its parameters.
        let numbers = [
            (3078, 31.883_333_333_333_333),
            (3079, 30.116_666_666_666_667),
            (3084, -100.333_333_333_333_33),
            (3085, 29.666_666_666_666_668),
            (3086, 2_296_583.333_333_333),
            (3087, 9_842_500.0),
        ];
        let codes = [
            (1024, 1),
            (2048, 4269),
            (3072, 32767),
            (3075, 8),
            (3076, 9003),
        ];
        let found = Crs::new(&definition(&codes, &numbers, "").unwrap(), Planet::EARTH).unwrap();
        let code = Crs::new("EPSG:2277", Planet::EARTH).unwrap();
        let (lon, lat) = (-97.7f64.to_radians(), 30.3f64.to_radians());
        let (a, b) = (found.xy(lon, lat).unwrap(), code.xy(lon, lat).unwrap());
        assert!((a.0 - b.0).hypot(a.1 - b.1) < 5.0, "{a:?} {b:?}");
    }

    #[test]
    fn what_cannot_be_told_is_said() {
        for (codes, expected) in [
            (
                &[(1024, 3)][..],
                "GTModelTypeGeoKey: found 3, expected 1 (projected) or 2 (geographic)",
            ),
            (
                &[(1025, 1)],
                "GeoKeyDirectory: found no coordinate reference system, expected ProjectedCRSGeoKey \
                 or GeodeticCRSGeoKey",
            ),
            (
                &[(1024, 1), (3072, 32767)],
                "ProjectedCRSGeoKey: found a user-defined one without ProjMethodGeoKey, expected an \
                 EPSG code, ProjMethodGeoKey, or a citation such as IAU_2015:49910",
            ),
            (
                &[(1024, 1), (2048, 4326), (3072, 32767), (3075, 27)],
                "ProjMethodGeoKey: found method 27, expected one of 1, 7 to 12, 14 to 17, 20, 21, \
                 24, 28",
            ),
            (
                &[(1024, 1), (2048, 4202), (3072, 32767), (3075, 1)],
                "GeodeticCRSGeoKey: found 4202 under a user-defined projection, expected its \
                 ellipsoid's axes",
            ),
            (
                &[
                    (1024, 1),
                    (2048, 4326),
                    (3072, 32767),
                    (3075, 1),
                    (3076, 9005),
                ],
                "ProjLinearUnitsGeoKey: found unit 9005, expected 9001 (metre), 9002 or 9003 \
                 (foot), or its size",
            ),
            (
                &[(1024, 2), (2048, 4326), (2054, 9101)],
                "GeogAngularUnitsGeoKey: found unit 9101, expected 9102 (degree)",
            ),
        ] {
            assert_eq!(definition(codes, &[], ""), Err(expected.to_owned()));
        }
    }
}
