//! Trees of values as parsers of JSON and YAML come upon them.

use super::document::{Kind, Node};
use crate::error::{Fault, Place};

/// Deeper than any calibration, or list of cameras or annotations, nests.
const DEEPEST: usize = 100;

/// A table or list that is being filled.
struct Open {
    place: Place,
    kind: Kind,
    /// The key that waits for its value, in a table.
    key: Option<(String, Place)>,
}

/// A tree in the making, of what a parser comes upon, in order.
pub(super) struct Builder<'a> {
    shown: &'a str,
    open: Vec<Open>,
    root: Option<Node>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(shown: &'a str) -> Self {
        Self {
            shown,
            open: Vec::new(),
            root: None,
        }
    }

    /// A table or list begins.
    ///
    /// # Errors
    /// One in place of a key, or too many in each other.
    pub(super) fn begin(&mut self, place: Place, kind: Kind) -> Result<(), Fault> {
        if let Some(Open {
            kind: Kind::Table(_),
            key: None,
            ..
        }) = self.open.last()
        {
            return Err(Fault::found(place, "", "a key that is no text", "text"));
        }
        if self.open.len() >= DEEPEST {
            let expected = format!("at most {DEEPEST}");
            return Err(Fault::found(place, "", "more levels than that", expected));
        }
        self.open.push(Open {
            place,
            kind,
            key: None,
        });
        Ok(())
    }

    /// The table or list that began last ends.
    ///
    /// # Errors
    /// As [`Builder::put`].
    pub(super) fn end(&mut self) -> Result<(), Fault> {
        match self.open.pop() {
            Some(Open { place, kind, .. }) => self.put(Node { place, kind }),
            None => Ok(()),
        }
    }

    /// Gives a finished value its place in the tree; in a table every other one is a key.
    ///
    /// # Errors
    /// A key that stands twice.
    pub(super) fn put(&mut self, node: Node) -> Result<(), Fault> {
        let Some(parent) = self.open.last_mut() else {
            self.root.get_or_insert(node);
            return Ok(());
        };
        match &mut parent.kind {
            Kind::List(list) => list.push(node),
            Kind::Table(entries) => match parent.key.take() {
                None => {
                    let key = key_text(node.kind);
                    if entries.iter().any(|(k, _)| *k == key) {
                        return Err(Fault::found(node.place, key, "the key twice", "it once"));
                    }
                    parent.key = Some((key, node.place));
                }
                Some((key, place)) => {
                    if !matches!(&node.kind, Kind::Other(word) if word == "null") {
                        let kind = node.kind;
                        entries.push((key, Node { place, kind }));
                    }
                }
            },
            _ => {}
        }
        Ok(())
    }

    /// The tree; of several the first.
    pub(super) fn finish(self) -> Node {
        Node {
            place: Place::file(self.shown),
            kind: self.root.map_or(Kind::Table(Vec::new()), |n| n.kind),
        }
    }
}

fn key_text(kind: Kind) -> String {
    match kind {
        Kind::Text(text) | Kind::Other(text) => text,
        Kind::Number(x) => x.to_string(),
        Kind::Boolean(b) => b.to_string(),
        Kind::List(_) | Kind::Table(_) => String::new(),
    }
}
