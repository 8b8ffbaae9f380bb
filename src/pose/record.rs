//! One row of poses.csv, as written: before it has a place in a site.

use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};

use super::{Pose, PoseSigma, Time};
use crate::frame::{Body, Enu, Geodetic, LocalEnu, Point, RigidTransform, Rotation, Site};

/// What a pose is looked up by.
#[derive(Debug, Clone, PartialEq)]
pub enum PoseKey {
    /// A sample of a log.
    Time(Time),
    /// The pose of one image.
    Image {
        /// The image.
        image_id: String,
        /// When it was taken, if the file says so.
        time: Option<Time>,
        /// Its camera, if the file names one.
        camera: Option<String>,
        /// Its picture, if the file names one.
        path: Option<String>,
        /// Pan and tilt of the camera's head, radians; zero where the file has neither.
        pan_tilt: [f64; 2],
    },
}

/// Where a pose is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// On the planet; the attitude is in the ENU of this very place.
    Geodetic(Geodetic),
    /// In the site's ENU, as is the attitude.
    Site(Point<Enu>),
}

/// How a pose is turned, in the ENU its [`Position`] names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attitude {
    /// Body axes into ENU.
    Measured(UnitQuaternion<f64>),
    /// Level, and turned nobody knows how.
    Level,
}

impl Attitude {
    /// From aerospace angles, radians: body forward-right-down into north-east-down in Z-Y-X order;
    /// yaw clockwise from north, pitch nose up, roll right side down.
    pub fn from_roll_pitch_yaw(roll: f64, pitch: f64, yaw: f64) -> Self {
        let ned_from_frd = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let enu_from_ned = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        let frd_from_flu = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let enu_from_flu =
            enu_from_ned * ned_from_frd.to_rotation_matrix().into_inner() * frd_from_flu;
        Self::Measured(Rotation::<LocalEnu, Body>::from_matrix(enu_from_flu).quaternion())
    }
}

/// One row of poses.csv.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseRow {
    /// Line of the file.
    pub line: u64,
    /// What it is looked up by.
    pub key: PoseKey,
    /// Which of several robots.
    pub platform: Option<String>,
    /// Where it is.
    pub position: Position,
    /// How it is turned.
    pub attitude: Attitude,
    /// Standard deviations that the row itself gives, in the order of [`PoseSigma::to_vector`].
    pub sigma: [Option<f64>; 6],
}

impl PoseRow {
    /// The pose in a site; `fallback` stands in for standard deviations the row does not give.
    pub fn resolve(&self, site: &Site, fallback: PoseSigma) -> Pose {
        let (point, enu_from_axes) = match self.position {
            Position::Geodetic(place) => (site.enu(place), site.enu_from_local(place)),
            Position::Site(point) => (point, Rotation::identity()),
        };
        let quaternion = match self.attitude {
            Attitude::Measured(q) => q,
            Attitude::Level => UnitQuaternion::identity(),
        };
        let rotation = enu_from_axes * Rotation::<LocalEnu, Body>::from_unit_quaternion(quaternion);
        let fallback = fallback.to_vector();
        let sigma = Vector6::from_fn(|i, _| self.sigma[i].unwrap_or(fallback[i]));
        Pose {
            enu_from_body: RigidTransform::new(rotation, point - Point::origin()),
            sigma: PoseSigma::from_vector(sigma),
            has_heading: matches!(self.attitude, Attitude::Measured(_)),
        }
    }

    /// The place on the planet; a position in the site's ENU has none before the site stands.
    pub fn geodetic(&self) -> Option<Geodetic> {
        match self.position {
            Position::Geodetic(place) => Some(place),
            Position::Site(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
        let (r, p, y) = (roll.to_radians(), pitch.to_radians(), yaw.to_radians());
        match Attitude::from_roll_pitch_yaw(r, p, y) {
            Attitude::Measured(q) => q.to_rotation_matrix().into_inner(),
            Attitude::Level => unreachable!("angles are measured"),
        }
    }

    #[test]
    fn aerospace_angles_mean_what_pilots_mean() {
        let near = |a: Vector3<f64>, b: [f64; 3]| (a - Vector3::from(b)).norm() < 1e-12;
        let forward = Vector3::x();
        let left = Vector3::y();
        // Yaw 90: nose to the east, left wing to the north.
        assert!(near(axes(0.0, 0.0, 90.0) * forward, [1.0, 0.0, 0.0]));
        assert!(near(axes(0.0, 0.0, 90.0) * left, [0.0, 1.0, 0.0]));
        // Pitch up 30 heading north: the nose rises.
        let nose = axes(0.0, 30.0, 0.0) * forward;
        assert!(near(nose, [0.0, 30f64.to_radians().cos(), 0.5]));
        // Roll 30: the right side goes down, so the left side rises.
        let wing = axes(30.0, 0.0, 0.0) * left;
        assert!(near(wing, [-(30f64.to_radians().cos()), 0.0, 0.5]));
        // The order is yaw, then pitch, then roll: at pitch 90 the nose points up whatever the rest.
        assert!(near(axes(20.0, 90.0, 50.0) * forward, [0.0, 0.0, 1.0]));
    }
}
