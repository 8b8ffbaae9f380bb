//! Optimal assignment on a sparse graph, exact, where every node may stay unmatched at a price.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A pair that may be matched, and what matching it costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index on the left side.
    pub left: usize,
    /// Index on the right side.
    pub right: usize,
    /// Cost of the match, in the unit of the unmatched cost.
    pub cost: f64,
}

/// The matching of least total cost, where a node of either side that stays unmatched costs
/// `unmatched_cost`.
///
/// `candidates` names the pairs that may be matched, each at most once, sorted by `left`; those
/// that cost no less than leaving both sides unmatched are passed over. The result is sorted by
/// `left`. Among several optima the same one is chosen for the same input.
///
/// The method is that of successive shortest augmenting paths with node potentials (Jonker and
/// Volgenant, Computing 38, 1987; Crouse, IEEE Trans. AES 52, 2016, eq. 1), on the sparse graph:
/// every left node has an end of its own, "unmatched", so a search ends as soon as the path found
/// costs more than giving some node up. It never leaves the connected component in which it
/// starts, and resets no more than what it touched; this makes it near linear in the number of
/// candidates where components are small.
///
/// # Panics
/// Where a candidate's index lies outside `n_left` or `n_right`.
pub fn assign(
    n_left: usize,
    n_right: usize,
    candidates: &[Pair],
    unmatched_cost: f64,
) -> Vec<Pair> {
    let mut solver = Solver::new(n_left, n_right, candidates, unmatched_cost);
    for left in 0..n_left {
        solver.insert(left);
    }
    let matched = |pair: &&Pair| solver.right_of[pair.left] == Some(pair.right);
    candidates.iter().filter(matched).copied().collect()
}

/// The state of the search. Costs are lowered by twice the unmatched cost, so that an unmatched
/// node costs nothing and every edge is negative.
struct Solver {
    /// Edges of left node `i`: `edges[first[i]..first[i + 1]]`.
    first: Vec<usize>,
    edges: Vec<(usize, f64)>,
    /// The potentials: `cost - left_price - right_price >= 0` on every edge, 0 on matched ones.
    left_price: Vec<f64>,
    right_price: Vec<f64>,
    right_of: Vec<Option<usize>>,
    left_of: Vec<Option<usize>>,
    /// Of the search under way, by right node: the shortest distance, where it came from, and
    /// whether it is final.
    distance: Vec<f64>,
    came_from: Vec<usize>,
    is_final: Vec<bool>,
    touched: Vec<usize>,
    heap: BinaryHeap<Reached>,
}

/// Where a search ends.
enum End {
    /// At a right node that was free.
    Free(usize),
    /// With this left node given up.
    GiveUp(usize),
}

impl Solver {
    fn new(n_left: usize, n_right: usize, candidates: &[Pair], unmatched_cost: f64) -> Self {
        debug_assert!(candidates.is_sorted_by_key(|pair| pair.left));
        let mut first = vec![0; n_left + 1];
        let mut edges = Vec::with_capacity(candidates.len());
        for pair in candidates {
            let cost = pair.cost - 2.0 * unmatched_cost;
            if cost < 0.0 {
                assert!(pair.right < n_right, "a candidate's right index");
                first[pair.left + 1] += 1;
                edges.push((pair.right, cost));
            }
        }
        for left in 0..n_left {
            first[left + 1] += first[left];
        }
        Self {
            first,
            edges,
            left_price: vec![0.0; n_left],
            right_price: vec![0.0; n_right],
            right_of: vec![None; n_left],
            left_of: vec![None; n_right],
            distance: vec![f64::INFINITY; n_right],
            came_from: vec![0; n_right],
            is_final: vec![false; n_right],
            touched: Vec::new(),
            heap: BinaryHeap::new(),
        }
    }

    /// Takes one more left node into the matching, along the shortest augmenting path.
    fn insert(&mut self, start: usize) {
        let edges = &self.edges[self.first[start]..self.first[start + 1]];
        self.left_price[start] = edges
            .iter()
            .map(|&(right, cost)| cost - self.right_price[right])
            .fold(0.0, f64::min);
        let (end, length) = self.shortest_path(start);
        self.update_prices(start, length);
        self.augment(start, &end);
        for right in self.touched.drain(..) {
            self.distance[right] = f64::INFINITY;
            self.is_final[right] = false;
        }
        self.heap.clear();
    }

    /// Dijkstra's search over reduced costs, from a new left node to the cheapest end.
    fn shortest_path(&mut self, start: usize) -> (End, f64) {
        let (mut left, mut so_far) = (start, 0.0);
        let (mut given_up, mut least) = (start, f64::INFINITY);
        loop {
            let give_up = so_far - self.left_price[left];
            if give_up < least {
                (given_up, least) = (left, give_up);
            }
            for &(right, cost) in &self.edges[self.first[left]..self.first[left + 1]] {
                let through = so_far + cost - self.left_price[left] - self.right_price[right];
                if through < self.distance[right] && !self.is_final[right] {
                    if self.distance[right].is_infinite() {
                        self.touched.push(right);
                    }
                    self.distance[right] = through;
                    self.came_from[right] = left;
                    let distance = through;
                    self.heap.push(Reached { distance, right });
                }
            }
            let Some(next) = self.nearest().filter(|next| next.distance < least) else {
                return (End::GiveUp(given_up), least);
            };
            let Some(owner) = self.left_of[next.right] else {
                return (End::Free(next.right), next.distance);
            };
            self.is_final[next.right] = true;
            (left, so_far) = (owner, next.distance);
        }
    }

    /// The nearest right node that is not final.
    fn nearest(&mut self) -> Option<Reached> {
        loop {
            let reached = self.heap.pop()?;
            let stale = reached.distance > self.distance[reached.right];
            if !stale && !self.is_final[reached.right] {
                return Some(reached);
            }
        }
    }

    /// Keeps reduced costs non-negative, and zero along the path.
    fn update_prices(&mut self, start: usize, length: f64) {
        self.left_price[start] += length;
        for &right in &self.touched {
            if !self.is_final[right] {
                continue;
            }
            let slack = length - self.distance[right];
            self.right_price[right] -= slack;
            if let Some(left) = self.left_of[right] {
                self.left_price[left] += slack;
            }
        }
    }

    /// Flips the matches along the path.
    fn augment(&mut self, start: usize, end: &End) {
        let mut right = match *end {
            End::Free(right) => right,
            End::GiveUp(left) => match self.right_of[left].take() {
                Some(right) => right,
                None => return,
            },
        };
        loop {
            let left = self.came_from[right];
            self.left_of[right] = Some(left);
            match self.right_of[left].replace(right) {
                Some(before) if left != start => right = before,
                _ => return,
            }
        }
    }
}

/// A right node at a distance; the heap's greatest is the nearest, the first index where equal.
struct Reached {
    distance: f64,
    right: usize,
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_distance = other.distance.total_cmp(&self.distance);
        by_distance.then(other.right.cmp(&self.right))
    }
}
impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Reached {}

#[cfg(test)]
mod tests;
