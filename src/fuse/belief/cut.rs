//! Boxes that the picture's border cuts: what is left of them is measured, what lies across the
//! border is not.
//!
//! Of a side that is cut at one end the other end is as good a reading as any. It replaces the aim
//! point: `end = aim - to_aim * length`, where the length is what the object's size and place let
//! expect, `exp(row 2)`, times the shape that whole boxes have; but no less than what is seen.

use super::SizeRule;
use super::algebra::Square4;
use super::data::Look;
use super::engine::Normal;
use super::expect::Expected;
use super::single::median;
use crate::adjust::Measurement;
use crate::detection::{Cut, PixelBox, Side};

/// What is cut off, as a share of what an object is long, is anything up to about four fifths: the
/// logarithm of the whole over what is seen has this mean, and this standard deviation.
const MORE: (f64, f64) = (0.5, 0.5);
/// Ends of the side that is not cut: what is left of an object need not reach as far as the whole,
/// one standard deviation as a share of its length. An ellipse of which a quarter is left is nine
/// tenths as wide.
const OTHER: f64 = 0.1;
/// How uncertain the mark of a side is of which both ends are cut, as a share of its length; and of
/// the other side of one of which that is not said.
const LOST: f64 = 0.5;
/// Fewer whole boxes say nothing about shapes; the logarithm of a side over the other has this
/// standard deviation then, and no less with more.
const LEAST_BOXES: usize = 6;
const SHAPE_SIGMA: (f64, f64) = (0.5, 0.05);

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
    /// Whether the side that says the size is cut.
    is_size_cut: bool,
}

impl Left {
    pub(super) fn of(cut: Cut, bounds: PixelBox, shape: &Shape, rule: SizeRule) -> Option<Self> {
        let sides = [cut.across, cut.down];
        let seen_px = [bounds.width(), bounds.height()];
        let ratios = shape.sides.map(|side| side.mean.exp());
        let of_size = match rule {
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
            is_size_cut: of_size != Side::Whole,
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
        let one_end = self
            .sides
            .iter()
            .zip(&self.spreads)
            .any(|(side, &spread)| spread == 0.0 && matches!(side, Side::Cut { .. }));
        if one_end { seen + MORE.0 } else { seen }
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
        more[2] = if self.is_size_cut { MORE.1 } else { OTHER }.powi(2);
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
