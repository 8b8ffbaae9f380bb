//! The rocks in a grid over the ground, for rays that ask which they meet.

use nalgebra::Vector3;

use crate::frame::{Direction, Enu, Point, Ray};

use super::ground::Ground;
use super::rocks::Rock;
use super::scene::Occlusion;

/// Rocks by the cells of a horizontal grid their bodies reach into.
pub struct Field<'a> {
    rocks: &'a [Rock],
    origin: [f64; 2],
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Of each cell, row by row: its share of `members`.
    starts: Vec<usize>,
    members: Vec<usize>,
    /// The highest point of any rock above its place, and above the tangent plane.
    highest_m: f64,
    lowest_m: f64,
}

/// Rocks count as members of cells this many times their radius away, for the shade they cast on
/// the ground around them.
pub(super) const SHADE_REACH: f64 = 1.6;

/// Where a ray meets a rock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RockHit {
    /// Index of the rock.
    pub rock: usize,
    /// Distance along the ray, metres.
    pub distance_m: f64,
    /// Outward unit normal, ENU.
    pub normal: Vector3<f64>,
}

impl<'a> Field<'a> {
    /// The field of some rocks.
    pub fn new(rocks: &'a [Rock]) -> Self {
        let bound = |f: fn(&Rock) -> f64, pick: fn(f64, f64) -> f64, start: f64| {
            rocks.iter().map(f).fold(start, pick)
        };
        let west = bound(|r| r.place.xyz.x - r.diameter_m, f64::min, f64::INFINITY);
        let south = bound(|r| r.place.xyz.y - r.diameter_m, f64::min, f64::INFINITY);
        let east = bound(
            |r| r.place.xyz.x + r.diameter_m,
            f64::max,
            f64::NEG_INFINITY,
        );
        let north = bound(
            |r| r.place.xyz.y + r.diameter_m,
            f64::max,
            f64::NEG_INFINITY,
        );
        let (width, height) = ((east - west).max(0.0), (north - south).max(0.0));
        let cell_m = (width.max(height) / 512.0).max(0.4);
        let mut field = Self {
            rocks,
            origin: [west, south],
            cell_m,
            columns: cells(width / cell_m),
            rows: cells(height / cell_m),
            starts: Vec::new(),
            members: Vec::new(),
            highest_m: bound(
                |r| r.place.xyz.z + r.diameter_m * r.shape.half_axes.z,
                f64::max,
                f64::NEG_INFINITY,
            ),
            lowest_m: bound(
                |r| r.place.xyz.z - r.diameter_m * r.shape.half_axes.z,
                f64::min,
                f64::INFINITY,
            ),
        };
        field.fill();
        field
    }

    /// The rocks.
    pub fn rocks(&self) -> &'a [Rock] {
        self.rocks
    }

    fn fill(&mut self) {
        let mut cells: Vec<Vec<usize>> = vec![Vec::new(); self.columns * self.rows];
        for (i, rock) in self.rocks.iter().enumerate() {
            let reach = rock.diameter_m * rock.shape.half_axes.xy().max() * SHADE_REACH;
            let p = rock.place.xyz;
            let (c0, c1) = (
                self.column(p.x - reach),
                self.column(p.x + reach).min(self.columns - 1),
            );
            let (r0, r1) = (
                self.row(p.y - reach),
                self.row(p.y + reach).min(self.rows - 1),
            );
            for row in r0..=r1 {
                for column in c0..=c1 {
                    cells[row * self.columns + column].push(i);
                }
            }
        }
        self.starts.push(0);
        for cell in cells {
            self.members.extend(cell);
            self.starts.push(self.members.len());
        }
    }

    fn column(&self, x: f64) -> usize {
        whole((x - self.origin[0]) / self.cell_m)
    }

    fn row(&self, y: f64) -> usize {
        whole((y - self.origin[1]) / self.cell_m)
    }

    /// The rocks of the cell at a place.
    pub(super) fn members_at(&self, x: f64, y: f64) -> &[usize] {
        let (u, v) = (
            (x - self.origin[0]) / self.cell_m,
            (y - self.origin[1]) / self.cell_m,
        );
        if u < 0.0 || v < 0.0 {
            return &[];
        }
        let (column, row) = (whole(u), whole(v));
        if column >= self.columns || row >= self.rows {
            return &[];
        }
        self.members_of(row, column)
    }

    fn members_of(&self, row: usize, column: usize) -> &[usize] {
        let cell = row * self.columns + column;
        &self.members[self.starts[cell]..self.starts[cell + 1]]
    }

    /// All rocks whose places lie within a horizontal distance of a place, and others near it;
    /// ascending.
    pub(super) fn near(&self, x: f64, y: f64, within_m: f64) -> Vec<usize> {
        let last = |n: usize| n.saturating_sub(1);
        let columns = self.column(x - within_m)..=self.column(x + within_m).min(last(self.columns));
        let mut rocks = Vec::new();
        for row in self.row(y - within_m)..=self.row(y + within_m).min(last(self.rows)) {
            for column in columns.clone() {
                rocks.extend(self.members_of(row, column));
            }
        }
        rocks.sort_unstable();
        rocks.dedup();
        rocks
    }

    /// The first rock a ray meets before `reach_m`, other than `except`.
    pub fn first_hit(&self, ray: Ray<Enu>, reach_m: f64, except: Option<usize>) -> Option<RockHit> {
        let mut best: Option<RockHit> = None;
        self.walk(ray, reach_m, |rock, leave_m| {
            if Some(rock) != except
                && let Some((distance_m, normal)) = meet(&self.rocks[rock], ray)
                && distance_m < best.map_or(reach_m, |b| b.distance_m)
            {
                best = Some(RockHit {
                    rock,
                    distance_m,
                    normal,
                });
            }
            // A hit within the cell is nearer than any beyond it.
            best.is_some_and(|b| b.distance_m <= leave_m)
        });
        best
    }

    /// Whether a ray meets any rock other than `except` before `reach_m`.
    pub fn is_blocked(&self, ray: Ray<Enu>, reach_m: f64, except: Option<usize>) -> bool {
        let mut blocked = false;
        self.walk(ray, reach_m, |rock, _| {
            blocked |= Some(rock) != except
                && meet(&self.rocks[rock], ray).is_some_and(|(d, _)| d < reach_m);
            blocked
        });
        blocked
    }

    /// Visits the members of the cells along a ray in turn, each with the distance at which the ray
    /// leaves its cell, until `visit` has had enough (Amanatides and Woo, 1987).
    fn walk(&self, ray: Ray<Enu>, reach_m: f64, mut visit: impl FnMut(usize, f64) -> bool) {
        let Some((enter, leave)) = self.span(ray, reach_m) else {
            return;
        };
        let d = ray.direction.xyz();
        let start = ray.at(enter).xyz;
        let mut cell = [
            self.column(start.x).min(self.columns - 1),
            self.row(start.y).min(self.rows - 1),
        ];
        let last = [self.columns, self.rows];
        let mut next = [f64::INFINITY; 2];
        let mut step = [f64::INFINITY; 2];
        for axis in 0..2 {
            if d[axis] != 0.0 {
                #[expect(clippy::cast_precision_loss, reason = "at most 512 cells")]
                let edge = (cell[axis] + usize::from(d[axis] > 0.0)) as f64;
                let edge = self.origin[axis] + edge * self.cell_m;
                next[axis] = (edge - ray.origin.xyz[axis]) / d[axis];
                step[axis] = self.cell_m / d[axis].abs();
            }
        }
        loop {
            let axis = usize::from(next[1] < next[0]);
            let leave_cell = next[axis];
            let index = cell[1] * self.columns + cell[0];
            for &rock in &self.members[self.starts[index]..self.starts[index + 1]] {
                if visit(rock, leave_cell) {
                    return;
                }
            }
            if leave_cell > leave {
                return;
            }
            cell[axis] = if d[axis] > 0.0 {
                cell[axis] + 1
            } else if cell[axis] > 0 {
                cell[axis] - 1
            } else {
                return;
            };
            if cell[axis] >= last[axis] {
                return;
            }
            next[axis] += step[axis];
        }
    }

    /// Where a ray enters and leaves the space the rocks fill.
    fn span(&self, ray: Ray<Enu>, reach_m: f64) -> Option<(f64, f64)> {
        if self.rocks.is_empty() {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "at most 512 cells")]
        let size = [self.columns as f64, self.rows as f64].map(|n| n * self.cell_m);
        let low = [self.origin[0], self.origin[1], self.lowest_m];
        let high = [
            self.origin[0] + size[0],
            self.origin[1] + size[1],
            self.highest_m,
        ];
        let (mut enter, mut leave) = (0.0f64, reach_m);
        for axis in 0..3 {
            let (o, d) = (ray.origin.xyz[axis], ray.direction.xyz()[axis]);
            if d == 0.0 {
                if o < low[axis] || o > high[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[axis] - o) / d, (high[axis] - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }

    /// Whether more than half of a rock's visible outline is hidden from an eye.
    pub(super) fn is_hidden(
        &self,
        rock: usize,
        eye: Point<Enu>,
        ground: &Ground,
        by: Occlusion,
    ) -> bool {
        if !by.rocks && !by.ground {
            return false;
        }
        let samples = outline_samples(&self.rocks[rock], eye);
        let hidden = samples.iter().filter(|&&sample| {
            let to_sample = sample - eye;
            let Some(direction) = Direction::new(to_sample.xyz) else {
                return false;
            };
            let ray = Ray {
                origin: eye,
                direction,
            };
            let reach_m = to_sample.norm();
            (by.rocks && self.is_blocked(ray, reach_m, Some(rock)))
                || (by.ground && ground.first_hit_m(ray, reach_m - 1e-3).is_some())
        });
        2 * hidden.count() > samples.len()
    }
}

/// Points spread over the half of a rock that stands out of the ground, as an eye sees it.
fn outline_samples(rock: &Rock, eye: Point<Enu>) -> [Point<Enu>; 9] {
    let to_rock = rock.place.xyz - eye.xyz;
    let across = Vector3::new(-to_rock.y, to_rock.x, 0.0);
    let across = across / across.norm().max(1e-9) * rock.diameter_m * 0.5;
    let up = Vector3::z() * rock.diameter_m * rock.shape.top;
    std::array::from_fn(|i| {
        let column = [-0.7, 0.0, 0.7][i % 3];
        let row = [0.15, 0.45, 0.75][i / 3];
        Point::from_xyz(rock.place.xyz + across * column * (1.0 - 0.3 * row) + up * row)
    })
}

/// Where a ray enters a rock's body: distance and outward normal. `None` where it misses it, starts
/// inside or has it behind.
fn meet(rock: &Rock, ray: Ray<Enu>) -> Option<(f64, Vector3<f64>)> {
    let shape = &rock.shape;
    let scale = rock.diameter_m;
    let o = (ray.origin.xyz - rock.place.xyz) / scale;
    let d = ray.direction.xyz();
    // Most rays miss the sphere around the body.
    let reach = shape.half_axes.max();
    let along = o.dot(&d);
    if o.norm_squared() - along * along > reach * reach {
        return None;
    }
    let (mut enter, mut leave, mut normal) =
        ellipsoid_span(shape.half_axes, shape.long_axis, o, d)?;
    for &(n, distance) in &shape.facets {
        let toward = n.dot(&d);
        let gap = distance - n.dot(&o);
        if toward == 0.0 {
            if gap < 0.0 {
                return None;
            }
            continue;
        }
        let t = gap / toward;
        if toward > 0.0 {
            leave = leave.min(t);
        } else if t > enter {
            enter = t;
            normal = n;
        }
        if enter > leave {
            return None;
        }
    }
    (enter > 1e-9).then_some((enter * scale, normal))
}

/// The span of a ray in an ellipsoid and the normal where it enters.
fn ellipsoid_span(
    half_axes: Vector3<f64>,
    [cos, sin]: [f64; 2],
    o: Vector3<f64>,
    d: Vector3<f64>,
) -> Option<(f64, f64, Vector3<f64>)> {
    let to_axes = |v: Vector3<f64>| {
        Vector3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z).component_div(&half_axes)
    };
    let (p, q) = (to_axes(o), to_axes(d));
    let (a, b, c) = (q.norm_squared(), p.dot(&q), p.norm_squared() - 1.0);
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let enter = (-b - root) / a;
    let n = (p + q * enter).component_div(&half_axes);
    let n = Vector3::new(n.x * cos - n.y * sin, n.x * sin + n.y * cos, n.z);
    Some((enter, (-b + root) / a, n.normalize()))
}

fn cells(extent: f64) -> usize {
    whole(extent.ceil()).max(1)
}

fn whole(x: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a grid of at most 512 cells; what lies before it counts as its first"
    )]
    let whole = x.clamp(0.0, 1e6) as usize;
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Scene, simulate};

    #[test]
    fn every_rock_near_a_place_is_found_near_it() {
        let scene = Scene::parse("[rocks]\nnumber = 300\n", "scene.toml").unwrap();
        let rocks = simulate(&scene).rocks;
        let field = Field::new(&rocks);
        for (x, y, within_m) in [(10.0, 0.0, 3.0), (-30.0, 4.0, 29.0), (60.0, -50.0, 5.0)] {
            let near = field.near(x, y, within_m);
            assert!(near.is_sorted());
            let apart = |rock: &Rock| (rock.place.xyz.x - x).hypot(rock.place.xyz.y - y);
            for (i, rock) in rocks.iter().enumerate() {
                assert!(apart(rock) > within_m || near.contains(&i), "{i}");
            }
        }
        assert!(field.near(10.0, 0.0, 3.0).len() < 100);
        assert_eq!(field.near(0.0, 0.0, f64::INFINITY).len(), rocks.len());
        assert!(Field::new(&[]).near(0.0, 0.0, 5.0).is_empty());
    }
}
