//! Lays pictures on the ground.

use rayon::prelude::*;

use super::grid::{Source, sources};
use super::{Mosaic, MosaicGrid};
use crate::frame::{Crs, Enu, Geodetic, Pixel, Point};
use crate::publish::{Picture, Scene};

/// Pixels between the places that are projected exactly; between them the projection is straight.
const LATTICE: usize = 16;

/// A pixel of the mosaic in the making.
#[derive(Clone, Copy)]
struct Cell {
    /// Its place on the ground; `None` where the ground is unknown.
    point: Option<Point<Enu>>,
    normal: nalgebra::Vector3<f64>,
    /// Picture pixels on a square metre, of the view that shows it best so far.
    density: f64,
    claim: Claim,
}

/// Which picture a pixel of the mosaic is from, and where in it.
#[derive(Clone, Copy)]
struct Claim {
    /// Index of the source, or [`NOBODY`].
    source: u32,
    u: f32,
    v: f32,
}

const NOBODY: u32 = u32::MAX;

/// Draws the mosaic: first decides which view shows each pixel best, for which no picture is
/// needed, then opens every picture once.
pub(super) fn render(scene: &Scene<'_>, crs: &Crs, grid: MosaicGrid) -> (Mosaic, Vec<String>) {
    let sources = sources(scene);
    let bands: Vec<usize> = (0..grid.rows).step_by(LATTICE).collect();
    let claims: Vec<Vec<Claim>> = bands
        .par_iter()
        .map(|&row| band(scene, crs, &grid, &sources, row))
        .collect();
    let mut rgba = vec![0; grid.columns * grid.rows * 4];
    let mut warnings = Vec::new();
    let indexed: Vec<(u32, &Source<'_>)> = (0..NOBODY).zip(&sources).collect();
    // As many pictures at a time as there are threads: they are what takes memory.
    for some in indexed.chunks(rayon::current_num_threads().max(1)) {
        let drawn: Vec<_> = some
            .par_iter()
            .map(|&(i, source)| draw(i, source, &claims, grid.columns * LATTICE))
            .collect();
        for (colours, &(_, source)) in drawn.into_iter().zip(some) {
            let Some(colours) = colours else {
                let image = &source.view.image_id;
                warnings.push(format!("image {image}: cannot be read, not in the mosaic"));
                continue;
            };
            for (at, [r, g, b]) in colours {
                rgba[4 * at..4 * at + 4].copy_from_slice(&[r, g, b, 255]);
            }
        }
    }
    (Mosaic { grid, rgba }, warnings)
}

/// The pixels that a picture claims, with their colours; `None` where it cannot be read.
fn draw(
    index: u32,
    source: &Source<'_>,
    claims: &[Vec<Claim>],
    band_len: usize,
) -> Option<Vec<(usize, [u8; 3])>> {
    let mut claimed = claims.iter().enumerate().flat_map(|(band, claims)| {
        let all = claims.iter().enumerate();
        let mine = all.filter(|(_, claim)| claim.source == index);
        mine.map(move |(i, claim)| (band * band_len + i, claim))
    });
    let Some(first) = claimed.next() else {
        return Some(Vec::new());
    };
    let picture = source.view.picture.as_ref()?;
    let picture = Picture::read(&picture.path, &picture.name).ok()?;
    let coloured = [first]
        .into_iter()
        .chain(claimed)
        .filter_map(|(at, claim)| {
            let pixel = Pixel::new(f64::from(claim.u), f64::from(claim.v));
            Some((at, sample(&picture, pixel)?))
        });
    Some(coloured.collect())
}

/// Who shows the rows from `top` to the next band best.
fn band(
    scene: &Scene<'_>,
    crs: &Crs,
    grid: &MosaicGrid,
    sources: &[Source<'_>],
    top: usize,
) -> Vec<Claim> {
    let rows = LATTICE.min(grid.rows - top);
    let mut cells = cells(scene, crs, grid, top, rows);
    for (index, source) in (0..NOBODY).zip(sources) {
        claim(scene, grid, (index, source), &mut cells);
    }
    cells.iter().map(|cell| cell.claim).collect()
}

/// The places of a band's pixels on the ground.
fn cells(scene: &Scene<'_>, crs: &Crs, grid: &MosaicGrid, top: usize, rows: usize) -> Vec<Cell> {
    let n_nodes = grid.columns.div_ceil(LATTICE) + 1;
    let nodes = |row: usize| -> Vec<Option<[f64; 2]>> {
        let node = |i: usize| node(scene, crs, grid, (i * LATTICE, row));
        (0..n_nodes).map(node).collect()
    };
    let (upper, lower) = (nodes(top), nodes(top + LATTICE));
    let mut cells = Vec::with_capacity(rows * grid.columns);
    for row in 0..rows {
        let down = (real(row) + 0.5) / real(LATTICE);
        for column in 0..grid.columns {
            let (left, within) = (column / LATTICE, column % LATTICE);
            let right = (real(within) + 0.5) / real(LATTICE);
            let corners = [upper[left], upper[left + 1], lower[left], lower[left + 1]];
            let weights = [
                (1.0 - right) * (1.0 - down),
                right * (1.0 - down),
                (1.0 - right) * down,
                right * down,
            ];
            let mut at = Some([0.0; 2]);
            for (corner, weight) in corners.into_iter().zip(weights) {
                at = at
                    .zip(corner)
                    .map(|(sum, c)| [0, 1].map(|i| sum[i] + weight * c[i]));
            }
            let ground = at.and_then(|[east, north]| scene.terrain?.ground_at(east, north));
            cells.push(Cell {
                point: ground.as_ref().map(|g| g.point),
                normal: ground.map_or(nalgebra::Vector3::z(), |g| g.normal.xyz()),
                density: grid.scale.least_density(),
                claim: Claim {
                    source: NOBODY,
                    u: 0.0,
                    v: 0.0,
                },
            });
        }
    }
    cells
}

/// The place in ENU, (east, north), of a corner of the mosaic's pixels, on the ground.
fn node(
    scene: &Scene<'_>,
    crs: &Crs,
    grid: &MosaicGrid,
    (column, row): (usize, usize),
) -> Option<[f64; 2]> {
    let step = grid.scale.m_per_px;
    let x = grid.west_m + real(column) * step;
    let y = grid.north_m - real(row) * step;
    let (lon, lat) = crs.lon_lat(x, y).ok()?;
    let place = |height_m: f64| scene.site.enu(Geodetic { lat, lon, height_m }).xyz;
    let mut at = place(scene.site.origin().height_m);
    // Far from the origin verticals lean: the height decides where on its vertical the place is.
    if let Some(ground) = scene.terrain.and_then(|t| t.ground_at(at.x, at.y)) {
        at = place(scene.site.height_m(ground.point));
    }
    Some([at.x, at.y])
}

/// Gives a view the cells that it shows better than those before it.
fn claim(
    scene: &Scene<'_>,
    grid: &MosaicGrid,
    (index, source): (u32, &Source<'_>),
    cells: &mut [Cell],
) {
    let Some(camera_from_enu) = source.view.enu_from_camera().map(|t| t.inverse()) else {
        return;
    };
    let [west, south, east, north] = source.reach(grid.scale);
    let origin = source.view.origin();
    let footprint = scene.footprints.of(source.index);
    let per_radian2 = source.pixel_angle.powi(-2);
    for cell in cells {
        let Some(point) = cell.point else { continue };
        let at = point.xyz;
        if at.x < west || at.x > east || at.y < south || at.y > north {
            continue;
        }
        let to_camera = origin.xyz - at;
        let distance2 = to_camera.norm_squared();
        // Projected area over squared distance is the solid angle.
        let density = to_camera.dot(&cell.normal) / (distance2 * distance2.sqrt()) * per_radian2;
        if density <= cell.density || !footprint.covers(at.x, at.y) {
            continue;
        }
        let Ok(pixel) = source.camera.pixel(camera_from_enu * point) else {
            continue;
        };
        if pixel.is_inside(source.camera.width, source.camera.height) {
            cell.density = density;
            #[expect(
                clippy::cast_possible_truncation,
                reason = "a thousandth of a pixel stays"
            )]
            let (u, v) = (pixel.u as f32, pixel.v as f32);
            cell.claim = Claim {
                source: index,
                u,
                v,
            };
        }
    }
}

/// The colour at a place of a picture, straight between its four pixels.
fn sample(picture: &Picture, at: Pixel) -> Option<[u8; 3]> {
    let (width, height) = (f64::from(picture.width()), f64::from(picture.height()));
    let inside = at.u > -0.5 && at.u < width - 0.5 && at.v > -0.5 && at.v < height - 0.5;
    if !inside {
        return None;
    }
    let (u, v) = (at.u.clamp(0.0, width - 1.0), at.v.clamp(0.0, height - 1.0));
    let (left, top) = (u.floor(), v.floor());
    let (right, down) = (u - left, v - top);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the picture"
    )]
    let colour = |u: f64, v: f64| {
        let (u, v) = (u.min(width - 1.0) as u32, v.min(height - 1.0) as u32);
        picture.colour(u, v)
    };
    let corners = [
        (colour(left, top)?, (1.0 - right) * (1.0 - down)),
        (colour(left + 1.0, top)?, right * (1.0 - down)),
        (colour(left, top + 1.0)?, (1.0 - right) * down),
        (colour(left + 1.0, top + 1.0)?, right * down),
    ];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a mean of bytes"
    )]
    let channel = |i: usize| {
        let mean: f64 = corners
            .iter()
            .map(|(c, weight)| f64::from(c[i]) * weight)
            .sum();
        mean.round() as u8
    };
    Some([channel(0), channel(1), channel(2)])
}

#[expect(clippy::cast_precision_loss, reason = "rows and columns of a raster")]
fn real(n: usize) -> f64 {
    n as f64
}
