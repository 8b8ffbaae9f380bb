//! Records set aside: counted, reported with their reason, never silently dropped.

use std::fmt;

use serde::Serialize;

use crate::error::{Fault, Place};

/// Why a record was set aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// A field that cannot be read or lies outside its domain.
    BadValue,
    /// A second record under a key that must be unique.
    Duplicate,
    /// A pose farther from the site's origin than one site reaches.
    OffSite,
    /// An image whose time lies outside the pose log, or that no pose names.
    NoPose,
    /// An image in a gap of the pose log longer than the run allows.
    PoseGap,
    /// An image of a camera that cameras.toml does not have.
    UnknownCamera,
    /// A picture whose size is not its camera's.
    PictureSize,
    /// A detection of an image that is not in the images.
    UnknownImage,
    /// A detection of an image that was itself set aside.
    ImageRejected,
    /// A box or point wholly outside its picture.
    OutsidePicture,
    /// A score below the run's least.
    LowScore,
    /// A ray that the lens model has no answer for.
    OutsideLens,
    /// A ray that points above the horizon.
    AboveHorizon,
    /// A hit or range nearer than the run trusts.
    TooNear,
    /// A hit or range farther than the run trusts.
    TooFar,
    /// A ray that leaves the terrain model, or enters a hole of it.
    OffTerrain,
    /// A platform that stands below the terrain.
    UnderGround,
    /// A range shorter than the sensor's height above the ground.
    RangeTooShort,
}

impl Reason {
    /// The word in rejects.csv and run.json.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::BadValue => "bad_value",
            Self::Duplicate => "duplicate",
            Self::OffSite => "off_site",
            Self::NoPose => "no_pose",
            Self::PoseGap => "pose_gap",
            Self::UnknownCamera => "unknown_camera",
            Self::PictureSize => "picture_size",
            Self::UnknownImage => "unknown_image",
            Self::ImageRejected => "image_rejected",
            Self::OutsidePicture => "outside_picture",
            Self::LowScore => "low_score",
            Self::OutsideLens => "outside_lens",
            Self::AboveHorizon => "above_horizon",
            Self::TooNear => "too_near",
            Self::TooFar => "too_far",
            Self::OffTerrain => "off_terrain",
            Self::UnderGround => "under_ground",
            Self::RangeTooShort => "range_too_short",
        }
    }

    /// Whether it speaks of a fault in the data, which counts against the allowed share, rather
    /// than of a choice of the run (range, score) or of plain geometry.
    pub const fn is_fault(self) -> bool {
        !matches!(
            self,
            Self::LowScore | Self::AboveHorizon | Self::TooNear | Self::TooFar
        )
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A record set aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reject {
    /// The file it stands in, as the run names it.
    pub file: String,
    /// Its line, from 1.
    pub line: Option<u64>,
    /// Its key: an image, or image and detection, or a time; empty where it has none.
    pub record: String,
    /// Why.
    pub reason: Reason,
    /// The particulars, in words.
    pub detail: String,
}

impl Reject {
    /// A record that a fault keeps from being read.
    pub fn from_fault(fault: Fault, record: impl Into<String>) -> Self {
        let Fault {
            place,
            field,
            problem,
        } = fault;
        let detail = Fault::new(Place::default(), field, problem).to_string();
        Self {
            file: place.file,
            line: place.line,
            record: record.into(),
            reason: Reason::BadValue,
            detail,
        }
    }
}

impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = Place {
            file: self.file.clone(),
            line: self.line,
            column: None,
        };
        write!(f, "{place}: {}", self.detail)
    }
}
