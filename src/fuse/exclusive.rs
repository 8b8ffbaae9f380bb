//! Which detection of a view is which object, where no object is detected twice: the marginal
//! probabilities of exclusive association, by belief propagation.
//!
//! J. L. Williams and R. A. Lau, "Approximate evaluation of marginal association probabilities with
//! belief propagation", IEEE Transactions on Aerospace and Electronic Systems 50(4), 2014.

use std::ops::Range;

/// Odds are cut to this much, e^60, so that no product of messages overflows.
const MOST_ODDS: f64 = 1.142_007_389_815_684_2e26;

/// Belief propagation over the candidate pairs of one view, with the memory it works in: one value
/// serves any number of views without allocating anew.
///
/// ```
/// use rockmap::fuse::Exclusive;
///
/// // Both detections look most like object 0, which can be only one of them.
/// let (pairs, odds) = ([(0, 0), (1, 0), (1, 1)], [100.0, 100.0, 10.0]);
/// let mut p = Vec::new();
/// Exclusive::new().marginals(2, 2, &pairs, &odds, &mut p);
/// // Of the weights 1 + 100 + 100 + 10 + 100 * 10, those with detection 0 as object 0:
/// assert!((p[0] - 1100.0 / 1211.0).abs() < 1e-3);
/// ```
#[derive(Debug, Clone)]
pub struct Exclusive {
    /// The most rounds of messages; 15 unless set.
    pub max_iterations: usize,
    /// A largest relative change of a message of no more than this ends them; 1e-4 unless set.
    pub tolerance: f64,
    /// The pairs by detection and then object: what is kept of each is indexed by this rank.
    graph: Graph,
    odds: Vec<f64>,
    to_object: Vec<f64>,
    to_detection: Vec<f64>,
    /// Sums over the pairs before each one of its row.
    before: Vec<f64>,
    unassigned: Vec<f64>,
}

/// How the messages settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// Rounds done.
    pub iterations: usize,
    /// Whether the last changed no message by more than the tolerance.
    pub converged: bool,
}

impl Exclusive {
    /// With 15 iterations and a tolerance of 1e-4.
    pub fn new() -> Self {
        Self {
            max_iterations: 15,
            tolerance: 1e-4,
            graph: Graph::default(),
            odds: Vec::new(),
            to_object: Vec::new(),
            to_detection: Vec::new(),
            before: Vec::new(),
            unassigned: Vec::new(),
        }
    }

    /// Into `out`, in the order of `pairs`, the probability of each pair (detection, object), where
    /// each detection is at most one object and each object at most one detection. `odds` are those
    /// of a pair against its detection being none of the objects and the object going undetected:
    /// a whole assignment weighs the product of the odds of its pairs. They are cut to e^60; what
    /// is not above zero (or not a number) counts as zero. Each pair stands at most once, in any
    /// order: another order gives the same bits.
    ///
    /// Exact where the pairs form no cycle. In cycles the result errs towards the likelier
    /// assignments, the more the larger the odds; a detection's probabilities never sum to more
    /// than one, and once the messages have settled an object's do not either.
    ///
    /// # Panics
    /// Where a pair lies outside `n_detections` or `n_objects`, or there are not as many odds as
    /// pairs.
    pub fn marginals(
        &mut self,
        n_detections: usize,
        n_objects: usize,
        pairs: &[(u32, u32)],
        odds: &[f64],
        out: &mut Vec<f64>,
    ) -> Settled {
        assert_eq!(pairs.len(), odds.len(), "odds are given by pair");
        self.graph.build(n_detections, n_objects, pairs);
        self.odds.clear();
        let cut = |&at: &usize| {
            if odds[at] > 0.0 {
                odds[at].min(MOST_ODDS)
            } else {
                0.0
            }
        };
        self.odds.extend(self.graph.pair_of.iter().map(cut));
        for (messages, neutral) in [
            (&mut self.to_object, 1.0),
            (&mut self.to_detection, 0.0),
            (&mut self.before, 0.0),
        ] {
            messages.clear();
            messages.resize(pairs.len(), neutral);
        }
        let settled = self.settle();
        self.believe(out);
        settled
    }

    /// By detection, the probability of the last call that it is none of the objects:
    /// what the sum of its pairs leaves of one, without the loss of digits of that difference.
    pub fn unassigned(&self) -> &[f64] {
        &self.unassigned
    }

    fn settle(&mut self) -> Settled {
        for iteration in 1..=self.max_iterations {
            for object in 0..self.graph.n_objects() {
                self.tell_detections(object);
            }
            let mut change: f64 = 0.0;
            for detection in 0..self.graph.n_detections() {
                change = change.max(self.tell_objects(self.graph.row(detection)));
            }
            if change <= self.tolerance {
                return Settled {
                    iterations: iteration,
                    converged: true,
                };
            }
        }
        Settled {
            iterations: self.max_iterations,
            converged: false,
        }
    }

    /// The messages of an object to its detections: the odds of each pair, lowered by what the
    /// other detections claim of the object. The sum over the others is put together from those
    /// before and those after, since the difference of the whole sum and one term has no digits
    /// left where that term outweighs the rest.
    fn tell_detections(&mut self, object: usize) {
        let column = self.graph.column(object);
        let mut sum = 0.0;
        for &at in column {
            self.to_detection[at] = sum;
            sum += self.odds[at] * self.to_object[at];
        }
        let mut after = 0.0;
        for &at in column.iter().rev() {
            let others = self.to_detection[at] + after;
            after += self.odds[at] * self.to_object[at];
            self.to_detection[at] = self.odds[at] / (1.0 + others);
        }
    }

    /// The messages of a detection to its objects: how free the other objects leave it. The largest
    /// relative change of them.
    fn tell_objects(&mut self, row: Range<usize>) -> f64 {
        let mut sum = 0.0;
        for at in row.clone() {
            self.before[at] = sum;
            sum += self.to_detection[at];
        }
        let mut after = 0.0;
        let mut change: f64 = 0.0;
        for at in row.rev() {
            let free = 1.0 / (1.0 + self.before[at] + after);
            after += self.to_detection[at];
            change = change.max((free - self.to_object[at]).abs() / free);
            self.to_object[at] = free;
        }
        change
    }

    /// The marginals from the messages to each detection.
    fn believe(&mut self, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.odds.len(), 0.0);
        self.unassigned.clear();
        for detection in 0..self.graph.n_detections() {
            let row = self.graph.row(detection);
            let sum = 1.0 + self.to_detection[row.clone()].iter().sum::<f64>();
            self.unassigned.push(1.0 / sum);
            for at in row {
                out[self.graph.pair_of[at]] = self.to_detection[at] / sum;
            }
        }
    }
}

impl Default for Exclusive {
    fn default() -> Self {
        Self::new()
    }
}

/// Pairs in an order of their own, by row (detection) and by column (object).
#[derive(Debug, Clone, Default)]
struct Graph {
    /// The given pair of each rank.
    pair_of: Vec<usize>,
    row_starts: Vec<usize>,
    /// Ranks by object, ascending within one.
    columns: Vec<usize>,
    column_starts: Vec<usize>,
    by_object: Vec<usize>,
}

impl Graph {
    /// Two counting sorts put the pairs into the order of detections and objects; a third groups
    /// them by object.
    fn build(&mut self, n_detections: usize, n_objects: usize, pairs: &[(u32, u32)]) {
        let object = |at: usize| pairs[at].1 as usize;
        let detection = |at: usize| pairs[at].0 as usize;
        let given = 0..pairs.len();
        group(
            n_objects,
            given.clone(),
            object,
            &mut self.column_starts,
            &mut self.by_object,
        );
        group(
            n_detections,
            self.by_object.iter().copied(),
            detection,
            &mut self.row_starts,
            &mut self.pair_of,
        );
        let pair_of = &self.pair_of;
        group(
            n_objects,
            given,
            |rank| object(pair_of[rank]),
            &mut self.column_starts,
            &mut self.columns,
        );
    }

    fn n_detections(&self) -> usize {
        self.row_starts.len() - 1
    }

    fn n_objects(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// The ranks of a detection's pairs.
    fn row(&self, detection: usize) -> Range<usize> {
        self.row_starts[detection]..self.row_starts[detection + 1]
    }

    /// The ranks of an object's pairs.
    fn column(&self, object: usize) -> &[usize] {
        &self.columns[self.column_starts[object]..self.column_starts[object + 1]]
    }
}

/// Sorts items by their group, those of one group in the order they come; `starts` gets where each
/// group starts, and one more at the end.
fn group(
    n_groups: usize,
    items: impl Iterator<Item = usize> + Clone,
    group_of: impl Fn(usize) -> usize,
    starts: &mut Vec<usize>,
    sorted: &mut Vec<usize>,
) {
    starts.clear();
    starts.resize(n_groups + 1, 0);
    let mut n_items = 0;
    for item in items.clone() {
        starts[group_of(item) + 1] += 1;
        n_items += 1;
    }
    for at in 0..n_groups {
        starts[at + 1] += starts[at];
    }
    sorted.clear();
    sorted.resize(n_items, 0);
    // Each start walks to the end of its group and is put back after.
    for item in items {
        let next = &mut starts[group_of(item)];
        sorted[*next] = item;
        *next += 1;
    }
    starts.rotate_right(1);
    starts[0] = 0;
}

#[cfg(test)]
mod tests;
