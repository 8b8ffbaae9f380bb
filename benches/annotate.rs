//! What annotating costs beside the decoding and encoding that a picture needs anyway.
//!
//! `reencode/420` and `reencode/444` decode a JPEG of 1280 x 960 pixels with libjpeg-turbo and
//! encode it again with colour at half and at full resolution; `annotate` decodes, draws 60
//! objects, 60 detections and a tint, and encodes; `draw` draws alone.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Matrix2;
use rockmap::frame::Pixel;
use rockmap::publish::annotate::{Annotation, DetectionMark, ObjectMark, annotate};
use rockmap::publish::picture::Picture;
use turbojpeg::{Image, PixelFormat, Subsamp};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 960;

/// A photograph's worth of texture: slow and fast waves and a little noise.
fn source() -> Vec<u8> {
    let mut state = 1u32;
    let picture = Picture::from_fn(WIDTH, HEIGHT, |x, y| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 24) / 255.0 - 0.5;
        let (x, y) = (f64::from(x), f64::from(y));
        let slow = (x / 170.0).sin() + (y / 90.0 + x / 300.0).cos();
        let fast = (x / 7.0 + y / 11.0).sin() * (y / 5.0).cos();
        [1.1, 1.0, 0.85].map(|tone| byte((125.0 + 35.0 * slow + 12.0 * fast + 10.0 * noise) * tone))
    });
    let picture = picture.expect("the size is sound");
    reencoded(
        &picture.to_jpeg(90).expect("the size is sound"),
        Subsamp::Sub2x2,
    )
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn byte(value: f64) -> u8 {
    value.clamp(0.0, 255.0) as u8
}

fn scene() -> Annotation {
    let (width, height) = (f64::from(WIDTH), f64::from(HEIGHT));
    let mut scene = Annotation {
        title: "v012 · mast camera".to_owned(),
        covered: vec![vec![
            Pixel::new(150.0, 1100.0),
            Pixel::new(400.0, 280.0),
            Pixel::new(1000.0, 250.0),
            Pixel::new(1400.0, 600.0),
            Pixel::new(1200.0, 1100.0),
        ]],
        ..Annotation::default()
    };
    for index in 0..60u32 {
        let t = f64::from(index);
        let centre = Pixel::new(
            width * (t * 0.754_877).fract(),
            height * (0.2 + 0.8 * (t * 0.569_840).fract()),
        );
        let radius = 6.0 + 30.0 * (t * 0.618_034).fract();
        scene.objects.push(ObjectMark {
            label: format!("r{index:04}"),
            centre,
            radius_px: radius,
            covariance_px: Matrix2::new(90.0, 10.0, 10.0, 25.0),
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

/// What a program without marks would do.
fn reencoded(jpeg: &[u8], colour: Subsamp) -> Vec<u8> {
    let rgb = turbojpeg::decompress(jpeg, PixelFormat::RGB).expect("the JPEG is sound");
    let image: Image<&[u8]> = rgb.as_deref();
    let bytes = turbojpeg::compress(image, 90, colour).expect("the size is sound");
    bytes.to_vec()
}

fn annotating(criterion: &mut Criterion) {
    let jpeg = source();
    let scene = scene();
    let mut group = criterion.benchmark_group("picture");
    group.sample_size(40);
    group.bench_function("reencode/420", |bench| {
        bench.iter(|| reencoded(black_box(&jpeg), Subsamp::Sub2x2));
    });
    group.bench_function("reencode/444", |bench| {
        bench.iter(|| reencoded(black_box(&jpeg), Subsamp::None));
    });
    group.bench_function("annotate", |bench| {
        bench.iter(|| {
            let mut picture = Picture::decode(black_box(&jpeg)).expect("the JPEG is sound");
            annotate(&mut picture, black_box(&scene));
            picture.to_jpeg(90)
        });
    });
    let picture = Picture::decode(&jpeg).expect("the JPEG is sound");
    group.bench_function("draw", |bench| {
        bench.iter_batched_ref(
            || picture.clone(),
            |picture| annotate(picture, black_box(&scene)),
            criterion::BatchSize::LargeInput,
        );
    });
    group.finish();
}

criterion_group!(benches, annotating);
criterion_main!(benches);
