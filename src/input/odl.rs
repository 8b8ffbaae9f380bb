//! Labels in ODL, the Object Description Language of NASA's archives (PDS Standards Reference 3.8,
//! chapter 12), attached to a picture or in a file of their own.

use super::Document;
use super::document::{Group, Kind, Node};
use crate::error::{Fault, Place};

/// Deeper than any label nests.
const DEEPEST: usize = 20;

impl Document {
    /// Parses a label up to its `END`; what follows, a picture perhaps, is not looked at. `shown` is
    /// the name faults call the file by.
    ///
    /// `GROUP` and `OBJECT` become tables, sequences and sets lists. The name space of a keyword
    /// (`MSL:`) is dropped, and a keyword may stand several times. The unit of `KEY` stands under
    /// `KEY__UNIT`, as VICAR labels have it; that of a list is the list of its values' units.
    ///
    /// # Errors
    /// What is not ODL, with line and column.
    pub fn parse_odl(text: &str, shown: &str) -> Result<Self, Fault> {
        let mut scanner = Scanner::new(text, shown);
        let mut top = Group::new(String::new(), Place::file(shown));
        let mut open: Vec<Group> = Vec::new();
        while let Some((place, keyword)) = scanner.keyword()? {
            match keyword {
                "END" => break,
                "GROUP" | "OBJECT" | "BEGIN_GROUP" | "BEGIN_OBJECT" => {
                    scanner.equals(keyword)?;
                    let name = scanner.word("the name of a group")?;
                    if open.len() >= DEEPEST {
                        let expected = format!("at most {DEEPEST}");
                        let found = "more groups than that";
                        return Err(Fault::found(place, name, found, expected));
                    }
                    open.push(Group::new(name, place));
                }
                "END_GROUP" | "END_OBJECT" => {
                    let group = scanner.end(place, keyword, open.pop())?;
                    open.last_mut().unwrap_or(&mut top).entries.push(group);
                }
                _ => {
                    scanner.equals(keyword)?;
                    let (kind, unit) = scanner.value(keyword, DEEPEST)?;
                    let name = keyword.rsplit(':').next().unwrap_or(keyword).to_owned();
                    let group = open.last_mut().unwrap_or(&mut top);
                    if let Some(kind) = unit {
                        let place = place.clone();
                        let unit = (format!("{name}__UNIT"), Node { place, kind });
                        group.entries.push(unit);
                    }
                    group.entries.push((name, Node { place, kind }));
                }
            }
        }
        if let Some(Group { name, place, .. }) = open.pop() {
            let found = "no end of this group";
            return Err(Fault::found(place, name, found, "END_GROUP"));
        }
        Ok(Document::of(shown, top.close().1))
    }
}

struct Scanner<'a> {
    rest: &'a str,
    shown: &'a str,
    line: u64,
    column: u64,
}

impl<'a> Scanner<'a> {
    fn new(text: &'a str, shown: &'a str) -> Self {
        Self {
            rest: text.strip_prefix('\u{feff}').unwrap_or(text),
            shown,
            line: 1,
            column: 1,
        }
    }

    fn place(&self) -> Place {
        Place {
            file: self.shown.to_owned(),
            line: Some(self.line),
            column: Some(self.column),
        }
    }

    /// Takes the first `bytes` of what is left.
    fn take(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(bytes);
        for c in taken.chars() {
            if c == '\n' {
                self.line += 1;
                self.column = 1;
            } else {
                self.column += 1;
            }
        }
        self.rest = rest;
        taken
    }

    /// Takes blanks and comments.
    fn blank(&mut self) -> Result<(), Fault> {
        loop {
            let blank = |c: char| !(c.is_whitespace() || c == '\0');
            let end = self.rest.find(blank).unwrap_or(self.rest.len());
            self.take(end);
            if !self.rest.starts_with("/*") {
                return Ok(());
            }
            let Some(end) = self.rest.find("*/") else {
                let place = self.place();
                return Err(Fault::found(place, "", "a comment without an end", "*/"));
            };
            self.take(end + 2);
        }
    }

    /// The next keyword and its place; `None` at the end of the text.
    fn keyword(&mut self) -> Result<Option<(Place, &'a str)>, Fault> {
        self.blank()?;
        if self.rest.is_empty() {
            return Ok(None);
        }
        let place = self.place();
        let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ':' | '^' | '-');
        let end = self.rest.find(|c| !part(c)).unwrap_or(self.rest.len());
        if end == 0 {
            let found: String = self.rest.chars().take(1).collect();
            return Err(Fault::found(place, "", format!("{found:?}"), "a keyword"));
        }
        Ok(Some((place, self.take(end))))
    }

    fn has_equals(&mut self) -> bool {
        let is = self.blank().is_ok() && self.rest.starts_with('=');
        if is {
            self.take(1);
        }
        is
    }

    fn equals(&mut self, keyword: &str) -> Result<(), Fault> {
        if self.has_equals() {
            return Ok(());
        }
        Err(Fault::found(
            self.place(),
            keyword,
            "no value",
            "= and a value",
        ))
    }

    /// The end of a group, which may name it.
    fn end(
        &mut self,
        place: Place,
        keyword: &str,
        open: Option<Group>,
    ) -> Result<(String, Node), Fault> {
        let Some(group) = open else {
            return Err(Fault::found(place, keyword, "an end", "a GROUP before it"));
        };
        if self.has_equals() {
            let named = self.word("the name of a group")?;
            if named != group.name {
                return Err(Fault::found(place, keyword, named, group.name));
            }
        }
        Ok(group.close())
    }

    fn word(&mut self, expected: &str) -> Result<String, Fault> {
        self.blank()?;
        let place = self.place();
        match self.value("", 1)?.0 {
            Kind::Text(text) => Ok(text),
            other => Err(Fault::found(place, "", shown(other), expected)),
        }
    }

    /// A value and its unit.
    fn value(&mut self, keyword: &str, levels: usize) -> Result<(Kind, Option<Kind>), Fault> {
        self.blank()?;
        let place = self.place();
        let kind = match self.rest.chars().next() {
            Some('(' | '{') if levels > 0 => return self.list(keyword, levels),
            Some(quote @ ('"' | '\'')) => {
                let Some(end) = self.rest[1..].find(quote) else {
                    return Err(Fault::found(
                        place,
                        keyword,
                        "text without an end",
                        "a quote",
                    ));
                };
                let quoted = self.take(end + 2);
                let words = quoted[1..=end].split_whitespace();
                Kind::Text(words.collect::<Vec<_>>().join(" "))
            }
            _ => {
                let ends = |c: char| {
                    c.is_whitespace() || matches!(c, ',' | ')' | '}' | '<' | '(' | '{' | '\0')
                };
                let end = self.rest.find(ends).unwrap_or(self.rest.len());
                if end == 0 {
                    return Err(Fault::found(place, keyword, "nothing", "a value"));
                }
                bare(self.take(end))
            }
        };
        let unit = self.unit(keyword)?;
        Ok((kind, unit.map(Kind::Text)))
    }

    /// A list, and the list of its values' units where any has one; a unit behind the whole list is that
    /// of every value.
    fn list(&mut self, keyword: &str, levels: usize) -> Result<(Kind, Option<Kind>), Fault> {
        let close = if self.rest.starts_with('(') { ')' } else { '}' };
        let begun = self.place();
        self.take(1);
        let (mut list, mut units) = (Vec::new(), Vec::new());
        let mut has_unit = false;
        loop {
            self.blank()?;
            if self.rest.starts_with(close) {
                self.take(1);
                let common = self.unit(keyword)?.map(Kind::Text);
                let own = has_unit.then_some(Kind::List(units));
                return Ok((Kind::List(list), common.or(own)));
            }
            if self.rest.is_empty() {
                let found = "a list without an end";
                return Err(Fault::found(begun, keyword, found, format!("{close:?}")));
            }
            let place = self.place();
            let (kind, unit) = self.value(keyword, levels - 1)?;
            has_unit |= unit.is_some();
            units.push(Node {
                place: place.clone(),
                kind: unit.unwrap_or_else(|| Kind::Text(String::new())),
            });
            list.push(Node { place, kind });
            self.blank()?;
            if self.rest.starts_with(',') {
                self.take(1);
            }
        }
    }

    /// Takes a unit, `<rad>`, if one follows.
    fn unit(&mut self, keyword: &str) -> Result<Option<String>, Fault> {
        let blanks = self.rest.len() - self.rest.trim_start_matches([' ', '\t']).len();
        if !self.rest[blanks..].starts_with('<') {
            return Ok(None);
        }
        match self.rest.find('>') {
            Some(end) => {
                let unit = self.take(end + 1);
                let unit = unit.trim_start().trim_matches(['<', '>']).trim();
                Ok(Some(unit.to_owned()))
            }
            None => Err(Fault::found(
                self.place(),
                keyword,
                "a unit without an end",
                "\">\"",
            )),
        }
    }
}

fn bare(word: &str) -> Kind {
    let numeric = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E');
    match word.parse::<f64>() {
        Ok(number) if word.chars().all(numeric) => Kind::Number(number),
        _ => Kind::Text(word.to_owned()),
    }
}

fn shown(kind: Kind) -> String {
    Node {
        place: Place::default(),
        kind,
    }
    .shown()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABEL: &str = "PDS_VERSION_ID = PDS3\r\n/* a comment\r\n over lines */\r\n^IMAGE = 25\r\n\
        MSL:REQUEST_ID = \"7\"\r\nNOTE = \"two\r\n     words\"\r\n\
        GROUP = MODEL\r\n  A = (1.5 <m>, -2.0e-1 <m>,\r\n   3)\r\n  S = {X, 'Y Z'}\r\n  MASK = 2#0011#\r\n\
        END_GROUP = MODEL\r\nOBJECT = IMAGE\r\n LINES = 1024 <pixel>\r\nEND_OBJECT\r\nEND\r\n\0\u{1}binary = (((";

    #[test]
    fn values_know_their_places() {
        let document = Document::parse_odl(LABEL, "a.lbl").unwrap();
        let root = document.root();
        assert_eq!(root.text("REQUEST_ID").unwrap(), "7");
        assert_eq!(root.text("NOTE").unwrap(), "two words");
        assert_eq!(root.number("^IMAGE", .., "a number"), Some(25.0));
        let model = root.section("MODEL");
        assert_eq!(model.triple("A"), Some([1.5, -0.2, 3.0]));
        assert_eq!(model.texts("A__UNIT").unwrap(), ["m", "m", ""]);
        assert_eq!(model.texts("S").unwrap(), ["X", "Y Z"]);
        assert_eq!(model.text("MASK").unwrap(), "2#0011#");
        let image = root.section("IMAGE");
        assert_eq!(image.integer("LINES", 1..=4), None);
        assert_eq!(image.words("LINES__UNIT").unwrap(), ["pixel"]);
        assert_eq!(image.words("LINES").unwrap(), ["1024"]);
        assert_eq!(
            document.faults_said(),
            ["a.lbl:15:2: IMAGE.LINES: found 1024, expected a whole number from 1 to 4"]
        );
    }

    #[test]
    fn what_is_not_odl_has_a_place() {
        let fault = |text: &str| Document::parse_odl(text, "a.lbl").unwrap_err().to_string();
        assert_eq!(
            fault("A = 1\nGROUP = G\nB = (1, 2\n"),
            "a.lbl:3:5: B: found a list without an end, expected ')'"
        );
        assert_eq!(
            fault("GROUP = G\nEND_GROUP = H\n"),
            "a.lbl:2:1: END_GROUP: found H, expected G"
        );
        assert_eq!(
            fault("GROUP = G\nB = 1\nEND\n"),
            "a.lbl:1:1: G: found no end of this group, expected END_GROUP"
        );
        assert_eq!(
            fault("A 1\n"),
            "a.lbl:1:3: A: found no value, expected = and a value"
        );
        assert_eq!(
            fault("A = \"x\n"),
            "a.lbl:1:5: A: found text without an end, expected a quote"
        );
        assert_eq!(
            fault("END_GROUP\n"),
            "a.lbl:1:1: END_GROUP: found an end, expected a GROUP before it"
        );
        assert_eq!(
            fault("A = 1 <m\n"),
            "a.lbl:1:6: A: found a unit without an end, expected \">\""
        );
    }
}
