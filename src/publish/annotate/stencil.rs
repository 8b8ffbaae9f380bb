//! Distances to lines, of which any number of strokes are made at once.

use super::canvas::narrow;
use super::grid::whole;
use super::style::{Frame, Line};

/// Side of a tile, pixels.
pub(super) const TILE: usize = 16;

/// For every pixel near a line its squared distance to the nearest one, kept in the tiles that any
/// line has come near to.
///
/// Lines that are drawn from one stencil melt where they cross or meet, so that a translucent
/// stroke is nowhere darker than elsewhere, and a bright stroke and the wider dark one below it
/// come from one computation.
pub(super) struct Stencil {
    width: usize,
    height: usize,
    across: usize,
    /// For each tile of the picture, one more than its number in `tiles`, or 0.
    numbers: Vec<u32>,
    tiles: Vec<Tile>,
}

/// The squared distances of one tile, rows from the top.
pub(super) struct Tile {
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) squares: [f32; TILE * TILE],
}

impl Stencil {
    /// No lines yet, for a picture of this size.
    pub(super) fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        let across = width.div_ceil(TILE);
        Self {
            width,
            height,
            across,
            numbers: vec![0; across * height.div_ceil(TILE)],
            tiles: Vec::new(),
        }
    }

    /// Adds the line from one point to another, pixels, as far as `reach` from it. Beyond the line's
    /// ends distances count `bluntness` times: round ends have 1, blunter ones more.
    pub(super) fn segment(&mut self, [from, to]: [[f64; 2]; 2], reach: f64, bluntness: f64) {
        let Some(frame) = Frame::about(&[from, to]) else {
            return;
        };
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let (ux, uy) = if length > 0.0 {
            (dx / length, dy / length)
        } else {
            (1.0, 0.0)
        };
        let rows = span(frame.top - reach, frame.bottom + reach, self.height);
        for row in rows {
            let y = f64::from(u32::try_from(row).unwrap_or(u32::MAX)) - from[1];
            // Of an oblique line, a row meets only the strip as wide as the line's reach.
            let (mut left, mut right) = (frame.left - reach, frame.right + reach);
            if uy.abs() > 1e-6 {
                let middle = from[0] + y * ux / uy;
                let half = reach / uy.abs();
                left = left.max(middle - half);
                right = right.min(middle + half);
            }
            let columns = span(left, right, self.width);
            if columns.is_empty() {
                continue;
            }
            let run = Run {
                along: y * uy - from[0] * ux,
                across: -from[0] * uy - y * ux,
                step: (ux, uy),
                length: narrow(length),
                bluntness: narrow(bluntness),
            };
            self.run(row, columns, &run);
        }
    }

    /// The tiles that lines have come near to.
    pub(super) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Forgets all lines.
    pub(super) fn clear(&mut self) {
        for tile in &self.tiles {
            self.numbers[tile.row / TILE * self.across + tile.column / TILE] = 0;
        }
        self.tiles.clear();
    }

    /// Lowers the distances along a row, in all tiles that the columns touch.
    fn run(&mut self, row: usize, columns: std::ops::Range<usize>, run: &Run) {
        let line = (row % TILE) * TILE;
        for start in (columns.start / TILE * TILE..columns.end).step_by(TILE) {
            let tile = self.tile(start, row);
            run.lower(start, &mut tile.squares[line..line + TILE]);
        }
    }

    fn tile(&mut self, column: usize, row: usize) -> &mut Tile {
        let number = &mut self.numbers[row / TILE * self.across + column / TILE];
        if *number == 0 {
            self.tiles.push(Tile {
                column: column / TILE * TILE,
                row: row / TILE * TILE,
                squares: [f32::INFINITY; TILE * TILE],
            });
            *number = u32::try_from(self.tiles.len()).unwrap_or(u32::MAX);
        }
        &mut self.tiles[*number as usize - 1]
    }
}

impl Line {
    /// How far from its middle the line has any colour, pixels.
    pub(super) fn reach(&self) -> f64 {
        self.halo_width.max(self.core_width) / 2.0 + 0.5
    }
}

/// A row of pixels seen from a segment: how far along it and across from it the row's first pixel
/// lies, and each next one farther.
struct Run {
    along: f64,
    across: f64,
    step: (f64, f64),
    length: f32,
    bluntness: f32,
}

impl Run {
    /// Lowers the squared distances of sixteen pixels from a column on: always all of a tile's row,
    /// so that the compiler can do many at once.
    fn lower(&self, column: usize, squares: &mut [f32]) {
        let column = f64::from(u32::try_from(column).unwrap_or(u32::MAX));
        let along = narrow(self.along + column * self.step.0);
        let across = narrow(self.across + column * self.step.1);
        let step = (narrow(self.step.0), narrow(self.step.1));
        for (square, index) in squares.iter_mut().zip(INDICES) {
            let along = along + index * step.0;
            let across = across + index * step.1;
            let before = if along < 0.0 { -along } else { 0.0 };
            let after = along - self.length;
            let beyond = if after > before { after } else { before } * self.bluntness;
            let here = across * across + beyond * beyond;
            *square = if here < *square { here } else { *square };
        }
    }
}

/// The columns of a tile.
const INDICES: [f32; TILE] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];

/// The pixels between two coordinates.
fn span(from: f64, to: f64, count: usize) -> std::ops::Range<usize> {
    let end = if to < 0.0 {
        0
    } else {
        (whole(to) + 1).min(count)
    };
    whole(from + 1.0).min(end)..end // What lies at `from` itself is out of reach.
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_to_the_nearest_segment() {
        let mut stencil = Stencil::new(50, 40);
        let segments = [
            ([3.0, 4.0], [45.5, 30.25]),
            ([20.0, 35.0], [20.0, -500.0]),
            ([30.0, 10.0], [30.0, 10.0]),
        ];
        for (from, to) in segments {
            stencil.segment([from, to], 6.0, 1.0);
        }
        let distance = |p: [f64; 2], (a, b): ([f64; 2], [f64; 2])| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = (p[0] - a[0]) * dx + (p[1] - a[1]) * dy;
            let square = dx * dx + dy * dy;
            let share = if square > 0.0 { along / square } else { 0.0 }.clamp(0.0, 1.0);
            (p[0] - a[0] - share * dx).hypot(p[1] - a[1] - share * dy)
        };
        let mut near = 0;
        for tile in stencil.tiles() {
            for (index, &square) in tile.squares.iter().enumerate() {
                let (x, y) = (tile.column + index % TILE, tile.row + index / TILE);
                let at = [x, y].map(|v| f64::from(u32::try_from(v).unwrap()));
                let expected = segments
                    .map(|s| distance(at, s))
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                if x < 50 && y < 40 && expected < 6.0 {
                    near += 1;
                    assert!((f64::from(square).sqrt() - expected).abs() < 1e-3, "{at:?}");
                }
            }
        }
        let expected_near = (0..40u32)
            .flat_map(|y| (0..50u32).map(move |x| [f64::from(x), f64::from(y)]))
            .filter(|&p| segments.iter().any(|&s| distance(p, s) < 6.0))
            .count();
        assert_eq!(near, expected_near);
        stencil.clear();
        assert!(stencil.tiles().is_empty() && stencil.numbers.iter().all(|&n| n == 0));
    }
}
