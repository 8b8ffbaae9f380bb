//! XML whose every element knows its place.

use roxmltree::{Document as Tree, Node as Element, TextPos};

use super::Document;
use super::document::{Kind, Node};
use crate::error::{Fault, Place};

/// Deeper than any annotation or calibration nests.
const DEEPEST: usize = 100;

impl Document {
    /// Parses XML. `shown` is the name faults call the file by. The document is a table of one key,
    /// the root element; an element with elements below it is a table, another its text or, where
    /// that is one, its number. Attributes are not kept; empty elements count as absent.
    ///
    /// # Errors
    /// What is not XML, with line and column.
    pub fn parse_xml(text: &str, shown: &str) -> Result<Self, Fault> {
        let tree = Tree::parse(text).map_err(|e| {
            let message = e.to_string();
            let what = message.split(" at ").next().unwrap_or(&message);
            Fault::new(place(shown, e.pos()), "", format!("not XML: {what}"))
        })?;
        let element = tree.root_element();
        let mut entries = Vec::new();
        if let Some(node) = node(&tree, element, shown, DEEPEST)? {
            entries.push((element.tag_name().name().to_owned(), node));
        }
        let root = Node {
            place: Place::file(shown),
            kind: Kind::Table(entries),
        };
        Ok(Document::of(shown, root))
    }
}

fn place(shown: &str, position: TextPos) -> Place {
    Place {
        file: shown.to_owned(),
        line: Some(u64::from(position.row)),
        column: Some(u64::from(position.col)),
    }
}

/// An element as a value; `None` where it is empty.
fn node(
    tree: &Tree<'_>,
    element: Element<'_, '_>,
    shown: &str,
    levels: usize,
) -> Result<Option<Node>, Fault> {
    let place = place(shown, tree.text_pos_at(element.range().start));
    if levels == 0 {
        let expected = format!("at most {DEEPEST}");
        return Err(Fault::found(place, "", "more levels than that", expected));
    }
    let mut entries = Vec::new();
    for child in element.children().filter(Element::is_element) {
        if let Some(below) = node(tree, child, shown, levels - 1)? {
            entries.push((child.tag_name().name().to_owned(), below));
        }
    }
    let text: String = element
        .children()
        .filter_map(|c| c.text().filter(|_| c.is_text()))
        .collect();
    let text = text.trim();
    let kind = if !entries.is_empty() {
        Kind::Table(entries)
    } else if text.is_empty() {
        return Ok(None);
    } else {
        match text.parse::<f64>() {
            Ok(number) if !text.contains(char::is_alphabetic) || number.is_finite() => {
                Kind::Number(number)
            }
            _ => Kind::Text(text.to_owned()),
        }
    };
    Ok(Some(Node { place, kind }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_know_their_places() {
        let text = "<?xml version=\"1.0\"?>\n<a>\n  <b id=\"x\">1</b>\n  <!-- no -->\n  <c> text &amp; more </c>\n  <b>2e1</b><d/><o><n>1</n></o><o><n>x</n></o>\n</a>";
        let document = Document::parse_xml(text, "a.xml").unwrap();
        let a = document.root().section("a");
        assert_eq!(a.text("c").unwrap(), "text & more");
        assert_eq!(a.number("b", .., "a number"), Some(1.0));
        assert!(!a.has("d"));
        let all = a.tables("o");
        assert_eq!(all[0].name("n").unwrap(), "1");
        all[1].number("n", .., "a number");
        assert_eq!(
            document.faults_said(),
            ["a.xml:6:35: a.o[1].n: found \"x\", expected a number"]
        );
    }

    #[test]
    fn what_is_not_xml_has_a_place() {
        let fault = Document::parse_xml("<a>\n<b></a>", "a.xml").unwrap_err();
        assert_eq!(
            fault.to_string(),
            "a.xml:2:4: not XML: expected 'b' tag, not 'a'"
        );
        let deep = format!("{}{}", "<a>".repeat(150), "</a>".repeat(150));
        let fault = Document::parse_xml(&deep, "a.xml").unwrap_err();
        assert!(fault.to_string().contains("more levels than that"));
    }
}
