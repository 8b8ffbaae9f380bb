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

/// The page, with a place for everything in it.
const PAGE: &str = include_str!("report.html");
/// Its style.
const STYLE: &str = include_str!("report.css");
/// Its scripts, in the order in which they stand in the page.
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("grid.js"),
    include_str!("map.js"),
    include_str!("rock.js"),
    include_str!("charts.js"),
    include_str!("page.js"),
];

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
        Product::new("report.html", page(run.title, &data))
    }
}

/// The page of these data.
fn page(title: &str, data: &str) -> String {
    // Within a script "<" could end it.
    let data = data.replace('<', "\\u003c");
    let mut scripts = String::from("\"use strict\";\n");
    for script in SCRIPTS {
        scripts.push_str(script);
    }
    let mut rest = PAGE;
    let mut html = String::with_capacity(data.len() + 100_000);
    let parts = [
        ("{{title}}", escaped(title)),
        ("{{style}}", STYLE.to_owned()),
        ("{{heading}}", escaped(title)),
        ("{{data}}", data),
        ("{{scripts}}", scripts),
    ];
    for (name, content) in parts {
        let (before, after) = rest.split_once(name).unwrap_or((rest, ""));
        html.push_str(before);
        html.push_str(&content);
        rest = after;
    }
    html.push_str(rest);
    html
}

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests;
