//! report.html: one page that opens without a network and shows what each rock rests on.
//!
//! The data stand in the page as JSON; columns with an entry a rock, a detection or a view are
//! packed as little-endian bytes in base64. Style and scripts are files of their own beside this one, put into
//! the page as they stand.

mod charts;
mod coverage;
mod crops;
mod data;
mod packed;

pub use crops::{CropPlan, CutCrop};

use serde_json::Value;

use super::{Product, Rock, Scene};
use crate::input::Reject;

/// What every page has, with a place for everything in it.
const PAGE: &str = include_str!("page.html");
/// Its style.
const STYLE: &str = include_str!("report.css");

/// What a kind of page has of its own.
struct Kind {
    name: &'static str,
    /// The elements that its scripts fill.
    body: &'static str,
    /// In the order in which they stand in the page.
    scripts: &'static [&'static str],
}

/// The report of a run.
const REPORT: Kind = Kind {
    name: "report",
    body: include_str!("report.html"),
    scripts: &[
        include_str!("elements.js"),
        include_str!("data.js"),
        include_str!("grid.js"),
        include_str!("map.js"),
        include_str!("rock.js"),
        include_str!("charts.js"),
        include_str!("changes.js"),
        include_str!("page.js"),
    ],
};
/// A comparison by itself.
const COMPARISON: Kind = Kind {
    name: "compare",
    body: include_str!("changes.html"),
    scripts: &[
        include_str!("elements.js"),
        include_str!("charts.js"),
        include_str!("changes.js"),
        include_str!("changes_page.js"),
    ],
};
/// What stands around the data in a page.
const DATA_MARKS: (&str, &str) = ("id=\"data\">", "</script>");

/// What the report says of the run beside the map.
pub struct Run<'a> {
    /// What the map is called.
    pub title: &'a str,
    /// run.json.
    pub manifest: &'a Value,
    /// Records set aside.
    pub rejects: &'a [Reject],
    /// Where the annotated picture of each view is, relative to the page.
    pub pictures: &'a [Option<String>],
    /// What was planned to be cut from the pictures.
    pub plan: &'a CropPlan,
    /// What was cut.
    pub crops: &'a [CutCrop],
}

impl Scene<'_> {
    /// report.html.
    pub fn report(&self, rocks: &[Rock], run: &Run<'_>) -> Product {
        let data = serde_json::to_string(&data::page(self, rocks, run)).unwrap_or_default();
        Product::new("report.html", REPORT.page(run.title, &data))
    }
}

/// The report of a run as its page holds it; `None` where the page is of another version of the
/// program, whose scripts would not know what this one says.
pub fn held(page: &str) -> Option<Value> {
    let (_, rest) = page.split_once(DATA_MARKS.0)?;
    let (data, _) = rest.split_once(DATA_MARKS.1)?;
    let data: Value = serde_json::from_str(data).ok()?;
    (data["manifest"]["version"] == env!("CARGO_PKG_VERSION")).then_some(data)
}

/// A report with a section on what changed since an earlier map. It stands in another folder than its
/// annotated pictures, and does not lead to them.
pub fn with_changes(mut report: Value, changes: Value) -> String {
    if let Some(pictures) = report["views"]["picture"].as_array_mut() {
        pictures.fill(Value::Null);
    }
    report["changes"] = changes;
    let title = report["title"].as_str().unwrap_or("map").to_owned();
    REPORT.page(&title, &report.to_string())
}

/// A page of what changed, by itself.
pub fn changes_page(title: &str, changes: &Value) -> String {
    let data = serde_json::json!({ "changes": changes }).to_string();
    COMPARISON.page(title, &data)
}

impl Kind {
    /// The page of these data.
    fn page(&self, title: &str, data: &str) -> String {
        let title = escaped(title);
        let parts = [
            ("{{title}}", title.clone()),
            ("{{kind}}", self.name.to_owned()),
            ("{{style}}", STYLE.to_owned()),
            ("{{body}}", self.body.replacen("{{heading}}", &title, 1)),
            // Within a script "<" could end it.
            ("{{data}}", data.replace('<', "\\u003c")),
            ("{{scripts}}", self.scripts.concat()),
        ];
        let mut rest = PAGE;
        let mut html = String::with_capacity(data.len() + 100_000);
        for (name, content) in parts {
            let (before, after) = rest.split_once(name).unwrap_or((rest, ""));
            html.push_str(before);
            html.push_str(&content);
            rest = after;
        }
        html.push_str(rest);
        html
    }
}

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    super::svg::escaped_but(text, |c| c)
}

#[cfg(test)]
mod tests;
