use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

struct Case {
    n_detections: usize,
    n_objects: usize,
    pairs: Vec<(u32, u32)>,
    odds: Vec<f64>,
}

impl Case {
    fn found(&self, solver: &mut Exclusive) -> Vec<f64> {
        let mut out = Vec::new();
        let (pairs, odds) = (&self.pairs, &self.odds);
        solver.marginals(self.n_detections, self.n_objects, pairs, odds, &mut out);
        out
    }

    /// The marginals by listing every assignment.
    fn enumerated(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.pairs.len()];
        let mut taken = vec![false; self.n_objects];
        let total = self.list(0, 1.0, &mut taken, &mut Vec::new(), &mut weights);
        weights.iter().map(|w| w / total).collect()
    }

    fn list(
        &self,
        detection: usize,
        weight: f64,
        taken: &mut [bool],
        chosen: &mut Vec<usize>,
        weights: &mut [f64],
    ) -> f64 {
        if detection == self.n_detections {
            for &pair in chosen.iter() {
                weights[pair] += weight;
            }
            return weight;
        }
        let mut total = self.list(detection + 1, weight, taken, chosen, weights);
        for (at, &(j, k)) in self.pairs.iter().enumerate() {
            if j as usize == detection && !taken[k as usize] {
                taken[k as usize] = true;
                chosen.push(at);
                let through = weight * self.odds[at];
                total += self.list(detection + 1, through, taken, chosen, weights);
                chosen.pop();
                taken[k as usize] = false;
            }
        }
        total
    }

    /// Sums of the marginals by detection and by object.
    fn sums(&self, marginals: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut rows = vec![0.0; self.n_detections];
        let mut columns = vec![0.0; self.n_objects];
        for (&(j, k), p) in self.pairs.iter().zip(marginals) {
            rows[j as usize] += p;
            columns[k as usize] += p;
        }
        (rows, columns)
    }
}

/// All pairs of a few detections and objects in random order, those in that `keeps` lets, with odds
/// uniform in the logarithm.
fn random(
    random: &mut ChaCha8Rng,
    (n_detections, n_objects): (u32, u32),
    log_odds: f64,
    mut keeps: impl FnMut(u32, u32) -> bool,
) -> Case {
    let all = (0..n_detections).flat_map(|j| (0..n_objects).map(move |k| (j, k)));
    let mut pairs: Vec<(u32, u32)> = all.collect();
    pairs.shuffle(random);
    pairs.retain(|&(j, k)| keeps(j, k));
    let odds = pairs.iter();
    let odds = odds.map(|_| random.random_range(-log_odds..log_odds).exp());
    Case {
        n_detections: n_detections as usize,
        n_objects: n_objects as usize,
        odds: odds.collect(),
        pairs,
    }
}

/// Lets a pair in that closes no cycle.
fn forest(n_detections: u32, n_objects: u32) -> impl FnMut(u32, u32) -> bool {
    let mut tree: Vec<u32> = (0..n_detections + n_objects).collect();
    move |j, k| {
        let (a, b) = (tree[j as usize], tree[(n_detections + k) as usize]);
        for node in &mut tree {
            if *node == b {
                *node = a;
            }
        }
        a != b
    }
}

fn patient() -> Exclusive {
    Exclusive {
        max_iterations: 1000,
        tolerance: 1e-13,
        ..Exclusive::new()
    }
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

#[test]
fn exact_where_no_pairs_form_a_cycle() {
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let mut solver = patient();
    for log_odds in [1.0, 5.0, 30.0, 60.0] {
        for (j, k) in [(1, 1), (3, 2), (4, 4), (5, 6), (6, 5)] {
            for _ in 0..20 {
                let case = random(&mut chance, (j, k), log_odds, forest(j, k));
                assert!(!case.pairs.is_empty());
                let expected = case.enumerated();
                let found = case.found(&mut solver);
                assert!(
                    largest_difference(&found, &expected) < 1e-9,
                    "{log_odds} {found:?} {expected:?}"
                );
                let (rows, _) = case.sums(&expected);
                for (row, unassigned) in rows.iter().zip(solver.unassigned()) {
                    assert!((1.0 - row - unassigned).abs() < 1e-9);
                }
            }
        }
    }
}

/// All pairs of four detections and objects: the largest error of a marginal, over 200 draws and in
/// the mean of their worst ones, for odds from e^-1 to e, e^-2 to e^2, and e^-4 to e^4.
#[test]
fn close_in_small_cycles() {
    let mut chance = ChaCha8Rng::seed_from_u64(2);
    let mut solver = Exclusive::new();
    for (log_odds, most, typical) in [(1.0, 0.03, 0.007), (2.0, 0.06, 0.014), (4.0, 0.20, 0.026)] {
        let mut worst = Vec::new();
        for _ in 0..200 {
            let case = random(&mut chance, (4, 4), log_odds, |_, _| true);
            let found = case.found(&mut solver);
            worst.push(largest_difference(&found, &case.enumerated()));
        }
        let mean = worst.iter().sum::<f64>() / 200.0;
        let largest = worst.into_iter().fold(0.0, f64::max);
        assert!(
            largest < most && mean < typical,
            "{log_odds}: {largest} {mean}"
        );
    }
}

#[test]
fn nothing_is_given_twice() {
    let mut chance = ChaCha8Rng::seed_from_u64(3);
    for log_odds in [2.0, 20.0, 60.0] {
        for size in [(3, 8), (8, 8), (12, 5)] {
            let mut solver = patient();
            let case = random(&mut chance, size, log_odds, |_, _| true);
            let (rows, columns) = case.sums(&case.found(&mut solver));
            assert!(rows.iter().all(|sum| *sum <= 1.0 + 1e-12), "{rows:?}");
            assert!(columns.iter().all(|sum| *sum <= 1.0 + 1e-9), "{columns:?}");
            // With the iterations of a hot loop, the objects' sums are nearly so.
            let (rows, columns) = case.sums(&case.found(&mut Exclusive::new()));
            assert!(rows.iter().all(|sum| *sum <= 1.0 + 1e-12), "{rows:?}");
            assert!(columns.iter().all(|sum| *sum <= 1.05), "{columns:?}");
        }
    }
}

#[test]
fn the_order_of_pairs_does_not_matter() {
    let mut chance = ChaCha8Rng::seed_from_u64(4);
    let mut solver = Exclusive::new();
    for _ in 0..20 {
        let case = random(&mut chance, (7, 6), 10.0, |j, k| (j * 5 + k * 3) % 4 != 0);
        let found = case.found(&mut solver);
        let mut order: Vec<usize> = (0..case.pairs.len()).collect();
        order.sort_unstable_by_key(|&at| case.pairs[at]);
        let sorted = Case {
            pairs: order.iter().map(|&at| case.pairs[at]).collect(),
            odds: order.iter().map(|&at| case.odds[at]).collect(),
            ..case
        };
        let again = sorted.found(&mut solver);
        assert!(order.iter().zip(&again).all(|(&at, p)| found[at] == *p));
    }
}

#[test]
fn one_term_may_outweigh_the_rest() {
    // Detection 0 is object 0 beyond doubt, which leaves detection 1 half and half. Differences
    // from the whole sum, 1e26, would lose what detection 1 says of the object.
    let case = Case {
        n_detections: 2,
        n_objects: 2,
        pairs: vec![(0, 0), (1, 0), (1, 1)],
        odds: vec![60f64.exp(), 1e3, 1.0],
    };
    let found = case.found(&mut patient());
    assert!(largest_difference(&found, &[1.0, 0.0, 0.5]) < 1e-12);
    // Two detections that are object 0 alike.
    let case = Case {
        odds: vec![60f64.exp(), 60f64.exp(), 0.0],
        ..case
    };
    let found = case.found(&mut patient());
    assert!(largest_difference(&found, &[0.5, 0.5, 0.0]) < 1e-12);
}

#[test]
fn odd_odds_are_cut() {
    let case = |odds: Vec<f64>| Case {
        n_detections: 2,
        n_objects: 1,
        pairs: vec![(0, 0), (1, 0)],
        odds,
    };
    let mut solver = Exclusive::new();
    let cut = case(vec![60f64.exp(), 0.0]).found(&mut solver);
    for odds in [[f64::INFINITY, f64::NAN], [1e300, -1.0]] {
        assert_eq!(case(odds.to_vec()).found(&mut solver), cut);
    }
    assert!((MOST_ODDS / 60f64.exp() - 1.0).abs() < 1e-12);
}

#[test]
fn empty_views_and_lone_detections() {
    let mut solver = Exclusive::new();
    let mut out = vec![1.0];
    let settled = solver.marginals(0, 0, &[], &[], &mut out);
    assert!(out.is_empty() && settled.converged && solver.unassigned().is_empty());
    let settled = solver.marginals(3, 2, &[(1, 1)], &[3.0], &mut out);
    assert_eq!((out[0], settled.iterations), (0.75, 1));
    assert_eq!(solver.unassigned(), [1.0, 0.25, 1.0]);
}
