use super::*;

const SEED: u64 = 11;

fn circle(noise: f64, n_views: usize) -> Circle {
    Circle {
        n_objects: 12,
        n_views,
        noise,
    }
}

#[test]
fn the_papers_score_by_hand() {
    let at = |x: f64| Vector2::new(x, 0.0);
    let trial = Trial {
        objects: vec![at(0.0), at(1.0), at(5.0)],
        views: Vec::new(),
        labels: Vec::new(),
    };
    // The first object takes 0.6, although the second lies nearer to it and is left with -1.
    assert!((trial.error(&[at(-1.0), at(0.6), at(5.5)]) - (0.36 + 4.0 + 0.25)).abs() < 1e-12);
    // Two estimates for three objects: the last in the list goes without.
    assert!((trial.error(&[at(0.0), at(1.5)]) - (0.25 + 1.0)).abs() < 1e-12);
    assert!((trial.error(&[]) - 3.0).abs() < 1e-12);
    // The best pairing gives the second object 0.6, and the first one nothing nearer than one.
    assert!(
        (trial.paired_error(&[at(-1.5), at(0.6), at(5.5)]) - (1.0 + 0.16 + 0.25)).abs() < 1e-12
    );
    assert!((trial.paired_error(&[at(0.0), at(1.5)]) - (0.25 + 1.0)).abs() < 1e-12);
    assert!((trial.paired_error(&[]) - 3.0).abs() < 1e-12);
}

#[test]
fn trials_repeat_and_nest() {
    let trial = circle(0.1, 4).trial(SEED, 3);
    assert_eq!(trial, circle(0.1, 4).trial(SEED, 3));
    assert_ne!(trial.views, circle(0.1, 4).trial(SEED, 4).views);
    assert_eq!(circle(0.1, 2).trial(SEED, 3).views, trial.views[..2]);
    assert!((trial.objects[3] - Vector2::new(0.0, 1.0)).norm() < 1e-12);
}

/// The errors of methods, by method and trial.
fn errors(circle: Circle, methods: &[CircleMethod], n_trials: usize) -> Vec<Vec<f64>> {
    let scores = circle.scores(methods, n_trials, SEED).into_iter();
    let errors = scores.map(|of| of.iter().map(|s| s.error).collect());
    errors.collect()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = count(values.len());
    values.sum::<f64>() / n
}

#[test]
fn without_noise_every_method_is_right() {
    let errors = errors(circle(1e-6, 4), &CircleMethod::ALL, 5);
    assert!(errors.iter().flatten().all(|e| *e < 1e-10), "{errors:?}");
}

#[test]
fn small_noise_reaches_the_bound() {
    // At noise 0.05 neighbours are ten standard deviations apart: all methods average right.
    let circle = circle(0.05, 4);
    let methods = [CircleMethod::Em, CircleMethod::Paper, CircleMethod::Belief];
    for errors in errors(circle, &methods, 200) {
        let mean = mean(errors.into_iter());
        // 24 squared normal errors a trial: relative standard error sqrt(2 / 24 / 200).
        assert!((mean / circle.bound() - 1.0).abs() < 3.0 * 0.0204, "{mean}");
    }
}

/// Means of detections whose objects are known have the error of the bound, whichever way objects
/// and estimates are paired: at 0.1 no object lies nearer to a neighbour's estimate.
#[test]
fn known_associations_reach_the_bound() {
    let circle = circle(0.10, 3);
    let scores = &circle.scores(&[CircleMethod::Oracle], 500, SEED)[0];
    assert!(scores.iter().all(|s| (s.error - s.paired).abs() < 1e-12));
    let mean = mean(scores.iter().map(|s| s.error));
    // Relative standard error sqrt(2 / 24 / 500).
    assert!((mean / circle.bound() - 1.0).abs() < 3.0 * 0.0129, "{mean}");
}

#[test]
fn belief_comes_near_known_associations() {
    // Objects paired with estimates as well as can be; the ratio to known associations in the same
    // trials is 1.03 at noise 0.15 and 1.15 at 0.20 over 400 trials.
    for (noise, most) in [(0.10, 1.01), (0.15, 1.06), (0.20, 1.22)] {
        let methods = [CircleMethod::Belief, CircleMethod::Oracle];
        let scores = circle(noise, 4).scores(&methods, 50, SEED);
        let [belief, oracle] = [0, 1].map(|m| mean(scores[m].iter().map(|s: &Score| s.paired)));
        let ratio = belief / oracle;
        assert!((0.99..most).contains(&ratio), "{noise}: {ratio}");
    }
}

/// Means over 50 trials of an independent program (numpy, dense equations) with its own random
/// numbers, within two standard errors of the difference.
#[test]
fn means_agree_with_an_independent_program() {
    use crate::experiment::statistics::{Mean, SignTest};
    for (noise, em, paper) in [(0.10, 0.066, 0.064), (0.15, 0.67, 0.40), (0.20, 1.54, 1.12)] {
        let methods = [CircleMethod::Em, CircleMethod::Paper];
        let errors = errors(circle(noise, 4), &methods, 50);
        for (errors, expected) in errors.iter().zip([em, paper]) {
            let mean = Mean::of(errors).unwrap();
            let two = 2.0 * std::f64::consts::SQRT_2 * mean.standard_error.unwrap();
            assert!((mean.mean - expected).abs() < two, "{noise}: {mean:?}");
        }
        if noise == 0.15 {
            let test = SignTest::of(&errors[1], &errors[0], 1e-12);
            assert!(test.wins >= 38, "{test:?}");
        }
    }
}
