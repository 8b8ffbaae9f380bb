//! A picture (or any other look around) with everything that says how it was taken: its pose, its
//! camera and where the camera's head was turned.

mod assemble;
mod images;

pub use assemble::{Assembly, Sources, assemble};
pub use images::{ImageFile, ImageRow, read_images};

use std::path::PathBuf;
use std::sync::Arc;

use crate::camera::{Camera, PanTilt};
use crate::frame::{self, Body, Enu, LocalEnu, Point, RigidTransform, Rotation};
use crate::pose::{Pose, Time};

/// One look at the ground.
#[derive(Debug, Clone)]
pub struct View {
    /// The image.
    pub image_id: String,
    /// The file and line that list it.
    pub listed: (String, u64),
    /// When it was taken, if that is known.
    pub time: Option<Time>,
    /// Which of several robots took it.
    pub platform: Option<String>,
    /// The picture, where one is at hand.
    pub picture: Option<Picture>,
    /// Its camera; a view of ranges and bearings has none.
    pub camera: Option<Arc<Camera>>,
    /// Where the camera's head was turned.
    pub head: PanTilt,
    /// Where the platform was.
    pub pose: Pose,
    /// East, north, up at the platform's own place, into the site's.
    pub enu_from_local: Rotation<Enu, LocalEnu>,
}

/// Where a view's picture is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// As the image list gives it, relative to that file; outputs keep this name.
    pub name: String,
    /// Where to open it.
    pub path: PathBuf,
    /// SHA-256 of its content, where the run hashed it.
    pub sha256: Option<[u8; 32]>,
}

impl View {
    /// Camera axes into body axes, with the head as it was turned.
    pub fn body_from_camera(&self) -> Option<RigidTransform<Body, frame::Camera>> {
        let camera = self.camera.as_ref()?;
        Some(camera.mount.body_from_camera(self.head))
    }

    /// Camera axes into the site's ENU.
    pub fn enu_from_camera(&self) -> Option<RigidTransform<Enu, frame::Camera>> {
        Some(self.pose.enu_from_body * self.body_from_camera()?)
    }

    /// Where it looks from: the camera's centre, or the body's origin without a camera.
    pub fn origin(&self) -> Point<Enu> {
        self.enu_from_camera()
            .map_or_else(|| self.pose.enu_from_body.origin(), |t| t.origin())
    }

    /// The camera's name, if it has one.
    pub fn camera_name(&self) -> Option<&str> {
        self.camera.as_ref().map(|c| c.name.as_str())
    }

    /// Heading of the body's forward axis at its own place, radians clockwise from true north.
    pub fn yaw(&self) -> Option<f64> {
        let forward = self.pose.enu_from_body.rotation * frame::Vector::<Body>::new(1.0, 0.0, 0.0);
        let local = self.enu_from_local.inverse() * forward;
        self.pose
            .has_heading
            .then(|| local.xyz.x.atan2(local.xyz.y))
    }
}
