//! A TOML file whose every value knows its place, read section by section, all faults collected.

use std::cell::RefCell;
use std::fmt::Display;
use std::ops::RangeBounds;

use toml_edit::{Item, TableLike, Value};

use crate::error::{Fault, Place, suggestion};

/// A parsed TOML file, with the command line's overrides laid over it.
#[derive(Debug)]
pub struct Document {
    file: String,
    root: Node,
    faults: RefCell<Vec<Fault>>,
}

/// A value and where it stands.
#[derive(Debug, Clone)]
struct Node {
    place: Place,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Text(String),
    Number(f64),
    Boolean(bool),
    List(Vec<Node>),
    Table(Vec<(String, Node)>),
    /// A date, which no key takes.
    Other(String),
}

impl Document {
    /// Parses TOML. `shown` is the name faults call the file by.
    ///
    /// # Errors
    /// What is not TOML, with line and column.
    pub fn parse(text: &str, shown: &str) -> Result<Self, Fault> {
        let parsed = toml_edit::Document::parse(text.to_owned()).map_err(|e| {
            let place = place_of(text, shown, e.span().map(|s| s.start));
            Fault::new(place, "", e.message().replace('\n', ", "))
        })?;
        Ok(Self {
            file: shown.to_owned(),
            root: table_node(text, shown, parsed.as_table(), Place::file(shown)),
            faults: RefCell::default(),
        })
    }

    /// Lays this document over another: tables are merged key by key, every other value of this
    /// one replaces the other's. Each value keeps its own file and line.
    #[must_use]
    pub fn over(self, base: Document) -> Document {
        Document {
            file: self.file,
            root: self.root.over(base.root),
            faults: self.faults,
        }
    }

    /// Lays `KEY.PATH=VALUE` over the document, as `--set` gives it. A value that is not TOML is
    /// taken as text, so that `--set view.aim=bottom` needs no quotes.
    ///
    /// # Errors
    /// An override without `=`, or a path that runs through a value that is no table.
    pub fn set(&mut self, assignment: &str) -> Result<(), Fault> {
        let place = Place::file("--set");
        let Some((path, value)) = assignment.split_once('=') else {
            return Err(Fault::found(place, "", assignment, "KEY.PATH=VALUE"));
        };
        let value: Value = value
            .trim()
            .parse()
            .unwrap_or_else(|_| Value::from(value.trim()));
        let mut node = &mut self.root;
        for key in path.trim().split('.') {
            if !matches!(node.kind, Kind::Table(_)) {
                return Err(Fault::found(
                    place,
                    path.trim(),
                    "a key below a value",
                    "a table",
                ));
            }
            let Kind::Table(entries) = &mut node.kind else {
                unreachable!("checked above");
            };
            let index = entries
                .iter()
                .position(|(k, _)| k == key)
                .unwrap_or_else(|| {
                    let empty = Node {
                        place: place.clone(),
                        kind: Kind::Table(Vec::new()),
                    };
                    entries.push((key.to_owned(), empty));
                    entries.len() - 1
                });
            node = &mut entries[index].1;
        }
        *node = value_node("", "--set", &value);
        Ok(())
    }

    /// The whole file as a section.
    pub fn root(&self) -> Section<'_> {
        Section {
            document: self,
            node: Some(&self.root),
            path: String::new(),
            known: RefCell::default(),
        }
    }

    /// All faults found while reading, in the order of the file.
    pub fn into_faults(self) -> Vec<Fault> {
        let mut faults = self.faults.into_inner();
        faults.sort_by_key(|f| (f.place.line.unwrap_or(0), f.place.column.unwrap_or(0)));
        faults
    }
}

fn place_of(text: &str, shown: &str, offset: Option<usize>) -> Place {
    let Some(before) = offset.and_then(|o| text.get(..o)) else {
        return Place::file(shown);
    };
    let line = before.matches('\n').count() as u64 + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() as u64 + 1;
    Place {
        file: shown.to_owned(),
        line: Some(line),
        column: Some(column),
    }
}

fn table_node(text: &str, shown: &str, table: &dyn TableLike, place: Place) -> Node {
    let entries = table.iter().map(|(key, item)| {
        let key_span = table.key(key).and_then(|k| k.span());
        let span = key_span.or_else(|| item.span()).map(|s| s.start);
        let place = place_of(text, shown, span);
        let mut node = match item {
            Item::Value(value) => value_node(text, shown, value),
            Item::Table(t) => table_node(text, shown, t, place.clone()),
            Item::ArrayOfTables(list) => Node {
                place: place.clone(),
                kind: Kind::List(
                    list.iter()
                        .map(|t| table_node(text, shown, t, place.clone()))
                        .collect(),
                ),
            },
            Item::None => Node {
                place: place.clone(),
                kind: Kind::Table(Vec::new()),
            },
        };
        node.place = place;
        (key.to_owned(), node)
    });
    Node {
        kind: Kind::Table(entries.collect()),
        place,
    }
}

fn value_node(text: &str, shown: &str, value: &Value) -> Node {
    let place = place_of(text, shown, value.span().map(|s| s.start));
    let kind = match value {
        Value::String(s) => Kind::Text(s.value().clone()),
        #[expect(
            clippy::cast_precision_loss,
            reason = "no key needs integers over 2^53"
        )]
        Value::Integer(i) => Kind::Number(*i.value() as f64),
        Value::Float(x) => Kind::Number(*x.value()),
        Value::Boolean(b) => Kind::Boolean(*b.value()),
        Value::Datetime(d) => Kind::Other(d.value().to_string()),
        Value::Array(list) => Kind::List(list.iter().map(|v| value_node(text, shown, v)).collect()),
        Value::InlineTable(t) => return table_node(text, shown, t, place),
    };
    Node { place, kind }
}

impl Node {
    fn over(self, base: Node) -> Node {
        let kind = match (self.kind, base.kind) {
            (Kind::Table(mine), Kind::Table(mut merged)) => {
                for (key, node) in mine {
                    match merged.iter().position(|(k, _)| *k == key) {
                        Some(i) => {
                            let (_, below) = merged.remove(i);
                            merged.insert(i, (key, node.over(below)));
                        }
                        None => merged.push((key, node)),
                    }
                }
                Kind::Table(merged)
            }
            (mine, _) => mine,
        };
        Node {
            place: self.place,
            kind,
        }
    }

    fn shown(&self) -> String {
        match &self.kind {
            Kind::Text(t) => format!("{t:?}"),
            Kind::Number(x) => x.to_string(),
            Kind::Boolean(b) => b.to_string(),
            Kind::List(list) => format!("a list of {}", list.len()),
            Kind::Table(_) => "a table".to_owned(),
            Kind::Other(date) => date.clone(),
        }
    }
}

/// A table of the document. Every key it is asked for counts as known; [`Section::finish`] reports
/// the others.
pub struct Section<'a> {
    document: &'a Document,
    node: Option<&'a Node>,
    path: String,
    known: RefCell<Vec<String>>,
}

impl<'a> Section<'a> {
    /// Whether the file has this section.
    pub fn is_present(&self) -> bool {
        self.node.is_some()
    }

    /// Whether the section has this key, which counts as known from then on.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    fn get(&self, key: &str) -> Option<&'a Node> {
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

    fn take<T>(
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
        self.take(key, "text", |n| match &n.kind {
            Kind::Text(t) => Some(t.clone()),
            _ => None,
        })
    }

    /// Text, or a list of texts.
    pub fn texts(&self, key: &str) -> Option<Vec<String>> {
        let text = |n: &Node| match &n.kind {
            Kind::Text(t) => Some(t.clone()),
            _ => None,
        };
        self.take(key, "text or a list of texts", |n| match &n.kind {
            Kind::List(list) => list.iter().map(text).collect(),
            _ => text(n).map(|t| vec![t]),
        })
    }

    /// One of a few words.
    pub fn word(&self, key: &str, words: &[&str]) -> Option<String> {
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
        self.take(key, "true or false", |n| match n.kind {
            Kind::Boolean(b) => Some(b),
            _ => None,
        })
    }

    /// A finite number within bounds, which `expected` words.
    pub fn number(&self, key: &str, bounds: impl RangeBounds<f64>, expected: &str) -> Option<f64> {
        self.take(key, expected, |n| match n.kind {
            Kind::Number(x) if x.is_finite() && bounds.contains(&x) => Some(x),
            _ => None,
        })
    }

    /// A whole number within bounds.
    pub fn integer(&self, key: &str, bounds: std::ops::RangeInclusive<u64>) -> Option<u64> {
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

    /// A list of finite numbers whose length is one of `lengths`.
    pub fn numbers(&self, key: &str, lengths: &[usize]) -> Option<Vec<f64>> {
        let counts: Vec<String> = lengths.iter().map(usize::to_string).collect();
        let expected = format!("a list of {} finite numbers", counts.join(" or "));
        self.take(key, expected, |n| match &n.kind {
            Kind::List(list) if lengths.contains(&list.len()) => list
                .iter()
                .map(|n| match n.kind {
                    Kind::Number(x) if x.is_finite() => Some(x),
                    _ => None,
                })
                .collect(),
            _ => None,
        })
    }

    /// A list of any number of finite numbers.
    pub fn number_list(&self, key: &str) -> Option<Vec<f64>> {
        self.take(key, "a list of finite numbers", |n| match &n.kind {
            Kind::List(list) => list
                .iter()
                .map(|n| match n.kind {
                    Kind::Number(x) if x.is_finite() => Some(x),
                    _ => None,
                })
                .collect(),
            _ => None,
        })
    }

    /// Three finite numbers.
    pub fn triple(&self, key: &str) -> Option<[f64; 3]> {
        self.numbers(key, &[3])?.try_into().ok()
    }

    /// A section below this one; an absent one answers `None` to every key.
    pub fn section(&self, key: &str) -> Section<'a> {
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
        match self.node.map(|n| &n.kind) {
            Some(Kind::Table(entries)) => entries
                .iter()
                .map(|(key, _)| (key.clone(), self.section(key)))
                .collect(),
            _ => Vec::new(),
        }
    }

    /// A number within bounds, or one of a few words: `Ok` the one, `Err` the other.
    pub fn number_or_word(
        &self,
        key: &str,
        words: &[&str],
        bounds: impl RangeBounds<f64>,
        number: &str,
    ) -> Option<Result<f64, String>> {
        if let Some(Kind::Number(_)) = self.get(key).map(|n| &n.kind) {
            let expected = format!("{}, or {number}", words.join(", "));
            return self.number(key, bounds, &expected).map(Ok);
        }
        self.word(key, words).map(Err)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(text: &str, sets: &[&str], read: impl Fn(&Section)) -> Vec<String> {
        let mut document = Document::parse(text, "p.toml").unwrap();
        for set in sets {
            document.set(set).unwrap();
        }
        let root = document.root();
        read(&root);
        root.finish();
        let faults = document.into_faults();
        faults.iter().map(Fault::to_string).collect()
    }

    #[test]
    fn all_faults_are_listed_with_their_places() {
        let text = "[view]\naim = \"centre\"\nmax_rnge_m = 3\nmin_range_m = -1\n";
        let found = faults(text, &["view.fov_deg=wide"], |root| {
            let view = root.section("view");
            view.word("aim", &["center", "bottom"]);
            view.number("min_range_m", 0.0.., "a number not below zero");
            view.number("max_range_m", 0.0.., "a number not below zero");
            view.number("fov_deg", 0.0..=360.0, "0 to 360");
            view.finish();
        });
        assert_eq!(
            found,
            [
                "--set: view.fov_deg: found \"wide\", expected 0 to 360",
                "p.toml:2:1: view.aim: found \"centre\", expected one of center, bottom (is center meant?)",
                "p.toml:3:1: view.max_rnge_m: unknown key, is max_range_m meant?",
                "p.toml:4:1: view.min_range_m: found -1, expected a number not below zero",
            ]
        );
    }

    #[test]
    fn overrides_replace_and_create() {
        let mut document = Document::parse("[a]\nx = 1\n", "p.toml").unwrap();
        document.set("a.x=2.5").unwrap();
        document.set("b.c = [1, 2]").unwrap();
        let root = document.root();
        assert_eq!(root.section("a").number("x", .., "a number"), Some(2.5));
        assert_eq!(root.section("b").numbers("c", &[2]), Some(vec![1.0, 2.0]));
        let mut again = Document::parse("x = 1\n", "p.toml").unwrap();
        assert_eq!(
            again.set("x.y=1").unwrap_err().to_string(),
            "--set: x.y: found a key below a value, expected a table"
        );
        assert_eq!(
            again.set("x").unwrap_err().to_string(),
            "--set: found x, expected KEY.PATH=VALUE"
        );
    }

    #[test]
    fn a_document_over_another_merges_tables_and_keeps_places() {
        let base = Document::parse("[a]\nx = 1\ny = 2\n[b]\nz = [1]\n", "base.toml").unwrap();
        let mine = Document::parse("[a]\n\ny = \"no\"\n", "mine.toml").unwrap();
        let merged = mine.over(base);
        let root = merged.root();
        assert_eq!(root.section("a").number("x", .., "a number"), Some(1.0));
        assert_eq!(root.section("b").number_list("z"), Some(vec![1.0]));
        root.section("a").number("y", .., "a number");
        let faults = merged.into_faults();
        let texts: Vec<String> = faults.iter().map(Fault::to_string).collect();
        assert_eq!(
            texts,
            ["mine.toml:3:1: a.y: found \"no\", expected a number"]
        );
    }

    #[test]
    fn what_is_not_toml_has_a_place() {
        let fault = Document::parse("[a]\nx = = 1\n", "p.toml").unwrap_err();
        assert!(fault.to_string().starts_with("p.toml:2:5: "), "{fault}");
    }
}
