//! A picture's border, walked finely enough for its trace on the ground.

use geo::Coord;

use crate::camera::Camera;
use crate::frame::Pixel;

/// First division of each side of the picture.
const PIECES: u32 = 8;
/// A piece is halved at most this often.
const MAX_DEPTH: u32 = 7;

/// Walks once around the picture and maps every border pixel to the ground, halving a piece of the
/// border until the middle of its trace lies within a tolerance of the chord.
pub(super) fn walk(
    camera: &Camera,
    to_ground: &dyn Fn(Pixel) -> Option<Coord<f64>>,
    tolerance_m: &dyn Fn(Coord<f64>) -> f64,
) -> Option<Vec<Coord<f64>>> {
    let (right, bottom) = (
        f64::from(camera.width) - 0.5,
        f64::from(camera.height) - 0.5,
    );
    let corners = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)];
    let mut ring = Vec::new();
    for side in 0..4 {
        let (u0, v0) = corners[side];
        let (u1, v1) = corners[(side + 1) % 4];
        let at = |share: f64| Pixel::new(u0 + (u1 - u0) * share, v0 + (v1 - v0) * share);
        for piece in 0..PIECES {
            let start = f64::from(piece) / f64::from(PIECES);
            let end = f64::from(piece + 1) / f64::from(PIECES);
            let ends = (to_ground(at(start))?, to_ground(at(end))?);
            ring.push(ends.0);
            halve(
                &mut ring,
                &|s| to_ground(at(s)),
                tolerance_m,
                (start, end),
                ends,
                0,
            )?;
        }
    }
    Some(ring)
}

/// Adds the points between the two ends of a piece, both excluded.
fn halve(
    ring: &mut Vec<Coord<f64>>,
    at: &dyn Fn(f64) -> Option<Coord<f64>>,
    tolerance_m: &dyn Fn(Coord<f64>) -> f64,
    (start, end): (f64, f64),
    (from, to): (Coord<f64>, Coord<f64>),
    depth: u32,
) -> Option<()> {
    let middle = 0.5 * (start + end);
    let here = at(middle)?;
    let chord = (from + to) * 0.5;
    let away_m = (here.x - chord.x).hypot(here.y - chord.y);
    if away_m > tolerance_m(here) && depth < MAX_DEPTH {
        halve(
            ring,
            at,
            tolerance_m,
            (start, middle),
            (from, here),
            depth + 1,
        )?;
        ring.push(here);
        halve(ring, at, tolerance_m, (middle, end), (here, to), depth + 1)?;
    }
    Some(())
}
