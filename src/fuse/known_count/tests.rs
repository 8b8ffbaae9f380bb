use nalgebra::{Matrix3, Rotation2};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;

fn observation(view: usize, x: f64, y: f64, covariance: Matrix3<f64>) -> Observation {
    Observation {
        view,
        class: 7,
        place: Point::new(x, y, 3.0),
        covariance,
    }
}

fn round(width: f64) -> Matrix3<f64> {
    Matrix3::identity() * width.powi(2)
}

/// Objects in a row, `spacing` apart, seen by views in shuffled order; and the observations of each
/// object.
fn row(
    (n_objects, n_views): (usize, usize),
    spacing: f64,
    width: f64,
    seed: u64,
) -> (Vec<Observation>, Vec<Vec<usize>>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut seen = Vec::new();
    let mut labels = vec![Vec::new(); n_objects];
    let number = |n: usize| f64::from(u32::try_from(n).unwrap());
    for view in 0..n_views {
        let mut of_view: Vec<(usize, Observation)> = (0..n_objects)
            .map(|k| {
                let mut normal = || random.sample::<f64, _>(StandardNormal) * width;
                let (x, y) = (spacing * number(k) + normal(), normal());
                (k, observation(view, x, y, round(width)))
            })
            .collect();
        of_view.shuffle(&mut random);
        for (k, observation) in of_view {
            labels[k].push(seen.len());
            seen.push(observation);
        }
    }
    (seen, labels)
}

fn means(seen: &[Observation], labels: &[Vec<usize>]) -> Vec<Vector2<f64>> {
    let mean = |of: &Vec<usize>| {
        let places = of.iter().map(|&i| seen[i].place.xyz.xy());
        places.sum::<Vector2<f64>>() / f64::from(u32::try_from(of.len()).unwrap())
    };
    labels.iter().map(mean).collect()
}

#[test]
fn nothing_gives_an_empty_map() {
    let fusion = fuse_known_count(&[], &KnownCount::new(3));
    assert!(fusion.objects.is_empty() && fusion.solver.is_empty());
    let seen = [observation(0, 0.0, 0.0, round(0.1))];
    assert!(
        fuse_known_count(&seen, &KnownCount::new(0))
            .objects
            .is_empty()
    );
}

#[test]
fn a_single_view_is_its_own_map() {
    let (seen, _) = row((5, 1), 0.1, 0.3, 1);
    let fusion = fuse_known_count(&seen, &KnownCount::new(5));
    assert_eq!(fusion.objects.len(), 5);
    for (object, seen) in fusion.objects.iter().zip(&seen) {
        assert!((object.place.xyz - seen.place.xyz).norm() < 1e-12);
        assert!((object.covariance - seen.covariance).norm() < 1e-9);
        assert_eq!((object.class, object.members.len()), (7, 1));
    }
}

#[test]
fn objects_apart_are_the_means_of_their_observations() {
    let (seen, labels) = row((6, 5), 2.0, 0.1, 2);
    let fusion = fuse_known_count(&seen, &KnownCount::new(6));
    assert_eq!(fusion.objects.len(), 6);
    for mean in &means(&seen, &labels) {
        let nearest = fusion.objects.iter().min_by(|a, b| {
            let off = |o: &Object| (o.place.xyz.xy() - mean).norm();
            off(a).total_cmp(&off(b))
        });
        let object = nearest.unwrap();
        assert!((object.place.xyz.xy() - mean).norm() < 1e-6);
        assert!((object.weight - 5.0).abs() < 1e-6);
        // Five independent errors of 0.1.
        assert!((object.covariance - round(0.1) / 5.0).norm() < 1e-6);
        assert!((object.place.xyz.z - 3.0).abs() < 1e-12);
    }
    let solver = &fusion.solver[0];
    assert!(solver.converged && solver.stopped == Stopped::NothingMoved);
    assert!(solver.log_likelihood.is_sorted());
}

/// Two objects 1.5 widths apart: every detection alone would do for both. That a view does not
/// detect an object twice tells them apart; their distance by mixtures shrinks to nothing.
#[test]
fn exclusivity_tells_close_objects_apart() {
    let mut distance = 0.0;
    for seed in 0..20 {
        let (seen, _) = row((2, 8), 0.3, 0.2, seed);
        let fusion = fuse_known_count(&seen, &KnownCount::new(2));
        let [a, b] = &fusion.objects[..] else {
            panic!("two objects");
        };
        distance += (a.place.xyz - b.place.xyz).norm() / 20.0;
        for object in [a, b] {
            for of_view in object
                .members
                .chunk_by(|a, b| a.observation / 2 == b.observation / 2)
            {
                assert!(of_view.iter().map(|m| m.weight).sum::<f64>() < 1.0 + 1e-3);
            }
        }
    }
    // Assignments chosen to fit hold them a little farther apart than they are, 0.3.
    assert!((0.25..0.45).contains(&distance), "{distance}");
}

/// The best whole assignment, by trying all of them, is what the search finds.
#[test]
fn the_search_finds_the_best_assignment() {
    let orders: [[usize; 4]; 24] = permutations();
    for seed in 0..10 {
        let (seen, _) = row((4, 3), 0.5, 0.3, 100 + seed);
        let settings = KnownCount::new(4);
        let views = Views::new(&seen, &settings);
        let mut best = f64::NEG_INFINITY;
        for second in &orders {
            for third in &orders {
                let together =
                    |k: usize| views.log_odds_together(&[k, 4 + second[k], 8 + third[k]]);
                best = best.max((0..4).map(together).sum());
            }
        }
        let fusion = fuse_known_count(&seen, &settings);
        let found = *fusion.solver[0].log_likelihood.last().unwrap();
        assert!((found - best).abs() < 1e-9, "{seed}: {found} {best}");
    }
}

/// Where neighbours overlap the true assignment is seldom the one that fits best. What is found
/// fits no worse: it is not the search that keeps the method from the truth.
#[test]
fn what_is_found_fits_no_worse_than_the_truth() {
    let settings = KnownCount::new(12);
    let mut better = 0;
    for seed in 0..30 {
        let (seen, labels) = row((12, 4), 0.5, 0.2, 200 + seed);
        let views = Views::new(&seen, &settings);
        let truth: f64 = labels.iter().map(|of| views.log_odds_together(of)).sum();
        let fusion = fuse_known_count(&seen, &settings);
        let found = *fusion.solver[0].log_likelihood.last().unwrap();
        assert!(found >= truth - 1e-9, "{seed}: {found} {truth}");
        better += usize::from(found > truth + 1e-9);
    }
    assert!(better > 20, "{better}");
}

fn permutations() -> [[usize; 4]; 24] {
    let mut all = [[0; 4]; 24];
    let mut at = 0;
    for code in 0..256 {
        let order = [code % 4, code / 4 % 4, code / 16 % 4, code / 64];
        if (0..4).all(|k| order.contains(&k)) {
            all[at] = order;
            at += 1;
        }
    }
    all
}

/// Elongated errors: the place is the mean weighted by inverse covariances.
#[test]
fn covariances_weigh() {
    let along = |angle: f64| {
        let turn = Rotation2::new(angle).matrix().to_owned();
        let flat = turn * Matrix2::new(1.0, 0.0, 0.0, 0.0001) * turn.transpose();
        let mut full = Matrix3::identity();
        full.fixed_view_mut::<2, 2>(0, 0).copy_from(&flat);
        full
    };
    // One view knows x to 1 cm, the other y.
    let seen = [
        observation(0, 0.0, 0.9, along(std::f64::consts::FRAC_PI_2)),
        observation(1, 0.7, 0.0, along(0.0)),
    ];
    let fusion = fuse_known_count(&seen, &KnownCount::new(1));
    assert_eq!(fusion.objects.len(), 1);
    let object = &fusion.objects[0];
    assert!(object.place.xyz.xy().norm() < 1e-3);
    // 1 / (1 + 1 / 0.0001) along either axis; the heights average.
    let expected = [1.0 / 10_001.0, 1.0 / 10_001.0, 0.5];
    for (axis, expected) in expected.into_iter().enumerate() {
        assert!((object.covariance[(axis, axis)] / expected - 1.0).abs() < 1e-6);
    }
}

#[test]
fn clutter_is_left_out_and_misses_are_borne() {
    let (mut seen, labels) = row((4, 5), 2.0, 0.1, 3);
    let means = means(&seen, &labels);
    // One view misses an object, another sees something where nothing is.
    let missed = seen.iter().position(|o| o.view == 2).unwrap();
    seen.remove(missed);
    seen.push(observation(4, 3.0, 9.0, round(0.1)));
    let settings = KnownCount {
        p_detect: 0.9,
        clutter_per_m2: 0.01,
        ..KnownCount::new(4)
    };
    let fusion = fuse_known_count(&seen, &settings);
    assert_eq!(fusion.objects.len(), 4);
    let last = seen.len() - 1;
    for object in &fusion.objects {
        assert!(object.members.iter().all(|m| m.observation != last));
        let nearest = means.iter().map(|m| (object.place.xyz.xy() - m).norm());
        assert!(nearest.fold(f64::INFINITY, f64::min) < 0.2);
    }
    let weights: f64 = fusion.objects.iter().map(|o| o.weight).sum();
    // What is missing is the small chance that true detections are clutter.
    assert!((weights - 19.0).abs() < 0.01, "{weights}");
}

/// Nothing is certain or impossible enough to break the search: no misses, no clutter, no errors.
#[test]
fn certainties_are_borne() {
    let (mut seen, _) = row((4, 4), 1.0, 0.2, 4);
    for observation in &mut seen {
        if observation.view == 1 {
            observation.covariance = Matrix3::zeros();
        }
    }
    let settings = KnownCount {
        p_detect: 1.0,
        clutter_per_m2: 0.0,
        ..KnownCount::new(4)
    };
    let fusion = fuse_known_count(&seen, &settings);
    assert_eq!(fusion.objects.len(), 4);
    for object in &fusion.objects {
        let exact = |m: &Member| seen[m.observation].view == 1;
        let exact = object.members.iter().find(|m| exact(m)).unwrap();
        let place = seen[exact.observation].place.xyz;
        assert!((object.place.xyz - place).xy().norm() < 1e-6);
    }
}

/// One view has two candidates, alike far to either side: the object stays in the middle, and its
/// covariance has their spread.
#[test]
fn open_memberships_widen_the_covariance() {
    let seen = [
        observation(0, 0.0, 0.0, round(0.1)),
        observation(1, 0.2, 0.0, round(0.1)),
        observation(1, -0.2, 0.0, round(0.1)),
    ];
    let fusion = fuse_known_count(&seen, &KnownCount::new(1));
    let object = &fusion.objects[0];
    assert!(object.place.xyz.xy().norm() < 1e-9);
    assert!((object.weight - 2.0).abs() < 1e-6);
    // Of the mean of two errors of 0.1; half of the second pulls by 0.2 either way.
    assert!((object.covariance[(0, 0)] - (0.01 / 2.0 + 0.2 * 0.2 / 4.0)).abs() < 1e-6);
    assert!((object.covariance[(1, 1)] - 0.01 / 2.0).abs() < 1e-6);
}

#[test]
fn starts_take_every_view_once() {
    assert_eq!(orders(2), [[0, 1], [1, 0]]);
    let expected = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [1, 0, 2],
        [2, 1, 0],
    ];
    assert_eq!(orders(3), expected);
    let many = orders(21);
    assert_eq!(many.len(), 16);
    for mut order in many {
        order.sort_unstable();
        assert!(order.into_iter().eq(0..21));
    }
}
