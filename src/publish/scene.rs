//! What publishing works from.

use crate::detection::{Aim, Detection};
use crate::footprint::Footprints;
use crate::frame::Site;
use crate::project::Placed;
use crate::terrain::Terrain;
use crate::view::View;

/// A run up to the ground: views, what they detected, what they could have seen.
pub struct Scene<'a> {
    /// The site.
    pub site: &'a Site,
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
