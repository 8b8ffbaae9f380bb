//! Whether, and where exactly, a ray meets the surface within one cell.

use std::ops::ControlFlow::{self, Break, Continue};

use super::Miss;
use super::leg::{Leg, Line};
use super::march::{Found, March, Over, Passed};
use super::model::Surface;
use super::patch::Patch;

/// Cells in doubt are looked at in pieces of this length, metres: these bend by less than 1e-7 m.
const PIECE_M: f64 = 2.0;

/// The most pieces a cell in doubt is cut into.
const MAX_PIECES: u32 = 64;

/// The most a cell in doubt is widened to either side, as a share of its leg: where a ray is all but
/// vertical, its way across the raster says nothing of its length.
const MAX_ROOM: f64 = 0.01;

/// Where a Newton step is so short that the next one would be of the order of rounding, metres.
const LAST_STEP_M: f64 = 1e-5;

/// A cell's surface, and how a ray passes over it, by the metre.
struct Crossing {
    number: usize,
    patch: Patch,
    /// How column and row grow.
    rate: [f64; 2],
    /// How the height above the ellipsoid grows.
    climb: f64,
}

impl March<'_> {
    /// A stretch over one cell.
    pub fn cell(&mut self, over: Over<'_>, line: Line, cell: [usize; 2]) -> ControlFlow<Found> {
        let Over {
            leg,
            number,
            s0,
            s1,
            ..
        } = over;
        let tile = &self.model.tiles[number];
        let Some(patch) = tile.patch(cell) else {
            let ceilings = [over.ceiling_m, tile.holes.ceiling_m(cell[0], cell[1])];
            return self.scan(Over {
                number: number + 1,
                ceiling_m: ceilings.into_iter().flatten().reduce(f64::max),
                ..over
            });
        };
        let above = leg.height.from(s0) - patch.along(line.at(s0), line.step);
        let (length, slack) = (s1 - s0, line.slack_m);
        // The bend moves the borders of the cell by so much.
        let room = (line.bend / line.step[0].hypot(line.step[1])).min(MAX_ROOM);
        let crossing = Crossing::new(number, patch, leg, &line, 0.5 * (s0 + s1));
        let entered = self.passed != Passed::All && self.passed != Passed::Tile(number);
        if entered && above.c <= slack {
            self.enter(&crossing, leg.t(s0))?;
        }
        self.passed = Passed::Tile(number);
        let wide = above.from(-room);
        if wide.at(wide.lowest(length + 2.0 * room)) > slack {
            return Continue(());
        }
        let hit = if above.c > slack && above.at(length) < -slack {
            let s = above.first_not_positive(length).unwrap_or(length);
            self.polish(&crossing, leg.t(s0 + s), (leg.t(s0), leg.t(s1)))
        } else {
            self.refine(&crossing, leg, (leg.t(s0 - room), leg.t(s1 + room)))
        };
        hit.map_or(Continue(()), |t| Break(Ok(t)))
    }

    /// The ray comes to a raster from elsewhere, perhaps below its surface.
    fn enter(&self, crossing: &Crossing, t: f64) -> ControlFlow<Found> {
        if self.above(crossing, t).is_none_or(|(above, _)| above > 0.0) {
            return Continue(());
        }
        Break(match self.passed {
            Passed::Start => Err(Miss::UnderGround),
            Passed::Unknown => Err(Miss::OffTerrain),
            _ => Ok(self.wall(t)),
        })
    }

    /// Where exactly, near `t`, the ray goes under a step between two surfaces.
    pub fn wall(&self, t: f64) -> f64 {
        let under = |t: f64| {
            let place = self.site.geodetic(self.ray.at(t));
            let surface = self.model.surface(place);
            surface.is_some_and(|surface| place.height_m <= surface.height_m())
        };
        for doubling in 0..24 {
            let margin = 1e-8 * f64::from(1u32 << doubling);
            let ends = ((t - margin).max(0.0), t + margin);
            if let Some(t) = bisected(under, ends) {
                return t;
            }
        }
        t
    }

    /// How high the ray exactly runs above a raster's surface at `t`, metres, and that surface; a
    /// place just off the known cells is judged by the crossing's own.
    fn above(&self, crossing: &Crossing, t: f64) -> Option<(f64, Surface)> {
        let place = self.site.geodetic(self.ray.at(t));
        let tile = &self.model.tiles[crossing.number];
        let position = tile.position(place)?;
        let patch = tile.patch_at(position).unwrap_or(crossing.patch);
        let surface = Surface::Tile(crossing.number, patch, position);
        Some((place.height_m - surface.height_m(), surface))
    }

    /// The root of the exact surface near `guess`, within or hardly beyond `ends`: by Newton's
    /// method, or where that strays (two cells that meet in a ridge) by bisection.
    fn polish(&self, crossing: &Crossing, guess: f64, ends: (f64, f64)) -> Option<f64> {
        let trust = 1e-4 + 0.02 * (ends.1 - ends.0);
        let mut t = guess;
        for _ in 0..8 {
            let (above, surface) = self.above(crossing, t)?;
            let slope = crossing.closing(&surface);
            let step = -above / slope;
            if slope >= 0.0 || (t + step - guess).abs() > trust {
                break;
            }
            t += step;
            if step.abs() < LAST_STEP_M {
                let landed = crossing.is_amid(&surface) || self.is_known(crossing, t);
                return landed.then_some(t);
            }
        }
        self.bisect(crossing, ends)
    }

    /// The root between two ends of which the first is above the surface and the second below.
    fn bisect(&self, crossing: &Crossing, ends: (f64, f64)) -> Option<f64> {
        let under = |t: f64| {
            self.above(crossing, t)
                .is_some_and(|(above, _)| above <= 0.0)
        };
        bisected(under, ends).filter(|&t| self.is_known(crossing, t))
    }

    /// Whether the raster knows the ground at `t`: a hit just off its edge is none.
    fn is_known(&self, crossing: &Crossing, t: f64) -> bool {
        let tile = &self.model.tiles[crossing.number];
        let position = tile.position(self.site.geodetic(self.ray.at(t)));
        position.is_some_and(|position| tile.patch_at(position).is_some())
    }

    /// A cell in doubt, in pieces that do not bend.
    fn refine(&self, crossing: &Crossing, leg: &Leg, ends: (f64, f64)) -> Option<f64> {
        let (first, last) = ((ends.0 - 1e-6).max(leg.t0), (ends.1 + 1e-6).min(leg.t1));
        let pieces = pieces(last - first);
        let tile = &self.model.tiles[crossing.number];
        let mut t0 = first;
        let mut start = self.site.geodetic(self.ray.at(t0));
        for piece in 1..=pieces {
            let t1 = first + (last - first) * f64::from(piece) / f64::from(pieces);
            let end = self.site.geodetic(self.ray.at(t1));
            let slope = self.slope(start);
            let leg = Leg::new((t0, start), (t1, end), slope);
            let (from, to) = (tile.position(start)?, tile.position(end)?);
            let line = Line {
                start: from,
                step: [to[0] - from[0], to[1] - from[1]],
                bend: 0.0,
                slack_m: 0.0,
            };
            let patch = tile.patch_at(line.at(0.5)).unwrap_or(crossing.patch);
            let above = leg.height - patch.along(line.start, line.step);
            if let Some(s) = above.first_not_positive(1.0) {
                let here = Crossing::new(crossing.number, patch, &leg, &line, s);
                let lowest = leg.t(above.lowest(1.0));
                if let Some(t) = self.polish(&here, leg.t(s), (t0, lowest)) {
                    return Some(t);
                }
            }
            (t0, start) = (t1, end);
        }
        None
    }
}

impl Crossing {
    fn new(number: usize, patch: Patch, leg: &Leg, line: &Line, s: f64) -> Self {
        let length = leg.length_m();
        Self {
            number,
            patch,
            rate: line.step.map(|step| step / length),
            climb: leg.height.slope(s) / length,
        }
    }

    /// Whether a surface is so far from the borders of its cell that one more step stays in it.
    fn is_amid(&self, surface: &Surface) -> bool {
        let Surface::Tile(_, patch, position) = surface else {
            return true;
        };
        let amid = |offset: f64, rate: f64| {
            let room = LAST_STEP_M * rate.abs();
            offset > room && offset < 1.0 - room
        };
        amid(position[0] - patch.column, self.rate[0])
            && amid(position[1] - patch.row, self.rate[1])
    }

    /// How the height of the ray above a surface grows, metres a metre.
    fn closing(&self, surface: &Surface) -> f64 {
        match surface {
            Surface::Tile(_, patch, position) => {
                let [x, y] = patch.gradient(*position);
                self.climb - x * self.rate[0] - y * self.rate[1]
            }
            Surface::Outside(_) => self.climb,
        }
    }
}

/// Where `under` begins to hold, between two ends of which it holds at the second alone; `None`
/// where they are otherwise.
fn bisected(under: impl Fn(f64) -> bool, (mut above, mut below): (f64, f64)) -> Option<f64> {
    if under(above) || !under(below) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (above + below);
        if under(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    Some(below)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the number is clamped"
)]
fn pieces(length_m: f64) -> u32 {
    (length_m / PIECE_M)
        .ceil()
        .clamp(1.0, f64::from(MAX_PIECES)) as u32
}
