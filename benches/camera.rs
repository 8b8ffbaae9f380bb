//! Rays and pixels a second of every lens model, on one thread.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rockmap::camera::{Camera, cameras_from_toml};
use rockmap::frame::{Pixel, Point};

fn lenses(criterion: &mut Criterion) {
    let cameras = include_str!("../tests/camera/cameras.toml");
    let cameras = cameras_from_toml(cameras, "cameras.toml").expect("the cameras are sound");
    let mut group = criterion.benchmark_group("camera");
    for (name, camera) in &cameras {
        let pixels = grid(camera);
        let points: Vec<Point<_>> = pixels
            .iter()
            .filter_map(|&pixel| Some(camera.ray(pixel).ok()?.at(7.5)))
            .collect();
        assert_eq!(
            pixels.len(),
            points.len(),
            "{name} has a ray for every pixel"
        );
        let mut rays: Vec<_> = pixels.iter().map(|&pixel| camera.ray(pixel)).collect();
        let mut seen: Vec<_> = points.iter().map(|&point| camera.pixel(point)).collect();
        group.throughput(Throughput::Elements(pixels.len() as u64));
        group.bench_function(format!("{name}/ray"), |b| {
            b.iter(|| {
                for &pixel in &pixels {
                    let _ = black_box(camera.ray(black_box(pixel)));
                }
            });
        });
        group.bench_function(format!("{name}/pixel"), |b| {
            b.iter(|| {
                for &point in &points {
                    let _ = black_box(camera.pixel(black_box(point)));
                }
            });
        });
        group.bench_function(format!("{name}/rays"), |b| {
            b.iter(|| camera.rays(black_box(&pixels), black_box(&mut rays)));
        });
        group.bench_function(format!("{name}/pixels"), |b| {
            b.iter(|| camera.pixels(black_box(&points), black_box(&mut seen)));
        });
        group.bench_function(format!("{name}/ray_with_jacobian"), |b| {
            b.iter(|| {
                for &pixel in &pixels {
                    let _ = black_box(camera.ray_with_jacobian(black_box(pixel)));
                }
            });
        });
        group.bench_function(format!("{name}/pixel_with_jacobian"), |b| {
            b.iter(|| {
                for &point in &points {
                    let _ = black_box(camera.pixel_with_jacobian(black_box(point)));
                }
            });
        });
    }
    group.finish();
}

/// 4096 pixels all over the picture.
fn grid(camera: &Camera) -> Vec<Pixel> {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let centres = || (0..64).map(|i| (f64::from(i) + 0.5) / 64.0);
    centres()
        .flat_map(|v| centres().map(move |u| Pixel::new(u * width - 0.5, v * height - 0.5)))
        .collect()
}

criterion_group!(benches, lenses);
criterion_main!(benches);
