//! Writing in Noto Sans.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve, Point};
use tiny_skia::{FillRule, LineJoin, Mask, Path, PathBuilder, Stroke, Transform};

use super::canvas::{Canvas, Stamp, narrow};
use super::style::{Colour, Style};

/// The height of capitals of Noto Sans, of the font size.
pub(super) const CAP_HEIGHT: f64 = 0.714;
/// Glyphs stand at quarters of a pixel.
const QUARTERS: f64 = 4.0;

/// The fonts, checked once; bytes that are no font leave pictures without writing.
static REGULAR: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::REGULAR_TTF).ok());
static BOLD: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::BOLD_TTF).ok());

/// What a text is for: it decides size and weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    /// An object's name.
    Label,
    /// The legend's rows.
    Body,
    /// The legend's heading.
    Title,
}

/// Measures texts and draws them.
pub(super) struct Typesetter {
    sizes: [f64; 3],
    halo_width: f64,
    halo: Colour,
}

/// What decides a glyph's coverage: weight, size and halo (as bits), glyph, quarter of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    is_bold: bool,
    size: u64,
    halo_width: u64,
    glyph: GlyphId,
    quarter: u8,
}

thread_local! {
    /// Every glyph that this thread has drawn: the pictures of a run have few sizes.
    static GLYPHS: RefCell<HashMap<Key, Rc<Glyph>>> = RefCell::default();
}

/// How many glyphs a thread keeps.
const MAX_GLYPHS: usize = 4096;

/// A glyph's coverage and that of the line around it, if there is one.
#[derive(Default)]
struct Glyph {
    /// Of the coverage's first column and row, from the pen.
    column: i64,
    row: i64,
    width: usize,
    body: Vec<u8>,
    halo: Vec<u8>,
}

impl Typesetter {
    pub(super) fn new(style: &Style) -> Self {
        Self {
            sizes: [style.label_size, style.body_size, style.title_size],
            halo_width: 2.2 * style.unit.max(0.8),
            halo: style.text_halo,
        }
    }

    /// The font size of a face, pixels.
    pub(super) fn size(&self, face: Face) -> f64 {
        self.sizes[face as usize]
    }

    /// How long a text is, pixels.
    pub(super) fn width(&self, text: &str, face: Face) -> f64 {
        self.pen(text, face).1
    }

    /// The text, or as much of its start as fits with an ellipsis.
    pub(super) fn fitted(&self, text: &str, face: Face, width: f64) -> String {
        if self.width(text, face) <= width {
            return text.to_owned();
        }
        let mut kept: Vec<char> = text.chars().collect();
        while kept.pop().is_some() {
            let short = format!("{}…", kept.iter().collect::<String>().trim_end());
            if self.width(&short, face) <= width {
                return short;
            }
        }
        String::new()
    }

    /// Writes a text from `left` (pixel coordinate) on the baseline, on a dark halo if asked for.
    pub(super) fn write(
        &self,
        canvas: &mut Canvas,
        text: &str,
        face: Face,
        [left, baseline]: [f64; 2],
        (colour, has_halo): (Colour, bool),
    ) {
        let (row, _) = split(baseline.round());
        let halo_width = if has_halo { self.halo_width } else { 0.0 };
        let glyphs: Vec<(i64, Rc<Glyph>)> = self
            .pen(text, face)
            .0
            .into_iter()
            .map(|(glyph, x)| {
                let (column, quarter) = split(left + 0.5 + x);
                let key = Key {
                    is_bold: face != Face::Body,
                    size: self.size(face).to_bits(),
                    halo_width: halo_width.to_bits(),
                    glyph,
                    quarter,
                };
                (column, glyph_of(key))
            })
            .collect();
        // All halos first: a halo over its neighbour's body would eat it.
        for is_halo in [true, false] {
            for (column, glyph) in &glyphs {
                let coverage = if is_halo { &glyph.halo } else { &glyph.body };
                if coverage.is_empty() {
                    continue;
                }
                let stamp = Stamp {
                    column: column + glyph.column,
                    row: row + glyph.row,
                    width: glyph.width,
                    coverage,
                };
                canvas.stamp(&stamp, if is_halo { self.halo } else { colour });
            }
        }
    }

    /// Where each glyph of a text starts, and the text's length.
    fn pen(&self, text: &str, face: Face) -> (Vec<(GlyphId, f64)>, f64) {
        let Some(font) = font(face != Face::Body) else {
            return (Vec::new(), 0.0);
        };
        let scale = self.size(face) / units_per_em(font);
        let mut at = 0.0;
        let mut before = None;
        let mut glyphs = Vec::new();
        for character in text.chars() {
            let glyph = font.glyph_id(character);
            if let Some(before) = before {
                at += f64::from(font.kern_unscaled(before, glyph)) * scale;
            }
            glyphs.push((glyph, at));
            at += f64::from(font.h_advance_unscaled(glyph)) * scale;
            before = Some(glyph);
        }
        (glyphs, at)
    }
}

/// The glyph, from those that are kept or newly drawn; without an outline, as a space, it is empty.
fn glyph_of(key: Key) -> Rc<Glyph> {
    GLYPHS.with_borrow_mut(|known| {
        if known.len() >= MAX_GLYPHS {
            known.clear();
        }
        let glyph = known
            .entry(key)
            .or_insert_with(|| Rc::new(drawn(key).unwrap_or_default()));
        Rc::clone(glyph)
    })
}

fn drawn(key: Key) -> Option<Glyph> {
    let font = font(key.is_bold)?;
    let scale = f64::from_bits(key.size) / units_per_em(font);
    let halo_width = f64::from_bits(key.halo_width);
    let shift = f64::from(key.quarter) / QUARTERS;
    let path = outline(&font.outline(key.glyph)?.curves, scale, shift)?;
    let stroke = Stroke {
        width: narrow(halo_width),
        line_join: LineJoin::Round,
        ..Stroke::default()
    };
    let around = (halo_width > 0.0)
        .then(|| path.stroke(&stroke, 1.0))
        .flatten();
    let bounds = around.as_ref().unwrap_or(&path).bounds();
    let (column, _) = split(f64::from(bounds.left()).floor());
    let (row, _) = split(f64::from(bounds.top()).floor());
    let side = |from: i64, to: f32| {
        let (end, _) = split(f64::from(to).ceil() + 1.0);
        u32::try_from(end - from).ok()
    };
    let (width, height) = (side(column, bounds.right())?, side(row, bounds.bottom())?);
    let to_mask = Transform::from_translate(
        narrow(-f64::from(i32::try_from(column).ok()?)),
        narrow(-f64::from(i32::try_from(row).ok()?)),
    );
    let coverage = |path: &Path| {
        let mut mask = Mask::new(width, height)?;
        mask.fill_path(path, FillRule::Winding, true, to_mask);
        Some(mask.take())
    };
    Some(Glyph {
        column,
        row,
        width: width as usize,
        body: coverage(&path)?,
        halo: around.as_ref().and_then(coverage).unwrap_or_default(),
    })
}

fn font(is_bold: bool) -> Option<&'static FontRef<'static>> {
    if is_bold { &BOLD } else { &REGULAR }.as_ref()
}

fn units_per_em(font: &FontRef) -> f64 {
    font.units_per_em().map_or(1000.0, f64::from)
}

/// A glyph's path, its pen at `shift` and its baseline at zero, y downwards.
fn outline(curves: &[OutlineCurve], scale: f64, shift: f64) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let at = |p: &Point| {
        let x = narrow(f64::from(p.x) * scale + shift);
        (x, narrow(-f64::from(p.y) * scale))
    };
    let mut last = None;
    for curve in curves {
        let (start, end) = match curve {
            OutlineCurve::Line(a, b) | OutlineCurve::Quad(a, _, b) => (*a, *b),
            OutlineCurve::Cubic(a, _, _, b) => (*a, *b),
        };
        if last != Some(start) {
            if last.is_some() {
                builder.close();
            }
            let (x, y) = at(&start);
            builder.move_to(x, y);
        }
        let (x, y) = at(&end);
        match curve {
            OutlineCurve::Line(..) => builder.line_to(x, y),
            OutlineCurve::Quad(_, control, _) => {
                let (cx, cy) = at(control);
                builder.quad_to(cx, cy, x, y);
            }
            OutlineCurve::Cubic(_, first, second, _) => {
                let ((ax, ay), (bx, by)) = (at(first), at(second));
                builder.cubic_to(ax, ay, bx, by, x, y);
            }
        }
        last = Some(end);
    }
    if last.is_some() {
        builder.close();
    }
    builder.finish()
}

/// The whole pixel at or before a coordinate, and the quarters beyond it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "pixel coordinates of texts are small, and quarters are 0 to 3"
)]
fn split(at: f64) -> (i64, u8) {
    let quarters = (at * QUARTERS).round();
    let column = (quarters / QUARTERS).floor();
    (column as i64, (quarters - column * QUARTERS) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_font() {
        let typesetter = Typesetter::new(&Style::for_size(900, 900));
        let size = typesetter.size(Face::Body);
        // Noto Sans Regular: a digit advances 1171 of 2048 units.
        let width = typesetter.width("4711", Face::Body);
        assert!(
            (width - 4.0 * 1171.0 / 2048.0 * size).abs() < 1e-4,
            "{width}"
        );
        assert_eq!(typesetter.width("", Face::Body), 0.0);
    }

    #[test]
    fn long_texts_are_cut_to_fit() {
        let typesetter = Typesetter::new(&Style::for_size(900, 900));
        let text = "a title that is much too long";
        let short = typesetter.fitted(text, Face::Title, 80.0);
        assert!(short.ends_with('…') && text.starts_with(short.trim_end_matches('…')));
        assert!(typesetter.width(&short, Face::Title) <= 80.0);
        assert_eq!(typesetter.fitted(text, Face::Title, 1e4), text);
        assert_eq!(typesetter.fitted(text, Face::Title, 1.0), "");
    }

    #[test]
    fn quarters_belong_to_the_pixel_before() {
        assert_eq!(split(3.0), (3, 0));
        assert_eq!(split(3.26), (3, 1));
        assert_eq!(split(3.9), (4, 0));
        assert_eq!(split(-0.3), (-1, 3));
    }
}
