//! The lens models under one roof.

use nalgebra::{Matrix2x3, Matrix3x2, Vector3};

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

    #[inline]
    pub(super) fn ray(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        match self {
            Self::Pinhole(lens) => lens.ray(pixel),
            Self::BrownConrady(lens) => lens.ray(pixel),
            Self::Fisheye(lens) => lens.ray(pixel),
            Self::Equirectangular(lens) => lens.ray(pixel),
            Self::Cahv(lens) => lens.ray(pixel),
            Self::Cahvor(lens) => lens.ray(pixel),
            Self::Cahvore(lens) => lens.ray(pixel),
        }
    }

    #[inline]
    pub(super) fn pixel(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        match self {
            Self::Pinhole(lens) => lens.pixel(point),
            Self::BrownConrady(lens) => lens.pixel(point),
            Self::Fisheye(lens) => lens.pixel(point),
            Self::Equirectangular(lens) => lens.pixel(point),
            Self::Cahv(lens) => lens.pixel(point),
            Self::Cahvor(lens) => lens.pixel(point),
            Self::Cahvore(lens) => lens.pixel(point),
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
