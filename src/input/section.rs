//! A table of a document, read key by key.

use std::cell::RefCell;
use std::fmt::Display;
use std::ops::RangeBounds;

use super::asked::{Asked, Interval, Takes};
use super::document::{Document, Kind, Node};
use crate::error::{Fault, Place, suggestion};

/// A table of the document. Every key it is asked for counts as known; [`Section::finish`] reports
/// the others.
pub struct Section<'a> {
    document: &'a Document,
    node: Option<&'a Node>,
    path: String,
    known: RefCell<Vec<String>>,
}

impl<'a> Section<'a> {
    /// The whole document.
    pub(super) fn root(document: &'a Document) -> Self {
        Self {
            document,
            node: Some(&document.root),
            path: String::new(),
            known: RefCell::default(),
        }
    }

    /// Whether the file has this section.
    pub fn is_present(&self) -> bool {
        self.node.is_some()
    }

    /// Whether the section has this key, which counts as known from then on.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    pub(super) fn get(&self, key: &str) -> Option<&'a Node> {
        self.known.borrow_mut().push(key.to_owned());
        match &self.node?.kind {
            Kind::Table(entries) => entries.iter().find(|(k, _)| k == key).map(|(_, n)| n),
            _ => None,
        }
    }

    /// The dotted path of a key.
    fn path_of(&self, key: &str) -> String {
        match (self.path.is_empty(), key.is_empty()) {
            (true, _) => key.to_owned(),
            (false, true) => self.path.clone(),
            (false, false) => format!("{}.{key}", self.path),
        }
    }

    /// Where a key stands, or where its section does, or the file.
    pub fn place(&self, key: &str) -> Place {
        let entry = match self.node.map(|n| &n.kind) {
            Some(Kind::Table(entries)) => entries.iter().find(|(k, _)| k == key).map(|(_, n)| n),
            _ => None,
        };
        entry
            .or(self.node.filter(|n| n.place.line.is_some()))
            .map_or_else(|| Place::file(&self.document.file), |n| n.place.clone())
    }

    /// Records a fault in a key.
    pub fn fault(&self, key: &str, found: impl Display, expected: impl Display) {
        let fault = Fault::found(self.place(key), self.path_of(key), found, expected);
        self.document.faults.borrow_mut().push(fault);
    }

    /// Records a fault in a key, in words of the caller's.
    pub fn problem(&self, key: &str, problem: impl Into<String>) {
        let fault = Fault::new(self.place(key), self.path_of(key), problem);
        self.document.faults.borrow_mut().push(fault);
    }

    /// Notes what a key may hold; what is said last counts.
    pub(super) fn ask(&self, key: &str, takes: Takes) {
        let path = self.path_of(key);
        let mut asked = self.document.asked.borrow_mut();
        match asked.iter_mut().find(|a| a.path == path) {
            Some(earlier) => earlier.takes = takes,
            None => asked.push(Asked { path, takes }),
        }
    }

    pub(super) fn take<T>(
        &self,
        key: &str,
        expected: impl Display,
        convert: impl FnOnce(&'a Node) -> Option<T>,
    ) -> Option<T> {
        let node = self.get(key)?;
        let converted = convert(node);
        if converted.is_none() {
            self.fault(key, node.shown(), expected);
        }
        converted
    }

    /// Text.
    pub fn text(&self, key: &str) -> Option<String> {
        self.ask(key, Takes::Text);
        self.take(key, "text", |n| match &n.kind {
            Kind::Text(t) => Some(t.clone()),
            _ => None,
        })
    }

    /// Says which texts a key read by [`Section::texts`] may hold; it is for the caller to check them.
    pub fn offers(&self, key: &str, words: &[&str]) {
        self.ask(key, Takes::WordList(owned(words)));
    }

    /// One of a few words.
    pub fn word(&self, key: &str, words: &[&str]) -> Option<String> {
        self.ask(key, Takes::Words(owned(words)));
        let expected = words.join(", ");
        let near = match self.get(key).map(|n| &n.kind) {
            Some(Kind::Text(t)) => suggestion(t, words.iter().copied()),
            _ => None,
        };
        let near = near
            .map(|w| format!(" (is {w} meant?)"))
            .unwrap_or_default();
        self.take(key, format!("one of {expected}{near}"), |n| match &n.kind {
            Kind::Text(t) if words.contains(&t.as_str()) => Some(t.clone()),
            _ => None,
        })
    }

    /// True or false.
    pub fn boolean(&self, key: &str) -> Option<bool> {
        self.ask(key, Takes::Boolean);
        self.take(key, "true or false", |n| match n.kind {
            Kind::Boolean(b) => Some(b),
            _ => None,
        })
    }

    /// A finite number within bounds, which `expected` words.
    pub fn number(&self, key: &str, bounds: impl RangeBounds<f64>, expected: &str) -> Option<f64> {
        self.ask(key, Takes::Number(Interval::new(&bounds)));
        self.take(key, expected, |n| match n.kind {
            Kind::Number(x) if x.is_finite() && bounds.contains(&x) => Some(x),
            _ => None,
        })
    }

    /// A whole number within bounds.
    pub fn integer(&self, key: &str, bounds: std::ops::RangeInclusive<u64>) -> Option<u64> {
        self.ask(key, Takes::Integer(*bounds.start(), *bounds.end()));
        let expected = format!("a whole number from {} to {}", bounds.start(), bounds.end());
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be whole and in range"
        )]
        self.take(key, expected, |n| match n.kind {
            Kind::Number(x) if x.fract() == 0.0 && x >= 0.0 && bounds.contains(&(x as u64)) => {
                Some(x as u64)
            }
            _ => None,
        })
    }

    /// A section below this one; an absent one answers `None` to every key.
    pub fn section(&self, key: &str) -> Section<'a> {
        self.ask(key, Takes::Table);
        let node = self.take(key, "a table", |n| {
            matches!(n.kind, Kind::Table(_)).then_some(n)
        });
        Section {
            document: self.document,
            node,
            path: self.path_of(key),
            known: RefCell::default(),
        }
    }

    /// All sections below this one, with their names, in the order of the file.
    pub fn sections(&self) -> Vec<(String, Section<'a>)> {
        let section = |key: String| {
            let section = self.section(&key);
            (key, section)
        };
        self.keys().into_iter().map(section).collect()
    }

    /// The keys that are there, in the order of the file.
    pub fn keys(&self) -> Vec<String> {
        match self.node.map(|n| &n.kind) {
            Some(Kind::Table(entries)) => entries.iter().map(|(key, _)| key.clone()).collect(),
            _ => Vec::new(),
        }
    }

    /// The same table, of which nothing is known yet.
    pub fn again(&self) -> Section<'a> {
        Section {
            document: self.document,
            node: self.node,
            path: self.path.clone(),
            known: RefCell::default(),
        }
    }

    /// All tables under this key: those of a list, or of a key that stands several times, as elements
    /// of XML and groups of labels do. What is no table answers `None` to every key.
    pub fn tables(&self, key: &str) -> Vec<Section<'a>> {
        self.known.borrow_mut().push(key.to_owned());
        let Some(Kind::Table(entries)) = self.node.map(|n| &n.kind) else {
            return Vec::new();
        };
        let nodes: Vec<&Node> = entries
            .iter()
            .filter(|(k, _)| k == key)
            .map(|(_, n)| n)
            .collect();
        if let [only] = nodes[..]
            && let Kind::List(list) = &only.kind
        {
            return self.numbered(key, list.iter().collect());
        }
        if nodes.len() == 1 {
            let path = self.path_of(key);
            let only = |node| Section {
                document: self.document,
                node: Some(node),
                path: path.clone(),
                known: RefCell::default(),
            };
            return nodes.into_iter().map(only).collect();
        }
        self.numbered(key, nodes)
    }

    /// The tables of a document that is a list; `None` where it is no list.
    pub fn rows(&self) -> Option<Vec<Section<'a>>> {
        match self.node.map(|n| &n.kind) {
            Some(Kind::List(list)) => Some(self.numbered("", list.iter().collect())),
            _ => None,
        }
    }

    fn numbered(&self, key: &str, nodes: Vec<&'a Node>) -> Vec<Section<'a>> {
        let path = self.path_of(key);
        let section = |(i, node)| Section {
            document: self.document,
            node: Some(node),
            path: format!("{path}[{i}]"),
            known: RefCell::default(),
        };
        nodes.into_iter().enumerate().map(section).collect()
    }

    /// All tables below this one, with their names; one name may stand several times.
    pub fn groups(&self) -> Vec<(String, Section<'a>)> {
        let Some(Kind::Table(entries)) = self.node.map(|n| &n.kind) else {
            return Vec::new();
        };
        let group = |(key, node): &'a (String, Node)| {
            let is_table = matches!(node.kind, Kind::Table(_));
            let section = Section {
                document: self.document,
                node: Some(node),
                path: self.path_of(key),
                known: RefCell::default(),
            };
            is_table.then(|| (key.clone(), section))
        };
        entries.iter().filter_map(group).collect()
    }

    /// True or false, or a number that is not zero or zero.
    pub fn boolean_or_number(&self, key: &str) -> Option<bool> {
        self.take(key, "true or false, 1 or 0", |n| match n.kind {
            Kind::Boolean(b) => Some(b),
            Kind::Number(x) => Some(x != 0.0),
            _ => None,
        })
    }

    /// Text, or a number as text: names and identifiers that happen to be digits.
    pub fn name(&self, key: &str) -> Option<String> {
        self.take(key, "text", |n| match &n.kind {
            Kind::Text(t) => Some(t.clone()),
            Kind::Number(x) => Some(x.to_string()),
            _ => None,
        })
    }

    /// What stands under a key, as faults show it.
    pub fn shown(&self, key: &str) -> String {
        self.get(key).map_or("nothing".to_owned(), Node::shown)
    }

    /// A number within bounds, or one of a few words: `Ok` the one, `Err` the other.
    pub fn number_or_word(
        &self,
        key: &str,
        words: &[&str],
        bounds: impl RangeBounds<f64>,
        number: &str,
    ) -> Option<Result<f64, String>> {
        let takes = Takes::NumberOrWord(Interval::new(&bounds), owned(words));
        let found = if let Some(Kind::Number(_)) = self.get(key).map(|n| &n.kind) {
            let expected = format!("{}, or {number}", words.join(", "));
            self.number(key, bounds, &expected).map(Ok)
        } else {
            self.word(key, words).map(Err)
        };
        self.ask(key, takes);
        found
    }

    /// Records a fault for every key that was never asked for, with the nearest known one.
    pub fn finish(self) {
        let Some(Kind::Table(entries)) = self.node.map(|n| &n.kind) else {
            return;
        };
        let known = self.known.borrow();
        for (key, _) in entries.iter().filter(|(key, _)| !known.contains(key)) {
            let near = suggestion(key, known.iter().map(String::as_str))
                .map(|near| format!(", is {near} meant?"))
                .unwrap_or_default();
            self.problem(key, format!("unknown key{near}"));
        }
    }
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}
