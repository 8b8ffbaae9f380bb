//! Boxes that the picture's border cuts.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector2};

use super::assert_derivatives;
use super::recorded::Recorded;
use crate::adjust::{LevelPlane, Measurement, Problem, Reading};
use crate::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use crate::detection::{Aim, Cut, PixelBox, Side};
use crate::frame::{Pixel, Point, RigidTransform, Rotation, Vector};
use crate::fuse::belief::cut::{Left, Shape};
use crate::fuse::belief::data::Look;
use crate::fuse::belief::engine::Engine;
use crate::fuse::belief::{BeliefSettings, SizeRule, algebra};
use crate::pose::{Pose, PoseSigma};
use crate::view::View;

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 960;

fn measured(bounds: PixelBox, cut: Cut) -> Measurement {
    Measurement {
        view: 0,
        reading: Reading::Pixel {
            pixel: bounds.aim_point(Aim::CENTER),
            sigma_px: Vector2::new(1.5, 1.5),
            range: None,
        },
        log_size: None,
        bounds: Some(bounds),
        cut,
        class: 0,
        score: None,
    }
}

/// A box of this width and height about a pixel.
fn about(pixel: Pixel, [width, height]: [f64; 2]) -> PixelBox {
    PixelBox {
        x_min: pixel.u - 0.5 * width,
        x_max: pixel.u + 0.5 * width,
        y_min: pixel.v - 0.5 * height,
        y_max: pixel.v + 0.5 * height,
    }
}

/// Boxes twice as wide as high.
fn long_boxes() -> Shape {
    let whole = measured(about(Pixel::new(100.0, 100.0), [40.0, 20.0]), Cut::NONE);
    Shape::of(&[whole; 9], SizeRule::Height)
}

#[test]
fn shapes_are_those_of_whole_boxes() {
    let [wide, high] = long_boxes().lengths_px(30.0);
    assert!((wide - 60.0).abs() < 1e-9 && (high - 30.0).abs() < 1e-9);
    // Cut boxes have no shape, and few say nothing.
    let whole = measured(about(Pixel::new(100.0, 100.0), [40.0, 20.0]), Cut::NONE);
    let mut cut = whole;
    cut.cut.across = Side::Lost;
    for some in [vec![cut; 9], vec![whole; 5]] {
        assert_eq!(
            Shape::of(&some, SizeRule::Width).lengths_px(30.0),
            [30.0; 2]
        );
    }
}

/// A look of which the right and the lower end are cut.
fn cut_look(engine: &Engine<'_>, view: usize) -> Look {
    let bounds = about(Pixel::new(100.0, 100.0), [1.0, 1.0]);
    let cut = Cut {
        across: Side::Cut {
            end_px: 99.5,
            to_aim: 0.5,
        },
        down: Side::Cut {
            end_px: 99.5,
            to_aim: 0.7,
        },
    };
    let mut look = engine.looks[engine.start[view]];
    look.left = Left::of(cut, bounds, &long_boxes(), SizeRule::Height);
    look
}

#[test]
fn ends_lie_before_the_aim_point() {
    let recorded = Recorded::read(include_str!("../../../../tests/data/belief/pixels.json"));
    let engine = recorded.engine();
    let x = engine.objects[0];
    let view = engine.expectation().pairs[0].view;
    let look = cut_look(&engine, view);
    let whole = engine.expect(view, &x).unwrap();
    let ends = whole.of_ends(&look).unwrap();
    let size_px = whole.values[2].exp();
    assert!((whole.values[0] - ends.values[0] - 0.5 * 2.0 * size_px).abs() < 1e-9);
    assert!((whole.values[1] - ends.values[1] - 0.7 * size_px).abs() < 1e-9);
    assert_eq!(whole.values[2..], ends.values[2..]);
}

#[test]
fn derivatives_of_ends_against_central_differences() {
    let recorded = Recorded::read(include_str!("../../../../tests/data/belief/pixels.json"));
    let mut engine = recorded.engine();
    let mut n = 0;
    for pair in engine.expectation().pairs.iter().step_by(9) {
        let (view, x) = (pair.view, engine.objects[pair.object]);
        let look = cut_look(&engine, view);
        let seen = engine.expect(view, &x).unwrap();
        let ends = seen.of_ends(&look).unwrap();
        assert_derivatives(&mut engine, view, x, |engine, x| {
            let seen = engine.expect(view, x).unwrap();
            seen.of_ends(&look).unwrap()
        });
        // A spread turned into that of the ends is the spread by the derivatives of the ends.
        let cov = &engine.object_cov[pair.object];
        let turned = seen.spread_of_ends(&look, &algebra::spread(&seen.by_object, cov, 4));
        let direct = algebra::spread(&ends.by_object, cov, 4);
        for (a, b) in turned.iter().flatten().zip(direct.iter().flatten()) {
            assert!((a - b).abs() < 1e-9 * b.abs().max(1.0));
        }
        n += 1;
    }
    assert!(n > 5);
}

/// A camera two metres above the ground that looks 20 degrees down to the east.
fn view() -> View {
    let intrinsics = Intrinsics {
        fx: 800.0,
        fy: 800.0,
        cx: 639.5,
        cy: 479.5,
    };
    View {
        image_id: "view".into(),
        listed: ("poses.csv".into(), 1),
        time: None,
        platform: None,
        picture: None,
        camera: Some(Arc::new(Camera {
            name: "mast".into(),
            width: WIDTH,
            height: HEIGHT,
            lens: Lens::Pinhole(Pinhole::new(intrinsics).unwrap()),
            mount: Mount::default(),
            readout: None,
        })),
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(
                Rotation::from_unit_quaternion(UnitQuaternion::from_euler_angles(
                    0.0,
                    20f64.to_radians(),
                    0.0,
                )),
                Vector::new(0.0, 0.0, 2.0),
            ),
            sigma: PoseSigma {
                east_m: 1e-3,
                north_m: 1e-3,
                up_m: 1e-3,
                roll: 1e-4,
                pitch: 1e-4,
                yaw: 1e-4,
            },
            has_heading: true,
        },
        enu_from_local: Rotation::identity(),
    }
}

/// A rock of known size of which the lower border shows less than half is found where it is; the
/// middle of what is seen lies a third of its size beyond.
#[test]
fn what_is_left_of_a_rock_places_it() {
    const SIZE_M: f64 = 0.5;
    let view = view();
    let place = Point::new(1.55, 0.2, 0.0);
    let camera = view.camera.clone().unwrap();
    let in_camera = view.enu_from_camera().unwrap().inverse() * place;
    let side_px = SIZE_M * 800.0 / in_camera.xyz.z;
    let whole = about(camera.pixel(in_camera).unwrap(), [side_px; 2]);
    let mut seen = whole;
    seen.y_max = f64::from(HEIGHT) - 0.5;
    let share = seen.height() / whole.height();
    assert!((0.2..0.5).contains(&share), "{share}");
    let cut = seen.cut(WIDTH, HEIGHT, 3.0, Aim::CENTER);
    let far = about(Pixel::new(640.0, 300.0), [40.0, 40.0]);
    let mut measurements = vec![measured(far, Cut::NONE); 8];
    measurements.push(measured(seen, cut));
    let views = [view];
    let problem = Problem {
        views: &views,
        measurements: &measurements,
        surface: &LevelPlane::default(),
        height_sigma_m: 0.005,
        max_range_m: 15.0,
        min_range_m: 0.0,
    };
    for size_rule in [SizeRule::Width, SizeRule::Height] {
        let settings = BeliefSettings {
            size_rule,
            size_m: Some((SIZE_M, 0.005)),
            ..BeliefSettings::default()
        };
        let engine = Engine::new(&problem, &settings);
        let at = engine.looks.iter().position(|l| l.left.is_some()).unwrap();
        let found = engine.singles[at].object;
        let off_m = (found[0] - place.xyz.x).hypot(found[1] - place.xyz.y);
        assert!(off_m < 0.03, "{size_rule:?}: {off_m} m");
        let middle = camera.ray(seen.aim_point(Aim::CENTER)).unwrap();
        let middle = views[0].enu_from_camera().unwrap() * middle;
        let hit = middle.origin.xyz
            - middle.direction.xyz() * (middle.origin.xyz.z / middle.direction.xyz().z);
        assert!(hit.x - place.xyz.x > 0.1);
    }
}

/// A cut box is at least as large as it looks, and an end is as good as an aim point.
#[test]
fn what_a_cut_box_says() {
    let recorded = Recorded::read(include_str!("../../../../tests/data/belief/pixels.json"));
    let engine = recorded.fresh();
    let look = cut_look(&engine, 0);
    let left = look.left.unwrap();
    assert_eq!(left.ends([100.0, 100.0]), [99.5, 99.5]);
    assert!((left.log_size(2.0) - 2.5).abs() < 1e-12);
    let [u, v, size] = left.variances();
    // The width is known by the shape of other boxes, to a twentieth.
    assert!((u - (0.5 * 2.0 * 0.05f64).powi(2)).abs() < 1e-9);
    assert_eq!(v, 0.0);
    assert!((size - 0.25).abs() < 1e-12);
}
