//! Places and derivatives against the plain geometry and central differences.

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::*;
use crate::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole, cameras_from_toml};
use crate::detection::{Mark, MarkSigma, PixelBox};
use crate::frame::{Enu, Geodetic, Pixel, Planet, Point, RigidTransform, Rotation, Site, Vector};
use crate::pose::{Pose, PoseSigma};
use crate::terrain::{Affine, HeightGrid, Posts};

fn site() -> Site {
    Site::new(
        Planet::EARTH,
        Geodetic::from_degrees(-24.45, -69.93, 1000.0),
    )
}

fn camera() -> Camera {
    let intrinsics = Intrinsics {
        fx: 900.0,
        fy: 905.0,
        cx: 640.0,
        cy: 480.0,
    };
    Camera {
        name: "mast".into(),
        width: 1280,
        height: 960,
        lens: Lens::Pinhole(Pinhole::new(intrinsics).unwrap()),
        mount: Mount::new(Vector::new(0.3, -0.1, 1.8), [0.5, -0.5, 0.5, -0.5]).unwrap(),
        readout: None,
    }
}

/// The same place and focal length, with an entrance pupil that moves by decimetres.
fn moving_pupil() -> Camera {
    let text = "[cameras.mast]\nmodel = \"cahvore\"\nwidth = 1280\nheight = 960\naxes = \"flu\"\n\
        C = [0.3, -0.1, 1.8]\nA = [1, 0, 0]\nH = [640, -900, 0]\nV = [480, 0, -900]\n\
        O = [1, 0, 0]\nR = [0, 0, 0]\nE = [0.5, 0.2, 0]\nmtype = 2\n";
    cameras_from_toml(text, "cameras.toml").unwrap()["mast"].clone()
}

/// A view two metres up that looks down by some 20 degrees, tilted and rolled a little.
fn view(with_camera: bool) -> View {
    let turn = UnitQuaternion::from_euler_angles(0.03, 0.33, 0.7);
    let place = Geodetic::from_degrees(-24.449, -69.931, 1000.4);
    let enu = site().enu(place);
    View {
        image_id: "v1".into(),
        listed: ("poses.csv".into(), 2),
        time: None,
        platform: None,
        picture: None,
        camera: with_camera.then(|| Arc::new(camera())),
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(
                Rotation::from_unit_quaternion(turn),
                enu - Point::origin(),
            ),
            sigma: PoseSigma {
                east_m: 0.05,
                north_m: 0.04,
                up_m: 0.02,
                roll: 0.004,
                pitch: 0.003,
                yaw: 0.007,
            },
            has_heading: true,
        },
        enu_from_local: site().enu_from_local(place),
    }
}

fn settings() -> Settings {
    Settings {
        aim: Aim::CENTER,
        min_range_m: 0.0,
        max_range_m: f64::INFINITY,
        min_score: 0.0,
        noise: MarkNoise {
            pixel_px: 1.5,
            range_m: 0.15,
            bearing: 0.02,
        },
    }
}

fn detection(mark: Mark, range_m: Option<f64>) -> Detection {
    Detection {
        image_id: "v1".into(),
        det_id: "0".into(),
        class: None,
        score: Some(0.7),
        diameter_m: None,
        mark,
        range_m,
        sigma: MarkSigma::default(),
        file: 0,
        line: 2,
    }
}

/// A slope with a swell: neither level nor even.
fn hills() -> Terrain {
    let (lat, lon) = (-24.449_f64, -69.931_f64);
    let step = 1e-5;
    let (columns, rows) = (200, 200);
    let height = |column: usize, row: usize| {
        let (x, y) = (column as f64 - 100.0, row as f64 - 100.0);
        1000.0 + 0.08 * x - 0.05 * y + 0.3 * (x / 9.0).sin() * (y / 7.0).cos()
    };
    let posts: Vec<f64> = (0..rows * columns)
        .map(|i| height(i % columns, i / columns))
        .collect();
    let first = Affine::north_up(lon - 100.0 * step, lat + 100.0 * step, step);
    let grid = HeightGrid::new(columns, rows, Posts::F64(posts), first, "EPSG:4326").unwrap();
    Terrain::from_grids(site(), vec![grid], None).unwrap()
}

fn hit(view: &View, detection: &Detection, terrain: Option<&Terrain>) -> Result<Hit, Miss> {
    let settings = settings();
    let sighting = sight(detection, view, &settings)?;
    meet(&sighting, view, terrain, &settings)
}

/// The view with its pose in error by the six parameters.
fn perturbed(view: &View, error: [f64; 6]) -> View {
    let mut view = view.clone();
    let t = &mut view.pose.enu_from_body;
    t.translation.xyz += Vector3::new(error[0], error[1], error[2]);
    t.rotation = t
        .rotation
        .perturbed(Vector3::new(error[3], error[4], error[5]));
    view
}

fn raised(height_m: f64, terrain: &str) -> Terrain {
    match terrain {
        "level" => Terrain::constant_height(site(), 1000.0 + height_m),
        _ => unreachable!("only the level ground is raised"),
    }
}

/// Every kind of sighting, with the ground it meets.
fn cases() -> Vec<(&'static str, View, Detection, Option<Terrain>)> {
    let level = || Some(Terrain::constant_height(site(), 1000.0));
    let pixel = Mark::Point(Pixel::new(500.0, 700.0));
    let corner = Mark::Point(Pixel::new(100.0, 900.0));
    let fisheye = || View {
        camera: Some(Arc::new(moving_pupil())),
        ..view(true)
    };
    vec![
        (
            "moving pupil on level ground",
            fisheye(),
            detection(corner, None),
            level(),
        ),
        (
            "moving pupil with a range",
            fisheye(),
            detection(corner, Some(7.3)),
            level(),
        ),
        (
            "ray on level ground",
            view(true),
            detection(pixel, None),
            level(),
        ),
        (
            "ray on hills",
            view(true),
            detection(pixel, None),
            Some(hills()),
        ),
        (
            "ray with a range",
            view(true),
            detection(pixel, Some(7.3)),
            level(),
        ),
        (
            "bearing on level ground",
            view(false),
            detection(Mark::Bearing(0.4), Some(9.0)),
            level(),
        ),
        (
            "bearing on hills",
            view(true),
            detection(Mark::Bearing(-0.6), Some(9.0)),
            Some(hills()),
        ),
        (
            "bearing without ground",
            view(false),
            detection(Mark::Bearing(2.0), Some(4.0)),
            None,
        ),
        (
            "azimuth on level ground",
            view(false),
            detection(Mark::Azimuth(1.1), Some(9.0)),
            level(),
        ),
    ]
}

#[test]
fn derivative_by_the_pose_against_central_differences() {
    for (name, view, detection, terrain) in cases() {
        let found = hit(&view, &detection, terrain.as_ref()).unwrap();
        for parameter in 0..6 {
            let step = 1e-4;
            let moved = |sign: f64| {
                let mut error = [0.0; 6];
                error[parameter] = sign * step;
                hit(&perturbed(&view, error), &detection, terrain.as_ref())
                    .unwrap()
                    .point
                    .xyz
            };
            let numeric = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let analytic = found.by_pose.column(parameter);
            let scale = found.slant_range_m.max(1.0);
            let azimuth_turn = name.starts_with("azimuth") && parameter >= 3;
            if azimuth_turn {
                assert_eq!(analytic.norm(), 0.0, "{name} {parameter}");
                continue;
            }
            // The bilinear surface bends within a step; the level one by its curvature alone.
            let tolerance = if name.contains("hills") { 3e-4 } else { 2e-5 };
            assert!(
                (numeric - analytic).norm() < tolerance * scale,
                "{name} {parameter}: {numeric:?} {analytic:?}"
            );
        }
    }
}

#[test]
fn covariance_of_the_mark_against_central_differences() {
    for (name, view, found, terrain) in cases() {
        let placed = hit(&view, &found, terrain.as_ref()).unwrap();
        let at = |detection: &Detection| hit(&view, detection, terrain.as_ref()).unwrap().point.xyz;
        let slope = |sigma: f64, change: &dyn Fn(&mut Detection, f64)| {
            let step = 1e-2 * sigma;
            let moved = |sign: f64| {
                let mut detection = found.clone();
                change(&mut detection, sign * step);
                at(&detection)
            };
            (moved(1.0) - moved(-1.0)) / (2.0 * step) * sigma
        };
        let mut expected = Matrix3::zeros();
        let mut add = |column: Vector3<f64>| expected += column * column.transpose();
        match found.mark {
            Mark::Point(_) => {
                for along in [Pixel::new(1.0, 0.0), Pixel::new(0.0, 1.0)] {
                    add(slope(1.5, &|d, h| {
                        if let Mark::Point(p) = &mut d.mark {
                            *p = Pixel::new(p.u + along.u * h, p.v + along.v * h);
                        }
                    }));
                }
            }
            _ => add(slope(0.02, &|d, h| match &mut d.mark {
                Mark::Bearing(b) | Mark::Azimuth(b) => *b += h,
                _ => {}
            })),
        }
        if found.range_m.is_some() {
            add(slope(0.15, &|d, h| d.range_m = d.range_m.map(|r| r + h)));
        }
        let off = (placed.mark_covariance - expected).norm() / expected.norm();
        let tolerance = if name.contains("hills") { 2e-3 } else { 1e-4 };
        assert!(off < tolerance, "{name}: {off}");
    }
}

#[test]
fn derivative_by_the_height_of_the_ground() {
    for (name, view, detection, terrain) in cases() {
        if terrain.is_none() || name.contains("hills") {
            continue;
        }
        let found = hit(&view, &detection, terrain.as_ref()).unwrap();
        let at = |height_m| {
            hit(&view, &detection, Some(&raised(height_m, "level")))
                .unwrap()
                .point
                .xyz
        };
        let numeric = (at(1e-3) - at(-1e-3)) / 2e-3;
        assert!((numeric - found.by_ground_height).norm() < 1e-4, "{name}");
    }
}

#[test]
fn bearing_and_azimuth_agree_about_north() {
    // Body facing east: bearing 90 (to the right) is south, azimuth 180.
    let mut east = view(false);
    east.pose.enu_from_body.rotation = Rotation::identity();
    let terrain = Terrain::constant_height(site(), 1000.4);
    let right = detection(Mark::Bearing(90f64.to_radians()), Some(5.0));
    let south = detection(Mark::Azimuth(180f64.to_radians()), Some(5.0));
    let a = hit(&east, &right, Some(&terrain)).unwrap().point;
    let b = hit(&east, &south, Some(&terrain)).unwrap().point;
    let from: Point<Enu> = east.origin();
    assert!((a - from).xyz.y < -4.99 && (a - from).xyz.x.abs() < 0.01);
    assert!(a.distance(b) < 0.01);
}

#[test]
fn a_range_shorter_than_the_height_meets_no_ground() {
    let terrain = Terrain::constant_height(site(), 995.0);
    let short = detection(Mark::Azimuth(0.0), Some(3.0));
    let miss = hit(&view(false), &short, Some(&terrain)).unwrap_err();
    assert_eq!(miss.to_string(), "range 3 m meets the ground nowhere");
    assert_eq!(miss.reason(), Reason::RangeTooShort);
}

#[test]
fn a_box_keeps_its_true_centre_where_it_leaves_the_picture() {
    let terrain = Terrain::constant_height(site(), 1000.0);
    let at = |mark| hit(&view(true), &detection(mark, None), Some(&terrain));
    let partly = Mark::Box(PixelBox {
        x_min: -120.0,
        y_min: 800.0,
        x_max: 20.0,
        y_max: 900.0,
    });
    // A point outside the picture is no detection, so the centre is looked up by a wider camera.
    let mut wide = view(true);
    let mut camera = camera();
    (camera.width, camera.lens) = (1480, Lens::Pinhole(shifted()));
    wide.camera = Some(Arc::new(camera));
    let centre = Mark::Point(Pixel::new(-50.0 + 200.0, 850.0));
    let expected = hit(&wide, &detection(centre, None), Some(&terrain)).unwrap();
    assert!(at(partly).unwrap().point.distance(expected.point) < 1e-9);

    let outside = Mark::Box(PixelBox {
        x_min: -120.0,
        y_min: 800.0,
        x_max: -20.0,
        y_max: 900.0,
    });
    assert_eq!(
        at(outside).unwrap_err().to_string(),
        "found a box -120 800 -20 900, expected some of it in the picture of 1280x960"
    );
}

/// The camera's lens with 200 more columns on the left.
fn shifted() -> Pinhole {
    Pinhole::new(Intrinsics {
        fx: 900.0,
        fy: 905.0,
        cx: 840.0,
        cy: 480.0,
    })
    .unwrap()
}

#[test]
fn ranges_and_scores_are_trusted_within_their_limits() {
    let terrain = Terrain::constant_height(site(), 1000.0);
    let seen = detection(Mark::Point(Pixel::new(500.0, 700.0)), None);
    let with = |settings: Settings| {
        let view = view(true);
        place(&seen, (3, &view), Some(&terrain), 0.02, &settings)
    };
    let range_m = with(settings()).unwrap().hit.ground_range_m;
    let near = with(Settings {
        max_range_m: range_m - 0.5,
        ..settings()
    });
    assert_eq!(near.unwrap_err().reason(), Reason::TooFar);
    let far = with(Settings {
        min_range_m: range_m + 0.5,
        ..settings()
    });
    assert_eq!(far.unwrap_err().reason(), Reason::TooNear);
    let sure = with(Settings {
        min_score: 0.8,
        ..settings()
    });
    assert_eq!(
        sure.unwrap_err().to_string(),
        "score 0.7 is below min_score = 0.8"
    );
    assert_eq!(with(settings()).unwrap().view, 3);
}

#[test]
fn the_width_of_a_box_gives_the_diameter() {
    let terrain = Terrain::constant_height(site(), 1000.0);
    let mark = Mark::Box(PixelBox {
        x_min: 620.0,
        y_min: 650.0,
        x_max: 660.0,
        y_max: 670.0,
    });
    let view = view(true);
    let placed = place(
        &detection(mark, None),
        (0, &view),
        Some(&terrain),
        0.02,
        &settings(),
    );
    let placed = placed.unwrap();
    // A bar of that length across the line of sight spans the box.
    let enu_from_camera = view.enu_from_camera().unwrap();
    let seen = enu_from_camera.inverse() * placed.hit.point;
    let half = Vector::new(0.5 * placed.diameter_m.unwrap(), 0.0, 0.0);
    let camera = view.camera.as_ref().unwrap();
    let left = camera.pixel(seen + half * -1.0).unwrap();
    let right = camera.pixel(seen + half).unwrap();
    assert!(
        (right.u - left.u - 40.0).abs() < 0.2,
        "{}",
        right.u - left.u
    );
}
