//! Labels and records of rover pictures.

use super::*;

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
