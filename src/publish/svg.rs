//! The little of SVG that maps and plots need.

/// An SVG document as it grows.
pub struct Svg {
    body: String,
}

/// A rectangle on the page, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Svg {
    /// An empty page, pixels.
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            body: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" \
                 height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
                 font-family=\"Noto Sans, DejaVu Sans, Helvetica, Arial, sans-serif\">\n\
                 <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
            ),
        }
    }

    /// Appends elements.
    pub fn push(&mut self, elements: &str) {
        self.body.push_str(elements);
    }

    /// The document.
    pub fn finish(mut self) -> String {
        self.body.push_str("</svg>\n");
        self.body
    }
}

impl Frame {
    /// The frame's outline.
    pub fn outline(&self) -> String {
        format!(
            "<rect {} fill=\"none\" stroke=\"#999\" stroke-width=\"1\"/>\n",
            self.attributes()
        )
    }

    /// The frame filled.
    pub fn filled(&self, colour: &str) -> String {
        format!("<rect {} fill=\"{colour}\"/>\n", self.attributes())
    }

    /// Its corner and size.
    pub fn attributes(&self) -> String {
        format!(
            "x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\"",
            self.x, self.y, self.width, self.height
        )
    }
}

/// A line of text with these attributes.
pub fn text(x: f64, y: f64, content: &str, attributes: &str) -> String {
    let content = escaped(content);
    format!("<text x=\"{x:.2}\" y=\"{y:.2}\" {attributes}>{content}</text>\n")
}

/// A straight line with these attributes.
pub fn line(from: (f64, f64), to: (f64, f64), attributes: &str) -> String {
    format!(
        "<line x1=\"{:.2}\" y1=\"{:.2}\" x2=\"{:.2}\" y2=\"{:.2}\" {attributes}/>\n",
        from.0, from.1, to.0, to.1
    )
}

/// What a browser shows when the pointer rests on the element around it.
pub fn title(content: &str) -> String {
    format!("<title>{}</title>", escaped(content))
}

/// Text with what XML would take for markup replaced, and what XML has no place for left out.
pub fn escaped(content: &str) -> String {
    escaped_but(content, |c| if c.is_control() { ' ' } else { c })
}

/// Text with what markup is made of replaced, and every other character by what it is mapped to.
pub(super) fn escaped_but(content: &str, other: impl Fn(char) -> char) -> String {
    let mut safe = String::with_capacity(content.len());
    for c in content.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c => safe.push(other(c)),
        }
    }
    safe
}

/// The largest of 1, 2, 5 times a power of ten that is at most `most`.
pub fn round_length(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    [5.0, 2.0, 1.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|&length| length <= most * (1.0 + 1e-9))
        .unwrap_or(power)
}

/// A length with the decimals its step needs.
pub fn labelled(value: f64, step: f64) -> String {
    let decimals = (0..6).find(|&d| {
        let scaled = step * 10f64.powi(d);
        (scaled - scaled.round()).abs() < 1e-6
    });
    let decimals = usize::try_from(decimals.unwrap_or(6)).unwrap_or(6);
    format!("{:.decimals$}", value + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_lengths_are_round() {
        for (most, expected) in [
            (1.0, 1.0),
            (1.9, 1.0),
            (4.9, 2.0),
            (0.07, 0.05),
            (730.0, 500.0),
        ] {
            assert!(
                (round_length(most) - expected).abs() < 1e-12 * expected,
                "{most}"
            );
        }
        assert_eq!(labelled(0.05, 0.05), "0.05");
        assert_eq!(labelled(500.0, 500.0), "500");
    }

    #[test]
    fn markup_is_escaped() {
        assert_eq!(escaped("a<b>&\"c\"\n"), "a&lt;b&gt;&amp;&quot;c&quot; ");
    }
}
