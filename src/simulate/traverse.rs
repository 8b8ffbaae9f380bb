//! Where the platforms stand, when, and where their poses say they stand.

use nalgebra::{Matrix3, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;

use crate::camera::PanTilt;
use crate::frame::{self, Body, Enu, Point, RigidTransform, Rotation, Vector};

use super::ground::Ground;
use super::random::{Purpose, normal, stream};
use super::scene::{Path, Platform, PoseKey, PosePlan, Scene};

/// One image of the traverse.
#[derive(Debug, Clone)]
pub struct View {
    /// Its name.
    pub image_id: String,
    /// Index of its platform in [`Scene::platforms`].
    pub platform: usize,
    /// Index of its camera in [`Scene::cameras`].
    pub camera: usize,
    /// The station of its platform, from 0.
    pub station: usize,
    /// Seconds since 1970.
    pub time_s: f64,
    /// The head's angles, where the log is keyed by time; zero where the pan is part of the pose.
    pub head: PanTilt,
    /// The pose it was taken from.
    pub enu_from_body: RigidTransform<Enu, Body>,
    /// The pose the log gives.
    pub measured: RigidTransform<Enu, Body>,
}

impl View {
    /// The true pose of the camera.
    pub fn enu_from_camera(&self, scene: &Scene) -> RigidTransform<Enu, frame::Camera> {
        let mount = &scene.cameras[self.camera].mount;
        self.enu_from_body * mount.body_from_camera(self.head)
    }

    /// The error of the measured pose, as poses err: true minus measured position in ENU, metres,
    /// and the rotation vector `delta` of `R_true = R_measured Exp(delta)` in body axes, radians.
    pub fn pose_error(&self) -> Vector6<f64> {
        let shift = self.enu_from_body.translation - self.measured.translation;
        let turn = self.measured.rotation.inverse() * self.enu_from_body.rotation;
        let turn = turn.quaternion().scaled_axis();
        Vector6::new(
            shift.xyz.x,
            shift.xyz.y,
            shift.xyz.z,
            turn.x,
            turn.y,
            turn.z,
        )
    }
}

/// All views of the scene, platform by platform in the order of time.
pub(super) fn traverse(scene: &Scene, ground: &Ground) -> Vec<View> {
    let platforms = scene.platforms.iter().enumerate();
    platforms
        .flat_map(|(index, platform)| platform_views(scene, ground, index, platform))
        .collect()
}

fn platform_views(scene: &Scene, ground: &Ground, index: usize, platform: &Platform) -> Vec<View> {
    let mut errors = PoseErrors::new(scene, index);
    let mut views: Vec<View> = Vec::new();
    for station in 0..platform.stations {
        errors.next_station();
        #[expect(clippy::cast_precision_loss, reason = "far fewer stations than 2^53")]
        let (place, left) = at_station(platform, station as f64);
        #[expect(clippy::cast_precision_loss, reason = "far fewer stations than 2^53")]
        let mut time_s = platform.start_s + platform.station_s * station as f64;
        for &pan in &platform.pans {
            let (head, body_left) = match scene.poses.key {
                PoseKey::Image => (PanTilt::default(), left - pan),
                PoseKey::Time => (PanTilt { pan, tilt: 0.0 }, left),
            };
            let enu_from_body = stand(platform, ground, place, body_left);
            // The cameras of a platform take their pictures at once: their pose is one.
            let measured = errors.measure(&enu_from_body);
            for &camera in &platform.cameras {
                views.push(View {
                    image_id: format!("{}_{:04}", platform.name, views.len()),
                    platform: index,
                    camera,
                    station,
                    time_s,
                    head,
                    measured,
                    enu_from_body,
                });
            }
            time_s += platform.pan_s;
        }
    }
    views
}

/// East and north of a station, metres, and the heading there, counter-clockwise from east.
fn at_station(platform: &Platform, station: f64) -> ([f64; 2], f64) {
    let x = platform.spacing_m * station;
    match &platform.path {
        Path::Line {
            start_m,
            azimuth,
            sway_m,
            sway_scale_m,
            yaw_sway,
            yaw_sway_scale_m,
        } => {
            let (sin, cos) = azimuth.sin_cos();
            let left = sway_m * (x / sway_scale_m).sin();
            let place = [
                start_m[0] + x * sin - left * cos,
                start_m[1] + x * cos + left * sin,
            ];
            let heading = std::f64::consts::FRAC_PI_2 - azimuth;
            (place, heading + yaw_sway * (x / yaw_sway_scale_m).sin())
        }
        Path::Waypoints(places) => along(places, x),
    }
}

/// The place `x` metres along the legs, and its heading; the last leg goes on for ever.
fn along(places: &[[f64; 2]], mut x: f64) -> ([f64; 2], f64) {
    let last = places.len().saturating_sub(2);
    for (i, leg) in places.windows(2).enumerate() {
        let (east, north) = (leg[1][0] - leg[0][0], leg[1][1] - leg[0][1]);
        let length = east.hypot(north);
        if x <= length || i == last {
            let share = if length > 0.0 { x / length } else { 0.0 };
            let place = [leg[0][0] + east * share, leg[0][1] + north * share];
            return (place, north.atan2(east));
        }
        x -= length;
    }
    (places.first().copied().unwrap_or([0.0; 2]), 0.0)
}

/// The pose of a body that stands on the ground at a place, its heading counter-clockwise from
/// east.
fn stand(
    platform: &Platform,
    ground: &Ground,
    [east, north]: [f64; 2],
    left: f64,
) -> RigidTransform<Enu, Body> {
    let foot = ground.point(east, north);
    let up = if platform.follows_ground {
        let slope = ground.slope_at(east, north);
        Vector3::new(-slope[0], -slope[1], 1.0).normalize()
    } else {
        Vector3::z()
    };
    let heading = Vector3::new(left.cos(), left.sin(), 0.0);
    let forward = (heading - up * heading.dot(&up)).normalize();
    let axes = Matrix3::from_columns(&[forward, up.cross(&forward), up]);
    let origin = Point::<Enu>::from_xyz(foot.xyz + up * platform.height_m);
    RigidTransform::new(Rotation::from_matrix(axes), Vector::from_xyz(origin.xyz))
}

/// The errors of one platform's poses: a share that drifts from station to station as an
/// Ornstein-Uhlenbeck process, and the rest, new with every view.
struct PoseErrors<'a> {
    plan: &'a PosePlan,
    drift: Vector6<f64>,
    stations: usize,
    drift_rng: ChaCha8Rng,
    jitter_rng: ChaCha8Rng,
}

impl<'a> PoseErrors<'a> {
    fn new(scene: &'a Scene, platform: usize) -> Self {
        Self {
            plan: &scene.poses,
            drift: Vector6::zeros(),
            stations: 0,
            drift_rng: stream(scene.seed, Purpose::Drift, platform),
            jitter_rng: stream(scene.seed, Purpose::Jitter, platform),
        }
    }

    fn next_station(&mut self) {
        let new = Vector6::from_fn(|_, _| normal(&mut self.drift_rng));
        // Stationary from the first station on.
        let keep = if self.stations == 0 {
            0.0
        } else {
            (-1.0 / self.plan.drift_stations).exp()
        };
        self.drift = self.drift * keep + new * (1.0 - keep * keep).sqrt();
        self.stations += 1;
    }

    /// The pose the log gives for a true one.
    fn measure(&mut self, pose: &RigidTransform<Enu, Body>) -> RigidTransform<Enu, Body> {
        let s = self.plan.sigma.scaled(self.plan.scale);
        let sigma = Vector6::new(s.east_m, s.north_m, s.up_m, s.roll, s.pitch, s.yaw);
        let jitter = Vector6::from_fn(|_, _| normal(&mut self.jitter_rng));
        let drift = self.plan.drift_share;
        let unit = self.drift * drift.sqrt() + jitter * (1.0 - drift).sqrt();
        let error = unit.component_mul(&sigma);
        // R_true = R_measured Exp(delta), so R_measured = R_true Exp(-delta).
        let rotation = pose
            .rotation
            .perturbed(-error.fixed_rows::<3>(3).into_owned());
        let shift = Vector::from_xyz(error.fixed_rows::<3>(0).into_owned());
        RigidTransform::new(rotation, pose.translation - shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(text: &str) -> Scene {
        Scene::parse(text, "scene.toml").unwrap()
    }

    fn views(scene: &Scene) -> Vec<View> {
        let ground = Ground::new(&scene.site, &scene.ground, scene.seed);
        traverse(scene, &ground)
    }

    #[test]
    fn pose_errors_have_their_sigmas_and_the_drift_its_correlation() {
        let scene = scene(
            "[poses]\nscale = 2\ndrift_share = 0.8\ndrift_stations = 5\n\
             [platforms.r]\nstations = 40000\nspacing_m = 0\npans_deg = [0]\n",
        );
        let errors: Vec<Vector6<f64>> = views(&scene).iter().map(View::pose_error).collect();
        let sigma = [0.1, 0.1, 0.04, 0.5, 0.5, 0.8].map(|s: f64| s);
        let lag = |axis: usize, lag: usize| {
            let pairs = errors.iter().zip(&errors[lag..]);
            let unit = if axis < 3 { 1.0 } else { 1f64.to_radians() };
            let s = sigma[axis] * unit;
            pairs.map(|(a, b)| a[axis] * b[axis] / (s * s)).sum::<f64>() / 4e4
        };
        for axis in 0..6 {
            // 40000 stations correlated over 5 hold about 8000 independent ones: 1.6 % a variance.
            assert!((lag(axis, 0) - 1.0).abs() < 0.07, "{}", lag(axis, 0));
            for steps in [1u32, 5, 10] {
                let expected = 0.8 * (-f64::from(steps) / 5.0).exp();
                let found = lag(axis, steps as usize);
                assert!((found - expected).abs() < 0.07, "{found} {expected}");
            }
        }
    }

    #[test]
    fn the_default_traverse_is_the_one_documented() {
        let views = views(&scene("[poses]\nscale = 0\n"));
        assert_eq!(views.len(), 45);
        let last = &views[44];
        let place = last.enu_from_body.translation.xyz;
        assert!((place.x - 28.0).abs() < 1e-9);
        assert!((place.y - 0.3 * (28.0 / 5.0f64).sin()).abs() < 1e-9);
        // A pan of -30 degrees clockwise looks 30 degrees to the left.
        let forward = last.enu_from_body.rotation * Vector::<Body>::new(1.0, 0.0, 0.0);
        let left = forward.xyz.y.atan2(forward.xyz.x);
        let expected = 30f64.to_radians() + 0.1 * (28.0 / 7.0f64).sin();
        assert!((left - expected).abs() < 1e-12);
        assert_eq!(last.image_id, "rover_0044");
        assert_eq!(last.station, 14);
    }

    #[test]
    fn waypoints_turn_the_rover() {
        let places = [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]];
        let (place, heading) = along(&places, 5.0);
        assert!((place[0] - 3.0).abs() < 1e-12 && (place[1] - 2.0).abs() < 1e-12);
        assert!((heading - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}
