//! Of which class an object is, where the detector takes classes for each other.
//!
//! Without a table of confusion a detection joins only objects of its class. With one, an object has
//! a probability of each class: the prior times what its detections say, P(said | true) each, as
//! often as they are independent. A detection joins it with the probability that an object of such
//! classes is called what the detection calls it, in units of the share of all objects that are called
//! so: clutter is taken to be called as objects are on the whole.

use super::engine::{Edge, Engine};
use super::looks::Repeats;

/// Probabilities below this are taken for it.
const LEAST: f64 = 1e-9;
/// Logarithm of a probability with which a detection does not join an object any more.
const NEVER: f64 = -15.0;
/// Rounds of the estimate of how common classes are: each takes milliseconds.
const ROUNDS: usize = 50;

/// How often a detector says which class of an object of which class.
#[derive(Debug, Clone, PartialEq)]
pub struct Confusion {
    /// P(said | true): one row for each true class.
    says: Vec<Vec<f64>>,
}

impl Confusion {
    /// From P(said | true), one row for each true class. Rows are scaled to a sum of one.
    ///
    /// `None` unless the table is square with finite entries, none negative, and no row of zeros.
    pub fn new(says: Vec<Vec<f64>>) -> Option<Self> {
        let n = says.len();
        let row = |mut row: Vec<f64>| {
            let sum: f64 = row.iter().sum();
            let fits = row.len() == n && row.iter().all(|p| *p >= 0.0);
            (fits && sum.is_finite() && sum > 0.0).then(|| {
                row.iter_mut().for_each(|p| *p /= sum);
                row
            })
        };
        let says: Option<Vec<Vec<f64>>> = says.into_iter().map(row).collect();
        Some(Self { says: says? })
    }
}

/// The table as the loops read it.
#[derive(Debug, Clone)]
pub(super) struct Kinds {
    /// By said class, for every true class: logarithm of P(said | true) / P(said).
    ln_says: Vec<Vec<f64>>,
    /// How common the true classes are.
    prior: Vec<f64>,
}

impl Kinds {
    /// `said` are the classes that all detections say.
    pub(super) fn new(confusion: &Confusion, said: impl Iterator<Item = usize>) -> Self {
        let says = &confusion.says;
        let n = says.len();
        let mut times = vec![0.0; n];
        said.for_each(|class| times[class] += 1.0);
        let prior = shares(says, &times);
        let ln_says = (0..n)
            .map(|said| {
                let p: Vec<f64> = says.iter().map(|row| row[said].max(LEAST)).collect();
                let share: f64 = p.iter().zip(&prior).map(|(p, prior)| p * prior).sum();
                p.iter().map(|p| (p / share).ln()).collect()
            })
            .collect();
        Self { ln_says, prior }
    }

    /// Probabilities of the classes after some votes.
    fn posterior(&self, votes: &[f64]) -> Vec<f64> {
        let most = votes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut p: Vec<f64> = self
            .prior
            .iter()
            .zip(votes)
            .map(|(prior, vote)| prior * (vote - most).exp())
            .collect();
        let sum: f64 = p.iter().sum();
        p.iter_mut().for_each(|p| *p /= sum);
        p
    }

    /// Logarithm of the probability of some votes, whatever the class.
    fn ln_evidence(&self, votes: &[f64]) -> f64 {
        let most = votes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let terms = self.prior.iter().zip(votes);
        most + terms
            .map(|(p, vote)| p * (vote - most).exp())
            .sum::<f64>()
            .ln()
    }
}

/// The shares of the true classes that make the said ones most probable, one more of each (EM).
fn shares(says: &[Vec<f64>], said: &[f64]) -> Vec<f64> {
    #[expect(clippy::cast_precision_loss, reason = "a count of classes")]
    let n = says.len() as f64;
    let mut shares = vec![1.0 / n; says.len()];
    for _ in 0..ROUNDS {
        let mut counts = vec![1.0; says.len()];
        for (d, &times) in said.iter().enumerate() {
            let joint: Vec<f64> = shares.iter().zip(says).map(|(s, row)| s * row[d]).collect();
            let sum: f64 = joint.iter().sum();
            if sum > 0.0 {
                for (count, p) in counts.iter_mut().zip(&joint) {
                    *count += times * p / sum;
                }
            }
        }
        let sum: f64 = counts.iter().sum();
        shares = counts.iter().map(|c| c / sum).collect();
    }
    shares
}

/// What an object is taken for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Class {
    /// What its first detection says it is.
    first: usize,
    /// What its detections say of every true class, as logarithms; empty without a table.
    votes: Vec<f64>,
}

impl Class {
    /// Another detection says something, which counts so many times.
    pub(super) fn hear(&mut self, kinds: Option<&Kinds>, said: usize, times: f64) {
        if let Some(kinds) = kinds {
            for (vote, ln) in self.votes.iter_mut().zip(&kinds.ln_says[said]) {
                *vote += times * ln;
            }
        }
    }
}

/// The detections that objects were given last, which must not vouch for themselves.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    /// Sorted by look.
    pub(super) edges: &'a [Edge],
    /// How often each counts for the class of its object.
    pub(super) times: &'a [f64],
}

impl Given<'_> {
    pub(super) const NONE: Given<'static> = Given {
        edges: &[],
        times: &[],
    };
}

impl Engine<'_> {
    /// The class of an object of which one detection is known.
    pub(super) fn class_of(&self, look: usize) -> Class {
        let said = self.looks[look].class;
        let mut class = Class {
            first: said,
            votes: self
                .kinds
                .as_deref()
                .map_or_else(Vec::new, |k| vec![0.0; k.prior.len()]),
        };
        class.hear(self.kinds.as_deref(), said, 1.0);
        class
    }

    /// Logarithm of the odds that a detection says what it says of an object, for every detection
    /// of a view; `None` for those that are of another class.
    pub(super) fn joins(
        &self,
        view: usize,
        object: usize,
        class: &Class,
        given: Given<'_>,
    ) -> impl Fn(usize) -> Option<f64> {
        let kinds = self.kinds.as_deref();
        let first = class.first;
        let posterior = kinds.map(|kinds| {
            let mut others = class.clone();
            let looks = self.looks_of(view);
            let from = given.edges.partition_point(|e| e.look < looks.start);
            let own = given.edges.iter().zip(given.times).skip(from);
            for (edge, times) in own.take_while(|(e, _)| e.look < looks.end) {
                if edge.object == object {
                    others.hear(Some(kinds), self.looks[edge.look].class, -times);
                }
            }
            kinds.posterior(&others.votes)
        });
        move |said| match kinds.zip(posterior.as_ref()) {
            Some((kinds, posterior)) => {
                let terms = posterior.iter().zip(&kinds.ln_says[said]);
                let ln = terms.map(|(p, ln)| p * ln.exp()).sum::<f64>().ln();
                (ln > NEVER).then_some(ln)
            }
            None => (said == first).then_some(0.0),
        }
    }

    /// Logarithm of the odds that two objects say what they say as one thing, against two; `None`
    /// where they are of different classes.
    pub(super) fn one_class(&self, a: usize, b: usize) -> Option<f64> {
        let (a, b) = (&self.classes[a], &self.classes[b]);
        let Some(kinds) = self.kinds.as_deref() else {
            return (a.first == b.first).then_some(0.0);
        };
        let both: Vec<f64> = a.votes.iter().zip(&b.votes).map(|(a, b)| a + b).collect();
        let apart = kinds.ln_evidence(&a.votes) + kinds.ln_evidence(&b.votes);
        let ln = kinds.ln_evidence(&both) - apart;
        (ln > NEVER).then_some(ln)
    }

    /// Logarithm of the odds of what an object's detections say of its class, against clutter.
    pub(super) fn class_evidence(&self, object: usize) -> f64 {
        let kinds = self.kinds.as_deref();
        kinds.map_or(0.0, |kinds| kinds.ln_evidence(&self.classes[object].votes))
    }

    /// The most probable class of an object, and its probability where that is not certain.
    pub(super) fn best_class(&self, object: usize) -> (usize, Option<f64>) {
        let class = &self.classes[object];
        let Some(kinds) = self.kinds.as_deref() else {
            return (class.first, None);
        };
        let posterior = kinds.posterior(&class.votes);
        let mut best = (class.first, posterior[class.first]);
        for (c, &p) in posterior.iter().enumerate() {
            if p > best.1 {
                best = (c, p);
            }
        }
        (best.0, Some(best.1))
    }

    /// What all objects are taken for, by the detections they have now.
    pub(super) fn hear_classes(&mut self) {
        let Some(kinds) = self.kinds.clone() else {
            return;
        };
        let of: Vec<(usize, usize)> = self
            .edges
            .iter()
            .map(|e| (e.object, self.looks[e.look].view))
            .collect();
        let worth = self.worth(&self.objects, &of, Repeats::Detection);
        self.class_times = self
            .edges
            .iter()
            .zip(&worth)
            .map(|(edge, worth)| edge.weight * worth)
            .collect();
        for class in &mut self.classes {
            class.votes.fill(0.0);
        }
        for (edge, times) in self.edges.iter().zip(&self.class_times) {
            let said = self.looks[edge.look].class;
            self.classes[edge.object].hear(Some(&kinds), said, *times);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: [[f64; 2]; 2] = [[0.9, 0.1], [0.3, 0.7]];

    fn kinds(said: &[usize]) -> Kinds {
        let confusion = Confusion::new(TABLE.map(|row| row.to_vec()).to_vec()).unwrap();
        Kinds::new(&confusion, said.iter().copied())
    }

    #[test]
    fn tables_are_square_and_without_negative_shares() {
        let table = |rows: &[&[f64]]| Confusion::new(rows.iter().map(|r| r.to_vec()).collect());
        assert_eq!(table(&[&[1.0, 0.0]]), None);
        assert_eq!(table(&[&[1.2, -0.2], &[0.0, 1.0]]), None);
        assert_eq!(table(&[&[0.0, 0.0], &[0.0, 1.0]]), None);
        assert_eq!(table(&[&[f64::NAN, 0.0], &[0.0, 1.0]]), None);
        // Shares are shares.
        let halves = table(&[&[2.0, 2.0], &[0.0, 1.0]]);
        assert_eq!(halves, table(&[&[0.5, 0.5], &[0.0, 1.0]]));
    }

    #[test]
    fn classes_are_as_common_as_makes_what_is_said_most_probable() {
        // Of 3000 things 1000 are of the first class: 900 + 600 are called so.
        let mut said = vec![0; 1500];
        said.extend(vec![1; 1500]);
        let prior = kinds(&said).prior;
        assert!((prior[0] - 1.0 / 3.0).abs() < 5e-3, "{prior:?}");
        assert!((prior.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn votes_are_bayes() {
        let kinds = kinds(&[0, 1]);
        let mut class = Class {
            first: 0,
            votes: vec![0.0; 2],
        };
        for said in [0, 1, 1] {
            class.hear(Some(&kinds), said, 1.0);
        }
        let joint = [
            kinds.prior[0] * 0.9 * 0.1 * 0.1,
            kinds.prior[1] * 0.3 * 0.7 * 0.7,
        ];
        let p = joint[0] / (joint[0] + joint[1]);
        assert!((kinds.posterior(&class.votes)[0] - p).abs() < 1e-12);
        let first = kinds.prior[0] * 0.9 + kinds.prior[1] * 0.3;
        let evidence = ((joint[0] + joint[1]) / (first * (1.0 - first).powi(2))).ln();
        assert!((kinds.ln_evidence(&class.votes) - evidence).abs() < 1e-12);
        // Unheard, all is as before.
        class.hear(Some(&kinds), 1, -1.0);
        let p = kinds.prior[0] * 0.09 / (kinds.prior[0] * 0.09 + kinds.prior[1] * 0.21);
        assert!((kinds.posterior(&class.votes)[0] - p).abs() < 1e-12);
    }
}
