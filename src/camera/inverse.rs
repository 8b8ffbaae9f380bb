//! A table of an inverse radial map, from which Newton's method starts next to the answer.

use std::fmt;
use std::sync::Arc;

/// The ratio of the undistorted to the distorted radius over the square `q` of the latter, in
/// cubic pieces.
///
/// The ratio is an analytic function of `q`, centre included, which the radius itself is not. The
/// pieces are narrow in proportion to `q`: sixteen from every power of two to the next, found by
/// the leading bits of `q`, below them one that reaches down to zero.
#[derive(Clone, PartialEq)]
pub(super) struct InverseTable {
    /// One less than the leading bits of the square at which the second piece begins.
    below_first: u64,
    pieces: Arc<[Piece]>,
}

/// `c0 + t (c1 + t (c2 + t c3))` with `t = q - begin`.
#[derive(Clone, Copy, PartialEq)]
struct Piece {
    begin: f64,
    coefficients: [f64; 4],
}

/// A ratio and its derivative by `q`.
pub(super) type Sample = (f64, f64);

/// Leading bits of a number that tell its piece: exponent and four bits of its fraction.
const SHIFT: u32 = 52 - 4;

/// Pieces between the first and the end of the table: eighteen powers of two, that is down to a
/// radius five hundred times smaller than the largest, below which the ratio is next to constant.
const PIECES: u64 = 18 * 16;

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
        let normal = end.is_normal() && end > 0.0;
        let Some(first) = (end.to_bits() >> SHIFT)
            .checked_sub(PIECES)
            .filter(|first| normal && *first > 0)
        else {
            return Self::empty();
        };
        let ends = (0..PIECES).map(|i| f64::from_bits((first + i) << SHIFT));
        let mut begin = 0.0;
        let mut left = sample(0.0);
        let mut pieces = Vec::new();
        for end in ends {
            let right = sample(end);
            let (Some(l), Some(r)) = (left, right) else {
                break;
            };
            pieces.push(Piece::new((begin, l), (end, r)));
            (begin, left) = (end, right);
        }
        Self {
            below_first: first - 1,
            pieces: pieces.into(),
        }
    }

    /// The ratio at `q`, but for some millionths at most; `None` beyond the table.
    #[inline(always)]
    pub(super) fn ratio(&self, q: f64) -> Option<f64> {
        // The order of numbers above zero is that of their bits.
        let beyond = (q.to_bits() >> SHIFT).saturating_sub(self.below_first);
        let piece = self.pieces.get(usize::try_from(beyond).ok()?)?;
        let [c0, c1, c2, c3] = piece.coefficients;
        let t = q - piece.begin;
        Some(c0 + t * (c1 + t * (c2 + t * c3)))
    }
}

impl Piece {
    /// The cubic of these values and slopes at two ends (Hermite).
    fn new((begin, (left, rise)): (f64, Sample), (end, (right, fall)): (f64, Sample)) -> Self {
        let width = end - begin;
        let chord = (right - left) / width;
        let bend = (3.0 * chord - 2.0 * rise - fall) / width;
        let twist = (rise + fall - 2.0 * chord) / (width * width);
        Self {
            begin,
            coefficients: [left, rise, bend, twist],
        }
    }
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
            let off = table.ratio(q).unwrap() - sample(q).unwrap().0;
            assert!(off.abs() < 1e-7, "{q} {off:e}");
        }
        assert_eq!(table.ratio(0.0), Some(1.0));
        assert!(table.ratio(1e-300).is_some());
    }

    #[test]
    fn beyond_its_end_there_is_no_answer() {
        let table = InverseTable::new(8.0, sample);
        for q in [3.1, 9.0, f64::INFINITY, f64::NAN] {
            assert_eq!(table.ratio(q), None);
        }
        for end in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-308] {
            assert_eq!(InverseTable::new(end, sample), InverseTable::empty());
        }
    }
}
