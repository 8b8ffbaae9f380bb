//! First hits, and boxes projected with their covariances, a second on one thread: on constant height,
//! and on a model of 1000 x 1000 posts.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rockmap::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
use rockmap::detection::{Aim, Detection, Mark, MarkSigma, PixelBox};
use rockmap::frame::{
    Crs, Direction, Enu, Geodetic, Planet, Point, Ray, RigidTransform, Rotation, Site, Vector,
};
use rockmap::pose::{Pose, PoseSigma};
use rockmap::project::{self, MarkNoise, Settings};
use rockmap::terrain::{Affine, HeightGrid, Posts, Terrain};
use rockmap::view::View;

const RAYS: u32 = 1000;

fn site() -> Site {
    Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0))
}

/// Half a metre between posts, hills of two metres with half a metre of roughness.
fn model() -> Terrain {
    let origin = site().origin();
    let utm = Crs::new("EPSG:32632", Planet::EARTH).expect("PROJ knows UTM");
    let (x, y) = utm
        .xy(origin.lon, origin.lat)
        .expect("the site is in the zone");
    let heights = (0..1_000_000u32)
        .map(|i| (f64::from(i % 1000), f64::from(i / 1000)))
        .map(|(c, r)| {
            let hills = (c / 30.0).sin() * (r / 40.0).cos();
            115.0 + 2.0 * hills + 0.25 * (0.7 * c + 0.3 * r).sin() * (0.2 * c - 0.9 * r).cos()
        })
        .collect();
    let map = Affine::north_up(x - 250.0, y + 250.0, 0.5);
    let grid = HeightGrid::new(1000, 1000, Posts::F64(heights), map, "EPSG:32632");
    Terrain::from_grids(site(), vec![grid.expect("a raster")], None).expect("a model")
}

/// Rays from 1.8 m above the ground at places spread over the middle of the model.
fn rays(terrain: &Terrain, down_deg: f64, up_m: f64) -> Vec<Ray<Enu>> {
    (0..RAYS)
        .map(|i| {
            let share = |step: f64| (f64::from(i) * step).fract() * 2.0 - 1.0;
            let (east, north) = (80.0 * share(0.618_034), 80.0 * share(0.754_878));
            let ground = terrain
                .ground_at(east, north)
                .expect("the middle is known")
                .point;
            let (sin, cos) = (360.0 * share(0.569_840)).to_radians().sin_cos();
            let down = down_deg.to_radians();
            let xyz = nalgebra::Vector3::new(sin * down.cos(), cos * down.cos(), -down.sin());
            Ray {
                origin: Point::new(east, north, ground.xyz.z + up_m),
                direction: Direction::new(xyz).expect("a direction"),
            }
        })
        .collect()
}

fn first_hits(c: &mut Criterion) {
    let plane = Terrain::constant_height(site(), 115.0);
    let model = model();
    let mut group = c.benchmark_group("first_hit");
    group.throughput(Throughput::Elements(u64::from(RAYS)));
    for (name, terrain, down_deg, up_m, range_m) in [
        ("constant height, 14 m away", &plane, 7.3, 1.8, 50.0),
        ("model, straight down", &model, 90.0, 1.8, 50.0),
        ("model, 25 degrees down", &model, 25.0, 1.8, 50.0),
        ("model, 7.3 degrees down (14 m)", &model, 7.3, 1.8, 14.0),
        ("model, grazing to 150 m", &model, 0.5, 1.8, 150.0),
        ("model, from 60 m above", &model, 40.0, 60.0, 500.0),
    ] {
        let rays = rays(terrain, down_deg, up_m);
        group.bench_function(name, |b| {
            b.iter(|| {
                rays.iter()
                    .filter(|&&ray| terrain.first_hit(black_box(ray), range_m).is_ok())
                    .count()
            });
        });
    }
    group.finish();
}

/// A mast camera that looks down by 15 degrees.
fn view(terrain: &Terrain) -> View {
    let ground = terrain
        .ground_at(0.0, 0.0)
        .expect("the middle is known")
        .point;
    let intrinsics = Intrinsics {
        fx: 900.0,
        fy: 900.0,
        cx: 639.5,
        cy: 479.5,
    };
    let camera = Camera {
        name: "mast".into(),
        width: 1280,
        height: 960,
        lens: Lens::Pinhole(Pinhole::new(intrinsics).expect("a lens")),
        mount: Mount::new(Vector::new(0.2, 0.0, 1.8), [0.5, -0.5, 0.5, -0.5]).expect("a mount"),
        readout: None,
    };
    let down = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.26, 0.4);
    View {
        image_id: "v".into(),
        listed: ("poses.csv".into(), 2),
        time: None,
        platform: None,
        picture: None,
        camera: Some(Arc::new(camera)),
        head: PanTilt {
            pan: 0.0,
            tilt: 0.0,
        },
        pose: Pose {
            enu_from_body: RigidTransform::new(
                Rotation::from_unit_quaternion(down),
                ground - Point::<Enu>::origin(),
            ),
            sigma: PoseSigma {
                east_m: 0.05,
                north_m: 0.05,
                up_m: 0.02,
                roll: 0.004,
                pitch: 0.004,
                yaw: 0.007,
            },
            has_heading: true,
        },
        enu_from_local: site().enu_from_local(site().origin()),
    }
}

/// Boxes spread over the picture's lower two thirds.
fn boxes() -> Vec<Detection> {
    let one = |i: u32| {
        let share = |step: f64| (f64::from(i) * step).fract();
        let (u, v) = (1240.0 * share(0.618_034), 340.0 + 580.0 * share(0.754_878));
        Detection {
            image_id: "v".into(),
            det_id: i.to_string(),
            class: None,
            score: Some(0.8),
            diameter_m: None,
            mark: Mark::Box(PixelBox {
                x_min: u,
                y_min: v,
                x_max: u + 30.0,
                y_max: v + 24.0,
            }),
            range_m: None,
            sigma: MarkSigma::default(),
            file: 0,
            line: u64::from(i) + 2,
        }
    };
    (0..RAYS).map(one).collect()
}

fn projected_boxes(c: &mut Criterion) {
    let plane = Terrain::constant_height(site(), 115.0);
    let model = model();
    let settings = Settings {
        aim: Aim::CENTER,
        min_range_m: 0.0,
        max_range_m: 60.0,
        min_score: 0.0,
        noise: MarkNoise {
            pixel_px: 1.5,
            range_m: 0.15,
            bearing: 0.02,
        },
    };
    let boxes = boxes();
    let mut group = c.benchmark_group("project");
    group.throughput(Throughput::Elements(u64::from(RAYS)));
    for (name, terrain) in [("boxes, constant height", &plane), ("boxes, model", &model)] {
        let view = view(terrain);
        group.bench_function(name, |b| {
            b.iter(|| {
                let place = |d| project::place(d, (0, &view), Some(terrain), 0.02, &settings);
                boxes
                    .iter()
                    .filter(|&d| place(black_box(d)).is_ok())
                    .count()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, first_hits, projected_boxes);
criterion_main!(benches);
