//! Data sets with recorded intermediate values.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector6};
use serde_json::Value;

use crate::adjust::{LevelPlane, Measurement, Problem, Reading};
use crate::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use crate::detection::{Cut, PixelBox, Side};
use crate::frame::{Pixel, RigidTransform, Rotation, Vector};
use crate::fuse::belief::algebra::{Square4, Square6};
use crate::fuse::belief::curve::Detectability;
use crate::fuse::belief::engine::{Edge, Engine, Normal};
use crate::fuse::belief::{BeliefSettings, PoseCorrection};
use crate::pose::{Pose, PoseSigma};
use crate::project::Range;
use crate::view::View;

/// A data set, a state of fusion of no special kind, and what each step makes of it.
pub(super) struct Recorded {
    root: Value,
    views: Vec<View>,
    measurements: Vec<Measurement>,
    pub(super) settings: BeliefSettings,
}

/// All numbers of a value, in their order.
pub(super) fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(n) => vec![n.as_f64().unwrap()],
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        other => panic!("numbers expected, not {other}"),
    }
}

pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

pub(super) fn index(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

pub(super) fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn array<const N: usize>(value: &Value) -> [f64; N] {
    numbers(value).try_into().unwrap()
}

/// A square matrix in the leading corner of one of four rows; ones on the rest of its diagonal.
pub(super) fn square4(value: &Value, rest: f64) -> Square4 {
    let rows: Vec<Vec<f64>> = list(value).iter().map(numbers).collect();
    let mut out = [[0.0; 4]; 4];
    for (i, row) in out.iter_mut().enumerate() {
        row[i] = rest;
    }
    for (i, row) in rows.iter().enumerate() {
        out[i][..row.len()].copy_from_slice(row);
    }
    out
}

pub(super) fn square6(value: &Value) -> Square6 {
    let rows: Vec<[f64; 6]> = list(value).iter().map(array).collect();
    rows.try_into().unwrap()
}

fn matrix3(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_slice(&numbers(value))
}

fn normal(value: &Value, otherwise: Normal) -> Normal {
    if value.is_null() {
        return otherwise;
    }
    let [mean, variance] = array(value);
    Normal { mean, variance }
}

fn camera(value: &Value) -> Camera {
    let size = |key: &str| u32::try_from(index(&value[key])).unwrap();
    let of = |key: &str| number(&value[key]);
    let intrinsics = Intrinsics {
        fx: of("fx"),
        fy: of("fy"),
        cx: of("cx"),
        cy: of("cy"),
    };
    let rotation = Rotation::from_matrix(matrix3(&value["rotation"]));
    let [x, y, z] = array(&value["translation"]);
    Camera {
        name: "mast".into(),
        width: size("width"),
        height: size("height"),
        lens: Lens::Pinhole(Pinhole::new(intrinsics).unwrap()),
        mount: Mount::from_transform(RigidTransform::new(rotation, Vector::new(x, y, z))),
        readout: None,
    }
}

fn view(value: &Value, camera: Option<Arc<Camera>>, sigma: PoseSigma) -> View {
    let rotation = Rotation::from_matrix(matrix3(&value["rotation"]));
    let [x, y, z] = array(&value["position"]);
    View {
        image_id: String::new(),
        listed: (String::new(), 0),
        time: None,
        platform: None,
        picture: None,
        camera,
        head: PanTilt::default(),
        pose: Pose {
            enu_from_body: RigidTransform::new(rotation, Vector::new(x, y, z)),
            sigma,
            has_heading: true,
        },
        enu_from_local: Rotation::identity(),
    }
}

fn measurement(value: &Value) -> Measurement {
    let ([a, b], [sa, sb]) = (array(&value["z"]), array(&value["sd"]));
    let log_px = value["log_px"].as_f64();
    let reading = if log_px.is_some() {
        Reading::Pixel {
            pixel: Pixel::new(a, b),
            sigma_px: Vector2::new(sa, sb),
            range: None,
        }
    } else {
        Reading::Bearing {
            bearing: a,
            is_azimuth: false,
            sigma: sa,
            range: Range {
                range_m: b,
                sigma_m: sb,
            },
        }
    };
    let is_cut = index(&value["cut"]) == 1;
    Measurement {
        view: index(&value["view"]),
        reading,
        log_size: None,
        bounds: log_px.map(|l| PixelBox {
            x_min: a - 0.5 * l.exp(),
            x_max: a + 0.5 * l.exp(),
            y_min: b - 0.5 * l.exp(),
            y_max: b + 0.5 * l.exp(),
        }),
        cut: if is_cut {
            Cut {
                across: Side::Lost,
                down: Side::Lost,
            }
        } else {
            Cut::NONE
        },
        class: 0,
        score: None,
    }
}

impl Recorded {
    pub(super) fn read(text: &str) -> Self {
        let root: Value = serde_json::from_str(text).unwrap();
        let given = &root["settings"];
        let sigma = PoseSigma::from_vector(Vector6::from(array::<6>(&given["sigma"])));
        let camera = (!root["camera"].is_null()).then(|| Arc::new(camera(&root["camera"])));
        Self {
            views: list(&root["views"])
                .iter()
                .map(|v| view(v, camera.clone(), sigma))
                .collect(),
            measurements: list(&root["looks"]).iter().map(measurement).collect(),
            settings: BeliefSettings {
                pose_correction: PoseCorrection::PerView,
                log_size_sigma: number(&given["log_size_sigma"]),
                shape: number(&given["shape"]),
                fov: number(&given["fov"]),
                ..BeliefSettings::default()
            },
            root,
        }
    }

    /// What a step made of the state.
    pub(super) fn step(&self, name: &str) -> &Value {
        let step = &self.root["steps"][name];
        assert!(!step.is_null(), "{name}");
        step
    }

    pub(super) fn times_s(&self) -> Vec<f64> {
        numbers(&self.root["times_s"])
    }

    /// Whether detections have sizes, and objects therefore a fourth unknown that is recorded.
    pub(super) fn has_sizes(&self) -> bool {
        !self.root["camera"].is_null()
    }

    /// How many unknowns of an object are recorded.
    pub(super) fn n_unknowns(&self) -> usize {
        if self.has_sizes() { 4 } else { 3 }
    }

    /// The rows of a detection that are recorded.
    pub(super) fn rows(&self) -> &'static [usize] {
        if self.has_sizes() {
            &[0, 1, 2]
        } else {
            &[0, 3]
        }
    }

    /// Fusion as it begins.
    pub(super) fn fresh(&self) -> Engine<'_> {
        let given = &self.root["settings"];
        let problem = Problem {
            views: &self.views,
            measurements: &self.measurements,
            surface: &LevelPlane {
                slope_east: 0.0,
                slope_north: 0.0,
            },
            height_sigma_m: number(&given["height_sigma_m"]),
            max_range_m: number(&given["max_range_m"]),
            min_range_m: 0.0,
        };
        let mut engine = Engine::new(&problem, &self.settings);
        assert_eq!(engine.looks.len(), self.measurements.len());
        // The other implementation knows no objects beyond the border, and takes the ranges as exact.
        engine.model.border = 0.0;
        engine.blur_m = (0.0, 0.0);
        engine
    }

    /// Fusion in the recorded state.
    pub(super) fn engine(&self) -> Engine<'_> {
        let mut engine = self.fresh();
        self.set_model(&mut engine);
        for (i, view) in list(&self.root["views"]).iter().enumerate() {
            engine.set_delta(i, array(&view["delta"]));
            engine.pose_cov[i] = square6(&view["cov"]);
            engine.volumes[i] = number(&view["volume"]);
        }
        for object in list(&self.root["objects"]) {
            let mut x = [0.0; 4];
            let at = numbers(&object["at"]);
            x[..at.len()].copy_from_slice(&at);
            engine.objects.push(x);
            // Without sizes nothing but the prior speaks of an object's size.
            let of_size = engine.model.size.variance;
            engine.object_cov.push(square4(&object["cov"], of_size));
            let class = engine.class_of(0);
            engine.classes.push(class);
        }
        for edge in list(&self.root["edges"]) {
            engine.edges.push(Edge {
                look: index(&edge[0]),
                object: index(&edge[1]),
                weight: number(&edge[2]),
            });
        }
        // Starts are warm: a few more steps than one call takes.
        for _ in 0..4 {
            engine.settle();
        }
        engine.weigh_background();
        engine
    }

    fn set_model(&self, engine: &mut Engine<'_>) {
        let given = &self.root["model"];
        let of = |key: &str| number(&given[key]);
        let model = &mut engine.model;
        model.scales = array(&given["scales"]);
        model.pose_scale = array(&given["pose_scale"]);
        model.height_variance = of("height_variance");
        model.size = normal(&given["size"], model.size);
        model.clutter_size = normal(&given["clutter_size"], model.clutter_size);
        model.clutter = of("clutter");
        model.transients = of("transients");
        model.density = of("density");
        let [low, high] = array(&given["bins"]);
        model.curve = Detectability::of(low, high, numbers(&given["curve"]));
        engine.area_m2 = of("area");
        engine.view_area_m2 = of("view_area");
    }

    /// The same with times.
    pub(super) fn timed(&self) -> Engine<'_> {
        let mut engine = self.engine();
        for (platform, time_s) in engine.platforms.iter_mut().zip(self.times_s()) {
            platform.time_s = Some(time_s);
        }
        engine
    }
}

/// Largest departure of numbers from recorded ones, relative to each or to one, whichever is more.
pub(super) fn assert_close(what: &str, found: &[f64], recorded: &Value, tolerance: f64) {
    let recorded = numbers(recorded);
    assert_eq!(found.len(), recorded.len(), "{what}");
    for (i, (f, r)) in found.iter().zip(&recorded).enumerate() {
        let off = (f - r).abs() / r.abs().max(1.0);
        assert!(off < tolerance, "{what}[{i}]: {f}, recorded {r}");
    }
}

/// The same of symmetric matrices, their rows scaled to ones on the diagonal.
pub(super) fn assert_matrix<const N: usize>(
    what: &str,
    found: &[[f64; N]; N],
    recorded: &Value,
    tolerance: f64,
) {
    let rows: Vec<Vec<f64>> = list(recorded).iter().map(numbers).collect();
    for (i, row) in rows.iter().enumerate() {
        for (j, r) in row.iter().enumerate() {
            let scale = (rows[i][i] * rows[j][j]).sqrt();
            let f = found[i][j];
            assert!(
                (f - r).abs() < tolerance * scale,
                "{what}[{i}][{j}]: {f}, recorded {r}"
            );
        }
    }
}

/// Steps of poses, by their standard deviations.
pub(super) fn assert_delta(
    what: &str,
    found: &[[f64; 6]],
    recorded: &Value,
    sigma: &Vector6<f64>,
    tolerance: f64,
) {
    for (view, (f, r)) in found.iter().zip(list(recorded)).enumerate() {
        let r: [f64; 6] = array(r);
        for i in 0..6 {
            let off = (f[i] - r[i]).abs() / sigma[i];
            assert!(
                off < tolerance,
                "{what}, view {view}, {i}: {}, recorded {}",
                f[i],
                r[i]
            );
        }
    }
}
