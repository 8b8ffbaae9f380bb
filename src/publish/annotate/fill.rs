//! Coverage of polygons, row by row.

use super::grid::whole;

/// Lines that each row of pixels is sampled on; across them coverage is exact.
const LINES: u32 = 4;

/// Gives every run of pixels that the even-odd interior of the rings covers alike: its row, its
/// columns and its coverage, over 0 to 1. Coordinates are pixels, integers their centres.
pub(super) fn even_odd(
    rings: &[Vec<[f64; 2]>],
    (width, height): (u32, u32),
    mut run: impl FnMut(usize, std::ops::Range<usize>, f64),
) {
    let mut edges: Vec<Edge> = rings
        .iter()
        .flat_map(|ring| (0..ring.len()).map(|i| Edge::new(ring[i], ring[(i + 1) % ring.len()])))
        .filter(|edge| edge.top < edge.bottom)
        .collect();
    edges.sort_by(|a, b| a.top.total_cmp(&b.top));
    let (mut next, mut active) = (0, Vec::new());
    let mut crossings = Vec::new();
    let mut events = Vec::new();
    for row in 0..height {
        let top = f64::from(row) - 0.5;
        while edges.get(next).is_some_and(|edge| edge.top < top + 1.0) {
            active.push(edges[next]);
            next += 1;
        }
        active.retain(|edge: &Edge| edge.bottom > top);
        events.clear();
        for line in 0..LINES {
            let y = top + (f64::from(line) + 0.5) / f64::from(LINES);
            crossings.clear();
            crossings.extend(active.iter().filter_map(|edge| edge.crossing(y)));
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let ends = [pair[0], pair[1]].map(|x| (x + 0.5).clamp(0.0, f64::from(width)));
                events.push((ends[0], 1));
                events.push((ends[1], -1));
            }
        }
        events.sort_by(|a: &(f64, i32), b| a.0.total_cmp(&b.0));
        cover(&events, |columns, coverage| {
            run(row as usize, columns, coverage);
        });
    }
}

/// Integrates the number of sampling lines that are inside over each pixel of a row.
fn cover(events: &[(f64, i32)], mut run: impl FnMut(std::ops::Range<usize>, f64)) {
    let mut at = 0.0;
    let mut inside = 0;
    let mut gathered = 0.0; // of the pixel that `at` lies in
    for &(x, step) in events {
        let level = f64::from(inside) / f64::from(LINES);
        if whole(x) > whole(at) {
            let pixel = whole(at);
            gathered += level * (at.floor() + 1.0 - at);
            if gathered > 0.0 {
                run(pixel..pixel + 1, gathered);
            }
            if level > 0.0 && whole(x) > pixel + 1 {
                run(pixel + 1..whole(x), level);
            }
            gathered = level * (x - x.floor());
        } else {
            gathered += level * (x - at);
        }
        at = x;
        inside += step;
    }
    if gathered > 0.0 {
        run(whole(at)..whole(at) + 1, gathered);
    }
}

/// A side of a polygon, from its upper end to its lower.
#[derive(Debug, Clone, Copy)]
struct Edge {
    top: f64,
    bottom: f64,
    x_top: f64,
    slope: f64,
}

impl Edge {
    fn new(a: [f64; 2], b: [f64; 2]) -> Self {
        let (upper, lower) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        Self {
            top: upper[1],
            bottom: lower[1],
            x_top: upper[0],
            slope: (lower[0] - upper[0]) / (lower[1] - upper[1]),
        }
    }

    fn crossing(&self, y: f64) -> Option<f64> {
        let x = self.x_top + (y - self.top) * self.slope;
        (self.top <= y && y < self.bottom).then_some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered(rings: &[Vec<[f64; 2]>]) -> Vec<f64> {
        let mut pixels = vec![0.0; 20 * 10];
        even_odd(rings, (20, 10), |row, columns, coverage| {
            for column in columns {
                assert_eq!(pixels[row * 20 + column], 0.0, "each pixel once");
                pixels[row * 20 + column] = coverage;
            }
        });
        pixels
    }

    fn block(left: f64, top: f64, right: f64, bottom: f64) -> Vec<[f64; 2]> {
        vec![[left, top], [right, top], [right, bottom], [left, bottom]]
    }

    #[test]
    fn a_block_covers_its_pixels_by_their_shares() {
        let pixels = covered(&[block(1.75, 0.5, 4.0, 2.0)]);
        let row = |row: usize| &pixels[row * 20 + 1..row * 20 + 6];
        assert_eq!(row(0), [0.0; 5]);
        assert_eq!(row(1), [0.0, 0.75, 1.0, 0.5, 0.0]);
        assert_eq!(row(2), [0.0, 0.375, 0.5, 0.25, 0.0]);
        assert_eq!(row(3), [0.0; 5]);
    }

    #[test]
    fn holes_and_overlaps_are_even_odd() {
        let rings = [
            block(-0.5, -0.5, 9.5, 9.5),
            block(2.5, 2.5, 5.5, 5.5),
            block(7.5, -0.5, 30.0, 9.5),
        ];
        let pixels = covered(&rings);
        let at = |x: usize, y: usize| pixels[y * 20 + x];
        assert_eq!((at(0, 0), at(3, 3), at(6, 4)), (1.0, 0.0, 1.0));
        assert_eq!(
            (at(8, 4), at(9, 9), at(10, 4), at(19, 9)),
            (0.0, 0.0, 1.0, 1.0)
        );
    }

    #[test]
    fn a_slanted_shape_covers_its_area() {
        let triangle = vec![[1.0, 0.3], [17.2, 4.1], [5.5, 8.9]];
        let area = ((17.2f64 - 1.0) * (8.9 - 0.3) - (5.5 - 1.0) * (4.1 - 0.3)) / 2.0;
        let sum: f64 = covered(&[triangle]).iter().sum();
        assert!((sum - area).abs() < 0.1, "{sum} {area}");
    }
}
