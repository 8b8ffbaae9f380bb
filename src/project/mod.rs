//! From a detector's mark to a place on the ground, with the uncertainty it has there.
//!
//! A [`Sighting`] is what a mark says by itself, in body axes: a ray, or a bearing, and perhaps a
//! range. Meeting the terrain it becomes a [`Hit`], which carries the covariance of the mark's own
//! noise and its Jacobian by the six pose errors, or a [`Miss`] that says why not.

mod hit;
mod sighting;
mod size;

pub(crate) use hit::level_direction;
pub use hit::{Hit, meet};
pub use sighting::{LineOfSight, Range, Sighting, sight};
pub use size::diameter_m;

use nalgebra::Matrix3;

use crate::camera::LensError;
use crate::detection::{Aim, Detection};
use crate::input::Reason;
use crate::terrain::{self, Terrain};
use crate::view::View;

/// How marks are read and how far they are trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which point of a box is the object's place.
    pub aim: Aim,
    /// Least ground range, metres.
    pub min_range_m: f64,
    /// Greatest ground range, metres; infinite for none.
    pub max_range_m: f64,
    /// Least score.
    pub min_score: f64,
    /// Standard deviations of marks that give none of their own.
    pub noise: MarkNoise,
}

/// Standard deviations of a detector's marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkNoise {
    /// Of columns and rows, pixels.
    pub pixel_px: f64,
    /// Of ranges, metres.
    pub range_m: f64,
    /// Of bearings and azimuths, radians.
    pub bearing: f64,
}

/// Why a mark has no place on the ground.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Miss {
    /// The mark lies wholly outside its picture.
    #[error("found {found}, expected some of it in the picture of {width}x{height}")]
    OutsidePicture {
        /// The mark.
        found: String,
        /// The picture's width, pixels.
        width: u32,
        /// The picture's height, pixels.
        height: u32,
    },
    /// The score is below the run's least.
    #[error("score {score} is below min_score = {min_score}")]
    LowScore {
        /// The score found.
        score: f64,
        /// The least the run takes.
        min_score: f64,
    },
    /// A mark in pixels, in a view without a camera.
    #[error("found a mark in pixels, expected a camera for it in cameras.toml")]
    NoCamera,
    /// A bearing from the body's axis, where the heading is not known.
    #[error(
        "found a bearing from the body's axis, expected an azimuth, since the pose has no attitude"
    )]
    NoHeading,
    /// A ray with neither a range nor a terrain to meet.
    #[error("found a mark in pixels without a range, expected a terrain for it to meet")]
    NoTerrain,
    /// The lens model has no ray there.
    #[error("{0}")]
    Lens(#[from] LensError),
    /// The ray does not meet the terrain.
    #[error("{}", terrain_words(*.0))]
    Terrain(terrain::Miss),
    /// The range is shorter than the sensor's height above the ground.
    #[error("range {range_m} m meets the ground nowhere")]
    RangeTooShort {
        /// The range found, metres.
        range_m: f64,
    },
    /// Nearer than the run trusts.
    #[error("ground range {range_m:.3} m is below min_range_m = {min_range_m}")]
    TooNear {
        /// The ground range found, metres.
        range_m: f64,
        /// The least the run trusts, metres.
        min_range_m: f64,
    },
    /// Farther than the run trusts.
    #[error("ground range {range_m:.3} m is above max_range_m = {max_range_m}")]
    TooFar {
        /// The ground range found, metres.
        range_m: f64,
        /// The greatest the run trusts, metres.
        max_range_m: f64,
    },
}

fn terrain_words(miss: terrain::Miss) -> &'static str {
    match miss {
        terrain::Miss::AboveHorizon => "its ray passes above the ground",
        terrain::Miss::TooFar => "its ray meets the ground beyond max_range_m",
        terrain::Miss::OffTerrain => "its ray leaves the terrain model or enters a hole of it",
        terrain::Miss::UnderGround => "its ray starts below the ground",
    }
}

impl Miss {
    /// The reason a reject carries.
    pub fn reason(&self) -> Reason {
        match self {
            Self::OutsidePicture { .. } => Reason::OutsidePicture,
            Self::LowScore { .. } => Reason::LowScore,
            Self::NoCamera | Self::NoHeading | Self::NoTerrain => Reason::BadValue,
            Self::Lens(_) => Reason::OutsideLens,
            Self::RangeTooShort { .. } => Reason::RangeTooShort,
            Self::TooNear { .. } => Reason::TooNear,
            Self::TooFar { .. } | Self::Terrain(terrain::Miss::TooFar) => Reason::TooFar,
            Self::Terrain(terrain::Miss::AboveHorizon) => Reason::AboveHorizon,
            Self::Terrain(terrain::Miss::OffTerrain) => Reason::OffTerrain,
            Self::Terrain(terrain::Miss::UnderGround) => Reason::UnderGround,
        }
    }
}

/// A detection with its place on the ground.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Index of its view.
    pub view: usize,
    /// The detection.
    pub detection: Detection,
    /// Where it lies.
    pub hit: Hit,
    /// Covariance of the place, m^2, with the shares of pose and terrain.
    pub covariance: Matrix3<f64>,
    /// Diameter of what was detected, metres, where the mark shows it.
    pub diameter_m: Option<f64>,
}

/// Places a detection on the ground.
///
/// # Errors
/// As [`sight`] and [`meet`].
pub fn place(
    detection: &Detection,
    (index, view): (usize, &View),
    terrain: Option<&Terrain>,
    ground_height_sigma_m: f64,
    settings: &Settings,
) -> Result<Placed, Miss> {
    let sighting = sight(detection, view, settings)?;
    let hit = meet(&sighting, view, terrain, settings)?;
    Ok(Placed {
        view: index,
        detection: detection.clone(),
        covariance: hit.covariance(&view.pose.sigma.covariance(), ground_height_sigma_m),
        diameter_m: diameter_m(detection, view, hit.slant_range_m, settings),
        hit,
    })
}

#[cfg(test)]
mod tests;
