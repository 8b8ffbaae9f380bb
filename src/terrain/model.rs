//! Several rasters as one surface, with a constant height around and beneath them.

use crate::frame::{Crs, CrsError, Direction, Enu, Geodetic, Point, Site};

use super::grid::HeightGrid;
use super::mosaic;
use super::patch::Patch;
use super::tile::Tile;

/// Rays are followed in legs of at most this length, metres.
const LEG_M: f64 = 100.0;

/// A leg may bend this much in a raster before cells are looked at one by one, cells.
const LEG_BEND: f64 = 0.005;

/// Height models, the earlier first, and the height that serves where all are silent.
#[derive(Debug)]
pub(super) struct Model {
    pub tiles: Vec<Tile>,
    pub outside_m: Option<f64>,
    /// The highest and the lowest of the whole surface, metres.
    pub top_m: f64,
    pub bottom_m: f64,
    /// Length of the legs rays are followed in, metres.
    pub leg_m: f64,
    /// Least and greatest east, and north, that any raster reaches, metres.
    pub bounds: [[f64; 2]; 2],
}

/// What the surface at a place is made of.
#[derive(Debug, Clone, Copy)]
pub(super) enum Surface {
    /// A cell of the raster of this number, at a column and row.
    Tile(usize, Patch, [f64; 2]),
    /// The constant height outside the rasters, metres.
    Outside(f64),
}

impl Surface {
    /// Height above the ellipsoid, metres.
    pub fn height_m(&self) -> f64 {
        match self {
            Self::Tile(_, patch, position) => patch.height_m(*position),
            Self::Outside(height_m) => *height_m,
        }
    }
}

impl Model {
    /// Makes rasters ready.
    ///
    /// # Errors
    /// The number of the raster whose CRS cannot serve, and why.
    pub fn new(
        site: &Site,
        grids: Vec<HeightGrid>,
        outside_m: Option<f64>,
    ) -> Result<Self, (usize, CrsError)> {
        for (number, grid) in grids.iter().enumerate() {
            Crs::new(grid.crs(), site.planet()).map_err(|error| (number, error))?;
        }
        let grids = mosaic::join(grids);
        let mut tiles = Vec::with_capacity(grids.len());
        // What shows through a raster's holes are the later ones, so they are made first.
        let mut under_holes_m = outside_m.unwrap_or(f64::NEG_INFINITY);
        for (number, grid) in grids.into_iter().rev() {
            let tile = Tile::new(site, number, grid, under_holes_m);
            let tile = tile.map_err(|error| (number, error))?;
            under_holes_m = under_holes_m.max(tile.top_m);
            tiles.push(tile);
        }
        tiles.reverse();
        let lowest = outside_m.unwrap_or(f64::INFINITY);
        let bend = tiles.iter().map(|tile| tile.bend).fold(1e-12, f64::max);
        Ok(Self {
            top_m: under_holes_m,
            bottom_m: tiles
                .iter()
                .map(|tile| tile.bottom_m)
                .fold(lowest, f64::min),
            leg_m: LEG_M.min((8.0 * LEG_BEND / bend).sqrt()),
            bounds: bounds(site, &tiles),
            outside_m,
            tiles,
        })
    }

    /// The surface at a place; `None` where the ground is unknown.
    pub fn surface(&self, place: Geodetic) -> Option<Surface> {
        for (number, tile) in self.tiles.iter().enumerate() {
            let Some(position) = tile.position(place) else {
                continue;
            };
            if let Some(patch) = tile.patch_at(position) {
                return Some(Surface::Tile(number, patch, position));
            }
        }
        self.outside_m.map(Surface::Outside)
    }

    /// The upward normal of a surface at a place.
    pub fn normal(&self, site: &Site, place: Geodetic, surface: &Surface) -> Direction<Enu> {
        match surface {
            Surface::Tile(number, patch, _) => self.tiles[*number].normal(site, place, patch),
            Surface::Outside(_) => site.up(place),
        }
    }

    /// The distances along a horizontal line `origin + t step` between which it is within the
    /// bounds of the rasters; `None` where it never is.
    pub fn within_bounds(&self, origin: Point<Enu>, step: [f64; 2]) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for (i, [low, high]) in self.bounds.into_iter().enumerate() {
            let start = origin.xyz[i];
            if step[i] == 0.0 {
                if start < low || start > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - start) / step[i], (high - start) / step[i]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter < leave).then_some((enter, leave))
    }
}

/// A rectangle in ENU that holds every raster at every height of its own, with room to spare.
fn bounds(site: &Site, tiles: &[Tile]) -> [[f64; 2]; 2] {
    const STEPS: u32 = 32;
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for tile in tiles {
        let last = tile.last();
        for step in 0..STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let edges = [
                [share * last[0], 0.0],
                [last[0], share * last[1]],
                [(1.0 - share) * last[0], last[1]],
                [0.0, (1.0 - share) * last[1]],
            ];
            for (edge, height_m) in edges
                .into_iter()
                .flat_map(|edge| [(edge, tile.bottom_m), (edge, tile.top_m)])
            {
                let Some(place) = tile.place(edge, height_m) else {
                    // The map ends within the raster: no edge bounds it.
                    return [[-2.0 * Site::REACH_M, 2.0 * Site::REACH_M]; 2];
                };
                let point = site.enu(place);
                for (i, bound) in bounds.iter_mut().enumerate() {
                    bound[0] = bound[0].min(point.xyz[i]);
                    bound[1] = bound[1].max(point.xyz[i]);
                }
            }
        }
    }
    let size = bounds.iter().map(|b| b[1] - b[0]).fold(0.0, f64::max);
    // The edges bend by less than this between the samples.
    let room = 10.0 + 0.01 * size;
    bounds.map(|[low, high]| [low - room, high + room])
}
