use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn total(n_left: usize, n_right: usize, matched: &[Pair], unmatched: f64) -> f64 {
    let left_over = n_left + n_right - 2 * matched.len();
    let count = f64::from(u32::try_from(left_over).unwrap());
    matched.iter().map(|p| p.cost).sum::<f64>() + unmatched * count
}

/// Every matching there is.
fn brute(left: usize, n_left: usize, used: &mut [bool], pairs: &[Pair], price: f64) -> f64 {
    if left == n_left {
        let free = used.iter().filter(|&&u| !u).count();
        return price * f64::from(u32::try_from(free).unwrap());
    }
    let mut best = price + brute(left + 1, n_left, used, pairs, price);
    for pair in pairs.iter().filter(|p| p.left == left) {
        if !used[pair.right] {
            used[pair.right] = true;
            best = best.min(pair.cost + brute(left + 1, n_left, used, pairs, price));
            used[pair.right] = false;
        }
    }
    best
}

/// The dense Hungarian algorithm on the square matrix in which every node has an unmatched
/// partner, written after the textbook with no code in common with the solver.
fn hungarian(n_left: usize, n_right: usize, pairs: &[Pair], price: f64) -> f64 {
    let n = n_left + n_right;
    let mut a = vec![vec![1e9; n + 1]; n + 1];
    for (i, row) in a.iter_mut().enumerate() {
        for (j, cost) in row.iter_mut().enumerate() {
            *cost = match (i > n_left, j > n_right) {
                (true, true) => 0.0,
                (false, false) => 1e9,
                _ => price,
            };
        }
    }
    for p in pairs {
        a[p.left + 1][p.right + 1] = p.cost;
    }
    let (mut u, mut v) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    let mut p = vec![0usize; n + 1];
    for i in 1..=n {
        p[0] = i;
        let mut j0 = 0;
        let (mut low, mut way) = (vec![f64::INFINITY; n + 1], vec![0; n + 1]);
        let mut used = vec![false; n + 1];
        while p[j0] != 0 {
            used[j0] = true;
            let (i0, mut delta, mut j1) = (p[j0], f64::INFINITY, 0);
            for j in 1..=n {
                if !used[j] {
                    let reduced = a[i0][j] - u[i0] - v[j];
                    if reduced < low[j] {
                        (low[j], way[j]) = (reduced, j0);
                    }
                    if low[j] < delta {
                        (delta, j1) = (low[j], j);
                    }
                }
            }
            for j in 0..=n {
                if used[j] {
                    u[p[j]] += delta;
                    v[j] -= delta;
                } else {
                    low[j] -= delta;
                }
            }
            j0 = j1;
        }
        while j0 != 0 {
            p[j0] = p[way[j0]];
            j0 = way[j0];
        }
    }
    (1..=n).map(|j| a[p[j]][j]).sum()
}

fn random_pairs(rng: &mut ChaCha8Rng, n_left: usize, n_right: usize, density: f64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for left in 0..n_left {
        for right in 0..n_right {
            if rng.random_bool(density) {
                let cost = rng.random_range(0.0..2.5);
                pairs.push(Pair { left, right, cost });
            }
        }
    }
    pairs
}

fn assert_is_a_matching(n_left: usize, n_right: usize, matched: &[Pair]) {
    let (mut left, mut right) = (vec![0; n_left], vec![0; n_right]);
    for pair in matched {
        left[pair.left] += 1;
        right[pair.right] += 1;
    }
    assert!(left.iter().chain(&right).all(|&n| n <= 1));
}

#[test]
fn equals_brute_force_on_small_cases() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for case in 0..3000 {
        let (n_left, n_right) = (rng.random_range(0..=6), rng.random_range(0..=6));
        let density = [0.2, 0.5, 1.0][case % 3];
        let pairs = random_pairs(&mut rng, n_left, n_right, density);
        let matched = assign(n_left, n_right, &pairs, 1.0);
        assert_is_a_matching(n_left, n_right, &matched);
        let best = brute(0, n_left, &mut vec![false; n_right], &pairs, 1.0);
        let found = total(n_left, n_right, &matched, 1.0);
        assert!((found - best).abs() < 1e-12, "{case}: {found} {best}");
    }
}

#[test]
fn equals_the_dense_hungarian_on_middling_cases() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (n_left, n_right, density) in [
        (60, 60, 1.0),
        (120, 80, 0.3),
        (70, 150, 0.05),
        (150, 150, 0.02),
        (100, 100, 0.1),
    ] {
        let pairs = random_pairs(&mut rng, n_left, n_right, density);
        let matched = assign(n_left, n_right, &pairs, 1.0);
        assert_is_a_matching(n_left, n_right, &matched);
        let best = hungarian(n_left, n_right, &pairs, 1.0);
        let found = total(n_left, n_right, &matched, 1.0);
        assert!((found - best).abs() < 1e-9, "{found} {best}");
    }
}

#[test]
fn equal_costs_and_chains_are_solved() {
    // A chain in which greedy takes the middle pair (cost 0.1) and loses both ends.
    let chain = [(0, 0, 0.5), (0, 1, 0.1), (1, 1, 0.5)].map(|(left, right, cost)| Pair {
        left,
        right,
        cost,
    });
    let matched = assign(2, 2, &chain, 1.0);
    assert_eq!(matched, [chain[0], chain[2]]);
    // All costs equal: as many matches as there can be.
    let pairs: Vec<Pair> = (0..30)
        .flat_map(|left| (0..20).map(move |right| (left, right)))
        .map(|(left, right)| Pair {
            left,
            right,
            cost: 1.0,
        })
        .collect();
    assert_eq!(assign(30, 20, &pairs, 1.0).len(), 20);
}

#[test]
fn a_pair_no_better_than_none_is_not_matched() {
    let pair = Pair {
        left: 0,
        right: 0,
        cost: 2.0,
    };
    assert!(assign(1, 1, &[pair], 1.0).is_empty());
    let cheaper = Pair {
        cost: 1.999,
        ..pair
    };
    assert_eq!(assign(1, 1, &[cheaper], 1.0), [cheaper]);
}
