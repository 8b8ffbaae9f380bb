//! JSON of the Mars 2020 raw pictures: the records of the public feed, one or a page of them, and the
//! flat `-metadata.json` that downloaders keep beside a picture.

use super::Found;
use super::fields::required;
use super::rover::{RoverImage, RoverPose, Vectors, attitude, linearity, place, utc};
use crate::camera::Linearity;
use crate::error::suggestion;
use crate::input::Section;

const TYPES: [&str; 3] = ["CAHV", "CAHVOR", "CAHVORE"];

pub(super) fn read(root: &Section, found: &mut Found) {
    let records = match root.rows() {
        Some(records) => records,
        None if root.has("images") => root.tables("images"),
        None => return image(root, found),
    };
    let mut is_one = false;
    for record in &records {
        // A page of the feed has pictures of cameras without a model among the others.
        if has_model(record) {
            is_one = true;
            image(record, found);
        } else {
            let id = record.name("imageid").unwrap_or_default();
            found.note(format!(
                "{id}: the record has no camera model and is left out"
            ));
        }
    }
    if !is_one {
        root.fault("images", "no record with a camera model", "at least one");
    }
}

fn has_model(record: &Section) -> bool {
    let (section, key) = part(record, ["camera_model_component_list", ""]);
    section.has(key) && !matches!(section.shown(key).as_str(), "\"UNK\"" | "\"\"")
}

/// Where a record keeps a field: by itself, or, in the feed, in its `camera` or `extended` part.
fn part<'a>(record: &Section<'a>, keys: [&'static str; 2]) -> (Section<'a>, &'static str) {
    for name in ["camera", "extended"] {
        for section in record.tables(name) {
            if let Some(key) = keys.into_iter().find(|key| section.has(key)) {
                return (section, key);
            }
        }
    }
    let key = keys.into_iter().find(|key| record.has(key));
    // The record itself, as a section of its own, so that its faults name its place.
    (record.again(), key.unwrap_or(keys[0]))
}

fn image(record: &Section, found: &mut Found) {
    let id = required(record, "imageid", "the picture's name", |s, key| {
        s.name(key)
    });
    let size = size(record, found);
    let vectors = vectors(record);
    let (Some(id), Some(size), Some(vectors)) = (id, size, vectors) else {
        return;
    };
    let time = record.text("date_taken_utc").and_then(|text| utc(&text));
    let Some(pose) = pose(record) else {
        return;
    };
    let (section, key) = part(record, ["camera_model_component_list", ""]);
    if let Some(camera) = vectors.camera(&section, key, &id, size) {
        found.image(RoverImage {
            image_id: id,
            time,
            camera,
            pose,
            link: None,
        });
    }
}

/// The numbers of `(1, 2, 3)`; `None` where it is no such text.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let number = |word: &str| word.trim().parse().ok().filter(|x: &f64| x.is_finite());
    inner.split(',').map(number).collect()
}

/// As many numbers as a field of a record must have, written as `(1, 2)` or as a list. The outer
/// `None` where they are wrong, the inner where there are none.
#[expect(clippy::option_option, reason = "absent and wrong are two things")]
fn tuple<const N: usize>(record: &Section, keys: [&'static str; 2]) -> Option<Option<[f64; N]>> {
    let (section, key) = part(record, keys);
    if !section.has(key) || matches!(section.shown(key).as_str(), "\"UNK\"" | "\"\"") {
        return Some(None);
    }
    let listed = section.counters(key);
    let read = listed.or_else(|| numbers(&section.text(key)?));
    match read.and_then(|list| <[f64; N]>::try_from(list).ok()) {
        Some(list) => Some(Some(list)),
        None => {
            section.fault(key, section.shown(key), format!("{N} numbers"));
            None
        }
    }
}

/// The picture's size. The vectors are in this very picture's pixels, also where it is a part of the
/// detector or averages its pixels, so that neither is of further use.
fn size(record: &Section, found: &mut Found) -> Option<[u32; 2]> {
    let subframe = tuple::<4>(record, ["subframe_rect", "subframeRect"])?;
    let (section, key) = part(record, ["scale_factor", "scaleFactor"]);
    let scale = section.counters(key).and_then(|c| c.first().copied());
    let scale = scale.or_else(|| section.text(key)?.parse().ok());
    let of_part = subframe.map(|[_, _, width, height]| {
        let scale = scale.filter(|s| *s >= 1.0).unwrap_or(1.0);
        [width / scale, height / scale]
    });
    let given = tuple::<2>(record, ["dimension", ""])?;
    let Some(size) = given.or(of_part) else {
        record.fault("dimension", "nothing", "the picture's size in pixels");
        return None;
    };
    if let Some(part) = of_part
        && part != size
    {
        found.note(format!(
            "dimension {} x {} is not that of subframe_rect by scale_factor, {} x {}",
            size[0], size[1], part[0], part[1]
        ));
    }
    let side = |x: f64| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be whole and in range"
        )]
        ((1.0..=1e6).contains(&x) && x.fract() == 0.0).then_some(x as u32)
    };
    let sides = side(size[0]).zip(side(size[1]));
    if sides.is_none() {
        let found = format!("{} x {}", size[0], size[1]);
        record.fault("dimension", found, "whole numbers above zero");
    }
    sides.map(|(width, height)| [width, height])
}

fn vectors(record: &Section) -> Option<Vectors> {
    let (section, key) = part(record, ["camera_model_type", ""]);
    let kind = required(&section, key, "CAHV, CAHVOR or CAHVORE", |s, key| {
        let kind = s.text(key)?;
        let near = suggestion(&kind, TYPES).map(|w| format!(" (is {w} meant?)"));
        if !TYPES.contains(&kind.as_str()) {
            let expected = format!("one of {}{}", TYPES.join(", "), near.unwrap_or_default());
            s.fault(key, format!("{kind:?}"), expected);
            return None;
        }
        Some(kind)
    });
    let (section, key) = part(record, ["camera_model_component_list", ""]);
    let text = required(&section, key, "the vectors of the model", |s, key| {
        s.text(key)
    });
    let (kind, text) = (kind?, text?);
    let parts: Vec<&str> = text.split(';').map(str::trim).collect();
    let letters: &[&str] = match kind.as_str() {
        "CAHV" => &["C", "A", "H", "V"],
        "CAHVOR" => &["C", "A", "H", "V", "O", "R"],
        _ => &["C", "A", "H", "V", "O", "R", "E"],
    };
    let is_cahvore = kind == "CAHVORE";
    let count = letters.len() + if is_cahvore { 2 } else { 0 };
    if parts.len() < count {
        let found = format!("{} components", parts.len());
        section.fault(key, found, format!("{count} of {kind}"));
        return None;
    }
    let mut triples = Vec::new();
    for (letter, part) in letters.iter().zip(&parts) {
        match numbers(part).and_then(|n| <[f64; 3]>::try_from(n).ok()) {
            Some(triple) => triples.push(triple),
            None => {
                let found = format!("{part:?} for {letter}");
                section.fault(key, found, "three finite numbers, (x,y,z)");
                return None;
            }
        }
    }
    let e = if is_cahvore {
        Some((triples[6], mtype(&section, key, parts[7], parts[8])?))
    } else {
        None
    };
    Some(Vectors {
        cahv: [triples[0], triples[1], triples[2], triples[3]],
        or: (triples.len() > 4).then(|| [triples[4], triples[5]]),
        e,
    })
}

fn mtype(section: &Section, key: &str, mtype: &str, parameter: &str) -> Option<Linearity> {
    let number = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite());
    let read = number(mtype).zip(number(parameter));
    let linearity = read.and_then(|(mtype, parameter)| linearity(mtype, parameter));
    if linearity.is_none() {
        let found = format!("\"{mtype};{parameter}\" for mtype and linearity");
        section.fault(key, found, "1, 2 or 3 and a number");
    }
    linearity
}

/// Where the rover was, as far as the record says.
fn pose(record: &Section) -> Option<RoverPose> {
    let xyz = tuple::<3>(record, ["xyz", ""])?;
    let quaternion = tuple::<4>(record, ["attitude", "rover_attitude"])?;
    let turned = quaternion.map(attitude);
    if let (Some(q), Some(None)) = (quaternion, turned) {
        let (section, key) = part(record, ["attitude", "rover_attitude"]);
        section.fault(key, format!("{q:?}"), "a unit quaternion, scalar first");
        return None;
    }
    let site = record.counters("site").and_then(|c| c.first().copied());
    let site = site.or_else(|| record.text("site")?.parse().ok());
    Some(RoverPose {
        site: site.and_then(super::label::whole_number),
        place: xyz.map(place),
        attitude: turned.flatten(),
    })
}
