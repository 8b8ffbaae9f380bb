//! `output.formats`: the formats a map is written in.

use crate::input::Section;
use crate::publish::Format;

/// The map formats, each once; `None` where one is not known.
pub(super) fn formats(section: &Section<'_>) -> Option<Vec<Format>> {
    let names = section.texts("formats");
    let known = Format::ALL.map(|format| <[&str; 2]>::from(format.names()));
    section.offers("formats", known.as_flattened());
    let Some(names) = names else {
        return Some(vec![Format::GeoJson, Format::GeoPackage]);
    };
    let mut formats: Vec<Format> = Vec::new();
    let mut faulty = false;
    for name in names {
        match Format::named(&name) {
            Some(format) if !formats.contains(&format) => formats.push(format),
            Some(_) => {
                let found = format!("{name:?} a second time");
                section.fault("formats", found, "every format once");
                faulty = true;
            }
            None => {
                let known = Format::ALL.map(|format| format.names().0).join(", ");
                section.fault("formats", format!("{name:?}"), known);
                faulty = true;
            }
        }
    }
    (!faulty).then_some(formats)
}
