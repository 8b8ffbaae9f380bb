//! Lists under the keys of a table.

use std::ops::RangeInclusive;

use super::asked::Takes;
use super::document::{Kind, Node};
use super::section::Section;

impl Section<'_> {
    /// Text, or a list of texts.
    pub fn texts(&self, key: &str) -> Option<Vec<String>> {
        self.ask(key, Takes::Texts);
        let text = |n: &Node| match &n.kind {
            Kind::Text(t) => Some(t.clone()),
            _ => None,
        };
        self.take(key, "text or a list of texts", |n| match &n.kind {
            Kind::List(list) => list.iter().map(text).collect(),
            _ => text(n).map(|t| vec![t]),
        })
    }

    /// A whole number within bounds, which stands for two of the same, or a list of two.
    pub fn integer_pair(&self, key: &str, bounds: RangeInclusive<u64>) -> Option<[u64; 2]> {
        let (low, high) = (bounds.start(), bounds.end());
        let expected = format!("a whole number from {low} to {high}, or a list of two");
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be whole and in range"
        )]
        let whole = |n: &Node| match n.kind {
            Kind::Number(x) if x.fract() == 0.0 && x >= 0.0 && bounds.contains(&(x as u64)) => {
                Some(x as u64)
            }
            _ => None,
        };
        self.take(key, expected, |n| match &n.kind {
            Kind::List(list) => match &list[..] {
                [first, second] => Some([whole(first)?, whole(second)?]),
                _ => None,
            },
            _ => whole(n).map(|n| [n, n]),
        })
    }

    /// A list of finite numbers whose length is one of `lengths`.
    pub fn numbers(&self, key: &str, lengths: &[usize]) -> Option<Vec<f64>> {
        self.ask(key, Takes::Numbers(lengths.to_vec()));
        let counts: Vec<String> = lengths.iter().map(usize::to_string).collect();
        let expected = format!("a list of {} finite numbers", counts.join(" or "));
        self.take(key, expected, |n| match &n.kind {
            Kind::List(list) if lengths.contains(&list.len()) => finite(list),
            _ => None,
        })
    }

    /// A list of any number of finite numbers.
    pub fn number_list(&self, key: &str) -> Option<Vec<f64>> {
        self.ask(key, Takes::Numbers(Vec::new()));
        self.take(key, "a list of finite numbers", |n| match &n.kind {
            Kind::List(list) => finite(list),
            _ => None,
        })
    }

    /// Three finite numbers.
    pub fn triple(&self, key: &str) -> Option<[f64; 3]> {
        self.numbers(key, &[3])?.try_into().ok()
    }

    /// A matrix by its rows, a list of lists, as one list.
    pub fn matrix(&self, key: &str, rows: usize, columns: usize) -> Option<Vec<f64>> {
        let expected = format!("{rows} lists of {columns} finite numbers");
        let row = |n: &Node| match &n.kind {
            Kind::List(list) if list.len() == columns => finite(list),
            _ => None,
        };
        let matrix = self.take(key, expected, |n| match &n.kind {
            Kind::List(list) if list.len() == rows => {
                list.iter().map(row).collect::<Option<Vec<_>>>()
            }
            _ => None,
        });
        matrix.map(|rows| rows.concat())
    }

    /// Finite numbers in a list, or in a text that blanks part, as XML has them.
    pub fn number_words(&self, key: &str) -> Option<Vec<f64>> {
        let finite = |x: &f64| x.is_finite();
        let number = |n: &Node| match n.kind {
            Kind::Number(x) => Some(x).filter(finite),
            _ => None,
        };
        self.take(key, "finite numbers", |n| match &n.kind {
            Kind::List(list) => list.iter().map(number).collect(),
            Kind::Text(text) => text
                .split_whitespace()
                .map(|word| word.parse().ok().filter(finite))
                .collect(),
            _ => number(n).map(|x| vec![x]),
        })
    }

    /// A number or a list of numbers, as a list; `None`, without a fault, where it is neither.
    pub fn counters(&self, key: &str) -> Option<Vec<f64>> {
        let number = |n: &Node| match n.kind {
            Kind::Number(x) => Some(x),
            _ => None,
        };
        match self.get(key).map(|n| &n.kind)? {
            Kind::List(list) => list.iter().map(number).collect(),
            Kind::Number(x) => Some(vec![*x]),
            _ => None,
        }
    }

    /// Texts and numbers, alone or in a list, as texts; `None`, without a fault, where there is anything
    /// else.
    pub fn words(&self, key: &str) -> Option<Vec<String>> {
        let word = |n: &Node| match &n.kind {
            Kind::Text(text) => Some(text.clone()),
            Kind::Number(x) => Some(x.to_string()),
            _ => None,
        };
        let node = self.get(key)?;
        match &node.kind {
            Kind::List(list) => list.iter().map(word).collect(),
            _ => word(node).map(|word| vec![word]),
        }
    }
}

/// Finite numbers, if all are.
fn finite(list: &[Node]) -> Option<Vec<f64>> {
    let number = |n: &Node| match n.kind {
        Kind::Number(x) if x.is_finite() => Some(x),
        _ => None,
    };
    list.iter().map(number).collect()
}
