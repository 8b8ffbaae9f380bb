//! What of an annotation lies in the picture, and how it is drawn.

use super::canvas::Canvas;
use super::curve::{Curve, clipped};
use super::grid::Grid;
use super::style::{Frame, Style};
use super::{Annotation, Counts, DetectionMark, ObjectMark};
use crate::frame::Pixel;

/// The marks that can be seen.
pub(super) struct Marks<'a> {
    pub(super) counts: Counts,
    pub(super) rings: Vec<Ring<'a>>,
    covered: Vec<Vec<[f64; 2]>>,
    boxes: Vec<[[f64; 2]; 4]>,
    points: Vec<Pixel>,
    placed: Vec<Curve>,
}

/// An object's ring and ellipse.
pub(super) struct Ring<'a> {
    pub(super) object: &'a ObjectMark,
    pub(super) radius: f64,
    circle: Curve,
    ellipse: Option<Vec<[f64; 2]>>,
}

impl<'a> Marks<'a> {
    /// The marks of an annotation that a picture of this style's size shows.
    pub(super) fn of(annotation: &'a Annotation, style: &Style) -> Self {
        let view = style.view();
        let mut marks = Self {
            counts: Counts::default(),
            rings: annotation
                .objects
                .iter()
                .filter_map(|object| Ring::of(object, style))
                .collect(),
            covered: annotation
                .covered
                .iter()
                .map(|ring| clipped(ring, &view))
                .filter(|ring| ring.len() > 2)
                .collect(),
            boxes: Vec::new(),
            points: Vec::new(),
            placed: annotation
                .placed
                .iter()
                .filter_map(|mark| circle(mark.centre, mark.radius_px, style))
                .collect(),
        };
        for &detection in &annotation.detections {
            match detection {
                DetectionMark::Box {
                    x_min,
                    y_min,
                    x_max,
                    y_max,
                } => marks
                    .boxes
                    .extend(corners([x_min, y_min], [x_max, y_max], style)),
                DetectionMark::Point(pixel) => {
                    let at = [pixel.u, pixel.v];
                    let seen = Frame::about(&[at]).is_some_and(|f| style.picture().meets(&f));
                    marks.points.extend(seen.then_some(pixel));
                }
            }
        }
        let detected = marks.rings.iter().filter(|r| r.object.detected).count();
        marks.counts = Counts {
            boxes: marks.boxes.len(),
            points: marks.points.len(),
            placed: marks.placed.len(),
            detected,
            missed: marks.rings.len() - detected,
            ellipses: marks.rings.iter().filter(|r| r.ellipse.is_some()).count(),
            covered: !marks.covered.is_empty(),
        };
        marks
    }

    /// Takes the marks' places in the grid.
    pub(super) fn occupy(&self, grid: &mut Grid, style: &Style) {
        for corners in &self.boxes {
            grid.cross(corners);
        }
        for point in &self.points {
            grid.take_disc([point.u, point.v], 5.0 * style.unit);
        }
        for circle in &self.placed {
            grid.cross(&circle.points());
        }
        for ring in &self.rings {
            let centre = [ring.object.centre.u, ring.object.centre.v];
            // Names may stand inside of a boulder that fills the picture.
            if ring.radius < 40.0 * style.unit {
                grid.take_disc(centre, ring.radius + 2.0 * style.unit);
            } else {
                grid.take_points(&ring.circle.points());
            }
            if let Some(ellipse) = &ring.ellipse {
                grid.cross(ellipse);
            }
        }
    }

    /// Draws everything but the writing, from the ground up.
    pub(super) fn draw(&self, canvas: &mut Canvas, style: &Style) {
        if self.counts.covered {
            canvas.fill(&self.covered, style.tint);
            canvas.closed(&self.covered, &style.edge);
        }
        canvas.closed(&self.boxes, &style.detection);
        let ticks: Vec<_> = self.points.iter().flat_map(|&p| ticks(p, style)).collect();
        canvas.open(&ticks, &style.detection);
        canvas.circles(&self.placed, &style.detection);
        for detected in [false, true] {
            let rings = self.rings.iter().filter(|r| r.object.detected == detected);
            let ellipses: Vec<_> = rings.filter_map(|r| r.ellipse.as_ref()).collect();
            let line = style.ellipse(detected);
            if detected {
                canvas.closed(&ellipses, &line);
            } else {
                canvas.dashed(&ellipses, &line, style.dash);
            }
        }
        for detected in [false, true] {
            let rings = self.rings.iter().filter(|r| r.object.detected == detected);
            let circles: Vec<_> = rings.map(|ring| ring.circle).collect();
            draw_rings(canvas, style, detected, &circles);
        }
    }
}

impl<'a> Ring<'a> {
    fn of(object: &'a ObjectMark, style: &Style) -> Option<Self> {
        let circle = circle(object.centre, object.radius_px, style)?;
        let ellipse = Curve::ellipse_95(object.centre, object.covariance_px)
            .filter(|e| (style.min_ellipse..=style.max_half_axis).contains(&e.reach))
            .map(|ellipse| ellipse.points());
        Some(Self {
            object,
            radius: circle.reach,
            circle,
            ellipse,
        })
    }
}

/// The circle of an object of this radius, no smaller than one that can be seen; `None` where it is
/// out of the picture, or so large that its projection means nothing.
fn circle(centre: Pixel, radius_px: f64, style: &Style) -> Option<Curve> {
    let radius = radius_px.max(style.min_ring_radius);
    let (u, v) = (centre.u, centre.v);
    let about = Frame::about(&[[u - radius, v - radius], [u + radius, v + radius]])?;
    let is_seen = about.meets(&style.picture()) && radius <= style.max_half_axis;
    (is_seen && !radius_px.is_nan()).then(|| Curve::circle(centre, radius))
}

/// Draws the rings of objects, solid where this view detected them and dashed where it did not.
pub(super) fn draw_rings(canvas: &mut Canvas, style: &Style, detected: bool, circles: &[Curve]) {
    let line = style.ring(detected);
    if detected {
        canvas.circles(circles, &line);
    } else {
        let points: Vec<_> = circles.iter().map(Curve::points).collect();
        canvas.dashed(&points, &line, style.dash);
    }
}

/// The four ticks about a point that was detected.
pub(super) fn ticks(point: Pixel, style: &Style) -> [[[f64; 2]; 2]; 4] {
    let (near, far) = (2.0 * style.unit, 6.5 * style.unit);
    [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
        .map(|[x, y]| [near, far].map(|along| [point.u + x * along, point.v + y * along]))
}

/// A box's corners, sides beyond the picture brought to just outside of it; `None` where none of
/// the box is in the picture.
fn corners(a: [f64; 2], b: [f64; 2], style: &Style) -> Option<[[f64; 2]; 4]> {
    let seen = Frame::about(&[a, b]).filter(|frame| frame.meets(&style.picture()))?;
    let view = style.view();
    let (left, right) = (seen.left.max(view.left), seen.right.min(view.right));
    let (top, bottom) = (seen.top.max(view.top), seen.bottom.min(view.bottom));
    Some([[left, top], [right, top], [right, bottom], [left, bottom]])
}
