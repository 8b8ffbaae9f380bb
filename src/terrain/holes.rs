//! The cells of a raster over which the ground is unknown.

use super::grid::HeightGrid;

/// Holes: connected sets of cells (by edge or corner) with an unknown post, as runs along rows.
///
/// A hole's ceiling is the highest known post that touches it. Where a ray runs above it, it is
/// taken to pass over the hole.
#[derive(Debug, Default)]
pub(super) struct Holes {
    runs: Vec<Run>,
    /// Where the runs of each row of cells begin, and their end; empty where there are none.
    rows: Vec<usize>,
    /// The ceiling of each run's hole, metres.
    ceilings: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    first: usize,
    last: usize,
}

impl Holes {
    /// The holes of a raster.
    pub fn new(grid: &HeightGrid) -> Self {
        let (runs, rows) = runs(grid);
        if runs.is_empty() {
            return Self::default();
        }
        let mut parent: Vec<usize> = (0..runs.len()).collect();
        for row in 1..rows.len() - 1 {
            join_rows(
                &runs,
                &mut parent,
                rows[row - 1]..rows[row],
                rows[row]..rows[row + 1],
            );
        }
        let mut highest = vec![f64::NEG_INFINITY; runs.len()];
        for row in 0..rows.len() - 1 {
            let own = rows[row]..rows[row + 1];
            for (index, run) in own.clone().zip(&runs[own]) {
                let root = root(&mut parent, index);
                for post_row in [row, row + 1] {
                    for column in run.first..=run.last + 1 {
                        // `max` passes over the NaN of unknown posts.
                        highest[root] = highest[root].max(grid.height_m(column, post_row));
                    }
                }
            }
        }
        let ceilings = (0..runs.len())
            .map(|index| highest[root(&mut parent, index)])
            .collect();
        Self {
            runs,
            rows,
            ceilings,
        }
    }

    /// The ceiling of the hole that holds a cell, metres (negative infinity where the raster knows
    /// nothing at all); `None` for a known cell.
    pub fn ceiling_m(&self, column: usize, row: usize) -> Option<f64> {
        let (&start, &end) = (self.rows.get(row)?, self.rows.get(row + 1)?);
        let runs = &self.runs[start..end];
        let index = runs.partition_point(|run| run.last < column);
        runs.get(index)
            .filter(|run| run.first <= column)
            .map(|_| self.ceilings[start + index])
    }
}

fn runs(grid: &HeightGrid) -> (Vec<Run>, Vec<usize>) {
    let unknown = |column: usize, row: usize| {
        !(grid.height_m(column, row).is_finite() && grid.height_m(column, row + 1).is_finite())
    };
    let mut runs: Vec<Run> = Vec::new();
    let mut rows = vec![0];
    for row in 0..grid.rows() - 1 {
        let begin = runs.len();
        for column in 0..grid.columns() - 1 {
            if unknown(column, row) || unknown(column + 1, row) {
                match runs[begin..].last_mut() {
                    Some(run) if run.last + 1 == column => run.last = column,
                    _ => runs.push(Run {
                        first: column,
                        last: column,
                    }),
                }
            }
        }
        rows.push(runs.len());
    }
    (runs, rows)
}

/// Joins the runs of one row with those of the next that touch them.
fn join_rows(
    runs: &[Run],
    parent: &mut [usize],
    above: std::ops::Range<usize>,
    below: std::ops::Range<usize>,
) {
    let (mut i, mut j) = (above.start, below.start);
    while i < above.end && j < below.end {
        let (a, b) = (runs[i], runs[j]);
        if a.first <= b.last + 1 && b.first <= a.last + 1 {
            let (p, q) = (root(parent, i), root(parent, j));
            parent[p.max(q)] = p.min(q);
        }
        if a.last < b.last {
            i += 1;
        } else {
            j += 1;
        }
    }
}

fn root(parent: &mut [usize], mut index: usize) -> usize {
    while parent[index] != index {
        parent[index] = parent[parent[index]];
        index = parent[index];
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{Affine, Posts};

    fn grid(rows: &[&str]) -> HeightGrid {
        let heights = rows
            .iter()
            .flat_map(|row| row.bytes())
            .map(|b| match b {
                b'.' => f32::NAN,
                digit => f32::from(digit - b'0'),
            })
            .collect();
        let map = Affine::north_up(0.0, 0.0, 1.0);
        HeightGrid::new(
            rows[0].len(),
            rows.len(),
            Posts::F32(heights),
            map,
            "EPSG:32632",
        )
        .unwrap()
    }

    #[test]
    fn a_whole_raster_has_none() {
        let holes = Holes::new(&grid(&["123", "456"]));
        assert_eq!(holes.ceiling_m(0, 0), None);
    }

    #[test]
    fn one_post_opens_four_cells_under_the_highest_neighbour() {
        let holes = Holes::new(&grid(&["11111", "12119", "11.11", "11511", "11111"]));
        for (column, row, expected) in [
            (1, 1, Some(5.0)),
            (2, 2, Some(5.0)),
            (0, 1, None),
            (3, 1, None),
            (1, 3, None),
        ] {
            assert_eq!(holes.ceiling_m(column, row), expected, "{column} {row}");
        }
    }

    #[test]
    fn holes_that_touch_are_one_and_others_are_not() {
        // A U: its arms join in the lowest row, after both have begun.
        let joined = Holes::new(&grid(&[
            "7111111", "1.111.1", "1.111.1", "1.....1", "1111111",
        ]));
        assert_eq!(joined.ceiling_m(5, 0), Some(7.0));
        assert_eq!(joined.ceiling_m(0, 0), Some(7.0));
        let apart = Holes::new(&grid(&["7111111", "1.111.1", "1111111"]));
        assert_eq!(apart.ceiling_m(0, 0), Some(7.0));
        assert_eq!(apart.ceiling_m(5, 0), Some(1.0));
        assert_eq!(apart.ceiling_m(3, 0), None);
    }
}
