//! Drawing in place on a picture.

use super::curve::{self, Curve};
use super::fill;
use super::grid::whole;
use super::stencil::{Stencil, TILE};
use super::style::{Colour, Frame, Line};
use crate::publish::picture::Picture;

/// How blunt the ends of dashes are: rounder ones would close the gaps between short dashes.
const BLUNTNESS: f64 = 3.0;

/// The largest radius that a circle is drawn with as one: of larger ones the renderer's precision would show.
const MAX_CIRCLE_RADIUS: f64 = 4096.0;

/// A picture to draw on.
pub(super) struct Canvas<'a> {
    picture: &'a mut Picture,
    stencil: Stencil,
    /// Those that have drawn: few lines differ.
    pens: Vec<Pen>,
}

/// Coverage of a rectangle of pixels, 0 to 255, at a column and row that may lie outside.
pub(super) struct Stamp<'a> {
    pub(super) column: i64,
    pub(super) row: i64,
    pub(super) width: usize,
    pub(super) coverage: &'a [u8],
}

impl<'a> Canvas<'a> {
    pub(super) fn new(picture: &'a mut Picture) -> Self {
        Self {
            stencil: Stencil::new(picture.width(), picture.height()),
            picture,
            pens: Vec::new(),
        }
    }

    /// Fills polygons by the even-odd rule.
    pub(super) fn fill(&mut self, rings: &[Vec<[f64; 2]>], colour: Colour) {
        let width = self.picture.width() as usize;
        let size = (self.picture.width(), self.picture.height());
        let pixels = self.picture.rgba_mut();
        fill::even_odd(rings, size, |row, columns, coverage| {
            let alpha = share(coverage, f64::from(colour.alpha));
            let end = columns.end.min(width);
            if let Some(run) =
                pixels.get_mut((row * width + columns.start) * 4..(row * width + end) * 4)
            {
                mix_run(run, colour.rgb, alpha);
            }
        });
    }

    /// Draws closed polygons in one line, dark below bright.
    pub(super) fn closed<P: AsRef<[[f64; 2]]>>(&mut self, polygons: &[P], line: &Line) {
        for polygon in polygons {
            self.stencil.polygon(polygon.as_ref(), line.reach());
        }
        self.ink(line);
    }

    /// Draws whole circles as [`Canvas::closed`].
    pub(super) fn circles(&mut self, circles: &[Curve], line: &Line) {
        for circle in circles {
            let centre = [circle.centre.u, circle.centre.v];
            if circle.reach <= MAX_CIRCLE_RADIUS {
                self.stencil.circle(centre, circle.reach, line.reach());
            } else {
                self.stencil.polygon(&circle.points(), line.reach());
            }
        }
        self.ink(line);
    }

    /// Draws open lines as [`Canvas::closed`].
    pub(super) fn open<P: AsRef<[[f64; 2]]>>(&mut self, lines: &[P], line: &Line) {
        for points in lines {
            for ends in points.as_ref().windows(2) {
                self.stencil.segment([ends[0], ends[1]], line.reach(), 1.0);
            }
        }
        self.ink(line);
    }

    /// Draws closed polygons in dashes, a dash and its gap about `period` long.
    pub(super) fn dashed<P: AsRef<[[f64; 2]]>>(
        &mut self,
        polygons: &[P],
        line: &Line,
        period: f64,
    ) {
        let view = Frame {
            left: -line.reach(),
            top: -line.reach(),
            right: f64::from(self.picture.width()) + line.reach(),
            bottom: f64::from(self.picture.height()) + line.reach(),
        };
        for polygon in polygons {
            curve::dashes(
                polygon.as_ref(),
                (period, line.halo_width / BLUNTNESS),
                &view,
                |ends| {
                    self.stencil.segment(ends, line.reach(), BLUNTNESS);
                },
            );
        }
        self.ink(line);
    }

    /// Lays a colour over the pixels by their coverage.
    pub(super) fn stamp(&mut self, stamp: &Stamp, colour: Colour) {
        let (columns, rows) = (self.picture.width(), self.picture.height());
        let pixels = self.picture.rgba_mut();
        let row_bytes = columns as usize * 4;
        // Of a stamp that hangs over the left or upper border, this much is cut off.
        let cut = |at: i64| usize::try_from(-at.min(0)).unwrap_or(usize::MAX);
        let start = |at: i64| usize::try_from(at.max(0)).unwrap_or(usize::MAX);
        let (left, top) = (start(stamp.column), start(stamp.row));
        if left >= columns as usize || top >= rows as usize {
            return;
        }
        let lines = stamp
            .coverage
            .chunks_exact(stamp.width)
            .skip(cut(stamp.row));
        for (line, row) in lines.zip(pixels.chunks_exact_mut(row_bytes).skip(top)) {
            let (below, _) = row[left * 4..].as_chunks_mut::<4>();
            for (&coverage, pixel) in line.iter().skip(cut(stamp.column)).zip(below) {
                if coverage > 0 {
                    let alpha = u32::from(coverage) * u32::from(colour.alpha);
                    Mix::over(colour.rgb, (alpha * 256 + 32_512) / 65_025).apply(pixel);
                }
            }
        }
    }

    /// Draws what the stencil holds, and empties it.
    fn ink(&mut self, line: &Line) {
        let (width, height) = (
            self.picture.width() as usize,
            self.picture.height() as usize,
        );
        let pixels = self.picture.rgba_mut();
        let known = self.pens.iter().position(|pen| pen.line == *line);
        let number = known.unwrap_or_else(|| {
            self.pens.push(Pen::new(line));
            self.pens.len() - 1
        });
        let pen = &self.pens[number];
        for tile in self.stencil.tiles() {
            let columns = TILE.min(width - tile.column);
            for (row, squares) in tile.lines().filter(|(row, _)| tile.row + row < height) {
                let start = ((tile.row + row) * width + tile.column) * 4;
                pen.ink(&mut pixels[start..start + columns * 4], squares);
            }
        }
        self.stencil.clear();
    }
}

/// What a line does to a pixel at each distance from its middle.
struct Pen {
    line: Line,
    reach_square: f32,
    /// Entries a pixel of distance.
    scale: f32,
    mixes: Vec<Mix>,
}

/// `below * keep + add`, in 256ths, two channels side by side in one number, 16 bits each:
/// a channel is at most 255 x 256 + 127, so that none runs over into the next.
#[derive(Debug, Clone, Copy)]
struct Mix {
    keep: u32,
    /// To red and blue.
    red_blue: u32,
    /// To green and opacity, which stays whole.
    green: u32,
}

impl Mix {
    const EVERY_OTHER: u32 = 0x00ff_00ff;
    /// What rounds.
    const HALVES: u32 = 0x007f_007f;

    /// Keeps so many 256ths of what is below, and adds red, green and blue, 256ths too.
    fn new(keep: u32, [r, g, b]: [u32; 3]) -> Self {
        Self {
            keep,
            red_blue: (r | (b << 16)) + Self::HALVES,
            green: (g | ((256 - keep) * 255) << 16) + Self::HALVES,
        }
    }

    /// A colour laid over, by so many 256ths.
    fn over([r, g, b]: [u8; 3], share: u32) -> Self {
        let pair = |low: u8, high: u8| u32::from(low) | u32::from(high) << 16;
        // Wrapping, because checks for an overflow that cannot be cost time here.
        let add = |pair: u32| pair.wrapping_mul(share).wrapping_add(Self::HALVES);
        Self {
            keep: 256 - share,
            red_blue: add(pair(r, b)),
            green: add(pair(g, 255)),
        }
    }

    fn apply(self, pixel: &mut [u8; 4]) {
        let below = u32::from_le_bytes(*pixel);
        // Wrapping, because checks for an overflow that cannot be cost time here.
        let mix = |channels: u32, add: u32| channels.wrapping_mul(self.keep).wrapping_add(add);
        let red_blue = mix(below & Self::EVERY_OTHER, self.red_blue) >> 8;
        let green = mix(below >> 8 & Self::EVERY_OTHER, self.green);
        *pixel = (red_blue & Self::EVERY_OTHER | green & !Self::EVERY_OTHER).to_le_bytes();
    }
}

impl Pen {
    /// Entries of the table.
    const STEPS: u16 = 256;

    /// A pixel is covered by how far it lies inside the line's edge, half a pixel both ways.
    fn new(line: &Line) -> Self {
        let reach = line.reach();
        let layers = [
            (line.halo_width / 2.0 + 0.5, line.halo),
            (line.core_width / 2.0 + 0.5, line.core),
        ];
        let mixes = (0..Self::STEPS).map(|step| {
            let distance = f64::from(step) / f64::from(Self::STEPS) * reach;
            let (mut keep, mut add) = (1.0, [0.0; 3]);
            for (edge, colour) in layers {
                let alpha = (edge - distance).clamp(0.0, 1.0) * f64::from(colour.alpha) / 255.0;
                keep *= 1.0 - alpha;
                for (sum, above) in add.iter_mut().zip(colour.rgb) {
                    *sum = *sum * (1.0 - alpha) + f64::from(above) * alpha;
                }
            }
            let keep = share(keep, 256.0);
            Mix::new(
                keep,
                add.map(|sum| share(sum, 256.0).min((256 - keep) * 255)),
            )
        });
        // Beyond the reach everything is kept.
        let mixes = mixes.chain([Mix::new(256, [0; 3])]);
        Self {
            line: *line,
            reach_square: narrow(reach * reach),
            scale: narrow(f64::from(Self::STEPS) / reach),
            mixes: mixes.collect(),
        }
    }

    fn ink(&self, pixels: &mut [u8], squares: &[f32; TILE]) {
        // By fours, which most lines leave out or cover, so that few branches are guessed wrong.
        let (pixels, _) = pixels.as_chunks_mut::<4>();
        let (fours, _) = squares.as_chunks::<4>();
        for (pixels, squares) in pixels.chunks_mut(4).zip(fours) {
            let is_near = squares.map(|square| square < self.reach_square);
            if is_near == [false; 4] {
                continue;
            }
            // The square roots without a branch, many at once; beyond the reach lies the last entry.
            let entries = squares.map(|square| {
                let square = if square < self.reach_square {
                    square
                } else {
                    self.reach_square
                };
                // Wrapping, because a check for an overflow that cannot be would forbid that.
                let rounded = (square.sqrt() * self.scale + WHOLE).to_bits();
                rounded.wrapping_sub(WHOLE.to_bits())
            });
            for (pixel, entry) in pixels.iter_mut().zip(entries) {
                if let Some(mix) = self.mixes.get(entry as usize) {
                    mix.apply(pixel);
                }
            }
        }
    }
}

/// What a small number is added to to be rounded: the last bits of the sum are the nearest whole one.
const WHOLE: f32 = 8_388_608.0;

/// The renderer's precision.
#[expect(
    clippy::cast_possible_truncation,
    reason = "24 bits place a line to a thousandth of a pixel in the largest picture"
)]
pub(super) fn narrow(value: f64) -> f32 {
    value as f32
}

/// A share as so many of a whole, rounded.
fn share(value: f64, whole_share: f64) -> u32 {
    u32::try_from(whole(value * whole_share + 0.5)).unwrap_or(u32::MAX)
}

/// Lays a colour over a run of pixels, in arithmetic that the compiler can do on many at once.
fn mix_run(run: &mut [u8], [r, g, b]: [u8; 3], alpha: u32) {
    let alpha = u16::try_from(alpha).unwrap_or(255).min(255);
    let keep = 255 - alpha;
    let add = [r, g, b, 255].map(|above| u16::from(above) * alpha + 128);
    // Rounded division by 255, exact up to 65,535 (Blinn, 1994); the sum is at most 255^2 + 128.
    // Wrapping, because a check for overflow would forbid to do many at once.
    let mix = |channel: u8, add: u16| {
        let sum = u16::from(channel).wrapping_mul(keep).wrapping_add(add);
        (sum.wrapping_add(sum >> 8) >> 8).to_le_bytes()[0]
    };
    let mut four_pixels = run.chunks_exact_mut(16);
    let add_four: [u16; 16] = std::array::from_fn(|i| add[i % 4]);
    for pixels in &mut four_pixels {
        for (channel, add) in pixels.iter_mut().zip(add_four) {
            *channel = mix(*channel, add);
        }
    }
    for pixel in four_pixels.into_remainder().chunks_exact_mut(4) {
        for (channel, add) in pixel.iter_mut().zip(add) {
            *channel = mix(*channel, add);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_over_the_border_is_cut() {
        let white = Colour {
            rgb: [255; 3],
            alpha: 255,
        };
        for (column, row, expected) in [
            (-1, -1, vec![(0, 0, 40)]),
            (4, 2, vec![(4, 2, 10)]),
            (1, 1, vec![(1, 1, 10), (2, 1, 20), (1, 2, 30), (2, 2, 40)]),
            (-2, 0, vec![]),
            (5, 0, vec![]),
            (0, 3, vec![]),
        ] {
            let mut picture = Picture::of_colour(5, 3, [0; 3]).unwrap();
            let stamp = Stamp {
                column,
                row,
                width: 2,
                coverage: &[10, 20, 30, 40],
            };
            Canvas::new(&mut picture).stamp(&stamp, white);
            let marked: Vec<(u32, u32, u8)> = (0..3)
                .flat_map(|y| (0..5).map(move |x| (x, y)))
                .map(|(x, y)| (x, y, picture.colour(x, y).unwrap()[0]))
                .filter(|&(_, _, value)| value > 0)
                .collect();
            assert_eq!(marked, expected);
        }
    }

    #[test]
    fn mixing_is_right_to_one_and_never_runs_over() {
        for share in 0..=256u16 {
            for below in 0..=255u8 {
                let mut pixel = [below, 255 - below, below, 255];
                let before = pixel;
                let above = [255, 255, 0];
                Mix::over(above, u32::from(share)).apply(&mut pixel);
                let weight = f64::from(share) / 256.0;
                for i in 0..3 {
                    let exact =
                        f64::from(before[i]) * (1.0 - weight) + f64::from(above[i]) * weight;
                    assert!((f64::from(pixel[i]) - exact).abs() <= 0.51);
                }
                assert_eq!(pixel[3], 255);
            }
        }
    }

    #[test]
    fn runs_mix_as_exact_arithmetic_does() {
        for alpha in [0u16, 1, 60, 128, 254, 255] {
            for below in 0..=255u8 {
                let mut run = [below, below, below, 255].repeat(7);
                mix_run(&mut run, [0, 86, 255], u32::from(alpha));
                let exact = [0u32, 86, 255].map(|above| {
                    let alpha = u32::from(alpha);
                    let sum = u32::from(below) * (255 - alpha) + above * alpha;
                    u8::try_from((sum + 127) / 255).unwrap()
                });
                assert_eq!(run, [exact[0], exact[1], exact[2], 255].repeat(7));
            }
        }
    }
}
