use std::path::PathBuf;

use super::*;
use crate::camera::Lens;
use crate::frame::{Body, Pixel, Point, Vector};

/// The text of a small file of the format, kept with the tests.
fn sample(name: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn read(name: &str, text: &str) -> Result<CameraFile, Error> {
    cameras_from_bytes(text.as_bytes(), Path::new(name), name)
}

/// The faults of a sample in which one text stands for another.
fn faults(name: &str, from: &str, to: &str) -> Vec<String> {
    let text = sample(name);
    assert!(text.contains(from), "{from} in {name}");
    let error = read(name, &text.replacen(from, to, 1)).unwrap_err();
    error.to_string().lines().map(str::to_owned).collect()
}

/// Where the camera sees the point (0.31, -0.22, 1) of its own axes.
fn seen(camera: &Camera) -> Pixel {
    camera.pixel(Point::new(0.31, -0.22, 1.0)).unwrap()
}

fn near(pixel: Pixel, u: f64, v: f64) -> bool {
    pixel.distance(Pixel::new(u, v)) < 1e-6
}

/// Pixels by `cv2.projectPoints` of opencv-python 5.0.
#[test]
fn ros_files_see_as_opencv_does() {
    let file = read("left.yaml", &sample("ros.yaml")).unwrap();
    assert_eq!(file.format, CameraFormat::Ros);
    let camera = &file.cameras["narrow_stereo/left"];
    assert_eq!((camera.width, camera.height), (1280, 720));
    assert!(near(seen(camera), 911.240281681342, 172.579573480974));
    assert_eq!(
        file.notes,
        [
            "left.yaml: projection_matrix and rectification_matrix not used, since marks are in the raw \
             picture; the file says nothing of the mount: the camera looks forward from the body's origin"
        ]
    );
    let file = read("mast.yaml", &sample("ros-message.yaml")).unwrap();
    let camera = &file.cameras["mast"];
    assert_eq!((camera.width, camera.height), (640, 480));
    assert!(near(seen(camera), 456.826158386597, 143.492159457791));
    let text = sample("ros.yaml")
        .replace("plumb_bob", "equidistant")
        .replace("-0.000871, 0.000000]", "-0.000871]");
    let fisheye = read("left.yaml", &text).unwrap();
    assert!(matches!(
        fisheye.cameras["narrow_stereo/left"].lens,
        Lens::Fisheye(_)
    ));
}

/// By `sensor_msgs/CameraInfo` the region counts in pixels of the sensor, which are averaged after it is
/// cut: column 41.5 of the sensor is the centre of the block of columns 41 and 42, the first of those.
#[test]
fn ros_messages_of_a_binned_region() {
    let text = sample("ros-message.yaml");
    let whole = read("ros-message.yaml", &text).unwrap();
    let text = text
        .replace("binning_x: 0", "binning_x: 2")
        .replace("binning_y: 0", "binning_y: 3")
        .replace("x_offset: 0", "x_offset: 41")
        .replace("y_offset: 0", "y_offset: 30")
        .replace("  height: 0", "  height: 300")
        .replace("  width: 0", "  width: 501");
    let part = read("ros-message.yaml", &text).unwrap();
    let (whole, part) = (&whole.cameras["ros-message"], &part.cameras["ros-message"]);
    assert_eq!((part.width, part.height), (250, 100));
    let ray = |camera: &Camera, u, v| camera.ray(Pixel::new(u, v)).unwrap().direction;
    assert_eq!(ray(part, 0.0, 0.0), ray(whole, 41.5, 31.0));
    assert_eq!(ray(part, 100.0, 50.0), ray(whole, 241.5, 181.0));
}

#[test]
fn faults_of_ros_files() {
    assert_eq!(
        faults("ros.yaml", "plumb_bob", "plum_bob"),
        [
            "ros.yaml:8:1: distortion_model: found \"plum_bob\", expected one of plumb_bob, \
             rational_polynomial, equidistant (is plumb_bob meant?)"
        ]
    );
    assert_eq!(
        faults("ros.yaml", "plumb_bob", "equidistant"),
        [
            "ros.yaml:9:1: distortion_coefficients: found 5 coefficients, expected 4 for \"equidistant\""
        ]
    );
    assert_eq!(
        faults(
            "ros.yaml",
            "data: [905.512816, 0.000000",
            "data: [905.512816, 0.5"
        ),
        ["ros.yaml:4:1: camera_matrix: found a skew of 0.5, expected 0: no model has one"]
    );
    assert_eq!(
        faults(
            "ros.yaml",
            "data: [905.512816, 0.000000, ",
            "data: [905.512816, "
        ),
        [
            "ros.yaml:7:3: camera_matrix.data: found a list of 8, expected a list of 9 finite numbers"
        ]
    );
    assert_eq!(
        faults("ros.yaml", "image_width: 1280\n", ""),
        ["ros.yaml: image_width: found nothing, expected the picture's size in pixels"]
    );
    assert_eq!(
        faults("ros-message.yaml", "binning_x: 0", "binning_x: 641"),
        [
            "ros-message.yaml:14:1: binning_x: found 641 by 1, expected whole numbers from 1 to the 640x480 pixels there are"
        ]
    );
    assert_eq!(
        faults("ros-message.yaml", "  width: 0", "  width: 320"),
        [
            "ros-message.yaml:16:1: roi: found a subframe of 320x0 from column 0 and row 0, expected a part of the 640x480 there are"
        ]
    );
    let broken = faults("ros.yaml", "data: [905.512816,", "data: [[905.512816,");
    assert!(broken[0].starts_with("ros.yaml:"), "{broken:?}");
}

/// Pixels by `cv2.projectPoints` and `cv2.fisheye.projectPoints` of the point that the matrices of
/// the file, multiplied by numpy, make of (0.4, 0.3, 2) in the axes of the inertial unit.
#[test]
fn kalibr_chains_hang_on_the_inertial_unit() {
    let file = read("chain.yaml", &sample("kalibr.yaml")).unwrap();
    assert_eq!(file.format, CameraFormat::Kalibr);
    assert!(file.notes.is_empty(), "{:?}", file.notes);
    let point = Point::<Body>::new(0.4, 0.3, 2.0);
    for (name, [u, v], centre) in [
        (
            "cam0",
            [311.328162726413, 305.788646118329],
            [0.058041425241, -0.029993540906, -0.013650291568],
        ),
        (
            "cam1",
            [212.645306528592, 284.794242845466],
            [0.061061613316, -0.13998714065, -0.01073629443],
        ),
    ] {
        let camera = &file.cameras[name];
        let body_from_camera = camera.mount.body_from_camera(Default::default());
        let [x, y, z] = centre;
        assert!(body_from_camera.origin().distance(Point::new(x, y, z)) < 1e-8);
        let pixel = camera.pixel(body_from_camera.inverse() * point).unwrap();
        // The matrices of the file are rotations to ten digits.
        assert!(pixel.distance(Pixel::new(u, v)) < 1e-4, "{name} {pixel:?}");
    }
    let bare: String = sample("kalibr.yaml")
        .lines()
        .filter(|l| !l.starts_with("  -") && !l.contains("T_c"))
        .map(|l| format!("{l}\n"))
        .collect();
    let file = read("chain.yaml", &bare).unwrap();
    assert_eq!(
        file.notes[0],
        "chain.yaml: cam0: the file says nothing of the mount: the camera looks forward from the body's origin"
    );
    assert_eq!(file.cameras["cam0"].mount, Default::default());
}

#[test]
fn faults_of_kalibr_chains() {
    assert_eq!(
        faults("kalibr.yaml", "camera_model: pinhole", "camera_model: omni"),
        [
            "kalibr.yaml:8:3: cam0.camera_model: found \"omni\", expected \"pinhole\", the one projection of Kalibr's that is read"
        ]
    );
    assert_eq!(
        faults("kalibr.yaml", "model: equidistant", "model: fov"),
        [
            "kalibr.yaml:24:3: cam1.distortion_model: found \"fov\", expected one of radtan, equidistant, none"
        ]
    );
    assert_eq!(
        faults("kalibr.yaml", "[441.25, ", "["),
        [
            "kalibr.yaml:11:3: cam0.intrinsics: found a list of 3, expected a list of 4 finite numbers"
        ]
    );
    assert_eq!(
        faults("kalibr.yaml", "[0.03077760397, ", "[0.13077760397, "),
        [
            "kalibr.yaml:2:3: cam0.T_cam_imu: found a matrix that stretches or mirrors, expected a rotation and a translation above 0, 0, 0, 1"
        ]
    );
    assert_eq!(
        faults("kalibr.yaml", "  - [0.0, 0.0, 0.0, 1.0]\n", ""),
        [
            "kalibr.yaml:2:3: cam0.T_cam_imu: found a list of 3, expected 4 lists of 4 finite numbers"
        ]
    );
    assert_eq!(
        faults(
            "kalibr.yaml",
            "resolution: [752, 480]",
            "resolution: [752, 480.5]"
        ),
        ["kalibr.yaml:12:3: cam0.resolution: found 752 x 480.5, expected whole numbers above zero"]
    );
}

/// Pixels by opencv-python 5.0, which read the same files.
#[test]
fn opencv_storages_see_as_opencv_does() {
    for (name, [u, v]) in [
        ("opencv.yml", [509.253031059824, 104.836558602705]),
        ("opencv-fisheye.xml", [1126.743946443909, 420.7392676183]),
        ("opencv-2.xml", [512.69787250875, 102.7695179875]),
    ] {
        let file = read(name, &sample(name)).unwrap();
        assert_eq!(file.format, CameraFormat::OpenCv);
        let camera = &file.cameras[name.split('.').next().unwrap()];
        assert!(near(seen(camera), u, v), "{name} {:?}", seen(camera));
    }
    let json = "{\"image_width\": 640, \"image_height\": 480, \"camera_matrix\": {\"type_id\": \
        \"opencv-matrix\", \"rows\": 3, \"cols\": 3, \"dt\": \"d\", \"data\": [657, 0, 319.5, 0, 655, \
        239.5, 0, 0, 1]}, \"distortion_coefficients\": {\"type_id\": \"opencv-matrix\", \"rows\": 1, \
        \"cols\": 4, \"dt\": \"d\", \"data\": [-0.41, 0.5, 0.001, -0.002]}}";
    let file = read("c.json", json).unwrap();
    assert!(near(
        seen(&file.cameras["c"]),
        512.69787250875,
        102.7695179875
    ));
}

#[test]
fn faults_of_opencv_storages() {
    assert_eq!(
        faults("opencv.yml", "   rows: 5", "   rows: 6"),
        [
            "opencv.yml:24:4: distortion_coefficients.data: found 5 numbers, expected 6, rows times cols"
        ]
    );
    assert_eq!(
        faults(
            "opencv.yml",
            "   rows: 5\n   cols: 1",
            "   rows: 0\n   cols: 1"
        ),
        [
            "opencv.yml:24:4: distortion_coefficients.data: found 5 numbers, expected 0, rows times cols"
        ]
    );
    assert_eq!(
        faults("opencv.yml", "camera_matrix:", "camera_matricks:"),
        ["opencv.yml: camera_matrix: found nothing, expected a matrix"]
    );
    assert_eq!(
        faults("opencv-2.xml", "-0.41 0.5", "-0.41 O.5"),
        [
            "opencv-2.xml:10:3: opencv_storage.Distortion_Coefficients.data: found \"-0.41 O.5 0.001 -0.002\", expected finite numbers"
        ]
    );
    assert_eq!(
        faults("opencv-2.xml", "</Camera_Matrix>", ""),
        ["opencv-2.xml:11:1: not XML: expected 'Camera_Matrix' tag, not 'opencv_storage'"]
    );
    assert_eq!(
        faults(
            "opencv-fisheye.xml",
            "-4.8207e-03 1.2091e-03",
            "-4.8207e-03"
        ),
        [
            "opencv-fisheye.xml:17:3: opencv_storage.distortion_coefficients.data: found 3 numbers, expected 4, rows times cols"
        ]
    );
}

/// Pixels by `pycolmap.Camera.img_from_cam` of pycolmap 4.2, less the half pixel.
#[test]
fn colmap_cameras_see_as_colmap_does() {
    let file = read("cameras.txt", &sample("cameras.txt")).unwrap();
    assert_eq!(file.format, CameraFormat::Colmap);
    let pixels = [
        [2253.1875, 589.625],
        [2256.4625, 588.26],
        [2249.81226635275, 592.0203271045],
        [2250.020018534415, 591.872890072351],
        [2252.232137455501, 591.468720225843],
        [752.235981637764, 431.473895834889],
        [2253.174126948596, 590.80137895419],
        [752.227982963915, 431.412399186899],
        [752.236414691448, 431.406415380263],
    ];
    assert_eq!(file.cameras.len(), pixels.len());
    for (name, [u, v]) in (1..).zip(pixels) {
        let pixel = seen(&file.cameras[&name.to_string()]);
        assert!(near(pixel, u, v), "{name} {pixel:?}");
    }
}

#[test]
fn faults_of_colmap_cameras_are_told_together() {
    let text = "# a comment\n1 PINHOLE 3072 2304 2560.56 2558.2 1536.5\n2 FOV 30 20 1 2 3 4 5\n\
        3 PINHOLE 3072 -1 1 2 3 4\n4 PINHOLE 3072 2304 1 2 3 x\n5 PINHOLE 3072 2304 0 2 3 4\n6 PINHOLE\n";
    let error = read("cameras.txt", text).unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(
        lines,
        [
            "cameras.txt:2: PARAMS: found 3 numbers, expected fx, fy, cx, cy",
            "cameras.txt:3: MODEL: found FOV, expected one of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE, FULL_OPENCV, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE",
            "cameras.txt:4: HEIGHT: found -1, expected a whole number from 1 to 1000000",
            "cameras.txt:5: cy: found x, expected a finite number",
            "cameras.txt:6: PARAMS: found fx 0, fy 2, cx 2.5, cy 3.5, expected finite numbers, fx and fy above zero",
            "cameras.txt:7: found 2 fields, expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS",
        ]
    );
    let error = read("cameras.txt", "# nothing\n").unwrap_err();
    assert_eq!(
        error.to_string(),
        "cameras.txt: found no camera, expected lines CAMERA_ID MODEL WIDTH HEIGHT PARAMS"
    );
}

/// A rover that stands at ENU (17.75, 11.5, 0.5) of its site and heads 73.7398 degrees east of
/// north. Pixels and places by numpy, from the formulas of CAHVOR and of quaternions.
#[test]
fn labels_tell_camera_and_pose() {
    let file = read("2n.img", &(sample("rover.lbl") + "\0\u{1}\u{fffd}")).unwrap();
    assert_eq!(file.format, CameraFormat::OdlLabel);
    let [image] = &file.images[..] else {
        panic!("one picture");
    };
    assert_eq!(image.image_id, "2N126400000EFF0200P1500L0M1");
    assert_eq!(image.time.unwrap().to_string(), "2004-01-03T12:00:00.5Z");
    let camera = &file.cameras["2N126400000EFF0200P1500L0M1"];
    assert_eq!(*camera, image.camera);
    assert_eq!((camera.width, camera.height), (512, 256));
    // 3 m ahead of the camera, 0.4 to its right, 2.6 below, in the rover's axes.
    let body = Point::<Body>::new(3.45, -0.52, -1.36);
    let body_from_camera = camera.mount.body_from_camera(Default::default());
    let pixel = camera.pixel(body_from_camera.inverse() * body).unwrap();
    assert!(near(pixel, 316.34688897256, 42.167822280792), "{pixel:?}");
    assert_eq!(
        file.notes,
        [
            "2n.img: a picture from column 0, row 512 of its detector, 2 x 2 pixels averaged: the camera model counts the detector's pixels"
        ]
    );
    let pose = image.pose;
    assert_eq!(pose.site, Some(2));
    let (place, attitude) = (pose.place.unwrap(), pose.attitude.unwrap());
    let seen = place + attitude * Vector::<Body>::from_xyz(body.xyz);
    assert!(seen.distance(Point::new(21.2076, 11.9668, -0.86)) < 1e-12);
    let ahead = (attitude * Vector::<Body>::new(1.0, 0.0, 0.0)).xyz;
    assert!((ahead.x.atan2(ahead.y).to_degrees() - 73.73979529168803).abs() < 1e-9);
}

/// A model in the picture's own pixels stays as it is: its centre tells.
#[test]
fn labels_of_subframes_that_count_the_pictures_pixels() {
    // H and V of the sample as they are in its picture: the centre lies at (255.75, -0.25).
    let text = sample("rover.lbl")
        .replace("(409.6,1200.0,307.2)", "(204.6,600.0,153.45)")
        .replace("(-310.4,0.0,", "(-360.2,0.0,")
        .replace("1267.2)", "479.85)");
    let file = read("2n.lbl", &text).unwrap();
    let camera = &file.images[0].camera;
    let body_from_camera = camera.mount.body_from_camera(Default::default());
    let body = Point::<Body>::new(3.45, -0.52, -1.36);
    let pixel = camera.pixel(body_from_camera.inverse() * body).unwrap();
    assert!(pixel.distance(Pixel::new(316.34688897256, 42.167822280792)) < 0.5);
    assert!(file.notes[0].ends_with("the camera model counts the picture's pixels"));
}

#[test]
fn faults_of_labels() {
    let rover = |from: &str, to: &str| faults("rover.lbl", from, to);
    assert_eq!(
        rover("= CAHVOR", "= CAHVRO"),
        [
            "rover.lbl:18:3: GEOMETRIC_CAMERA_MODEL_PARMS.MODEL_TYPE: found \"CAHVRO\", expected one of CAHV, CAHVOR, CAHVORE (is CAHVOR meant?)"
        ]
    );
    assert_eq!(
        rover("(409.6,1200.0,307.2)", "(409.6,1200.0)"),
        [
            "rover.lbl:23:3: GEOMETRIC_CAMERA_MODEL_PARMS.MODEL_COMPONENT_3: found a list of 2, expected a list of 3 finite numbers"
        ]
    );
    assert_eq!(
        rover("(0.8,0.0,0.0,0.6)", "(0.8,0.0,0.0,0.9)"),
        [
            "rover.lbl:38:3: ROVER_COORDINATE_SYSTEM_PARMS.ORIGIN_ROTATION_QUATERNION: found a quaternion of length 1.2042, expected a unit quaternion"
        ]
    );
    assert_eq!(
        rover("ELEVATION_DIRECTION = UP", "ELEVATION_DIRECTION = DOWN"),
        [
            "rover.lbl:40:3: ROVER_COORDINATE_SYSTEM_PARMS.POSITIVE_ELEVATION_DIRECTION: found \"DOWN\", expected one of UP"
        ]
    );
    assert_eq!(
        rover("LINES                        = 256\n", "\n"),
        ["rover.lbl: IMAGE.LINES: found nothing, expected the picture's size in pixels"]
    );
    assert_eq!(
        rover("GEOMETRIC_CAMERA_MODEL_PARMS\n  MODEL", "OTHER\n  MODEL"),
        ["rover.lbl:30:1: END_GROUP: found GEOMETRIC_CAMERA_MODEL_PARMS, expected OTHER"]
    );
    assert_eq!(
        rover(
            "COORDINATE_SYSTEM_INDEX      = (2,11,10)",
            "COORDINATE_SYSTEM_INDEX      = (2,12,10)"
        ),
        [
            "rover.lbl:47:3: LOCAL_LEVEL_COORDINATE_SYSTEM_PARMS.COORDINATE_SYSTEM_INDEX: found [2.0, 12.0, 10.0], expected [2.0, 11.0, 10.0], the index of the frame that refers to it"
        ]
    );
    assert_eq!(
        rover("= LOCAL_LEVEL_FRAME", "= ROVER_FRAME"),
        [
            "rover.lbl:28:3: GEOMETRIC_CAMERA_MODEL_PARMS.REFERENCE_COORD_SYSTEM_NAME: found frames that refer to each other, expected frames that lead to a SITE_FRAME"
        ]
    );
    let text = sample("rover.lbl").replacen("= LOCAL_LEVEL_FRAME", "= SOME_FRAME", 1);
    let file = read("rover.lbl", &text).unwrap();
    assert!(
        file.notes
            .contains(&"rover.lbl: nothing is said of the SOME_FRAME: no pose".to_owned())
    );
    assert!(file.images[0].pose.place.is_none());
}

/// The feed's record stands as the label's rover: heading 73.7398 degrees, at north 12.5, east -3.25,
/// 0.75 down.
#[test]
fn records_of_the_mars_2020_feed() {
    let file = read("feed.json", &sample("feed.json")).unwrap();
    assert_eq!(file.format, CameraFormat::Mars2020);
    let image = &file.images[0];
    assert_eq!(
        image.image_id,
        "NLE_0002_0667129493_453ECM_N0030000NCAM00101_00_4LLJ"
    );
    assert_eq!((image.camera.width, image.camera.height), (1280, 960));
    assert_eq!(image.time.unwrap().to_string(), "2021-02-20T01:57:50.123Z");
    assert_eq!(image.pose.site, Some(3));
    assert!(
        image
            .pose
            .place
            .unwrap()
            .distance(Point::new(-3.25, 12.5, -0.75))
            < 1e-15
    );
    let ahead = image.pose.attitude.unwrap() * Vector::<Body>::new(1.0, 0.0, 0.0);
    assert!((ahead.xyz.x.atan2(ahead.xyz.y).to_degrees() - 73.73979529168803).abs() < 1e-9);
    // The axis A meets the picture where A.H and A.V say: 640, 480.
    let ray = image.camera.ray(Pixel::new(640.0, 480.0)).unwrap();
    let body = image.camera.mount.body_from_camera(Default::default()) * ray;
    assert!((body.direction.xyz() - nalgebra::Vector3::new(0.8, 0.0, -0.6)).norm() < 1e-9);
    assert!(file.notes.is_empty(), "{:?}", file.notes);
}

#[test]
fn faults_of_mars_2020_records() {
    let feed = |from: &str, to: &str| faults("feed.json", from, to);
    assert_eq!(
        feed("\"CAHVORE\"", "\"CAHVOR E\""),
        [
            "feed.json:21:9: images[0].camera.camera_model_type: found \"CAHVOR E\", expected one of CAHV, CAHVOR, CAHVORE (is CAHVORE meant?)"
        ]
    );
    assert_eq!(
        feed(";2;0.0", ""),
        [
            "feed.json:18:9: images[0].camera.camera_model_component_list: found 7 components, expected 9 of CAHVORE"
        ]
    );
    assert_eq!(
        feed(";2;0.0", ";4;0.0"),
        [
            "feed.json:18:9: images[0].camera.camera_model_component_list: found \"4;0.0\" for mtype and linearity, expected 1, 2 or 3 and a number"
        ]
    );
    assert_eq!(
        feed("(512.0,700.0,384.0)", "(512.0,700.0)"),
        [
            "feed.json:18:9: images[0].camera.camera_model_component_list: found \"(512.0,700.0)\" for H, expected three finite numbers, (x,y,z)"
        ]
    );
    assert_eq!(
        feed(
            "(0.8,0.0,0.0,0.6)\",\n      \"imageid",
            "(0.8,0.0,0.6)\",\n      \"imageid"
        ),
        ["feed.json:14:7: images[0].attitude: found \"(0.8,0.0,0.6)\", expected 4 numbers"]
    );
    assert_eq!(
        feed(
            "(0.8,0.0,0.0,0.6)\",\n      \"imageid",
            "(0.8,0.0,0.0,0.9)\",\n      \"imageid"
        ),
        [
            "feed.json:14:7: images[0].attitude: found [0.8, 0.0, 0.0, 0.9], expected a unit quaternion, scalar first"
        ]
    );
    assert_eq!(
        faults("feed.json", "\"imageid\"", "\"image\""),
        ["feed.json:3:5: images[0].imageid: found nothing, expected the picture's name"]
    );
    assert_eq!(
        feed("(1280,960)", "(1280,960.5)"),
        [
            "feed.json:3:5: images[0].dimension: found 1280 x 960.5, expected whole numbers above zero"
        ]
    );
}

#[test]
fn records_of_a_page_without_a_model_are_left_out() {
    let text = sample("feed.json");
    let (start, end) = (text.find("    {\n").unwrap(), text.rfind("\n  ],").unwrap());
    let record = &text[start..end];
    let list = record.find("\"(1.1,").unwrap();
    let blind = record
        .replace(
            &record[list..list + record[list..].find(",\n").unwrap()],
            "\"UNK\"",
        )
        .replace("NLE_0002", "HELI_0002");
    let both = text.replace(record, &format!("{blind},\n{record}"));
    let file = read("feed.json", &both).unwrap();
    assert_eq!(file.cameras.len(), 1);
    assert_eq!(
        file.notes,
        [
            "feed.json: HELI_0002_0667129493_453ECM_N0030000NCAM00101_00_4LLJ: the record has no camera model and is left out"
        ]
    );
    let error = read("feed.json", &text.replace(record, &blind)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "feed.json:2:3: images: found no record with a camera model, expected at least one"
    );
}

#[test]
fn text_is_asked_for() {
    let error = cameras_from_bytes(b"[cameras]\n\xff", Path::new("c.toml"), "c.toml").unwrap_err();
    assert_eq!(
        error.to_string(),
        "c.toml: found bytes that are not UTF-8, expected text"
    );
}
