//! One scene in native files and in those of others: the maps are the same.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;

use rockmap::frame::{Ellipsoid, Geodetic};
use rockmap::pipeline::{self, Config, Overrides, Silent};
use serde_json::Value;

const PIPELINE: &str = "[site]\norigin = { lat_deg = 10.0, lon_deg = 20.0, height_m = 0.0 }\n\
    [terrain]\nplane_m = 0.0\n[fusion]\nmin_weight = 0.5\n[output]\ndir = \"map\"\nannotate = false\n\
    [input]\n";

/// A camera 10 m above the ground that looks straight down, the top of its picture to the north.
const CAMERAS: &str = "[cameras.1]\nmodel = \"brown_conrady\"\nwidth = 640\nheight = 480\nfx = 500.0\n\
    fy = 510.0\ncx = 319.5\ncy = 239.25\ndistortion = [-0.1, 0.02, 0.001, -0.0005]\n";
const POSES: &str = "image_id,camera,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg\n\
    a,1,0,0,10,0,-90,0\nb,1,1,0,10,0,-90,0\n";
const DETECTIONS: &str = "image_id,det_id,class,score,x_min,y_min,x_max,y_max\n\
    a,0,rock,0.9,309.5,229.5,329.5,249.5\na,1,rock,0.8,99.5,49.5,119.5,59.5\n\
    b,0,rock,0.9,259.5,229.5,279.5,249.5\n";

/// The rocks of a run over these files: latitude, longitude and class, in the order of the map.
fn rocks(files: &[(&str, &str)], input: &str) -> (Vec<(Geodetic, String)>, Vec<String>) {
    let home = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(home.path().join(name), text).unwrap();
    }
    let text = format!("{PIPELINE}{input}");
    fs::write(home.path().join("pipeline.toml"), text).unwrap();
    let path = home.path().join("pipeline.toml");
    let config = Config::read(Path::new(&path), &Overrides::default()).unwrap();
    let summary = pipeline::run(&config, false, &Silent).unwrap();
    assert!(summary.rejects.is_empty(), "{:?}", summary.rejects);
    let map = fs::read_to_string(home.path().join("map/rocks.geojson")).unwrap();
    let map: Value = serde_json::from_str(&map).unwrap();
    let rock = |feature: &Value| {
        let at = &feature["geometry"]["coordinates"];
        let place = Geodetic::from_degrees(at[1].as_f64().unwrap(), at[0].as_f64().unwrap(), 0.0);
        (
            place,
            feature["properties"]["class"].as_str().unwrap().to_owned(),
        )
    };
    let rocks = map["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(rock)
        .collect();
    (rocks, summary.warnings)
}

#[test]
fn the_same_scene_in_other_files_is_the_same_map() {
    let native = [
        ("cameras.toml", CAMERAS),
        ("poses.csv", POSES),
        ("detections.csv", DETECTIONS),
    ];
    let (expected, warnings) = rocks(
        &native,
        "cameras = \"cameras.toml\"\nposes = \"poses.csv\"\ndetections = \"detections.csv\"\n",
    );
    assert_eq!((expected.len(), warnings.len()), (2, 0));

    // COLMAP counts from the corner. Its camera axes in the world: right is east, down is south,
    // forward is down: half a turn about east, and the translation is that of the world's origin.
    let cameras = "1 OPENCV 640 480 500 510 320 239.75 -0.1 0.02 0.001 -0.0005\n";
    let images = "1 0 1 0 0 0 0 10 1 a.png\n\n2 0 1 0 0 -1 0 10 1 b.png\n\n";
    let coco = r#"{"images": [{"id": 1, "file_name": "a.png"}, {"id": 2, "file_name": "b.png"}],
        "categories": [{"id": 5, "name": "rock"}],
        "annotations": [
        {"id": 0, "image_id": 1, "category_id": 5, "bbox": [310, 230, 20, 20], "score": 0.9},
        {"id": 1, "image_id": 1, "category_id": 5, "bbox": [100, 50, 20, 10], "score": 0.8},
        {"id": 2, "image_id": 2, "category_id": 5, "bbox": [260, 230, 20, 20], "score": 0.9}]}"#;
    let voc = |name: &str, boxes: &[[u32; 4]]| {
        let object = |[x0, y0, x1, y1]: &[u32; 4]| {
            format!(
                "<object><name>rock</name><bndbox><xmin>{x0}</xmin><ymin>{y0}</ymin>\
                 <xmax>{x1}</xmax><ymax>{y1}</ymax></bndbox></object>"
            )
        };
        let objects: String = boxes.iter().map(object).collect();
        format!("<annotation><filename>{name}</filename>{objects}</annotation>")
    };
    let voc_a = voc("a.png", &[[311, 231, 330, 250], [101, 51, 120, 60]]);
    let voc_b = voc("b.png", &[[261, 231, 280, 250]]);
    let files = [
        ("cameras.txt", cameras),
        ("images.txt", images),
        ("coco.json", coco),
        ("a.xml", &voc_a),
        ("b.xml", &voc_b),
    ];
    for detections in ["\"coco.json\"", "[\"a.xml\", \"b.xml\"]"] {
        let input = format!(
            "cameras = \"cameras.txt\"\nposes = \"images.txt\"\ndetections = {detections}\n"
        );
        let (found, warnings) = rocks(&files, &input);
        assert_eq!(found.len(), expected.len());
        for ((a, class), (b, other)) in found.iter().zip(&expected) {
            let ecef = |place: &Geodetic| Ellipsoid::WGS84.to_ecef(*place);
            let off = ecef(a).distance(ecef(b));
            assert!(off < 1e-3, "{detections}: {off}");
            assert_eq!(class, other);
        }
        assert_eq!(
            warnings[0],
            "cameras.txt: the file says nothing of the mount: the camera looks forward from the body's origin"
        );
    }

    // A log of the TUM kind, whose scalar is last, beside a list of images.
    let log = "# timestamp tx ty tz qx qy qz qw\n\
        100 0 0 10 -0.5 0.5 0.5 0.5\n101 1 0 10 -0.5 0.5 0.5 0.5\n";
    let images = "image_id,time,camera\na,100,1\nb,101,1\n";
    let mut files = native.to_vec();
    files.extend([("log.txt", log), ("images.csv", images)]);
    let (found, _) = rocks(
        &files,
        "cameras = \"cameras.toml\"\nposes = \"log.txt\"\nimages = \"images.csv\"\n\
         detections = \"detections.csv\"\n",
    );
    for ((a, _), (b, _)) in found.iter().zip(&expected) {
        assert!(
            Ellipsoid::WGS84
                .to_ecef(*a)
                .distance(Ellipsoid::WGS84.to_ecef(*b))
                < 1e-3
        );
    }
}
