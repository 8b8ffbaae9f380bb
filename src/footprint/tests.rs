//! Footprints against plain geometry.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion};

use super::*;
use crate::camera::{Camera, Equirectangular, Fisheye, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use crate::frame::{
    Body, Enu, Geodetic, Pixel, Planet, Point, RigidTransform, Rotation, Site, Vector,
};
use crate::pose::{Pose, PoseSigma};
use crate::terrain::Terrain;
use crate::view::View;

fn site() -> Site {
    Site::new(Planet::MOON, Geodetic::from_degrees(10.0, 20.0, 0.0))
}

fn ground() -> Terrain {
    Terrain::constant_height(site(), 0.0)
}

/// A view from `(0, 0, height)` whose body has this attitude; the camera looks along body x.
fn view(camera: Option<Camera>, height_m: f64, rotation: Rotation<Enu, Body>) -> View {
    View {
        image_id: "v".into(),
        listed: ("poses.csv".into(), 2),
        time: None,
        platform: None,
        picture: None,
        camera: camera.map(Arc::new),
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(rotation, Vector::new(0.0, 0.0, height_m)),
            sigma: PoseSigma::from_vector(nalgebra::Vector6::zeros()),
            has_heading: true,
        },
        enu_from_local: Rotation::identity(),
    }
}

/// Pitched down by an angle, degrees, heading east.
fn down(angle_deg: f64) -> Rotation<Enu, Body> {
    let angle = angle_deg.to_radians();
    Rotation::from_unit_quaternion(UnitQuaternion::from_euler_angles(0.0, angle, 0.0))
}

fn intrinsics() -> Intrinsics {
    Intrinsics {
        fx: 500.0,
        fy: 500.0,
        cx: 319.5,
        cy: 239.5,
    }
}

fn camera(lens: Lens, width: u32, height: u32) -> Camera {
    Camera {
        name: "c".into(),
        width,
        height,
        lens,
        mount: Mount::default(),
        readout: None,
    }
}

fn pinhole() -> Camera {
    camera(Lens::Pinhole(Pinhole::new(intrinsics()).unwrap()), 640, 480)
}

fn reach(min_range_m: f64, max_range_m: f64) -> Reach {
    Reach {
        min_range_m,
        max_range_m,
        fov: TAU,
    }
}

fn share_off(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

#[test]
fn a_picture_straight_down_is_a_rectangle() {
    let footprint = trace(
        &view(Some(pinhole()), 10.0, down(90.0)),
        Some(&ground()),
        reach(0.0, 100.0),
    );
    assert!(
        share_off(footprint.area_m2(), 12.8 * 9.6) < 1e-4,
        "{}",
        footprint.area_m2()
    );
    // Its long side lies along the body's left, north.
    assert!(
        footprint.covers(4.7, 6.3) && !footprint.covers(4.9, 0.0) && !footprint.covers(0.0, 6.5)
    );
}

#[test]
fn the_least_range_cuts_a_hole() {
    let view = view(Some(pinhole()), 10.0, down(90.0));
    let footprint = trace(&view, Some(&ground()), reach(2.0, 100.0));
    assert!(share_off(footprint.area_m2(), 12.8 * 9.6 - 4.0 * PI) < 1e-3);
    assert_eq!(footprint.ground().0[0].interiors().len(), 1);
    assert!(!footprint.covers(1.0, 1.0) && footprint.covers(1.6, 1.6));
}

#[test]
fn a_picture_above_the_horizon_keeps_its_lower_part() {
    // Level camera: the lower half sees the ground from f h / (H / 2) = 20.83 m on.
    let view = view(Some(pinhole()), 10.0, down(0.0));
    let footprint = trace(&view, Some(&ground()), reach(0.0, 60.0));
    let near_m = 10.0 * 500.0 / 240.0;
    let half = (320.0f64 / 500.0).atan();
    // A circular sector less the triangle before the picture's lower edge.
    let expected = 60.0 * 60.0 * half - near_m * near_m * half.tan();
    assert!(
        share_off(footprint.area_m2(), expected) < 2e-3,
        "{} {expected}",
        footprint.area_m2()
    );
    assert!(
        footprint.covers(59.0, 0.0)
            && !footprint.covers(20.0, 0.0)
            && !footprint.covers(-30.0, 0.0)
    );
}

#[test]
fn a_picture_of_the_sky_has_none() {
    let footprint = trace(
        &view(Some(pinhole()), 10.0, down(-40.0)),
        Some(&ground()),
        reach(0.0, 60.0),
    );
    assert_eq!(footprint.area_m2(), 0.0);
    assert!(!footprint.covers(10.0, 0.0));
}

#[test]
fn a_panorama_sees_the_whole_ring() {
    let lens = Lens::Equirectangular(Equirectangular::new(720, 360));
    let view = view(Some(camera(lens, 720, 360)), 2.0, down(3.0));
    let footprint = trace(&view, Some(&ground()), reach(1.0, 20.0));
    assert!(
        share_off(footprint.area_m2(), PI * (400.0 - 1.0)) < 2e-3,
        "{}",
        footprint.area_m2()
    );
}

#[test]
fn a_fisheye_that_shows_zenith_and_horizon() {
    // 220 degrees of field looking up: sees the horizon all round, and no ground within
    // h / tan 20 degrees.
    let f = 320.0 / 110f64.to_radians();
    let intrinsics = Intrinsics {
        fx: f,
        fy: f,
        cx: 319.5,
        cy: 319.5,
    };
    let lens = Lens::Fisheye(Fisheye::new(intrinsics, [0.0; 4]).unwrap());
    let view = view(Some(camera(lens, 640, 640)), 2.0, down(-90.0));
    let footprint = trace(&view, Some(&ground()), reach(0.0, 50.0));
    // The picture is square and the field round: nearest along the sides' middles.
    let near_m = 2.0 / 20f64.to_radians().tan();
    assert!(!footprint.covers(near_m * 0.95, 0.0) && footprint.covers(near_m * 1.05, 0.0));
    assert!(footprint.covers(-49.0, 0.0) && !footprint.covers(0.1, 0.1));
}

#[test]
fn every_ground_pixel_lies_in_the_footprint_and_no_other() {
    let view = view(Some(pinhole()), 3.0, down(12.0));
    let reach = reach(4.0, 25.0);
    let (terrain, limits) = (ground(), reach);
    let footprint = trace(&view, Some(&terrain), reach);
    let enu_from_camera = view.enu_from_camera().unwrap();
    let camera = view.camera.as_ref().unwrap();
    for i in 0..40 {
        for j in 0..30 {
            let pixel = Pixel::new(f64::from(i) * 16.0 + 7.5, f64::from(j) * 16.0 + 7.5);
            let ray = enu_from_camera * camera.ray(pixel).unwrap();
            let Ok(hit) = terrain.first_hit(ray, limits.max_range_m) else {
                continue;
            };
            let range_m = hit.point.horizontal_distance(view.origin());
            let near_the_rim = (range_m - limits.min_range_m).abs() < 0.05
                || (range_m - limits.max_range_m).abs() < 0.05;
            let expected = range_m > limits.min_range_m;
            let found = footprint.covers(hit.point.xyz.x, hit.point.xyz.y);
            assert!(near_the_rim || found == expected, "{pixel:?} at {range_m}");
        }
    }
}

#[test]
fn views_without_a_camera_have_their_sector() {
    let north = Rotation::from_matrix(Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0));
    let sector = Reach {
        fov: 60f64.to_radians(),
        ..reach(0.0, 10.0)
    };
    let footprint = trace(&view(None, 0.0, north), None, sector);
    assert!(share_off(footprint.area_m2(), 100.0 * PI / 6.0) < 1e-3);
    assert!(
        footprint.covers(0.0, 9.9) && footprint.covers(4.8, 8.5) && !footprint.covers(5.3, 8.5)
    );
    assert!(!footprint.covers(0.0, -1.0));
    let ring = trace(&view(None, 0.0, north), None, reach(0.0, 10.0));
    assert!(share_off(ring.area_m2(), 100.0 * PI) < 1e-3);
}

#[test]
fn queries_over_many_footprints() {
    let north = Rotation::identity();
    let at = |east_m: f64| {
        let mut view = view(None, 0.0, north);
        view.pose.enu_from_body.translation.xyz.x = east_m;
        trace(&view, None, reach(0.0, 5.0))
    };
    let footprints = Footprints::new(vec![at(0.0), at(6.0), at(100.0), Footprint::empty()]);
    let place = |east_m: f64| Point::<Enu>::new(east_m, 0.0, 0.0);
    assert_eq!(footprints.views_covering(place(3.0)), [0, 1]);
    assert_eq!(footprints.views_covering(place(-4.0)), [0]);
    assert_eq!(footprints.views_covering(place(50.0)), [0usize; 0]);
    assert_eq!(footprints.views_overlapping(0), [1]);
    assert_eq!(footprints.views_overlapping(2), [0usize; 0]);
    assert_eq!(footprints.views_overlapping(3), [0usize; 0]);
    let lens = footprints.seen_by_at_least(2).unsigned_area();
    let half = 0.6f64.acos();
    let expected = 2.0 * 25.0 * (half - 0.6 * half.sin());
    assert!(share_off(lens, expected) < 2e-3, "{lens} {expected}");
    let covered = footprints.covered_by_others(1).unsigned_area();
    assert!((covered - lens).abs() < 1e-6);
    assert!(footprints.covered_by_others(2).0.is_empty());
}

#[test]
fn seams_between_triangles_leave_no_gap() {
    let footprint = trace(
        &view(Some(pinhole()), 10.0, down(60.0)),
        Some(&ground()),
        reach(0.0, 40.0),
    );
    let inside = |p: &geo::Coord<f64>| geo::Contains::contains(footprint.ground(), p);
    for i in 0..400 {
        for j in 0..400 {
            let p = geo::coord! { x: f64::from(i) * 0.1 - 5.0, y: f64::from(j) * 0.1 - 20.0 };
            if inside(&p) {
                assert!(footprint.covers(p.x, p.y), "{p:?}");
            }
        }
    }
}

#[test]
fn no_attitude_loses_its_footprint() {
    let camera = || Some(pinhole());
    for pitch in [-20, -10, 0, 5, 10, 15, 30, 60, 90] {
        for roll in [-30, -1, 0, 2, 45] {
            for yaw in [0, 1, 45, 90, 137, 180, 270] {
                let [r, p, y] = [roll, pitch, yaw].map(|a| f64::from(a).to_radians());
                let turn = UnitQuaternion::from_euler_angles(r, p, y);
                let view = view(camera(), 2.0, Rotation::from_unit_quaternion(turn));
                let footprint = trace(&view, Some(&ground()), reach(0.0, 20.0));
                let expected = sampled_area_m2(&view, 20.0);
                let found = footprint.area_m2();
                let at = format!("roll {roll}, pitch {pitch}, yaw {yaw}");
                assert!(
                    (found - expected).abs() < 0.02 * expected + 0.5,
                    "{at}: {found} {expected}"
                );
            }
        }
    }
}

/// The ground a view sees, counted on a grid of a quarter of a metre.
fn sampled_area_m2(view: &View, reach_m: f64) -> f64 {
    let camera_from_enu = view.enu_from_camera().unwrap().inverse();
    let camera = view.camera.as_ref().unwrap();
    let mut count = 0;
    for i in -80..80 {
        for j in -80..80 {
            let (x, y) = (f64::from(i) * 0.25 + 0.125, f64::from(j) * 0.25 + 0.125);
            let seen = camera.pixel(camera_from_enu * Point::new(x, y, 0.0));
            let inside = seen.is_ok_and(|p| p.is_inside(camera.width, camera.height));
            count += i32::from(inside && x.hypot(y) <= reach_m);
        }
    }
    f64::from(count) * 0.0625
}
