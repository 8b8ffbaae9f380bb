//! YAML whose every value knows its place.

use saphyr_parser::{Event, Marker, Parser, ScalarStyle};

use super::Document;
use super::builder::Builder;
use super::document::{Kind, Node};
use crate::error::{Fault, Place};

impl Document {
    /// Parses the first document of a YAML file. `shown` is the name faults call the file by. A key
    /// without a value counts as absent. `%YAML:1.0`, which OpenCV writes for a directive, is
    /// understood.
    ///
    /// # Errors
    /// What is not YAML, a key that stands twice, or an alias, with line and column.
    pub fn parse_yaml(text: &str, shown: &str) -> Result<Self, Fault> {
        let mut builder = Builder::new(shown);
        let body = text.strip_prefix('\u{feff}').unwrap_or(text);
        // The directive is blanked, so that lines keep their numbers.
        let blanked;
        let body = match body.strip_prefix("%YAML:") {
            Some(rest) => {
                blanked = rest.find('\n').map_or("", |end| &rest[end..]);
                blanked
            }
            None => body,
        };
        for event in Parser::new_from_str(body) {
            let (event, span) = event.map_err(|e| {
                let place = place(shown, *e.marker());
                Fault::new(place, "", format!("not YAML: {}", e.info()))
            })?;
            if matches!(event, Event::DocumentEnd) {
                break;
            }
            take(&mut builder, event, place(shown, span.start))?;
        }
        Ok(Document::of(shown, builder.finish()))
    }
}

fn take(builder: &mut Builder<'_>, event: Event<'_>, place: Place) -> Result<(), Fault> {
    match event {
        Event::MappingStart(..) => builder.begin(place, Kind::Table(Vec::new())),
        Event::SequenceStart(..) => builder.begin(place, Kind::List(Vec::new())),
        Event::MappingEnd | Event::SequenceEnd => builder.end(),
        Event::Scalar(text, style, ..) => {
            let kind = match style {
                ScalarStyle::Plain => plain(&text),
                _ => Kind::Text(text.into_owned()),
            };
            builder.put(Node { place, kind })
        }
        Event::Alias(_) => Err(Fault::found(place, "", "an alias", "a plain value")),
        _ => Ok(()),
    }
}

fn place(shown: &str, marker: Marker) -> Place {
    Place {
        file: shown.to_owned(),
        line: Some(marker.line() as u64),
        column: Some(marker.col() as u64 + 1),
    }
}

/// What a scalar without quotes means, by the core schema of YAML 1.2.
fn plain(text: &str) -> Kind {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => return Kind::Other("null".to_owned()),
        "true" | "True" | "TRUE" => return Kind::Boolean(true),
        "false" | "False" | "FALSE" => return Kind::Boolean(false),
        _ => {}
    }
    match text.trim_start_matches(['-', '+']).to_lowercase().as_str() {
        ".inf" => return Kind::Number(f64::INFINITY),
        ".nan" => return Kind::Number(f64::NAN),
        _ => {}
    }
    let numeric = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E');
    match text.parse::<f64>() {
        Ok(number) if text.chars().all(numeric) => Kind::Number(number),
        _ => Kind::Text(text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_places() {
        let text = "%YAML:1.0\n---\nname: \"12\"\nsize: 1.e+01\nempty:\nm: !!opencv-matrix\n   rows: 1\n   data: [ 1., .5,\n       -.Inf ]\nflag: true\n---\nname: other\n";
        let document = Document::parse_yaml(text, "c.yml").unwrap();
        let root = document.root();
        assert_eq!(root.text("name").unwrap(), "12");
        assert_eq!(root.number("size", .., "a number"), Some(10.0));
        assert!(!root.has("empty"));
        assert_eq!(root.boolean("flag"), Some(true));
        let m = root.section("m");
        assert_eq!(m.numbers("data", &[3]), None);
        assert_eq!(
            document.faults_said(),
            ["c.yml:8:4: m.data: found a list of 3, expected a list of 3 finite numbers"]
        );
    }

    #[test]
    fn what_is_not_understood_has_a_place() {
        let fault = |text: &str| Document::parse_yaml(text, "c.yml").unwrap_err().to_string();
        assert!(fault("a: [1, 2\nb: 3\n").starts_with("c.yml:"));
        assert_eq!(
            fault("a: 1\na: 2\n"),
            "c.yml:2:1: a: found the key twice, expected it once"
        );
        assert_eq!(
            fault("a: &x 1\nb: *x\n"),
            "c.yml:2:4: found an alias, expected a plain value"
        );
        assert_eq!(
            fault("? [1]\n: 2\n"),
            "c.yml:1:3: found a key that is no text, expected text"
        );
        assert!(fault(&"[".repeat(200)).contains("more levels than that, expected at most 100"));
    }
}
