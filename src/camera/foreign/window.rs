//! Which pixels of its detector a rover's picture is made of, and in which of the two a camera model
//! is written.

use super::rover::Vectors;
use crate::camera::{BadReadout, Readout, Subframe};
use crate::frame::Pixel;

/// A picture as a part of its detector: the first column and row, from 0, and how many pixels are
/// averaged into one, both ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) first: [u32; 2],
    pub(super) averaged: [u32; 2],
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
        self.first == [0, 0] && self.averaged == [1, 1]
    }

    /// The part of the detector that a picture of this size shows.
    pub(super) fn part(&self, [width, height]: [u32; 2]) -> Subframe {
        let [first_u_px, first_v_px] = self.first;
        Subframe {
            first_u_px,
            first_v_px,
            width: width.saturating_mul(self.averaged[0]),
            height: height.saturating_mul(self.averaged[1]),
        }
    }

    /// How a picture of this size is read out of its detector.
    ///
    /// # Errors
    /// [`BadReadout`] where the detector does not hold it.
    pub(super) fn readout(
        &self,
        [columns, rows]: [u32; 2],
        picture: [u32; 2],
    ) -> Result<Readout, BadReadout> {
        let part = Readout::whole(columns, rows).cut(self.part(picture))?;
        part.binned(self.averaged)
    }
}

/// Whose pixels a model counts: the place where the picture plane's normal A meets the picture lies
/// near the middle of the detector in one of the two.
pub(super) fn counts(vectors: &Vectors, readout: &Readout) -> Counts {
    let [_, a, h, v] = vectors.cahv;
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let [u, v] = [h, v].map(|x| dot(a, x) / dot(a, a));
    let centre = Pixel::new(u, v);
    let [column, row] = readout.sensor().map(|n| 0.5 * (f64::from(n) - 1.0));
    let middle = Pixel::new(column, row);
    if centre.distance(middle) < centre.distance(readout.in_picture(middle)) {
        Counts::Detector
    } else {
        Counts::Picture
    }
}
