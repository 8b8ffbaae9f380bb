//! The bounds against those of the numpy reference on the same data: tests/reference/bounds.py
//! wrote the scenes and the results under tests/data/bounds.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector, Vector2, Vector3, Vector6};
use rockmap::adjust::{LevelPlane, Measurement, Problem, Reading};
use rockmap::bound::{BoundMap, Fair, Partition, clairvoyant, fair};
use rockmap::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use rockmap::detection::Cut;
use rockmap::existence::{Exposure, Prior};
use rockmap::frame::{Body, Enu, Pixel, RigidTransform, Rotation, Vector};
use rockmap::pose::{Pose, PoseSigma};
use rockmap::view::View;
use serde::Deserialize;

#[derive(Deserialize)]
struct Scene {
    camera: SceneCamera,
    sigma: [f64; 6],
    area_m2: f64,
    share: f64,
    position: Vec<[f64; 3]>,
    quaternion: Vec<[f64; 4]>,
    view: Vec<usize>,
    pixel: Vec<[f64; 2]>,
    log_size: Vec<f64>,
    /// The object of every detection, -1 for clutter.
    object: Vec<i64>,
    clairvoyant: Clairvoyant,
    fair: FairResult,
    tilted: Option<Tilted>,
}

#[derive(Deserialize)]
struct SceneCamera {
    width: u32,
    height: u32,
    f: f64,
    cx: f64,
    cy: f64,
}

#[derive(Deserialize)]
struct Clairvoyant {
    object: Vec<i64>,
    place: Vec<[f64; 2]>,
    covariance: Vec<[[f64; 2]; 2]>,
    pose: Vec<[f64; 6]>,
}

#[derive(Deserialize)]
struct FairResult {
    /// The group of every detection.
    group: Vec<usize>,
    place: Vec<[f64; 2]>,
    covariance: Vec<[[f64; 2]; 2]>,
    p_exist: Vec<f64>,
    pixel_px: f64,
    clutter: f64,
    density: f64,
    pose_scale: [f64; 6],
    size: [f64; 2],
    clutter_size: [f64; 2],
    detectability: Vec<f64>,
}

/// Three-dimensional points over a sloping plane, by scipy's least squares.
#[derive(Deserialize)]
struct Tilted {
    slope: [f64; 2],
    height_sigma_m: f64,
    place: Vec<[f64; 3]>,
    covariance: Vec<[[f64; 3]; 3]>,
}

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/bounds")
        .join(name);
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

impl Scene {
    fn views(&self) -> Vec<View> {
        let SceneCamera {
            width,
            height,
            f,
            cx,
            cy,
        } = self.camera;
        let pinhole = Pinhole::new(Intrinsics {
            fx: f,
            fy: f,
            cx,
            cy,
        })
        .unwrap();
        let camera = Arc::new(Camera {
            name: "mast".into(),
            width,
            height,
            lens: Lens::Pinhole(pinhole),
            mount: Mount::default(),
            readout: None,
        });
        let poses = self.position.iter().zip(&self.quaternion);
        poses
            .enumerate()
            .map(|(i, (&[x, y, z], &quaternion))| View {
                image_id: format!("{i:03}"),
                listed: ("poses.csv".into(), 1),
                time: None,
                platform: None,
                picture: None,
                camera: Some(Arc::clone(&camera)),
                head: PanTilt::default(),
                pose: Pose {
                    enu_from_body: RigidTransform::<Enu, Body>::new(
                        Rotation::from_scalar_first(quaternion).unwrap(),
                        Vector::new(x, y, z),
                    ),
                    sigma: PoseSigma::from_vector(Vector6::from(self.sigma)),
                    has_heading: true,
                },
                enu_from_local: Rotation::identity(),
            })
            .collect()
    }

    fn measurements(&self) -> Vec<Measurement> {
        let detections = self.view.iter().zip(&self.pixel).zip(&self.log_size);
        detections
            .map(|((&view, &[u, v]), &log_size)| Measurement {
                view,
                reading: Reading::Pixel {
                    pixel: Pixel::new(u, v),
                    sigma_px: Vector2::new(1.5, 1.5),
                    range: None,
                },
                log_size: Some(log_size),
                bounds: None,
                cut: Cut::NONE,
                class: 0,
                score: None,
            })
            .collect()
    }

    fn partition(&self) -> Partition {
        let names: Vec<Option<String>> = self
            .object
            .iter()
            .map(|&id| (id >= 0).then(|| id.to_string()))
            .collect();
        Partition::new(names.iter().map(|name| Some(name.as_deref())))
    }
}

fn problem<'a>(
    views: &'a [View],
    measurements: &'a [Measurement],
    surface: &'a LevelPlane,
    height_sigma_m: f64,
) -> Problem<'a> {
    Problem {
        views,
        measurements,
        surface,
        height_sigma_m,
        max_range_m: 14.0,
        min_range_m: 0.0,
    }
}

/// The largest deviation of places and, relative to their size, of covariances from a reference
/// that is looked up by the first member of each object.
fn deviation<const N: usize>(
    map: &BoundMap,
    reference: impl Fn(usize) -> ([f64; N], [[f64; N]; N]),
) -> (f64, f64) {
    let mut worst = (0.0f64, 0.0f64);
    for object in &map.objects {
        let (place, covariance) = reference(object.observations[0]);
        let place = SVector::from(place);
        // The reference holds rows, nalgebra columns; a covariance is its own transpose.
        let covariance = SMatrix::from(covariance);
        let away_m = object.place.xyz.fixed_rows::<N>(0) - place;
        let away = object.covariance.fixed_view::<N, N>(0, 0) - covariance;
        worst.0 = worst.0.max(away_m.amax());
        worst.1 = worst.1.max(away.amax() / covariance.trace());
    }
    worst
}

/// Index of an object in a reference list.
fn index(objects: &[i64], id: i64) -> usize {
    objects.iter().position(|&o| o == id).unwrap()
}

#[test]
fn clairvoyant_on_a_plane_agrees_with_the_numpy_reference() {
    let scene = scene("small.json");
    let (views, measurements) = (scene.views(), scene.measurements());
    let plane = LevelPlane::default();
    let problem = problem(&views, &measurements, &plane, 0.0);
    let map = clairvoyant(&problem, &scene.partition()).unwrap();
    assert!(map.evidence.converged);
    assert_eq!(map.objects.len(), scene.clairvoyant.object.len());
    let (place_m, covariance) = deviation(&map, |detection| {
        let at = index(&scene.clairvoyant.object, scene.object[detection]);
        (
            scene.clairvoyant.place[at],
            scene.clairvoyant.covariance[at],
        )
    });
    assert!(place_m < 1e-6, "{place_m} m");
    assert!(covariance < 1e-6, "{covariance}");
    for (found, expected) in map.poses.iter().zip(&scene.clairvoyant.pose) {
        assert!((found - Vector6::from(*expected)).amax() < 1e-7);
    }
}

#[test]
fn clairvoyant_over_a_slope_agrees_with_scipy() {
    let scene = scene("small.json");
    let tilted = scene.tilted.as_ref().unwrap();
    let (views, measurements) = (scene.views(), scene.measurements());
    let plane = LevelPlane {
        slope_east: tilted.slope[0],
        slope_north: tilted.slope[1],
    };
    let problem = problem(&views, &measurements, &plane, tilted.height_sigma_m);
    let map = clairvoyant(&problem, &scene.partition()).unwrap();
    let (place_m, covariance) = deviation(&map, |detection| {
        let at = index(&scene.clairvoyant.object, scene.object[detection]);
        (tilted.place[at], tilted.covariance[at])
    });
    assert!(place_m < 1e-6, "{place_m} m");
    assert!(covariance < 1e-4, "{covariance}");
}

fn fair_map(scene: &Scene, height_sigma_m: f64) -> BoundMap {
    let (views, measurements) = (scene.views(), scene.measurements());
    let plane = LevelPlane::default();
    let problem = problem(&views, &measurements, &plane, height_sigma_m);
    let exposure = Exposure {
        area_m2: scene.area_m2,
        shares: vec![scene.share; views.len()],
    };
    let prior = Prior::default();
    let data = Fair {
        problem: &problem,
        exposure: &exposure,
        prior: &prior,
    };
    fair(&data, &scene.partition()).unwrap()
}

#[test]
fn fair_on_a_plane_agrees_with_the_numpy_reference() {
    let scene = scene("small.json");
    let expected = &scene.fair;
    let map = fair_map(&scene, 0.0);
    let model = map.evidence.model.as_ref().unwrap();
    let near = |found: f64, expected: f64, what: &str| {
        assert!(
            (found - expected).abs() < 1e-6,
            "{what}: {found} {expected}"
        );
    };
    near(model.noise.reading * 1.5, expected.pixel_px, "noise");
    for q in 0..6 {
        near(model.noise.pose[q], expected.pose_scale[q], "pose noise");
    }
    near(model.clutter_per_view, expected.clutter, "clutter");
    near(model.density_per_m2, expected.density, "density");
    near(model.size.mean, expected.size[0], "size");
    near(model.size.variance, expected.size[1], "size variance");
    near(model.clutter_size.mean, expected.clutter_size[0], "clutter");
    near(
        model.clutter_size.variance,
        expected.clutter_size[1],
        "clutter",
    );
    for (found, expected) in model.curve.values().iter().zip(&expected.detectability) {
        near(*found, *expected, "curve");
    }
    assert_eq!(map.objects.len(), expected.place.len());
    let (place_m, covariance) = deviation(&map, |detection| {
        let at = expected.group[detection];
        (expected.place[at], expected.covariance[at])
    });
    assert!(place_m < 1e-6, "{place_m} m");
    assert!(covariance < 1e-6, "{covariance}");
    for object in &map.objects {
        let group = expected.group[object.observations[0]];
        near(object.p_exist, expected.p_exist[group], "p_exist");
    }
}

/// Heights that hardly vary are as good as none; heights that vary make places less certain.
#[test]
fn fair_in_three_dimensions_tends_to_the_plane() {
    let scene = scene("small.json");
    let flat = fair_map(&scene, 0.0);
    let nearly = fair_map(&scene, 1e-4);
    let rough = fair_map(&scene, 0.1);
    let trace = |map: &BoundMap| -> f64 {
        let covariances = map.objects.iter();
        covariances.map(|o| o.covariance.trace()).sum()
    };
    for (a, b) in flat.objects.iter().zip(&nearly.objects) {
        assert!(a.place.distance(b.place) < 1e-4);
        assert!(
            (a.p_exist - b.p_exist).abs() < 1e-3,
            "{} {}",
            a.p_exist,
            b.p_exist
        );
    }
    assert!(trace(&rough) > 1.5 * trace(&flat));
}

/// The derivatives by place and pose error, against central differences, with a mount that is off
/// the body's origin and a large pose error.
#[test]
fn derivatives_agree_with_differences() {
    use rockmap::adjust::CorrectedPose;
    use rockmap::project::Range;
    let scene = scene("small.json");
    let mut view = scene.views().remove(0);
    let mut camera = (**view.camera.as_ref().unwrap()).clone();
    camera.mount = Mount::new(Vector::new(0.4, -0.2, 0.3), [0.5, -0.45, 0.52, -0.5]).unwrap();
    view.camera = Some(Arc::new(camera));
    let plane = LevelPlane {
        slope_east: 0.1,
        slope_north: -0.05,
    };
    let range = Range {
        range_m: 7.0,
        sigma_m: 0.1,
    };
    let readings = [
        Reading::Pixel {
            pixel: Pixel::new(600.0, 500.0),
            sigma_px: Vector2::new(1.0, 1.0),
            range: Some(range),
        },
        Reading::Bearing {
            bearing: 0.1,
            is_azimuth: false,
            sigma: 0.01,
            range,
        },
        Reading::Bearing {
            bearing: 1.4,
            is_azimuth: true,
            sigma: 0.01,
            range,
        },
    ];
    let views = [view];
    let delta = Vector6::new(0.1, -0.2, 0.05, 0.3, -0.2, 0.25);
    for reading in readings {
        let measurement = Measurement {
            view: 0,
            reading,
            log_size: None,
            bounds: None,
            cut: Cut::NONE,
            class: 0,
            score: None,
        };
        let problem = problem(&views, &[], &plane, 0.1);
        let residual = |point: Vector3<f64>, delta: Vector6<f64>| {
            let pose = CorrectedPose::new(&views[0], &delta);
            let prediction = pose.predict(&problem, &measurement, point);
            prediction.unwrap()
        };
        let point = Vector3::new(6.5, 2.0, 0.1);
        let here = residual(point, delta);
        let scale = here.by_pose.amax();
        // An azimuth is taken not to turn with the platform, the arm of its camera neither.
        let is_azimuth = matches!(
            reading,
            Reading::Bearing {
                is_azimuth: true,
                ..
            }
        );
        for i in 0..if is_azimuth { 3 } else { 6 } {
            let mut step = Vector6::zeros();
            step[i] = 1e-5;
            let after = residual(point, delta + step).residual;
            let before = residual(point, delta - step).residual;
            let numeric = (before - after) / 2e-5;
            assert!(
                (numeric - here.by_pose.column(i)).amax() < 1e-6 * scale,
                "{i}"
            );
        }
        for i in 0..3 {
            let mut step = Vector3::zeros();
            step[i] = 1e-5;
            let after = residual(point + step, delta).residual;
            let before = residual(point - step, delta).residual;
            let numeric = (before - after) / 2e-5;
            assert!(
                (numeric - here.by_point.column(i)).amax() < 1e-6 * scale,
                "{i}"
            );
        }
    }
}

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let scene = scene("small.json");
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let map = pool.build().unwrap().install(|| fair_map(&scene, 0.05));
        format!("{map:?}")
    };
    let one = solve(1);
    assert_eq!(one, solve(2));
    assert_eq!(one, solve(5));
}

#[test]
fn what_has_no_bound_says_why() {
    let scene = scene("small.json");
    let (mut views, measurements) = (scene.views(), scene.measurements());
    let plane = LevelPlane::default();
    let nothing = Partition::new(scene.object.iter().map(|_| None));
    let clutter = Partition::new(scene.object.iter().map(|_| Some(None)));
    let flat = problem(&views, &measurements, &plane, 0.0);
    for partition in [&nothing, &clutter] {
        assert_eq!(
            clairvoyant(&flat, partition).unwrap_err().to_string(),
            "found no labelled detection that can be placed, expected at least one"
        );
    }
    views[3].camera = None;
    let exposure = Exposure {
        area_m2: 1.0,
        shares: vec![1.0; views.len()],
    };
    let data = Fair {
        problem: &problem(&views, &measurements, &plane, 0.0),
        exposure: &exposure,
        prior: &Prior::default(),
    };
    assert_eq!(
        fair(&data, &scene.partition()).unwrap_err().to_string(),
        "found views without a camera, expected a camera for every view: \
         the fair bound weighs what a picture does not show"
    );
}

/// Poses that are known exactly leave every object to its own measurements.
#[test]
fn without_pose_errors_objects_are_independent() {
    let scene = scene("small.json");
    let (mut views, measurements) = (scene.views(), scene.measurements());
    for view in &mut views {
        view.pose.sigma = PoseSigma::from_vector(Vector6::zeros());
    }
    let plane = LevelPlane::default();
    let problem = problem(&views, &measurements, &plane, 0.0);
    let whole = clairvoyant(&problem, &scene.partition()).unwrap();
    let one = scene.partition().objects().swap_remove(5);
    let alone = Partition {
        groups: vec![one.clone()],
        n_left_out: 0,
    };
    let alone = clairvoyant(&problem, &alone).unwrap();
    let found = whole.objects.iter().find(|o| o.label == one.label).unwrap();
    assert!(found.place.distance(alone.objects[0].place) < 1e-7);
    let covariance = found.covariance - alone.objects[0].covariance;
    assert!(covariance.amax() < 1e-9 && found.covariance.trace() > 1e-7);
    assert!(whole.poses.iter().all(|p| p.amax() < 1e-7));
}

/// A box says the width of what it shows, unless the picture's border cuts it.
#[test]
fn detections_become_measurements() {
    use rockmap::detection::{Aim, Detection, Mark, MarkSigma, PixelBox};
    use rockmap::project::{MarkNoise, Settings};
    let scene = scene("small.json");
    let views = scene.views();
    let settings = Settings {
        aim: Aim::BOTTOM,
        min_range_m: 0.0,
        max_range_m: 14.0,
        min_score: 0.5,
        noise: MarkNoise {
            pixel_px: 1.5,
            range_m: 0.1,
            bearing: 0.01,
        },
    };
    let detection = |x_min: f64, score: f64| Detection {
        image_id: "000".into(),
        det_id: "1".into(),
        class: None,
        score: Some(score),
        diameter_m: None,
        mark: Mark::Box(PixelBox {
            x_min,
            y_min: 100.0,
            x_max: x_min + 30.0,
            y_max: 140.0,
        }),
        range_m: None,
        sigma: MarkSigma {
            v_px: Some(3.0),
            ..MarkSigma::default()
        },
        file: 0,
        line: 2,
    };
    let measure =
        |x_min, score| Measurement::new(&detection(x_min, score), (7, &views[0]), &settings);
    let whole = measure(200.0, 0.9).unwrap();
    assert_eq!(whole.view, 7);
    assert_eq!(whole.log_size, Some(30f64.ln()));
    assert_eq!(whole.reading.values(), Vector3::new(215.0, 140.0, 0.0));
    assert_eq!(whole.reading.sigmas(), Vector3::new(1.5, 3.0, 1.0));
    assert_eq!(whole.reading.n_rows(), 2);
    assert_eq!(measure(-10.0, 0.9).unwrap().log_size, None);
    assert_eq!(
        measure(200.0, 0.4).unwrap_err().to_string(),
        "score 0.4 is below min_score = 0.5"
    );
}
