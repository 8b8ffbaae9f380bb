//! Pictures of the scene, ray by ray: rocks with their shadows on a textured ground under a sky.
//!
//! A picture depends on the scene, the view and the place in the picture alone: the same bytes at
//! any number of threads. A rock's box ([`super::Shape`]) holds for the picture: the silhouette's
//! left and right extremes are its box's.

mod develop;
mod ground_look;
mod palette;
mod pebbles;
mod rock_look;
mod sky;
mod studio;

use std::io::BufWriter;
use std::path::Path;

use image::{ImageEncoder, RgbImage};
use rayon::prelude::*;

use crate::error::Error;
use crate::frame::Pixel;

use super::Simulation;
use super::scene::{PictureFormat, RenderPlan};
use palette::Colour;
use studio::{Studio, Surface};

/// A rendered picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// 8 bits a channel.
    pub rgb: RgbImage,
    /// Of each pixel, row by row: the index of the rock it shows at its centre.
    pub rock: Vec<Option<usize>>,
    /// The format it is written in.
    pub format: PictureFormat,
}

/// One ray's answer.
#[derive(Debug, Clone, Copy)]
struct Sample {
    light: Colour,
    surface: Surface,
}

/// Renders what a view shows from its true pose.
pub fn render(simulation: &Simulation, plan: &RenderPlan, view: usize) -> Picture {
    let studio = Studio::new(simulation, plan, view);
    let (width, height) = studio.size();
    let rows: Vec<Vec<Sample>> = (0..height)
        .into_par_iter()
        .map(|v| {
            (0..width)
                .map(|u| sample(&studio, u, v, [0.0; 2]))
                .collect()
        })
        .collect();
    let smooth: Vec<Vec<Colour>> = (0..height)
        .into_par_iter()
        .map(|v| (0..width).map(|u| smoothed(&studio, &rows, u, v)).collect())
        .collect();
    let samples = rows.iter().flatten();
    Picture {
        rgb: develop::develop(&smooth, plan.sensor_noise, studio.grain_key()),
        rock: samples.map(|s| s.surface.rock()).collect(),
        format: plan.format,
    }
}

fn sample(studio: &Studio, u: u32, v: u32, [du, dv]: [f64; 2]) -> Sample {
    let (light, surface) = studio.look(Pixel::new(f64::from(u) + du, f64::from(v) + dv));
    Sample { light, surface }
}

/// A pixel's light: two or four more rays where its neighbours show something else.
fn smoothed(studio: &Studio, rows: &[Vec<Sample>], u: u32, v: u32) -> Colour {
    let (i, j) = (u as usize, v as usize);
    let here = rows[j][i];
    let others = [
        rows[j].get(i + 1),
        rows.get(j + 1).and_then(|row| row.get(i)),
        i.checked_sub(1).and_then(|i| rows[j].get(i)),
        j.checked_sub(1).and_then(|j| rows[j].get(i)),
    ];
    let mut edges = others
        .iter()
        .flatten()
        .filter(|o| o.surface != here.surface);
    let Some(first) = edges.next() else {
        return here.light;
    };
    // Outlines of rocks and of the horizon deserve more rays than pebbles do.
    let is_outline =
        |s: &Sample| !matches!(s.surface, Surface::Ground { .. } | Surface::Pebble { .. });
    let offsets = if is_outline(&here) || is_outline(first) || edges.any(|o| is_outline(o)) {
        &GRID[..]
    } else {
        &GRID[..2]
    };
    let sum: Colour = offsets.iter().map(|&o| sample(studio, u, v, o).light).sum();
    sum / f64::from(u32::try_from(offsets.len()).unwrap_or(1))
}

/// A rotated grid, symmetric about the pixel's centre, and so are its first two places.
const GRID: [[f64; 2]; 4] = [
    [0.125, 0.375],
    [-0.125, -0.375],
    [0.375, -0.125],
    [-0.375, 0.125],
];

/// Writes a picture in its format.
///
/// # Errors
/// A file that cannot be written, or a picture the encoder refuses.
pub fn write_picture(picture: &Picture, path: &Path) -> Result<(), Error> {
    let refused = |e: String| Error::Output(format!("{}: {e}", path.display()));
    match picture.format {
        PictureFormat::Png => {
            let file = std::fs::File::create(path).map_err(|e| Error::io(path, "create", e))?;
            let (width, height) = picture.rgb.dimensions();
            image::codecs::png::PngEncoder::new(BufWriter::new(file))
                .write_image(&picture.rgb, width, height, image::ExtendedColorType::Rgb8)
                .map_err(|e| refused(e.to_string()))
        }
        PictureFormat::Jpeg => {
            let (width, height) = picture.rgb.dimensions();
            let (width, height) = (width as usize, height as usize);
            let image = turbojpeg::Image {
                pixels: picture.rgb.as_raw().as_slice(),
                width,
                pitch: 3 * width,
                height,
                format: turbojpeg::PixelFormat::RGB,
            };
            let bytes = turbojpeg::compress(image, 92, turbojpeg::Subsamp::Sub2x1)
                .map_err(|e| refused(e.to_string()))?;
            std::fs::write(path, &bytes[..]).map_err(|e| Error::io(path, "write", e))
        }
    }
}
