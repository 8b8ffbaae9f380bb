//! Which pixels of its detector a rover's picture is made of, and in which of the two a camera model
//! is written.

use super::rover::Vectors;

/// A picture as a part of its detector: the first column and row, from 0, and how many pixels are
/// averaged into one, both ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub(super) first: [f64; 2],
    pub(super) averaged: [f64; 2],
}

/// Whose pixels the H and V of a model count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counts {
    /// Those of the picture.
    Picture,
    /// Those of the whole detector.
    Detector,
}

impl Window {
    /// Whether the picture is the whole detector, pixel by pixel, or its upper left part.
    pub(super) fn is_whole(&self) -> bool {
        self.first == [0.0, 0.0] && self.averaged == [1.0, 1.0]
    }

    /// Where a pixel of the detector lies in the picture: the mean of n pixels is centred between
    /// them, so that `u' = (u - first + 1/2) / n - 1/2`.
    pub(super) fn pixel(&self, detector: [f64; 2]) -> [f64; 2] {
        let one = |i: usize| (detector[i] - self.first[i] + 0.5) / self.averaged[i] - 0.5;
        [one(0), one(1)]
    }

    /// The vectors in the picture's pixels, of vectors in the detector's. H and V are pixels times
    /// A, so that a shift of pixels is a multiple of A.
    pub(super) fn vectors(&self, detector: Vectors) -> Vectors {
        let [c, a, h, v] = detector.cahv;
        let moved = |vector: [f64; 3], i: usize| {
            let n = self.averaged[i];
            let shift = (0.5 - self.first[i]) / n - 0.5;
            [0, 1, 2].map(|k| vector[k] / n + shift * a[k])
        };
        Vectors {
            cahv: [c, a, moved(h, 0), moved(v, 1)],
            ..detector
        }
    }

    /// Whose pixels a model counts: the place where the picture plane's normal A meets the picture
    /// lies near the middle of the detector, of this size, in one of the two.
    pub(super) fn counts(&self, vectors: &Vectors, detector: [f64; 2]) -> Counts {
        let [_, a, h, v] = vectors.cahv;
        let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        let centre = [h, v].map(|x| dot(a, x) / dot(a, a));
        let middle = detector.map(|n| 0.5 * (n - 1.0));
        let away = |to: [f64; 2]| (centre[0] - to[0]).hypot(centre[1] - to[1]);
        if away(middle) < away(self.pixel(middle)) {
            Counts::Detector
        } else {
            Counts::Picture
        }
    }
}
