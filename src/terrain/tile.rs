//! One raster made ready for rays: its map projection, its blocks and its holes.

use crate::frame::{Crs, CrsError, Direction, Enu, Geodetic, LocalEnu, Point, Site, Vector};

use super::grid::{Affine, HeightGrid};
use super::holes::Holes;
use super::patch::Patch;
use super::pyramid::Pyramid;

/// Farther than this from the site's origin no ground is looked at, metres.
const KEPT_M: f64 = 1.5 * Site::REACH_M;

/// A place this far outside the outermost posts still counts as on them, in cells: rounding of
/// the map projection must not push a place off its edge.
const EDGE: f64 = 1e-7;

/// A raster, the way from a place to its posts, and what rays need to pass over it fast.
#[derive(Debug)]
pub(super) struct Tile {
    /// Of the raster in the list given, or of the first of those it was joined from.
    pub number: usize,
    grid: HeightGrid,
    crs: Crs,
    post_from_crs: Affine,
    /// The middle longitude, degrees, where the raster is in longitude and latitude: places are
    /// taken at the turn nearest to it.
    middle_deg: Option<f64>,
    pub pyramid: Pyramid,
    pub holes: Holes,
    /// How much straight lines bend in the raster, cells a square metre; an upper bound.
    pub bend: f64,
    /// Steps of this length or more, in cells, lead round the planet.
    pub half_turn: f64,
    /// The greatest step between neighbouring posts, metres.
    pub step_m: f64,
    /// The highest and the lowest known post, metres.
    pub top_m: f64,
    pub bottom_m: f64,
}

impl Tile {
    /// Makes a raster ready; `under_holes_m` is the highest of what shows through its holes.
    ///
    /// # Errors
    /// [`CrsError`] where PROJ does not know the raster's CRS on the site's planet.
    pub fn new(
        site: &Site,
        number: usize,
        grid: HeightGrid,
        under_holes_m: f64,
    ) -> Result<Self, CrsError> {
        let crs = Crs::new(grid.crs(), site.planet())?;
        let middle_deg = middle_longitude_deg(site, &crs, &grid);
        let grid = crop(site, &crs, middle_deg, grid);
        // The constructor of the raster has seen the inverse exist.
        let post_from_crs = grid
            .crs_from_post()
            .inverse()
            .unwrap_or(grid.crs_from_post());
        let holes = Holes::new(&grid);
        let pyramid = Pyramid::new(&grid, &holes, under_holes_m);
        let (bottom_m, top_m, step_m) = extremes(&grid);
        let mut tile = Self {
            number,
            grid,
            crs,
            post_from_crs,
            middle_deg,
            pyramid,
            holes,
            bend: 0.0,
            half_turn: f64::INFINITY,
            step_m,
            top_m,
            bottom_m,
        };
        tile.bend = tile.greatest_bend(site);
        if middle_deg.is_some() {
            let map = tile.grid.crs_from_post();
            tile.half_turn = 180.0 / map.x_column.abs().max(map.x_row.abs());
        }
        Ok(tile)
    }

    /// Greatest column and row of a place on the raster: those of the last post.
    #[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
    pub fn last(&self) -> [f64; 2] {
        [
            (self.grid.columns() - 1) as f64,
            (self.grid.rows() - 1) as f64,
        ]
    }

    /// Column and row, in and around the raster, of a place; `None` where its map does not reach.
    pub fn position(&self, place: Geodetic) -> Option<[f64; 2]> {
        position(
            &self.crs,
            &self.grid,
            &self.post_from_crs,
            self.middle_deg,
            place,
        )
    }

    /// The column and row of the cell at a position, its last edges included; `None` outside.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the position is checked to lie on the raster"
    )]
    pub fn cell(&self, position: [f64; 2]) -> Option<[usize; 2]> {
        let last = self.last();
        let on = |i: usize| position[i] >= -EDGE && position[i] <= last[i] + EDGE;
        let index = |i: usize| (position[i].max(0.0) as usize).min(last[i] as usize - 1);
        (on(0) && on(1)).then(|| [index(0), index(1)])
    }

    /// The surface over a cell; `None` in a hole.
    #[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
    pub fn patch(&self, [column, row]: [usize; 2]) -> Option<Patch> {
        let posts =
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| self.grid.height_m(column + i, row + j));
        Patch::new(column as f64, row as f64, posts)
    }

    /// The surface at a position; `None` outside and in a hole.
    pub fn patch_at(&self, position: [f64; 2]) -> Option<Patch> {
        self.patch(self.cell(position)?)
    }

    /// The upward normal of a patch at a place, in the site's ENU.
    pub fn normal(&self, site: &Site, place: Geodetic, patch: &Patch) -> Direction<Enu> {
        let up = site.up(place);
        let slope = self.slope(site, place, patch).unwrap_or([0.0; 2]);
        let local = Vector::<LocalEnu>::new(-slope[0], -slope[1], 1.0);
        let normal = site.enu_from_local(place) * local;
        Direction::new(normal.xyz).unwrap_or(up)
    }

    /// How a patch rises eastwards and northwards at a place, metres a metre.
    fn slope(&self, site: &Site, place: Geodetic, patch: &Patch) -> Option<[f64; 2]> {
        let [across, meridian] = site.planet().ellipsoid.radii(place.lat);
        let step_lon = 1.0 / ((across + place.height_m) * place.lat.cos());
        let step_lat = 1.0 / (meridian + place.height_m);
        let [x, y] = self.position(place)?;
        let gradient = patch.gradient([x, y]);
        let along = |lon: f64, lat: f64| {
            let moved = Geodetic {
                lon: place.lon + lon,
                lat: place.lat + lat,
                ..place
            };
            let [x1, y1] = self.position(moved)?;
            Some(gradient[0] * (x1 - x) + gradient[1] * (y1 - y))
        };
        Some([along(step_lon, 0.0)?, along(0.0, step_lat)?])
    }

    /// The place at a position, on the ellipsoid's height `height_m`.
    pub fn place(&self, [column, row]: [f64; 2], height_m: f64) -> Option<Geodetic> {
        let (x, y) = self.grid.crs_from_post().apply(column, row);
        let (lon, lat) = self.crs.lon_lat(x, y).ok()?;
        Some(Geodetic { lat, lon, height_m })
    }

    /// Horizontal distance from a point to the raster's extent, metres; 0 on it.
    pub fn distance_m(&self, site: &Site, point: Point<Enu>) -> Option<f64> {
        let place = site.geodetic(point);
        let position = self.position(place)?;
        if self.cell(position).is_some() {
            return Some(0.0);
        }
        let last = self.last();
        let near = [
            position[0].clamp(0.0, last[0]),
            position[1].clamp(0.0, last[1]),
        ];
        let edge = self.place(near, place.height_m)?;
        Some(site.enu(edge).distance(point))
    }

    /// An upper bound, by samples, of the second derivative of column and row along straight lines.
    fn greatest_bend(&self, site: &Site) -> f64 {
        const STEP_M: f64 = 100.0;
        let radius = site.planet().ellipsoid.a;
        let last = self.last();
        let mut bend = 0.0f64;
        for node in 0..25 {
            let share = [(node % 5) as f64 / 4.0, (node / 5) as f64 / 4.0];
            let Some(place) = self.place([share[0] * last[0], share[1] * last[1]], 0.0) else {
                continue;
            };
            let (centre, axes) = (site.enu(place), site.enu_from_local(place));
            let position = |east: f64, north: f64| {
                let offset = axes * Vector::<LocalEnu>::new(east, north, 0.0);
                self.position(site.geodetic(centre + offset))
            };
            for (east, north) in [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (0.6, -0.8)] {
                let ends = (
                    position(-east * STEP_M, -north * STEP_M),
                    position(0.0, 0.0),
                    position(east * STEP_M, north * STEP_M),
                );
                let (Some(a), Some(b), Some(c)) = ends else {
                    continue;
                };
                let second = (0..2).map(|i| (a[i] - 2.0 * b[i] + c[i]).abs() / STEP_M.powi(2));
                // Lines that also climb turn against the verticals, which fan out.
                let scale = (0..2).map(|i| (c[i] - a[i]).abs() / (2.0 * STEP_M));
                let here = second.fold(0.0, f64::max) + 2.0 * scale.fold(0.0, f64::max) / radius;
                bend = bend.max(here);
            }
        }
        2.0 * bend
    }
}

fn position(
    crs: &Crs,
    grid: &HeightGrid,
    post_from_crs: &Affine,
    middle_deg: Option<f64>,
    place: Geodetic,
) -> Option<[f64; 2]> {
    let (mut x, y) = crs.xy(place.lon, place.lat).ok()?;
    if let Some(middle) = middle_deg {
        x += 360.0 * ((middle - x) / 360.0).round();
    }
    Some(grid.crs_from_post().solve(post_from_crs, x, y))
}

/// The middle longitude of a raster whose CRS is in degrees; `None` where it is in metres or feet.
#[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
fn middle_longitude_deg(site: &Site, crs: &Crs, grid: &HeightGrid) -> Option<f64> {
    let origin = site.origin();
    let (x, y) = crs.xy(origin.lon, origin.lat).ok()?;
    // Datums differ by less than a hundredth of a degree; a projection is in larger units.
    let turn = (x - origin.lon_deg()).rem_euclid(360.0);
    let degrees = turn.min(360.0 - turn) < 0.01 && (y - origin.lat_deg()).abs() < 0.01;
    let middle = (
        (grid.columns() - 1) as f64 / 2.0,
        (grid.rows() - 1) as f64 / 2.0,
    );
    // Within metres of a projection's own origin both read zero: there the units tell.
    let (x1, _) = crs.xy(origin.lon + 0.001, origin.lat).ok()?;
    let turn = (x1 - x - 0.001f64.to_degrees()).rem_euclid(360.0);
    (degrees && turn.min(360.0 - turn) < 1e-4)
        .then(|| grid.crs_from_post().apply(middle.0, middle.1).0)
}

/// The part of a raster that a site can reach.
///
/// # Errors
/// [`CrsError`] where PROJ does not know the raster's CRS on the site's planet.
pub(super) fn within_reach(site: &Site, grid: HeightGrid) -> Result<HeightGrid, CrsError> {
    let crs = Crs::new(grid.crs(), site.planet())?;
    let middle_deg = middle_longitude_deg(site, &crs, &grid);
    Ok(crop(site, &crs, middle_deg, grid))
}

/// The part of a raster that a site can reach, so that a model of a whole planet serves as well.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "positions are clamped onto the raster"
)]
fn crop(site: &Site, crs: &Crs, middle_deg: Option<f64>, grid: HeightGrid) -> HeightGrid {
    let Some(inverse) = grid.crs_from_post().inverse() else {
        return grid;
    };
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for azimuth_deg in 0..360 {
        let (east, north) = f64::from(azimuth_deg).to_radians().sin_cos();
        let point = Point::new(KEPT_M * east, KEPT_M * north, 0.0);
        let place = site.geodetic(point);
        let Some(position) = position(crs, &grid, &inverse, middle_deg, place) else {
            return grid;
        };
        for i in 0..2 {
            low[i] = low[i].min(position[i]);
            high[i] = high[i].max(position[i]);
        }
    }
    let last = [(grid.columns() - 1) as f64, (grid.rows() - 1) as f64];
    let polar =
        site.origin().lat.abs() + KEPT_M / site.planet().ellipsoid.a > std::f64::consts::FRAC_PI_2;
    let outside = (0..2).any(|i| high[i] <= 0.0 || low[i] >= last[i]);
    let inside = (0..2).all(|i| low[i] <= 0.0 && high[i] >= last[i]);
    if outside || inside || (middle_deg.is_some() && polar) {
        return grid;
    }
    let range = |i: usize| {
        let first = low[i].floor().clamp(0.0, last[i] - 1.0);
        let end = high[i].ceil().clamp(first + 1.0, last[i]);
        (first as usize, end as usize)
    };
    grid.window(range(0), range(1))
}

/// The lowest and the highest known post, and the greatest step between neighbours, metres.
fn extremes(grid: &HeightGrid) -> (f64, f64, f64) {
    let (mut low, mut high, mut step) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let h = grid.height_m(column, row);
            // Unknown posts are NaN, which `min` and `max` pass over.
            (low, high) = (low.min(h), high.max(h));
            if column > 0 {
                step = step.max((h - grid.height_m(column - 1, row)).abs());
            }
            if row > 0 {
                step = step.max((h - grid.height_m(column, row - 1)).abs());
            }
        }
    }
    (low, high, step)
}
