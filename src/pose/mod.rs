//! Where the platform was: pose logs and poses of single images.
//!
//! [`read_poses`] turns poses.csv, in all its variants, into records; [`PoseRow::resolve`] places
//! them in a site. A log becomes [`Track`]s, one a platform, which answer for any time between
//! their samples and never extrapolate.

mod colmap;
mod lines;
mod odometry;
mod reader;
mod record;
mod reference;
mod time;
mod track;
mod tum;
mod writer;

pub use reader::{PoseFile, read_poses};
pub(crate) use reader::{pan_tilt, time};
pub use record::{Attitude, PoseKey, PoseRow, Position};
pub use reference::{HeadingReference, North};
pub use time::Time;
pub use track::{NoPose, Track};
pub use writer::{ImageRecord, PoseRecord, format_time, poses_text, write_images, write_poses};

use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

use crate::frame::{Body, Enu, RigidTransform};

/// A pose of the platform and how far it may be wrong.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// Body axes into the site's ENU.
    pub enu_from_body: RigidTransform<Enu, Body>,
    /// Standard deviations of its error.
    pub sigma: PoseSigma,
    /// Whether the heading was measured; if not, the body's axes are level and turned anyhow.
    pub has_heading: bool,
}

/// Standard deviations of a pose's error: its position in the site's ENU, and the rotation vector
/// `delta` in body axes with `R_true = R Exp(delta)`, whose x, y and z parts are named roll, pitch
/// and yaw.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PoseSigma {
    /// East, metres.
    pub east_m: f64,
    /// North, metres.
    pub north_m: f64,
    /// Up, metres.
    pub up_m: f64,
    /// About the body's x axis, radians.
    #[serde(rename = "roll_rad")]
    pub roll: f64,
    /// About the body's y axis, radians.
    #[serde(rename = "pitch_rad")]
    pub pitch: f64,
    /// About the body's z axis, radians.
    #[serde(rename = "yaw_rad")]
    pub yaw: f64,
}

impl PoseSigma {
    /// The six in the order every pose Jacobian uses: east, north, up, roll, pitch, yaw.
    pub fn to_vector(self) -> Vector6<f64> {
        Vector6::new(
            self.east_m,
            self.north_m,
            self.up_m,
            self.roll,
            self.pitch,
            self.yaw,
        )
    }

    /// From the six in that order.
    pub fn from_vector(v: Vector6<f64>) -> Self {
        Self {
            east_m: v[0],
            north_m: v[1],
            up_m: v[2],
            roll: v[3],
            pitch: v[4],
            yaw: v[5],
        }
    }

    /// All six, multiplied by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self::from_vector(self.to_vector() * factor)
    }

    /// The covariance of the pose's error, diagonal.
    pub fn covariance(self) -> Matrix6<f64> {
        let sigma = self.to_vector();
        Matrix6::from_diagonal(&sigma.component_mul(&sigma))
    }
}
