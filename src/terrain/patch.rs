//! The surface between four posts, and where a ray meets it.

/// The bilinear surface over one cell: `h = h00 + hx u + hy v + hxy u v` with `u`, `v` the column
/// and row from the cell's first post.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Column of the cell's first post.
    pub column: f64,
    /// Row of the cell's first post.
    pub row: f64,
    h00: f64,
    hx: f64,
    hy: f64,
    hxy: f64,
}

/// A quadratic `c + b s + a s^2`: how high a ray runs above a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic {
    pub c: f64,
    pub b: f64,
    pub a: f64,
}

impl Patch {
    /// From the heights of the posts (column, row), (column + 1, row), (column, row + 1) and
    /// (column + 1, row + 1); `None` where one of them is unknown.
    pub fn new(column: f64, row: f64, [p00, p10, p01, p11]: [f64; 4]) -> Option<Self> {
        let hxy = p00 - p10 - p01 + p11;
        hxy.is_finite().then_some(Self {
            column,
            row,
            h00: p00,
            hx: p10 - p00,
            hy: p01 - p00,
            hxy,
        })
    }

    /// The height at a place, metres.
    pub fn height_m(&self, [column, row]: [f64; 2]) -> f64 {
        let (u, v) = (column - self.column, row - self.row);
        self.h00 + self.hx * u + (self.hy + self.hxy * u) * v
    }

    /// How the height grows with column and row, metres a cell.
    pub fn gradient(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        let (u, v) = (column - self.column, row - self.row);
        [self.hx + self.hxy * v, self.hy + self.hxy * u]
    }

    /// The height along the line `start + step s`.
    pub fn along(&self, start: [f64; 2], step: [f64; 2]) -> Quadratic {
        let [gx, gy] = self.gradient(start);
        Quadratic {
            c: self.height_m(start),
            b: gx * step[0] + gy * step[1],
            a: self.hxy * step[0] * step[1],
        }
    }
}

impl Quadratic {
    /// The value at `s`.
    pub fn at(&self, s: f64) -> f64 {
        self.c + (self.b + self.a * s) * s
    }

    /// The slope at `s`.
    pub fn slope(&self, s: f64) -> f64 {
        self.b + 2.0 * self.a * s
    }

    /// The same curve counted from `s`.
    pub fn from(&self, s: f64) -> Self {
        Self {
            c: self.at(s),
            b: self.slope(s),
            a: self.a,
        }
    }

    /// Where on `[0, end]` the value is least.
    pub fn lowest(&self, end: f64) -> f64 {
        let inner = -self.b / (2.0 * self.a);
        if self.a > 0.0 && inner > 0.0 && inner < end {
            inner
        } else if self.at(end) < self.c {
            end
        } else {
            0.0
        }
    }

    /// The first `s` in `[0, end]` at which the value is not positive.
    pub fn first_not_positive(&self, end: f64) -> Option<f64> {
        if self.c <= 0.0 {
            return Some(0.0);
        }
        // Citardauq's form: the divisor cannot vanish for the first root from a positive start,
        // where the value must fall.
        let discriminant = self.b * self.b - 4.0 * self.a * self.c;
        if discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        let first = if self.b < 0.0 {
            2.0 * self.c / (root - self.b)
        } else if self.a < 0.0 {
            (self.b + root) / (-2.0 * self.a)
        } else {
            return None;
        };
        (first <= end).then_some(first)
    }
}

impl std::ops::Sub for Quadratic {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            c: self.c - other.c,
            b: self.b - other.b,
            a: self.a - other.a,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_between_posts_by_hand() {
        let patch = Patch::new(10.0, 20.0, [1.0, 3.0, 5.0, 11.0]).unwrap();
        assert_eq!(patch.height_m([10.0, 20.0]), 1.0);
        assert_eq!(patch.height_m([11.0, 21.0]), 11.0);
        // 0.75 * (0.5 * 1 + 0.5 * 3) + 0.25 * (0.5 * 5 + 0.5 * 11)
        assert_eq!(patch.height_m([10.5, 20.25]), 3.5);
        assert_eq!(patch.gradient([10.5, 20.25]), [3.0, 6.0]);
        assert!(Patch::new(0.0, 0.0, [1.0, 2.0, f64::NAN, 1.0]).is_none());
    }

    #[test]
    fn the_height_along_a_line_is_the_height_at_its_places() {
        let patch = Patch::new(1.0, 2.0, [1.0, 3.0, 5.0, 11.0]).unwrap();
        let (start, step) = ([1.1, 2.9], [0.7, -0.6]);
        let along = patch.along(start, step);
        for s in [0.0, 0.3, 0.8, 1.0] {
            let place = [start[0] + s * step[0], start[1] + s * step[1]];
            assert!((along.at(s) - patch.height_m(place)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_first_root_is_found_whatever_the_curve() {
        let root = |c, b, a| Quadratic { c, b, a }.first_not_positive(10.0);
        assert_eq!(root(6.0, -5.0, 1.0), Some(2.0)); // roots 2 and 3
        assert_eq!(root(6.0, 1.0, -1.0), Some(3.0)); // rises first: roots -2 and 3
        assert_eq!(root(6.0, -2.0, 0.0), Some(3.0));
        assert_eq!(root(1.0, 0.0, -0.25), Some(2.0));
        assert_eq!(root(6.0, 1.0, 0.0), None);
        assert_eq!(root(6.0, 5.0, 1.0), None); // both roots behind
        assert_eq!(root(1.0, -1.0, 1.0), None); // none
        assert_eq!(root(1.0, -0.05, 0.0), None); // at 20, beyond the end
        assert_eq!(root(-1.0, 1.0, 0.0), Some(0.0));
    }

    #[test]
    fn the_lowest_place_is_a_vertex_or_an_end() {
        let lowest = |c, b, a| Quadratic { c, b, a }.lowest(4.0);
        assert_eq!(lowest(6.0, -4.0, 1.0), 2.0);
        assert_eq!(lowest(6.0, -40.0, 1.0), 4.0);
        assert_eq!(lowest(6.0, 1.0, 1.0), 0.0);
        assert_eq!(lowest(6.0, 1.0, -1.0), 4.0);
    }
}
