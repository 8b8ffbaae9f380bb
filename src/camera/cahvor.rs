//! JPL's camera model with radial distortion.

use nalgebra::{Matrix2x3, Matrix3x2, Vector3};

use super::cahv::OpticalAxis;
use super::lanes::Central;
use super::perspective::{
    direction_by_plane, direction_of_plane, plane_by_point, plane_of_point, product,
};
use super::radial::Radial;
use super::sensor::Sensor;
use super::{BadLens, Cahv, CahvVectors, LensError, Mount, central_ray};
use crate::frame::{self, Pixel, Point, Ray};

/// CAHVOR (Gennery 1992): CAHV with radial distortion about an optical axis O of its own.
///
/// ```text
/// zeta = p.O    lambda = p - zeta O    tau = lambda.lambda / zeta^2
/// p'   = p + (rho0 + rho1 tau + rho2 tau^2) lambda
/// ```
///
/// with p the point from C; p' is then seen by the CAHV model.
#[derive(Debug, Clone, PartialEq)]
pub struct Cahvor {
    base: Cahv,
    optical: OpticalAxis,
    distortion: [f64; 3],
    radial: Radial,
    sensor: Sensor,
}

impl Cahvor {
    /// The lens of the CAHV vectors, the optical axis O in the same axes, and the coefficients
    /// R = rho0, rho1, rho2.
    ///
    /// # Errors
    /// As [`Cahv::new`], [`BadLens::NoDirection`] where O is zero, [`BadLens::Distortion`].
    pub fn new(vectors: CahvVectors, o: [f64; 3], r: [f64; 3]) -> Result<Self, BadLens> {
        let base = Cahv::new(vectors)?;
        let optical = OpticalAxis::new(&base, o)?;
        let sensor = base
            .sensor_along(&optical.lens_from_camera)
            .ok_or(BadLens::Singular)?;
        Ok(Self {
            base,
            optical,
            distortion: r,
            radial: radial(r, optical.length).ok_or(BadLens::Distortion)?,
            sensor,
        })
    }

    /// The linear part.
    pub fn linear(&self) -> &Cahv {
        &self.base
    }

    /// O, in the axes of [`Cahv::vectors_on`] this mount.
    pub fn optical_axis_on(&self, mount: &Mount) -> [f64; 3] {
        self.optical.vector_on(&self.base, mount)
    }

    /// R: rho0, rho1, rho2.
    pub fn distortion(&self) -> [f64; 3] {
        self.distortion
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        let (distorted, distorted_by_pixel) = self.sensor.plane_with_jacobian(pixel)?;
        let (plane, by_distorted) = self.radial.undistort_with_jacobian(distorted)?;
        let direction = direction_of_plane(plane);
        let turn = self.optical.lens_from_camera.transpose();
        let jacobian = product(
            &product(&turn, &direction_by_plane(direction)),
            &product(&by_distorted, &distorted_by_pixel),
        );
        Ok((central_ray(product(&turn, &direction)), jacobian))
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        let plane = plane_of_point(product(&self.optical.lens_from_camera, &point.xyz))?;
        self.sensor.pixel(self.radial.distort(plane)?)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        let turn = self.optical.lens_from_camera;
        let in_lens = product(&turn, &point.xyz);
        let plane = plane_of_point(in_lens)?;
        let (distorted, by_plane) = self.radial.distort_with_jacobian(plane)?;
        let (pixel, by_distorted) = self.sensor.pixel_with_jacobian(distorted)?;
        Ok((
            pixel,
            product(
                &product(&by_distorted, &by_plane),
                &product(&plane_by_point(plane, in_lens.z), &turn),
            ),
        ))
    }
}

impl Central for Cahvor {
    #[inline(always)]
    fn directions<const N: usize>(&self, pixels: &[Pixel; N]) -> [Vector3<f64>; N] {
        let planes = self.radial.undistort_nearby(&self.sensor.planes(pixels));
        let turn = self.optical.lens_from_camera.transpose();
        planes.directions().map(|unit| product(&turn, &unit))
    }

    fn searched_direction(&self, pixel: Pixel) -> Result<Vector3<f64>, LensError> {
        let plane = self.radial.undistort(self.sensor.plane(pixel)?)?;
        let turn = self.optical.lens_from_camera.transpose();
        Ok(product(&turn, &direction_of_plane(plane)))
    }
}

/// The distortion as a map of the radius `t` at unit depth along O.
///
/// Files round O to six digits, and the formula takes it as it is: with `n` its length and
/// `e = 1 - n^2`, `tau = (e^2 + t^2) / n^2` and the distorted radius is `t (1 + mu) / (1 + mu e)`.
fn radial([r0, r1, r2]: [f64; 3], n: f64) -> Option<Radial> {
    let e = 1.0 - n * n;
    let (shift, scale) = (e * e / (n * n), 1.0 / (n * n));
    let mu = [
        r0 + r1 * shift + r2 * shift * shift,
        (r1 + 2.0 * r2 * shift) * scale,
        r2 * scale * scale,
    ];
    Radial::new(
        [1.0 + mu[0], mu[1], mu[2], 0.0, 0.0],
        [1.0 + mu[0] * e, mu[1] * e, mu[2] * e, 0.0],
    )
}
