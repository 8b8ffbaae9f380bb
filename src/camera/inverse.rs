//! A table of an inverse radial map, from which Newton's method starts next to the answer.

use std::fmt;
use std::sync::Arc;

/// The ratio of the undistorted to the distorted radius over the square `q` of the latter, in
/// cubic pieces.
///
/// The ratio is an analytic function of `q`, centre included, which the radius itself is not. The
/// pieces are narrow in proportion to `q`: 64 from every power of two to the next, found by the
/// leading bits of `q`, below them one that reaches down to zero.
#[derive(Clone, PartialEq)]
pub(super) struct InverseTable {
    /// One less than the leading bits of the square at which the second piece begins.
    below_first: u64,
    /// Coefficients in powers of `q` less the beginning of the piece.
    pieces: Arc<[[f64; 4]]>,
}

/// A ratio and its derivative by `q`.
pub(super) type Sample = (f64, f64);

/// Leading bits of a number that tell its piece: exponent and six bits of its fraction.
const SHIFT: u32 = 52 - 6;

/// The first piece ends so many powers of two below the end of the table, or below one: at a
/// radius a sixty-fourth of the largest the ratio is next to constant.
const BELOW: f64 = 1.0 / 4096.0;

/// The piece beyond the last.
const BEYOND: [f64; 4] = [f64::NAN; 4];

impl InverseTable {
    /// A table without pieces.
    pub(super) fn empty() -> Self {
        Self {
            below_first: 0,
            pieces: Arc::new([]),
        }
    }

    /// The table of a ratio that `sample` gives, from zero to the square `end`; shorter where the
    /// ratio ends earlier.
    pub(super) fn new(end: f64, sample: impl Fn(f64) -> Option<Sample>) -> Self {
        let tabulated = end > 1e-100 && end < 1e100;
        if !tabulated {
            return Self::empty();
        }
        let bits = |q: f64| q.to_bits() >> SHIFT;
        let first = bits(BELOW * end.min(1.0));
        let mut begin = 0.0;
        let mut left = sample(0.0);
        let mut pieces = Vec::new();
        for end in (first..bits(end)).map(|bits| f64::from_bits(bits << SHIFT)) {
            let right = sample(end);
            let (Some(l), Some(r)) = (left, right) else {
                break;
            };
            pieces.push(cubic(end - begin, l, r));
            (begin, left) = (end, right);
        }
        Self {
            below_first: first - 1,
            pieces: pieces.into(),
        }
    }

    /// The ratio at `q`, but for a billionth or so; not a number beyond the table.
    #[inline(always)]
    pub(super) fn ratio(&self, q: f64) -> f64 {
        // The order of numbers above zero is that of their bits.
        let bits = q.to_bits() >> SHIFT;
        let index = bits.saturating_sub(self.below_first);
        let begin = if index == 0 {
            0.0
        } else {
            f64::from_bits(bits << SHIFT)
        };
        let piece = self.pieces.get(index as usize);
        let [c0, c1, c2, c3] = *piece.unwrap_or(&BEYOND);
        let t = q - begin;
        c0 + t * (c1 + t * (c2 + t * c3))
    }
}

/// The cubic of these values and slopes at the ends of a piece of this width (Hermite), from its
/// beginning.
fn cubic(width: f64, (left, rise): Sample, (right, fall): Sample) -> [f64; 4] {
    let chord = (right - left) / width;
    let bend = (3.0 * chord - 2.0 * rise - fall) / width;
    let twist = (rise + fall - 2.0 * chord) / (width * width);
    [left, rise, bend, twist]
}

/// The table follows from the map it inverts.
impl fmt::Debug for InverseTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "InverseTable({} pieces)", self.pieces.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1 / (1 + q)` and its slope.
    fn sample(q: f64) -> Option<Sample> {
        let ratio = 1.0 / (1.0 + q);
        (q < 3.0).then_some((ratio, -ratio * ratio))
    }

    #[test]
    fn between_the_samples_the_table_is_near() {
        let table = InverseTable::new(8.0, sample);
        for i in 0..2870 {
            let q = f64::from(i) * 1e-3;
            let off = table.ratio(q) - sample(q).unwrap().0;
            assert!(off.abs() < 1e-9, "{q} {off:e}");
        }
        assert_eq!([table.ratio(0.0), table.ratio(1e-300)], [1.0, 1.0]);
    }

    #[test]
    fn beyond_its_end_there_is_no_answer() {
        let table = InverseTable::new(8.0, sample);
        for q in [3.1, 9.0, f64::INFINITY, f64::NAN] {
            assert!(table.ratio(q).is_nan());
        }
        for end in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-308] {
            assert_eq!(InverseTable::new(end, sample), InverseTable::empty());
        }
    }
}
