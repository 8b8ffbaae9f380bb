//! There and back over whole pictures, and what lies outside them.

use rockmap::camera::{
    BrownConrady, Camera, Intrinsics, Lens, LensError, Mount, PanTilt, cameras_from_toml,
    cameras_to_toml, read_camera_file, write_cameras,
};
use rockmap::frame::{Pixel, Point, RigidTransform, Rotation, Vector};

#[test]
fn every_pixel_comes_back() {
    for camera in super::cameras().values() {
        let (right, bottom) = (
            f64::from(camera.width) - 1.0,
            f64::from(camera.height) - 1.0,
        );
        let steps = || (0..=40).map(|i| f64::from(i) / 40.0);
        for (a, b) in steps().flat_map(|a| steps().map(move |b| (a, b))) {
            let pixel = Pixel::new(a * right, b * bottom);
            for distance in [0.5, 300.0] {
                let point = camera.ray(pixel).unwrap().at(distance);
                let back = camera.pixel(point).unwrap();
                let off = back.distance(pixel);
                assert!(off < 1e-8, "{} {pixel:?} {off:e}", camera.name);
            }
        }
    }
}

/// A point either has no pixel or has one whose ray leads back to it: nothing folds over.
#[test]
fn no_point_folds_into_a_picture() {
    for camera in super::cameras().values() {
        let mut seen = 0;
        for i in 0..=180 {
            for j in 0..24 {
                let (sin, cos) = (f64::from(i) / 180.0 * std::f64::consts::PI).sin_cos();
                let (s, c) = (f64::from(j) / 12.0 * std::f64::consts::PI).sin_cos();
                let point = Point::new(sin * c * 5.0, sin * s * 5.0, cos * 5.0);
                let Ok(pixel) = camera.pixel(point) else {
                    continue;
                };
                if !pixel.is_inside(camera.width, camera.height) {
                    continue;
                }
                seen += 1;
                let ray = camera.ray(pixel).unwrap();
                let to_point = (point - ray.origin).xyz.normalize();
                let off = (ray.direction.xyz() - to_point).norm();
                assert!(off < 1e-9, "{} {point:?} {off:e}", camera.name);
            }
        }
        assert!(seen > 20, "{} saw {seen} of the points", camera.name);
    }
}

#[test]
fn behind_is_an_error() {
    for camera in super::cameras().values() {
        let behind = camera.pixel(Point::new(0.01, -0.02, -5.0));
        match camera.lens {
            Lens::Equirectangular(_) => assert!(behind.is_ok()),
            Lens::Fisheye(_) | Lens::Cahvore(_) => assert!(behind.is_err(), "{}", camera.name),
            _ => assert_eq!(behind, Err(LensError::BehindCamera), "{}", camera.name),
        }
        assert!(camera.pixel(Point::origin()).is_err(), "{}", camera.name);
    }
}

#[test]
fn what_is_no_number_has_no_answer() {
    for camera in super::cameras().values() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                !camera.has_ray(Pixel::new(bad, 5.0)),
                "{} {bad}",
                camera.name
            );
        }
        // So far out a panorama goes around and a tilted image plane has a vanishing point; all
        // others have no answer, and none a direction that is no unit vector.
        if let Ok(ray) = camera.ray(Pixel::new(1e200, 5.0)) {
            let length = ray.direction.xyz().norm();
            assert!((length - 1.0).abs() < 1e-12, "{} {length}", camera.name);
        }
        for bad in [f64::NAN, f64::INFINITY] {
            for axis in 0..3 {
                let mut point = Point::new(0.1, 0.2, 3.0);
                point.xyz[axis] = bad;
                assert!(camera.pixel(point).is_err(), "{} {point:?}", camera.name);
            }
        }
    }
}

/// With k1 = -0.3 alone the distorted radius `r (1 - 0.3 r^2)` turns at `r = 1 / sqrt(0.9)`, where it
/// is two thirds of that; at r = 1.7 it would be back at 0.2261, well inside the picture.
#[test]
fn distortion_that_turns_back_ends_the_field() {
    let intrinsics = Intrinsics {
        fx: 500.0,
        fy: 500.0,
        cx: 320.0,
        cy: 240.0,
    };
    for tangential in [0.0, 1e-4] {
        let lens = BrownConrady::new(intrinsics, &[-0.3, 0.0, tangential, 0.0]).unwrap();
        let turning = 1.0 / 0.9f64.sqrt();
        assert!((lens.field_radius() - turning).abs() < 1e-12);
        let camera = camera(Lens::BrownConrady(lens));
        assert_eq!(
            camera.pixel(Point::new(1.7, 0.0, 1.0)),
            Err(LensError::OutsideField)
        );
        let edge = 320.0 + 500.0 * turning * 2.0 / 3.0;
        assert!(camera.has_ray(Pixel::new(edge - 0.5, 240.0)));
        assert_eq!(
            camera
                .ray(Pixel::new(edge + 0.5, 240.0))
                .map(|r| r.direction),
            Err(LensError::OutsideField)
        );
    }
}

#[test]
fn a_panorama_has_no_pixel_at_its_poles_and_no_rows_beyond() {
    let panorama = &super::cameras()["panorama"];
    assert_eq!(
        panorama.pixel(Point::new(0.0, -2.0, 0.0)),
        Err(LensError::OutsideField)
    );
    assert!(panorama.has_ray(Pixel::new(10.0, -0.5)));
    assert!(!panorama.has_ray(Pixel::new(10.0, -0.6)));
    assert!(!panorama.has_ray(Pixel::new(10.0, 1023.6)));
}

#[test]
fn cameras_written_and_read_are_the_same() {
    let cameras = super::cameras();
    assert_eq!(
        cameras_from_toml(&cameras_to_toml(&cameras), "again.toml").unwrap(),
        cameras
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.toml");
    write_cameras(&path, &cameras).unwrap();
    assert_eq!(
        read_camera_file(&path, "cameras.toml").unwrap().cameras,
        cameras
    );
}

/// JPL's vectors hold the mount, so a camera that was moved is written with moved vectors.
#[test]
fn a_moved_cahv_camera_is_written_where_it_stands() {
    let rotation = Rotation::from_scalar_first([0.3, -0.7, 0.2, 0.4]).unwrap();
    let mount = RigidTransform::new(rotation, Vector::new(1.0, -2.0, 0.5));
    for name in ["cahv", "cahvor", "cahvore_below"] {
        let mut camera = super::cameras()[name].clone();
        camera.mount = Mount::from_transform(mount);
        let text = cameras_to_toml(&[(name.to_owned(), camera.clone())].into());
        let again = &cameras_from_toml(&text, "moved.toml").unwrap()[name];
        let pixel = Pixel::new(200.0, 700.0);
        let [old, new] = [&camera, again].map(|camera| {
            let body_from_camera = camera.mount.body_from_camera(PanTilt::default());
            (body_from_camera * camera.ray(pixel).unwrap()).at(10.0)
        });
        assert!(old.distance(new) < 1e-12, "{name}");
    }
}

fn camera(lens: Lens) -> Camera {
    Camera {
        name: "made".to_owned(),
        width: 640,
        height: 480,
        lens,
        mount: Mount::default(),
        readout: None,
    }
}
