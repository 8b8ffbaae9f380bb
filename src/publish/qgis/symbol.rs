//! Symbols of QGIS.

use super::xml::{data_defined, options};

/// A colour with its opacity, each 0 to 255.
pub(super) type Rgba = (u8, u8, u8, u8);

/// A symbol: parts drawn one over the other.
#[derive(Debug, Clone)]
pub(super) struct Symbol {
    parts: Vec<Part>,
}

/// A part of a symbol.
#[derive(Debug, Clone)]
enum Part {
    /// A round stone as large as on the ground, and never too small to be seen.
    Stone { fill: Rgba },
    /// A small sign of fixed size, turned to a heading.
    Sign {
        shape: &'static str,
        fill: Rgba,
        size_mm: f64,
        heading: Option<&'static str>,
    },
    /// A line.
    Line { colour: Rgba, width_mm: f64 },
    /// An area.
    Area {
        fill: Rgba,
        edge: Rgba,
        width_mm: f64,
    },
}

const WHITE: Rgba = (255, 255, 255, 255);

impl Symbol {
    /// A rock, as large as its diameter says; without one, small.
    pub(super) fn stone(fill: Rgba) -> Self {
        Self::of(Part::Stone { fill })
    }

    /// A small sign, turned by an expression in degrees clockwise if there is one.
    pub(super) fn sign(
        shape: &'static str,
        fill: Rgba,
        size_mm: f64,
        heading: Option<&'static str>,
    ) -> Self {
        Self::of(Part::Sign {
            shape,
            fill,
            size_mm,
            heading,
        })
    }

    /// A line in a white casing.
    pub(super) fn way(colour: Rgba, width_mm: f64) -> Self {
        let casing = Part::Line {
            colour: WHITE,
            width_mm: width_mm * 2.2,
        };
        Self {
            parts: vec![casing, Part::Line { colour, width_mm }],
        }
    }

    /// An edge in a white casing around nothing, which shows on dark and on light.
    pub(super) fn outline(colour: Rgba, width_mm: f64) -> Self {
        let (clear, casing) = ((255, 255, 255, 0), (255, 255, 255, 170));
        let ring = |edge: Rgba, width_mm: f64| Part::Area {
            fill: clear,
            edge,
            width_mm,
        };
        Self {
            parts: vec![ring(casing, width_mm * 2.6), ring(colour, width_mm)],
        }
    }

    /// An area with an edge.
    pub(super) fn area(fill: Rgba, edge: Rgba, width_mm: f64) -> Self {
        Self::of(Part::Area {
            fill,
            edge,
            width_mm,
        })
    }

    fn of(part: Part) -> Self {
        Self { parts: vec![part] }
    }

    /// The symbol of this number as XML.
    pub(super) fn text(&self, number: usize) -> String {
        let kind = match self.parts.first() {
            Some(Part::Line { .. }) => "line",
            Some(Part::Area { .. }) => "fill",
            _ => "marker",
        };
        let parts: Vec<String> = self.parts.iter().map(Part::text).collect();
        format!(
            "<symbol type=\"{kind}\" name=\"{number}\" alpha=\"1\" clip_to_extent=\"1\" \
             force_rhr=\"0\">\n{}</symbol>\n",
            parts.concat()
        )
    }
}

impl Part {
    fn text(&self) -> String {
        let (class, pairs, defined) = match *self {
            Self::Stone { fill } => stone(fill),
            Self::Sign {
                shape,
                fill,
                size_mm,
                heading,
            } => sign(shape, fill, size_mm, heading),
            Self::Line { colour, width_mm } => line(colour, width_mm),
            Self::Area {
                fill,
                edge,
                width_mm,
            } => area(fill, edge, width_mm),
        };
        format!(
            "<layer class=\"{class}\" enabled=\"1\" locked=\"0\" pass=\"0\">\n{}{}</layer>\n",
            options(&pairs),
            data_defined(&defined)
        )
    }
}

/// A part's class, its options, and those that follow from expressions.
type Content = (
    &'static str,
    Vec<(&'static str, String)>,
    Vec<(&'static str, &'static str)>,
);

fn stone(fill: Rgba) -> Content {
    let pairs = vec![
        ("name", "circle".to_owned()),
        ("color", colour(fill)),
        ("outline_color", colour(WHITE)),
        ("outline_style", "solid".to_owned()),
        ("outline_width", "0.25".to_owned()),
        ("outline_width_unit", "MM".to_owned()),
        ("size", "0.2".to_owned()),
        // Metres on the ground, at least 2 mm on the screen.
        ("size_unit", "RenderMetersInMapUnits".to_owned()),
        ("size_map_unit_scale", "3x:0,0,1,2,0,0".to_owned()),
        ("scale_method", "diameter".to_owned()),
    ];
    (
        "SimpleMarker",
        pairs,
        vec![("size", "coalesce(\"diameter_m\", 0.2)")],
    )
}

fn sign(shape: &'static str, fill: Rgba, size_mm: f64, heading: Option<&'static str>) -> Content {
    let pairs = vec![
        ("name", shape.to_owned()),
        ("color", colour(fill)),
        ("outline_color", colour(WHITE)),
        ("outline_style", "solid".to_owned()),
        ("outline_width", "0.15".to_owned()),
        ("outline_width_unit", "MM".to_owned()),
        ("size", size_mm.to_string()),
        ("size_unit", "MM".to_owned()),
        ("scale_method", "diameter".to_owned()),
    ];
    let defined = heading.map(|expression| ("angle", expression));
    ("SimpleMarker", pairs, defined.into_iter().collect())
}

fn line(rgba: Rgba, width_mm: f64) -> Content {
    let pairs = vec![
        ("line_color", colour(rgba)),
        ("line_style", "solid".to_owned()),
        ("line_width", width_mm.to_string()),
        ("line_width_unit", "MM".to_owned()),
        ("capstyle", "round".to_owned()),
        ("joinstyle", "round".to_owned()),
    ];
    ("SimpleLine", pairs, Vec::new())
}

fn area(fill: Rgba, edge: Rgba, width_mm: f64) -> Content {
    let pairs = vec![
        ("color", colour(fill)),
        ("style", "solid".to_owned()),
        ("outline_color", colour(edge)),
        ("outline_style", "solid".to_owned()),
        ("outline_width", width_mm.to_string()),
        ("outline_width_unit", "MM".to_owned()),
        ("joinstyle", "round".to_owned()),
    ];
    ("SimpleFill", pairs, Vec::new())
}

fn colour((r, g, b, a): Rgba) -> String {
    format!("{r},{g},{b},{a}")
}
