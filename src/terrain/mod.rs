//! The ground: its height at a place, and where a ray first meets it.
//!
//! Heights are metres above the ellipsoid. The ground is either a surface of constant height (which
//! curves with the planet: it is 31 m below the tangent plane at 20 km) or a model made of rasters:
//!
//! - The height at a place is the bilinear interpolation of the four posts around it, in the
//!   raster's own columns and rows. Beyond the outermost posts a raster says nothing, and neither in
//!   a cell with an unknown post (a hole). Rasters cut from one along the borders of its pixels are
//!   joined again first.
//! - Of several rasters the first in the list that knows a place counts. Where none does, the
//!   constant height given for outside holds, and where none is given the ground is unknown.
//! - Where surfaces of different height meet, the step between them is a wall and can be hit.
//! - Over unknown ground a ray is taken to pass while it is higher than every known post around the
//!   hole, and outside all rasters while it is higher than the whole model; otherwise it might have
//!   hit something, and is [`Miss::OffTerrain`]. The unknown stretch in which the ray starts is
//!   passed at any height, for a camera stands on ground, known or not; a ray that comes out of it
//!   below the known surface is `OffTerrain`.

mod ascii;
mod cell;
mod constant;
mod geoid;
mod geotiff;
mod grid;
mod holes;
mod leg;
mod local;
mod march;
mod model;
mod mosaic;
mod open;
mod patch;
mod planetary;
mod pyramid;
mod tile;

#[cfg(test)]
mod tests;

use crate::frame::{CrsError, Direction, Enu, GeoidGrid, Point, Ray, Site};

pub use ascii::read_ascii_grid;
pub use geoid::{datum_of_grid, vertical_datum};
pub use geotiff::{read_geotiff, write_geotiff};
pub use grid::{Affine, GridError, HeightGrid, HeightsAbove, Posts};
pub use open::read_heights;

use model::Model;

/// The ground of a site.
#[derive(Debug)]
pub struct Terrain {
    site: Site,
    shape: Shape,
    geoid_grids: Vec<GeoidGrid>,
}

#[derive(Debug)]
enum Shape {
    Constant(f64),
    Model(Box<Model>),
}

/// The ground at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The place, on the surface.
    pub point: Point<Enu>,
    /// The surface's upward normal.
    pub normal: Direction<Enu>,
}

/// Where a ray first meets the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundHit {
    /// The place.
    pub point: Point<Enu>,
    /// The surface's upward normal there.
    pub normal: Direction<Enu>,
    /// Distance from the ray's origin along the ray, metres.
    pub distance_m: f64,
}

/// Why a ray meets no ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, thiserror::Error)]
pub enum Miss {
    /// It stays above the ground for good.
    #[error("above the horizon")]
    AboveHorizon,
    /// It comes down, if at all, beyond the range asked for.
    #[error("beyond the range")]
    TooFar,
    /// It gets low over ground that the terrain model does not know.
    #[error("off the terrain model")]
    OffTerrain,
    /// It starts on or below the ground.
    #[error("starts below the ground")]
    UnderGround,
}

impl Terrain {
    /// A surface of constant height above the ellipsoid, metres.
    pub fn constant_height(site: Site, height_m: f64) -> Self {
        Self {
            site,
            shape: Shape::Constant(height_m),
            geoid_grids: Vec::new(),
        }
    }

    /// Height models from rasters, of which the earlier count where they overlap. The height
    /// `outside_m`, metres above the ellipsoid, serves in holes and outside all models.
    ///
    /// # Errors
    /// The number of the raster whose CRS PROJ does not know on the site's planet, and why.
    pub fn from_grids(
        site: Site,
        grids: Vec<HeightGrid>,
        outside_m: Option<f64>,
    ) -> Result<Self, (usize, CrsError)> {
        let grids: Vec<HeightGrid> = grids
            .into_iter()
            .map(|grid| local::on_planet(&site, grid))
            .collect();
        let shape = match (grids.is_empty(), outside_m) {
            (true, Some(height_m)) => Shape::Constant(height_m),
            _ => Shape::Model(Box::new(Model::new(&site, grids, outside_m)?)),
        };
        Ok(Self {
            site,
            shape,
            geoid_grids: Vec::new(),
        })
    }

    /// The site whose ENU everything is in.
    pub fn site(&self) -> Site {
        self.site
    }

    /// The grids by which heights of its models were shifted to the ellipsoid.
    pub fn geoid_grids(&self) -> &[GeoidGrid] {
        &self.geoid_grids
    }

    /// Whether it is a surface of constant height.
    pub fn is_constant_height(&self) -> bool {
        matches!(self.shape, Shape::Constant(_))
    }

    /// The ground on the vertical line of the ENU frame at an east and a north, metres; `None`
    /// where it is unknown. Far from the site's origin that line leans against the local vertical; the
    /// place is found by fixed-point steps, to 1e-9 m.
    pub fn ground_at(&self, east_m: f64, north_m: f64) -> Option<Ground> {
        let mut up = 0.0;
        for _ in 0..50 {
            let point = Point::new(east_m, north_m, up);
            let place = self.site.geodetic(point);
            let height_m = match &self.shape {
                Shape::Constant(height_m) => *height_m,
                Shape::Model(model) => model.surface(place)?.height_m(),
            };
            let step = (height_m - place.height_m) / self.site.up(place).xyz().z;
            up += step;
            if step.abs() < 1e-9 {
                break;
            }
        }
        let point = Point::new(east_m, north_m, up);
        Some(Ground {
            point,
            normal: self.normal(point),
        })
    }

    /// Where a ray first meets the ground, to 1e-6 m, no farther from its origin than
    /// `max_ground_range_m` in the horizontal plane of the ENU frame (infinity for any distance).
    ///
    /// # Errors
    /// The reason, where it meets none.
    pub fn first_hit(&self, ray: Ray<Enu>, max_ground_range_m: f64) -> Result<GroundHit, Miss> {
        let distance_m = match &self.shape {
            Shape::Constant(height_m) => self.first_constant(ray, *height_m)?,
            Shape::Model(model) => march::first_hit(&self.site, model, ray, max_ground_range_m)?,
        };
        let point = ray.at(distance_m);
        if point.horizontal_distance(ray.origin) > max_ground_range_m {
            return Err(Miss::TooFar);
        }
        Ok(GroundHit {
            point,
            normal: self.normal(point),
            distance_m,
        })
    }

    /// Whether the ground stands in the line of sight between two points by more than
    /// `clearance_m`: whether it is met by the line when both ends are raised by that much. Unknown
    /// ground hides nothing.
    pub fn occluded(&self, from: Point<Enu>, to: Point<Enu>, clearance_m: f64) -> bool {
        let up = self.site.up(self.site.geodetic(to)) * clearance_m;
        let Some(direction) = Direction::new((to - from).xyz) else {
            return false;
        };
        let origin = from + up;
        let ray = Ray { origin, direction };
        // A hair more than the range, so that a vertical line is not cut by rounding.
        let range = from.horizontal_distance(to) * (1.0 + 1e-12) + 1e-9;
        match self.first_hit(ray, range) {
            Ok(hit) => hit.distance_m < from.distance(to),
            Err(miss) => miss == Miss::UnderGround,
        }
    }

    /// Whether the height of the ground below or above a point is known.
    pub fn covers(&self, point: Point<Enu>) -> bool {
        match &self.shape {
            Shape::Constant(_) => true,
            Shape::Model(model) => model.surface(self.site.geodetic(point)).is_some(),
        }
    }

    /// Horizontal distance from a point to the extent of the nearest model, metres; 0 on one, and
    /// everywhere where the ground is known outside of them too.
    pub fn distance_to(&self, point: Point<Enu>) -> f64 {
        match &self.shape {
            Shape::Model(model) if model.outside_m.is_none() => model
                .tiles
                .iter()
                .filter_map(|tile| tile.distance_m(&self.site, point))
                .fold(f64::INFINITY, f64::min),
            _ => 0.0,
        }
    }

    fn first_constant(&self, ray: Ray<Enu>, height_m: f64) -> Result<f64, Miss> {
        match constant::first_not_above(&self.site, ray, height_m, 0.0) {
            None => Err(Miss::AboveHorizon),
            Some(0.0) => Err(Miss::UnderGround),
            Some(t) => Ok(t),
        }
    }

    /// The surface's normal at a point on it, or the vertical where it is unknown.
    fn normal(&self, point: Point<Enu>) -> Direction<Enu> {
        let place = self.site.geodetic(point);
        match &self.shape {
            Shape::Constant(_) => self.site.up(place),
            Shape::Model(model) => match model.surface(place) {
                Some(surface) => model.normal(&self.site, place, &surface),
                None => self.site.up(place),
            },
        }
    }
}
