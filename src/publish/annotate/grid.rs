//! Which parts of the picture are taken.

use super::style::{Frame, Style};

/// A coarse raster of the picture that remembers where marks lie.
pub(super) struct Grid {
    cell: f64,
    columns: usize,
    rows: usize,
    cells: Vec<Use>,
}

/// What lies in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    Free,
    /// A thin line: writing over it is to be avoided.
    Crossed,
    /// A ring, a label or the legend: nothing is written here.
    Taken,
}

impl Grid {
    pub(super) fn new(style: &Style) -> Self {
        let cell = (2.0 * style.unit).max(2.0);
        let columns = whole(style.width / cell) + 1;
        let rows = whole(style.height / cell) + 1;
        Self {
            cell,
            columns,
            rows,
            cells: vec![Use::Free; columns * rows],
        }
    }

    /// Takes all of a rectangle.
    pub(super) fn take(&mut self, frame: Frame) {
        self.put(frame, Use::Taken);
    }

    /// Takes all of a disc.
    pub(super) fn take_disc(&mut self, [u, v]: [f64; 2], radius: f64) {
        let mut y = -radius;
        while y <= radius {
            let half = (radius * radius - y * y).max(0.0).sqrt();
            self.take(Frame {
                left: u - half,
                top: v + y,
                right: u + half,
                bottom: v + y,
            });
            y += self.cell * 0.5;
        }
    }

    /// Takes the points of a line.
    pub(super) fn take_points(&mut self, points: &[[f64; 2]]) {
        self.points(points, Use::Taken);
    }

    /// Notes that a closed thin line passes.
    pub(super) fn cross(&mut self, points: &[[f64; 2]]) {
        self.points(points, Use::Crossed);
    }

    /// How much of a rectangle is crossed, in cells, or `None` where some of it is taken.
    pub(super) fn cost(&self, frame: Frame) -> Option<usize> {
        let mut crossed = 0;
        for cells in self.inside(frame) {
            for cell in cells {
                match cell {
                    Use::Free => {}
                    Use::Crossed => crossed += 1,
                    Use::Taken => return None,
                }
            }
        }
        Some(crossed)
    }

    /// How much of a rectangle is not free, in cells.
    pub(super) fn crowd(&self, frame: Frame) -> usize {
        let not_free = |cells: &[Use]| cells.iter().filter(|&&cell| cell != Use::Free).count();
        self.inside(frame).map(not_free).sum()
    }

    /// The cells of a rectangle, row by row.
    fn inside(&self, frame: Frame) -> impl Iterator<Item = &[Use]> {
        let (columns, rows) = self.span(frame);
        rows.map(move |row| &self.cells[row * self.columns..][columns.clone()])
    }

    fn points(&mut self, points: &[[f64; 2]], how: Use) {
        let view = Frame {
            left: 0.0,
            top: 0.0,
            right: self.cell * whole_to_f64(self.columns),
            bottom: self.cell * whole_to_f64(self.rows),
        };
        for (index, &from) in points.iter().enumerate() {
            let to = points[(index + 1) % points.len()];
            if Frame::about(&[from, to]).is_none_or(|about| !about.meets(&view)) {
                continue;
            }
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let length = (dx * dx + dy * dy).sqrt();
            let steps = (length / self.cell).ceil().max(1.0);
            let mut step = 0.0;
            while step < steps {
                let share = step / steps;
                self.put_at([from[0] + dx * share, from[1] + dy * share], how);
                step += 1.0;
            }
        }
    }

    fn put_at(&mut self, at: [f64; 2], how: Use) {
        if at[0] >= 0.0 && at[1] >= 0.0 {
            let [column, row] = at.map(|x| whole((x + 0.5) / self.cell));
            if column < self.columns && row < self.rows {
                let cell = &mut self.cells[row * self.columns + column];
                *cell = how.max(*cell);
            }
        }
    }

    fn put(&mut self, frame: Frame, how: Use) {
        let (columns, rows) = self.span(frame);
        for row in rows {
            for cell in &mut self.cells[row * self.columns..][columns.clone()] {
                *cell = how.max(*cell);
            }
        }
    }

    /// Columns and rows that a rectangle touches.
    fn span(&self, frame: Frame) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let range = |from: f64, to: f64, count: usize| {
            let start = whole((from + 0.5) / self.cell).min(count);
            let end = if to < -0.5 {
                0
            } else {
                (whole((to + 0.5) / self.cell) + 1).min(count)
            };
            start..end.max(start)
        };
        (
            range(frame.left, frame.right, self.columns),
            range(frame.top, frame.bottom, self.rows),
        )
    }
}

/// The whole part, zero for what is less or not a number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, which is what is wanted"
)]
pub(super) fn whole(value: f64) -> usize {
    value as usize
}

fn whole_to_f64(value: usize) -> f64 {
    u32::try_from(value).map_or(f64::MAX, f64::from)
}
