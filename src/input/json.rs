//! JSON whose every value knows its place.

use serde::de::IgnoredAny;

use super::Document;
use super::builder::Builder;
use super::document::{Kind, Node};
use crate::error::{Fault, Place};

impl Document {
    /// Parses JSON. `shown` is the name faults call the file by. A key whose value is `null` counts
    /// as absent.
    ///
    /// # Errors
    /// What is not JSON, or a key that stands twice, with line and column.
    pub fn parse_json(text: &str, shown: &str) -> Result<Self, Fault> {
        // The library checks the whole text; the walk below only has to find where its values stand.
        serde_json::from_str::<IgnoredAny>(text).map_err(|e| {
            let place = Place {
                file: shown.to_owned(),
                line: Some(e.line() as u64),
                column: Some(e.column() as u64),
            };
            let message = e.to_string();
            let what = message.split(" at line ").next().unwrap_or(&message);
            Fault::new(place, "", format!("not JSON: {what}"))
        })?;
        let mut walk = Walk {
            text,
            shown,
            at: 0,
            counted: 0,
            line: 1,
            column: 1,
        };
        let mut builder = Builder::new(shown);
        while let Some(first) = walk.peek() {
            let place = walk.place();
            walk.take(first, place, &mut builder)?;
        }
        Ok(Document::of(shown, builder.finish()))
    }
}

/// A walk through text that is known to be JSON.
struct Walk<'a> {
    text: &'a str,
    shown: &'a str,
    at: usize,
    /// Up to where lines and columns have been counted.
    counted: usize,
    line: u64,
    column: u64,
}

impl Walk<'_> {
    fn place(&mut self) -> Place {
        for c in self.text[self.counted..self.at].chars() {
            if c == '\n' {
                self.line += 1;
                self.column = 1;
            } else {
                self.column += 1;
            }
        }
        self.counted = self.at;
        Place {
            file: self.shown.to_owned(),
            line: Some(self.line),
            column: Some(self.column),
        }
    }

    /// The next byte that says something; `None` at the end.
    fn peek(&mut self) -> Option<u8> {
        let bytes = self.text.as_bytes();
        while let Some(b' ' | b'\t' | b'\r' | b'\n' | b',' | b':') = bytes.get(self.at) {
            self.at += 1;
        }
        bytes.get(self.at).copied()
    }

    /// Takes what begins with this byte into the tree.
    fn take(&mut self, first: u8, place: Place, tree: &mut Builder<'_>) -> Result<(), Fault> {
        let kind = match first {
            b'{' | b'[' | b'}' | b']' => {
                self.at += 1;
                return match first {
                    b'{' => tree.begin(place, Kind::Table(Vec::new())),
                    b'[' => tree.begin(place, Kind::List(Vec::new())),
                    _ => tree.end(),
                };
            }
            b'"' => Kind::Text(self.string()?),
            _ => match self.bare() {
                "true" => Kind::Boolean(true),
                "false" => Kind::Boolean(false),
                "null" => Kind::Other("null".to_owned()),
                number => Kind::Number(number.parse().unwrap_or(f64::NAN)),
            },
        };
        tree.put(Node { place, kind })
    }

    /// The string that begins here.
    fn string(&mut self) -> Result<String, Fault> {
        let bytes = self.text.as_bytes();
        let start = self.at;
        self.at += 1;
        while let Some(&b) = bytes.get(self.at) {
            self.at += if b == b'\\' { 2 } else { 1 };
            if b == b'"' {
                break;
            }
        }
        let quoted = &self.text[start..self.at];
        serde_json::from_str(quoted)
            .map_err(|_| Fault::found(self.place(), "", quoted, "text of whole characters"))
    }

    /// The number or word that begins here.
    fn bare(&mut self) -> &str {
        let rest = &self.text[self.at..];
        let ends = |c: char| c.is_whitespace() || matches!(c, ',' | ']' | '}');
        let word = &rest[..rest.find(ends).unwrap_or(rest.len())];
        self.at += word.len();
        word
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_places() {
        let text = "{\"a\": [1, null, -2.5e1],\n \"b\\u00e9\": {\"c\": \"x\\\"y\", \"n\": null},\n\t\"list\": [{\"u\": true}, {}]}";
        let document = Document::parse_json(text, "d.json").unwrap();
        let root = document.root();
        assert_eq!(
            root.place("b\u{e9}"),
            Place {
                file: "d.json".into(),
                line: Some(2),
                column: Some(2)
            }
        );
        let b = root.section("b\u{e9}");
        assert_eq!(b.text("c").unwrap(), "x\"y");
        assert!(!b.has("n"));
        let rows = root.tables("list");
        assert_eq!(rows[0].boolean("u"), Some(true));
        rows[1].fault("u", "nothing", "a number");
        root.number_list("a");
        assert_eq!(
            document.faults_said(),
            [
                "d.json:3:24: list[1].u: found nothing, expected a number",
                "d.json:1:2: a: found a list of 3, expected a list of finite numbers",
            ]
        );
        let list = Document::parse_json(" [{\"a\": 1}]", "d.json").unwrap();
        assert_eq!(list.root().rows().unwrap()[0].name("a").unwrap(), "1");
    }

    #[test]
    fn what_is_not_json_has_a_place() {
        let fault = |text| {
            Document::parse_json(text, "d.json")
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            fault("{\"a\": 1,\n \"b\": }"),
            "d.json:2:7: not JSON: expected value"
        );
        assert_eq!(
            fault("{\"a\": 1,\n \"a\": 2}"),
            "d.json:2:2: a: found the key twice, expected it once"
        );
        assert_eq!(
            fault("[1, 2"),
            "d.json:1:5: not JSON: EOF while parsing a list"
        );
        let deep = format!("{}{}", "[".repeat(10_000), "]".repeat(10_000));
        assert_eq!(
            Document::parse_json(&deep, "d.json")
                .unwrap_err()
                .to_string(),
            "d.json:1:101: found more levels than that, expected at most 100"
        );
    }
}
