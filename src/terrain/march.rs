//! The first place where a ray meets a model of several rasters.
//!
//! The ray is cut into legs. On a leg the height above the ellipsoid is a parabola (exact to
//! 1e-7 m on 100 m), and column and row in a raster are lines but for a known bend. Blocks of cells
//! that lie below the ray are skipped whole; in each cell that is left the difference of a parabola
//! and a bilinear surface along a line is a quadratic. Where it is positive by more than the bend
//! can account for there is no hit, where it changes sign by more than that there is one, and
//! everything between is decided on pieces so short that they do not bend. Every hit is polished on
//! the exact surface.

use std::ops::ControlFlow::{self, Break, Continue};

use crate::frame::{Enu, Geodetic, Ray, Site};

use super::Miss;
use super::constant::{first_not_above, height_along};
use super::leg::{Blocks, Leg, Line};
use super::model::Model;

/// What the parabola of a leg may be off, metres, and then some.
const SLACK_M: f64 = 2e-7;

/// Stretches of unknown ground shorter than this, metres, are rounding between neighbours.
const SLIVER_M: f64 = 1e-6;

/// A ray on its way.
pub(super) struct March<'a> {
    pub site: &'a Site,
    pub model: &'a Model,
    pub ray: Ray<Enu>,
    pub passed: Passed,
    /// Where the last leg ended in the first raster: the next one begins there.
    joint: Option<(f64, [f64; 2])>,
}

/// What the ray has last been seen above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Passed {
    /// Nothing: it has just started.
    Start,
    /// Unknown ground since the start.
    Unknown,
    /// Everything.
    All,
    /// A raster.
    Tile(usize),
    /// The constant height outside.
    Outside,
}

/// Distance to the hit, metres, or why there is none.
pub(super) type Found = Result<f64, Miss>;

/// A stretch of a leg over the raster of a number; `ceiling_m` is that of the holes of earlier
/// rasters through which it is seen.
#[derive(Clone, Copy)]
pub(super) struct Over<'l> {
    pub leg: &'l Leg,
    pub number: usize,
    pub s0: f64,
    pub s1: f64,
    pub ceiling_m: Option<f64>,
}

/// The first hit of a ray within a horizontal distance: how far along the ray.
pub(super) fn first_hit(
    site: &Site,
    model: &Model,
    ray: Ray<Enu>,
    max_ground_range_m: f64,
) -> Found {
    let mut march = March {
        site,
        model,
        ray,
        passed: Passed::Start,
        joint: None,
    };
    let step = [ray.direction.xyz().x, ray.direction.xyz().y];
    let far = max_ground_range_m / step[0].hypot(step[1]);
    let far = if far.is_nan() { f64::INFINITY } else { far };
    let top = first_not_above(site, ray, model.top_m, 0.0).ok_or(Miss::AboveHorizon)?;
    let bounds = model.within_bounds(ray.origin, step);
    if top > far {
        let leave = bounds.map_or(0.0, |(_, leave)| leave);
        return Err(march.after(leave.min(far), far));
    }
    let start = march.begin(top);
    let (enter, leave) = bounds
        .filter(|&(enter, leave)| leave > start && enter < far)
        .map_or((start, start), |(a, b)| (a.max(start), b.min(far)));
    match march.run(start, (enter, leave), far) {
        Break(found) => found,
        Continue(()) => {
            // Rasters beyond the range lie ahead still, and their heights count.
            let ahead = bounds.is_some_and(|(_, end)| end > far);
            let from = if ahead { far } else { leave.max(top) };
            Err(march.after(from, far))
        }
    }
}

impl March<'_> {
    /// Where to start: at `top`, where the ray comes down to the highest ground, or, where it
    /// stands over unknown ground, at its origin.
    fn begin(&mut self, top: f64) -> f64 {
        if top == 0.0 {
            return 0.0;
        }
        let origin = self.site.geodetic(self.ray.origin);
        if self.model.outside_m.is_some() || self.model.surface(origin).is_some() {
            self.passed = Passed::All;
            return top;
        }
        self.passed = Passed::Unknown;
        0.0
    }

    /// From `start` to the bounds of the rasters, through them, and on to `far`.
    fn run(&mut self, start: f64, (enter, leave): (f64, f64), far: f64) -> ControlFlow<Found> {
        self.around(start, enter)?;
        let mut t = enter;
        let mut place = self.site.geodetic(self.ray.at(t));
        while t < leave {
            let slope = self.slope(place);
            if place.height_m > self.model.top_m && slope >= 0.0 {
                return Break(Err(Miss::AboveHorizon));
            }
            // Wherever it comes to known ground, it will be below it.
            if self.passed == Passed::Unknown && place.height_m < self.model.bottom_m {
                return Break(Err(Miss::OffTerrain));
            }
            let next = (t + self.model.leg_m).min(leave);
            let leg = self.leg(t, next, place, slope);
            self.scan(Over {
                leg: &leg,
                number: 0,
                s0: 0.0,
                s1: 1.0,
                ceiling_m: None,
            })?;
            (t, place) = (next, leg.end);
        }
        self.around(leave, far)
    }

    /// A stretch outside the bounds of all rasters.
    fn around(&mut self, from: f64, to: f64) -> ControlFlow<Found> {
        if from >= to {
            return Continue(());
        }
        let Some(outside_m) = self.model.outside_m else {
            if self.passed == Passed::Start {
                self.passed = Passed::Unknown;
            }
            return Continue(());
        };
        self.outside(outside_m, from, to)
    }

    /// Why there is no hit on a ray that has left the rasters, or come to the end of its range, at
    /// `from`.
    fn after(&self, from: f64, far: f64) -> Miss {
        if self.passed == Passed::Unknown {
            let rises = self.slope(self.site.geodetic(self.ray.at(from))) >= 0.0;
            return if rises {
                Miss::AboveHorizon
            } else {
                Miss::OffTerrain
            };
        }
        let (outside_m, top_m) = (self.model.outside_m, self.model.top_m);
        let highest_m = outside_m.filter(|_| from < far).unwrap_or(top_m);
        match first_not_above(self.site, self.ray, highest_m, from) {
            None => Miss::AboveHorizon,
            Some(t) if t >= far || outside_m.is_some() => Miss::TooFar,
            Some(_) => Miss::OffTerrain,
        }
    }

    pub fn slope(&self, place: Geodetic) -> f64 {
        self.site.up(place).xyz().dot(&self.ray.direction.xyz())
    }

    /// The leg from `t0`, at `start` where the height grows by `slope`, to `t1`.
    fn leg(&self, t0: f64, t1: f64, start: Geodetic, slope: f64) -> Leg {
        let end = self.site.geodetic(self.ray.at(t1));
        Leg::new((t0, start), (t1, end), slope)
    }

    /// The leg in a raster; `None` where its map does not reach or the leg crosses its seam.
    fn line(&mut self, number: usize, leg: &Leg) -> Option<Line> {
        let tile = &self.model.tiles[number];
        let start = match self.joint {
            Some((t, start)) if number == 0 && t == leg.t0 => start,
            _ => tile.position(leg.start)?,
        };
        let end = tile.position(leg.end)?;
        if number == 0 {
            self.joint = Some((leg.t1, end));
        }
        let bend = tile.bend * leg.length_m().powi(2) / 8.0;
        let step = [end[0] - start[0], end[1] - start[1]];
        // A step round the planet is a leg across the map's edge at its antimeridian.
        (step[0].hypot(step[1]) < tile.half_turn).then_some(Line {
            start,
            step,
            bend,
            slack_m: SLACK_M + 4.0 * tile.step_m * bend,
        })
    }

    /// A stretch over a raster and whatever lies around it.
    pub fn scan(&mut self, over: Over<'_>) -> ControlFlow<Found> {
        let Over {
            leg,
            number,
            s0,
            s1,
            ..
        } = over;
        if s1 <= s0 {
            return Continue(());
        }
        let later = Over {
            number: number + 1,
            ..over
        };
        let Some(tile) = self.model.tiles.get(number) else {
            return match self.model.outside_m {
                Some(outside_m) if leg.lowest_m(s0, s1) > outside_m + SLACK_M => {
                    self.passed = Passed::Outside;
                    Continue(())
                }
                Some(outside_m) => self.outside(outside_m, leg.t(s0), leg.t(s1)),
                None => self.unknown(over),
            };
        };
        let line = self.line(number, leg);
        let part = line.and_then(|line| Some((line, line.clip(tile.last(), s0, s1)?)));
        let Some((line, (enter, leave))) = part else {
            return self.scan(later);
        };
        self.scan(Over { s1: enter, ..later })?;
        self.walk(
            Over {
                s0: enter,
                s1: leave,
                ..over
            },
            line,
        )?;
        self.scan(Over { s0: leave, ..later })
    }

    /// A stretch over unknown ground. The one in which the ray starts is passed: whoever stands
    /// there has the ground below them. Any other is passed above its ceiling alone.
    fn unknown(&mut self, over: Over<'_>) -> ControlFlow<Found> {
        let leg = over.leg;
        if leg.t(over.s1) - leg.t(over.s0) < SLIVER_M {
            return Continue(());
        }
        if matches!(self.passed, Passed::Start | Passed::Unknown) {
            self.passed = Passed::Unknown;
            return Continue(());
        }
        if leg.lowest_m(over.s0, over.s1) <= over.ceiling_m.unwrap_or(self.model.top_m) {
            return Break(Err(Miss::OffTerrain));
        }
        Continue(())
    }

    /// A stretch over the constant height outside.
    fn outside(&mut self, outside_m: f64, from: f64, to: f64) -> ControlFlow<Found> {
        if height_along(self.site, self.ray, from).0 <= outside_m {
            return Break(match self.passed {
                Passed::Start => Err(Miss::UnderGround),
                Passed::Tile(_) => Ok(self.wall(from)),
                _ => Ok(from),
            });
        }
        self.passed = Passed::Outside;
        match first_not_above(self.site, self.ray, outside_m, from) {
            Some(t) if t <= to => Break(Ok(t)),
            _ => Continue(()),
        }
    }

    /// A stretch over the cells of a raster.
    fn walk(&mut self, over: Over<'_>, line: Line) -> ControlFlow<Found> {
        let tile = &self.model.tiles[over.number];
        let mut blocks = Blocks::new(tile.last(), line, over.s0, over.s1);
        let levels = tile.pyramid.levels();
        let mut level = levels;
        loop {
            let exit = blocks.exit(level);
            if level == 0 {
                self.cell(
                    Over {
                        s0: blocks.s,
                        s1: exit,
                        ..over
                    },
                    line,
                    blocks.cell,
                )?;
            } else {
                let (highest, hole) = tile.pyramid.block(level, blocks.cell[0], blocks.cell[1]);
                let seen_through = over.ceiling_m.filter(|_| hole);
                let clear_m = highest.max(seen_through.unwrap_or(f64::NEG_INFINITY)) + line.slack_m;
                // Over unknown ground since its start, a ray must be told where that ends.
                let lost = hole && matches!(self.passed, Passed::Start | Passed::Unknown);
                if lost || over.leg.lowest_m(blocks.s, exit) <= clear_m {
                    level -= 1;
                    continue;
                }
                self.passed = Passed::Tile(over.number);
            }
            if !blocks.advance(level) {
                return Continue(());
            }
            level = (level + 1).min(levels);
        }
    }
}
