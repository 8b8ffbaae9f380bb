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
    /// Those in use, and behind them those that were and can be again.
    tiles: Vec<Tile>,
    n_tiles: usize,
}

/// The squared distances of one tile, rows from the top.
pub(super) struct Tile {
    pub(super) column: usize,
    pub(super) row: usize,
    /// A bit for each row that a line has come near to; the others hold no distances.
    near: u16,
    squares: [[f32; TILE]; TILE],
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
            n_tiles: 0,
        }
    }

    /// Adds the sides of a closed polygon, as far as `reach` from them.
    pub(super) fn polygon(&mut self, points: &[[f64; 2]], reach: f64) {
        for (index, &start) in points.iter().enumerate() {
            let end = points[(index + 1) % points.len()];
            self.segment([start, end], reach, 1.0);
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
        let run = Run {
            from,
            step: (ux, uy),
            length: narrow(length),
            bluntness: narrow(bluntness),
        };
        // Of an oblique line, a row meets only the strip as wide as the line's reach.
        let strip = (uy.abs() > 1e-6).then(|| (ux / uy, reach / uy.abs()));
        let rows = span(frame.top - reach, frame.bottom + reach, self.height);
        for top in (rows.start / TILE * TILE..rows.end).step_by(TILE) {
            let rows = rows.start.max(top)..rows.end.min(top + TILE);
            let (mut left, mut right) = (frame.left - reach, frame.right + reach);
            if let Some((slope, half)) = strip {
                let [first, last] =
                    [rows.start, rows.end - 1].map(|row| from[0] + (float(row) - from[1]) * slope);
                left = left.max(first.min(last) - half);
                right = right.min(first.max(last) + half);
            }
            let columns = span(left, right, self.width);
            for start in (columns.start / TILE * TILE..columns.end).step_by(TILE) {
                let tile = self.tile(start, top);
                for row in rows.clone() {
                    run.lower((start, row), tile.line_mut(row - top));
                }
            }
        }
    }

    /// Adds a circle, as far as `reach` from it.
    pub(super) fn circle(&mut self, [u, v]: [f64; 2], radius: f64, reach: f64) {
        let (outer, inner) = (radius + reach, (radius - reach).max(0.0));
        for row in span(v - outer, v + outer, self.height) {
            let y = float(row) - v;
            let half = (outer * outer - y * y).max(0.0).sqrt();
            let hole = (inner * inner - y * y).max(0.0).sqrt();
            let arc = Arc { u, y, radius };
            let sides = if hole > 0.0 {
                [(u - half, u - hole), (u + hole, u + half)]
            } else {
                [(u - half, u + half), (u, u)]
            };
            for (left, right) in sides {
                let columns = span(left, right, self.width);
                self.row(row, columns, |start, squares| arc.lower(start, squares));
            }
        }
    }

    /// The tiles that lines have come near to.
    pub(super) fn tiles(&self) -> &[Tile] {
        &self.tiles[..self.n_tiles]
    }

    /// Forgets all lines.
    pub(super) fn clear(&mut self) {
        for tile in &self.tiles[..self.n_tiles] {
            self.numbers[tile.row / TILE * self.across + tile.column / TILE] = 0;
        }
        self.n_tiles = 0;
    }

    /// Lowers the distances along a row, in all tiles that the columns touch.
    fn row(
        &mut self,
        row: usize,
        columns: std::ops::Range<usize>,
        lower: impl Fn(usize, &mut [f32; TILE]),
    ) {
        if columns.is_empty() {
            return;
        }
        for start in (columns.start / TILE * TILE..columns.end).step_by(TILE) {
            let tile = self.tile(start, row);
            lower(start, tile.line_mut(row % TILE));
        }
    }

    fn tile(&mut self, column: usize, row: usize) -> &mut Tile {
        let number = &mut self.numbers[row / TILE * self.across + column / TILE];
        if *number == 0 {
            if self.n_tiles == self.tiles.len() {
                self.tiles.push(Tile {
                    column: 0,
                    row: 0,
                    near: 0,
                    squares: [[f32::INFINITY; TILE]; TILE],
                });
            }
            let tile = &mut self.tiles[self.n_tiles];
            (tile.column, tile.row) = (column / TILE * TILE, row / TILE * TILE);
            tile.near = 0;
            self.n_tiles += 1;
            *number = u32::try_from(self.n_tiles).unwrap_or(u32::MAX);
        }
        &mut self.tiles[*number as usize - 1]
    }
}

impl Tile {
    /// The squared distances of the rows that a line has come near to, each with its row in the tile.
    pub(super) fn lines(&self) -> impl Iterator<Item = (usize, &[f32; TILE])> {
        let all = self.squares.iter().enumerate();
        all.filter(|(row, _)| self.near & (1 << row) != 0)
    }

    fn line_mut(&mut self, row: usize) -> &mut [f32; TILE] {
        let line = &mut self.squares[row];
        if self.near & (1 << row) == 0 {
            self.near |= 1 << row;
            *line = [f32::INFINITY; TILE];
        }
        line
    }
}

impl Line {
    /// How far from its middle the line has any colour, pixels.
    pub(super) fn reach(&self) -> f64 {
        self.halo_width.max(self.core_width) / 2.0 + 0.5
    }
}

/// A segment that pixels are seen from: along it and across from it.
struct Run {
    from: [f64; 2],
    /// Its direction.
    step: (f64, f64),
    length: f32,
    bluntness: f32,
}

impl Run {
    /// Lowers the squared distances of sixteen pixels from a column on: always all of a tile's row,
    /// so that the compiler can do many at once.
    fn lower(&self, (column, row): (usize, usize), squares: &mut [f32; TILE]) {
        let (x, y) = (float(column) - self.from[0], float(row) - self.from[1]);
        let along = narrow(x * self.step.0 + y * self.step.1);
        let across = narrow(x * self.step.1 - y * self.step.0);
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

/// A row of pixels seen from a circle's centre.
struct Arc {
    u: f64,
    y: f64,
    radius: f64,
}

impl Arc {
    /// As [`Run::lower`].
    fn lower(&self, column: usize, squares: &mut [f32; TILE]) {
        let (x, y) = (narrow(float(column) - self.u), narrow(self.y));
        let (y_square, radius) = (y * y, narrow(self.radius));
        for (square, index) in squares.iter_mut().zip(INDICES) {
            let x = x + index;
            let off = (x * x + y_square).sqrt() - radius;
            let here = off * off;
            *square = if here < *square { here } else { *square };
        }
    }
}

/// The columns of a tile.
const INDICES: [f32; TILE] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];

fn float(pixel: usize) -> f64 {
    f64::from(u32::try_from(pixel).unwrap_or(u32::MAX))
}

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

    /// Column, row and squared distance of every pixel that a line has come near to.
    fn squares_of(stencil: &Stencil) -> Vec<(usize, usize, f32)> {
        let of_tile = |tile: &Tile| {
            let line = |(row, line): (usize, &[f32; TILE])| {
                let (x, y) = (tile.column, tile.row + row);
                line.iter()
                    .enumerate()
                    .map(|(i, &square)| (x + i, y, square))
                    .collect::<Vec<_>>()
            };
            tile.lines().flat_map(line).collect::<Vec<_>>()
        };
        stencil.tiles().iter().flat_map(of_tile).collect()
    }

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
        for (x, y, square) in squares_of(&stencil) {
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
        let expected_near = (0..40u32)
            .flat_map(|y| (0..50u32).map(move |x| [f64::from(x), f64::from(y)]))
            .filter(|&p| segments.iter().any(|&s| distance(p, s) < 6.0))
            .count();
        assert_eq!(near, expected_near);
        stencil.clear();
        assert!(stencil.tiles().is_empty() && stencil.numbers.iter().all(|&n| n == 0));
    }

    #[test]
    fn distances_to_circles_are_those_of_the_formula() {
        for (centre, radius) in [
            ([20.3, 17.6], 12.25),
            ([25.0, 20.0], 2.0),
            ([-300.0, 20.0], 320.5),
        ] {
            let mut stencil = Stencil::new(50, 40);
            stencil.circle(centre, radius, 3.5);
            let mut squares = vec![f32::INFINITY; 50 * 40];
            for (x, y, square) in squares_of(&stencil) {
                if x < 50 && y < 40 {
                    squares[y * 50 + x] = square;
                }
            }
            let mut near = 0;
            for (index, &square) in squares.iter().enumerate() {
                let (x, y) = (float(index % 50), float(index / 50));
                let expected = ((x - centre[0]).hypot(y - centre[1]) - radius).abs();
                if expected < 3.5 {
                    near += 1;
                    assert!(
                        (f64::from(square).sqrt() - expected).abs() < 1e-3,
                        "{x} {y}"
                    );
                }
            }
            assert!(near > 50, "{near}");
        }
    }
}
