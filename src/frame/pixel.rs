//! Where something is in a raw picture.

use nalgebra::Vector2;

/// A place in the raw (distorted) picture, in pixels: `u` right, `v` down.
///
/// An integer is the centre of a pixel and (0, 0) the centre of the top-left one, so a picture of
/// `width` by `height` spans -0.5 to `width - 0.5` and -0.5 to `height - 0.5`. Undistorted pixels
/// never leave the lens models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Column, rightwards.
    pub u: f64,
    /// Row, downwards.
    pub v: f64,
}

impl Pixel {
    /// The pixel at column `u` and row `v`.
    pub const fn new(u: f64, v: f64) -> Self {
        Self { u, v }
    }

    /// The pair as a vector, for arithmetic.
    pub fn to_vector(self) -> Vector2<f64> {
        Vector2::new(self.u, self.v)
    }

    /// Distance to another pixel, pixels.
    pub fn distance(self, other: Pixel) -> f64 {
        (self.u - other.u).hypot(self.v - other.v)
    }

    /// Whether the pixel lies in a picture of this size, its border included.
    pub fn is_inside(self, width: u32, height: u32) -> bool {
        self.u >= -0.5
            && self.v >= -0.5
            && self.u <= f64::from(width) - 0.5
            && self.v <= f64::from(height) - 0.5
    }
}

impl From<Vector2<f64>> for Pixel {
    fn from(v: Vector2<f64>) -> Self {
        Self::new(v.x, v.y)
    }
}
