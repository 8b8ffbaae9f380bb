//! What is painted on the ground lies in the mosaic where it lies on the map.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use rockmap::frame::{Crs, Enu, Pixel, Planet, Point};
use rockmap::pipeline::{self, Config, Overrides, Silent};
use rockmap::publish::Picture;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

const SPOT_M: f64 = 0.12;

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
}

/// A mosaic as read back: its pixels, and easting and northing of the middle of one.
struct Read {
    columns: usize,
    rgba: Vec<u8>,
    scale_m: f64,
    west_m: f64,
    north_m: f64,
    /// The code of EPSG of its system.
    code: u16,
}

impl Read {
    fn of(path: &Path) -> Self {
        let mut decoder = Decoder::new(BufReader::new(fs::File::open(path).unwrap())).unwrap();
        let (columns, _) = decoder.dimensions().unwrap();
        let scale = decoder.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap();
        let tie = decoder.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap();
        let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap();
        let code = keys.chunks(4).find(|key| key[0] == 3072).unwrap()[3];
        let DecodingResult::U8(rgba) = decoder.read_image().unwrap() else {
            panic!("not bytes");
        };
        Self {
            columns: columns as usize,
            rgba,
            scale_m: scale[0],
            west_m: tie[3],
            north_m: tie[4],
            code,
        }
    }

    /// The middle of the red pixels within a metre of a place, and how many there are.
    fn middle_of_red(&self, (x, y): (f64, f64)) -> (f64, f64, u32) {
        let (mut sum, mut n) = ((0.0, 0.0), 0);
        for (i, pixel) in self.rgba.chunks_exact(4).enumerate() {
            let (column, row) = ((i % self.columns) as f64, (i / self.columns) as f64);
            let at = (
                self.west_m + (column + 0.5) * self.scale_m,
                self.north_m - (row + 0.5) * self.scale_m,
            );
            let is_near = (at.0 - x).hypot(at.1 - y) < 1.0;
            if is_near && pixel[3] > 0 && pixel[0] > 150 && pixel[1] < 90 {
                sum = (sum.0 + at.0, sum.1 + at.1);
                n += 1;
            }
        }
        (sum.0 / f64::from(n), sum.1 / f64::from(n), n)
    }
}

#[test]
fn spots_on_the_ground_lie_within_a_pixel_of_their_places() {
    let home = tempfile::tempdir().unwrap();
    let data = home.path().join("data");
    let fixture = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures/tiny");
    copy(&fixture, &data);
    copy(&fixture.join("images"), &data.join("images"));
    let config = |set: &[&str]| {
        let overrides = Overrides {
            out: Some(home.path().join("map")),
            set: set.iter().map(|&s| s.to_owned()).collect(),
            ..Overrides::default()
        };
        Config::read(&data.join("pipeline.toml"), &overrides).unwrap()
    };
    let inputs = pipeline::read(&config(&[]), &Silent).unwrap();
    let terrain = inputs.terrain.as_ref().unwrap();
    let spots: Vec<Point<Enu>> = [(7.0, 0.0), (8.5, -0.6), (9.5, 0.8)]
        .into_iter()
        .map(|(east, north)| terrain.ground_at(east, north).unwrap().point)
        .collect();
    for view in &inputs.views {
        let camera = view.camera.as_ref().unwrap();
        let enu_from_camera = view.enu_from_camera().unwrap();
        let colour = |column: u32, row: u32| {
            let ray = camera.ray(Pixel::new(f64::from(column), f64::from(row)));
            let hit = terrain.first_hit(enu_from_camera * ray.unwrap(), 100.0);
            let is_spot =
                hit.is_ok_and(|hit| spots.iter().any(|spot| spot.distance(hit.point) < SPOT_M));
            if is_spot {
                [230, 20, 20]
            } else {
                [120, 120, 120]
            }
        };
        let picture = Picture::from_fn(camera.width, camera.height, colour).unwrap();
        picture
            .write(&view.picture.as_ref().unwrap().path, 98)
            .unwrap();
    }
    let mut set = vec![
        "output.mosaic=true",
        "output.mosaic_m_per_px=0.02",
        "output.annotate=false",
        // The spots are painted as the poses are stated; they shall stay so.
        "fusion.pose_correction=\"off\"",
    ];
    // The site's own zone, and a neighbouring one that the run asks for, whose north is turned by degrees.
    for (code, crs) in [(32719, None), (32718, Some("output.crs=\"EPSG:32718\""))] {
        set.extend(crs);
        pipeline::run(&config(&set), true, &Silent).unwrap();
        let mosaic = Read::of(&home.path().join("map/mosaic.tif"));
        assert_eq!(mosaic.code, code);
        let map = Crs::new(&format!("EPSG:{code}"), Planet::EARTH).unwrap();
        for spot in &spots {
            let place = inputs.site.geodetic(*spot);
            let (x, y) = map.xy(place.lon, place.lat).unwrap();
            let (found_x, found_y, n) = mosaic.middle_of_red((x, y));
            assert!(n > 40, "{n} pixels of the spot at {:?}", spot.xyz);
            let off_m = (found_x - x).hypot(found_y - y);
            assert!(off_m < mosaic.scale_m, "{off_m} m at {:?}", spot.xyz);
        }
    }
}
