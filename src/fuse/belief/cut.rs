//! Boxes that the picture's border cuts: what is left of them is measured, what lies across the
//! border is not.
//!
//! Of a side that is cut at one end the other end is as good a reading as any. It replaces the aim
//! point: `end = aim - to_aim * length`, where the length is what the object's size and place let
//! expect, `exp(row 2)`, times the shape that whole boxes have; but no less than what is seen.

use super::SizeRule;
use super::algebra::Square4;
use super::data::Look;
use super::engine::{Engine, Normal};
use super::evidence::Evidence;
use super::expect::Expected;
use super::single::median;
use crate::adjust::{Measurement, Reading};
use crate::detection::{Cut, PixelBox, Side};

/// What is cut off, as a share of what an object is long, is anything up to about four fifths: the
/// logarithm of the whole over what is seen has this mean, and this standard deviation.
const MORE: (f64, f64) = (0.5, 0.5);
/// Ends of the side that is not cut: what is left of an object need not reach as far as the whole,
/// one standard deviation as a share of its length. An ellipse of which a quarter is left is nine
/// tenths as wide.
const OTHER: f64 = 0.1;
/// How uncertain the mark of a side is of which both ends are cut, one standard deviation as a share
/// of its length.
const LOST: f64 = 0.5;
/// Fewer whole boxes say nothing about shapes; the logarithm of a side over the other has this
/// standard deviation then, and no less with more.
const LEAST_BOXES: usize = 6;
const SHAPE_SIGMA: (f64, f64) = (0.5, 0.05);
/// The share of objects that are detected although their aim point lies beyond the border, before any
/// data; it counts for so many looks.
pub(super) const START_BORDER: f64 = 0.5;
const BORDER_COUNT: f64 = 1.0;
/// Objects less likely beyond the border say nothing of it.
const LEAST_BEYOND: f64 = 0.05;

/// How long boxes are along and down, over the side that says how large objects are: logarithms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    sides: [Normal; 2],
}

impl Shape {
    /// As whole boxes have it.
    pub(super) fn of(measurements: &[Measurement], rule: SizeRule) -> Self {
        let whole = measurements.iter().filter(|m| !m.cut.is_any());
        let ratios: Vec<f64> = whole
            .filter_map(|m| m.bounds)
            .filter(|b| b.width() > 0.0 && b.height() > 0.0)
            .map(|b| match rule {
                SizeRule::Width => (b.height() / b.width()).ln(),
                SizeRule::Height => (b.width() / b.height()).ln(),
            })
            .collect();
        let mut other = Normal {
            mean: 0.0,
            variance: SHAPE_SIGMA.0.powi(2),
        };
        if ratios.len() >= LEAST_BOXES
            && let Some(mean) = median(ratios.clone())
            && let Some(spread) = median(ratios.iter().map(|r| (r - mean).abs()).collect())
        {
            let variance = (1.4826 * spread).max(SHAPE_SIGMA.1).powi(2);
            other = Normal { mean, variance };
        }
        let own = Normal {
            mean: 0.0,
            variance: 0.0,
        };
        Self {
            sides: match rule {
                SizeRule::Width => [own, other],
                SizeRule::Height => [other, own],
            },
        }
    }

    /// Lengths along and down of what has an apparent size, pixels.
    pub(super) fn lengths_px(&self, size_px: f64) -> [f64; 2] {
        self.sides.map(|side| size_px * side.mean.exp())
    }
}

/// Where in boxes the aim points lie, as shares of their lengths.
pub(super) fn aim(measurements: &[Measurement]) -> [f64; 2] {
    let shares = measurements.iter().filter_map(|m| {
        let (b, Reading::Pixel { pixel, .. }) = (m.bounds?, m.reading) else {
            return None;
        };
        (b.height() > 0.0).then(|| (pixel.v - b.y_min) / b.height())
    });
    [0.5, median(shares.collect()).unwrap_or(0.5)]
}

/// What is left of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Left {
    sides: [Side; 2],
    /// Lengths of what is seen, pixels.
    seen_px: [f64; 2],
    /// Of what is expected, over the size.
    ratios: [f64; 2],
    /// Variances of the logarithms of those.
    spreads: [f64; 2],
    /// No less than this is the size of the whole, pixels.
    size_px: f64,
    /// The side that says the size.
    size_side: Side,
}

impl Left {
    pub(super) fn of(cut: Cut, bounds: PixelBox, shape: &Shape, rule: SizeRule) -> Option<Self> {
        let sides = [cut.across, cut.down];
        let seen_px = [bounds.width(), bounds.height()];
        let ratios = shape.sides.map(|side| side.mean.exp());
        let size_side = match rule {
            SizeRule::Width => cut.across,
            SizeRule::Height => cut.down,
        };
        let is_left = cut.is_any() && seen_px[0] > 0.0 && seen_px[1] > 0.0;
        is_left.then_some(Self {
            sides,
            seen_px,
            ratios,
            spreads: shape.sides.map(|side| side.variance),
            size_px: (seen_px[0] / ratios[0]).max(seen_px[1] / ratios[1]),
            size_side,
        })
    }

    /// What is read instead of the aim point.
    pub(super) fn ends(&self, aim: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| match self.sides[i] {
            Side::Cut { end_px, .. } => end_px,
            _ => aim[i],
        })
    }

    /// Logarithm of the size, read off what is seen of it.
    pub(super) fn log_size(&self, seen: f64) -> f64 {
        match self.size_side {
            Side::Cut { .. } => seen + MORE.0,
            _ => seen,
        }
    }

    /// No less than this is the size of the whole, pixels.
    pub(super) fn size_px(&self) -> f64 {
        self.size_px
    }

    /// What the border adds to the variances of column, row and logarithm of the size.
    pub(super) fn variances(&self) -> [f64; 3] {
        let mut more = [0.0; 3];
        for i in 0..2 {
            let length_px = (self.size_px * self.ratios[i]).max(self.seen_px[i]);
            more[i] = match self.sides[i] {
                Side::Whole => (OTHER * length_px).powi(2),
                Side::Cut { to_aim, .. } => (to_aim * length_px).powi(2) * self.spreads[i],
                Side::Lost => (LOST * length_px).powi(2),
            };
        }
        more[2] = match self.size_side {
            Side::Whole => OTHER.powi(2),
            _ => MORE.1.powi(2),
        };
        more
    }

    /// Of column and row: how far the end that is read lies from the aim point of the object, and the
    /// derivative of that by the logarithm of its apparent size.
    pub(super) fn offsets(&self, log_size: f64) -> [(f64, f64); 2] {
        std::array::from_fn(|i| match self.sides[i] {
            Side::Cut { to_aim, .. } => {
                let length_px = log_size.exp() * self.ratios[i];
                if length_px > self.seen_px[i] {
                    (-to_aim * length_px, -to_aim * length_px)
                } else {
                    (-to_aim * self.seen_px[i], 0.0)
                }
            }
            _ => (0.0, 0.0),
        })
    }
}

impl Engine<'_> {
    /// How often objects are detected whose aim point lies beyond the border: some detectors mark
    /// what is left of them, others leave them out. Least squares over the views that other views'
    /// objects may be at the border of.
    pub(super) fn learn_border(&mut self, evidence: &Evidence, real: &[f64], support: &[f64]) {
        let (mut hits, mut chances) = (BORDER_COUNT * START_BORDER, BORDER_COUNT);
        let pairs = evidence.expectation.pairs.iter().zip(&evidence.detected);
        for ((pair, q), worth) in pairs.zip(&evidence.worth) {
            let k = pair.object;
            if support[k] - *q > 0.8 && real[k] > 0.5 && pair.beyond > LEAST_BEYOND {
                let p = self.model.curve.at(pair.visibility);
                let weight = real[k] * worth * pair.beyond;
                hits += weight * (q - p * pair.inside);
                chances += weight * p * pair.beyond;
            }
        }
        self.model.border = (hits / chances).clamp(0.0, 1.0);
    }
}

impl Expected {
    /// What is expected of the ends that a look reads, where the border cuts its box.
    #[inline]
    pub(super) fn of_ends(&self, look: &Look) -> Option<Self> {
        let offsets = look.left.as_ref()?.offsets(self.values[2]);
        let mut ends = *self;
        for (r, (offset, gain)) in offsets.into_iter().enumerate() {
            ends.values[r] += offset;
            for i in 0..4 {
                ends.by_object[r][i] += gain * self.by_object[2][i];
            }
            for i in 0..6 {
                ends.by_pose[r][i] += gain * self.by_pose[2][i];
            }
        }
        Some(ends)
    }

    /// A spread of this view's readings as the look's ends have it.
    #[inline]
    pub(super) fn spread_of_ends(&self, look: &Look, spread: &Square4) -> Square4 {
        let Some(left) = look.left.as_ref() else {
            return *spread;
        };
        let mut out = *spread;
        for (r, (_, gain)) in left.offsets(self.values[2]).into_iter().enumerate() {
            for i in 0..4 {
                out[r][i] += gain * out[2][i];
            }
            for row in &mut out {
                row[r] += gain * row[2];
            }
        }
        out
    }
}
