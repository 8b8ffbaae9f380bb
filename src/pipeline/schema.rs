//! The JSON Schema of the pipeline file, for editors.
//!
//! Keys, types and bounds are what the reader of the pipeline file itself asks for; meanings and
//! defaults are the book's. There is no third place in which they are written down.

use std::ops::Bound;

use serde_json::{Map, Value, json};

use super::config::Config;
use crate::input::{Asked, Interval, Takes};

/// The reference page of the book, whose tables say what each key means.
const BOOK: &str = include_str!("../../docs/src/pipeline-file.md");

/// The JSON Schema (draft 2020-12) of the pipeline file.
///
/// Keys overridden on the command line are not in the file, so nothing but `[input]` with its
/// required keys is asked for, as in the file itself.
pub fn schema() -> Value {
    let keys = Config::keys();
    let entries = entries();
    let mut root = table("", &keys, &entries);
    let about = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "rockmap pipeline file",
        "description": "A run of rockmap: inputs, terrain, noise, method, outputs",
    });
    if let (Value::Object(root), Value::Object(mut all)) = (&mut root, about) {
        all.append(root);
        all.insert("required".to_owned(), json!(["input"]));
        return Value::Object(all);
    }
    root
}

/// What the book says of a key.
struct Entry {
    path: String,
    default: String,
    kind: String,
    means: String,
}

/// The rows `| key | type | default | means |` of the book's tables, and its headings of sections.
fn entries() -> Vec<Entry> {
    BOOK.lines().filter_map(row).collect()
}

fn row(line: &str) -> Option<Entry> {
    if let Some(heading) = line.strip_prefix("## `[") {
        let (path, means) = heading.split_once("]`: ")?;
        return Some(Entry {
            path: path.to_owned(),
            default: String::new(),
            kind: String::new(),
            means: means.to_owned(),
        });
    }
    let cells: Vec<&str> = line.strip_prefix("| ")?.split('|').map(str::trim).collect();
    let path = cells.first()?.strip_prefix('`')?.strip_suffix('`')?;
    Some(Entry {
        path: path.to_owned(),
        kind: (*cells.get(1)?).to_owned(),
        default: (*cells.get(2)?).to_owned(),
        means: plain(cells.get(3)?),
    })
}

/// Markdown without its links, of which only the words stay.
fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some((before, link)) = rest.split_once('[') {
        text.push_str(before);
        match link.split_once("](").and_then(|(words, after)| {
            let (_, after) = after.split_once(')')?;
            (!words.contains(']')).then_some((words, after))
        }) {
            Some((words, after)) => {
                text.push_str(words);
                rest = after;
            }
            None => {
                text.push('[');
                rest = link;
            }
        }
    }
    text + rest
}

/// The schema of a table, with all keys below it.
fn table(path: &str, keys: &[Asked], entries: &[Entry]) -> Value {
    let prefix = match path {
        "" => String::new(),
        path => format!("{path}."),
    };
    let mut properties = Map::new();
    let mut required = Vec::new();
    for asked in keys {
        let Some(key) = asked
            .path
            .strip_prefix(&prefix)
            .filter(|k| !k.contains('.'))
        else {
            continue;
        };
        let entry = entries.iter().find(|e| e.path == asked.path);
        let mut of_key = match asked.takes {
            Takes::Table => table(&asked.path, keys, entries),
            _ => value(&asked.takes),
        };
        if let Some(entry) = entry {
            describe(&mut of_key, asked, entry);
            if entry.default.starts_with("required") {
                required.push(key);
            }
        }
        properties.insert(key.to_owned(), of_key);
    }
    // The keys of a table of which none is known are names of the run's own.
    let is_open = properties.is_empty();
    let mut all = json!({
        "type": "object",
        "properties": properties,
        "additionalProperties": is_open,
    });
    if !required.is_empty() {
        all["required"] = json!(required);
    }
    all
}

fn describe(of_key: &mut Value, asked: &Asked, entry: &Entry) {
    of_key["description"] = json!(entry.means.trim_end_matches(':'));
    if let Some(default) = default(&asked.takes, &entry.default) {
        of_key["default"] = default;
    }
    let named: Vec<&str> = entry.kind.split(", ").filter_map(ticked).collect();
    if asked.takes == Takes::Text && !named.is_empty() {
        of_key["examples"] = json!(named);
    }
}

/// A default as the book writes it: JSON, or a word that the key takes.
fn default(takes: &Takes, written: &str) -> Option<Value> {
    let text = ticked(written).unwrap_or(written);
    let words: &[String] = match takes {
        Takes::Words(words) | Takes::NumberOrWord(_, words) => words,
        Takes::Text => &[],
        _ => return serde_json::from_str(text).ok(),
    };
    let is_named = takes == &Takes::Text && ticked(written).is_some() && !written.contains(' ');
    (is_named || words.iter().any(|w| w == text)).then(|| json!(text))
}

/// What stands between two backticks, if the text is no more than that.
fn ticked(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('`')?.strip_suffix('`')?;
    (!inner.contains('`')).then_some(inner)
}

/// The schema of a value.
fn value(takes: &Takes) -> Value {
    match takes {
        Takes::Text => json!({"type": "string"}),
        Takes::Texts => list_or_one(&json!({"type": "string"})),
        Takes::WordList(words) => list_or_one(&json!({"enum": words})),
        Takes::Words(words) => json!({"enum": words}),
        Takes::Boolean => json!({"type": "boolean"}),
        Takes::Number(interval) => number(interval),
        Takes::NumberOrWord(interval, words) => {
            json!({"anyOf": [{"enum": words}, number(interval)]})
        }
        Takes::Integer(low, high) => json!({"type": "integer", "minimum": low, "maximum": high}),
        Takes::Numbers(lengths) => {
            let numbers = |n: &usize| {
                let items = json!({"type": "number"});
                json!({"type": "array", "items": items, "minItems": n, "maxItems": n})
            };
            match lengths.as_slice() {
                [] => json!({"type": "array", "items": {"type": "number"}}),
                lengths => json!({"anyOf": lengths.iter().map(numbers).collect::<Vec<_>>()}),
            }
        }
        Takes::Table => json!({"type": "object"}),
    }
}

fn list_or_one(item: &Value) -> Value {
    json!({"anyOf": [item, {"type": "array", "items": item}]})
}

fn number(interval: &Interval) -> Value {
    let mut all = json!({"type": "number"});
    match interval.low {
        Bound::Included(low) => all["minimum"] = json!(low),
        Bound::Excluded(low) => all["exclusiveMinimum"] = json!(low),
        Bound::Unbounded => {}
    }
    match interval.high {
        Bound::Included(high) => all["maximum"] = json!(high),
        Bound::Excluded(high) => all["exclusiveMaximum"] = json!(high),
        Bound::Unbounded => {}
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_and_bounds_are_the_readers_and_meanings_the_books() {
        let schema = schema();
        let view = &schema["properties"]["view"];
        assert_eq!(view["additionalProperties"], json!(false));
        assert_eq!(
            view["properties"]["fov_deg"],
            json!({
                "type": "number",
                "exclusiveMinimum": 0.0,
                "maximum": 360.0,
                "description": "opening angle of views without a camera, about the body's forward axis",
                "default": 360,
            })
        );
        let aim = &view["properties"]["aim"];
        assert_eq!(aim["anyOf"][0]["enum"], json!(["center", "bottom"]));
        assert_eq!(aim["default"], json!("center"));
        let formats = &schema["properties"]["output"]["properties"]["formats"];
        assert_eq!(formats["default"], json!(["geojson", "gpkg"]));
        assert_eq!(
            schema["properties"]["input"]["required"],
            json!(["poses", "detections"])
        );
    }

    #[test]
    fn links_lose_their_targets_and_other_brackets_stay() {
        assert_eq!(
            plain("see [Output](o.md#x), or `[1, 2]`"),
            "see Output, or `[1, 2]`"
        );
    }

    #[test]
    fn the_book_and_the_reader_know_the_same_keys() {
        let documented: Vec<String> = entries().into_iter().map(|e| e.path).collect();
        let read: Vec<String> = Config::keys().into_iter().map(|a| a.path).collect();
        let unread: Vec<_> = documented.iter().filter(|p| !read.contains(p)).collect();
        assert!(unread.is_empty(), "in the book alone: {unread:?}");
        let silent: Vec<_> = read.iter().filter(|p| !documented.contains(p)).collect();
        assert!(silent.is_empty(), "in the reader alone: {silent:?}");
    }

    /// What the book calls the default is what a pipeline file without the key gets.
    #[test]
    fn defaults_of_the_book_are_the_readers() {
        let text = "[input]\nposes = \"p.csv\"\ndetections = \"d.csv\"\n";
        let path = std::path::Path::new("p.toml");
        let config = Config::parse(text, path, &super::super::Overrides::default()).unwrap();
        let config = serde_json::to_value(config).unwrap();
        let schema = schema();
        let mut n_compared = 0;
        for asked in Config::keys() {
            let mut of_key = &schema;
            let mut found = Some(&config);
            for key in asked.path.split('.') {
                of_key = &of_key["properties"][key];
                found = found.and_then(|f| f.get(key));
            }
            if let (Some(found), default) = (found, &of_key["default"])
                && !default.is_null()
            {
                let same =
                    found == default || found.as_f64() == default.as_f64() && found.is_number();
                assert!(same, "{}: {default} in the book, {found} read", asked.path);
                n_compared += 1;
            }
        }
        assert!(n_compared > 15, "{n_compared}");
    }
}
