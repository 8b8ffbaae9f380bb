//! The lens models under one roof.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

use super::lanes::Central;
use super::{BrownConrady, Cahv, Cahvor, Cahvore, Equirectangular, Fisheye, Pinhole};
use crate::frame::{self, Direction, Pixel, Point, Ray};

/// Why a pixel has no ray, or a point no pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum LensError {
    /// The point lies behind the camera, or in the plane of its centre.
    #[error("behind the camera")]
    BehindCamera,
    /// The point or pixel lies where the lens model has no unique answer: beyond the radius at which
    /// the distortion turns back, beyond the angle the model is defined for, at a panorama's pole,
    /// or not a finite number.
    #[error("outside the field of the lens model")]
    OutsideField,
    /// The iteration that inverts the model did not end.
    #[error("the lens model's inverse does not converge")]
    NoConvergence,
}

/// Parameters that make no lens.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BadLens {
    /// Focal lengths that are not above zero, or a principal point that is not finite.
    #[error(
        "found fx {fx}, fy {fy}, cx {cx}, cy {cy}, expected finite numbers, fx and fy above zero"
    )]
    Intrinsics {
        /// Focal length along the columns.
        fx: f64,
        /// Focal length along the rows.
        fy: f64,
        /// Column of the principal point.
        cx: f64,
        /// Row of the principal point.
        cy: f64,
    },
    /// A number of distortion coefficients the model does not have.
    #[error("found {0} distortion coefficients, expected 4, 5, 8, 12 or 14")]
    Count(usize),
    /// Coefficients that are not finite, or that fold the picture at its very centre.
    #[error(
        "found distortion coefficients that fold the picture at its centre, expected ones that keep its order"
    )]
    Distortion,
    /// Vectors or angles that span no picture.
    #[error("found vectors that span no picture, expected A, H and V in three directions")]
    Singular,
    /// A vector that must have a direction and has none.
    #[error("found {0} without a direction, expected a vector of length one")]
    NoDirection(&'static str),
}

/// A lens model: the map between directions in camera axes and raw pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum Lens {
    /// No distortion.
    Pinhole(Pinhole),
    /// OpenCV's standard model, 4 to 14 coefficients.
    BrownConrady(BrownConrady),
    /// OpenCV's fisheye model.
    Fisheye(Fisheye),
    /// A panorama.
    Equirectangular(Equirectangular),
    /// JPL's linear model.
    Cahv(Cahv),
    /// JPL's model with radial distortion.
    Cahvor(Cahvor),
    /// JPL's model for fisheyes, with a moving entrance pupil.
    Cahvore(Cahvore),
}

/// The same for whichever model a lens is.
macro_rules! by_model {
    ($lens:expr, $model:ident => $done:expr) => {
        match $lens {
            Lens::Pinhole($model) => $done,
            Lens::BrownConrady($model) => $done,
            Lens::Fisheye($model) => $done,
            Lens::Equirectangular($model) => $done,
            Lens::Cahv($model) => $done,
            Lens::Cahvor($model) => $done,
            Lens::Cahvore($model) => $done,
        }
    };
}

impl Lens {
    /// The word `model = "..."` of cameras.toml.
    pub fn model(&self) -> &'static str {
        match self {
            Self::Pinhole(_) => "pinhole",
            Self::BrownConrady(_) => "brown_conrady",
            Self::Fisheye(_) => "fisheye",
            Self::Equirectangular(_) => "equirectangular",
            Self::Cahv(_) => "cahv",
            Self::Cahvor(_) => "cahvor",
            Self::Cahvore(_) => "cahvore",
        }
    }

    /// The ray of a pixel.
    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        by_model!(self, lens => lens.ray(pixel))
    }

    /// The rays of pixels, in order, as many as fit; `on_sensor` takes a pixel to the sensor.
    pub(super) fn rays(
        &self,
        pixels: &[Pixel],
        on_sensor: impl Fn(Pixel) -> Pixel,
        rays: &mut [Result<Ray<frame::Camera>, LensError>],
    ) {
        macro_rules! one_by_one {
            ($lens:expr) => {
                for (ray, &pixel) in rays.iter_mut().zip(pixels) {
                    *ray = $lens.ray(on_sensor(pixel));
                }
            };
        }
        match self {
            Self::BrownConrady(lens) => lens.rays(pixels, on_sensor, rays),
            Self::Fisheye(lens) => lens.rays(pixels, on_sensor, rays),
            Self::Cahvor(lens) => lens.rays(pixels, on_sensor, rays),
            Self::Pinhole(lens) => one_by_one!(lens),
            Self::Equirectangular(lens) => one_by_one!(lens),
            Self::Cahv(lens) => one_by_one!(lens),
            Self::Cahvore(lens) => one_by_one!(lens),
        }
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, RayJacobian), LensError> {
        // The moved pupil of a CAHVORE lens is the one origin that depends on the pixel.
        let central = |(ray, direction)| {
            let origin = Matrix3x2::zeros();
            (ray, RayJacobian { origin, direction })
        };
        match self {
            Self::Pinhole(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::BrownConrady(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::Fisheye(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::Equirectangular(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::Cahv(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::Cahvor(lens) => lens.ray_with_jacobian(pixel).map(central),
            Self::Cahvore(lens) => lens.ray_with_jacobian(pixel),
        }
    }

    /// The pixel of a point.
    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        by_model!(self, lens => lens.pixel(point))
    }

    /// The pixels of points, in order, as many as fit.
    pub(super) fn pixels(
        &self,
        points: &[Point<frame::Camera>],
        pixels: &mut [Result<Pixel, LensError>],
    ) {
        by_model!(self, lens => {
            for (pixel, &point) in pixels.iter_mut().zip(points) {
                *pixel = lens.pixel(point);
            }
        });
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        by_model!(self, lens => lens.pixel_with_jacobian(point))
    }
}

/// How a ray changes with its pixel: rows are components in the ray's axes, columns u and v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayJacobian {
    /// Of the origin, metres per pixel; zero but for CAHVORE lenses, whose entrance pupil moves.
    pub origin: Matrix3x2<f64>,
    /// Of the unit direction, per pixel.
    pub direction: Matrix3x2<f64>,
}

impl RayJacobian {
    /// In axes that the rotation matrix turns the present ones into.
    #[must_use]
    pub fn turned(&self, rotation: &Matrix3<f64>) -> Self {
        Self {
            origin: rotation * self.origin,
            direction: rotation * self.direction,
        }
    }

    /// By pixels of which the present ones are so many by columns and by rows.
    pub(super) fn scale_columns(&mut self, step: Vector2<f64>) {
        for matrix in [&mut self.origin, &mut self.direction] {
            matrix.column_mut(0).scale_mut(step.x);
            matrix.column_mut(1).scale_mut(step.y);
        }
    }
}

/// A ray from the camera's centre along a unit vector.
#[inline]
pub(super) fn central_ray(unit: Vector3<f64>) -> Ray<frame::Camera> {
    Ray {
        origin: Point::origin(),
        direction: Direction::from_unit(unit),
    }
}
