//! Views and detections as fusion's loops read them.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3, Vector6};

use super::algebra::{Square6, from_matrix};
use super::cut::{Left, Shape};
use super::{BeliefSettings, SizeRule};
use crate::adjust::{Measurement, Problem, Reading};
use crate::camera::{Camera, Lens};
use crate::frame::{Body, LocalEnu, Pixel, RigidTransform, Vector};
use crate::view::View;

/// Standard deviations of poses that are taken as exact, metres and radians.
const EXACT: f64 = 1e-6;

/// What of a view does not change.
#[derive(Debug, Clone)]
pub(super) struct Platform {
    pub(super) camera: Option<Arc<Camera>>,
    /// Whether its picture is so wide that a metre looks as wide all around it.
    pub(super) is_wide: bool,
    /// Cosine of an angle off the optical axis beyond which nothing comes near the picture; -1
    /// where no such angle is known.
    pub(super) least_cosine: f64,
    pub(super) body_from_camera: Matrix3<f64>,
    /// The camera's centre in body axes; the body's origin where there is none.
    pub(super) arm: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    pub(super) position: Vector3<f64>,
    /// East, north and up at the platform itself, in the site's axes.
    pub(super) local: Matrix3<f64>,
    /// Standard deviations of the six errors of its pose.
    pub(super) sigma: Vector6<f64>,
    /// Seconds, where all views have a time.
    pub(super) time_s: Option<f64>,
    /// Bearings it could have detected at, radians, where there is no camera.
    pub(super) sector: (f64, f64),
    /// Whether its bearings count from true north.
    pub(super) is_azimuth: bool,
    /// The number of its sensor, whose views share biases.
    pub(super) sensor: usize,
}

/// Which numbers a detection reads, in the order of the four rows: column or bearing, row, logarithm
/// of apparent size, slant range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Look {
    pub(super) view: usize,
    /// Index of the measurement.
    pub(super) measurement: usize,
    pub(super) values: [f64; 4],
    /// Standard deviations; ones of rows it does not have.
    pub(super) sigmas: [f64; 4],
    pub(super) has: [bool; 4],
    /// One more than its last row.
    pub(super) n: usize,
    /// Logarithm of the apparent size in pixels, where there is one.
    pub(super) log_px: Option<f64>,
    /// The aim point of the mark, where it is one.
    pub(super) mark: [f64; 2],
    /// What the picture's border leaves of the mark, where it cuts it.
    pub(super) left: Option<Left>,
    pub(super) class: usize,
    /// Logit of the detector's score.
    pub(super) logit: Option<f64>,
}

impl Look {
    /// How many numbers it reads.
    pub(super) fn n_rows(&self) -> f64 {
        self.has.iter().map(|&h| f64::from(u8::from(h))).sum()
    }

    pub(super) fn is_bearing(&self) -> bool {
        !self.has[1]
    }
}

/// The views in the order they are taken in: by platform and time.
pub(super) fn order(views: &[View]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.sort_by(|&a, &b| {
        let key = |v: usize| (views[v].platform.as_deref(), views[v].time);
        key(a).cmp(&key(b)).then(a.cmp(&b))
    });
    order
}

pub(super) fn platforms(problem: &Problem<'_>, order: &[usize], fov: f64) -> Vec<Platform> {
    let times: Vec<Option<f64>> = times(problem.views);
    let by_azimuth = azimuth_views(problem);
    let sensors = super::bias::sensors(problem, order);
    let place = |(&index, sensor): (&usize, usize)| {
        let view = &problem.views[index];
        let mount = view
            .body_from_camera()
            .unwrap_or_else(RigidTransform::<Body, crate::frame::Camera>::identity);
        let camera = view.camera.clone();
        Platform {
            is_wide: camera.as_deref().is_some_and(is_wide),
            least_cosine: camera.as_deref().map_or(-1.0, least_cosine),
            camera,
            body_from_camera: mount.rotation.matrix(),
            arm: mount.translation.xyz,
            rotation: view.pose.enu_from_body.rotation.matrix(),
            position: view.pose.enu_from_body.translation.xyz,
            local: view.enu_from_local.matrix(),
            sigma: view.pose.sigma.to_vector().map(|s| s.max(EXACT)),
            time_s: times[index],
            sector: if by_azimuth[index] {
                (-PI, PI)
            } else {
                (-0.5 * fov, 0.5 * fov)
            },
            is_azimuth: by_azimuth[index],
            sensor,
        }
    };
    order.iter().zip(sensors).map(place).collect()
}

fn is_wide(camera: &Camera) -> bool {
    matches!(
        camera.lens,
        Lens::Fisheye(_) | Lens::Equirectangular(_) | Lens::Cahvore(_)
    )
}

/// Cosine of the angle off the axis that holds the picture with half a picture around it, and a
/// tenth more; -1 where the lens says no rays that far out.
fn least_cosine(camera: &Camera) -> f64 {
    const SIDE: u32 = 32;
    const MORE: f64 = 1.1;
    if is_wide(camera) {
        return -1.0;
    }
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let mut most = 0.0f64;
    for i in 0..=SIDE {
        let share = 2.0 * f64::from(i) / f64::from(SIDE) - 0.5;
        let (u, v) = (share * width - 0.5, share * height - 0.5);
        let (left, right) = (-0.5 * width - 0.5, 1.5 * width - 0.5);
        let (top, bottom) = (-0.5 * height - 0.5, 1.5 * height - 0.5);
        for (u, v) in [(left, v), (right, v), (u, top), (u, bottom)] {
            let Ok(ray) = camera.ray(Pixel::new(u, v)) else {
                return -1.0;
            };
            most = most.max(ray.direction.xyz().z.clamp(-1.0, 1.0).acos());
        }
    }
    (MORE * most).min(PI).cos()
}

/// Seconds since the first view, if every view has a time.
fn times(views: &[View]) -> Vec<Option<f64>> {
    let first = views.iter().filter_map(|v| v.time).min();
    let all = views.iter().all(|v| v.time.is_some());
    let since = |view: &View| Some(view.time?.seconds_since(first?));
    views
        .iter()
        .map(|v| if all { since(v) } else { None })
        .collect()
}

fn azimuth_views(problem: &Problem<'_>) -> Vec<bool> {
    let mut is_azimuth = vec![false; problem.views.len()];
    for m in problem.measurements {
        if let Reading::Bearing {
            is_azimuth: true, ..
        } = m.reading
        {
            is_azimuth[m.view] = true;
        }
    }
    is_azimuth
}

/// The detections by view, in the order of the views.
pub(super) fn looks(
    problem: &Problem<'_>,
    order: &[usize],
    settings: &BeliefSettings,
    shape: &Shape,
) -> Vec<Look> {
    let mut rank = vec![0; order.len()];
    for (i, &view) in order.iter().enumerate() {
        rank[view] = i;
    }
    let measurements = problem.measurements.iter().enumerate();
    let mut looks: Vec<Look> = measurements
        .map(|(i, m)| look(i, m, rank[m.view], settings, shape))
        .collect();
    looks.sort_by_key(|look| (look.view, look.measurement));
    looks
}

fn look(
    index: usize,
    m: &Measurement,
    view: usize,
    settings: &BeliefSettings,
    shape: &Shape,
) -> Look {
    let (mut values, mut sigmas, mut has) = ([0.0; 4], [1.0; 4], [false; 4]);
    let mut set = |row: usize, value: f64, sigma: f64| {
        values[row] = value;
        sigmas[row] = sigma;
        has[row] = true;
    };
    let (mut log_px, mut left, mut mark) = (None, None, [0.0; 2]);
    let range_of;
    match m.reading {
        Reading::Pixel {
            pixel,
            sigma_px,
            range,
        } => {
            mark = [pixel.u, pixel.v];
            left = m
                .bounds
                .and_then(|b| Left::of(m.cut, b, shape, settings.size_rule));
            let [u, v] = left.map_or(mark, |left| left.ends(mark));
            set(0, u, sigma_px.x);
            set(1, v, sigma_px.y);
            range_of = range;
            log_px = apparent_size(m, settings.size_rule);
            if let Some(l) = log_px {
                let l = left.map_or(l, |left| left.log_size(l));
                set(2, l, settings.log_size_sigma);
            }
        }
        Reading::Bearing {
            bearing,
            sigma,
            range,
            ..
        } => {
            set(0, bearing, sigma);
            range_of = Some(range);
        }
    }
    if let Some(range) = range_of {
        set(3, range.range_m, range.sigma_m);
    }
    let n = 1 + (0..4).rev().find(|&r| has[r]).unwrap_or(0);
    Look {
        view,
        measurement: index,
        values,
        sigmas,
        has,
        n,
        log_px,
        mark,
        left,
        class: m.class,
        logit: m.score.filter(|_| settings.scores).map(logit),
    }
}

fn apparent_size(m: &Measurement, rule: SizeRule) -> Option<f64> {
    let bounds = m.bounds?;
    let px = match rule {
        SizeRule::Width => bounds.width(),
        SizeRule::Height => bounds.height(),
    };
    (px > 0.0).then(|| px.ln())
}

/// The logit of a score, finite at its ends.
fn logit(score: f64) -> f64 {
    let s = score.clamp(1e-3, 1.0 - 1e-3);
    (s / (1.0 - s)).ln()
}

/// A view's pose as it is believed.
#[derive(Debug, Clone)]
pub(super) struct PoseNow {
    pub(super) rotation: Matrix3<f64>,
    pub(super) position: Vector3<f64>,
    /// Site axes from camera axes.
    pub(super) from_camera: Matrix3<f64>,
    /// Where the view looks from.
    pub(super) origin: Vector3<f64>,
    /// `d Exp(r) = Exp(r) [J dr]x`.
    pub(super) right_jacobian: Matrix3<f64>,
}

impl Platform {
    /// The pose with the error added that is believed of it.
    pub(super) fn at(&self, delta: &[f64; 6]) -> PoseNow {
        let turn = Vector3::new(delta[3], delta[4], delta[5]);
        let rotation = self.rotation * nalgebra::Rotation3::new(turn).matrix();
        let position = self.position + Vector3::new(delta[0], delta[1], delta[2]);
        PoseNow {
            rotation,
            position,
            from_camera: rotation * self.body_from_camera,
            origin: position + rotation * self.arm,
            right_jacobian: crate::adjust::right_jacobian(turn),
        }
    }

    /// Covariance of the pose as measured, with the standard deviations scaled.
    pub(super) fn prior(&self, scale: &[f64; 6]) -> Square6 {
        from_matrix(&nalgebra::Matrix6::from_diagonal(&Vector6::from_fn(
            |i, _| (self.sigma[i] * scale[i]).powi(2),
        )))
    }

    /// The level direction of a bearing in the site's axes.
    pub(super) fn along(&self, pose: &PoseNow, bearing: f64) -> Vector3<f64> {
        let (sin, cos) = bearing.sin_cos();
        if self.is_azimuth {
            self.local * Vector::<LocalEnu>::new(sin, cos, 0.0).xyz
        } else {
            pose.rotation * Vector3::new(cos, -sin, 0.0)
        }
    }
}
