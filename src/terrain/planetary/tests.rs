//! Labels by hand, read whole, and what is said about those that do not serve.

mod vicar;

use std::path::Path;

use crate::frame::{Crs, Planet};
use crate::terrain::{HeightGrid, read_heights};

/// Three columns and two rows, the fifth unknown.
const SAMPLES: [i16; 6] = [100, 200, 300, -400, -32768, 600];

const PDS3: &str = "PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = 6\r\n\
    ^IMAGE = (\"DEM.IMG\", 2)\r\n/* a comment */\r\nOBJECT = IMAGE\r\nLINES = 2\r\n\
    LINE_SAMPLES = 3\r\nSAMPLE_TYPE = LSB_INTEGER\r\nSAMPLE_BITS = 16\r\nUNIT = METER\r\n\
    SCALING_FACTOR = 0.5\r\nOFFSET = 1737400. <METER>\r\nMISSING_CONSTANT = -32768\r\n\
    END_OBJECT = IMAGE\r\nOBJECT = IMAGE_MAP_PROJECTION\r\n\
    MAP_PROJECTION_TYPE = \"POLAR STEREOGRAPHIC\"\r\nA_AXIS_RADIUS = 1737.4 <KM>\r\n\
    B_AXIS_RADIUS = 1737.4 <KM>\r\nC_AXIS_RADIUS = 1737.4 <KM>\r\n\
    POSITIVE_LONGITUDE_DIRECTION = \"EAST\"\r\nCENTER_LATITUDE = -90. <DEG>\r\n\
    CENTER_LONGITUDE = 0. <DEG>\r\nMAP_SCALE = 10. <METERS/PIXEL>\r\n\
    MAP_RESOLUTION = 3032.34 <PIXEL/DEGREE>\r\nDESCRIPTION = \"LINE_PROJECTION_OFFSET = 7 of\r\n\
    another\"\r\nLINE_PROJECTION_OFFSET = 1.5\r\nSAMPLE_PROJECTION_OFFSET = 100.5\r\n\
    END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n";

const PDS4: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Product_Observational xmlns="http://pds.nasa.gov/pds4/pds/v1" xmlns:cart="http://pds.nasa.gov/pds4/cart/v1">
 <Observation_Area><Discipline_Area><cart:Cartography>
  <cart:Spatial_Reference_Information><cart:Horizontal_Coordinate_System_Definition>
   <cart:Planar>
    <cart:Map_Projection>
     <cart:map_projection_name>Equirectangular</cart:map_projection_name>
     <cart:Equirectangular>
      <cart:standard_parallel_1 unit="deg">10</cart:standard_parallel_1>
      <cart:longitude_of_central_meridian unit="deg">137</cart:longitude_of_central_meridian>
      <cart:latitude_of_projection_origin unit="deg">0</cart:latitude_of_projection_origin>
     </cart:Equirectangular>
    </cart:Map_Projection>
    <cart:Planar_Coordinate_Information><cart:Coordinate_Representation>
     <cart:pixel_resolution_x unit="m/pixel">20</cart:pixel_resolution_x>
     <cart:pixel_resolution_y unit="m/pixel">20</cart:pixel_resolution_y>
    </cart:Coordinate_Representation></cart:Planar_Coordinate_Information>
    <cart:Geo_Transformation>
     <cart:upperleft_corner_x unit="m">1000</cart:upperleft_corner_x>
     <cart:upperleft_corner_y unit="m">-270000</cart:upperleft_corner_y>
    </cart:Geo_Transformation>
   </cart:Planar>
   <cart:Geodetic_Model>
    <cart:latitude_type>Planetocentric</cart:latitude_type>
    <cart:a_axis_radius unit="km">3396.19</cart:a_axis_radius>
    <cart:b_axis_radius unit="km">3396.19</cart:b_axis_radius>
    <cart:c_axis_radius unit="km">3396.19</cart:c_axis_radius>
    <cart:longitude_direction>Positive East</cart:longitude_direction>
   </cart:Geodetic_Model>
  </cart:Horizontal_Coordinate_System_Definition></cart:Spatial_Reference_Information>
 </cart:Cartography></Discipline_Area></Observation_Area>
 <File_Area_Observational>
  <File><file_name>dem.img</file_name></File>
  <Array_2D_Image>
   <offset unit="byte">6</offset>
   <axes>2</axes>
   <axis_index_order>Last Index Fastest</axis_index_order>
   <Element_Array><data_type>SignedMSB2</data_type><unit>m</unit>
    <scaling_factor>0.1</scaling_factor><value_offset>-4500</value_offset></Element_Array>
   <Axis_Array><axis_name>Line</axis_name><elements>2</elements><sequence_number>1</sequence_number></Axis_Array>
   <Axis_Array><axis_name>Sample</axis_name><elements>3</elements><sequence_number>2</sequence_number></Axis_Array>
   <Special_Constants><missing_constant>-32768</missing_constant><valid_minimum>600</valid_minimum></Special_Constants>
  </Array_2D_Image>
 </File_Area_Observational>
</Product_Observational>
"#;

fn image(encode: fn(i16) -> [u8; 2]) -> Vec<u8> {
    let mut bytes = vec![7u8; 6];
    bytes.extend(SAMPLES.into_iter().flat_map(encode));
    bytes
}

/// The label in a file of that name, its image beside it.
fn read(name: &str, label: &str, image: &[u8]) -> Result<HeightGrid, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), label).unwrap();
    std::fs::write(folder.path().join("dem.img"), image).unwrap();
    let path = folder.path().join(name);
    read_heights(&path, name).map_err(|error| {
        error
            .to_string()
            .replace(&folder.path().display().to_string(), "here")
    })
}

fn pds3(label: &str) -> Result<HeightGrid, String> {
    read("dem.lbl", label, &image(i16::to_le_bytes))
}

fn pds4(label: &str) -> Result<HeightGrid, String> {
    read("dem.xml", label, &image(i16::to_be_bytes))
}

#[test]
fn pds3_radii_become_heights_on_their_polar_map() {
    let grid = pds3(PDS3).unwrap();
    let heights: Vec<f64> = (0..6).map(|i| grid.height_m(i % 3, i / 3)).collect();
    assert_eq!(heights[..4], [50.0, 100.0, 150.0, -200.0]);
    assert!(heights[4].is_nan() && heights[5] == 300.0);
    // The first post lies 100.5 steps left of the pole and 1.5 above it.
    assert_eq!(grid.crs_from_post().apply(0.0, 0.0), (-1005.0, 15.0));
    assert_eq!(grid.crs_from_post().apply(2.0, 1.0), (-985.0, 5.0));
    let own = Crs::new(grid.crs(), Planet::MOON).unwrap();
    let iau = Crs::new("IAU_2015:30135", Planet::MOON).unwrap();
    let (a, b) = (own.xy(1.0, -1.55).unwrap(), iau.xy(1.0, -1.55).unwrap());
    assert!((a.0 - b.0).hypot(a.1 - b.1) < 1e-6, "{a:?} {b:?}");
}

#[test]
fn pds3_labels_stand_before_their_image_too_and_cylinders_count_in_degrees() {
    let label = PDS3
        .replace("(\"DEM.IMG\", 2)", "2048 <BYTES>")
        .replace("POLAR STEREOGRAPHIC", "SIMPLE CYLINDRICAL")
        .replace(
            "MAP_SCALE = 10. <METERS/PIXEL>",
            "MAP_SCALE = 0.463 <KM/PIXEL>",
        )
        .replace("3032.34", "64")
        .replace("CENTER_LATITUDE = -90.", "CENTER_LATITUDE = 0.")
        .replace("OFFSET = 1737400. <METER>", "OFFSET = 0");
    let mut bytes = label.into_bytes();
    bytes.resize(2047, b' ');
    bytes.extend(SAMPLES.into_iter().flat_map(i16::to_le_bytes));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.img");
    std::fs::write(&path, bytes).unwrap();
    let grid = read_heights(&path, "whole.img").unwrap();
    assert_eq!(grid.height_m(2, 0), 150.0);
    let step = 1_737_400f64.to_radians() / 64.0;
    let (x, y) = grid.crs_from_post().apply(0.0, 0.0);
    assert!((x + 100.5 * step).abs() < 1e-6 && (y - 1.5 * step).abs() < 1e-6);
}

#[test]
fn pds4_is_read_on_its_map() {
    let grid = pds4(PDS4).unwrap();
    let heights: Vec<f64> = (0..6).map(|i| grid.height_m(i % 3, i / 3)).collect();
    assert_eq!(heights[..4], [-4490.0, -4480.0, -4470.0, -4540.0]);
    assert!(heights[4].is_nan() && heights[5] == -4440.0);
    assert_eq!(grid.crs_from_post().apply(0.0, 0.0), (1010.0, -270_010.0));
    let crs = Crs::new(grid.crs(), Planet::MARS).unwrap();
    let (lon, lat) = crs.lon_lat(1010.0, -270_010.0).unwrap();
    let radius = 3_396_190.0;
    assert!((lat + 270_010.0 / radius).abs() < 1e-12);
    let lon_expected = 137f64.to_radians() + 1010.0 / (radius * 10f64.to_radians().cos());
    assert!((lon - lon_expected).abs() < 1e-12);
}

#[test]
fn what_does_not_serve_is_told_exactly() {
    for (from, to, expected) in [
        (
            "^IMAGE = (\"DEM.IMG\", 2)\r\n",
            "",
            "^IMAGE: found nothing, expected where the image is",
        ),
        (
            "(\"DEM.IMG\", 2)",
            "(\"DEM.IMG\", 0)",
            "4:1: ^IMAGE: found DEM.IMG, 0, expected where the image is",
        ),
        (
            "LINES = 2",
            "LINES = two",
            "7:1: LINES: found \"two\", expected a number",
        ),
        (
            "LINES = 2",
            "LINES = 900",
            "found 3 x 900 posts in 18 bytes, expected as many as the file holds, and at most 2147483648",
        ),
        (
            "LSB_INTEGER",
            "VAX_REAL",
            "9:1: SAMPLE_TYPE: found VAX_REAL, expected a type such as MSB_INTEGER, LSB_INTEGER, IEEE_REAL or PC_REAL",
        ),
        (
            "SAMPLE_BITS = 16",
            "SAMPLE_BITS = 12",
            "10:1: SAMPLE_BITS: found 12, expected 8, 16 or 32, and 32 or 64 of real numbers",
        ),
        (
            "UNIT = METER",
            "UNIT = KELVIN",
            "11:1: UNIT: found KELVIN, expected METER or KILOMETER",
        ),
        (
            "LINES = 2",
            "LINES = 2\r\nBANDS = 3",
            "8:1: BANDS: found 3, expected 1, a band of heights",
        ),
        (
            "LINES = 2",
            "LINES = 2\r\nENCODING_TYPE = \"JP2\"",
            "8:1: ENCODING_TYPE: found JP2, expected plain samples",
        ),
        (
            "POLAR STEREOGRAPHIC",
            "MERCATOR",
            "17:1: MAP_PROJECTION_TYPE: found \"MERCATOR\", expected EQUIRECTANGULAR, SIMPLE CYLINDRICAL, SINUSOIDAL or POLAR STEREOGRAPHIC",
        ),
        (
            "CENTER_LATITUDE = -90.",
            "CENTER_LATITUDE = -80.",
            "22:1: CENTER_LATITUDE: found -80, expected 90 or -90, a pole",
        ),
        (
            "SAMPLE_PROJECTION_OFFSET = 100.5",
            "",
            "16:1: SAMPLE_PROJECTION_OFFSET: found nothing, expected a number",
        ),
        (
            "A_AXIS_RADIUS = 1737.4 <KM>",
            "",
            "16:1: A_AXIS_RADIUS: found nothing, expected the body's radius",
        ),
    ] {
        let error = pds3(&PDS3.replacen(from, to, 1)).unwrap_err();
        let is_placed = expected.starts_with(|c: char| c.is_ascii_digit());
        let start = if is_placed { "dem.lbl:" } else { "dem.lbl: " };
        assert_eq!(error, format!("{start}{expected}"));
    }
    for (from, to, expected) in [
        (
            "</Product_Observational>",
            "",
            "not XML: the root node was opened but never closed",
        ),
        (
            "cart:Cartography",
            "cart:Nothing",
            "Cartography: found nothing, expected the map the image is on",
        ),
        (
            ">Equirectangular<",
            ">Lambert Conformal Conic<",
            "map_projection_name: found \"Lambert Conformal Conic\", expected Equirectangular, Sinusoidal or Polar Stereographic",
        ),
        (
            "SignedMSB2",
            "ComplexLSB8",
            "data_type: found ComplexLSB8, expected a type such as SignedLSB2 or IEEE754LSBSingle",
        ),
        (
            "<unit>m</unit>",
            "<unit>K</unit>",
            "unit: found K, expected m or km",
        ),
        (
            "unit=\"km\">3396.19</cart:a",
            "unit=\"km\">wide</cart:a",
            "a_axis_radius: found \"wide\", expected a number",
        ),
        (
            "<elements>3",
            "<elements>300",
            "found 300 x 2 posts in 18 bytes, expected as many as the file holds, and at most 2147483648",
        ),
        (
            "Last Index",
            "First Index",
            "axis_index_order: found First Index Fastest, expected Last Index Fastest",
        ),
        (
            "upperleft_corner_x",
            "corner_x",
            "upperleft_corner_x: found nothing, expected a length",
        ),
    ] {
        let error = pds4(&PDS4.replace(from, to)).unwrap_err();
        assert_eq!(error, format!("dem.xml: {expected}"));
    }
    let gone = pds4(&PDS4.replace("dem.img", "gone.img")).unwrap_err();
    let expected = Path::new("here").join("gone.img").display().to_string();
    assert!(
        gone.starts_with(&format!("{expected}: cannot read: ")),
        "{gone}"
    );
}
