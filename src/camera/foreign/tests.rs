mod rovers;

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

#[test]
fn text_is_asked_for() {
    let error = cameras_from_bytes(b"[cameras]\n\xff", Path::new("c.toml"), "c.toml").unwrap_err();
    assert_eq!(
        error.to_string(),
        "c.toml: found bytes that are not UTF-8, expected text"
    );
}
