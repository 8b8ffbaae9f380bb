//! Objects of two classes that the detector takes for each other.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector2};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};

use crate::adjust::{LevelPlane, Measurement, Problem, Reading};
use crate::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use crate::detection::Cut;
use crate::frame::{Pixel, Point, RigidTransform, Rotation, Vector};
use crate::fuse::belief::{Belief, BeliefSettings, Confusion, fuse_belief};
use crate::pose::{Pose, PoseSigma};
use crate::view::View;

/// A rock is called so nine times in ten, a shadow two times in three.
const SAYS: [[f64; 2]; 2] = [[0.9, 0.1], [0.35, 0.65]];
const N_VIEWS: u32 = 12;

fn views() -> Vec<View> {
    let lens = Pinhole::new(Intrinsics {
        fx: 800.0,
        fy: 800.0,
        cx: 639.5,
        cy: 479.5,
    });
    let camera = Arc::new(Camera {
        name: "mast".into(),
        width: 1280,
        height: 960,
        lens: Lens::Pinhole(lens.unwrap()),
        mount: Mount::default(),
        readout: None,
    });
    let down = UnitQuaternion::from_euler_angles(0.0, 20f64.to_radians(), 0.0);
    let sigma = PoseSigma::from_vector([0.02, 0.02, 0.01, 0.002, 0.002, 0.002].into());
    let view = |i: u32| View {
        image_id: format!("view{i}"),
        listed: ("poses.csv".into(), 1),
        time: None,
        platform: None,
        picture: None,
        camera: Some(camera.clone()),
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(
                Rotation::from_unit_quaternion(down),
                Vector::new(0.4 * f64::from(i), 0.0, 2.0),
            ),
            sigma,
            has_heading: true,
        },
        enu_from_local: Rotation::identity(),
    };
    (0..N_VIEWS).map(view).collect()
}

/// Twenty places in a grid, every other of the second class.
fn objects() -> Vec<([f64; 2], usize)> {
    let at = |i: u32| {
        let (row, column) = (i / 5, i % 5);
        let place = [8.0 + 1.5 * f64::from(row), -2.4 + 1.2 * f64::from(column)];
        (place, (i % 2) as usize)
    };
    (0..20).map(at).collect()
}

fn measurements(views: &[View]) -> Vec<Measurement> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut noise = |sigma: f64| Normal::new(0.0, sigma).unwrap().sample(&mut random);
    let mut all = Vec::new();
    for (index, view) in views.iter().enumerate() {
        for (place, class) in objects() {
            let place = Point::new(place[0], place[1], 0.0);
            let camera = view.camera.as_ref().unwrap();
            let Ok(seen) = camera.pixel(view.enu_from_camera().unwrap().inverse() * place) else {
                continue;
            };
            let is_inside = (0.0..1279.0).contains(&seen.u) && (0.0..959.0).contains(&seen.v);
            if !is_inside {
                continue;
            }
            let says_first = noise(1.0) < quantile(SAYS[class][0]);
            all.push(Measurement {
                view: index,
                reading: Reading::Pixel {
                    pixel: Pixel::new(seen.u + noise(1.5), seen.v + noise(1.5)),
                    sigma_px: Vector2::new(1.5, 1.5),
                    range: None,
                },
                log_size: None,
                bounds: None,
                cut: Cut::NONE,
                class: usize::from(!says_first),
                score: None,
            });
        }
    }
    all
}

/// The standard normal's quantiles at the shares of the table.
fn quantile(share: f64) -> f64 {
    if share > 0.5 { 1.2816 } else { -0.3853 }
}

fn fused(confusion: Option<Confusion>) -> Belief {
    let views = views();
    let measurements = measurements(&views);
    let problem = Problem {
        views: &views,
        measurements: &measurements,
        surface: &LevelPlane::default(),
        height_sigma_m: 0.02,
        max_range_m: 20.0,
        min_range_m: 0.0,
    };
    let settings = BeliefSettings {
        confusion,
        ..BeliefSettings::default()
    };
    fuse_belief(&problem, &settings)
}

fn table(rows: [[f64; 2]; 2]) -> Option<Confusion> {
    Confusion::new(rows.map(|row| row.to_vec()).to_vec())
}

#[test]
fn objects_called_by_two_names_are_one_with_the_right_class() {
    let belief = fused(table(SAYS));
    let real: Vec<_> = belief.objects.iter().filter(|o| o.p_exist > 0.5).collect();
    let truth = objects();
    assert_eq!(real.len(), truth.len());
    let mut right = 0;
    for (place, class) in &truth {
        let place = Point::new(place[0], place[1], 0.0);
        let near = |o: &&&_| {
            let o: &&crate::fuse::belief::BeliefObject = o;
            o.place.horizontal_distance(place) < 0.2
        };
        let found = real.iter().find(near).expect("every object");
        let p = found.p_class.expect("a probability");
        assert!((0.5..=1.0).contains(&p), "{p}");
        right += usize::from(found.class == *class);
    }
    assert!(right >= 19, "{right} of {}", truth.len());
    // Without the table, things called by two names are two.
    let apart = fused(None);
    let n = apart.objects.iter().filter(|o| o.p_exist > 0.5).count();
    assert!(n > truth.len() + 5, "{n}");
    assert!(apart.objects.iter().all(|o| o.p_class.is_none()));
}

#[test]
fn a_table_without_confusion_keeps_classes_apart() {
    let (with, without) = (fused(table([[1.0, 0.0], [0.0, 1.0]])), fused(None));
    let sure = |belief: &Belief| {
        let sure = belief.objects.iter().filter(|o| o.p_exist > 0.99);
        sure.cloned().collect::<Vec<_>>()
    };
    let (with, without) = (sure(&with), sure(&without));
    assert!(with.len() > 20, "{}", with.len());
    assert_eq!(with.len(), without.len());
    for (a, b) in with.iter().zip(&without) {
        assert!(a.place.distance(b.place) < 5e-3);
        assert_eq!(a.class, b.class);
        assert!(a.p_class.is_some_and(|p| p > 0.999_999));
    }
}
