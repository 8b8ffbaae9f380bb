//! What a reader asks of a document: the keys it knows and what each may hold.

use std::ops::{Bound, RangeBounds};

/// A key that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Its dotted path: `view.max_range_m`.
    pub path: String,
    /// What it may hold.
    pub takes: Takes,
}

/// What a key may hold.
#[derive(Debug, Clone, PartialEq)]
pub enum Takes {
    /// Any text.
    Text,
    /// A text, or a list of texts.
    Texts,
    /// One of these texts, or a list of them.
    WordList(Vec<String>),
    /// One of these texts.
    Words(Vec<String>),
    /// True or false.
    Boolean,
    /// A finite number.
    Number(Interval),
    /// A number, or one of these texts.
    NumberOrWord(Interval, Vec<String>),
    /// A whole number, both ends included.
    Integer(u64, u64),
    /// A list of finite numbers, of one of these lengths; of any where none is named.
    Numbers(Vec<usize>),
    /// A table.
    Table,
}

/// The numbers a key may hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub low: Bound<f64>,
    /// The upper end.
    pub high: Bound<f64>,
}

impl Interval {
    /// The interval of a range. One that begins at the least positive number begins above zero.
    pub(super) fn new(range: &impl RangeBounds<f64>) -> Self {
        let low = match range.start_bound().cloned() {
            Bound::Included(f64::MIN_POSITIVE) => Bound::Excluded(0.0),
            other => other,
        };
        let high = range.end_bound().cloned();
        Self { low, high }
    }
}
