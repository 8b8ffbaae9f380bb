//! Draws annotated pictures of made-up scenes, to look at: `annotate_demo OUT_FOLDER [PHOTO ...]`.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use nalgebra::Matrix2;
use rockmap::frame::Pixel;
use rockmap::publish::annotate::{Annotation, DetectionMark, ObjectMark, annotate};
use rockmap::publish::picture::Picture;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let folder = arguments.next().ok_or("expected a folder to write to")?;
    std::fs::create_dir_all(&folder)?;
    let scenes = [
        ("dark", 1280, 960, 26.0),
        ("bright", 1280, 960, 225.0),
        ("sand", 1242, 375, 140.0),
        ("small", 320, 240, 90.0),
        ("vga", 640, 480, 120.0),
        ("large", 4000, 3000, 120.0),
        ("strip", 4096, 400, 120.0),
    ];
    for (name, width, height, grey) in scenes {
        let mut picture = ground(width, height, grey)?;
        draw(&mut picture, &folder.join(format!("{name}.png")))?;
    }
    for photo in arguments {
        let mut picture = Picture::read(&photo, &photo.display().to_string())?;
        let name = photo.file_stem().unwrap_or_default().to_string_lossy();
        draw(&mut picture, &folder.join(format!("{name}.png")))?;
    }
    Ok(())
}

fn draw(picture: &mut Picture, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let scene = annotation(f64::from(picture.width()), f64::from(picture.height()));
    let counts = annotate(picture, &scene);
    picture.write(path, Picture::JPEG_QUALITY)?;
    println!("{}: {counts:?}", path.display());
    Ok(())
}

/// Sky above and textured ground below.
fn ground(width: u32, height: u32, grey: f64) -> Result<Picture, Box<dyn std::error::Error>> {
    let mut state = 1u32;
    let picture = Picture::from_fn(width, height, |_, y| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(state >> 24) / 255.0 - 0.5;
        let depth = f64::from(y) / f64::from(height);
        let sky = if depth < 0.2 {
            1.15
        } else {
            0.85 + 0.3 * depth
        };
        [1.08, 1.0, 0.88].map(|tone| byte((grey * sky + 16.0 * noise) * tone))
    })?;
    Ok(picture)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn byte(value: f64) -> u8 {
    value.clamp(0.0, 255.0) as u8
}

fn annotation(width: f64, height: f64) -> Annotation {
    let scale = (width * height).sqrt() / 1000.0;
    let mut scene = Annotation {
        title: "v012 · mast camera".to_owned(),
        covered: vec![
            vec![
                Pixel::new(width * 0.12, height * 1.2),
                Pixel::new(width * 0.3, height * 0.3),
                Pixel::new(width * 0.78, height * 0.26),
                Pixel::new(width * 1.1, height * 0.62),
                Pixel::new(width * 0.9, height * 1.1),
            ],
            (0..12)
                .map(|i| {
                    let (sin, cos) = (f64::from(i) / 12.0 * TAU).sin_cos();
                    Pixel::new(width * (0.55 + 0.07 * cos), height * (0.72 + 0.06 * sin))
                })
                .collect(),
        ],
        ..Annotation::default()
    };
    for i in 0..48u32 {
        let t = f64::from(i);
        let depth = (t * 0.618_034).fract();
        let centre = Pixel::new(
            width * (0.02 + 0.96 * (t * 0.754_877 + 0.1).fract()),
            height * (0.24 + 0.74 * depth * depth),
        );
        let radius = scale * (3.0 + 30.0 * depth * depth * (0.4 + (t * 0.31).fract()));
        let sigma = radius * 0.35 + scale;
        let slant = (t * 0.7).fract() - 0.5;
        let is_detected = i % 7 != 3;
        scene.objects.push(ObjectMark {
            label: format!("r{:04}", 100 + i),
            centre,
            radius_px: radius,
            covariance_px: Matrix2::new(2.2, slant, slant, 0.35) * (sigma * sigma),
            detected: is_detected,
            p_exist: Some(if i % 5 == 0 { 0.62 } else { 0.99 }),
        });
        if is_detected {
            let (half, off) = (radius * 1.1, scale * 2.0 * slant);
            scene.detections.push(DetectionMark::Box {
                x_min: centre.u - half + off,
                y_min: centre.v - half * 0.8,
                x_max: centre.u + half + off,
                y_max: centre.v + half * 0.8,
            });
        }
        if i % 12 == 5 {
            let beside = Pixel::new(centre.u + 40.0 * scale, centre.v + 30.0 * scale);
            scene.detections.push(DetectionMark::Point(beside));
        }
    }
    scene
}
