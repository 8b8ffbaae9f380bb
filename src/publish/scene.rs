//! What publishing works from.

use crate::detection::{Aim, Detection};
use crate::footprint::Footprints;
use crate::frame::{Geodetic, Site, VerticalDatum};
use crate::project::Placed;
use crate::terrain::Terrain;
use crate::view::View;

/// A run up to the ground: views, what they detected, what they could have seen.
pub struct Scene<'a> {
    /// The site.
    pub site: &'a Site,
    /// What heights of the map are above, where it is not the ellipsoid.
    pub datum: Option<&'a VerticalDatum>,
    /// The ground.
    pub terrain: Option<&'a Terrain>,
    /// The views.
    pub views: &'a [View],
    /// The views with their poses as measured, where those of `views` are corrected.
    pub measured: Option<&'a [View]>,
    /// All their detections, by view, those without a place on the ground too.
    pub detections: &'a [(usize, Detection)],
    /// The detections with a place on the ground.
    pub placed: &'a [Placed],
    /// What each view could have seen.
    pub footprints: &'a Footprints,
    /// Names of the classes, by class index.
    pub classes: &'a [Option<String>],
    /// The point of a box taken for the object's place.
    pub aim: Aim,
}

impl Scene<'_> {
    /// The height of a place as the map gives it, metres: in the run's vertical datum, or above the
    /// ellipsoid where it names none; `None` outside the datum's grid.
    pub fn height_m(&self, place: Geodetic) -> Option<f64> {
        match self.datum {
            None => Some(place.height_m),
            Some(datum) => datum.height_m(place).ok(),
        }
    }

    /// What the heights of the map are, for the description of a field.
    pub(super) fn height_about(&self) -> &'static str {
        match self.datum {
            None => "height above the ellipsoid, m",
            Some(_) => "height in the run's vertical datum, m",
        }
    }
}
