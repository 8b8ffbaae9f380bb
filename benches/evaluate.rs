//! How long it takes to hold a large map against the truth.

use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rockmap::evaluate::{Comparison, Estimate, Options, Report, RockMap, TrueObject, Truth};
use rockmap::frame::{Enu, Geodetic, Planet, Point, Site};

/// A square of random true objects, each mapped within decimetres, and a tenth of false ones.
fn scene(n: u32, side_m: f64, error_m: f64) -> (RockMap, Truth) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let origin = Geodetic::from_degrees(-24.45, -69.93, 0.0);
    let site = Site::new(Planet::EARTH, origin);
    let geodetic = |x: f64, y: f64| site.geodetic(Point::<Enu>::new(x, y, 0.0));
    let (mut objects, mut estimates) = (Vec::new(), Vec::new());
    for i in 0..n {
        let (x, y) = (rng.random_range(0.0..side_m), rng.random_range(0.0..side_m));
        objects.push(TrueObject {
            object_id: format!("t{i}"),
            class: None,
            place: geodetic(x, y),
            n_detections: None,
        });
        let mut offset = || rng.random_range(-error_m..error_m);
        let mut places = vec![(x + offset(), y + offset())];
        if i % 10 == 0 {
            places.push((rng.random_range(0.0..side_m), rng.random_range(0.0..side_m)));
        }
        for (x, y) in places {
            estimates.push(Estimate {
                rock_id: format!("r{}", estimates.len()),
                class: None,
                place: geodetic(x, y),
                p_exist: Some(0.9),
                ellipse: None,
            });
        }
    }
    let planet = Planet::EARTH;
    let ignored = Vec::new();
    (RockMap { planet, estimates }, Truth { objects, ignored })
}

fn evaluate(c: &mut Criterion) {
    let mut group = c.benchmark_group("evaluate");
    group.sample_size(10);
    // One object a square metre: pairs are few. Ten a square metre: with a cut-off of half a metre
    // nearly all objects hang together in one component.
    for (name, n, side_m) in [
        ("100k objects, 1 a square metre", 100_000, 316.0),
        ("100k objects, 10 a square metre", 100_000, 100.0),
    ] {
        let (map, truth) = scene(n, side_m, 0.2);
        let options = Options::default();
        group.bench_function(name, |bench| {
            bench.iter(|| {
                let comparison = Comparison::new(&map, &truth, &options);
                comparison.map(|c| Report::new(&c).gospa.gospa_m)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, evaluate);
criterion_main!(benches);
