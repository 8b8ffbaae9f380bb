//! Every kind of bad input, and the exact words it gets.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// A small data set that is right: a camera straight down over level ground, three pictures.
const PIPELINE: &str = r#"
[site]
name = "test"
origin = { lat_deg = 10.0, lon_deg = 20.0, height_m = 0.0 }

[input]
poses = "poses.csv"
cameras = "cameras.toml"
detections = "detections.csv"

[terrain]
plane_m = 0.0

[output]
dir = "out"
"#;
const CAMERAS: &str = r"
[cameras.down]
model = 'pinhole'
width = 640
height = 480
fx = 500.0
fy = 500.0
cx = 319.5
cy = 239.5
";
const POSES: &str = "image_id,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg
a,0,0,10,0,-90,0
b,1,0,10,0,-90,0
c,2,0,10,0,-90,0
";
const DETECTIONS: &str = "image_id,det_id,score,x_min,y_min,x_max,y_max
a,0,0.9,310,230,330,250
b,0,0.9,310,180,330,200
c,0,0.9,310,130,330,150
";

/// A data set in a folder of its own.
struct Case {
    folder: TempDir,
}

impl Case {
    fn new() -> Self {
        let case = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        case.with("pipeline.toml", PIPELINE)
            .with("cameras.toml", CAMERAS)
            .with("poses.csv", POSES)
            .with("detections.csv", DETECTIONS)
    }

    fn with(self, name: &str, text: &str) -> Self {
        fs::write(self.folder.path().join(name), text).unwrap();
        self
    }

    fn rockmap(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_rockmap"))
            .current_dir(self.folder.path())
            .args(arguments)
            .output()
            .unwrap()
    }

    /// The lines of standard error of a quiet run, and its exit code.
    fn run(&self, more: &[&str]) -> (Vec<String>, i32) {
        let output = self.rockmap(&[&["run", "pipeline.toml", "--quiet"], more].concat());
        let errors = String::from_utf8(output.stderr).unwrap();
        let lines = errors.lines().map(str::to_owned).collect();
        (lines, output.status.code().unwrap())
    }

    /// What rejects.csv says, without its header.
    fn rejects(&self) -> Vec<String> {
        let table = fs::read_to_string(self.folder.path().join("out/rejects.csv")).unwrap();
        table.lines().skip(1).map(str::to_owned).collect()
    }
}

/// A run that must not start, and what it says.
fn refused(case: &Case, more: &[&str], expected: &[&str]) {
    let (lines, code) = case.run(more);
    assert_eq!(lines, expected);
    assert_eq!(code, 2);
    assert!(
        !case.folder.path().join("out").exists(),
        "nothing is written"
    );
}

/// A run that sets one record aside, and what rejects.csv says of it.
fn rejected(case: &Case, expected: &[&str]) {
    let (lines, code) = case.run(&["--set", "input.max_reject_share=1"]);
    assert_eq!((lines, code), (Vec::<String>::new(), 0));
    assert_eq!(case.rejects(), expected);
}

#[test]
fn what_is_right_runs_clean() {
    let case = Case::new();
    let (lines, code) = case.run(&[]);
    assert_eq!((lines, code), (Vec::<String>::new(), 0));
    assert!(case.rejects().is_empty());
}

#[test]
fn a_missing_pipeline_file() {
    let output = Case::new().rockmap(&["run", "nothing.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "error: nothing.toml: cannot read: no such file or folder\n"
    );
}

#[test]
fn missing_files_are_told_together() {
    let case = Case::new();
    for file in ["poses.csv", "detections.csv"] {
        fs::remove_file(case.folder.path().join(file)).unwrap();
    }
    refused(
        &case,
        &[],
        &[
            "error: poses.csv: cannot read: no such file or folder",
            "error: detections.csv: cannot read: no such file or folder",
        ],
    );
}

#[test]
fn a_missing_column() {
    let case = Case::new().with("detections.csv", "image,det_id,x_min,y_min,x_max,y_max\n");
    refused(
        &case,
        &[],
        &[
            "error: detections.csv:1: image_id: found columns image, det_id, x_min, y_min, x_max, \
           y_max, expected a column image_id (is image meant?)",
        ],
    );
}

#[test]
fn a_letter_in_a_number() {
    let case = Case::new().with("detections.csv", &DETECTIONS.replace("180", "18O"));
    rejected(
        &case,
        &["detections.csv,3,b/0,bad_value,\"y_min: found \"\"18O\"\", expected a number\""],
    );
}

#[test]
fn latitude_95() {
    let poses = "image_id,lat_deg,lon_deg,alt_m,roll_deg,pitch_deg,yaw_deg
a,10,20,10,0,-90,0
b,95,20,10,0,-90,0
c,10,20,10,0,-90,0
";
    let case = Case::new().with("poses.csv", poses);
    rejected(
        &case,
        &[
            "poses.csv,3,b,bad_value,\"lat_deg: found 95, expected -90 to 90\"",
            "detections.csv,3,b/0,image_rejected,\"image_id: image b was itself rejected, bad_value\"",
        ],
    );
}

#[test]
fn not_a_number() {
    let case = Case::new().with("poses.csv", &POSES.replace("c,2", "c,NaN"));
    rejected(
        &case,
        &[
            "poses.csv,4,c,bad_value,\"x_m: found NaN, expected a finite number\"",
            "detections.csv,4,c/0,image_rejected,\"image_id: image c was itself rejected, bad_value\"",
        ],
    );
}

#[test]
fn a_quaternion_of_zero_length() {
    let poses = "image_id,x_m,y_m,z_m,qw,qx,qy,qz
a,0,0,10,0.70710678,0,0.70710678,0
b,1,0,10,0,0,0,0
c,2,0,10,0.70710678,0,0.70710678,0
";
    let case = Case::new().with("poses.csv", poses);
    rejected(
        &case,
        &[
            "poses.csv,3,b,bad_value,\"qw: found a quaternion of zero length, expected a unit quaternion\"",
            "detections.csv,3,b/0,image_rejected,\"image_id: image b was itself rejected, bad_value\"",
        ],
    );
}

#[test]
fn an_image_without_a_pose() {
    let case = Case::new().with("images.csv", "image_id\na\nb\nc\nd\n");
    let (lines, code) = case.run(&["--set", "input.images=images.csv"]);
    assert_eq!((lines, code), (Vec::<String>::new(), 0));
    assert_eq!(
        case.rejects(),
        ["images.csv,5,d,no_pose,\"found no pose of this image, expected one\""]
    );
}

#[test]
fn images_outside_the_pose_log_and_in_its_gaps() {
    let poses = "time,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg
100,0,0,10,0,-90,0
100.5,1,0,10,0,-90,0
103.5,2,0,10,0,-90,0
";
    let images = "image_id,time\na,100.25\nb,102\nc,1970-01-01T00:01:43.75Z\n";
    let case = Case::new()
        .with("poses.csv", poses)
        .with("images.csv", images);
    let set = [
        "--set",
        "input.images=images.csv",
        "--set",
        "input.max_reject_share=1",
    ];
    assert_eq!(case.run(&set), (Vec::new(), 0));
    assert_eq!(
        case.rejects(),
        [
            "images.csv,3,b,pose_gap,\"its time lies in a gap of 3 s of the pose log, longer than max_gap_s = 1\"",
            "images.csv,4,c,no_pose,\"its time 1970-01-01T00:01:43.75Z lies outside the pose log, 1970-01-01T00:01:40Z to 1970-01-01T00:01:43.5Z\"",
            "detections.csv,3,b/0,image_rejected,\"image_id: image b was itself rejected, pose_gap\"",
            "detections.csv,4,c/0,image_rejected,\"image_id: image c was itself rejected, no_pose\"",
        ]
    );
}

#[test]
fn a_detection_of_an_unknown_image() {
    let case = Case::new().with("detections.csv", &DETECTIONS.replace("b,0", "z,0"));
    rejected(
        &case,
        &[
            "detections.csv,3,z/0,unknown_image,\"image_id: found \"\"z\"\", expected an image of the run\"",
        ],
    );
}

#[test]
fn boxes_outside_the_picture() {
    let boxes = "image_id,det_id,x_min,y_min,x_max,y_max
a,0,-40,230,-20,250
a,1,-15,230,5,250
";
    let case = Case::new().with("detections.csv", boxes);
    rejected(
        &case,
        &[
            "detections.csv,2,a/0,outside_picture,\"found a box -40 230 -20 250, expected some of it in the picture of 640x480\"",
        ],
    );
    // The one partly outside is used with its true centre: column -5, 6.49 m left of the middle.
    let set = [
        "project",
        "pipeline.toml",
        "-q",
        "--force",
        "--set",
        "input.max_reject_share=1",
    ];
    assert_eq!(case.rockmap(&set).status.code(), Some(0));
    let map = fs::read_to_string(case.folder.path().join("out/detections.geojson")).unwrap();
    let map: serde_json::Value = serde_json::from_str(&map).unwrap();
    let lon = map["features"][0]["geometry"]["coordinates"][0]
        .as_f64()
        .unwrap();
    let west_m = (20.0 - lon).to_radians() * 6_378_137.0 * 10f64.to_radians().cos();
    assert!((west_m - (319.5 + 5.0) / 50.0).abs() < 0.01, "{west_m}");
}

#[test]
fn an_unknown_key() {
    let text = PIPELINE.replace("plane_m = 0.0", "plane_m = 0.0\nheigth_sigma_m = 0.1");
    let case = Case::new().with("pipeline.toml", &text);
    refused(
        &case,
        &["--set", "view.max_rang_m=4", "--set", "wiev.aim=bottom"],
        &[
            "error: --set: view.max_rang_m: unknown key, is max_range_m meant?",
            "error: --set: wiev: unknown key, is view meant?",
            "error: pipeline.toml:13:1: terrain.heigth_sigma_m: unknown key, is height_sigma_m meant?",
        ],
    );
}

#[test]
fn confusion_that_does_not_add_up() {
    let text = PIPELINE.to_owned()
        + "\n[fusion.confusion]\nrock = { rock = 0.9, shadow = 0.2 }\nshadow = { rock = 1.5 }\n";
    let line = PIPELINE.lines().count() + 3;
    let sum = format!(
        "error: pipeline.toml:{line}:1: fusion.confusion.rock: found probabilities that add up to \
         1.100, expected 1, the sum over what the detector may say"
    );
    let range = format!(
        "error: pipeline.toml:{}:12: fusion.confusion.shadow.rock: found 1.5, expected 0 to 1",
        line + 1
    );
    let case = Case::new().with("pipeline.toml", &text);
    refused(&case, &[], &[&sum, &range]);
}

#[test]
fn norths_heights_and_bodies_that_do_not_serve() {
    let set = |assignments: &[&str], expected: &[&str]| {
        let arguments: Vec<&str> = assignments.iter().flat_map(|&a| ["--set", a]).collect();
        refused(&Case::new(), &arguments, expected);
    };
    set(
        &["site.north=\"grid\""],
        &[
            "error: --set: site.north: found \"grid\" without site.crs, expected site.crs, a map whose \
             north it is",
        ],
    );
    set(
        &["site.north=\"grid\"", "site.crs=\"EPSG:4326\""],
        &[
            "error: --set: site.north: found \"grid\" with EPSG:4326, which is no map, expected a \
             projected site.crs, such as EPSG:32719",
        ],
    );
    set(
        &["site.north=\"magnetic\""],
        &[
            "error: --set: site.north: found \"magnetic\" without a declination, expected \
             site.declination_deg, the azimuth of magnetic north",
        ],
    );
    set(
        &["site.declination_deg=3.5"],
        &[
            "error: --set: site.declination_deg: found a declination, and headings that are not \
             magnetic, expected site.north = \"magnetic\"",
        ],
    );
    set(
        &["site.height=\"EPSG:32632\""],
        &[
            "error: --set: site.height: found \"EPSG:32632\", expected a vertical coordinate reference \
             system known to PROJ, such as EPSG:5773, or a geoid grid in GTX or GeoTIFF format (not a vertical \
             one)",
        ],
    );
    set(
        &["site.body=\"mars\"", "site.height=\"EPSG:5773\""],
        &[
            "error: --set: site.height: found \"EPSG:5773\", expected one that PROJ can turn into \
             heights above the ellipsoid here",
        ],
    );
    set(
        &["site.body=\"IAU_2015:49910\""],
        &[
            "error: --set: site.body: found \"IAU_2015:49910\", expected earth, moon, mars, or the \
             code of a geographic CRS by the IAU, such as IAU_2015:49900",
        ],
    );
}

#[test]
fn methods_and_formats_that_are_not_there() {
    refused(
        &Case::new(),
        &[
            "--set",
            "output.formats=[\"geojson\", \"shapefile\", \"json\"]",
        ],
        &[
            "error: --set: output.formats: found \"shapefile\", expected geojson, gpkg, flatgeobuf, geoparquet, csv",
            "error: --set: output.formats: found \"json\" a second time, expected every format once",
        ],
    );
    refused(
        &Case::new(),
        &["--method", "papr"],
        &[
            "error: --set: fusion.method: found \"papr\", expected one of em, paper, belief (is paper meant?)",
        ],
    );
}

#[test]
fn a_terrain_model_of_another_place() {
    let text = PIPELINE.replace("plane_m = 0.0", "path = \"terrain.tif\"");
    let case = Case::new().with("pipeline.toml", &text);
    let path = case.folder.path().join("terrain.tif");
    let far = "error: terrain.tif: found a model";
    model_at(&path, 10.5, 20.0);
    let near = format!("{far} 55.2 km from the nearest view, expected one that covers the site");
    refused(&case, &[], &[&near]);
    model_at(&path, 12.0, 20.0);
    let off = format!("{far} 221.2 km from the site's origin, expected one within 100 km");
    refused(&case, &[], &[&off]);
    model_at(&path, 10.0, 20.0);
    assert_eq!(case.run(&[]), (Vec::new(), 0));
}

/// A level height model of some 100 m about a place.
fn model_at(path: &Path, lat_deg: f64, lon_deg: f64) {
    use rockmap::frame::Planet;
    use rockmap::terrain::{Affine, HeightGrid, Posts, write_geotiff};
    let step = 1e-4;
    let corner = Affine::north_up(lon_deg - 5.0 * step, lat_deg + 5.0 * step, step);
    let grid = HeightGrid::new(11, 11, Posts::F32(vec![0.0; 121]), corner, "EPSG:4326").unwrap();
    write_geotiff(path, &grid, Planet::EARTH).unwrap();
}

#[test]
fn no_ground_for_pixels() {
    let text = PIPELINE.replace("[terrain]\nplane_m = 0.0\n", "");
    refused(
        &Case::new().with("pipeline.toml", &text),
        &[],
        &[
            "error: detections.csv: found detections in pixels, expected a ground for them: \
           [terrain] plane_m or path",
        ],
    );
}

#[test]
fn an_empty_night_gives_an_empty_map() {
    let case = Case::new().with(
        "detections.csv",
        "image_id,det_id,x_min,y_min,x_max,y_max\n",
    );
    assert_eq!(case.run(&[]), (Vec::new(), 0));
    let rocks = fs::read_to_string(case.folder.path().join("out/rocks.geojson")).unwrap();
    let rocks: serde_json::Value = serde_json::from_str(&rocks).unwrap();
    assert_eq!(rocks["features"], serde_json::json!([]));
    let evidence = fs::read_to_string(case.folder.path().join("out/evidence.csv")).unwrap();
    assert_eq!(
        evidence,
        "rock_id,image_id,det_id,weight,residual_px,residual_m\n"
    );
}

#[test]
fn too_many_rejects_show_in_the_exit_code() {
    let case = Case::new().with("detections.csv", &DETECTIONS.replace("b,0", "z,0"));
    let (lines, code) = case.run(&[]);
    assert_eq!(
        lines,
        ["error: more records were faulty than input.max_reject_share allows"]
    );
    assert_eq!(code, 1);
    assert_eq!(case.rejects().len(), 1, "the map is written all the same");
}

#[test]
fn check_lists_everything_and_writes_nothing() {
    let case = Case::new().with("detections.csv", &DETECTIONS.replace("180", "18O"));
    let output = case.rockmap(&[
        "check",
        "pipeline.toml",
        "-q",
        "--set",
        "input.max_reject_share=1",
    ]);
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "rejected: detections.csv:3: y_min: found \"18O\", expected a number\n"
    );
    assert_eq!(output.status.code(), Some(0));
    assert!(!case.folder.path().join("out").exists());
}

#[test]
fn another_runs_outputs_are_not_replaced_unasked() {
    let case = Case::new();
    assert_eq!(case.run(&[]).1, 0);
    assert_eq!(case.run(&[]).1, 0, "the same run may be made again");
    let (lines, code) = case.run(&["--method", "em"]);
    assert_eq!(code, 2);
    assert!(
        lines[0].ends_with("expected an empty folder, or --force to replace them"),
        "{lines:?}"
    );
    assert_eq!(case.run(&["--method", "em", "--force"]).1, 0);
}

#[test]
fn a_picture_of_the_wrong_size_and_one_that_is_missing() {
    use rockmap::publish::Picture;
    let case = Case::new();
    let small = Picture::of_colour(320, 240, [90, 80, 70]).unwrap();
    small.write(&case.folder.path().join("a.png"), 90).unwrap();
    let poses = "image_id,path,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg
a,a.png,0,0,10,0,-90,0
b,b.png,1,0,10,0,-90,0
c,,2,0,10,0,-90,0
";
    let case = case.with("poses.csv", poses);
    let (lines, code) = case.run(&["--set", "input.max_reject_share=1"]);
    assert_eq!(
        lines,
        ["warning: image b: b.png: cannot read: no such file or folder"]
    );
    assert_eq!(code, 0);
    assert_eq!(
        case.rejects(),
        [
            "poses.csv,2,a,picture_size,\"found a picture of 320x240, expected 640x480 as camera down has\"",
            "detections.csv,2,a/0,image_rejected,\"image_id: image a was itself rejected, picture_size\"",
        ]
    );
}

#[test]
fn a_second_pose_of_an_image_and_a_pose_off_the_site() {
    let poses = POSES.to_owned() + "a,5,0,10,0,-90,0\n";
    let case = Case::new().with("poses.csv", &poses.replace("c,2,", "c,200000,"));
    let expected = [
        "poses.csv,4,c,off_site,\"found a pose 200.0 km from the site's origin, expected at most 100 km\"",
        "poses.csv,5,a,duplicate,\"found this image_id a second time, expected it once\"",
        "detections.csv,4,c/0,image_rejected,\"image_id: image c was itself rejected, off_site\"",
    ];
    rejected(&case, &expected);
    // The same where an image list says which images there are: but for the image without a pose.
    let case = case.with("images.csv", "image_id\na\nb\n");
    let set = [
        "--force",
        "--set",
        "input.images=images.csv",
        "--set",
        "input.max_reject_share=1",
    ];
    assert_eq!(case.run(&set), (Vec::new(), 0));
    assert_eq!(case.rejects(), expected);
}
