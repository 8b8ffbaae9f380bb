//! A file of keys and values in which every value knows its place, read section by section, all
//! faults collected. TOML is read here; YAML, JSON, XML and the labels of space missions beside it.

use std::cell::RefCell;

use toml_edit::{Item, TableLike, Value};

use super::Section;
use super::asked::Asked;
use crate::error::{Fault, Place};

/// A parsed file of keys and values, with the command line's overrides laid over it.
#[derive(Debug)]
pub struct Document {
    pub(super) file: String,
    pub(super) root: Node,
    pub(super) faults: RefCell<Vec<Fault>>,
    pub(super) asked: RefCell<Vec<Asked>>,
}

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) place: Place,
    pub(super) kind: Kind,
}

/// A table that a parser is filling.
pub(super) struct Group {
    pub(super) name: String,
    pub(super) place: Place,
    pub(super) entries: Vec<(String, Node)>,
}

impl Group {
    pub(super) fn new(name: String, place: Place) -> Self {
        Self {
            name,
            place,
            entries: Vec::new(),
        }
    }

    /// The table with its name.
    pub(super) fn close(self) -> (String, Node) {
        let node = Node {
            place: self.place,
            kind: Kind::Table(self.entries),
        };
        (self.name, node)
    }
}

#[derive(Debug, Clone)]
pub(super) enum Kind {
    Text(String),
    Number(f64),
    Boolean(bool),
    List(Vec<Node>),
    Table(Vec<(String, Node)>),
    /// A date, which no key takes, or an empty place in a list.
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
            asked: RefCell::default(),
        })
    }

    /// A document of a tree that a parser made.
    pub(super) fn of(shown: &str, root: Node) -> Self {
        Self {
            file: shown.to_owned(),
            root,
            faults: RefCell::default(),
            asked: RefCell::default(),
        }
    }

    /// Lays this document over another: tables are merged key by key, every other value of this
    /// one replaces the other's. Each value keeps its own file and line.
    #[must_use]
    pub fn over(self, base: Document) -> Document {
        Document {
            file: self.file,
            root: self.root.over(base.root),
            faults: self.faults,
            asked: self.asked,
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
        Section::root(self)
    }

    /// The name faults call the file by.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Takes the faults found since the last call, in the order they were found: those of one record,
    /// where a file is read record by record.
    pub fn take_faults(&self) -> Vec<Fault> {
        std::mem::take(&mut *self.faults.borrow_mut())
    }

    /// [`Self::take_faults`] as they are told.
    #[cfg(test)]
    pub(super) fn faults_said(&self) -> Vec<String> {
        self.take_faults().iter().map(Fault::to_string).collect()
    }

    /// The keys that were asked for, each once, in the order of asking.
    pub fn asked(&self) -> Vec<Asked> {
        self.asked.borrow().clone()
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

    pub(super) fn shown(&self) -> String {
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
