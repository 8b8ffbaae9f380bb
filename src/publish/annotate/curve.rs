//! Rings, ellipses and polygons as points, whole, dashed or clipped to what can be seen.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix2, SymmetricEigen, Vector2};

use super::style::Frame;
use crate::frame::{Ellipse, Pixel};

/// How far a chord may lie from its curve, pixels.
const CHORD_TOLERANCE: f64 = 0.15;
/// Of one dash and its gap, what the dash takes with its ends.
const DASH_SHARE: f64 = 0.66;
/// The fewest dashes of a closed curve.
const MIN_DASHES: f64 = 4.0;

/// An ellipse `centre + axes (cos t, sin t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Curve {
    pub(super) centre: Pixel,
    pub(super) axes: Matrix2<f64>,
    /// The long half-axis, pixels.
    pub(super) reach: f64,
}

impl Curve {
    /// A circle.
    pub(super) fn circle(centre: Pixel, radius: f64) -> Self {
        Self {
            centre,
            axes: Matrix2::identity() * radius,
            reach: radius,
        }
    }

    /// An upright ellipse by its half-axes, pixels.
    pub(super) fn upright(centre: Pixel, [across, down]: [f64; 2]) -> Self {
        Self {
            centre,
            axes: Matrix2::new(across, 0.0, 0.0, down),
            reach: across.max(down),
        }
    }

    /// The 95 % ellipse of a covariance, px^2; a variance under zero counts as zero.
    pub(super) fn ellipse_95(centre: Pixel, covariance: Matrix2<f64>) -> Option<Self> {
        if !covariance.iter().all(|value| value.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new((covariance + covariance.transpose()) * 0.5);
        let half = eigen
            .eigenvalues
            .map(|variance| variance.max(0.0).sqrt() * Ellipse::scale_95());
        Some(Self {
            centre,
            axes: eigen.eigenvectors * Matrix2::from_diagonal(&half),
            reach: half.max(),
        })
    }

    /// The curve as a closed polygon that starts at the top (of a circle).
    pub(super) fn points(&self) -> Vec<[f64; 2]> {
        let step = (1.0 - CHORD_TOLERANCE / self.reach.max(0.5)).acos();
        let count = (PI / step).ceil().clamp(20.0, 4096.0);
        let mut points = Vec::new();
        let mut index = 0.0;
        while index < count {
            let (sin, cos) = (index / count * TAU - FRAC_PI_2).sin_cos();
            let offset = self.axes * Vector2::new(cos, sin);
            points.push([self.centre.u + offset.x, self.centre.v + offset.y]);
            index += 1.0;
        }
        points
    }
}

/// Gives the segments of a closed polygon's dashes, a dash and its gap about `period` long, as far
/// as they may be seen in `view`; both ends together will lengthen each dash by `ends`.
/// The first dash lies about the first point.
pub(super) fn dashes(
    points: &[[f64; 2]],
    (period, ends): (f64, f64),
    view: &Frame,
    mut segment: impl FnMut([[f64; 2]; 2]),
) {
    let lengths = cumulative(points);
    let total = lengths[points.len()];
    if total <= 0.0 {
        return;
    }
    let count = (total / period).round().max(MIN_DASHES);
    let step = total / count;
    let half = ((step * DASH_SHARE - ends) * 0.5).max(0.05 * step);
    let mut index = 0.0;
    while index < count {
        let middle = index * step;
        let dash = stretch(points, &lengths, middle - half, middle + half);
        if Frame::about(&dash).is_some_and(|about| about.meets(view)) {
            for pair in dash.windows(2) {
                segment([pair[0], pair[1]]);
            }
        }
        index += 1.0;
    }
}

/// The polygon's part inside the frame (Sutherland and Hodgman, 1974). Parts along the frame may
/// be doubled, which leaves an even-odd fill as it is; the frame lies outside of the picture.
pub(super) fn clipped(ring: &[Pixel], frame: &Frame) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = ring.iter().map(|p| [p.u, p.v]).collect();
    if Frame::about(&points).is_none_or(|about| !about.meets(frame)) {
        return Vec::new();
    }
    let sides = [
        (0, frame.left, 1.0),
        (0, frame.right, -1.0),
        (1, frame.top, 1.0),
        (1, frame.bottom, -1.0),
    ];
    for (axis, limit, sign) in sides {
        let depth = |point: &[f64; 2]| (point[axis] - limit) * sign;
        let mut kept = Vec::with_capacity(points.len() + 4);
        for (index, point) in points.iter().enumerate() {
            let before = &points[(index + points.len() - 1) % points.len()];
            let (from, to) = (depth(before), depth(point));
            if (from < 0.0) != (to < 0.0) {
                let share = from / (from - to);
                let mut crossing = [0, 1].map(|i| before[i] + (point[i] - before[i]) * share);
                crossing[axis] = limit;
                kept.push(crossing);
            }
            if to >= 0.0 {
                kept.push(*point);
            }
        }
        points = kept;
    }
    points
}

/// A rectangle with rounded corners, as a polygon.
pub(super) fn rounded(frame: &Frame, radius: f64) -> Vec<[f64; 2]> {
    let corners = [
        (frame.right - radius, frame.top + radius, -FRAC_PI_2),
        (frame.right - radius, frame.bottom - radius, 0.0),
        (frame.left + radius, frame.bottom - radius, FRAC_PI_2),
        (frame.left + radius, frame.top + radius, PI),
    ];
    corners
        .into_iter()
        .flat_map(|(x, y, start)| {
            (0..=8u8).map(move |i| {
                let (sin, cos) = (start + f64::from(i) / 8.0 * FRAC_PI_2).sin_cos();
                [x + radius * cos, y + radius * sin]
            })
        })
        .collect()
}

/// Lengths along the closed polygon at its points, and the whole length last.
fn cumulative(points: &[[f64; 2]]) -> Vec<f64> {
    let mut lengths = vec![0.0];
    let mut sum = 0.0;
    for (index, from) in points.iter().enumerate() {
        let to = points[(index + 1) % points.len()];
        sum += (to[0] - from[0]).hypot(to[1] - from[1]);
        lengths.push(sum);
    }
    lengths
}

/// The part of a closed polygon between two lengths along it, `from` possibly under zero.
fn stretch(points: &[[f64; 2]], lengths: &[f64], from: f64, to: f64) -> Vec<[f64; 2]> {
    let total = lengths[points.len()];
    let turn = if from < 0.0 { total } else { 0.0 };
    let at = |length: f64| {
        let length = length.rem_euclid(total);
        let segment = lengths
            .partition_point(|&l| l <= length)
            .clamp(1, points.len())
            - 1;
        let (start, end) = (points[segment], points[(segment + 1) % points.len()]);
        let whole = lengths[segment + 1] - lengths[segment];
        let share = if whole > 0.0 {
            (length - lengths[segment]) / whole
        } else {
            0.0
        };
        [0, 1].map(|i| start[i] + (end[i] - start[i]) * share)
    };
    let (from, to) = (from + turn, to + turn);
    let mut part = vec![at(from)];
    let mut index = lengths.partition_point(|&length| length <= from);
    loop {
        let lap = if index >= points.len() { total } else { 0.0 };
        let point = index % points.len();
        if lengths[point] + lap >= to || index >= 2 * points.len() {
            break;
        }
        part.push(points[point]);
        index += 1;
    }
    part.push(at(to));
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame {
        left: 0.0,
        top: 0.0,
        right: 10.0,
        bottom: 10.0,
    };

    fn area(points: &[[f64; 2]]) -> f64 {
        let doubled: f64 = (0..points.len())
            .map(|i| {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                a[0] * b[1] - b[0] * a[1]
            })
            .sum();
        doubled.abs() / 2.0
    }

    #[test]
    fn clipping_keeps_the_area_inside() {
        let corners = |points: &[[f64; 2]]| -> Vec<Pixel> {
            points.iter().map(|p| Pixel::new(p[0], p[1])).collect()
        };
        let huge = corners(&[[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]);
        assert!((area(&clipped(&huge, &FRAME)) - 100.0).abs() < 1e-6);
        let half = corners(&[[-5.0, 0.0], [15.0, 0.0], [15.0, 20.0]]); // below the diagonal from (-5, 0)
        assert!((area(&clipped(&half, &FRAME)) - 87.5).abs() < 1e-9);
        assert!(
            clipped(
                &corners(&[[20.0, 20.0], [30.0, 20.0], [30.0, 30.0]]),
                &FRAME
            )
            .is_empty()
        );
        let broken = corners(&[[1.0, 1.0], [f64::NAN, 2.0], [3.0, 3.0]]);
        assert!(clipped(&broken, &FRAME).is_empty());
    }

    #[test]
    fn dashes_and_gaps_share_the_length_as_they_should() {
        let circle = Curve::circle(Pixel::new(5.0, 5.0), 3.0).points();
        let lengths = cumulative(&circle);
        let total = lengths[circle.len()];
        assert!((total - TAU * 3.0).abs() < 0.1);
        let length = |part: &[[f64; 2]]| -> f64 {
            part.windows(2)
                .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
                .sum()
        };
        for from in [-2.0, 0.0, 0.3, 9.0, 17.9] {
            let part = stretch(&circle, &lengths, from, from + 2.5);
            assert!((length(&part) - 2.5).abs() < 1e-9, "from {from}");
        }
    }

    #[test]
    fn the_ellipse_holds_95_percent() {
        // Standard deviations 3 and 1 px, the long axis along u: half-axes 2.4477 of them.
        let cov = Matrix2::new(9.0, 0.0, 0.0, 1.0);
        let curve = Curve::ellipse_95(Pixel::new(100.0, 50.0), cov).unwrap();
        let frame = Frame::about(&curve.points()).unwrap();
        assert!((frame.right - frame.left - 2.0 * 3.0 * 2.447_75).abs() < 0.1);
        assert!((frame.bottom - frame.top - 2.0 * 2.447_75).abs() < 0.05);
        assert!((curve.reach - 7.343_24).abs() < 1e-4);
        assert!(Curve::ellipse_95(Pixel::new(0.0, 0.0), cov * f64::NAN).is_none());
    }
}
