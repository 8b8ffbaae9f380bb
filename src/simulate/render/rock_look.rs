//! The colour and the small relief of rocks.

use nalgebra::Vector3;

use super::super::Rock;
use super::super::noise::value_noise;
use super::super::random::{lattice, share};
use super::palette::{Colour, Colours, mix};

/// What a place of a rock looks like.
pub(super) struct Look {
    pub albedo: Colour,
    pub normal: Vector3<f64>,
    /// The body's own normal, without the small relief.
    pub face: Vector3<f64>,
    /// The facet it lies on: 0 for the rounded part.
    pub facet: usize,
}

/// Over how many diameters the edges between facets are worn round.
const WORN: f64 = 0.03;

/// The look of a place on the surface of a rock; detail finer than `detail_m` is left out.
pub(super) fn at(
    key: u64,
    colours: &Colours,
    rock: &Rock,
    index: usize,
    place: Vector3<f64>,
    detail_m: f64,
) -> Look {
    let local = (place - rock.place.xyz) / rock.diameter_m;
    let (face, facet) = worn_normal(rock, local);
    let bits = lattice(key, i64::try_from(index).unwrap_or(0), 77);
    let rock_key = key ^ bits;
    let (mut relief, mut mottle) = (Vector3::zeros(), 0.0);
    let p = local * rock.diameter_m;
    for (layer, scale, steep, depth) in [
        (0u64, 0.22 * rock.diameter_m, 0.16, 0.10),
        (3, 0.08 * rock.diameter_m, 0.20, 0.10),
        (6, 0.02, 0.22, 0.12),
        (9, 0.007, 0.22, 0.12),
    ] {
        if scale > 2.0 * detail_m {
            let (value, gradient) = solid_noise(rock_key.wrapping_add(layer), p / scale, face);
            relief += gradient * steep;
            mottle += value * depth;
        }
    }
    // The relief turns the normal, but never out of the body's own surface.
    let relief = relief - face * relief.dot(&face);
    let normal = (face - relief).normalize();
    let tone = share(bits, 0);
    let base = mix(colours.rock_dark, colours.rock_pale, tone * tone * 1.1);
    // Dust lies on what is level and low.
    let level = ((normal.z - 0.55) / 0.45).max(0.0);
    let low = (1.0 - local.z / (0.3 * rock.shape.top)).max(0.0);
    let dusty = (0.30 * level + 0.35 * low) * (0.6 + 0.8 * share(bits, 1));
    Look {
        albedo: mix(base * (1.0 + mottle), colours.dust, dusty),
        normal,
        face,
        facet,
    }
}

/// The colour of a pebble.
pub(super) fn pebble_albedo(colours: &Colours, bits: u64) -> Colour {
    let tone = share(bits.rotate_left(17), 0);
    let stone = mix(colours.rock_dark, colours.rock_pale, 0.25 + 0.9 * tone);
    mix(stone, colours.dust, 0.25)
}

/// The normal of a body whose edges are worn, at a place on its surface in diameters, and the facet
/// it lies nearest to.
fn worn_normal(rock: &Rock, local: Vector3<f64>) -> (Vector3<f64>, usize) {
    let shape = &rock.shape;
    let [cos, sin] = shape.long_axis;
    let a = shape.half_axes;
    let q = Vector3::new(
        local.x * cos + local.y * sin,
        local.y * cos - local.x * sin,
        local.z,
    );
    let g = q.component_div(&a).component_div(&a);
    let outward = Vector3::new(g.x * cos - g.y * sin, g.x * sin + g.y * cos, g.z);
    // Distance inside the ellipsoid's surface, to first order.
    let inside = (1.0 - q.component_div(&a).norm_squared()) / (2.0 * outward.norm().max(1e-9));
    let mut nearest = (inside, 0);
    let mut sum = outward.normalize() * (-inside.max(0.0) / WORN).exp();
    for (i, &(normal, distance)) in shape.facets.iter().enumerate() {
        let inside = distance - normal.dot(&local);
        sum += normal * (-inside.max(0.0) / WORN).exp();
        if inside < nearest.0 {
            nearest = (inside, i + 1);
        }
    }
    (sum.normalize(), nearest.1)
}

/// Noise over a body: the three planes of its axes, each as far as the face looks along its normal.
fn solid_noise(key: u64, p: Vector3<f64>, face: Vector3<f64>) -> (f64, Vector3<f64>) {
    let w = face.component_mul(&face);
    let (xy, by_xy) = value_noise(key, p.x, p.y);
    let (yz, by_yz) = value_noise(key.wrapping_add(1), p.y, p.z);
    let (zx, by_zx) = value_noise(key.wrapping_add(2), p.z, p.x);
    let gradient = Vector3::new(by_xy[0], by_xy[1], 0.0) * w.z
        + Vector3::new(0.0, by_yz[0], by_yz[1]) * w.x
        + Vector3::new(by_zx[1], 0.0, by_zx[0]) * w.y;
    (xy * w.z + yz * w.x + zx * w.y, gradient)
}
