//! Where the rocks of a scene lie, and what shape they have.
//!
//! A rock is the part of an ellipsoid within a few planes (its facets) that stands out of the
//! ground. The body's centre is the rock's point of the ground, so it is half buried, and its
//! outline on the ground is symmetric about that point: the silhouette's left and right extremes
//! lie as far from the point's projection, from wherever it is seen. Facets above the ground never
//! reach the outline. **Its box** is that of the whole body, the buried half included: centred on
//! the projection of the ground point, as wide as the silhouette, and as high as the body with its
//! buried half.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};
use rand_chacha::ChaCha8Rng;

use crate::frame::{Enu, Point};

use super::ground::Ground;
use super::random::{Purpose, normal, stream, uniform};
use super::scene::{Clusters, RockPlan, Scene};

/// A rock of the scene.
#[derive(Debug, Clone)]
pub struct Rock {
    /// Its name in `truth.csv` and `labels.csv`.
    pub object_id: String,
    /// Its point of the ground, at the body's centre.
    pub place: Point<Enu>,
    /// Its mean width, metres.
    pub diameter_m: f64,
    /// Its form.
    pub shape: Shape,
}

/// The form of a rock of unit mean width: half-axes and planes about its centre, east-north-up.
#[derive(Debug, Clone)]
pub struct Shape {
    /// Half-axes of the ellipsoid: long, short, vertical.
    pub half_axes: Vector3<f64>,
    /// Unit vector of the long axis, by east and north.
    pub long_axis: [f64; 2],
    /// Height of the body above its centre.
    pub top: f64,
    /// Outward unit normals of the facets and their distances from the centre.
    pub facets: Vec<(Vector3<f64>, f64)>,
    /// Half of the outline on the ground; the other half is its mirror image in the centre.
    outline: Vec<Vector2<f64>>,
}

/// No rock is lower than this share of the scene's height ratio.
const LOWEST_TOP: f64 = 0.75;

impl Shape {
    fn new(plan: &RockPlan, rng: &mut ChaCha8Rng) -> Self {
        let irregularity = plan.irregularity;
        // Elongation keeps the product of the half-axes, so that the mean width stays about one.
        let elongation = 1.0 + 0.5 * irregularity * uniform(rng);
        let (sin, cos) = (PI * uniform(rng)).sin_cos();
        let top = plan.height_ratio * (1.0 + irregularity * (uniform(rng) - 0.5) * 1.2);
        let top = top.clamp(LOWEST_TOP * plan.height_ratio * 0.5, 1.0);
        let mut shape = Self {
            half_axes: Vector3::new(0.5 * elongation.sqrt(), 0.5 / elongation.sqrt(), top),
            long_axis: [cos, sin],
            top,
            facets: Vec::new(),
            outline: Vec::new(),
        };
        if irregularity > 0.0 {
            shape.cut_outline(irregularity, rng);
        }
        shape.trace_outline();
        shape.widen();
        if irregularity > 0.0 {
            shape.cut_facets(irregularity, rng);
        }
        shape
    }

    /// Vertical facets in opposite pairs: the outline loses its roundness and keeps its symmetry.
    fn cut_outline(&mut self, irregularity: f64, rng: &mut ChaCha8Rng) {
        let first = uniform(rng) * PI;
        for pair in 0..3u32 {
            let azimuth = first + PI / 3.0 * (f64::from(pair) + 0.5 * (uniform(rng) - 0.5));
            let normal = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
            let depth = 1.0 - 0.22 * irregularity * uniform(rng);
            let distance = self.ellipsoid_support(normal) * depth;
            self.facets.push((normal, distance));
            self.facets.push((-normal, distance));
        }
    }

    /// Sloping facets and a top, each between the outline, which it must not cut, and the
    /// ellipsoid's surface.
    fn cut_facets(&mut self, irregularity: f64, rng: &mut ChaCha8Rng) {
        // The ellipsoid reaches higher than the rock, whose top is cut off it.
        self.half_axes.z = self.top * (1.0 + 0.35 * irregularity);
        let number = 6u32;
        let first = uniform(rng) * TAU;
        for i in 0..number {
            let step = TAU / f64::from(number);
            let azimuth = first + step * (f64::from(i) + 0.8 * (uniform(rng) - 0.5));
            let elevation = (0.25 + 0.9 * uniform(rng)).min(1.2);
            let (sin, cos) = elevation.sin_cos();
            let normal = Vector3::new(cos * azimuth.cos(), cos * azimuth.sin(), sin);
            let inner = cos * self.outline_support(azimuth);
            let outer = self.ellipsoid_support(normal);
            let depth = irregularity * (0.25 + 0.6 * uniform(rng));
            self.facets.push((normal, outer - (outer - inner) * depth));
        }
        let (tilt, azimuth) = (0.25 * irregularity * uniform(rng), TAU * uniform(rng));
        let cap = Vector3::new(
            tilt.sin() * azimuth.cos(),
            tilt.sin() * azimuth.sin(),
            tilt.cos(),
        );
        let inner = tilt.sin() * self.outline_support(azimuth);
        self.facets.push((cap, (self.top * tilt.cos()).max(inner)));
    }

    /// How far the uncut ellipsoid reaches along a unit vector.
    fn ellipsoid_support(&self, n: Vector3<f64>) -> f64 {
        let [cos, sin] = self.long_axis;
        let along = n.x * cos + n.y * sin;
        let across = n.y * cos - n.x * sin;
        let a = self.half_axes;
        Vector3::new(a.x * along, a.y * across, a.z * n.z).norm()
    }

    /// How far the outline on the ground reaches along a horizontal direction, its azimuth
    /// counter-clockwise from east: half the silhouette's width across it, in diameters.
    pub fn outline_support(&self, azimuth: f64) -> f64 {
        let direction = Vector2::new(azimuth.cos(), azimuth.sin());
        let reach = self.outline.iter().map(|p| p.dot(&direction).abs());
        reach.fold(0.0, f64::max)
    }

    /// Scales the outline to a mean width of one, which the cuts have taken from.
    fn widen(&mut self) {
        let number = f64::from(u32::try_from(self.outline.len()).unwrap_or(1));
        let mean = self.outline.iter().map(|p| {
            // Of the outline's own directions: evenly spread over half a turn.
            self.outline_support(p.y.atan2(p.x))
        });
        let factor = 0.5 * number / mean.sum::<f64>();
        self.half_axes.x *= factor;
        self.half_axes.y *= factor;
        self.facets.iter_mut().for_each(|f| f.1 *= factor);
        self.outline.iter_mut().for_each(|p| *p *= factor);
    }

    fn trace_outline(&mut self) {
        const SAMPLES: u32 = 96;
        let sample = |i| {
            let (sin, cos) = (PI * f64::from(i) / f64::from(SAMPLES)).sin_cos();
            let out = Vector2::new(cos, sin);
            out * self.outline_radius(out)
        };
        self.outline = (0..SAMPLES).map(sample).collect();
    }

    /// The outline's radius along a horizontal unit vector, in diameters.
    fn outline_radius(&self, out: Vector2<f64>) -> f64 {
        let [cos, sin] = self.long_axis;
        let along = (out.x * cos + out.y * sin) / self.half_axes.x;
        let across = (out.y * cos - out.x * sin) / self.half_axes.y;
        let ellipse = 1.0 / along.hypot(across);
        let vertical = self.facets.iter().filter(|(n, _)| n.z == 0.0);
        vertical
            .map(|(n, distance)| (distance, n.xy().dot(&out)))
            .filter(|&(_, toward)| toward > 0.0)
            .fold(ellipse, |r, (distance, toward)| r.min(distance / toward))
    }

    /// Height of the box in diameters, seen from an elevation above the rock's horizon along a
    /// horizontal direction whose azimuth counts counter-clockwise from east, radians: no part of
    /// the body, its buried half included, reaches beyond.
    pub fn box_height(&self, elevation: f64, azimuth: f64) -> f64 {
        let (sin, cos) = elevation.sin_cos();
        let depth = sin * self.outline_support(azimuth);
        let round = depth.hypot(cos * self.half_axes.z);
        // The top may be cut off the ellipsoid.
        2.0 * round.min(depth + cos * self.top)
    }
}

/// The scene's rocks on its ground.
pub(super) fn scatter(scene: &Scene, ground: &Ground) -> Vec<Rock> {
    let plan = &scene.rocks;
    let mut rng = stream(scene.seed, Purpose::Rocks, 0);
    let diameters = plan.diameter.draw(plan.number, &mut rng);
    let parents = parents(plan, &mut rng);
    let mut deviations = stream(scene.seed, Purpose::Deviation, 0);
    let mut rocks: Vec<Rock> = Vec::with_capacity(plan.number);
    // The largest find their places first where they must not overlap.
    let mut order: Vec<usize> = (0..plan.number).collect();
    if !plan.overlap {
        order.sort_by(|&a, &b| diameters[b].total_cmp(&diameters[a]).then(a.cmp(&b)));
    }
    for (i, &drawn) in order.iter().enumerate() {
        let diameter_m = diameters[drawn];
        let [east, north] = free_place(plan, &parents, diameter_m, &rocks, &mut rng);
        let mut place = ground.point(east, north);
        place.xyz.z += scene.ground.rock_deviation_m * normal(&mut deviations);
        rocks.push(Rock {
            object_id: format!("rock_{:04}", i + 1),
            place,
            diameter_m,
            shape: Shape::new(plan, &mut stream(scene.seed, Purpose::Shape, i)),
        });
    }
    rocks
}

fn parents(plan: &RockPlan, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let number = plan.clusters.map_or(0, |c| c.parents);
    (0..number).map(|_| uniform_place(plan, rng)).collect()
}

fn uniform_place(plan: &RockPlan, rng: &mut ChaCha8Rng) -> [f64; 2] {
    let a = plan.area;
    [
        a.west_m + (a.east_m - a.west_m) * uniform(rng),
        a.south_m + (a.north_m - a.south_m) * uniform(rng),
    ]
}

/// A place of the plan where the rock overlaps none, or any after many tries.
fn free_place(
    plan: &RockPlan,
    parents: &[[f64; 2]],
    diameter_m: f64,
    rocks: &[Rock],
    rng: &mut ChaCha8Rng,
) -> [f64; 2] {
    const TRIES: u32 = 200;
    let mut place = any_place(plan, parents, rng);
    for _ in 0..TRIES {
        let free = plan.overlap
            || rocks.iter().all(|r| {
                let gap = (r.place.xyz.x - place[0]).hypot(r.place.xyz.y - place[1]);
                gap > 0.6 * (r.diameter_m + diameter_m)
            });
        if free {
            break;
        }
        place = any_place(plan, parents, rng);
    }
    place
}

fn any_place(plan: &RockPlan, parents: &[[f64; 2]], rng: &mut ChaCha8Rng) -> [f64; 2] {
    const TRIES: u32 = 200;
    let Some(Clusters { sigma_m, share, .. }) = plan.clusters else {
        return uniform_place(plan, rng);
    };
    if uniform(rng) >= share {
        return uniform_place(plan, rng);
    }
    // A rock that falls outside the area is thrown again.
    for _ in 0..TRIES {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a share of a small number"
        )]
        let parent = (uniform(rng) * parents.len() as f64) as usize;
        let [e, n] = parents[parent];
        let place = [e + sigma_m * normal(rng), n + sigma_m * normal(rng)];
        if plan.area.holds(place[0], place[1]) {
            return place;
        }
    }
    uniform_place(plan, rng)
}
