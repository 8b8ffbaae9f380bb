//! Lens models and mounts: raw pixels to rays in camera axes and back, with Jacobians.
//!
//! A [`Camera`] is a [`Lens`] of a certain picture size on a [`Mount`]. Its pixels are raw: distorted
//! as the picture is ([`Pixel`] states the convention); undistorted pixels never leave the lens.
//! Every model goes both ways, with analytic derivatives, and says [`LensError`] where it has no
//! answer rather than giving a wrong one.

mod angle;
mod brown_conrady;
mod cahv;
mod cahvor;
mod cahvore;
mod equirectangular;
mod fisheye;
mod foreign;
mod lens;
mod mount;
mod perspective;
mod pinhole;
mod polynomial;
mod radial;
mod read;
mod sensor;
mod write;

use std::collections::BTreeMap;

use nalgebra::{Matrix2x3, Matrix3x2};

use crate::frame::{self, Pixel, Point, Ray};

pub use brown_conrady::BrownConrady;
pub use cahv::{BodyAxes, Cahv, CahvVectors};
pub use cahvor::Cahvor;
pub use cahvore::{Cahvore, Linearity};
pub use equirectangular::Equirectangular;
pub use fisheye::Fisheye;
pub use foreign::{
    CameraFile, CameraFormat, RoverImage, RoverPose, SiteLink, attitude_of_ned, cameras_from_bytes,
    read_camera_file,
};
pub use lens::{BadLens, Lens, LensError};
pub use mount::{Mount, PanTilt};
pub use pinhole::{Intrinsics, Pinhole};
pub(crate) use read::camera as read_camera;
pub use read::{cameras_from_toml, read_cameras};
pub use write::{cameras_to_toml, write_cameras};

use lens::central_ray;

/// The cameras of a run by name.
pub type Cameras = BTreeMap<String, Camera>;

/// A camera: its lens, the size of its pictures and its place on the platform.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The name images refer to it by.
    pub name: String,
    /// Columns of its pictures.
    pub width: u32,
    /// Rows of its pictures.
    pub height: u32,
    /// The lens model.
    pub lens: Lens,
    /// Its place on the platform.
    pub mount: Mount,
}

impl Camera {
    /// The ray a raw pixel looks along, in camera axes. It starts at the camera's centre, but for
    /// CAHVORE lenses, whose entrance pupil moves along the optical axis.
    ///
    /// # Errors
    /// [`LensError`] where the lens model has no ray for the pixel. A pixel outside the picture may
    /// have a ray all the same.
    pub fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        Ok(self.lens.ray(pixel)?.0)
    }

    /// As [`Camera::ray`], with the derivative of the unit direction by (u, v), per pixel: the three
    /// rows are the direction's components, the two columns u and v.
    ///
    /// # Errors
    /// As [`Camera::ray`].
    pub fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        self.lens.ray(pixel)
    }

    /// The raw pixel that shows a point. It may lie outside the picture: [`Pixel::is_inside`] tells.
    ///
    /// # Errors
    /// [`LensError`] where the lens does not see the point.
    pub fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        Ok(self.lens.pixel(point)?.0)
    }

    /// As [`Camera::pixel`], with the derivative of (u, v) by the point, pixels per metre: the two
    /// rows are u and v, the three columns the point's components.
    ///
    /// # Errors
    /// As [`Camera::pixel`].
    pub fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        self.lens.pixel(point)
    }

    /// Whether the lens model has a ray for the pixel.
    pub fn has_ray(&self, pixel: Pixel) -> bool {
        self.ray(pixel).is_ok()
    }
}
