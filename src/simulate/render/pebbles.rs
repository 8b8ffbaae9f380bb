//! Pebbles: too small and too many to be kept, each follows from the cell of ground it lies in.

use nalgebra::Vector3;

use crate::frame::{Enu, Ray};

use super::super::random::{lattice, share};

/// Layers of pebbles, each with one to a cell at most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pebbles {
    key: u64,
    layers: [Layer; 3],
}

#[derive(Debug, Clone, Copy)]
struct Layer {
    cell_m: f64,
    smallest_m: f64,
    largest_m: f64,
    /// The chance that a cell holds one.
    filled: f64,
}

/// A pebble that a ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pebble {
    pub place: Vector3<f64>,
    pub normal: Vector3<f64>,
    /// What tells it from others.
    pub bits: u64,
}

/// Height by radius.
const FLATNESS: f64 = 0.65;

impl Pebbles {
    /// About `per_m2` pebbles of half a centimetre and more on a square metre, most of them small.
    pub(super) fn new(key: u64, per_m2: f64) -> Self {
        // The shares of the three layers fall with size.
        let layer = |share: f64, filled: f64, smallest_m, largest_m| Layer {
            cell_m: (filled / (share * per_m2.max(1e-6))).sqrt(),
            smallest_m,
            largest_m,
            filled: if per_m2 > 0.0 { filled } else { 0.0 },
        };
        Self {
            key,
            layers: [
                layer(0.04, 0.6, 0.014, 0.030),
                layer(0.20, 0.7, 0.006, 0.015),
                layer(0.76, 0.75, 0.0035, 0.007),
            ],
        }
    }

    /// The first pebble a ray meets on its last stretch before it meets the ground at `ground_m`.
    /// `slope` is the ground's there; pebbles smaller than a third of `footprint_m` are left out.
    pub(super) fn first_hit(
        &self,
        ray: Ray<Enu>,
        ground_m: f64,
        slope: [f64; 2],
        footprint_m: f64,
    ) -> Option<Pebble> {
        let foot = ray.at(ground_m).xyz;
        let mut best: Option<(f64, Pebble)> = None;
        self.near(ray, foot, [-1.0, 0.0], footprint_m, |stone| {
            if let Some((t, normal)) = stone.meet(ray, foot, slope)
                && t < best.as_ref().map_or(ground_m, |b| b.0)
            {
                let pebble = Pebble {
                    place: ray.at(t).xyz,
                    normal,
                    bits: stone.bits,
                };
                best = Some((t, pebble));
            }
            false
        });
        best.map(|b| b.1)
    }

    /// Whether a ray from near the ground point `foot` meets a pebble on its way up.
    pub(super) fn is_blocked(
        &self,
        ray: Ray<Enu>,
        foot: Vector3<f64>,
        slope: [f64; 2],
        footprint_m: f64,
    ) -> bool {
        let mut blocked = false;
        self.near(ray, foot, [0.0, 1.0], footprint_m, |stone| {
            blocked = stone.meet(ray, foot, slope).is_some_and(|(t, _)| t > 1e-4);
            blocked
        });
        blocked
    }

    /// Visits the pebbles in the cells that a ray crosses while it is no higher above `foot` than
    /// they are, before it (`span` -1 to 0) or after it (0 to 1), until `visit` has had enough.
    fn near(
        &self,
        ray: Ray<Enu>,
        foot: Vector3<f64>,
        span: [f64; 2],
        footprint_m: f64,
        mut visit: impl FnMut(&Stone) -> bool,
    ) {
        let d = ray.direction.xyz();
        for (index, layer) in (0u64..).zip(&self.layers) {
            if layer.filled == 0.0 || layer.largest_m < footprint_m {
                continue;
            }
            // Twice the pebbles' height, for the ground may rise towards the ray.
            let along_m = 2.0 * layer.largest_m * FLATNESS / d.z.abs().max(0.02);
            let reach = [span[0] * along_m, span[1] * along_m];
            let from = foot.xy() + d.xy() * reach[0];
            let to = foot.xy() + d.xy() * reach[1];
            let margin = nalgebra::Vector2::repeat(layer.largest_m);
            let low = (from.inf(&to) - margin) / layer.cell_m;
            let high = (from.sup(&to) + margin) / layer.cell_m;
            for x in cell(low.x)..=cell(high.x) {
                for y in cell(low.y)..=cell(high.y) {
                    let stone = layer.stone(self.key.wrapping_add(index), x, y, footprint_m);
                    if stone.is_some_and(|s| visit(&s)) {
                        return;
                    }
                }
            }
        }
    }
}

/// One pebble.
struct Stone {
    centre: [f64; 2],
    half_axes: Vector3<f64>,
    turn: (f64, f64),
    bits: u64,
}

impl Layer {
    fn stone(&self, key: u64, x: i64, y: i64, footprint_m: f64) -> Option<Stone> {
        let bits = lattice(key, x, y);
        if share(bits, 0) >= self.filled {
            return None;
        }
        let more = lattice(bits, x, y);
        let skew = share(bits, 1) * share(bits, 2);
        let radius_m = self.smallest_m + (self.largest_m - self.smallest_m) * skew;
        if 3.0 * radius_m < footprint_m {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "a site spans few cells")]
        let centre = [x as f64 + share(more, 0), y as f64 + share(more, 1)];
        let long = 1.0 + 0.35 * share(more, 2);
        Some(Stone {
            centre: centre.map(|c| c * self.cell_m),
            half_axes: Vector3::new(radius_m * long, radius_m / long, radius_m * FLATNESS),
            turn: half_turn(share(bits, 2)),
            bits: more,
        })
    }
}

impl Stone {
    /// Where a ray enters the pebble, whose centre lies on the plane through `foot`.
    fn meet(
        &self,
        ray: Ray<Enu>,
        foot: Vector3<f64>,
        slope: [f64; 2],
    ) -> Option<(f64, Vector3<f64>)> {
        let [x, y] = self.centre;
        let z = foot.z + slope[0] * (x - foot.x) + slope[1] * (y - foot.y);
        let (sin, cos) = self.turn;
        let to_axes = |v: Vector3<f64>| {
            Vector3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z)
                .component_div(&self.half_axes)
        };
        let p = to_axes(ray.origin.xyz - Vector3::new(x, y, z));
        let q = to_axes(ray.direction.xyz());
        let (a, b, c) = (q.norm_squared(), p.dot(&q), p.norm_squared() - 1.0);
        let discriminant = b * b - a * c;
        if discriminant <= 0.0 {
            return None;
        }
        let t = (-b - discriminant.sqrt()) / a;
        let n = (p + q * t).component_div(&self.half_axes);
        let n = Vector3::new(n.x * cos - n.y * sin, n.x * sin + n.y * cos, n.z);
        (t > 0.0).then(|| (t, n.normalize()))
    }
}

/// Sine and cosine of an angle between -90 and 90 degrees, by the tangent of its half.
fn half_turn(share: f64) -> (f64, f64) {
    let t = 2.0 * share - 1.0;
    let scale = 1.0 / (1.0 + t * t);
    (2.0 * t * scale, (1.0 - t * t) * scale)
}

fn cell(x: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a site spans few cells")]
    let toward_zero = x as i64;
    #[expect(clippy::cast_precision_loss, reason = "a site spans few cells")]
    let below = toward_zero - i64::from(x < toward_zero as f64);
    below
}
