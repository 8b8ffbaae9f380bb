//! How many views see each place.

use geo::BoundingRect;
use rayon::prelude::*;
use serde::Serialize;

use super::packed::Packed;
use crate::footprint::Footprints;
use crate::frame::Point;
use crate::publish::layer::union;

/// About how many cells a grid has at most.
const MAX_CELLS: f64 = 65_536.0;
/// The finest cells, metres.
const MIN_CELL_M: f64 = 0.02;

/// The number of views that see the middle of each cell of a grid over all footprints.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Coverage {
    /// The grid's lower left corner, metres.
    pub(super) east_m: f64,
    pub(super) north_m: f64,
    /// The side of a cell, metres.
    pub(super) cell_m: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Views that see each cell, by rows from the south.
    pub(super) views: Packed,
    /// The area that at least 1, 2, ... views see, m^2, to the most that any place is seen by.
    pub(super) seen_by_at_least_m2: Vec<f64>,
}

/// The coverage; `None` where no view sees any ground.
pub(super) fn coverage(footprints: &Footprints) -> Option<Coverage> {
    let boxes = footprints
        .all()
        .iter()
        .filter_map(|f| f.ground().bounding_rect());
    let bounds = boxes.reduce(union)?;
    let (width_m, height_m) = (bounds.width(), bounds.height());
    // Long and narrow traverses get as many cells as square ones.
    let longest_m = width_m.max(height_m);
    let cell_m = (width_m * height_m / MAX_CELLS)
        .sqrt()
        .max(longest_m / 4096.0)
        .max(MIN_CELL_M);
    let (columns, rows) = (cells(width_m, cell_m), cells(height_m, cell_m));
    let middle = |i: usize| {
        #[expect(clippy::cast_precision_loss, reason = "a few thousand cells")]
        let cells = i as f64;
        (cells + 0.5) * cell_m
    };
    let counts: Vec<Vec<usize>> = (0..rows)
        .into_par_iter()
        .map(|row| {
            let north_m = bounds.min().y + middle(row);
            let count = |column| {
                let east_m = bounds.min().x + middle(column);
                footprints
                    .views_covering(Point::new(east_m, north_m, 0.0))
                    .len()
            };
            (0..columns).map(count).collect()
        })
        .collect();
    let counts = counts.concat();
    Some(Coverage {
        east_m: bounds.min().x,
        north_m: bounds.min().y,
        cell_m,
        columns,
        rows,
        seen_by_at_least_m2: seen_by_at_least_m2(&counts, cell_m),
        views: Packed::small_counts(counts),
    })
}

fn cells(length_m: f64, cell_m: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "cells are chosen so that there are few"
    )]
    let cells = (length_m / cell_m).ceil() as usize;
    cells.max(1)
}

fn seen_by_at_least_m2(counts: &[usize], cell_m: f64) -> Vec<f64> {
    let most = counts.iter().copied().max().unwrap_or(0);
    let mut cells = vec![0_u32; most + 1];
    for &count in counts {
        cells[count] += 1;
    }
    let mut so_far = 0;
    let mut areas: Vec<f64> = (1..=most)
        .rev()
        .map(|k| {
            so_far += cells[k];
            f64::from(so_far) * cell_m * cell_m
        })
        .collect();
    areas.reverse();
    areas
}

#[cfg(test)]
mod tests {
    use geo::{Area, MultiPolygon, Rect, coord};

    use super::*;
    use crate::footprint::Footprint;

    fn rectangle(east: f64, north: f64, width: f64, height: f64) -> Footprint {
        let far = coord! { x: east + width, y: north + height };
        let area = Rect::new(coord! { x: east, y: north }, far).to_polygon();
        Footprint::new(MultiPolygon::from(area))
    }

    #[test]
    fn areas_agree_with_those_of_polygons() {
        let footprints = Footprints::new(vec![
            rectangle(0.0, 0.0, 4.0, 3.0),
            rectangle(1.3, 0.7, 5.0, 2.0),
            rectangle(2.1, 1.1, 1.5, 6.0),
            Footprint::empty(),
        ]);
        let found = coverage(&footprints).unwrap();
        assert_eq!(found.seen_by_at_least_m2.len(), 3);
        for (k, area_m2) in (1..).zip(&found.seen_by_at_least_m2) {
            let exact_m2 = footprints.seen_by_at_least(k).unsigned_area();
            assert!(
                (area_m2 - exact_m2).abs() < 0.01 * exact_m2,
                "{k}: {area_m2} {exact_m2}"
            );
        }
    }

    #[test]
    fn a_long_strip_has_no_more_cells_than_a_square() {
        let strip = coverage(&Footprints::new(vec![rectangle(0.0, 0.0, 4000.0, 5.0)])).unwrap();
        assert!(
            strip.columns * strip.rows <= 70_000,
            "{} x {}",
            strip.columns,
            strip.rows
        );
        assert!(strip.columns > 10 * strip.rows);
        assert!(coverage(&Footprints::new(vec![Footprint::empty()])).is_none());
    }
}
