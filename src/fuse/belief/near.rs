//! Objects near a place: a grid of buckets that follows them as they move.

use std::collections::HashMap;

/// Objects by the cell of the ground they lie in.
#[derive(Debug, Clone)]
pub(super) struct Buckets {
    cell_m: f64,
    /// Only looked up, never walked: the order of a map of hashes is nobody's.
    cells: HashMap<(i64, i64), Vec<usize>>,
    of: Vec<(i64, i64)>,
}

impl Buckets {
    pub(super) fn new(cell_m: f64) -> Self {
        Self {
            cell_m,
            cells: HashMap::new(),
            of: Vec::new(),
        }
    }

    pub(super) fn over<'a>(cell_m: f64, objects: impl Iterator<Item = &'a [f64; 4]>) -> Self {
        let mut buckets = Self::new(cell_m);
        for (k, x) in objects.enumerate() {
            buckets.put(k, x[0], x[1]);
        }
        buckets
    }

    #[expect(clippy::cast_possible_truncation, reason = "a site spans few cells")]
    fn cell(&self, east_m: f64, north_m: f64) -> (i64, i64) {
        let at = |x: f64| (x / self.cell_m).floor().clamp(-1e15, 1e15) as i64;
        (at(east_m), at(north_m))
    }

    /// Puts the next object, or moves one.
    pub(super) fn put(&mut self, k: usize, east_m: f64, north_m: f64) {
        let cell = self.cell(east_m, north_m);
        if let Some(old) = self.of.get(k).copied() {
            if old == cell {
                return;
            }
            if let Some(list) = self.cells.get_mut(&old) {
                list.retain(|&other| other != k);
            }
            self.of[k] = cell;
        } else {
            self.of.push(cell);
        }
        self.cells.entry(cell).or_default().push(k);
    }

    /// Objects in the cells that a square about a place touches, ascending.
    pub(super) fn about(&self, east_m: f64, north_m: f64, reach_m: f64) -> Vec<usize> {
        let low = self.cell(east_m - reach_m, north_m - reach_m);
        let high = self.cell(east_m + reach_m, north_m + reach_m);
        let mut found = Vec::new();
        for i in low.0..=high.0 {
            for j in low.1..=high.1 {
                if let Some(list) = self.cells.get(&(i, j)) {
                    found.extend_from_slice(list);
                }
            }
        }
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_objects() {
        let places = [[0.0; 4], [5.0, 5.0, 0.0, 0.0], [-30.0, 2.0, 0.0, 0.0]];
        let mut buckets = Buckets::over(4.0, places.iter());
        assert_eq!(buckets.about(1.0, 1.0, 5.0), [0, 1]);
        buckets.put(2, 1.0, -3.0);
        buckets.put(0, 100.0, 0.0);
        assert_eq!(buckets.about(1.0, 1.0, 5.0), [1, 2]);
    }
}
