//! Marks on a picture: what the map says about what this view saw.
//!
//! As in Figures 11 and 12 of Thompson and Wettergreen (2005), the ground that other views cover
//! is tinted and every object of the map is drawn where it projects. Beside them stand the
//! detections of this view, so that one glance tells a rock that this view found from one that
//! only others did.
//!
//! | mark | look |
//! |---|---|
//! | ground that other views cover | sky-blue tint with a thin edge |
//! | detection | thin white box, or four ticks about a point |
//! | detection with a place on the ground, in pictures of one view alone | thin white circle |
//! | fused rock that this view detected | solid yellow ring |
//! | fused rock that it did not detect | dashed orange ring |
//! | 95 % ellipse of a fused rock | thin line in the ring's colour, solid or dashed as the ring |
//!
//! The colours are those of Okabe and Ito (2008), the orange lighter, which colour-blind eyes tell
//! apart, and nothing depends on them: solid and dashed do. Each line is bright on a dark one, so it stands out on any
//! ground. All sizes follow the picture's.

mod canvas;
mod content;
mod curve;
mod fill;
mod grid;
mod label;
mod legend;
mod marks;
mod stencil;
mod style;
mod text;

use nalgebra::Matrix2;

use crate::frame::Pixel;
use crate::publish::picture::{Picture, PictureError};

use canvas::Canvas;
use grid::Grid;
use marks::Marks;
use style::Style;
use text::Typesetter;

/// What drawings look like: raised whenever the same picture and annotation come to give another file.
pub const DRAWING: u32 = 2;

/// What is drawn on one picture. Everything may lie partly or wholly outside of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Annotation {
    /// What the legend is headed by: `v012 · mast camera`.
    pub title: String,
    /// The ground that other views cover: rings, closed by themselves, filled by the even-odd rule.
    pub covered: Vec<Vec<Pixel>>,
    /// The detections of this view.
    pub detections: Vec<DetectionMark>,
    /// The detections that have a place on the ground, where the picture shows this view alone.
    pub placed: Vec<PlacedMark>,
    /// The fused objects that project into this view.
    pub objects: Vec<ObjectMark>,
}

/// A detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DetectionMark {
    /// A box by its edges, pixels.
    Box {
        /// Left edge.
        x_min: f64,
        /// Upper edge.
        y_min: f64,
        /// Right edge.
        x_max: f64,
        /// Lower edge.
        y_max: f64,
    },
    /// A point.
    Point(Pixel),
}

/// A detection that has a place on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedMark {
    /// Where the place projects.
    pub centre: Pixel,
    /// The radius of what was detected, pixels; it is drawn no smaller than a ring that can be seen.
    pub radius_px: f64,
}

/// A fused object as this view sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectMark {
    /// A short name, `r0012`; empty for none.
    pub label: String,
    /// Where its centre projects.
    pub centre: Pixel,
    /// Its radius, pixels; it is drawn no smaller than a ring that can be seen.
    pub radius_px: f64,
    /// Covariance of the projected centre over (u, v), px^2.
    pub covariance_px: Matrix2<f64>,
    /// Whether a detection of this view belongs to it.
    pub detected: bool,
    /// Its probability of existence, where the method gives one; stands at the label if under 0.95.
    pub p_exist: Option<f64>,
}

/// How many marks of each kind lie in a picture, as its legend says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Detections given as boxes.
    pub boxes: usize,
    /// Detections given as points.
    pub points: usize,
    /// Detections with a place on the ground.
    pub placed: usize,
    /// Fused objects that this view detected.
    pub detected: usize,
    /// Fused objects that it did not detect.
    pub missed: usize,
    /// Fused objects whose 95 % ellipse is large enough to be drawn.
    pub ellipses: usize,
    /// Whether ground that other views cover is in sight.
    pub covered: bool,
}

/// Draws the annotation on the picture, and counts what is in it.
///
/// Marks with numbers that are not finite are left out. The result depends on the arguments alone.
pub fn annotate(picture: &mut Picture, annotation: &Annotation) -> Counts {
    let style = Style::for_size(picture.width(), picture.height());
    let marks = Marks::of(annotation, &style);
    let typesetter = Typesetter::new(&style);
    let mut grid = Grid::new(&style);
    marks.occupy(&mut grid, &style);
    let legend = legend::lay_out(&annotation.title, &marks.counts, &style, &typesetter, &grid);
    if let Some(legend) = &legend {
        grid.take(legend.frame);
    }
    let labels = label::place(&marks.rings, &mut grid, &style, &typesetter);

    let mut canvas = Canvas::new(picture);
    marks.draw(&mut canvas, &style);
    label::draw(&labels, &mut canvas, &typesetter);
    if let Some(legend) = &legend {
        legend.draw(&mut canvas, &style, &typesetter);
    }
    marks.counts
}

/// Draws one annotation, or several of the same picture side by side.
///
/// # Errors
/// [`PictureError::Size`], of pictures that together are too large.
pub fn annotate_panels(
    mut picture: Picture,
    panels: &[Annotation],
) -> Result<Picture, PictureError> {
    let Some((first, others)) = panels.split_first() else {
        return Ok(picture);
    };
    let others = others.iter().map(|annotation| {
        let mut copy = picture.clone();
        annotate(&mut copy, annotation);
        copy
    });
    let others: Vec<Picture> = others.collect();
    annotate(&mut picture, first);
    let gap = Style::for_size(picture.width(), picture.height()).gap;
    others
        .iter()
        .try_fold(picture, |left, right| left.beside(right, gap))
}

impl Annotation {
    /// How many marks would lie in a picture of this size.
    pub fn counts(&self, width: u32, height: u32) -> Counts {
        Marks::of(self, &Style::for_size(width, height)).counts
    }
}

#[cfg(test)]
mod tests;
