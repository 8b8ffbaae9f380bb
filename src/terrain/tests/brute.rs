//! Rays against a slow march with exact evaluations, which never steps farther than the ground can
//! rise.

use super::super::{Shape, constant};
use super::{ray, site, terrain, utm_grid};
use crate::frame::{Enu, Point, Ray};
use crate::terrain::{Affine, HeightGrid, Miss, Posts, Terrain};

/// Numbers in [0, 1): splitmix64, so that the rays never change.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Height above the known ground, if it is known.
fn above(terrain: &Terrain, ray: Ray<Enu>, t: f64) -> (f64, Option<f64>) {
    let Shape::Model(model) = &terrain.shape else {
        panic!("a model");
    };
    let place = site().geodetic(ray.at(t));
    let surface = model.surface(place);
    (
        place.height_m,
        surface.map(|surface| place.height_m - surface.height_m()),
    )
}

/// The rule of unknown ground: how high a ray must be to pass.
fn ceiling(terrain: &Terrain, ray: Ray<Enu>, t: f64) -> f64 {
    let Shape::Model(model) = &terrain.shape else {
        panic!("a model");
    };
    let place = site().geodetic(ray.at(t));
    let in_holes = model.tiles.iter().filter_map(|tile| {
        let [column, row] = tile.cell(tile.position(place)?)?;
        tile.holes.ceiling_m(column, row)
    });
    in_holes.reduce(f64::max).unwrap_or(model.top_m)
}

/// The first hit by definition, in steps of at most `longest` metres.
fn march(terrain: &Terrain, ray: Ray<Enu>, range: f64, longest: f64) -> Result<f64, Miss> {
    let Shape::Model(model) = &terrain.shape else {
        panic!("a model");
    };
    let steepest = model
        .tiles
        .iter()
        .map(|tile| tile.step_m)
        .fold(0.0, f64::max);
    let direction = ray.direction.xyz();
    let far = range / direction.xy().norm();
    // A ray that never comes to known ground is judged where it leaves the rasters for good.
    let bounds = model.within_bounds(ray.origin, [direction.x, direction.y]);
    let leave = bounds.map_or(0.0, |(_, leave)| leave);
    let (mut t, mut before) = (0.0f64, 0.0f64);
    let (mut known, mut started) = (false, false);
    loop {
        let (height, over) = above(terrain, ray, t);
        let rises = site().up(site().geodetic(ray.at(t))).xyz().dot(&direction) > 0.0;
        if !known
            && over.is_none()
            && height <= model.top_m
            && (t > far || height < model.bottom_m || t > leave)
        {
            return Err(if rises {
                Miss::AboveHorizon
            } else {
                Miss::OffTerrain
            });
        }
        if t > far {
            // Beyond all rasters the height outside is all that can be met.
            let left = model
                .within_bounds(ray.origin, [direction.x, direction.y])
                .is_none_or(|(_, leave)| leave < far);
            let highest = model.outside_m.filter(|_| left).unwrap_or(model.top_m);
            let later = constant::first_not_above(&site(), ray, highest, far);
            return Err(if later.is_none() {
                Miss::AboveHorizon
            } else {
                Miss::TooFar
            });
        }
        let step = match over {
            Some(over) if over <= 0.0 => {
                return match (started, known) {
                    (false, _) => Err(Miss::UnderGround),
                    (true, false) => Err(Miss::OffTerrain),
                    _ => Ok(bisect(terrain, ray, before, t)),
                };
            }
            Some(over) => {
                known = true;
                over / (1.0 + 1.5 * steepest)
            }
            None => {
                if known && height <= ceiling(terrain, ray, t) {
                    return Err(Miss::OffTerrain);
                }
                1e-2
            }
        };
        if height > model.top_m && rises {
            return Err(Miss::AboveHorizon);
        }
        started = true;
        before = t;
        t += step.clamp(1e-4, longest);
    }
}

fn bisect(terrain: &Terrain, ray: Ray<Enu>, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if above(terrain, ray, middle)
            .1
            .is_some_and(|over| over <= 0.0)
        {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Compares many rays; the march is repeated in finer steps where it may have stepped over a hit.
fn compare(
    terrain: &Terrain,
    rays: impl Iterator<Item = (Ray<Enu>, f64)>,
    longest: f64,
) -> [usize; 5] {
    let mut counts = [0; 5];
    for (number, (ray, range)) in rays.enumerate() {
        let found = terrain.first_hit(ray, range).map(|hit| hit.distance_m);
        let mut expected = march(terrain, ray, range, longest);
        if !agree(terrain, ray, found, expected) {
            // A corner of a ridge or of a hole that the march cut.
            expected = march(terrain, ray, range, 1e-4);
        }
        let real = agree(terrain, ray, found, expected);
        assert!(
            real,
            "ray {number} {ray:?} within {range}: found {found:?}, expected {expected:?}"
        );
        counts[match found {
            Ok(_) => 0,
            Err(Miss::AboveHorizon) => 1,
            Err(Miss::TooFar) => 2,
            Err(Miss::OffTerrain) => 3,
            Err(Miss::UnderGround) => 4,
        }] += 1;
    }
    counts
}

fn agree(
    terrain: &Terrain,
    ray: Ray<Enu>,
    found: Result<f64, Miss>,
    expected: Result<f64, Miss>,
) -> bool {
    match (found, expected) {
        // Along a surface that a ray grazes, rounding of 1e-9 m in the height moves the hit.
        (Ok(a), Ok(b)) => {
            (a - b).abs() < 1e-6
                || ((a - b).abs() < 1e-3
                    && above(terrain, ray, a)
                        .1
                        .is_some_and(|over| over.abs() < 1e-8))
                || (a < b && met(terrain, ray, a))
        }
        // The march has stepped over the tip of a ridge or the corner of a wall: the hit before
        // where it ended is one by exact evaluation.
        (Ok(a), Err(Miss::OffTerrain | Miss::TooFar | Miss::AboveHorizon)) => met(terrain, ray, a),
        (a, b) => a == b,
    }
}

/// Whether the ray goes under the ground at `t`, by exact evaluation.
fn met(terrain: &Terrain, ray: Ray<Enu>, t: f64) -> bool {
    let over = |t: f64| above(terrain, ray, t).1;
    over(t - 1e-7).is_none_or(|over| over > 0.0) && over(t + 1e-7).is_some_and(|over| over <= 0.0)
}

/// Ridges, saw teeth, a wall of 3 m in one cell and a pit.
fn rugged(x: f64, y: f64) -> f64 {
    let waves = 1.2 * (x / 6.0).sin() * (y / 5.0).cos() + 0.25 * (1.7 * x + 0.6 * y).sin();
    let teeth = if y > 20.0 {
        0.5 * (x / 3.0).rem_euclid(1.0)
    } else {
        0.0
    };
    let wall = if (18.0..=21.0).contains(&x) { 3.0 } else { 0.0 };
    let pit = if (x + 25.0).hypot(y + 20.0) < 5.0 {
        -2.0
    } else {
        0.0
    };
    115.0 + waves + teeth + wall + pit
}

/// Rays from a little above the ground, from the air and from below it, all directions, many of
/// them grazing.
fn rays(terrain: &Terrain, count: usize, seed: u64, half: f64) -> Vec<(Ray<Enu>, f64)> {
    let mut random = Random(seed);
    (0..count)
        .map(|number| {
            let (east, north) = (random.between(-half, half), random.between(-half, half));
            let ground = terrain
                .ground_at(east, north)
                .map_or(0.0, |ground| ground.point.xyz.z);
            let up = ground
                + match number % 8 {
                    0 => random.between(-0.2, 0.1),
                    1 => random.between(3.0, 40.0),
                    _ => random.between(0.1, 3.0),
                };
            let down_deg = match number % 3 {
                0 => random.between(-2.0, 3.0),
                1 => random.between(0.0, 25.0),
                _ => random.between(-10.0, 90.0),
            };
            let range = if number % 4 == 0 {
                f64::INFINITY
            } else {
                random.between(1.0, 40.0)
            };
            let azimuth_deg = match number % 10 {
                // Along the rows and columns of the raster, as near as can be.
                0 => 90.0 * (random.next() * 4.0).floor() + 0.4526,
                _ => random.between(0.0, 360.0),
            };
            (
                ray(Point::new(east, north, up), azimuth_deg, down_deg),
                range,
            )
        })
        .collect()
}

#[test]
fn rugged_ground_is_met_where_a_slow_march_meets_it() {
    let terrain = terrain(vec![utm_grid(81, 1.0, rugged)], None);
    let counts = compare(&terrain, rays(&terrain, 14_000, 1, 39.0).into_iter(), 1.0);
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

#[test]
fn coarse_posts_are_met_where_a_slow_march_meets_them() {
    let terrain = terrain(
        vec![utm_grid(21, 25.0, |x, y| rugged(x / 10.0, y / 10.0))],
        None,
    );
    let counts = compare(&terrain, rays(&terrain, 3000, 2, 240.0).into_iter(), 1.0);
    assert!(counts[0] > 500, "{counts:?}");
}

/// Rugged ground with a round hole, a ditch of unknown posts and specks.
fn holed(x: f64, y: f64) -> f64 {
    let hole = (x - 5.0).hypot(y - 5.0) < 4.0 || (x + 10.0).abs() < 1.5 && y.abs() < 12.0;
    let speck = (x.rem_euclid(17.0) - 3.0).abs() < 0.6 && (y.rem_euclid(13.0) - 3.0).abs() < 0.6;
    if hole || speck {
        f64::NAN
    } else {
        rugged(x, y)
    }
}

/// A hundred thousand rays over ridges, walls and holes; `make acceptance` runs it.
#[test]
#[ignore = "it takes a minute"]
fn a_hundred_thousand_rays_are_met_where_a_slow_march_meets_them() {
    let solid = terrain(vec![utm_grid(81, 1.0, rugged)], None);
    let with_holes = terrain(vec![utm_grid(81, 1.0, holed)], None);
    let with_ground_below = terrain(vec![utm_grid(81, 1.0, holed)], Some(114.0));
    let mut total = [0; 5];
    for (terrain, count, seed, half, longest) in [
        (&solid, 50_000, 11, 39.0, 1.0),
        (&with_holes, 25_000, 12, 45.0, 0.02),
        (&with_ground_below, 25_000, 13, 60.0, 0.02),
    ] {
        let rays = rays(terrain, count, seed, half);
        let counts = compare(terrain, rays.into_iter(), longest);
        for (all, one) in total.iter_mut().zip(counts) {
            *all += one;
        }
    }
    println!("hits, above the horizon, too far, off the model, under ground: {total:?}");
    assert_eq!(total.iter().sum::<usize>(), 100_000);
    assert!(total.iter().all(|&count| count > 1000), "{total:?}");
}

#[test]
fn holes_are_passed_where_the_rule_says_so() {
    let terrain = terrain(vec![utm_grid(81, 1.0, holed)], None);
    let counts = compare(&terrain, rays(&terrain, 3000, 3, 45.0).into_iter(), 0.02);
    assert!(counts.iter().all(|&count| count > 40), "{counts:?}");
}

#[test]
fn several_rasters_and_the_height_outside_are_one_surface() {
    let fine = utm_grid(61, 0.25, |x, y| {
        if x > y + 3.0 {
            f64::NAN
        } else {
            rugged(x, y) + 0.2
        }
    });
    let coarse = utm_grid(17, 2.0, |x, y| {
        if x.hypot(y - 9.0) < 4.0 {
            f64::NAN
        } else {
            rugged(x, y)
        }
    });
    let map = Affine {
        x0: 8.3997,
        x_column: 1.1e-5,
        x_row: 3e-6,
        y0: 49.0002,
        y_column: 2e-6,
        y_row: -8e-6,
    };
    let heights = (0..60 * 60u32)
        .map(|i| 115.0 + f64::from(i * 7919 % 13) * 0.05)
        .collect();
    let turned = HeightGrid::new(60, 60, Posts::F64(heights), map, "EPSG:4326").unwrap();
    let grids = vec![fine, coarse, turned];
    for (outside_m, seed) in [(Some(114.8), 4), (Some(115.6), 5)] {
        let terrain = terrain(grids.clone(), outside_m);
        let counts = compare(&terrain, rays(&terrain, 1500, seed, 30.0).into_iter(), 0.02);
        assert!(counts[0] > 300 && counts[3] == 0, "{counts:?}");
    }
    let terrain = terrain(grids, None);
    let counts = compare(&terrain, rays(&terrain, 1500, 6, 22.0).into_iter(), 0.02);
    assert!(counts[0] > 300, "{counts:?}");
}
