//! Rasters of heights and where their posts stand in a map.

/// A regular raster of heights, tied to a coordinate reference system.
///
/// Heights are samples at points, the posts; post (0, 0) is the first of the first row. Where a
/// height is unknown it is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightGrid {
    columns: usize,
    rows: usize,
    posts: Posts,
    crs_from_post: Affine,
    crs: String,
    above: HeightsAbove,
}

/// What a raster's heights are above.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum HeightsAbove {
    /// The file does not say: what the run's heights are above.
    #[default]
    Unsaid,
    /// The ellipsoid.
    Ellipsoid,
    /// The zero of a vertical CRS, by its code.
    Datum(String),
    /// The horizontal plane at the site's origin, in which the raster's coordinates are metres east and
    /// north of it; then the raster names no CRS.
    SiteOrigin,
}

/// The heights of a raster, metres, row by row, NaN where unknown.
#[derive(Debug, Clone)]
pub enum Posts {
    /// In single precision, as most files hold them.
    F32(Vec<f32>),
    /// In double precision.
    F64(Vec<f64>),
}

/// Planar coordinates of a CRS (degrees where it is geographic) from a post's column and row:
/// `x = x0 + x_column column + x_row row`, and the same for `y`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// First coordinate of post (0, 0).
    pub x0: f64,
    /// How the first coordinate grows with the column.
    pub x_column: f64,
    /// How the first coordinate grows with the row.
    pub x_row: f64,
    /// Second coordinate of post (0, 0).
    pub y0: f64,
    /// How the second coordinate grows with the column.
    pub y_column: f64,
    /// How the second coordinate grows with the row.
    pub y_row: f64,
}

/// What is wrong with a raster.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Too small to interpolate in, or not as many heights as posts.
    #[error(
        "found {heights} heights for {columns} x {rows} posts, expected at least 2 x 2, one height a post"
    )]
    Size {
        /// Heights given.
        heights: usize,
        /// Posts in a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// The posts do not span a plane.
    #[error(
        "found georeferencing that puts all posts on one line, expected one that spans an area"
    )]
    Degenerate,
}

impl HeightGrid {
    /// A raster from its heights, row by row.
    ///
    /// # Errors
    /// [`GridError`] where it is smaller than 2 x 2 posts, where the number of heights is not that
    /// of the posts, and where the posts span no area.
    pub fn new(
        columns: usize,
        rows: usize,
        posts: Posts,
        crs_from_post: Affine,
        crs: impl Into<String>,
    ) -> Result<Self, GridError> {
        let heights = posts.len();
        if columns < 2 || rows < 2 || columns.checked_mul(rows) != Some(heights) {
            return Err(GridError::Size {
                heights,
                columns,
                rows,
            });
        }
        crs_from_post.inverse().ok_or(GridError::Degenerate)?;
        Ok(Self {
            columns,
            rows,
            posts,
            crs_from_post,
            crs: crs.into(),
            above: HeightsAbove::Unsaid,
        })
    }

    /// The same raster, with what its heights are above.
    #[must_use]
    pub fn with_heights_above(self, above: HeightsAbove) -> Self {
        Self { above, ..self }
    }

    /// What its heights are above.
    pub fn heights_above(&self) -> &HeightsAbove {
        &self.above
    }

    /// Posts in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of posts.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// All heights, row by row.
    pub fn posts(&self) -> &Posts {
        &self.posts
    }

    /// The height of a post, metres, NaN where unknown.
    pub fn height_m(&self, column: usize, row: usize) -> f64 {
        self.posts.get(row * self.columns + column)
    }

    /// Where the posts stand in the CRS.
    pub fn crs_from_post(&self) -> Affine {
        self.crs_from_post
    }

    /// The definition of the CRS, as PROJ understands it.
    pub fn crs(&self) -> &str {
        &self.crs
    }

    /// As many posts with other heights, elsewhere.
    pub(super) fn on_map(self, posts: Posts, crs_from_post: Affine, crs: String) -> Self {
        Self {
            posts,
            crs_from_post,
            crs,
            ..self
        }
    }

    /// The part between two columns and two rows, all included.
    pub(super) fn window(&self, columns: (usize, usize), rows: (usize, usize)) -> Self {
        let indices = || {
            (rows.0..=rows.1)
                .flat_map(|row| (columns.0..=columns.1).map(move |c| row * self.columns + c))
        };
        let posts = match &self.posts {
            Posts::F32(all) => Posts::F32(indices().map(|i| all[i]).collect()),
            Posts::F64(all) => Posts::F64(indices().map(|i| all[i]).collect()),
        };
        Self {
            columns: columns.1 - columns.0 + 1,
            rows: rows.1 - rows.0 + 1,
            posts,
            crs_from_post: self.crs_from_post.moved(columns.0, rows.0),
            crs: self.crs.clone(),
            above: self.above.clone(),
        }
    }
}

impl Posts {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(all) => all.len(),
            Self::F64(all) => all.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The height at an index, metres.
    pub fn get(&self, index: usize) -> f64 {
        match self {
            Self::F32(all) => f64::from(all[index]),
            Self::F64(all) => all[index],
        }
    }
}

/// Two rasters hold the same heights where the same posts are unknown and the others are equal.
impl PartialEq for Posts {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len()
            && (0..self.len()).all(|i| {
                let (a, b) = (self.get(i), other.get(i));
                a == b || (a.is_nan() && b.is_nan())
            })
    }
}

impl Affine {
    /// Rows that run from west to east and follow each other from north to south, as maps have
    /// them: post (0, 0) at `(west, north)`, its neighbours `step` apart.
    pub fn north_up(west: f64, north: f64, step: f64) -> Self {
        Self::north_up_by([west, north], [step, step])
    }

    /// The same with a step to the east and another to the south.
    pub fn north_up_by([west, north]: [f64; 2], [east, south]: [f64; 2]) -> Self {
        Self {
            x0: west,
            x_column: east,
            x_row: 0.0,
            y0: north,
            y_column: 0.0,
            y_row: -south,
        }
    }

    /// The coordinates of a place between the posts.
    pub fn apply(&self, column: f64, row: f64) -> (f64, f64) {
        (
            self.x0 + self.x_column * column + self.x_row * row,
            self.y0 + self.y_column * column + self.y_row * row,
        )
    }

    /// The map back, from coordinates to column and row; `None` where the posts span no area.
    pub fn inverse(&self) -> Option<Affine> {
        let det = self.x_column * self.y_row - self.x_row * self.y_column;
        let size =
            (self.x_column.abs() + self.x_row.abs()) * (self.y_column.abs() + self.y_row.abs());
        let finite = size.is_finite() && self.x0.is_finite() && self.y0.is_finite();
        (finite && size > 0.0 && det.abs() > 1e-12 * size).then(|| {
            let (a, b) = (self.y_row / det, -self.x_row / det);
            let (c, d) = (-self.y_column / det, self.x_column / det);
            Affine {
                x0: -(a * self.x0 + b * self.y0),
                x_column: a,
                x_row: b,
                y0: -(c * self.x0 + d * self.y0),
                y_column: c,
                y_row: d,
            }
        })
    }

    /// Column and row of a place, through the inverse's linear part: differences are taken first,
    /// so that northings of millions of metres cost no digits.
    pub(super) fn solve(&self, inverse: &Affine, x: f64, y: f64) -> [f64; 2] {
        let (dx, dy) = (x - self.x0, y - self.y0);
        [
            inverse.x_column * dx + inverse.x_row * dy,
            inverse.y_column * dx + inverse.y_row * dy,
        ]
    }

    /// The same map with another post as (0, 0).
    #[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
    fn moved(&self, column: usize, row: usize) -> Self {
        let (x0, y0) = self.apply(column as f64, row as f64);
        Self { x0, y0, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotated_map_is_undone_by_its_inverse() {
        let map = Affine {
            x0: 456_054.0,
            x_column: 1.6,
            x_row: 1.2,
            y0: 5_427_824.0,
            y_column: 1.2,
            y_row: -1.6,
        };
        let inverse = map.inverse().unwrap();
        let (x, y) = map.apply(17.25, 40.5);
        let [column, row] = map.solve(&inverse, x, y);
        assert!((column - 17.25).abs() < 1e-9 && (row - 40.5).abs() < 1e-9);
        let (column, row) = inverse.apply(x, y);
        assert!((column - 17.25).abs() < 1e-6 && (row - 40.5).abs() < 1e-6);
    }

    #[test]
    fn rasters_that_cannot_be_are_refused() {
        let map = Affine::north_up(0.0, 0.0, 1.0);
        let error = HeightGrid::new(3, 2, Posts::F32(vec![0.0; 5]), map, "EPSG:32632").unwrap_err();
        assert_eq!(
            error.to_string(),
            "found 5 heights for 3 x 2 posts, expected at least 2 x 2, one height a post"
        );
        let line = Affine { y_row: 0.0, ..map };
        let error =
            HeightGrid::new(2, 2, Posts::F64(vec![0.0; 4]), line, "EPSG:32632").unwrap_err();
        assert_eq!(
            error.to_string(),
            "found georeferencing that puts all posts on one line, expected one that spans an area"
        );
    }

    #[test]
    fn a_window_keeps_its_place() {
        let heights: Vec<f32> = (0u8..20).map(f32::from).collect();
        let map = Affine::north_up(100.0, 200.0, 2.0);
        let grid = HeightGrid::new(5, 4, Posts::F32(heights), map, "EPSG:32632").unwrap();
        let part = grid.window((1, 3), (2, 3));
        assert_eq!((part.columns(), part.rows()), (3, 2));
        assert_eq!(part.height_m(0, 0), grid.height_m(1, 2));
        assert_eq!(part.height_m(2, 1), grid.height_m(3, 3));
        assert_eq!(part.crs_from_post().apply(0.0, 0.0), map.apply(1.0, 2.0));
    }
}
