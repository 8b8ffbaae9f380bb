//! Discs and sectors that clip footprints to the ranges in which the detector is trusted.

use std::f64::consts::TAU;

use geo::{BooleanOps, Coord, LineString, MultiPolygon, Polygon};

use super::Reach;
use crate::frame::{Enu, Point};

/// Corners of a full circle: a chord lies 0.15 mm inside a circle of 1 m.
const CORNERS: u32 = 180;

/// A disc about a place, as a polygon.
pub(super) fn disc(centre: Point<Enu>, radius_m: f64) -> Polygon<f64> {
    Polygon::new(arc(centre, radius_m, 0.0, TAU).into(), Vec::new())
}

/// A sector about a place, from one azimuth clockwise over an angle; the whole disc for 2 pi.
pub(super) fn sector(centre: Point<Enu>, radius_m: f64, middle: f64, fov: f64) -> Polygon<f64> {
    if fov >= TAU {
        return disc(centre, radius_m);
    }
    let mut ring = arc(centre, radius_m, middle - 0.5 * fov, fov);
    ring.push(Coord {
        x: centre.xyz.x,
        y: centre.xyz.y,
    });
    Polygon::new(LineString::new(ring), Vec::new())
}

fn arc(centre: Point<Enu>, radius_m: f64, start: f64, angle: f64) -> Vec<Coord<f64>> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an angle within a full turn gives at most CORNERS steps"
    )]
    let steps = ((f64::from(CORNERS) * angle / TAU).ceil() as u32).max(1);
    let is_full = angle >= TAU;
    let count = if is_full { steps } else { steps + 1 };
    let corner = |i: u32| {
        let (sin, cos) = (start + angle * f64::from(i) / f64::from(steps)).sin_cos();
        Coord {
            x: centre.xyz.x + radius_m * sin,
            y: centre.xyz.y + radius_m * cos,
        }
    };
    (0..count).map(corner).collect()
}

/// The part of an area within the ranges.
pub(super) fn to_ranges(
    area: &MultiPolygon<f64>,
    centre: Point<Enu>,
    reach: Reach,
) -> MultiPolygon<f64> {
    let within = area.intersection(&disc(centre, reach.limit_m()));
    if reach.min_range_m > 0.0 {
        within.difference(&disc(centre, reach.min_range_m))
    } else {
        within
    }
}
