//! Labels and records of rover pictures: where their pixels look, and maps made from them on Mars.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use rockmap::camera::{Camera, CameraFormat, read_camera_file};
use rockmap::frame::{
    Body, Enu, Geodetic, LocalEnu, Pixel, Planet, Point, RigidTransform, Rotation, Site,
};
use rockmap::pipeline::{self, Config, Overrides, Silent};
use rockmap::pose::Attitude;
use serde_json::Value;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A file of the real data, or one clear line that it is not there.
fn real(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("ROCKMAP_DATA")
        .map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let path = data.join("mars-rover").join(name);
    if !path.exists() {
        // Written past the test harness, which shows what passing tests print to nobody.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: mars-rover/{name} is not at hand (ROCKMAP_DATA)"
        );
        return None;
    }
    Some(path)
}

/// Azimuth and elevation, degrees, of a pixel's ray in the site frame of its label.
fn pointing(label: &Path, pixel: Pixel) -> [f64; 2] {
    let file = read_camera_file(label, "label").unwrap();
    let image = &file.images[0];
    let body_from_camera = image.camera.mount.body_from_camera(Default::default());
    let ray = body_from_camera * image.camera.ray(pixel).unwrap();
    let [east, north, up]: [f64; 3] = (image.pose.attitude.unwrap() * ray.direction).xyz().into();
    let azimuth = east.atan2(north).to_degrees().rem_euclid(360.0);
    [azimuth, up.asin().to_degrees()]
}

/// The label says the same of the middle of its picture: `SITE_DERIVED_GEOMETRY_PARMS`, azimuth
/// 141.721, elevation -39.482.
#[test]
fn a_curiosity_label_points_where_it_says() {
    let Some(label) = real("NRB_701383954RAS_F0933408NCAM00200M1.lbl") else {
        return;
    };
    let [azimuth, elevation] = pointing(&label, Pixel::new(511.5, 511.5));
    assert!((azimuth - 141.72).abs() < 0.01, "{azimuth}");
    assert!((elevation + 39.48).abs() < 0.01, "{elevation}");
    let file = read_camera_file(&label, "label").unwrap();
    assert_eq!(file.format, CameraFormat::OdlLabel);
    let image = &file.images[0];
    assert_eq!(image.image_id, "NRB_701383954RAS_F0933408NCAM00200M1");
    assert_eq!(image.time.unwrap().to_string(), "2022-03-24T09:42:32.18Z");
    assert_eq!((image.camera.width, image.camera.height), (1024, 1024));
    assert_eq!(image.pose.site, Some(93));
    // ORIGIN_OFFSET_VECTOR is north, east, down.
    let place = image.pose.place.unwrap();
    assert!(place.distance(Point::new(-156.017, 151.271, -22.3253)) < 1e-12);
    assert!(file.notes.is_empty(), "{:?}", file.notes);
}

/// The label's own site-frame pointing: azimuth 178.812, elevation -60.9945.
#[test]
fn an_insight_label_points_where_it_says() {
    let Some(label) = real("D001L0040_600081076EDR_F0002_0010M2.lbl.txt") else {
        return;
    };
    assert_eq!(
        read_camera_file(&label, "label").unwrap().format,
        CameraFormat::VicarLabel
    );
    let [azimuth, elevation] = pointing(&label, Pixel::new(511.5, 511.5));
    assert!((azimuth - 178.812).abs() < 0.001, "{azimuth}");
    assert!((elevation + 60.9945).abs() < 0.001, "{elevation}");
}

/// Rocks on level ground of Mars, and the platform's poses among them.
struct Ground {
    site: Site,
    height_m: f64,
}

impl Ground {
    fn new(lat_deg: f64, lon_deg: f64, origin_m: f64, height_m: f64) -> Self {
        let origin = Geodetic::from_degrees(lat_deg, lon_deg, origin_m);
        Self {
            site: Site::new(Planet::MARS, origin),
            height_m,
        }
    }

    /// The place on the ground below or above a point.
    fn at(&self, east: f64, north: f64) -> Point<Enu> {
        let mut place = self.site.geodetic(Point::new(east, north, 0.0));
        place.height_m = self.height_m;
        self.site.enu(place)
    }

    /// Up to 12 places 1 m or more apart that all of these cameras see well within their pictures.
    fn rocks(&self, views: &[(&Camera, RigidTransform<Enu, Body>)]) -> Vec<Point<Enu>> {
        let near = views[0].1.origin();
        let mut rocks: Vec<Point<Enu>> = Vec::new();
        for i in 0..160 {
            for j in 0..160 {
                let (east, north) = (0.37 * f64::from(i) - 29.6, 0.41 * f64::from(j) - 32.8);
                let rock = self.at(near.xyz.x + east, near.xyz.y + north);
                let seen = views.iter().all(|view| pixel(view, rock).is_some());
                let apart = rocks.iter().all(|other| other.distance(rock) > 1.0);
                if seen && apart && rocks.len() < 12 {
                    rocks.push(rock);
                }
            }
        }
        assert!(rocks.len() >= 4, "{} rocks", rocks.len());
        rocks
    }

    /// How far the farthest rock is from the nearest of the map, and the other way round, metres.
    fn off(&self, map: &Value, rocks: &[Point<Enu>]) -> f64 {
        let number = |v: &Value| v.as_f64().unwrap();
        let mapped: Vec<Point<Enu>> = map["features"]
            .as_array()
            .unwrap()
            .iter()
            .map(|feature| {
                let at = &feature["geometry"]["coordinates"];
                let place = Geodetic::from_degrees(number(&at[1]), number(&at[0]), self.height_m);
                self.site.enu(place)
            })
            .collect();
        assert_eq!(mapped.len(), rocks.len());
        let farthest = |from: &[Point<Enu>], to: &[Point<Enu>]| {
            let nearest = |p: &Point<Enu>| to.iter().map(|q| p.distance(*q)).fold(1e9, f64::min);
            from.iter().map(nearest).fold(0.0, f64::max)
        };
        farthest(&mapped, rocks).max(farthest(rocks, &mapped))
    }
}

/// Where a view shows a place, if well within its picture and not farther than 25 m.
fn pixel(
    (camera, pose): &(&Camera, RigidTransform<Enu, Body>),
    place: Point<Enu>,
) -> Option<Pixel> {
    let enu_from_camera = *pose * camera.mount.body_from_camera(Default::default());
    if enu_from_camera.origin().distance(place) > 25.0 {
        return None;
    }
    let pixel = camera.pixel(enu_from_camera.inverse() * place).ok()?;
    let inner = Pixel::new(pixel.u - 20.0, pixel.v - 20.0);
    (inner.u > 0.0 && inner.v > 0.0 && inner.is_inside(camera.width - 40, camera.height - 40))
        .then_some(pixel)
}

fn detections(views: &[(&Camera, RigidTransform<Enu, Body>)], rocks: &[Point<Enu>]) -> String {
    let mut text = "image_id,det_id,u_px,v_px\n".to_owned();
    for view in views {
        for (id, rock) in rocks.iter().enumerate() {
            let pixel = pixel(view, *rock).unwrap();
            writeln!(text, "{},{id},{},{}", view.0.name, pixel.u, pixel.v).unwrap();
        }
    }
    text
}

fn pipeline_file(ground: &Ground, cameras: &str) -> String {
    let origin = ground.site.origin();
    format!(
        "[site]\nbody = \"mars\"\norigin = {{ lat_deg = {:.12}, lon_deg = {:.12}, height_m = {} }}\n\
         [input]\nposes = \"poses.csv\"\nimages = \"images.csv\"\ncameras = {cameras}\n\
         detections = \"detections.csv\"\n\
         [terrain]\nplane_m = {:?}\n[fusion]\nmethod = \"em\"\nmin_weight = 0.5\n[output]\ndir = \"map\"\n",
        origin.lat_deg(),
        origin.lon_deg(),
        origin.height_m,
        ground.height_m
    )
}

/// Runs the pipeline of a folder and gives its map.
fn map_of(folder: &Path) -> Value {
    let config = Config::read(&folder.join("pipeline.toml"), &Overrides::default()).unwrap();
    let summary = pipeline::run(&config, false, &Silent).unwrap();
    assert!(summary.rejects.is_empty(), "{:?}", summary.rejects);
    let text = fs::read_to_string(folder.join("map/rocks.geojson")).unwrap();
    let map: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        map["crs"]["properties"]["name"],
        "urn:ogc:def:crs:IAU:2015:49900"
    );
    map
}

fn import(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rockmap"))
        .current_dir(folder)
        .arg("import")
        .args(arguments)
        .output()
        .unwrap()
}

/// Two pictures of a Mars 2020 feed become cameras.toml, images.csv and poses.csv, and the run on
/// them finds every rock where it is.
#[test]
fn imported_records_make_a_map() {
    let home = tempfile::tempdir().unwrap();
    let sample = root().join("tests/data/formats/feed.json");
    let feed = fs::read_to_string(sample).unwrap();
    let second = feed
        .replace("NLE_0002", "NLE_0003")
        .replace("(12.5,-3.25,0.75)", "(12.0,-4.5,0.75)");
    fs::write(home.path().join("a.json"), &feed).unwrap();
    fs::write(home.path().join("b.json"), &second).unwrap();
    let output = import(&["a.json", "b.json", "--to", "data"], home.path());
    assert!(output.status.success(), "{output:?}");
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "2 cameras, 2 pictures: cameras.toml, images.csv, poses.csv written to data\n"
    );
    let data = home.path().join("data");
    let poses = fs::read_to_string(data.join("poses.csv")).unwrap();
    let first = poses.lines().nth(1).unwrap();
    // Forward-left-up into east-north-up, of a heading of 73.7398 degrees.
    assert!(
        first.starts_with("NLE_0002_0667129493_453ECM_N0030000NCAM00101_00_4LLJ,-3.25,12.5,-0.75,")
    );
    let numbers: Vec<f64> = first
        .split(',')
        .skip(4)
        .map(|n| n.parse().unwrap())
        .collect();
    let half = (0.5 * (90.0 - 73.739_795_291_688_03_f64)).to_radians();
    let expected = [half.cos(), 0.0, 0.0, half.sin()];
    assert!(
        numbers
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{numbers:?}"
    );
    assert_eq!(
        fs::read_to_string(data.join("images.csv"))
            .unwrap()
            .lines()
            .nth(2),
        Some(
            "NLE_0003_0667129493_453ECM_N0030000NCAM00101_00_4LLJ,2021-02-20T01:57:50.123Z,\
             NLE_0003_0667129493_453ECM_N0030000NCAM00101_00_4LLJ"
        )
    );

    // The wheels stand 0.01 m above the ground that the run knows.
    let ground = Ground::new(18.44, 77.45, -2569.0, -2569.76);
    let files = [home.path().join("a.json"), home.path().join("b.json")];
    let images: Vec<_> = files
        .iter()
        .map(|f| read_camera_file(f, "feed").unwrap().images.remove(0))
        .collect();
    let views: Vec<_> = images
        .iter()
        .map(|i| {
            let place = i.pose.place.unwrap() - Point::origin();
            (
                &i.camera,
                RigidTransform::new(i.pose.attitude.unwrap(), place),
            )
        })
        .collect();
    let rocks = ground.rocks(&views);
    fs::write(data.join("detections.csv"), detections(&views, &rocks)).unwrap();
    fs::write(
        data.join("pipeline.toml"),
        pipeline_file(&ground, "\"cameras.toml\""),
    )
    .unwrap();
    let off = ground.off(&map_of(&data), &rocks);
    assert!(off < 1e-3, "{off}");

    // What stands in the folder is not replaced unasked, and pictures of two sites are not mixed.
    let again = import(&["a.json", "--to", "data"], home.path());
    assert_eq!(again.status.code(), Some(2));
    assert_eq!(
        String::from_utf8(again.stderr).unwrap(),
        "error: data/cameras.toml stands there already; --force replaces it\n"
    );
    let moved = second.replace("\"site\": 3", "\"site\": 4");
    fs::write(home.path().join("b.json"), moved).unwrap();
    let mixed = import(&["a.json", "b.json", "--to", "other"], home.path());
    assert_eq!(
        String::from_utf8(mixed.stderr).unwrap(),
        "error: b.json: site: found 4, expected 3, that of a.json, or a label that says where the one lies in the other\n"
    );
    assert!(!home.path().join("other").exists());
}

/// Where the records have no attitude, it is given; calibrations become cameras alone.
#[test]
fn what_import_is_told_and_what_it_writes() {
    let home = tempfile::tempdir().unwrap();
    let sample = root().join("tests/data/formats");
    let feed = fs::read_to_string(sample.join("feed.json")).unwrap();
    let bare = feed.replace("      \"attitude\": \"(0.8,0.0,0.0,0.6)\",\n", "");
    fs::write(home.path().join("a.json"), bare).unwrap();
    fs::write(home.path().join("a.png"), "a picture").unwrap();
    let output = import(
        &["a.json", "--to", "with", "-q", "--attitude", "0.8,0,0,0.6"],
        home.path(),
    );
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
    let poses = fs::read_to_string(home.path().join("with/poses.csv")).unwrap();
    assert!(
        poses.starts_with("image_id,x_m,y_m,z_m,qw,qx,qy,qz\n"),
        "{poses}"
    );
    let images = fs::read_to_string(home.path().join("with/images.csv")).unwrap();
    assert!(images.ends_with(",../a.png\n"), "{images}");
    let output = import(&["a.json", "--to", "without", "-q"], home.path());
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "note: a.json: NLE_0002_0667129493_453ECM_N0030000NCAM00101_00_4LLJ: no attitude is told\n"
    );
    let poses = fs::read_to_string(home.path().join("without/poses.csv")).unwrap();
    assert!(poses.starts_with("image_id,x_m,y_m,z_m\n"), "{poses}");
    let wrong = import(
        &["a.json", "--to", "wrong", "--attitude", "1,0,0,1"],
        home.path(),
    );
    assert_eq!(
        String::from_utf8(wrong.stderr).unwrap(),
        "error: --attitude: found [1.0, 0.0, 0.0, 1.0], expected the four numbers of a unit quaternion\n"
    );

    let chain = sample.join("kalibr.yaml");
    let output = import(&[chain.to_str().unwrap(), "--to", "chain"], home.path());
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "2 cameras, 0 pictures: cameras.toml written to chain\n"
    );
    let native = read_camera_file(&home.path().join("chain/cameras.toml"), "cameras.toml").unwrap();
    assert_eq!(native.format, CameraFormat::Native);
    assert_eq!(
        native.cameras,
        read_camera_file(&chain, "chain").unwrap().cameras
    );
}

/// Two Perseverance tiles, whose records have no attitude: the rover is put level over Jezero's
/// ground, and the run reads the JSON files as they are.
#[test]
fn perseverance_records_make_a_map() {
    let names = [
        "NLF_0670_0726421423_362ECM_N0320604NCAM08111_01_095J01-metadata.json",
        "NRF_0731_0731848568_991ECM_N0361610NCAM12731_04_195J01-metadata.json",
    ];
    let Some(files) = names
        .map(real)
        .into_iter()
        .collect::<Option<Vec<PathBuf>>>()
    else {
        return;
    };
    let ground = Ground::new(18.4447, 77.4508, -2569.0, -2570.5);
    for (file, yaw_deg) in files.iter().zip([-20.0f64, 75.0]) {
        let read = read_camera_file(file, "record").unwrap();
        assert_eq!(read.images.len(), 1);
        let camera = &read.images[0].camera;
        assert_eq!((camera.width, camera.height), (1288, 968));
        assert!(read.images[0].pose.place.is_some() && read.images[0].pose.attitude.is_none());
        let Attitude::Measured(level) =
            Attitude::from_roll_pitch_yaw(0.0, 0.0, yaw_deg.to_radians())
        else {
            panic!("measured");
        };
        let rotation = Rotation::<LocalEnu, Body>::from_unit_quaternion(level);
        let place = ground.at(3.0, -2.0);
        let here = ground.site.geodetic(place);
        let rotation = ground.site.enu_from_local(here) * rotation;
        let pose = RigidTransform::new(rotation, place - Point::origin());
        let views = [(camera, pose)];
        let rocks = ground.rocks(&views);
        let home = tempfile::tempdir().unwrap();
        let [qw, qx, qy, qz] = rotation.scalar_first();
        let [x, y, z]: [f64; 3] = place.xyz.into();
        let name = &camera.name;
        fs::write(
            home.path().join("poses.csv"),
            format!("image_id,x_m,y_m,z_m,qw,qx,qy,qz\n{name},{x},{y},{z},{qw},{qx},{qy},{qz}\n"),
        )
        .unwrap();
        fs::write(
            home.path().join("images.csv"),
            format!("image_id,camera\n{name},{name}\n"),
        )
        .unwrap();
        fs::write(
            home.path().join("detections.csv"),
            detections(&views, &rocks),
        )
        .unwrap();
        let cameras = format!("{:?}", file.canonicalize().unwrap());
        fs::write(
            home.path().join("pipeline.toml"),
            pipeline_file(&ground, &cameras),
        )
        .unwrap();
        let off = ground.off(&map_of(home.path()), &rocks);
        assert!(off < 1e-3, "{name}: {off}");
    }
}
