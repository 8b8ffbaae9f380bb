//! What QGIS shows a map by: a style for each layer (QML), and a project of all of them (QGZ).

mod legend;
mod project;
mod symbol;
mod xml;

pub(super) use project::local_crs;
pub use project::{Project, qgz};

use super::layer::{Kind, Layer};
use legend::{Rule, opacity, rules};
use xml::escaped;

/// Labels appear at scales larger than one to this.
const LABELS_FROM: u32 = 75;

/// A layer's style as a QML file.
pub fn qml(layer: &Layer) -> String {
    format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n\
         <qgis version=\"3.22.0\" styleCategories=\"Symbology|Labeling|Fields|Rendering\" \
         hasScaleBasedVisibilityFlag=\"0\">\n{}</qgis>\n",
        style(layer)
    )
}

/// The elements of a style, which a project's layer holds as well.
fn style(layer: &Layer) -> String {
    let rules = rules(layer);
    let kind = match layer.geometry {
        Some(Kind::Point) => 0,
        Some(Kind::Line) => 1,
        Some(Kind::Polygon) => 2,
        None => 4,
    };
    format!(
        "{}{}<blendMode>0</blendMode>\n<featureBlendMode>0</featureBlendMode>\n\
         <layerOpacity>{}</layerOpacity>\n{}<layerGeometryType>{kind}</layerGeometryType>\n",
        renderer(&rules),
        labels(layer),
        opacity(layer),
        meanings(layer)
    )
}

fn renderer(rules: &[Rule]) -> String {
    let symbols: Vec<String> = rules
        .iter()
        .enumerate()
        .map(|(i, rule)| rule.symbol.text(i))
        .collect();
    let symbols = symbols.concat();
    let attributes = "symbollevels=\"0\" forceraster=\"0\" enableorderby=\"0\"";
    if let [only] = rules
        && only.filter.is_empty()
    {
        return format!(
            "<renderer-v2 type=\"singleSymbol\" {attributes}>\n<symbols>\n{symbols}</symbols>\n\
             </renderer-v2>\n"
        );
    }
    let lines = rules.iter().enumerate().map(|(i, rule)| {
        format!(
            "<rule key=\"{{rule-{i}}}\" symbol=\"{i}\" label=\"{}\" filter=\"{}\"/>\n",
            escaped(&rule.label),
            escaped(&rule.filter)
        )
    });
    format!(
        "<renderer-v2 type=\"RuleRenderer\" {attributes}>\n<rules key=\"{{rules}}\">\n{}</rules>\n\
         <symbols>\n{symbols}</symbols>\n</renderer-v2>\n",
        lines.collect::<String>()
    )
}

/// Names of rocks, close by.
fn labels(layer: &Layer) -> String {
    if layer.name != "rocks" {
        return String::new();
    }
    format!(
        "<labeling type=\"simple\">\n<settings calloutType=\"simple\">\n\
         <text-style fieldName=\"rock_id\" isExpression=\"0\" fontFamily=\"Noto Sans\" \
         fontSize=\"8\" fontWeight=\"63\" fontSizeUnit=\"Point\" textColor=\"31,41,55,255\" textOpacity=\"1\">\n\
         <text-buffer bufferDraw=\"1\" bufferSize=\"0.8\" bufferSizeUnits=\"MM\" \
         bufferColor=\"255,255,255,230\" bufferOpacity=\"1\"/>\n</text-style>\n\
         <placement placement=\"6\" dist=\"0.6\" distUnits=\"MM\" offsetType=\"1\" \
         predefinedPositionOrder=\"TR,R,BR,TL,L,BL,TSR,BSR\"/>\n\
         <rendering scaleVisibility=\"1\" scaleMin=\"0\" scaleMax=\"{LABELS_FROM}\" \
         obstacle=\"1\" displayAll=\"0\"/>\n</settings>\n</labeling>\n"
    )
}

/// What the columns mean, as QGIS shows it in its forms.
fn meanings(layer: &Layer) -> String {
    let aliases = layer.fields.iter().enumerate().map(|(i, field)| {
        format!(
            "<alias index=\"{i}\" field=\"{}\" name=\"{}\"/>\n",
            field.name,
            escaped(field.about)
        )
    });
    format!("<aliases>\n{}</aliases>\n", aliases.collect::<String>())
}

#[cfg(test)]
mod tests;
