//! Belief fusion on one thread: the default scene, and how the time grows with the length of a
//! traverse.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use rayon::{ThreadPool, ThreadPoolBuilder};
use rockmap::adjust::{Measurement, Problem};
use rockmap::fuse::belief::{Belief, BeliefSettings, fuse_belief};
use rockmap::pipeline::{self, Config, Inputs, Overrides, Silent};
use rockmap::simulate::{self, Scene};

/// Metres of rocks before the first station and beyond the last.
const BEFORE_M: f64 = 2.0;
const BEYOND_M: f64 = 10.0;

/// What fusion is given of a scene.
struct Data {
    inputs: Inputs,
    measurements: Vec<Measurement>,
    height_sigma_m: f64,
    max_range_m: f64,
}

impl Data {
    /// Plays a scene, writes it and reads what a run reads.
    fn new(scene: &Scene) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let simulation = simulate::simulate(scene);
        simulate::write(&simulation, folder.path()).expect("the folder is writable");
        let file = folder.path().join("pipeline.toml");
        let config = Config::read(&file, &Overrides::default()).expect("it was written to be read");
        let inputs = pipeline::read(&config, &Silent).expect("all files are there");
        let settings = config.projection();
        let detections = inputs.detections.iter();
        let measurements = detections
            .filter_map(|(view, detection)| {
                let seen_from = (*view, &inputs.views[*view]);
                Measurement::new(detection, seen_from, &settings).ok()
            })
            .collect();
        Self {
            measurements,
            height_sigma_m: config.terrain.height_sigma_m,
            max_range_m: config.view.max_range_m.unwrap_or(f64::INFINITY),
            inputs,
        }
    }

    fn fuse(&self, pool: &ThreadPool) -> Belief {
        let problem = Problem {
            views: &self.inputs.views,
            measurements: &self.measurements,
            surface: self.inputs.terrain.as_ref().expect("the scene has ground"),
            height_sigma_m: self.height_sigma_m,
            max_range_m: self.max_range_m,
            min_range_m: 0.0,
        };
        pool.install(|| fuse_belief(&problem, &BeliefSettings::default()))
    }
}

/// The default scene, or one so many times as long with as many rocks a square metre.
fn scene(times: u32) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes");
    let mut scene = Scene::read(&folder.join("default.toml")).expect("a scene");
    let platform = &mut scene.platforms[0];
    platform.stations *= times as usize;
    let stations = u32::try_from(platform.stations).expect("few stations");
    let length_m = f64::from(stations) * platform.spacing_m;
    let area = &mut scene.rocks.area;
    let before_m2 = area.size_m2();
    (area.west_m, area.east_m) = (-BEFORE_M, length_m + BEYOND_M - BEFORE_M);
    let more = area.size_m2() / before_m2;
    scene.rocks.number = scaled(scene.rocks.number, more);
    scene
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a count of rocks"
)]
fn scaled(number: usize, factor: f64) -> usize {
    (number as f64 * factor).round() as usize
}

fn one_thread() -> ThreadPool {
    let pool = ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread")
}

fn default_scene(c: &mut Criterion) {
    let (data, pool) = (Data::new(&scene(1)), one_thread());
    let mut group = c.benchmark_group("fuse");
    group.sample_size(10);
    group.bench_function("belief, 45 views, one thread", |b| {
        b.iter(|| data.fuse(black_box(&pool)).objects.len());
    });
    group.finish();
}

/// Seconds that this process has computed, where the system tells: other work on the machine does
/// not count. Else seconds of the clock since `start`.
fn seconds(start: Instant) -> f64 {
    let threads = std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten();
    let nanoseconds = threads.filter_map(|thread| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    let computed: f64 = nanoseconds.sum::<f64>() * 1e-9;
    if computed > 0.0 {
        computed
    } else {
        start.elapsed().as_secs_f64()
    }
}

/// Traverses of 45 to 4500 views: seconds, and the exponent of their growth from each to the next
/// and from the first to the last. A filter that does not name them leaves them out.
fn lengths(_: &mut Criterion) {
    let filters: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    if !(filters.is_empty() || filters.iter().any(|f| "lengths".contains(f.as_str()))) {
        return;
    }
    let (pool, start) = (one_thread(), Instant::now());
    let mut all: Vec<(f64, f64)> = Vec::new();
    for times in [1, 3, 10, 30, 100] {
        let data = Data::new(&scene(times));
        let mut least_s = f64::INFINITY;
        for _ in 0..if times <= 10 { 3 } else { 1 } {
            let before_s = seconds(start);
            let belief = data.fuse(&pool);
            let this_s = seconds(start) - before_s;
            println!(
                "lengths: {} views, {} detections: {this_s:.3} s, {} starts, {} rounds",
                data.inputs.views.len(),
                data.measurements.len(),
                belief.evidence.n_starts,
                belief.evidence.rounds,
            );
            least_s = least_s.min(this_s);
        }
        let views = f64::from(u32::try_from(data.inputs.views.len()).expect("few views"));
        if let Some(&before) = all.last() {
            println!("lengths: growth {:.2}", growth(before, (views, least_s)));
        }
        all.push((views, least_s));
    }
    if let [first, .., last] = all[..] {
        println!(
            "lengths: growth from first to last {:.2}",
            growth(first, last)
        );
    }
}

/// The power of the number of views with which seconds grow between two lengths.
fn growth(before: (f64, f64), after: (f64, f64)) -> f64 {
    (after.1 / before.1).ln() / (after.0 / before.0).ln()
}

criterion_group!(benches, default_scene, lengths);
criterion_main!(benches);
