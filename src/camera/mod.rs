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
mod convert;
mod equirectangular;
mod fisheye;
mod foreign;
mod inverse;
mod lanes;
mod lens;
mod list;
mod mount;
mod perspective;
mod pinhole;
mod polynomial;
mod radial;
mod read;
mod read_readout;
mod read_vectors;
mod readout;
mod sensor;
mod write;

use std::collections::BTreeMap;

use nalgebra::Matrix2x3;

use crate::frame::{self, Pixel, Point, Ray};

pub use brown_conrady::BrownConrady;
pub use cahv::{BodyAxes, Cahv, CahvVectors};
pub use cahvor::Cahvor;
pub use cahvore::{Cahvore, Linearity};
pub use convert::{Axes, Conversion, Converted, pixels_of_table, rays_of_table};
pub use equirectangular::Equirectangular;
pub use fisheye::Fisheye;
pub use foreign::{
    CameraFile, CameraFormat, RoverImage, RoverPose, SiteLink, attitude_of_ned, cameras_from_bytes,
    read_camera_file,
};
pub use lens::{BadLens, Lens, LensError, RayJacobian};
pub use list::{cameras_as_json, cameras_as_text, find_camera};
pub use mount::{Mount, PanTilt};
pub use pinhole::{Intrinsics, Pinhole};
pub(crate) use read::camera as read_camera;
pub use read::cameras_from_toml;
pub use readout::{BadReadout, Readout, Reduction, Subframe};
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
    /// The lens model, in pixels of the full sensor.
    pub lens: Lens,
    /// Its place on the platform.
    pub mount: Mount,
    /// Which part of the sensor the pictures show, and how coarsely; `None` where they show all
    /// of it, pixel by pixel.
    pub readout: Option<Readout>,
}

impl Camera {
    /// The ray a raw pixel looks along, in camera axes. It starts at the camera's centre, but for
    /// CAHVORE lenses, whose entrance pupil moves along the optical axis.
    ///
    /// # Errors
    /// [`LensError`] where the lens model has no ray for the pixel. A pixel outside the picture may
    /// have a ray all the same.
    pub fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        self.lens.ray(self.on_sensor(pixel))
    }

    /// As [`Camera::ray`], with the derivative of the ray's origin and unit direction by (u, v),
    /// per pixel.
    ///
    /// # Errors
    /// As [`Camera::ray`].
    pub fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, RayJacobian), LensError> {
        let (ray, mut by_pixel) = self.lens.ray_with_jacobian(self.on_sensor(pixel))?;
        if let Some(readout) = &self.readout {
            by_pixel.scale_columns(readout.step());
        }
        Ok((ray, by_pixel))
    }

    /// The rays of many raw pixels, each as [`Camera::ray`] has it to the last bit, into `rays` of
    /// the same length. Faster than one by one, since the kind of lens is asked for once.
    ///
    /// Of slices of two lengths, what the longer has beyond the shorter is left alone.
    pub fn rays(&self, pixels: &[Pixel], rays: &mut [Result<Ray<frame::Camera>, LensError>]) {
        match &self.readout {
            None => self.lens.rays(pixels, |pixel| pixel, rays),
            Some(readout) => self
                .lens
                .rays(pixels, |pixel| readout.on_sensor(pixel), rays),
        }
    }

    /// The raw pixel that shows a point. It may lie outside the picture: [`Pixel::is_inside`] tells.
    ///
    /// # Errors
    /// [`LensError`] where the lens does not see the point.
    pub fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        Ok(self.in_picture(self.lens.pixel(point)?))
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
        let (pixel, mut by_point) = self.lens.pixel_with_jacobian(point)?;
        if let Some(readout) = &self.readout {
            let step = readout.step();
            by_point.row_mut(0).unscale_mut(step.x);
            by_point.row_mut(1).unscale_mut(step.y);
        }
        Ok((self.in_picture(pixel), by_point))
    }

    /// The raw pixels of many points, each as [`Camera::pixel`] has it to the last bit, into
    /// `pixels` of the same length; otherwise as [`Camera::rays`].
    pub fn pixels(&self, points: &[Point<frame::Camera>], pixels: &mut [Result<Pixel, LensError>]) {
        self.lens.pixels(points, pixels);
        if let Some(readout) = &self.readout {
            let seen = pixels.iter_mut().take(points.len()).flatten();
            seen.for_each(|pixel| *pixel = readout.in_picture(*pixel));
        }
    }

    /// Whether the lens model has a ray for the pixel.
    pub fn has_ray(&self, pixel: Pixel) -> bool {
        self.ray(pixel).is_ok()
    }

    /// The same camera with pictures that show a part of its present ones.
    ///
    /// # Errors
    /// [`BadReadout`] where there is no such part.
    pub fn subframe(&self, part: Subframe) -> Result<Self, BadReadout> {
        Ok(self.read_out(self.readout_or_whole().cut(part)?))
    }

    /// The same camera with pictures each of whose pixels is the average of a block of `by` columns
    /// and rows of its present ones; [`Reduction::Binning`] states the convention.
    ///
    /// # Errors
    /// [`BadReadout`] where a block is larger than the picture, or the pictures are downsampled.
    pub fn binned(&self, by: [u32; 2]) -> Result<Self, BadReadout> {
        Ok(self.read_out(self.readout_or_whole().binned(by)?))
    }

    /// The same camera with pictures of every so-many-th column and row of its present ones;
    /// [`Reduction::Downsampling`] states the convention.
    ///
    /// # Errors
    /// [`BadReadout`] where a step is larger than the picture, or the pictures are binned.
    pub fn downsampled(&self, by: [u32; 2]) -> Result<Self, BadReadout> {
        Ok(self.read_out(self.readout_or_whole().downsampled(by)?))
    }

    fn readout_or_whole(&self) -> Readout {
        self.readout
            .unwrap_or_else(|| Readout::whole(self.width, self.height))
    }

    fn read_out(&self, readout: Readout) -> Self {
        let [width, height] = readout.size();
        Self {
            width,
            height,
            readout: (!readout.is_whole()).then_some(readout),
            ..self.clone()
        }
    }

    #[inline]
    fn on_sensor(&self, pixel: Pixel) -> Pixel {
        self.readout
            .map_or(pixel, |readout| readout.on_sensor(pixel))
    }

    #[inline]
    fn in_picture(&self, sensor: Pixel) -> Pixel {
        self.readout
            .map_or(sensor, |readout| readout.in_picture(sensor))
    }
}
