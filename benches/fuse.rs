//! Belief fusion on one thread: the default scene, how the time grows with the length of a traverse,
//! and what it costs where the traverse returns to where it has been.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use rayon::{ThreadPool, ThreadPoolBuilder};
use rockmap::adjust::{Measurement, Problem};
use rockmap::fuse::belief::{Belief, BeliefSettings, fuse_belief};
use rockmap::pipeline::{self, Config, Inputs, Overrides, Silent};
use rockmap::simulate::{self, Path as Way, Scene};

/// Metres of rocks before the first station and beyond the last.
const BEFORE_M: f64 = 2.0;
const BEYOND_M: f64 = 10.0;
/// Metres of rocks around a traverse that returns.
const AROUND_M: f64 = 12.0;
/// Metres between the ways out and back.
const BACK_BESIDE_M: f64 = 3.0;
/// Metres between the lines of a lawn-mower.
const LINES_M: f64 = 6.0;

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

/// The default scene so many times as long, along legs between places, with as many rocks a square
/// metre.
fn along(times: u32, legs: impl Fn(f64) -> Vec<[f64; 2]>) -> Scene {
    let mut scene = scene(times);
    let platform = &mut scene.platforms[0];
    let stations = u32::try_from(platform.stations).expect("few stations");
    let places = legs(f64::from(stations) * platform.spacing_m);
    let area = &mut scene.rocks.area;
    let before_m2 = area.size_m2();
    let least = |i: usize| places.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min);
    let most = |i: usize| {
        places
            .iter()
            .map(|p| p[i])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    (area.west_m, area.east_m) = (least(0) - AROUND_M, most(0) + AROUND_M);
    (area.south_m, area.north_m) = (least(1) - AROUND_M, most(1) + AROUND_M);
    let more = area.size_m2() / before_m2;
    platform.path = Way::Waypoints(places);
    scene.rocks.number = scaled(scene.rocks.number, more);
    scene
}

/// Out, and back beside it.
fn out_and_back(length_m: f64) -> Vec<[f64; 2]> {
    let far_m = 0.5 * length_m;
    let beside_m = BACK_BESIDE_M;
    vec![[0.0, 0.0], [far_m, 0.0], [far_m, beside_m], [0.0, beside_m]]
}

/// To and fro in lines that fill a square.
fn lines(length_m: f64) -> Vec<[f64; 2]> {
    let n_lines = (length_m / LINES_M).sqrt().round().max(2.0);
    let line_m = length_m / n_lines;
    let mut places = Vec::new();
    let (mut north_m, mut from_m, mut to_m) = (0.0, 0.0, line_m);
    // One line more, as the ways between the lines are travelled too: the last is not finished.
    while north_m <= n_lines * LINES_M {
        places.extend([[from_m, north_m], [to_m, north_m]]);
        std::mem::swap(&mut from_m, &mut to_m);
        north_m += LINES_M;
    }
    places
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

/// Whether the command line asks for a part: a filter that does not name it leaves it out.
fn is_wanted(name: &str) -> bool {
    let filters: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    filters.is_empty() || filters.iter().any(|f| name.contains(f.as_str()))
}

/// What fusions of a scene came to.
struct Timed {
    views: f64,
    /// The least of some.
    seconds: f64,
    /// How often registration was done: where it left doubt, more than once.
    starts: f64,
}

impl Timed {
    fn new(name: &str, scene: &Scene, fusions: usize) -> Self {
        let (pool, start) = (one_thread(), Instant::now());
        let data = Data::new(scene);
        let mut timed = Self {
            views: number(data.inputs.views.len()),
            seconds: f64::INFINITY,
            starts: 1.0,
        };
        for _ in 0..fusions {
            let before_s = seconds(start);
            let belief = data.fuse(&pool);
            let this_s = seconds(start) - before_s;
            println!(
                "{name}: {} views, {} detections: {this_s:.3} s, {} starts, {} rounds",
                data.inputs.views.len(),
                data.measurements.len(),
                belief.evidence.n_starts,
                belief.evidence.rounds,
            );
            timed.seconds = timed.seconds.min(this_s);
            timed.starts = number(belief.evidence.n_starts);
        }
        timed
    }

    /// One registration with its rounds.
    fn start(&self) -> Self {
        Self {
            views: self.views,
            seconds: self.seconds / self.starts,
            starts: 1.0,
        }
    }

    /// The power of the number of views with which seconds grow from one length to this.
    fn growth_from(&self, before: &Self) -> f64 {
        (self.seconds / before.seconds).ln() / (self.views / before.views).ln()
    }
}

fn number(count: usize) -> f64 {
    f64::from(u32::try_from(count).expect("few views"))
}

/// Traverses of 45 to 4500 views: seconds, and the exponent of their growth from each to the next
/// and from the first to the last.
fn lengths(_: &mut Criterion) {
    if !is_wanted("lengths") {
        return;
    }
    let mut all: Vec<Timed> = Vec::new();
    for times in [1, 3, 10, 30, 100] {
        let this = Timed::new("lengths", &scene(times), if times <= 10 { 3 } else { 1 });
        if let Some(before) = all.last() {
            println!("lengths: growth {:.2}", this.growth_from(before));
        }
        all.push(this);
    }
    if let [first, .., last] = &all[..] {
        let growth = last.growth_from(first);
        println!("lengths: growth from first to last {growth:.2}");
    }
}

/// Traverses of 45 to 4500 views that return: how many times as long one registration with its
/// rounds takes as that of a straight traverse of as many views, and the exponent of its growth from
/// the first to the last.
fn returning(_: &mut Criterion) {
    if !is_wanted("returning") {
        return;
    }
    let mut all: Vec<[Timed; 3]> = Vec::new();
    for times in [1, 10, 33, 100] {
        let fusions = if times <= 10 { 3 } else { 1 };
        let these = [
            ("straight", scene(times)),
            ("out and back", along(times, out_and_back)),
            ("lines", along(times, lines)),
        ]
        .map(|(name, scene)| Timed::new(&format!("returning: {name}"), &scene, fusions).start());
        let [straight, back, mower] = &these;
        println!(
            "returning: {} views, times a straight one: out and back {:.2}, lines {:.2}",
            straight.views,
            back.seconds / straight.seconds,
            mower.seconds / straight.seconds
        );
        all.push(these);
    }
    if let [first, .., last] = &all[..] {
        let [straight, back, mower] = [0, 1, 2].map(|i| last[i].growth_from(&first[i]));
        println!(
            "returning: growth from first to last: straight {straight:.2}, out and back {back:.2}, \
             lines {mower:.2}"
        );
    }
}

criterion_group!(benches, default_scene, lengths, returning);
criterion_main!(benches);
