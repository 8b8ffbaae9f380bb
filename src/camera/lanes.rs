//! Several pixels at once, side by side, as processors like them.
//!
//! A lens model that inverts its distortion by a long chain of operations is bound by that chain's
//! length, not by its number of operations; eight independent chains run in little more time than
//! one. A single pixel goes the same way, so that it has the same ray to the last bit.

use nalgebra::{Vector2, Vector3};

use super::perspective::direction_of_plane;
use super::{LensError, central_ray};
use crate::frame::{self, Pixel, Ray};

/// How many pixels go side by side.
const LANES: usize = 8;

/// Places on a plane, side by side; not numbers where there is no answer by the short way.
#[derive(Clone, Copy)]
pub(super) struct Places<const N: usize> {
    pub(super) x: [f64; N],
    pub(super) y: [f64; N],
}

impl<const N: usize> Places<N> {
    /// The places that `place` gives for each lane.
    #[inline(always)]
    pub(super) fn from_fn(mut place: impl FnMut(usize) -> Vector2<f64>) -> Self {
        let (mut x, mut y) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let place = place(i);
            (x[i], y[i]) = (place.x, place.y);
        }
        Self { x, y }
    }

    /// The place in a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Vector2<f64> {
        Vector2::new(self.x[lane], self.y[lane])
    }

    /// Puts a place into a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, place: Vector2<f64>) {
        (self.x[lane], self.y[lane]) = (place.x, place.y);
    }

    /// The unit directions to these places on the plane at unit depth.
    #[inline(always)]
    pub(super) fn directions(&self) -> [Vector3<f64>; N] {
        let (mut x, mut y, mut z) = ([0.0; N], [0.0; N], [0.0; N]);
        for i in 0..N {
            let unit = direction_of_plane(self.get(i));
            (x[i], y[i], z[i]) = (unit.x, unit.y, unit.z);
        }
        std::array::from_fn(|i| Vector3::new(x[i], y[i], z[i]))
    }
}

/// A lens with a short way from pixels to directions, which serves nearly everywhere, and a long
/// way, which serves everywhere.
pub(super) trait Central {
    /// Unit directions in camera axes; not numbers where the short way does not lead to an answer.
    fn directions<const N: usize>(&self, pixels: &[Pixel; N]) -> [Vector3<f64>; N];

    /// The direction by the long way.
    ///
    /// # Errors
    /// [`LensError`] where the pixel has none.
    fn searched_direction(&self, pixel: Pixel) -> Result<Vector3<f64>, LensError>;

    /// The ray of a pixel.
    #[inline]
    fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        let [direction] = self.directions(&[pixel]);
        self.checked(pixel, direction)
    }

    /// The rays of pixels, in order, as many as fit.
    fn rays(
        &self,
        pixels: &[Pixel],
        on_sensor: impl Fn(Pixel) -> Pixel,
        rays: &mut [Result<Ray<frame::Camera>, LensError>],
    ) {
        let count = pixels.len().min(rays.len());
        let (blocks, rest) = pixels[..count].as_chunks::<LANES>();
        let (ray_blocks, ray_rest) = rays[..count].as_chunks_mut::<LANES>();
        for (block, rays) in blocks.iter().zip(ray_blocks) {
            let block = block.map(&on_sensor);
            let directions = self.directions(&block);
            for ((ray, pixel), direction) in rays.iter_mut().zip(block).zip(directions) {
                *ray = self.checked(pixel, direction);
            }
        }
        for (ray, &pixel) in ray_rest.iter_mut().zip(rest) {
            *ray = self.ray(on_sensor(pixel));
        }
    }

    /// The ray along a direction, if that is one.
    #[inline(always)]
    fn checked(
        &self,
        pixel: Pixel,
        direction: Vector3<f64>,
    ) -> Result<Ray<frame::Camera>, LensError> {
        if direction.z.is_nan() {
            self.searched_direction(pixel).map(central_ray)
        } else {
            Ok(central_ray(direction))
        }
    }
}
