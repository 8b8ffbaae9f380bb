//! What ground each view could have seen.
//!
//! A [`Footprint`] is the picture's border traced to the terrain, clipped to the ranges in which
//! the detector is trusted; a view without a camera has its sector. [`Footprints`] keeps all of
//! them with a tree over them and answers which views could have seen a place, which views overlap,
//! and where the ground is seen by at least k views.

mod border;
mod clip;
mod overlap;
mod shape;
mod trace;
mod tree;

pub use overlap::seen_by_at_least;
pub use trace::trace;
pub use tree::Footprints;

use geo::{Area, MultiPolygon};

use shape::Shape;

/// How far footprints reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Least ground range, metres.
    pub min_range_m: f64,
    /// Greatest ground range, metres; where it is infinite, footprints end at
    /// [`Reach::UNBOUNDED_M`].
    pub max_range_m: f64,
    /// Opening angle of views without a camera, about the body's forward axis, radians; 2 pi for
    /// the whole ring.
    pub fov: f64,
}

impl Reach {
    /// Where footprints end when the run gives no greatest range, metres: far enough for anything
    /// a picture of rocks resolves, and near enough that a horizon in the picture does no harm.
    pub const UNBOUNDED_M: f64 = 1000.0;

    /// The greatest ground range of footprints, metres.
    pub fn limit_m(&self) -> f64 {
        if self.max_range_m.is_finite() {
            self.max_range_m
        } else {
            Self::UNBOUNDED_M
        }
    }
}

/// The ground a view could have seen, in the site's horizontal ENU; it may have holes and several
/// parts, or be empty.
#[derive(Debug, Clone)]
pub struct Footprint {
    ground: MultiPolygon<f64>,
    shape: Option<Shape>,
}

impl Footprint {
    /// The footprint of an area in (east, north), metres.
    pub fn new(ground: MultiPolygon<f64>) -> Self {
        Self {
            shape: Shape::new(&ground),
            ground,
        }
    }

    /// A view that sees no ground.
    pub fn empty() -> Self {
        Self::new(MultiPolygon::new(Vec::new()))
    }

    /// The area in (east, north), metres.
    pub fn ground(&self) -> &MultiPolygon<f64> {
        &self.ground
    }

    /// Its size, m^2.
    pub fn area_m2(&self) -> f64 {
        self.ground.unsigned_area()
    }

    /// Whether it covers a place, its border included.
    pub fn covers(&self, east_m: f64, north_m: f64) -> bool {
        let shape = self.shape.as_ref();
        shape.is_some_and(|shape| shape.contains(east_m, north_m))
    }
}

#[cfg(test)]
mod tests;
