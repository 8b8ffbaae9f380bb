//! Randomness that depends on the scene's seed and its purpose alone, so that a new use of it
//! changes none of the others.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What a stream of random numbers is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Number, places and sizes of the rocks.
    Rocks = 1,
    /// The shape of one rock.
    Shape = 2,
    /// The pose errors of one platform that follow its stations.
    Drift = 3,
    /// The pose errors of one platform that are new with every view.
    Jitter = 4,
    /// The detector in one image.
    Detector = 5,
    /// False alarms in one image.
    Clutter = 6,
    /// The true ground.
    Ground = 7,
    /// The error of the terrain model.
    TerrainModel = 8,
    /// How far each rock's ground deviates from the true ground's smooth shape.
    Deviation = 9,
    /// Colours, pebbles and grains of the rendered ground.
    Texture = 10,
}

/// The stream of a purpose; `index` tells apart the images, rocks or platforms it serves.
pub(super) fn stream(seed: u64, purpose: Purpose, index: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(((purpose as u64) << 40) | index as u64);
    rng
}

/// A key for the lattice noise of [`lattice`].
pub(super) fn key(seed: u64, purpose: Purpose) -> u64 {
    stream(seed, purpose, 0).random()
}

/// A standard normal number.
pub(super) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// A number from 0 to 1, 1 excluded.
pub(super) fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    rng.random::<f64>()
}

/// 64 well-mixed bits of a lattice point: the finaliser of `SplitMix64` (Steele, Lea and Flood,
/// Fast splittable pseudorandom number generators, 2014) over the coordinates.
#[expect(clippy::cast_sign_loss, reason = "the bits alone matter")]
pub(super) fn lattice(key: u64, x: i64, y: i64) -> u64 {
    let mut z = key
        ^ (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The `part`-th of three 21-bit shares of 64 bits as a number from 0 to 1, 1 excluded.
pub(super) fn share(bits: u64, part: u32) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "21 bits fit")]
    let cut = ((bits >> (21 * part)) & 0x1f_ffff) as f64;
    cut / 2_097_152.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_purpose_and_index_and_repeat() {
        let first = |purpose, index| stream(7, purpose, index).random::<u64>();
        assert_eq!(first(Purpose::Rocks, 0), first(Purpose::Rocks, 0));
        assert_ne!(first(Purpose::Rocks, 0), first(Purpose::Rocks, 1));
        assert_ne!(first(Purpose::Rocks, 0), first(Purpose::Shape, 0));
    }

    #[test]
    fn lattice_shares_are_uniform() {
        let mut sum = [0.0; 3];
        let mut squares = [0.0; 3];
        for x in -50..50 {
            for y in -50..50 {
                let bits = lattice(1, x, y);
                for part in 0..3 {
                    let s = share(bits, part);
                    sum[part as usize] += s / 1e4;
                    squares[part as usize] += s * s / 1e4;
                }
            }
        }
        for part in 0..3 {
            assert!((sum[part] - 0.5).abs() < 4.0 * (1.0 / 12e4f64).sqrt());
            assert!((squares[part] - 1.0 / 3.0).abs() < 0.012);
        }
    }
}
