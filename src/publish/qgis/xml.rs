//! The bits of XML that QGIS's files are made of.

/// Text as it stands in an element or an attribute.
pub(super) fn escaped(text: &str) -> String {
    // XML has no way to write the other control characters.
    let is_written = |c: char| !c.is_control() || matches!(c, '\t' | '\n' | '\r');
    crate::publish::svg::escaped_but(text, |c| if is_written(c) { c } else { '\u{fffd}' })
}

/// A text as a literal of QGIS's expressions.
pub(super) fn literal(text: &str) -> String {
    format!("'{}'", text.replace('\\', "\\\\").replace('\'', "''"))
}

/// A map of options.
pub(super) fn options(pairs: &[(&str, String)]) -> String {
    let lines = pairs.iter().map(|(name, value)| {
        format!(
            "<Option type=\"QString\" name=\"{name}\" value=\"{}\"/>\n",
            escaped(value)
        )
    });
    format!(
        "<Option type=\"Map\">\n{}</Option>\n",
        lines.collect::<String>()
    )
}

/// Properties that follow from expressions.
pub(super) fn data_defined(pairs: &[(&str, &str)]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let lines = pairs.iter().map(|(name, expression)| {
        format!(
            "<Option type=\"Map\" name=\"{name}\">\n\
             <Option type=\"bool\" name=\"active\" value=\"true\"/>\n\
             <Option type=\"QString\" name=\"expression\" value=\"{}\"/>\n\
             <Option type=\"int\" name=\"type\" value=\"3\"/>\n</Option>\n",
            escaped(expression)
        )
    });
    format!(
        "<data_defined_properties>\n<Option type=\"Map\">\n\
         <Option type=\"QString\" name=\"name\" value=\"\"/>\n\
         <Option type=\"Map\" name=\"properties\">\n{}</Option>\n\
         <Option type=\"QString\" name=\"type\" value=\"collection\"/>\n</Option>\n\
         </data_defined_properties>\n",
        lines.collect::<String>()
    )
}
