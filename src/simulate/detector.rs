//! What the detector makes of each image.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};
use rayon::prelude::*;

use crate::camera::Camera;
use crate::frame::{self, Enu, Pixel, Point, RigidTransform};

use super::field::Field;
use super::ground::Ground;
use super::random::{Purpose, normal, stream, uniform};
use super::rocks::Rock;
use super::scene::{Border, BoxExtent, Detector, Scene, ScoreLaw};
use super::traverse::View;

/// One box of the detector.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedDetection {
    /// Index of its view.
    pub view: usize,
    /// Index of its rock, `None` for a false alarm.
    pub rock: Option<usize>,
    /// Left, upper, right and lower edge, pixels.
    pub edges_px: [f64; 4],
    /// Its confidence.
    pub score: f64,
    /// One standard deviation of its aim point by each axis, pixels: larger where it is an outlier.
    pub sigma_px: f64,
}

/// A rock's box without the detector's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// The projection of the rock's point of the ground.
    pub centre: Pixel,
    /// Width of the box, pixels.
    pub width_px: f64,
    /// How far the body reaches above `centre`, pixels.
    pub above_px: f64,
    /// How far what stands out of the ground reaches below `centre`, pixels.
    pub below_px: f64,
    /// Ground range from the camera, metres.
    pub range_m: f64,
}

/// What a rock looks like to a camera, or `None` where the camera cannot see it whatever its range.
pub fn appearance(
    camera: &Camera,
    enu_from_camera: &RigidTransform<Enu, frame::Camera>,
    rock: &Rock,
) -> Option<Appearance> {
    let eye = enu_from_camera.origin();
    let to_rock = rock.place.xyz - eye.xyz;
    let ground_m = to_rock.xy().norm();
    let in_camera = enu_from_camera.inverse() * rock.place;
    let (centre, jacobian) = camera.pixel_with_jacobian(in_camera).ok()?;
    if !centre.is_inside(camera.width, camera.height) {
        return None;
    }
    // Pixels a metre across the line of sight, along the horizon.
    let across = Vector3::new(-to_rock.y, to_rock.x, 0.0) / ground_m.max(1e-9);
    let across_camera = enu_from_camera.rotation.inverse().matrix() * across;
    let px_per_m = (jacobian * across_camera).norm();
    let azimuth = across.y.atan2(across.x);
    // Pixels a diameter.
    let px = rock.diameter_m * px_per_m;
    let width_px = 2.0 * rock.shape.outline_support(azimuth) * px;
    let elevation = (-to_rock.z).atan2(ground_m);
    let sight = to_rock.y.atan2(to_rock.x);
    Some(Appearance {
        centre,
        width_px,
        above_px: 0.5 * rock.shape.box_height(elevation, sight) * px,
        below_px: elevation.sin().max(0.0) * rock.shape.outline_support(sight) * px,
        range_m: ground_m,
    })
}

/// All detections, and for every rock the number of views in whose picture and range it lies.
pub(super) fn detect(
    scene: &Scene,
    ground: &Ground,
    rocks: &[Rock],
    views: &[View],
) -> (Vec<SimulatedDetection>, Vec<usize>) {
    let field = Field::new(rocks);
    let per_view: Vec<(Vec<SimulatedDetection>, Vec<usize>)> = (0..views.len())
        .into_par_iter()
        .map(|view| detect_in(scene, ground, &field, view, &views[view]))
        .collect();
    let mut n_visible = vec![0; rocks.len()];
    let mut detections = Vec::new();
    for (found, visible) in per_view {
        detections.extend(found);
        for rock in visible {
            n_visible[rock] += 1;
        }
    }
    (detections, n_visible)
}

fn detect_in(
    scene: &Scene,
    ground: &Ground,
    field: &Field,
    index: usize,
    view: &View,
) -> (Vec<SimulatedDetection>, Vec<usize>) {
    let detector = &scene.detector;
    let camera = &scene.cameras[view.camera];
    let pose = view.enu_from_camera(scene);
    let mut rng = stream(scene.seed, Purpose::Detector, index);
    let mut found = Vec::new();
    let mut visible = Vec::new();
    let eye = pose.origin().xyz;
    for i in field.near(eye.x, eye.y, detector.max_range_m) {
        let Some(seen) = appearance(camera, &pose, &field.rocks()[i]) else {
            continue;
        };
        if !in_range(detector, seen.range_m) {
            continue;
        }
        visible.push(i);
        let chance =
            detector.p_max / (1.0 + (-(seen.width_px - detector.px50) / detector.px_width).exp());
        let noticed = uniform(&mut rng) < chance;
        if noticed && !field.is_hidden(i, pose.origin(), ground, detector.occlusion) {
            found.push(measured(detector, index, i, &seen, &mut rng));
        }
    }
    let mut rng = stream(scene.seed, Purpose::Clutter, index);
    let clutter = Clutter {
        scene,
        ground,
        camera,
        pose,
        index,
    };
    found.extend(clutter.draw(&mut rng));
    shuffle(&mut found, &mut rng);
    let size = [camera.width, camera.height].map(f64::from);
    let found = found
        .into_iter()
        .filter_map(|d| bordered(detector.border, d, size));
    (found.collect(), visible)
}

fn in_range(detector: &Detector, range_m: f64) -> bool {
    range_m >= detector.min_range_m && range_m < detector.max_range_m
}

/// A rock's box with the detector's noise.
fn measured(
    detector: &Detector,
    view: usize,
    rock: usize,
    seen: &Appearance,
    rng: &mut ChaCha8Rng,
) -> SimulatedDetection {
    let outlier = uniform(rng) < detector.outlier_share;
    let factor = if outlier {
        detector.outlier_factor
    } else {
        1.0
    };
    let sigma_px = detector.pixel_px * factor;
    let u = seen.centre.u + sigma_px * normal(rng);
    let v = seen.centre.v + sigma_px * normal(rng);
    let size = (detector.box_sigma * normal(rng)).exp();
    SimulatedDetection {
        view,
        rock: Some(rock),
        edges_px: seen.edges_px(detector.extent, u, v, size),
        score: score(detector.score_true, rng),
        sigma_px,
    }
}

impl Appearance {
    /// The edges (left, upper, right, lower) of the rock's box when its point of the ground is
    /// taken to be at (`u`, `v`) and its size `size` times the true one.
    fn edges_px(&self, extent: BoxExtent, u: f64, v: f64, size: f64) -> [f64; 4] {
        let (half, above) = (0.5 * self.width_px * size, self.above_px * size);
        let below = match extent {
            BoxExtent::Body => above,
            BoxExtent::Visible => self.below_px * size,
        };
        [u - half, v - above, u + half, v + below]
    }

    /// Where in the rock's box its point of the ground lies, as a share of the height from the top.
    pub fn aim(&self, extent: BoxExtent) -> f64 {
        match extent {
            BoxExtent::Body => 0.5,
            BoxExtent::Visible => self.above_px / (self.above_px + self.below_px),
        }
    }
}

/// A logit-normal score.
fn score(law: ScoreLaw, rng: &mut ChaCha8Rng) -> f64 {
    let logit = (law.median / (1.0 - law.median)).ln() + law.spread * normal(rng);
    1.0 / (1.0 + (-logit).exp())
}

/// Where false alarms are drawn.
struct Clutter<'a> {
    scene: &'a Scene,
    ground: &'a Ground,
    camera: &'a Camera,
    pose: RigidTransform<Enu, frame::Camera>,
    index: usize,
}

impl Clutter<'_> {
    /// False alarms uniform over the picture; those whose ground is out of range are dropped.
    fn draw(&self, rng: &mut ChaCha8Rng) -> Vec<SimulatedDetection> {
        let detector = &self.scene.detector;
        // A mean of zero is no Poisson law: there are none.
        let number = Poisson::new(detector.clutter_per_image).map_or(0.0, |p| p.sample(rng));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let number = number as u32;
        (0..number).filter_map(|_| self.one(rng)).collect()
    }

    fn one(&self, rng: &mut ChaCha8Rng) -> Option<SimulatedDetection> {
        let detector = &self.scene.detector;
        let u = f64::from(self.camera.width) * uniform(rng) - 0.5;
        let v = f64::from(self.camera.height) * uniform(rng) - 0.5;
        let width = detector.clutter_px * (detector.clutter_sigma * normal(rng)).exp();
        let score = score(detector.score_false, rng);
        let ray = self.pose * self.camera.ray(Pixel::new(u, v)).ok()?;
        let reach_m = 2.0 * detector.max_range_m.min(5e3) + 100.0;
        let distance = self.ground.first_hit_m(ray, reach_m)?;
        let place: Point<Enu> = ray.at(distance);
        if !in_range(detector, place.horizontal_distance(ray.origin)) {
            return None;
        }
        let (sin, cos) = (-ray.direction.xyz().z).asin().sin_cos();
        let seen = Appearance {
            centre: Pixel::new(u, v),
            width_px: width,
            above_px: width * (0.5 * sin).hypot(self.scene.rocks.height_ratio * cos),
            below_px: width * 0.5 * sin.max(0.0),
            range_m: place.horizontal_distance(ray.origin),
        };
        Some(SimulatedDetection {
            view: self.index,
            rock: None,
            edges_px: seen.edges_px(detector.extent, u, v, 1.0),
            score,
            sigma_px: detector.pixel_px,
        })
    }
}

/// Fisher and Yates: the order of the boxes says nothing about what they are.
fn shuffle(found: &mut [SimulatedDetection], rng: &mut ChaCha8Rng) {
    for last in (1..found.len()).rev() {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a share of a small number"
        )]
        let other = (uniform(rng) * (last + 1) as f64) as usize;
        found.swap(last, other.min(last));
    }
}

/// What becomes of a box at the border of a picture of this size; `None` where nothing is left.
fn bordered(
    border: Border,
    mut found: SimulatedDetection,
    [width, height]: [f64; 2],
) -> Option<SimulatedDetection> {
    let [x_min, y_min, x_max, y_max] = found.edges_px;
    let inside = x_min >= -0.5 && y_min >= -0.5 && x_max <= width - 0.5 && y_max <= height - 0.5;
    match border {
        Border::Keep => Some(found),
        Border::Drop => inside.then_some(found),
        Border::Clip => {
            found.edges_px = [
                x_min.max(-0.5),
                y_min.max(-0.5),
                x_max.min(width - 0.5),
                y_max.min(height - 0.5),
            ];
            let [x_min, y_min, x_max, y_max] = found.edges_px;
            (x_max > x_min && y_max > y_min).then_some(found)
        }
    }
}
