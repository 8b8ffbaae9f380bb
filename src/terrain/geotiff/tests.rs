//! Files written and read back, files by hand, and what is said about files that do not serve.

use std::fs::File;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, Gray32, Gray32Float, GrayI16, RGB8};
use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffValue};
use tiff::tags::Tag;

use super::*;
use crate::frame::{Geodetic, Planet, Site};
use crate::terrain::{Affine, HeightGrid, HeightsAbove, Posts, Terrain};

const UTM_KEYS: &[u16] = &[1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32632];
const SCALE: &[f64] = &[2.0, 2.0, 0.0];
const TIE: &[f64] = &[0.0, 0.0, 0.0, 456_000.0, 5_427_000.0, 0.0];

/// The tags of a file by hand.
#[derive(Clone)]
struct Tags {
    keys: Vec<u16>,
    doubles: Vec<(Tag, Vec<f64>)>,
    nodata: Option<&'static str>,
    metadata: Option<&'static str>,
}

fn tags(keys: &[u16], doubles: &[(Tag, &[f64])]) -> Tags {
    Tags {
        keys: keys.to_vec(),
        doubles: doubles
            .iter()
            .map(|&(tag, values)| (tag, values.to_vec()))
            .collect(),
        nodata: None,
        metadata: None,
    }
}

fn utm() -> Tags {
    tags(
        UTM_KEYS,
        &[
            (Tag::ModelPixelScaleTag, SCALE),
            (Tag::ModelTiepointTag, TIE),
        ],
    )
}

/// Three by two posts.
fn file<C: ColorType>(folder: &TempDir, tags: &Tags, samples: &[C::Inner]) -> PathBuf
where
    [C::Inner]: TiffValue,
{
    let path = folder.path().join("terrain.tif");
    let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
    let mut image = encoder.new_image::<C>(3, 2).unwrap();
    let directory = image.encoder();
    if !tags.keys.is_empty() {
        directory
            .write_tag(Tag::GeoKeyDirectoryTag, &tags.keys[..])
            .unwrap();
    }
    for (tag, values) in &tags.doubles {
        directory.write_tag(*tag, &values[..]).unwrap();
    }
    if let Some(nodata) = tags.nodata {
        directory.write_tag(Tag::GdalNodata, nodata).unwrap();
    }
    if let Some(metadata) = tags.metadata {
        directory.write_tag(Tag::Unknown(42112), metadata).unwrap();
    }
    image.write_data(samples).unwrap();
    path
}

fn floats(tags: &Tags) -> Result<HeightGrid, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = file::<Gray32Float>(&folder, tags, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.5]);
    read_geotiff(&path, "terrain.tif").map_err(|error| error.to_string())
}

fn grid(posts: Posts, map: Affine, crs: &str) -> HeightGrid {
    HeightGrid::new(3, 2, posts, map, crs).unwrap()
}

fn round_trip(grid: &HeightGrid, planet: Planet) -> HeightGrid {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("terrain.tif");
    write_geotiff(&path, grid, planet).unwrap();
    read_geotiff(&path, "terrain.tif").unwrap()
}

#[test]
fn what_is_written_is_read_back() {
    let single = Posts::F32(vec![1.5, f32::NAN, -3.25, 4.0, 1e-3, 6.0]);
    let double = Posts::F64(vec![1.0, 2.0, 3.0 + 1e-12, 4.0, f64::NAN, 6.0]);
    let map = Affine::north_up(456_054.25, 5_427_823.5, 0.1);
    let turned = Affine {
        x0: 8.4,
        x_column: 1e-5,
        x_row: 2e-6,
        y0: 49.0,
        y_column: 2e-6,
        y_row: -1e-5,
    };
    let same = |grid: HeightGrid, planet| assert_eq!(round_trip(&grid, planet), grid);
    same(grid(single.clone(), map, "EPSG:32632"), Planet::EARTH);
    same(grid(double.clone(), map, "EPSG:32632"), Planet::EARTH);
    same(grid(single.clone(), map, "IAU_2015:49910"), Planet::MARS);
    let lunar = Affine::north_up(12.0, -45.0, 1e-4);
    same(grid(double.clone(), lunar, "IAU_2015:30100"), Planet::MOON);
    let back = round_trip(&grid(double, turned, "EPSG:4326"), Planet::EARTH);
    assert_eq!(back.crs(), "EPSG:4326");
    for (column, row) in [(0.0, 0.0), (2.0, 1.0)] {
        let (a, b) = (
            back.crs_from_post().apply(column, row),
            turned.apply(column, row),
        );
        assert!((a.0 - b.0).abs() < 1e-13 && (a.1 - b.1).abs() < 1e-13);
    }
}

#[test]
fn a_crs_without_a_code_is_not_written() {
    let crs = "+proj=tmerc +lon_0=9 +type=crs";
    let grid = grid(
        Posts::F32(vec![0.0; 6]),
        Affine::north_up(0.0, 0.0, 1.0),
        crs,
    );
    let error = write_geotiff(Path::new("unwritten.tif"), &grid, Planet::EARTH).unwrap_err();
    assert_eq!(
        error.to_string(),
        "found the CRS \"+proj=tmerc +lon_0=9 +type=crs\", expected an authority's code such as \
         EPSG:32719 to write a GeoTIFF in"
    );
}

#[test]
fn posts_are_in_the_middle_of_pixels_or_at_their_corners() {
    let area = floats(&utm()).unwrap();
    assert_eq!(
        area.crs_from_post().apply(0.0, 0.0),
        (456_001.0, 5_426_999.0)
    );
    let mut keys = UTM_KEYS.to_vec();
    keys[3] = 3;
    keys.splice(8..8, [1025, 0, 1, 2]);
    let point = floats(&Tags { keys, ..utm() }).unwrap();
    assert_eq!(
        point.crs_from_post().apply(0.0, 0.0),
        (456_000.0, 5_427_000.0)
    );
    assert_eq!(
        point.crs_from_post().apply(2.0, 1.0),
        (456_004.0, 5_426_998.0)
    );
    let matrix = [
        2.0,
        0.5,
        0.0,
        456_000.0,
        0.5,
        -2.0,
        0.0,
        5_427_000.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    ];
    let turned = tags(UTM_KEYS, &[(Tag::ModelTransformationTag, &matrix)]);
    let turned = floats(&turned).unwrap();
    assert_eq!(
        turned.crs_from_post().apply(0.0, 0.0),
        (456_001.25, 5_426_999.25)
    );
    // A tie point in the middle of the raster.
    let tie = [1.5, 1.0, 0.0, 456_000.0, 5_427_000.0, 0.0];
    let middle = tags(
        UTM_KEYS,
        &[
            (Tag::ModelPixelScaleTag, SCALE),
            (Tag::ModelTiepointTag, &tie),
        ],
    );
    let middle = floats(&middle).unwrap();
    assert_eq!(
        middle.crs_from_post().apply(1.0, 0.5),
        (456_000.0, 5_427_000.0)
    );
}

#[test]
fn all_sample_types_are_heights() {
    let folder = tempfile::tempdir().unwrap();
    let mut tags = utm();
    tags.nodata = Some("7");
    let expected = Posts::F64(vec![1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0]);
    let check = |path: PathBuf| {
        let grid = read_geotiff(&path, "terrain.tif").unwrap();
        assert_eq!(*grid.posts(), expected);
    };
    check(file::<Gray8>(&folder, &tags, &[1, 2, 7, 4, 5, 6]));
    check(file::<Gray16>(&folder, &tags, &[1, 2, 7, 4, 5, 6]));
    check(file::<GrayI16>(&folder, &tags, &[1, 2, 7, 4, 5, 6]));
    check(file::<Gray32>(&folder, &tags, &[1, 2, 7, 4, 5, 6]));
    check(file::<Gray32Float>(
        &folder,
        &tags,
        &[1.0, 2.0, 7.0, 4.0, 5.0, 6.0],
    ));
    check(file::<Gray32Float>(
        &folder,
        &tags,
        &[1.0, 2.0, f32::NAN, 4.0, 5.0, 6.0],
    ));
    // GDAL writes the lowest single-precision number with more digits than it has.
    tags.nodata = Some("-3.4028234663852886e+38 ");
    check(file::<Gray32Float>(
        &folder,
        &tags,
        &[1.0, 2.0, f32::MIN, 4.0, 5.0, 6.0],
    ));
}

#[test]
fn feet_scale_and_offset_become_metres() {
    let mut keys = UTM_KEYS.to_vec();
    keys[3] = 3;
    keys.extend([4099, 0, 1, 9002]);
    let feet = floats(&Tags { keys, ..utm() }).unwrap();
    assert!((feet.height_m(2, 1) - 6.5 * 0.3048).abs() < 1e-12);
    let metadata = "<GDALMetadata>\n  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">100</Item>\n  \
                    <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item>\n</GDALMetadata>";
    let scaled = floats(&Tags {
        metadata: Some(metadata),
        ..utm()
    })
    .unwrap();
    assert_eq!(scaled.height_m(2, 1), 103.25);
}

#[test]
fn strips_and_compression_change_nothing() {
    let (width, height) = (64u32, 50u32);
    let heights: Vec<f32> = (0..64 * 50u16)
        .map(|i| f32::from(i * 17 % 997) * 0.125)
        .collect();
    let whole: Vec<u16> = (0..64 * 50u16).map(|i| i * 17 % 997).collect();
    let folder = tempfile::tempdir().unwrap();
    for compression in [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Deflate(DeflateLevel::Best),
        Compression::Packbits,
    ] {
        for big in [false, true] {
            let path = folder.path().join("terrain.tif");
            let file = File::create(&path).unwrap();
            macro_rules! write {
                ($encoder:expr, $kind:ty, $samples:expr) => {{
                    let mut encoder = $encoder.unwrap().with_compression(compression);
                    let mut image = encoder.new_image::<$kind>(width, height).unwrap();
                    image.rows_per_strip(7).unwrap();
                    let tags = image.encoder();
                    tags.write_tag(Tag::ModelPixelScaleTag, SCALE).unwrap();
                    tags.write_tag(Tag::ModelTiepointTag, TIE).unwrap();
                    tags.write_tag(Tag::GeoKeyDirectoryTag, UTM_KEYS).unwrap();
                    image.write_data($samples).unwrap();
                }};
            }
            if big {
                let encoder = TiffEncoder::new_big(file);
                write!(
                    encoder.map(|e| e.with_predictor(Predictor::Horizontal)),
                    Gray16,
                    &whole
                );
            } else {
                write!(TiffEncoder::new(file), Gray32Float, &heights);
            }
            let grid = read_geotiff(&path, "terrain.tif").unwrap();
            for (i, &expected) in heights.iter().enumerate() {
                let scale = if big { 0.125 } else { 1.0 };
                assert_eq!(grid.posts().get(i) * scale, f64::from(expected));
            }
        }
    }
}

/// Sets the value of an entry of the one directory of a little-endian classic file.
fn set_entry(file: &mut [u8], tag: u16, value: u32) {
    let start = u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize;
    let count = u16::from_le_bytes(file[start..start + 2].try_into().unwrap());
    let at = (0..usize::from(count))
        .map(|i| start + 2 + 12 * i)
        .find(|&at| file[at..at + 2] == tag.to_le_bytes())
        .unwrap();
    let is_short = file[at + 2] == 3;
    let value = value.to_le_bytes();
    let width = if is_short { 2 } else { 4 };
    file[at + 8..at + 8 + width].copy_from_slice(&value[..width]);
}

#[test]
fn zstandard_is_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let heights = [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.5];
    let mut bytes = std::fs::read(file::<Gray32Float>(&folder, &utm(), &heights)).unwrap();
    let raw: Vec<u8> = heights.into_iter().flat_map(f32::to_le_bytes).collect();
    let packed = zstd::encode_all(&raw[..], 3).unwrap();
    set_entry(&mut bytes, 259, 50000);
    let end = u32::try_from(bytes.len()).unwrap();
    set_entry(&mut bytes, 273, end);
    set_entry(&mut bytes, 279, u32::try_from(packed.len()).unwrap());
    bytes.extend(packed);
    let path = folder.path().join("zstd.tif");
    std::fs::write(&path, bytes).unwrap();
    let grid = read_geotiff(&path, "zstd.tif").unwrap();
    assert_eq!(grid.posts(), &Posts::F32(heights.to_vec()));
}

#[test]
fn a_vertical_crs_is_kept_with_the_heights() {
    let keys: Vec<u16> = [&[1, 1, 0, 3], &UTM_KEYS[4..], &[4096, 0, 1, 5773]].concat();
    let grid = floats(&Tags { keys, ..utm() }).unwrap();
    let datum = HeightsAbove::Datum("EPSG:5773".to_owned());
    assert_eq!(grid.heights_above(), &datum);
    assert_eq!(
        floats(&utm()).unwrap().heights_above(),
        &HeightsAbove::Unsaid
    );
}

#[test]
fn what_does_not_serve_is_told_exactly() {
    let scale = (Tag::ModelPixelScaleTag, SCALE);
    let tie = (Tag::ModelTiepointTag, TIE);
    let ties = [0.0; 24];
    let mut words = utm();
    words.nodata = Some("none");
    for (tags, expected) in [
        (
            tags(&[], &[scale, tie]),
            "GeoKeyDirectory: found none, expected the keys of a coordinate reference system",
        ),
        (
            tags(UTM_KEYS, &[]),
            "found no georeferencing, expected ModelTiepoint and ModelPixelScale, or \
             ModelTransformation",
        ),
        (
            tags(UTM_KEYS, &[(Tag::ModelTiepointTag, &ties)]),
            "ModelTiepoint: found 4 tie points without ModelPixelScale, expected one and \
             ModelPixelScale, or ModelTransformation",
        ),
        (
            tags(UTM_KEYS, &[(Tag::ModelPixelScaleTag, &[0.0; 3]), tie]),
            "found georeferencing that puts all posts on one line, expected one that spans an area",
        ),
        (words, "GDAL_NODATA: found \"none\", expected a number"),
    ] {
        assert_eq!(
            floats(&tags).unwrap_err(),
            format!("terrain.tif: {expected}")
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let said = |path: &Path| read_geotiff(path, "terrain.tif").unwrap_err().to_string();
    let bands = file::<RGB8>(&folder, &utm(), &[0; 18]);
    assert_eq!(
        said(&bands),
        "terrain.tif: SamplesPerPixel: found 3, expected 1, a band of heights"
    );
    // LERC, by its code in place of the code for none.
    let mut lerc = std::fs::read(file::<Gray32Float>(&folder, &utm(), &[0.0; 6])).unwrap();
    set_entry(&mut lerc, 259, 34887);
    let packed = folder.path().join("lerc.tif");
    std::fs::write(&packed, lerc).unwrap();
    assert_eq!(
        said(&packed),
        "terrain.tif: Compression: found method 34887 (LERC), expected 1 (none), 5 (LZW), 8 \
         (deflate), 32773 (PackBits) or 50000 (Zstandard)"
    );
    let unknown = file::<Gray32Float>(&folder, &utm(), &[f32::NAN; 6]);
    assert_eq!(
        said(&unknown),
        "terrain.tif: found no known height, expected some"
    );
    let whole = std::fs::read(file::<Gray32Float>(&folder, &utm(), &[0.0; 6])).unwrap();
    let cut = folder.path().join("cut.tif");
    std::fs::write(&cut, &whole[..20]).unwrap();
    assert_eq!(
        said(&cut),
        "terrain.tif: found a file that ends early, expected a whole TIFF file"
    );
    std::fs::write(&cut, "image_id,det_id\n").unwrap();
    assert_eq!(
        said(&cut),
        "terrain.tif: found no TIFF file, expected a GeoTIFF height model"
    );
    let missing = folder.path().join("none.tif");
    assert!(said(&missing).ends_with("none.tif: cannot read: no such file or folder"));
}

#[test]
fn faults_of_all_files_are_told_together() {
    let folder = tempfile::tempdir().unwrap();
    let words = folder.path().join("words.tif");
    std::fs::write(&words, "words").unwrap();
    let files = ["a.tif", "b.tif"].map(|shown| (words.clone(), shown.to_owned()));
    let site = Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0));
    assert_eq!(
        Terrain::open(site, &files, None, None)
            .unwrap_err()
            .to_string(),
        "a.tif: found no TIFF file, expected a GeoTIFF height model\n\
         b.tif: found no TIFF file, expected a GeoTIFF height model"
    );
}

#[test]
fn models_of_elsewhere_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = file::<Gray32Float>(&folder, &utm(), &[1.0; 6]);
    let files = [(path, "a.tif".to_owned())];
    let near = Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0));
    assert!(Terrain::open(near, &files, None, None).is_ok());
    let far = Site::new(Planet::EARTH, Geodetic::from_degrees(51.0, 8.4, 115.0));
    assert_eq!(
        Terrain::open(far, &files, None, None)
            .unwrap_err()
            .to_string(),
        "a.tif: found a model 223.1 km from the site's origin, expected one within 100 km"
    );
    let mars = Site::new(Planet::MARS, Geodetic::from_degrees(18.0, 77.0, 0.0));
    let error = Terrain::open(mars, &files, None, None)
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "a.tif: crs: found \"EPSG:32632\" (WGS 84 / UTM zone 32N, of 6378.1 km), expected one of mars, \
         of 3396.2 km"
    );
}
