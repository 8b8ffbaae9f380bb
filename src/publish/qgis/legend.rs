//! What the colours of a layer mean.

use super::super::layer::{Layer, Value};
use super::symbol::{Rgba, Symbol};
use super::xml::literal;

/// A line of a legend: the features that pass a filter, and their symbol.
pub(super) struct Rule {
    /// Its words; empty where the layer has one symbol.
    pub(super) label: String,
    /// An expression; empty for all features.
    pub(super) filter: String,
    /// How they are drawn.
    pub(super) symbol: Symbol,
}

/// From sure to doubtful: viridis, which reads the same in grey and to the colour-blind.
const SURE_TO_DOUBTFUL: [Rgba; 4] = [
    (68, 1, 84, 255),
    (49, 104, 142, 255),
    (53, 183, 121, 255),
    (253, 231, 37, 255),
];

/// Colours of classes, by Okabe and Ito (2008), which the colour-blind can tell apart.
const CLASSES: [Rgba; 7] = [
    (213, 94, 0, 255),
    (0, 114, 178, 255),
    (0, 158, 115, 255),
    (204, 121, 167, 255),
    (230, 159, 0, 255),
    (86, 180, 233, 255),
    (240, 228, 66, 255),
];

const GREY: Rgba = (110, 110, 110, 255);
const INK: Rgba = (31, 41, 55, 255);
const AMBER: Rgba = (217, 119, 6, 200);

/// The legend of a layer.
pub(super) fn rules(layer: &Layer) -> Vec<Rule> {
    match layer.name {
        "rocks" => rocks(layer),
        "ellipses" => one(Symbol::outline((190, 24, 93, 255), 0.2)),
        "footprints" => one(footprint(layer.features.len())),
        "views" => one(view(layer.features.len())),
        "traverse" => one(Symbol::way(INK, 0.5)),
        "compare" => changes(),
        "detections" => one(Symbol::sign("circle", AMBER, 1.6, None)),
        _ => Vec::new(),
    }
}

/// What became of an object between two maps.
fn changes() -> Vec<Rule> {
    let statuses = ["same", "moved", "new", "gone", "unseen"];
    // What stayed is quiet; what changed is not.
    let colours = [
        GREY,
        CLASSES[4],
        CLASSES[2],
        CLASSES[0],
        (200, 200, 200, 255),
    ];
    let rules = statuses
        .into_iter()
        .zip(colours)
        .map(|(status, colour)| Rule {
            label: status.to_owned(),
            filter: format!("\"status\" = {}", literal(status)),
            symbol: Symbol::sign("circle", colour, 2.4, None),
        });
    rules.collect()
}

/// How opaque a layer is as a whole: where many footprints lie, what is under them still shows.
pub(super) fn opacity(layer: &Layer) -> f64 {
    if layer.name == "footprints" { 0.5 } else { 1.0 }
}

/// The more there are, the fainter each.
fn footprint(count: usize) -> Symbol {
    let (fill, edge) = match count {
        0..=30 => (24, 130),
        31..=150 => (10, 70),
        _ => (4, 30),
    };
    Symbol::area((14, 165, 233, fill), (14, 116, 170, edge), 0.12)
}

/// A triangle that points where the body heads; the more there are, the smaller.
fn view(count: usize) -> Symbol {
    let size_mm = match count {
        0..=30 => 2.4,
        31..=150 => 1.8,
        _ => 1.2,
    };
    Symbol::sign("triangle", INK, size_mm, Some("coalesce(\"yaw_deg\", 0)"))
}

fn one(symbol: Symbol) -> Vec<Rule> {
    vec![Rule {
        label: String::new(),
        filter: String::new(),
        symbol,
    }]
}

/// By existence where the method estimates it, or else by class where there are several, or else
/// by the views that agree.
fn rocks(layer: &Layer) -> Vec<Rule> {
    let classes = texts(layer, "class");
    let has_existence = column(layer, "p_exist").any(|v| *v != Value::Null);
    let stone = |label: &str, filter: &str, fill: Rgba| Rule {
        label: label.to_owned(),
        filter: filter.to_owned(),
        symbol: Symbol::stone(fill),
    };
    let sure = |label: &str, filter: &str, i: usize| stone(label, filter, SURE_TO_DOUBTFUL[i]);
    // Bright colours catch the eye; what is doubtful shall not do so more than what is sure.
    let doubtful = |label: &str, filter: &str, i: usize, opacity: u8| {
        let (r, g, b, _) = SURE_TO_DOUBTFUL[i];
        stone(label, filter, (r, g, b, opacity))
    };
    if has_existence {
        return vec![
            sure("exists, 0.9 to 1", "\"p_exist\" >= 0.9", 0),
            sure("0.5 to 0.9", "\"p_exist\" >= 0.5 AND \"p_exist\" < 0.9", 1),
            doubtful(
                "0.2 to 0.5",
                "\"p_exist\" >= 0.2 AND \"p_exist\" < 0.5",
                2,
                190,
            ),
            doubtful("below 0.2", "\"p_exist\" < 0.2", 3, 140),
        ];
    }
    if classes.len() > 1 {
        return by_class(&classes);
    }
    vec![
        sure("seen by 5 views or more", "\"n_views\" >= 5", 0),
        sure("by 3 or 4", "\"n_views\" IN (3, 4)", 1),
        sure("by 2", "\"n_views\" = 2", 2),
        sure("by one or none", "\"n_views\" < 2", 3),
    ]
}

fn by_class(classes: &[&str]) -> Vec<Rule> {
    let named = classes.iter().zip(CLASSES).map(|(class, colour)| Rule {
        label: (*class).to_owned(),
        filter: format!("\"class\" = {}", literal(class)),
        symbol: Symbol::stone(colour),
    });
    let rest = Rule {
        label: "other".to_owned(),
        filter: "ELSE".to_owned(),
        symbol: Symbol::stone(GREY),
    };
    named.chain([rest]).collect()
}

fn column<'a>(layer: &'a Layer, name: &str) -> impl Iterator<Item = &'a Value> {
    let at = layer.fields.iter().position(|f| f.name == name);
    let features = layer.features.iter();
    features.filter_map(move |f| f.values.get(at?))
}

/// The different texts of a column, sorted.
fn texts<'a>(layer: &'a Layer, name: &str) -> Vec<&'a str> {
    let mut all: Vec<&str> = column(layer, name)
        .filter_map(|value| match value {
            Value::Text(text) => Some(text.as_str()),
            _ => None,
        })
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}
