//! Colours and sizes.

use super::grid::whole;

/// Red, green, blue and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour {
    pub(super) rgb: [u8; 3],
    pub(super) alpha: u8,
}

impl Colour {
    const fn new(rgb: [u8; 3], alpha: u8) -> Self {
        Self { rgb, alpha }
    }
}

/// A bright line on a wider dark one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) core: Colour,
    pub(super) core_width: f64,
    pub(super) halo: Colour,
    pub(super) halo_width: f64,
}

impl Line {
    /// A line of so many units, on a dark one of this opacity. On a small picture the bright line
    /// is no thinner than a pixel, and the dark one shows by a pixel and more at both of its sides, because
    /// a fraction of a pixel is a fraction of the contrast.
    fn new(unit: f64, (core, core_width): (Colour, f64), (alpha, halo_width): (u8, f64)) -> Self {
        let core_width = (core_width * unit).max(1.0);
        Self {
            core,
            core_width,
            halo: Colour::new(NEAR_BLACK, alpha),
            halo_width: (halo_width * unit).max(core_width + 2.2),
        }
    }
}

/// Okabe and Ito, "Color Universal Design" (2008): sky blue, yellow, and orange made lighter, for
/// between black and their own orange some middle greys leave a contrast under 3 to 1.
const SKY_BLUE: [u8; 3] = [86, 180, 233];
const YELLOW: [u8; 3] = [240, 228, 66];
const ORANGE: [u8; 3] = [255, 184, 56];
const WHITE: [u8; 3] = [255, 255, 255];
const NEAR_BLACK: [u8; 3] = [10, 14, 18];

/// All colours and sizes (in pixels) for a picture of one size.
#[derive(Debug, Clone)]
pub(super) struct Style {
    pub(super) width: f64,
    pub(super) height: f64,
    /// What every size is a multiple of, pixels: 1 for a picture of 900 x 900.
    pub(super) unit: f64,
    pub(super) tint: Colour,
    pub(super) edge: Line,
    pub(super) detection: Line,
    pub(super) panel: Colour,
    pub(super) panel_edge: Line,
    pub(super) text: Colour,
    pub(super) text_halo: Colour,
    pub(super) min_ring_radius: f64,
    /// A dash and its gap, pixels.
    pub(super) dash: f64,
    /// A 95 % ellipse whose long half-axis is shorter is left out.
    pub(super) min_ellipse: f64,
    /// A ring or ellipse whose long half-axis is longer is left out: a projection linearised so
    /// far from its centre means nothing.
    pub(super) max_half_axis: f64,
    /// Between two pictures side by side, pixels.
    pub(super) gap: u32,
    pub(super) label_size: f64,
    pub(super) body_size: f64,
    pub(super) title_size: f64,
    pub(super) has_labels: bool,
}

impl Style {
    pub(super) fn for_size(width: u32, height: u32) -> Self {
        let (width, height) = (f64::from(width), f64::from(height));
        let side = (width * height).sqrt().min(2.0 * width.min(height));
        let unit = (side / 900.0).max(0.7);
        let line = |core, core_width: f64, halo_alpha, halo_width: f64| {
            Line::new(unit, (core, core_width), (halo_alpha, halo_width))
        };
        Self {
            width,
            height,
            unit,
            tint: Colour::new(SKY_BLUE, 60),
            edge: line(Colour::new(SKY_BLUE, 230), 1.1, 70, 2.6),
            detection: line(Colour::new(WHITE, 250), 1.2, 165, 3.1),
            panel: Colour::new([14, 19, 24], 205),
            panel_edge: line(Colour::new(WHITE, 60), 0.9, 0, 0.9),
            text: Colour::new(WHITE, 255),
            text_halo: Colour::new(NEAR_BLACK, 215),
            min_ring_radius: 7.0 * unit,
            dash: 13.0 * unit,
            min_ellipse: (1.5 * unit).max(1.5),
            max_half_axis: 100.0 * width.hypot(height),
            gap: u32::try_from(whole(8.0 * unit)).unwrap_or(u32::MAX),
            label_size: (11.5 * unit).max(9.0),
            body_size: (13.0 * unit).max(9.5),
            title_size: (14.0 * unit).max(10.0),
            has_labels: side >= 450.0,
        }
    }

    /// The ring of an object.
    pub(super) fn ring(&self, detected: bool) -> Line {
        Line::new(self.unit, (self.hue(detected), 2.0), (230, 4.4))
    }

    /// The ellipse of an object.
    pub(super) fn ellipse(&self, detected: bool) -> Line {
        Line::new(self.unit, (self.hue(detected), 1.25), (150, 2.9))
    }

    /// The colour of an object's marks.
    pub(super) fn hue(&self, detected: bool) -> Colour {
        Colour::new(if detected { YELLOW } else { ORANGE }, 255)
    }

    /// The picture, with room for a line's width all around.
    pub(super) fn view(&self) -> Frame {
        let margin = 8.0 * self.unit;
        Frame {
            left: -0.5 - margin,
            top: -0.5 - margin,
            right: self.width - 0.5 + margin,
            bottom: self.height - 0.5 + margin,
        }
    }

    /// The picture itself.
    pub(super) fn picture(&self) -> Frame {
        Frame {
            left: -0.5,
            top: -0.5,
            right: self.width - 0.5,
            bottom: self.height - 0.5,
        }
    }
}

/// An upright rectangle in pixel coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    /// The smallest one about points, or `None` where there are none or one is not finite.
    pub(super) fn about(points: &[[f64; 2]]) -> Option<Self> {
        let first = points.first()?;
        if !points.iter().flatten().all(|value| value.is_finite()) {
            return None;
        }
        let start = Self {
            left: first[0],
            top: first[1],
            right: first[0],
            bottom: first[1],
        };
        Some(points.iter().fold(start, |frame, &[x, y]| Self {
            left: frame.left.min(x),
            top: frame.top.min(y),
            right: frame.right.max(x),
            bottom: frame.bottom.max(y),
        }))
    }

    pub(super) fn meets(&self, other: &Self) -> bool {
        self.left <= other.right
            && other.left <= self.right
            && self.top <= other.bottom
            && other.top <= self.bottom
    }

    pub(super) fn contains(&self, other: &Self) -> bool {
        self.left <= other.left
            && self.top <= other.top
            && self.right >= other.right
            && self.bottom >= other.bottom
    }
}
