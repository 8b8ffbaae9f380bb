//! Labels of VICAR pictures: `KEY=VALUE` in one long line, in sections that `PROPERTY` begins.

use super::Document;
use super::document::{Group, Kind, Node};
use crate::error::{Fault, Place};

impl Document {
    /// Parses a VICAR label, which tells its own length in `LBLSIZE`; what follows is not looked at.
    /// `shown` is the name faults call the file by.
    ///
    /// Every `PROPERTY` becomes a table of that name; the history of tasks at the end is left out.
    ///
    /// # Errors
    /// What is not such a label, with its column.
    pub fn parse_vicar(text: &str, shown: &str) -> Result<Self, Fault> {
        let mut scanner = Scanner {
            text,
            shown,
            at: 0,
            end: text.len(),
        };
        let mut top = Group::new(String::new(), Place::file(shown));
        let mut property: Option<Group> = None;
        while let Some((place, key, kind)) = scanner.entry()? {
            match (key.as_str(), kind) {
                ("TASK", _) => break,
                ("PROPERTY", Kind::Text(name)) => {
                    let before = property.replace(Group::new(name, place));
                    top.entries.extend(before.map(Group::close));
                }
                (_, kind) => {
                    if let ("LBLSIZE", Kind::Number(size)) = (key.as_str(), &kind) {
                        scanner.limit(*size);
                    }
                    let group = property.as_mut().unwrap_or(&mut top);
                    group.entries.push((key, Node { place, kind }));
                }
            }
        }
        top.entries.extend(property.map(Group::close));
        Ok(Document::of(shown, top.close().1))
    }
}

struct Scanner<'a> {
    text: &'a str,
    shown: &'a str,
    at: usize,
    end: usize,
}

impl Scanner<'_> {
    /// A label is one line; its places are columns.
    fn place(&self) -> Place {
        Place {
            file: self.shown.to_owned(),
            line: Some(1),
            column: Some(self.at as u64 + 1),
        }
    }

    /// The label's length, where the text is not shorter anyhow.
    fn limit(&mut self, size: f64) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a length beyond the text is not taken"
        )]
        let size = size.max(0.0) as usize;
        if size > self.at && size < self.end && self.text.is_char_boundary(size) {
            self.end = size;
        }
    }

    fn rest(&self) -> &str {
        &self.text[self.at..self.end]
    }

    fn blank(&mut self) {
        let rest = self.rest();
        let blanks = rest.len()
            - rest
                .trim_start_matches(|c: char| c.is_whitespace() || c == '\0')
                .len();
        self.at += blanks;
    }

    /// The next key with its value; `None` at the label's end.
    fn entry(&mut self) -> Result<Option<(Place, String, Kind)>, Fault> {
        self.blank();
        if self.rest().is_empty() {
            return Ok(None);
        }
        let place = self.place();
        let rest = self.rest();
        let part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':';
        let end = rest.find(|c| !part(c)).unwrap_or(rest.len());
        let key = rest[..end].to_owned();
        if end == 0 || !rest[end..].trim_start().starts_with('=') {
            let found: String = rest.chars().take(12).collect();
            return Err(Fault::found(place, "", format!("{found:?}"), "KEY=VALUE"));
        }
        self.at += end;
        self.blank();
        self.at += 1;
        let kind = self.value(&key, true)?;
        Ok(Some((place, key, kind)))
    }

    fn value(&mut self, key: &str, may_be_list: bool) -> Result<Kind, Fault> {
        self.blank();
        let place = self.place();
        let rest = self.rest();
        match rest.chars().next() {
            Some('(') if may_be_list => self.list(key),
            Some('\'') => {
                let mut text = String::new();
                let mut inner = &rest[1..];
                // A doubled quote is a quote.
                loop {
                    let Some(end) = inner.find('\'') else {
                        return Err(Fault::found(place, key, "text without an end", "a quote"));
                    };
                    text.push_str(&inner[..end]);
                    inner = &inner[end + 1..];
                    match inner.strip_prefix('\'') {
                        Some(more) => {
                            text.push('\'');
                            inner = more;
                        }
                        None => break,
                    }
                }
                self.at += rest.len() - inner.len();
                Ok(Kind::Text(text))
            }
            _ => {
                let ends = |c: char| c.is_whitespace() || matches!(c, ',' | ')' | '\0');
                let end = rest.find(ends).unwrap_or(rest.len());
                if end == 0 {
                    return Err(Fault::found(place, key, "nothing", "a value"));
                }
                let word = &rest[..end];
                let kind = word
                    .parse::<f64>()
                    .map_or_else(|_| Kind::Text(word.to_owned()), Kind::Number);
                self.at += end;
                Ok(kind)
            }
        }
    }

    fn list(&mut self, key: &str) -> Result<Kind, Fault> {
        let begun = self.place();
        self.at += 1;
        let mut list = Vec::new();
        loop {
            self.blank();
            match self.rest().chars().next() {
                Some(')') => {
                    self.at += 1;
                    return Ok(Kind::List(list));
                }
                None => return Err(Fault::found(begun, key, "a list without an end", "')'")),
                Some(',') => self.at += 1,
                Some(_) => {
                    let place = self.place();
                    let kind = self.value(key, false)?;
                    list.push(Node { place, kind });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_places() {
        let head = "LBLSIZE=220  FORMAT='BYTE'  NL=1024  PROPERTY='MODEL'  A=(1.5,-2e-1, 3)  \
            T='it''s'  N=('X','Y')  PROPERTY='IMAGE_DATA'  LINES=12  TASK='LABEL'  USER='x'  DAT_TIM='now'";
        let text = format!("{head:220}\u{fffd}\u{1}(");
        let document = Document::parse_vicar(&text, "a.vic").unwrap();
        let root = document.root();
        assert_eq!(root.number("NL", .., "a number"), Some(1024.0));
        let model = root.section("MODEL");
        assert_eq!(model.triple("A"), Some([1.5, -0.2, 3.0]));
        assert_eq!(model.text("T").unwrap(), "it's");
        assert_eq!(model.texts("N").unwrap(), ["X", "Y"]);
        root.section("IMAGE_DATA").integer("LINES", 1..=4);
        assert!(!root.has("USER"));
        assert_eq!(
            document.faults_said(),
            ["a.vic:1:121: IMAGE_DATA.LINES: found 12, expected a whole number from 1 to 4"]
        );
    }

    #[test]
    fn what_is_no_label_has_a_place() {
        let fault = |text: &str| {
            Document::parse_vicar(text, "a.vic")
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            fault("LBLSIZE=100 A B"),
            "a.vic:1:13: found \"A B\", expected KEY=VALUE"
        );
        assert_eq!(
            fault("LBLSIZE=100 A=(1,"),
            "a.vic:1:15: A: found a list without an end, expected ')'"
        );
        assert_eq!(
            fault("LBLSIZE=100 A='x"),
            "a.vic:1:15: A: found text without an end, expected a quote"
        );
    }
}
