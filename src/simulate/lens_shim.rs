//! A pinhole in place of the lens models.

use std::fmt;

use nalgebra::{Matrix2x3, Vector3};

use crate::frame::{self, Direction, Pixel, Point, Ray, RigidTransform, Rotation, Vector};

/// A camera.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Its name.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length, pixels.
    pub f: f64,
    /// Its mount.
    pub mount: Mount,
}

/// A mount.
#[derive(Debug, Clone)]
pub struct Mount {
    /// Body from camera.
    pub body_from_camera: RigidTransform<frame::Body, frame::Camera>,
}

/// A head.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PanTilt {
    /// Clockwise.
    pub pan: f64,
    /// Up.
    pub tilt: f64,
}

/// No ray.
#[derive(Debug)]
pub struct LensError;
impl fmt::Display for LensError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("behind")
    }
}

impl Mount {
    /// Body from camera.
    pub fn body_from_camera(&self, head: PanTilt) -> RigidTransform<frame::Body, frame::Camera> {
        let turn = Rotation::<frame::Body, frame::Body>::identity()
            .perturbed(Vector3::new(0.0, 0.0, -head.pan))
            .perturbed(Vector3::new(0.0, -head.tilt, 0.0));
        RigidTransform::new(
            turn * self.body_from_camera.rotation,
            Vector::from_xyz(self.body_from_camera.translation.xyz),
        )
    }
}

impl Camera {
    fn centre(&self) -> (f64, f64) {
        (
            0.5 * (f64::from(self.width) - 1.0),
            0.5 * (f64::from(self.height) - 1.0),
        )
    }
    /// A ray.
    ///
    /// # Errors
    /// None.
    pub fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        let (cx, cy) = self.centre();
        let v = Vector3::new((pixel.u - cx) / self.f, (pixel.v - cy) / self.f, 1.0);
        Ok(Ray {
            origin: Point::origin(),
            direction: Direction::new(v).ok_or(LensError)?,
        })
    }
    /// A pixel.
    ///
    /// # Errors
    /// Behind.
    pub fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let (cx, cy) = self.centre();
        let p = point.xyz;
        if p.z <= 0.0 {
            return Err(LensError);
        }
        let s = self.f / p.z;
        let pixel = Pixel::new(s * p.x + cx, s * p.y + cy);
        let j = Matrix2x3::new(s, 0.0, -s * p.x / p.z, 0.0, s, -s * p.y / p.z);
        Ok((pixel, j))
    }
}
