//! How high a raster reaches, block by block, so that rays skip what lies below them.

use super::grid::HeightGrid;
use super::holes::Holes;

/// Blocks of `2^level` x `2^level` cells with the greatest height in each, levels from 1.
#[derive(Debug)]
pub(super) struct Pyramid {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    columns: usize,
    /// Greatest heights, metres, rounded up to single precision.
    highest: Vec<f32>,
    /// Which blocks hold an unknown cell; empty where none does.
    holes: Vec<bool>,
}

impl Pyramid {
    /// The pyramid of a raster. A hole counts as high as its ceiling, or as `under_holes_m`, the
    /// highest of what shows through it, if that is higher.
    pub fn new(grid: &HeightGrid, holes: &Holes, under_holes_m: f64) -> Self {
        let (columns, rows) = (grid.columns() - 1, grid.rows() - 1);
        let cell = |column: usize, row: usize| {
            if let Some(ceiling) = holes.ceiling_m(column, row) {
                return (round_up(ceiling.max(under_holes_m)), true);
            }
            let highest = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(i, j)| grid.height_m(column + i, row + j))
                .into_iter()
                .fold(f64::NEG_INFINITY, f64::max);
            (round_up(highest), false)
        };
        let mut levels = vec![Level::over(columns, rows, cell)];
        let (mut columns, mut rows) = (columns.div_ceil(2), rows.div_ceil(2));
        while columns > 1 || rows > 1 {
            let below = &levels[levels.len() - 1];
            let next = Level::over(columns, rows, |c, r| below.block(c, r));
            levels.push(next);
            (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
        }
        Self { levels }
    }

    /// The number of levels; the last is one block.
    pub fn levels(&self) -> u32 {
        u32::try_from(self.levels.len()).unwrap_or(u32::MAX)
    }

    /// The greatest height, metres, in the block of a level (from 1) that holds a cell, and
    /// whether some of its ground is unknown.
    pub fn block(&self, level: u32, column: usize, row: usize) -> (f64, bool) {
        let (highest, hole) = self.levels[level as usize - 1].block(column >> level, row >> level);
        (f64::from(highest), hole)
    }
}

impl Level {
    /// The level whose blocks gather 2 x 2 of what `below` gives.
    fn over(columns: usize, rows: usize, below: impl Fn(usize, usize) -> (f32, bool)) -> Self {
        let (width, height) = (columns.div_ceil(2), rows.div_ceil(2));
        let mut highest = Vec::with_capacity(width * height);
        let mut holes = Vec::with_capacity(width * height);
        for row in 0..height {
            for column in 0..width {
                let mut block = (f32::NEG_INFINITY, false);
                for r in 2 * row..(2 * row + 2).min(rows) {
                    for c in 2 * column..(2 * column + 2).min(columns) {
                        let (h, hole) = below(c, r);
                        block = (block.0.max(h), block.1 | hole);
                    }
                }
                highest.push(block.0);
                holes.push(block.1);
            }
        }
        if !holes.contains(&true) {
            holes = Vec::new();
        }
        Self {
            columns: width,
            highest,
            holes,
        }
    }

    fn block(&self, column: usize, row: usize) -> (f32, bool) {
        let index = row * self.columns + column;
        let hole = self.holes.get(index).copied().unwrap_or(false);
        (self.highest[index], hole)
    }
}

/// The nearest single-precision number that is not lower.
#[expect(clippy::cast_possible_truncation, reason = "what is lost is put back")]
fn round_up(height: f64) -> f32 {
    let near = height as f32;
    if f64::from(near) < height {
        near.next_up()
    } else {
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{Affine, Posts};

    #[test]
    fn every_block_is_as_high_as_its_highest_post() {
        let heights: Vec<f64> = (0..13 * 6)
            .map(|i| f64::from(i * 7919 % 101) + 0.123_456_789)
            .collect();
        let map = Affine::north_up(0.0, 0.0, 1.0);
        let grid = HeightGrid::new(13, 6, Posts::F64(heights), map, "EPSG:32632").unwrap();
        let pyramid = Pyramid::new(&grid, &Holes::new(&grid), f64::NEG_INFINITY);
        assert_eq!(pyramid.levels(), 4);
        for level in 1..=pyramid.levels() {
            let size = 1usize << level;
            for row in 0..grid.rows() - 1 {
                for column in 0..grid.columns() - 1 {
                    let (c0, r0) = (column / size * size, row / size * size);
                    let mut expected = f64::NEG_INFINITY;
                    for r in r0..=(r0 + size).min(grid.rows() - 1) {
                        for c in c0..=(c0 + size).min(grid.columns() - 1) {
                            expected = expected.max(grid.height_m(c, r));
                        }
                    }
                    let (found, hole) = pyramid.block(level, column, row);
                    assert!(found >= expected && found - expected < 1e-5 && !hole);
                }
            }
        }
    }
}
