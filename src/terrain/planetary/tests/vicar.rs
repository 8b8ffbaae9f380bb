//! VICAR files by hand.

use crate::frame::{Crs, Geodetic, Planet, Site};
use crate::terrain::{HeightGrid, HeightsAbove, Terrain, read_heights};

const SITE: &str = "PROPERTY='DERIVED_IMAGE_PARMS' DERIVED_IMAGE_TYPE='Z_MAP' \
    REFERENCE_COORD_SYSTEM_NAME='SITE_FRAME' PROPERTY='IMAGE_DATA' MISSING_CONSTANT=(3.40282E+38) \
    INVALID_CONSTANT=-9999.99 PROPERTY='SURFACE_PROJECTION_PARMS' MAP_PROJECTION_TYPE='ORTHORECTIFIED' \
    MAP_SCALE=(0.5,0.5) MAP_SCALE__UNIT=('M/PIXEL','M/PIXEL') X_AXIS_MAXIMUM=10.0 X_AXIS_MINIMUM=9.0 \
    Y_AXIS_MAXIMUM=-3.5 Y_AXIS_MINIMUM=-5.0 REFERENCE_COORD_SYSTEM_NAME='SITE_FRAME'";

const MAP: &str = "PROPERTY='IMAGE_MAP_PROJECTION' MAP_PROJECTION_TYPE='EQUIRECTANGULAR' \
    A_AXIS_RADIUS=3396.19 A_AXIS_RADIUS__UNIT='KM' CENTER_LATITUDE=-10.0 CENTER_LONGITUDE=137.0 \
    MAP_SCALE=2.0 MAP_SCALE__UNIT='M/PIXEL' LINE_PROJECTION_OFFSET=-5000.5 SAMPLE_PROJECTION_OFFSET=100.5";

const GEOTIFF: &str = "PROPERTY='GEOTIFF' GTMODELTYPEGEOKEY='1(ModelTypeProjected)' \
    PROJECTEDCSTYPEGEOKEY='32611(PCS_WGS84_UTM_zone_11N)' GTRASTERTYPEGEOKEY='2(RasterPixelIsPoint)' \
    MODELTIEPOINTTAG='(0,0,0,447000.0,3800000.0,0)' MODELPIXELSCALETAG='(30.0,30.0,0)'";

const REAL: &str =
    "FORMAT='REAL' ORG='BSQ' NL=2 NS=3 NB=1 NBB=0 NLB=0 EOL=0 INTFMT='LOW' REALFMT='RIEEE'";

/// Two rows of three, counted down.
const Z: [f32; 6] = [-1.5, -1.25, 2.0, f32::MAX, -9999.99, 0.5];

fn label(words: &str) -> Vec<u8> {
    // The label's length is a number of its own digits.
    let text = format!("LBLSIZE={:<8}{words}", words.len() + 20);
    format!("{text:<width$}", width = words.len() + 20).into_bytes()
}

fn read(bytes: &[u8]) -> Result<HeightGrid, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.vic");
    std::fs::write(&path, bytes).unwrap();
    read_heights(&path, "dem.vic").map_err(|error| error.to_string())
}

fn file(words: &str, samples: &[f32]) -> Vec<u8> {
    let mut bytes = label(words);
    bytes.extend(samples.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

fn heights(grid: &HeightGrid) -> Vec<f64> {
    (0..6).map(|i| grid.height_m(i % 3, i / 3)).collect()
}

#[test]
fn a_map_of_a_site_is_north_up_and_counts_up() {
    let grid = read(&file(&format!("{REAL} {SITE}"), &Z)).unwrap();
    let found = heights(&grid);
    assert_eq!(found[..3], [1.5, 1.25, -2.0]);
    assert!(found[3].is_nan() && found[4].is_nan() && found[5] == -0.5);
    assert_eq!(*grid.heights_above(), HeightsAbove::SiteOrigin);
    // The first post is in the middle of its pixel: 4.75 m west and 9.75 m north of the origin.
    assert_eq!(grid.crs_from_post().apply(0.0, 0.0), (-4.75, 9.75));
    assert_eq!(grid.crs_from_post().apply(2.0, 1.0), (-3.75, 9.25));
    let up = SITE.replace("Z_MAP", "ELEVATION_MAP");
    let known = [-1.5, -1.25, 2.0, -1.5, -1.25, 2.0];
    let grid = read(&file(&format!("{REAL} {up}"), &known)).unwrap();
    assert_eq!(heights(&grid)[..3], [-1.5, -1.25, 2.0]);
    let site = Site::new(Planet::MARS, Geodetic::from_degrees(18.4, 77.4, -2570.0));
    let terrain = Terrain::from_grids(site, vec![grid], None).unwrap();
    let ground = terrain.ground_at(-4.7499, 9.7499).unwrap();
    assert!((ground.point.xyz.z + 1.5).abs() < 1e-3, "{ground:?}");
}

#[test]
fn a_map_of_the_planet_may_stand_in_the_second_part_of_the_label() {
    let heights: [i16; 6] = [100, 200, 300, -400, -32768, 600];
    let first = "FORMAT='HALF' ORG='BIL' NL=2 NS=3 NB=1 NBB=4 NLB=1 RECSIZE=10 EOL=1 INTFMT='HIGH'";
    let mut bytes = label(first);
    bytes.extend([7u8; 10]);
    for row in heights.chunks(3) {
        bytes.extend([9u8; 4]);
        bytes.extend(row.iter().flat_map(|x| x.to_be_bytes()));
    }
    bytes.extend(label(&format!(
        "{MAP} MISSING_CONSTANT=-32768 TASK='MAP' USER='x'"
    )));
    let grid = read(&bytes).unwrap();
    // The constant stands in the map's own property, where no one looks for it.
    assert_eq!(
        self::heights(&grid),
        [100.0, 200.0, 300.0, -400.0, -32768.0, 600.0]
    );
    assert_eq!(grid.crs_from_post().apply(0.0, 0.0), (-201.0, -10_001.0));
    let crs = Crs::new(grid.crs(), Planet::MARS).unwrap();
    let (lon, lat) = crs.lon_lat(-201.0, -10_001.0).unwrap();
    assert!((lat + 10_001.0 / 3_396_190.0).abs() < 1e-12);
    let along = 201.0 / (3_396_190.0 * 10f64.to_radians().cos());
    assert!((lon - (137f64.to_radians() - along)).abs() < 1e-12);
}

#[test]
fn keys_of_a_geotiff_serve_by_their_names() {
    let grid = read(&file(&format!("{REAL} {GEOTIFF}"), &Z)).unwrap();
    assert_eq!(grid.crs(), "EPSG:32611");
    assert_eq!(
        grid.crs_from_post().apply(1.0, 1.0),
        (447_030.0, 3_799_970.0)
    );
    assert_eq!(grid.height_m(0, 0), -1.5);
    let area = GEOTIFF.replace("2(RasterPixelIsPoint)", "1(RasterPixelIsArea)");
    let grid = read(&file(&format!("{REAL} {area}"), &Z)).unwrap();
    assert_eq!(
        grid.crs_from_post().apply(0.0, 0.0),
        (447_015.0, 3_799_985.0)
    );
}

#[test]
fn a_pds3_label_before_a_vicar_one_is_the_one_that_counts() {
    let map = "GROUP = SURFACE_PROJECTION_PARMS\r\n MAP_PROJECTION_TYPE = VERTICAL\r\n \
        MAP_SCALE = (0.5 <m/pixel>, 0.5 <m/pixel>)\r\n X_AXIS_MAXIMUM = 10.0 <m>\r\n \
        Y_AXIS_MINIMUM = -5.0 <m>\r\nEND_GROUP = SURFACE_PROJECTION_PARMS\r\n\
        GROUP = DERIVED_IMAGE_PARMS\r\n DERIVED_IMAGE_TYPE = ELEVATION_MAP\r\n\
        END_GROUP = DERIVED_IMAGE_PARMS\r\n";
    let vicar = label(REAL);
    let odl = |at: usize| {
        format!(
            "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 12\r\n^IMAGE_HEADER = 2000 <BYTES>\r\n\
             ^IMAGE = {at} <BYTES>\r\n{map}OBJECT = IMAGE\r\n LINES = 2\r\n LINE_SAMPLES = 3\r\n \
             SAMPLE_TYPE = PC_REAL\r\n SAMPLE_BITS = 32\r\nEND_OBJECT = IMAGE\r\nEND\r\n"
        )
    };
    let mut bytes = odl(1999 + vicar.len() + 1).into_bytes();
    bytes.resize(1999, b' ');
    bytes.extend(vicar);
    bytes.extend(Z.iter().flat_map(|x| x.to_le_bytes()));
    let grid = read(&bytes).unwrap();
    assert_eq!(heights(&grid)[..3], [-1.5, -1.25, 2.0]);
    assert_eq!(grid.crs_from_post().apply(0.0, 0.0), (-4.75, 9.75));
}

#[test]
fn what_does_not_serve_is_told_exactly() {
    let whole = format!("{REAL} {SITE}");
    for (from, to, expected) in [
        (
            "NL=2",
            "NL=1",
            "NL: found 1, expected a whole number above 1",
        ),
        (
            "NS=3",
            "N=3",
            "NS: found nothing, expected a whole number above 1",
        ),
        ("NB=1", "NB=2", "NB: found 2, expected 1, a band of heights"),
        (
            "'REAL'",
            "'COMP'",
            "FORMAT: found COMP, expected BYTE, HALF, FULL, REAL or DOUB",
        ),
        (
            "RIEEE",
            "VAX",
            "REALFMT: found VAX, expected IEEE or RIEEE: numbers of the VAX are not read",
        ),
        (
            "REALFMT",
            "OTHER",
            "REALFMT: found VAX, expected IEEE or RIEEE: numbers of the VAX are not read",
        ),
        ("'BSQ'", "'BIX'", "ORG: found BIX, expected BSQ, BIL or BIP"),
        (
            "'BSQ' NL=2 NS=3 NB=1 NBB=0",
            "'BIP' NL=2 NS=3 NB=1 NBB=4",
            "ORG: found BIP with NBB=4, NLB=0, expected BSQ or BIL, or no binary labels",
        ),
        (
            "EOL=0",
            "EOL=0 RECSIZE=13",
            "RECSIZE: found 13, expected 12, NBB and NS samples of 4 bytes",
        ),
        (
            "EOL=0",
            "EOL=0 COMPRESS='BASIC'",
            "COMPRESS: found BASIC, expected plain samples",
        ),
        (
            "Z_MAP",
            "XYZ_MAP",
            "DERIVED_IMAGE_TYPE: found XYZ_MAP, expected ELEVATION_MAP (heights count up) or Z_MAP (they count down)",
        ),
        (
            "DERIVED_IMAGE_TYPE",
            "TYPE",
            "DERIVED_IMAGE_TYPE: found nothing, expected ELEVATION_MAP (heights count up) or Z_MAP (they count down)",
        ),
        (
            "'ORTHORECTIFIED'",
            "'CYLINDRICAL'",
            "MAP_PROJECTION_TYPE: found CYLINDRICAL, expected ORTHORECTIFIED, ORTHOGRAPHIC or VERTICAL, a map from above",
        ),
        (
            "Y_AXIS_MINIMUM=-5.0 REFERENCE_COORD_SYSTEM_NAME='SITE_FRAME'",
            "Y_AXIS_MINIMUM=-5.0 REFERENCE_COORD_SYSTEM_NAME='ROVER_FRAME'",
            "REFERENCE_COORD_SYSTEM_NAME: found ROVER_FRAME, expected SITE_FRAME, whose origin is that of the run's local frame",
        ),
        (
            "X_AXIS_MAXIMUM=10.0",
            "X_AXIS_MAXIMUM=12.0",
            "X_AXIS_MAXIMUM: found 12 m, expected 10 m, 2 pixels from X_AXIS_MINIMUM",
        ),
        (
            "MAP_SCALE=(0.5,0.5)",
            "MAP_SCALE=(0,0.5)",
            "MAP_SCALE: found 0, expected a length above zero",
        ),
        (
            "Y_AXIS_MAXIMUM=-3.5 Y_AXIS_MINIMUM=-5.0",
            "",
            "Y_AXIS_MAXIMUM: found nothing, expected an edge of the map in metres",
        ),
        (
            "SURFACE_PROJECTION_PARMS",
            "OTHER_PARMS",
            "IMAGE_MAP_PROJECTION: found nothing, expected the map the image is on: this group, or SURFACE_PROJECTION_PARMS, or GEOTIFF of a VICAR label",
        ),
    ] {
        let changed = whole.replacen(from, to, 1);
        assert_ne!(changed, whole, "{from}");
        let error = read(&file(&changed, &Z)).unwrap_err();
        assert!(error.ends_with(expected), "{error}\n{expected}");
    }
    let error = read(&file(&whole.replace("NL=2", "NL=1"), &Z)).unwrap_err();
    let expected = "dem.vic:1:41: NL: found 1, expected a whole number above 1";
    assert_eq!(error, expected);
    let short = file(&whole, &Z[..5]);
    let expected = format!(
        "dem.vic: found 3 x 2 posts in {} bytes, expected as many as the file holds, and at most \
         2147483648",
        short.len()
    );
    assert_eq!(read(&short).unwrap_err(), expected);
    let eol = whole.replace("EOL=0", "EOL=1");
    let error = read(&file(&eol, &Z)).unwrap_err();
    let at = label(&eol).len() + 24;
    let expected = format!(
        "EOL: found no label at byte {at}, expected the label's second part, which EOL=1 announces"
    );
    assert!(error.ends_with(&expected), "{error}");
    let keys = GEOTIFF.replace("(30.0,30.0,0)", "(30.0,wide,0)");
    let error = read(&file(&format!("{REAL} {keys}"), &Z)).unwrap_err();
    assert_eq!(
        error,
        "dem.vic: GEOTIFF.MODELPIXELSCALETAG: found \"(30.0,wide,0)\", expected numbers"
    );
    let keys = GEOTIFF.replace("MODELTIEPOINTTAG", "TAG");
    let error = read(&file(&format!("{REAL} {keys}"), &Z)).unwrap_err();
    assert!(error.ends_with("found no georeferencing, expected ModelTiepoint and ModelPixelScale, or ModelTransformation"), "{error}");
}
