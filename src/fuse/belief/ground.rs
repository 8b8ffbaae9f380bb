//! The ground under objects, which is asked for millions of times.

use crate::adjust::Surface;

/// Spacing of the nodes, metres: between them a planet bends by micrometres.
const SPACING_M: f64 = 10.0;
/// Ground this far about the views is kept, metres.
const MARGIN_M: f64 = 100.0;
/// No more nodes than this are kept.
const MOST_NODES: usize = 4_000_000;

/// Heights of a smooth surface at the nodes of a lattice.
#[derive(Debug, Clone)]
pub(super) struct SmoothGround {
    west_m: f64,
    south_m: f64,
    columns: usize,
    rows: usize,
    heights_m: Vec<f64>,
}

impl SmoothGround {
    /// About places (east, north); `None` where the surface is not smooth, or unknown somewhere.
    pub(super) fn new(
        surface: &dyn Surface,
        places: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> Option<Self> {
        if !surface.is_smooth() {
            return None;
        }
        let bound = |of: fn(&(f64, f64)) -> f64| {
            let values = places.clone().map(move |p| of(&p));
            let low = values.clone().fold(f64::INFINITY, f64::min);
            (
                low - MARGIN_M,
                values.fold(f64::NEG_INFINITY, f64::max) + MARGIN_M,
            )
        };
        let ((west_m, east_m), (south_m, north_m)) = (bound(|p| p.0), bound(|p| p.1));
        let (columns, rows) = (count(east_m - west_m)?, count(north_m - south_m)?);
        if columns.checked_mul(rows)? > MOST_NODES {
            return None;
        }
        let mut heights_m = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let at = |low: f64, i: usize| low + SPACING_M * whole(i);
                let ground = surface.ground_at(at(west_m, column), at(south_m, row))?;
                heights_m.push(ground.point.xyz.z);
            }
        }
        Some(Self {
            west_m,
            south_m,
            columns,
            rows,
            heights_m,
        })
    }

    /// Height and slopes by east and north; `None` off the lattice.
    pub(super) fn at(&self, east_m: f64, north_m: f64) -> Option<(f64, f64, f64)> {
        let x = (east_m - self.west_m) / SPACING_M;
        let y = (north_m - self.south_m) / SPACING_M;
        let inside = |t: f64, n: usize| t >= 0.0 && t < whole(n - 1);
        if !(inside(x, self.columns) && inside(y, self.rows)) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the lattice"
        )]
        let (i, j) = (x as usize, y as usize);
        let (s, t) = (x - whole(i), y - whole(j));
        let first = j * self.columns + i;
        let (a, b) = (self.heights_m[first], self.heights_m[first + 1]);
        let above = first + self.columns;
        let (c, d) = (self.heights_m[above], self.heights_m[above + 1]);
        let (low, high) = (a + s * (b - a), c + s * (d - c));
        let by_east = ((1.0 - t) * (b - a) + t * (d - c)) / SPACING_M;
        Some((low + t * (high - low), by_east, (high - low) / SPACING_M))
    }
}

/// How many nodes span a length.
fn count(length_m: f64) -> Option<usize> {
    let nodes = (length_m / SPACING_M).ceil() + 1.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to be a small number"
    )]
    let count = nodes as usize;
    (2.0..1e7).contains(&nodes).then_some(count)
}

#[expect(clippy::cast_precision_loss, reason = "a small number")]
fn whole(i: usize) -> f64 {
    i as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Geodetic, Planet, Site};
    use crate::terrain::Terrain;

    #[test]
    fn a_planet_is_smooth() {
        let site = Site::new(Planet::MOON, Geodetic::from_degrees(10.0, 20.0, 0.0));
        let terrain = Terrain::constant_height(site, 5.0);
        let places = [(1000.0, 2000.0), (1300.0, 2100.0)];
        let ground = SmoothGround::new(&terrain, places.iter().copied()).unwrap();
        for (east_m, north_m) in [(1003.0, 2004.0), (1397.0, 1901.0), (1155.5, 2050.1)] {
            let exact = terrain.ground_at(east_m, north_m).unwrap();
            let (up_m, by_east, _) = ground.at(east_m, north_m).unwrap();
            assert!((up_m - exact.point.xyz.z).abs() < 2e-5);
            let n = exact.normal.xyz();
            assert!((by_east + n.x / n.z).abs() < 1e-5);
        }
        assert!(ground.at(0.0, 0.0).is_none());
        assert!(ground.at(f64::NAN, 2000.0).is_none());
    }
}
