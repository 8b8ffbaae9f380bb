//! Distortion along the radius alone, and its inverse.

use nalgebra::{Matrix2, Vector2};

use super::LensError;
use super::inverse::InverseTable;
use super::lanes::Places;
use super::polynomial::{derivative, difference, evaluate, first_positive_root, product};

/// `r_d = r N(r^2) / D(r^2)`: the radial part of every lens model here.
///
/// It is used up to the smallest radius at which `r_d` stops growing (or the denominator vanishes):
/// beyond it a point outside the field would fold back into the picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Radial {
    numerator: [f64; 5],
    denominator: [f64; 4],
    /// Whether the denominator is one everywhere.
    polynomial: bool,
    /// Radius up to which the map is one to one; infinite where it always is.
    limit: f64,
    /// The distorted radius at the limit.
    distorted_limit: f64,
    /// Where Newton's method for the inverse starts.
    inverse: InverseTable,
}

/// The table of the inverse ends at this undistorted radius at the latest: 86 degrees from the axis
/// at unit depth.
const TABLE_RADIUS: f64 = 14.0;

impl Radial {
    /// From the coefficients of N and D in powers of `r^2`; `None` where the distorted radius does
    /// not grow with the radius at the centre, or a coefficient is not finite.
    pub(super) fn new(numerator: [f64; 5], denominator: [f64; 4]) -> Option<Self> {
        Self::up_to(f64::INFINITY, numerator, denominator)
    }

    /// As [`Radial::new`], for radii up to `most` only.
    pub(super) fn up_to(most: f64, numerator: [f64; 5], denominator: [f64; 4]) -> Option<Self> {
        let all = || numerator.iter().chain(&denominator);
        if !all().all(|c| c.is_finite()) || numerator[0] <= 0.0 || denominator[0] <= 0.0 {
            return None;
        }
        let s = [0.0, 2.0];
        // d r_d / dr = ((N + 2 s N') D - 2 s N D') / D^2 with s = r^2
        let n_slope = product(&s, &derivative(&numerator));
        let d_slope = product(&s, &derivative(&denominator));
        let grown = difference(&numerator, &difference(&[], &n_slope));
        let growth = difference(
            &product(&grown, &denominator),
            &product(&numerator, &d_slope),
        );
        let turning = first_positive_root(&growth);
        let pole = first_positive_root(&denominator);
        let limit = [turning, pole]
            .into_iter()
            .flatten()
            .fold(f64::INFINITY, f64::min);
        Some(
            Self {
                numerator,
                denominator,
                polynomial: denominator == [1.0, 0.0, 0.0, 0.0],
                limit: f64::INFINITY,
                distorted_limit: f64::INFINITY,
                inverse: InverseTable::empty(),
            }
            .limited(limit.sqrt().min(most))
            .tabulated(),
        )
    }

    /// The same map, used up to `limit` at most.
    fn limited(mut self, limit: f64) -> Self {
        if limit < self.limit {
            self.limit = limit;
            let (factor, _) = self.factor(limit * limit);
            // At a pole of the denominator the distorted radius grows without bound.
            self.distorted_limit = if factor > 0.0 {
                limit * factor
            } else {
                f64::INFINITY
            };
        }
        self
    }

    /// The same map with the table of its inverse.
    fn tabulated(mut self) -> Self {
        // At the limit itself the inverse has no slope.
        let end = TABLE_RADIUS.min(0.9999 * self.limit);
        let distorted = end * self.factor(end * end).0;
        self.inverse = InverseTable::new(distorted * distorted, |q| {
            let ratio = self.searched_ratio(q).ok()?;
            let (_, slope) = self.ratio_slope(ratio, q).ok()?;
            Some((ratio, slope))
        });
        self
    }

    /// The radius up to which the map is one to one.
    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    /// `N / D` and its derivative by `s = r^2`.
    #[inline(always)]
    pub(super) fn factor(&self, s: f64) -> (f64, f64) {
        self.factor_if(self.polynomial, s)
    }

    /// Whether the denominator is one everywhere.
    #[inline]
    pub(super) fn is_polynomial(&self) -> bool {
        self.polynomial
    }

    /// As [`Radial::factor`], by what [`Radial::is_polynomial`] says: asked once for many places, it is out
    /// of the way of processors that take several side by side.
    #[inline(always)]
    fn factor_of<const POLYNOMIAL: bool>(&self, s: f64) -> (f64, f64) {
        self.factor_if(POLYNOMIAL, s)
    }

    #[inline(always)]
    fn factor_if(&self, polynomial: bool, s: f64) -> (f64, f64) {
        let (n, n_slope) = evaluate(&self.numerator, s);
        if polynomial {
            return (n, n_slope);
        }
        let (d, d_slope) = evaluate(&self.denominator, s);
        let inverse = 1.0 / d;
        let factor = n * inverse;
        (factor, (n_slope - factor * d_slope) * inverse)
    }

    /// The distorted place of a place.
    ///
    /// # Errors
    /// [`LensError::OutsideField`] beyond the radius of use.
    #[inline]
    pub(super) fn distort(&self, place: Vector2<f64>) -> Result<Vector2<f64>, LensError> {
        if self.is_inside(place) {
            Ok(place * self.factor(place.norm_squared()).0)
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// As [`Radial::distort`], with the derivative.
    #[inline]
    pub(super) fn distort_with_jacobian(
        &self,
        place: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        if self.is_inside(place) {
            Ok(self.distort_unbounded(place))
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// As [`Radial::distort_with_jacobian`], within the radius of use or not.
    #[inline(always)]
    fn distort_unbounded(&self, place: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (factor, slope) = self.factor(place.norm_squared());
        (place * factor, scaling_jacobian(place, factor, slope))
    }

    /// The same by what [`Radial::is_polynomial`] says.
    #[inline(always)]
    pub(super) fn distort_unbounded_of<const POLYNOMIAL: bool>(
        &self,
        place: Vector2<f64>,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        let (factor, slope) = self.factor_of::<POLYNOMIAL>(place.norm_squared());
        (place * factor, scaling_jacobian(place, factor, slope))
    }

    /// Whether a place is within the radius of use.
    #[inline(always)]
    pub(super) fn is_inside(&self, place: Vector2<f64>) -> bool {
        place.norm_squared() < self.limit * self.limit
    }

    /// The place whose distorted place is given, wherever it is.
    ///
    /// # Errors
    /// [`LensError::OutsideField`] where no place within the radius of use is distorted to it.
    #[inline]
    pub(super) fn undistort(&self, distorted: Vector2<f64>) -> Result<Vector2<f64>, LensError> {
        Ok(distorted * self.ratio(distorted.norm_squared())?)
    }

    /// As [`Radial::undistort`], with the derivative.
    #[inline]
    pub(super) fn undistort_with_jacobian(
        &self,
        distorted: Vector2<f64>,
    ) -> Result<(Vector2<f64>, Matrix2<f64>), LensError> {
        let q = distorted.norm_squared();
        let (ratio, slope) = self.ratio_slope(self.ratio(q)?, q)?;
        let jacobian = scaling_jacobian(distorted, ratio, slope);
        Ok((distorted * ratio, jacobian))
    }

    /// The same but for a billionth or so.
    #[inline(always)]
    pub(super) fn undistort_roughly<const N: usize>(&self, distorted: &Places<N>) -> Places<N> {
        let q: [f64; N] = std::array::from_fn(|i| distorted.get(i).norm_squared());
        let ratios = q.map(|q| self.inverse.ratio(q));
        Places::from_fn(|i| distorted.get(i) * ratios[i])
    }

    /// The places whose distorted places are given, by the short way.
    #[inline(always)]
    pub(super) fn undistort_nearby<const N: usize>(&self, distorted: &Places<N>) -> Places<N> {
        let q: [f64; N] = std::array::from_fn(|i| distorted.get(i).norm_squared());
        let ratios = self.nearby_ratios(&q);
        Places::from_fn(|i| distorted.get(i) * ratios[i])
    }

    /// The undistorted radius over the distorted one, whose square is `q`.
    #[inline]
    fn ratio(&self, q: f64) -> Result<f64, LensError> {
        let [ratio] = self.nearby_ratios(&[q]);
        if ratio.is_nan() {
            self.searched_ratio(q)
        } else {
            Ok(ratio)
        }
    }

    /// The roots of `g factor(g^2 q) - 1` next to the table's, by one step of Newton's method, or by
    /// two; not numbers where these do not suffice, or lead out of the radius of use.
    #[inline(always)]
    fn nearby_ratios<const N: usize>(&self, q: &[f64; N]) -> [f64; N] {
        let mut ratios = q.map(|q| self.inverse.ratio(q));
        let mut settled = [false; N];
        for i in 0..N {
            (ratios[i], settled[i]) = self.polished_ratio(ratios[i], q[i]);
        }
        for (i, _) in settled.iter().enumerate().filter(|(_, s)| !**s) {
            let (ratio, is_settled) = self.polished_ratio(ratios[i], q[i]);
            ratios[i] = if is_settled { ratio } else { f64::NAN };
        }
        ratios
    }

    /// One step of Newton's method, and whether it was the last that is needed.
    #[inline(always)]
    fn polished_ratio(&self, near: f64, q: f64) -> (f64, bool) {
        let s = near * near * q;
        let (factor, slope) = self.factor(s);
        let growth = factor + 2.0 * s * slope;
        let step = (1.0 - near * factor) / growth;
        let ratio = near + step;
        // One at the centre, zero at the limit, where the map has no inverse.
        let slack = growth * ratio;
        // The error of a step is of the order of its square; a hundred covers the curvature.
        let small = 100.0 * step * step <= f64::EPSILON * slack * ratio * ratio;
        let inside = ratio * ratio * q < self.limit * self.limit;
        (ratio, small & inside & (slack > 1e-6))
    }

    /// The same wherever it is, by a search that cannot fail.
    #[cold]
    #[inline(never)]
    fn searched_ratio(&self, q: f64) -> Result<f64, LensError> {
        if q == 0.0 {
            return Ok(1.0 / self.factor(0.0).0);
        }
        let distorted = q.sqrt();
        Ok(self.radius(distorted, 4.0 * f64::EPSILON)? / distorted)
    }

    /// The ratio, with its derivative by `q`: `g factor(g^2 q) = 1` differentiated.
    #[inline]
    fn ratio_slope(&self, ratio: f64, q: f64) -> Result<(f64, f64), LensError> {
        let s = ratio * ratio * q;
        let (factor, slope) = self.factor(s);
        let growth = factor + 2.0 * s * slope;
        if growth > 0.0 {
            Ok((ratio, -ratio * ratio * ratio * slope / growth))
        } else {
            Err(LensError::OutsideField)
        }
    }

    /// The radius that is distorted to `distorted`, but for a share `tolerance` of that.
    ///
    /// # Errors
    /// [`LensError::OutsideField`] beyond the largest distorted radius, [`LensError::NoConvergence`]
    /// where Newton's method does not end, which its bracket rules out for finite input.
    #[inline]
    pub(super) fn radius(&self, distorted: f64, tolerance: f64) -> Result<f64, LensError> {
        if distorted == 0.0 {
            return Ok(0.0);
        }
        let reached = distorted < self.distorted_limit;
        if !reached {
            return Err(LensError::OutsideField);
        }
        let excess = |r: f64| {
            let s = r * r;
            let (factor, slope) = self.factor(s);
            (r * factor - distorted, factor + 2.0 * s * slope)
        };
        let high = self
            .radius_beyond(distorted)
            .ok_or(LensError::OutsideField)?;
        increasing_root(excess, high, distorted, tolerance * distorted)
            .ok_or(LensError::NoConvergence)
    }

    /// A radius that is distorted to more than `distorted`; `None` where the map never gets there.
    fn radius_beyond(&self, distorted: f64) -> Option<f64> {
        if self.limit.is_finite() {
            return Some(self.limit);
        }
        let mut radius = 2.0 * distorted.max(1.0);
        while radius < 1e12 {
            if radius * self.factor(radius * radius).0 > distorted {
                return Some(radius);
            }
            radius *= 16.0;
        }
        None
    }
}

/// The derivative of `place * factor(|place|^2)` by the place.
#[inline(always)]
fn scaling_jacobian(place: Vector2<f64>, factor: f64, slope: f64) -> Matrix2<f64> {
    let bend = place * (2.0 * slope);
    let mixed = place.x * bend.y;
    Matrix2::new(
        factor + place.x * bend.x,
        mixed,
        mixed,
        factor + place.y * bend.y,
    )
}

/// The root in [0, `high`] of an increasing function that gives its value and slope, by Newton's
/// method kept within a bracket that shrinks at every step; `None` where 200 steps do not suffice.
pub(super) fn increasing_root(
    f: impl Fn(f64) -> (f64, f64),
    high: f64,
    start: f64,
    tolerance: f64,
) -> Option<f64> {
    let (mut low, mut high) = (0.0, high);
    let mut x = if start < high { start } else { 0.5 * high };
    let mut last_step = high;
    for _ in 0..200 {
        let (value, slope) = f(x);
        if value.abs() <= tolerance {
            return Some(x);
        }
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - value / slope;
        // A Newton step that leaves the bracket, or does not shrink, gives way to bisection.
        let trusted = newton > low && newton < high && (newton - x).abs() < 0.75 * last_step;
        let next = if trusted { newton } else { 0.5 * (low + high) };
        last_step = (next - x).abs();
        // The error of a Newton step is of the order of its square.
        if last_step <= if trusted { 1e-10 } else { f64::EPSILON } * next {
            return Some(next);
        }
        x = next;
    }
    None
}

#[cfg(test)]
mod tests;
