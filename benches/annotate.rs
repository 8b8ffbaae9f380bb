//! Pictures a second that are annotated, beside a pipeline that only decodes and encodes them.
//!
//! Each row is one size and colour resolution of JPEG, in memory, on all cores. `re-encode` decodes
//! to RGB with libjpeg-turbo and encodes again in the same quality and colour resolution; `annotate`
//! decodes, draws 60 objects with their names and ellipses, 60 detections, a tint and a legend, and
//! encodes. The two take turns, and each has the median of its turns. `draw` is the drawing
//! alone, milliseconds a picture on one core.

use std::hint::black_box;
use std::time::{Duration, Instant};

use nalgebra::Matrix2;
use rayon::prelude::*;
use rockmap::frame::Pixel;
use rockmap::publish::annotate::{Annotation, DetectionMark, ObjectMark, annotate};
use rockmap::publish::picture::Picture;
use turbojpeg::{Image, PixelFormat, Subsamp};

/// The share of the plain pipeline's pictures a second that annotating is to reach, in pictures of
/// the demo's size and larger: a small one is mostly marks.
const GOAL: f64 = 0.6;
const QUALITY: u8 = Picture::JPEG_QUALITY;
/// How long one turn takes, about.
const TURN: Duration = Duration::from_millis(300);

fn main() {
    let is_test = std::env::args().any(|argument| argument == "--test");
    let turns = if is_test { 1 } else { 15 };
    println!(
        "{:>11}  {:>6}  {:>12}  {:>11}  {:>6}  {:>8}",
        "pixels", "colour", "re-encode /s", "annotate /s", "ratio", "draw ms"
    );
    let mut least = f64::INFINITY;
    for (width, height, colour) in [
        (640, 480, Subsamp::Sub2x2),
        (1280, 960, Subsamp::Sub2x2),
        (1280, 960, Subsamp::Sub2x1),
        (1280, 960, Subsamp::None),
        (4000, 3000, Subsamp::Sub2x2),
    ] {
        let jpeg = source(width, height, colour);
        let scene = scene(f64::from(width), f64::from(height));
        let plain = || reencoded(black_box(&jpeg), colour);
        let annotated = || annotated(black_box(&jpeg), black_box(&scene));
        let mut rates = [Vec::new(), Vec::new()];
        for _ in 0..turns {
            rates[0].push(per_second(&plain));
            rates[1].push(per_second(&annotated));
        }
        let [plain, annotated] = rates.map(median);
        let ratio = annotated / plain;
        if width >= 1280 {
            least = least.min(ratio);
        }
        let draw_ms = drawing_ms(&jpeg, &scene);
        println!(
            "{:>11}  {:>6}  {plain:>12.1}  {annotated:>11.1}  {ratio:>6.2}  {draw_ms:>8.2}",
            format!("{width}x{height}"),
            name(colour),
        );
    }
    println!("least ratio from 1280x960 on {least:.2}, goal {GOAL}");
    assert!(is_test || least >= GOAL, "annotating is too slow");
}

fn name(colour: Subsamp) -> &'static str {
    match colour {
        Subsamp::Sub2x2 => "4:2:0",
        Subsamp::Sub2x1 => "4:2:2",
        _ => "4:4:4",
    }
}

/// How often a second all cores together do the work.
fn per_second(work: &(impl Fn() -> Vec<u8> + Sync)) -> f64 {
    let start = Instant::now();
    black_box(work());
    let once = start.elapsed().as_secs_f64();
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(1);
    let mut count = 1;
    while f64::from(count) * once < TURN.as_secs_f64() {
        count += 1;
    }
    let start = Instant::now();
    (0..count * threads).into_par_iter().for_each(|_| {
        black_box(work());
    });
    f64::from(count * threads) / start.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn drawing_ms(jpeg: &[u8], scene: &Annotation) -> f64 {
    let picture = Picture::decode(jpeg).expect("the JPEG is sound");
    let times = (0..9).map(|_| {
        let mut copy = picture.clone();
        let start = Instant::now();
        annotate(&mut copy, scene);
        start.elapsed().as_secs_f64() * 1e3
    });
    median(times.collect())
}

/// What a program without marks would do.
fn reencoded(jpeg: &[u8], colour: Subsamp) -> Vec<u8> {
    let rgb = turbojpeg::decompress(jpeg, PixelFormat::RGB).expect("the JPEG is sound");
    let image: Image<&[u8]> = rgb.as_deref();
    let bytes = turbojpeg::compress(image, i32::from(QUALITY), colour);
    bytes.expect("the size is sound").to_vec()
}

fn annotated(jpeg: &[u8], scene: &Annotation) -> Vec<u8> {
    let mut picture = Picture::decode(jpeg).expect("the JPEG is sound");
    annotate(&mut picture, scene);
    picture.to_jpeg(QUALITY).expect("the size is sound")
}

/// A photograph's worth of texture: slow and fast waves and a little noise.
fn source(width: u32, height: u32, colour: Subsamp) -> Vec<u8> {
    let mut state = 1u32;
    let picture = Picture::from_fn(width, height, |x, y| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 24) / 255.0 - 0.5;
        let (x, y) = (f64::from(x), f64::from(y));
        let slow = (x / 170.0).sin() + (y / 90.0 + x / 300.0).cos();
        let fast = (x / 7.0 + y / 11.0).sin() * (y / 5.0).cos();
        [1.1, 1.0, 0.85].map(|tone| byte((125.0 + 35.0 * slow + 12.0 * fast + 10.0 * noise) * tone))
    });
    let picture = picture.expect("the size is sound");
    let jpeg = picture.to_jpeg(95).expect("the size is sound");
    reencoded(&jpeg, colour)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn byte(value: f64) -> u8 {
    value.clamp(0.0, 255.0) as u8
}

fn scene(width: f64, height: f64) -> Annotation {
    let scale = width / 1280.0;
    let ground = [
        (0.12, 1.15),
        (0.31, 0.29),
        (0.78, 0.26),
        (1.09, 0.62),
        (0.94, 1.15),
    ];
    let mut scene = Annotation {
        title: "v012 · mast camera".to_owned(),
        covered: vec![
            ground
                .map(|(x, y)| Pixel::new(x * width, y * height))
                .to_vec(),
        ],
        ..Annotation::default()
    };
    for index in 0..60u32 {
        let t = f64::from(index);
        let centre = Pixel::new(
            width * (t * 0.754_877).fract(),
            height * (0.2 + 0.8 * (t * 0.569_840).fract()),
        );
        let radius = (6.0 + 30.0 * (t * 0.618_034).fract()) * scale;
        scene.objects.push(ObjectMark {
            label: format!("r{index:04}"),
            centre,
            radius_px: radius,
            covariance_px: Matrix2::new(90.0, 10.0, 10.0, 25.0) * (scale * scale),
            detected: index % 6 != 0,
            p_exist: Some(0.9),
        });
        scene.detections.push(DetectionMark::Box {
            x_min: centre.u - radius,
            y_min: centre.v - radius,
            x_max: centre.u + radius,
            y_max: centre.v + radius,
        });
    }
    scene
}
