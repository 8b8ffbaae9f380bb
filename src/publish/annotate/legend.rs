//! The legend: one sample of each mark, and how many there are.

use super::Counts;
use super::canvas::Canvas;
use super::curve::{Curve, rounded};
use super::grid::Grid;
use super::marks::{draw_rings, ticks};
use super::style::{Frame, Style};
use super::text::{CAP_HEIGHT, Face, Typesetter};
use crate::frame::Pixel;

/// The largest share of the picture that the legend in words may take.
const MAX_SHARE: f64 = 0.16;
/// The largest share of the picture's width that a legend may take.
const MAX_WIDTH: f64 = 0.62;

/// A legend with its place.
pub(super) struct Legend {
    pub(super) frame: Frame,
    pub(super) title: String,
    pub(super) rows: Vec<Row>,
    layout: Layout,
}

/// A sample and its words.
pub(super) struct Row {
    sample: Option<Sample>,
    pub(super) words: String,
}

/// What a sample shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sample {
    Ring { detected: bool },
    Ellipse,
    Box,
    Point,
    Placed,
    Ground,
}

/// How the rows stand.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    padding: f64,
    row_height: f64,
    sample_width: f64,
    /// Of each row in a line, or 0 where each has its own line.
    step: f64,
}

/// Lays the legend out in the corner where it hides the least, in words, or on a small picture in
/// numbers alone; `None` where not even they have room.
pub(super) fn lay_out(
    title: &str,
    counts: &Counts,
    style: &Style,
    typesetter: &Typesetter,
    grid: &Grid,
) -> Option<Legend> {
    let unit = style.unit.max(0.75);
    let size = typesetter.size(Face::Body);
    let widest = |rows: &[Row]| {
        let width = |row: &Row| typesetter.width(&row.words, Face::Body);
        rows.iter().map(width).fold(0.0, f64::max)
    };
    let whole = style.width * style.height;
    for in_words in [true, false] {
        let rows = rows(counts, in_words);
        let count = f64::from(u32::try_from(rows.len()).ok()?);
        let mut layout = Layout {
            padding: 9.0 * unit,
            row_height: size * 1.62,
            sample_width: 31.0 * unit,
            step: 0.0,
        };
        let (lines, width) = if in_words {
            (count, layout.sample_width + widest(&rows))
        } else {
            layout.padding = 5.0 * unit;
            layout.sample_width = 22.0 * unit;
            layout.step = layout.sample_width + widest(&rows) + 7.0 * unit;
            (1.0, layout.step * count - 7.0 * unit)
        };
        let most = style.width * MAX_WIDTH - 2.0 * layout.padding;
        let title = typesetter.fitted(title, Face::Title, most.min(width * 1.6).max(width));
        let width = width.max(typesetter.width(&title, Face::Title)) + 2.0 * layout.padding;
        let lines = lines + if title.is_empty() { 0.0 } else { 1.1 };
        let height = lines * layout.row_height + 2.0 * layout.padding - size * 0.5;
        if width > most + 2.0 * layout.padding || width * height > MAX_SHARE * whole {
            continue;
        }
        return Some(Legend {
            frame: corner(width, height, style, grid),
            title,
            rows,
            layout,
        });
    }
    None
}

impl Legend {
    /// Draws the panel, the samples and the words.
    pub(super) fn draw(&self, canvas: &mut Canvas, style: &Style, typesetter: &Typesetter) {
        let panel = [rounded(&self.frame, 5.0 * style.unit)];
        canvas.fill(&panel, style.panel);
        canvas.closed(&panel, &style.panel_edge);
        let Layout {
            padding,
            row_height,
            sample_width,
            step,
        } = self.layout;
        let size = typesetter.size(Face::Body);
        let mut left = self.frame.left + padding;
        let mut middle = self.frame.top + padding + (row_height - size * 0.5) / 2.0;
        let baseline = |middle: f64, size: f64| middle + size * CAP_HEIGHT / 2.0;
        if !self.title.is_empty() {
            let start = [left, baseline(middle, typesetter.size(Face::Title))];
            typesetter.write(canvas, &self.title, Face::Title, start, (style.text, false));
            middle += row_height * 1.1;
        }
        for row in &self.rows {
            let mut start = [left, baseline(middle, size)];
            if let Some(sample) = row.sample {
                let inset = if step > 0.0 { 8.0 } else { 11.5 } * style.unit.max(0.75);
                draw_sample(canvas, style, sample, Pixel::new(left + inset, middle));
                start[0] += sample_width;
            }
            typesetter.write(canvas, &row.words, Face::Body, start, (style.text, false));
            if step > 0.0 {
                left += step;
            } else {
                middle += row_height;
            }
        }
    }
}

fn rows(counts: &Counts, in_words: bool) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut put = |is_there: bool, sample, count: Option<usize>, words: &str| {
        let words = match (count, in_words) {
            (Some(count), true) => format!("{count} {}", with_number(words, count)),
            (Some(count), false) => count.to_string(),
            (None, true) => words.to_owned(),
            (None, false) => return,
        };
        if is_there {
            rows.push(Row {
                sample: Some(sample),
                words,
            });
        }
    };
    for (detected, count, words) in [
        (true, counts.detected, "fused rock*, detected here"),
        (false, counts.missed, "fused rock*, not detected here"),
    ] {
        put(count > 0, Sample::Ring { detected }, Some(count), words);
    }
    put(counts.ellipses > 0, Sample::Ellipse, None, "95 % ellipses");
    put(
        counts.boxes > 0,
        Sample::Box,
        Some(counts.boxes),
        "detection*",
    );
    let points = if counts.boxes > 0 {
        "point detection*"
    } else {
        "detection*"
    };
    put(
        counts.points > 0,
        Sample::Point,
        Some(counts.points),
        points,
    );
    put(
        counts.placed > 0,
        Sample::Placed,
        Some(counts.placed),
        "detection*, placed on the ground",
    );
    put(
        counts.covered,
        Sample::Ground,
        None,
        "ground that other views cover",
    );
    if rows.is_empty() && in_words {
        rows.push(Row {
            sample: None,
            words: "no rocks, no detections".to_owned(),
        });
    }
    rows
}

/// The words with their plural s, where the star is, unless there is one.
fn with_number(words: &str, count: usize) -> String {
    words.replace('*', if count == 1 { "" } else { "s" })
}

/// The corner where the panel hides the fewest marks; the upper ones first, where the sky is.
fn corner(width: f64, height: f64, style: &Style, grid: &Grid) -> Frame {
    let margin = 9.0 * style.unit;
    let at = |left: f64, top: f64| Frame {
        left: left.round() - 0.5,
        top: top.round() - 0.5,
        right: (left + width).round() - 0.5,
        bottom: (top + height).round() - 0.5,
    };
    let (right, low) = (style.width - margin - width, style.height - margin - height);
    let first = at(margin, margin);
    [at(right, margin), at(margin, low), at(right, low)]
        .into_iter()
        .fold((grid.crowd(first), first), |best, frame| {
            let crowd = grid.crowd(frame);
            if crowd < best.0 { (crowd, frame) } else { best }
        })
        .1
}

fn draw_sample(canvas: &mut Canvas, style: &Style, sample: Sample, at: Pixel) {
    let unit = style.unit.max(0.75);
    let block = |half_width: f64, half_height: f64| {
        let (left, right) = (at.u - half_width * unit, at.u + half_width * unit);
        let (top, bottom) = (at.v - half_height * unit, at.v + half_height * unit);
        vec![[left, top], [right, top], [right, bottom], [left, bottom]]
    };
    match sample {
        Sample::Ring { detected } => {
            let circle = Curve::circle(at, 6.2 * unit);
            draw_rings(canvas, style, detected, &[circle]);
        }
        Sample::Ellipse => {
            let ellipse = Curve::upright(at, [9.5 * unit, 4.75 * unit]);
            canvas.closed(&[ellipse.points()], &style.ellipse(true));
        }
        Sample::Box => canvas.closed(&[block(7.0, 5.0)], &style.detection),
        Sample::Point => canvas.open(&ticks(at, style), &style.detection),
        Sample::Placed => canvas.circles(&[Curve::circle(at, 6.2 * unit)], &style.detection),
        Sample::Ground => {
            let ground = vec![block(9.5, 5.0)];
            canvas.fill(&ground, style.tint);
            canvas.closed(&ground, &style.edge);
        }
    }
}
