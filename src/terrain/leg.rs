//! Short stretches of a ray, over the ellipsoid and over the cells of a raster.

use crate::frame::Geodetic;

use super::patch::Quadratic;

/// A stretch of a ray from `t0` to `t1` metres; along it `s` runs from 0 to 1.
pub(super) struct Leg {
    pub t0: f64,
    pub t1: f64,
    pub start: Geodetic,
    pub end: Geodetic,
    /// Height above the ellipsoid, metres, by `s`.
    pub height: Quadratic,
}

impl Leg {
    /// From the two ends and how the height grows at the first, metres a metre.
    pub fn new((t0, start): (f64, Geodetic), (t1, end): (f64, Geodetic), slope: f64) -> Self {
        let b = slope * (t1 - t0);
        Self {
            t0,
            t1,
            start,
            end,
            height: Quadratic {
                c: start.height_m,
                b,
                a: end.height_m - start.height_m - b,
            },
        }
    }

    /// Length, metres.
    pub fn length_m(&self) -> f64 {
        self.t1 - self.t0
    }

    /// Distance along the ray, metres.
    pub fn t(&self, s: f64) -> f64 {
        self.t0 + s * self.length_m()
    }

    /// The lowest height on a part of it, metres.
    pub fn lowest_m(&self, s0: f64, s1: f64) -> f64 {
        let part = self.height.from(s0);
        part.at(part.lowest(s1 - s0))
    }
}

/// A leg in a raster: column and row are `start + step s`, but for a bend.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub start: [f64; 2],
    pub step: [f64; 2],
    /// What the bend is worth at most, cells.
    pub bend: f64,
    /// What it is worth at most in the height of the ray above the surface, metres.
    pub slack_m: f64,
}

impl Line {
    /// Column and row.
    pub fn at(&self, s: f64) -> [f64; 2] {
        [0, 1].map(|i| self.start[i] + s * self.step[i])
    }

    /// The part of `[s0, s1]` that lies over a raster whose last post is at `last`.
    pub fn clip(&self, last: [f64; 2], s0: f64, s1: f64) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (s0, s1);
        for (i, &last) in last.iter().enumerate() {
            if self.step[i] == 0.0 {
                if self.start[i] < 0.0 || self.start[i] > last {
                    return None;
                }
                continue;
            }
            let a = -self.start[i] / self.step[i];
            let b = (last - self.start[i]) / self.step[i];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter < leave).then_some((enter, leave))
    }
}

/// The blocks of cells a line passes, one after the other.
pub(super) struct Blocks {
    line: Line,
    /// Number of cells in a row and in a column.
    cells: [usize; 2],
    /// The cell the line is in.
    pub cell: [usize; 2],
    /// Where on the line.
    pub s: f64,
    end: f64,
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "positions are clamped onto the raster, which has under 2^53 cells"
)]
impl Blocks {
    /// From `s0` to `s1` of a line over a raster whose last post is at `last`.
    pub fn new(last: [f64; 2], line: Line, s0: f64, s1: f64) -> Self {
        let position = line.at(s0);
        Self {
            line,
            cells: last.map(|last| last as usize),
            cell: [0, 1].map(|i| position[i].clamp(0.0, last[i] - 1.0) as usize),
            s: s0,
            end: s1,
        }
    }

    /// Where the line leaves the block of a level that holds its cell.
    pub fn exit(&self, level: u32) -> f64 {
        self.exit_by(level).0
    }

    /// Goes on to the next block; false at the end.
    pub fn advance(&mut self, level: u32) -> bool {
        let (s, Some(axis)) = self.exit_by(level) else {
            return false;
        };
        let other = 1 - axis;
        let (low, high) = self.block(level, axis);
        if self.line.step[axis] > 0.0 {
            self.cell[axis] = high;
        } else if low == 0 {
            return false;
        } else {
            self.cell[axis] = low - 1;
        }
        if self.cell[axis] >= self.cells[axis] {
            return false;
        }
        // Rounding must not carry the line out of a block sideways.
        let (low, high) = self.block(level, other);
        let sideways = self.line.start[other] + s * self.line.step[other];
        self.cell[other] = (sideways.max(0.0) as usize).clamp(low, high - 1);
        self.s = s;
        true
    }

    /// Where the line leaves a block, and by which axis; none where it ends before.
    fn exit_by(&self, level: u32) -> (f64, Option<usize>) {
        let mut exit = (self.end, None);
        for axis in 0..2 {
            let (low, high) = self.block(level, axis);
            let step = self.line.step[axis];
            if step == 0.0 {
                continue;
            }
            let border = if step > 0.0 { high } else { low } as f64;
            let s = (border - self.line.start[axis]) / step;
            if s < exit.0 {
                exit = (s, Some(axis));
            }
        }
        (exit.0.max(self.s), exit.1)
    }

    /// The first cell of a block along an axis, and the one after its last.
    fn block(&self, level: u32, axis: usize) -> (usize, usize) {
        let low = self.cell[axis] >> level << level;
        (low, (low + (1 << level)).min(self.cells[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the line lies among positive columns and rows"
    )]
    fn whole(position: f64) -> usize {
        position as usize
    }

    #[test]
    fn every_cell_on_the_way_is_visited_once() {
        let line = Line {
            start: [0.5, 4.75],
            step: [6.0, -4.0],
            bend: 0.0,
            slack_m: 0.0,
        };
        let mut blocks = Blocks::new([7.0, 5.0], line, 0.0, 1.0);
        let mut cells = vec![blocks.cell];
        while blocks.advance(0) {
            cells.push(blocks.cell);
        }
        let mut expected: Vec<[usize; 2]> = (0..100_000u32)
            .map(|i| line.at(f64::from(i) / 1e5))
            .map(|place| place.map(whole))
            .collect();
        expected.dedup();
        assert_eq!(cells, expected);
        assert_eq!(blocks.exit(0), 1.0);
    }

    #[test]
    fn a_line_is_cut_to_the_raster() {
        let line = Line {
            start: [-2.0, 1.0],
            step: [8.0, 0.0],
            bend: 0.0,
            slack_m: 0.0,
        };
        assert_eq!(line.clip([4.0, 3.0], 0.0, 1.0), Some((0.25, 0.75)));
        assert_eq!(line.clip([4.0, 0.5], 0.0, 1.0), None);
        assert_eq!(line.clip([4.0, 3.0], 0.8, 1.0), None);
    }
}
