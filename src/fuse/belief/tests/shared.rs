//! Errors that views share: biases of sensors, errors of poses that fade slowly or drift.

use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use crate::adjust::{LevelPlane, Measurement, Problem, Reading};
use crate::camera::PanTilt;
use crate::detection::Cut;
use crate::frame::{Point, RigidTransform, Rotation, Vector};
use crate::fuse::belief::{Belief, BeliefSettings, BiasOf, fuse_belief};
use crate::pose::{Pose, PoseSigma};
use crate::project::Range;
use crate::view::View;

const SIGMA_BEARING: f64 = 0.01;
const SIGMA_RANGE_M: f64 = 0.1;
/// East, north and heading.
const SIGMA_POSE: [f64; 3] = [0.1, 0.1, 0.03];
/// Ways between views, metres.
const STEP_M: f64 = 0.7;
const RADIUS_M: f64 = 4.0;

/// What errs more than is stated.
#[derive(Clone, Copy, Default)]
struct Wrong {
    /// How much of the errors of a pose is left at the next.
    left: f64,
    bearing: f64,
    range_share: f64,
}

/// Ten landmarks within and about the ring that a robot drives.
fn landmarks() -> Vec<Point<crate::frame::Enu>> {
    let at = |i: u32| {
        let (away, turn) = (
            if i.is_multiple_of(2) { 1.5 } else { 7.0 },
            0.63 * f64::from(i),
        );
        Point::new(away * turn.cos(), away * turn.sin(), 0.0)
    };
    (0..10).map(at).collect()
}

fn drive(n_views: u32, wrong: Wrong, seed: u64) -> (Vec<View>, Vec<Measurement>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = |sigma: f64| Normal::new(0.0, sigma).unwrap().sample(&mut random);
    let mut error = SIGMA_POSE.map(&mut noise);
    let (mut views, mut measurements) = (Vec::new(), Vec::new());
    for index in 0..n_views {
        let along = f64::from(index) * STEP_M / RADIUS_M;
        let (east_m, north_m) = (RADIUS_M * along.cos(), RADIUS_M * along.sin());
        let heading = along + std::f64::consts::FRAC_PI_2;
        for landmark in landmarks() {
            let (e, n) = (landmark.xyz.x - east_m, landmark.xyz.y - north_m);
            let range_m = e.hypot(n) * (1.0 + wrong.range_share) + noise(SIGMA_RANGE_M);
            measurements.push(Measurement {
                view: views.len(),
                reading: Reading::Bearing {
                    bearing: heading - n.atan2(e) + wrong.bearing + noise(SIGMA_BEARING),
                    is_azimuth: false,
                    sigma: SIGMA_BEARING,
                    range: Range {
                        range_m,
                        sigma_m: SIGMA_RANGE_M,
                    },
                },
                log_size: None,
                bounds: None,
                cut: Cut::NONE,
                class: 0,
                score: None,
            });
        }
        views.push(View {
            image_id: format!("view{index}"),
            listed: ("poses.csv".into(), 1),
            time: None,
            platform: None,
            picture: None,
            camera: None,
            head: PanTilt::default(),
            pose: Pose {
                enu_from_body: RigidTransform::new(
                    Rotation::from_unit_quaternion(UnitQuaternion::from_euler_angles(
                        0.0,
                        0.0,
                        heading + error[2],
                    )),
                    Vector::new(east_m + error[0], north_m + error[1], 0.0),
                ),
                sigma: PoseSigma::from_vector(
                    [SIGMA_POSE[0], SIGMA_POSE[1], 0.0, 0.0, 0.0, SIGMA_POSE[2]].into(),
                ),
                has_heading: true,
            },
            enu_from_local: Rotation::identity(),
        });
        let fresh = (1.0 - wrong.left * wrong.left).sqrt();
        for (e, sigma) in error.iter_mut().zip(SIGMA_POSE) {
            *e = wrong.left * *e + fresh * noise(sigma);
        }
    }
    (views, measurements)
}

fn fused(n_views: u32, wrong: Wrong, seed: u64) -> Belief {
    let (views, measurements) = drive(n_views, wrong, seed);
    let problem = Problem {
        views: &views,
        measurements: &measurements,
        surface: &LevelPlane::default(),
        height_sigma_m: 0.01,
        max_range_m: 20.0,
        min_range_m: 0.0,
    };
    fuse_belief(&problem, &BeliefSettings::default())
}

/// Squared Mahalanobis distances of the places in the plane over their dimension, in the mean, and
/// the mean variance.
fn nees(belief: &Belief) -> (f64, f64) {
    let real: Vec<_> = belief.objects.iter().filter(|o| o.p_exist > 0.5).collect();
    let all = landmarks();
    assert_eq!(real.len(), all.len());
    let (mut nees, mut variance) = (0.0, 0.0);
    for landmark in &all {
        let nearest = real.iter().min_by(|a, b| {
            let far = |o: &crate::fuse::belief::BeliefObject| o.place.distance(*landmark);
            far(a).total_cmp(&far(b))
        });
        let object = nearest.unwrap();
        let off = (object.place.xyz - landmark.xyz).xy();
        let cov = object.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        nees += off.dot(&(cov.try_inverse().unwrap() * off)) / 2.0;
        variance += cov.trace() / 2.0;
    }
    (nees / all.len() as f64, variance / all.len() as f64)
}

#[test]
fn independent_errors_stay_so() {
    for (n_views, seed) in [(150, 1), (150, 2), (50, 3), (50, 4)] {
        let belief = fused(n_views, Wrong::default(), seed);
        let evidence = &belief.evidence;
        assert!(evidence.drift.is_none() && evidence.biases.is_empty());
        assert!(evidence.repetition.design_effect < 1.3);
        assert!(nees(&belief).0 < 3.0);
    }
}

#[test]
fn biases_are_found_and_taken_out() {
    let wrong = Wrong {
        bearing: 0.05,
        range_share: -0.03,
        ..Wrong::default()
    };
    for seed in [1, 2] {
        let belief = fused(150, wrong, seed);
        let biases = &belief.evidence.biases;
        for (of, truth) in [(BiasOf::Bearing, 0.05), (BiasOf::RangeScale, -0.03)] {
            let bias = biases.iter().find(|b| b.of == of).expect("a bias");
            assert!((bias.value - truth).abs() < 3.0 * bias.sigma, "{bias:?}");
            assert!(bias.sigma < 0.2 * truth.abs(), "{bias:?}");
        }
        assert!(nees(&belief).0 < 3.0);
    }
}

/// With many views and few objects, views count for fewer.
#[test]
fn errors_that_fade_slowly_widen_covariances() {
    let wrong = Wrong {
        left: 0.8,
        ..Wrong::default()
    };
    let (mut sum, mut variance, mut independent) = (0.0, 0.0, 0.0);
    for seed in 1..5 {
        let belief = fused(150, wrong, seed);
        let effect = belief.evidence.repetition.design_effect;
        assert!(belief.evidence.drift.is_none());
        assert!((2.0..12.0).contains(&effect), "{effect}");
        let (off, of) = nees(&belief);
        sum += off;
        variance += of;
        independent += nees(&fused(150, Wrong::default(), seed)).1;
    }
    assert!(sum / 4.0 < 3.0, "{sum}");
    assert!(variance > 2.0 * independent);
}

/// With few views, poses are taken to drift.
#[test]
fn drift_is_found() {
    let wrong = Wrong {
        left: 0.95,
        ..Wrong::default()
    };
    let mut sum = 0.0;
    for seed in 1..5 {
        let belief = fused(50, wrong, seed);
        let drift = belief.evidence.drift.expect("drift");
        assert!(drift.share > 0.7 && drift.length_m > 4.0, "{drift:?}");
        sum += nees(&belief).0;
    }
    assert!(sum / 4.0 < 3.0, "{sum}");
}
