//! Labels of pictures from the surface of Mars: MER, Phoenix, MSL, `InSight`, in ODL (PDS3) or VICAR.

use super::Found;
use super::fields::required;
use super::rover::{RoverImage, RoverPose, SiteLink, Vectors, after, linearity, place, step, utc};
use super::window::{Counts, Window, counts};
use crate::camera::Camera;
use crate::frame::{Body, Enu, Point, RigidTransform};
use crate::input::Section;

/// More steps than any chain of frames has.
const LONGEST_CHAIN: usize = 10;

pub(super) fn read(root: &Section, stem: &str, found: &mut Found) {
    let product = identity(root, "PRODUCT_ID").unwrap_or_else(|| stem.to_owned());
    let time = identity(root, "START_TIME").and_then(|text| utc(&text));
    if time.is_none() {
        found.note("no START_TIME: the picture has no time");
    }
    let Some(model) = model_group(root) else {
        let expected = "the group of the camera model";
        root.fault("GEOMETRIC_CAMERA_MODEL", "nothing", expected);
        return;
    };
    let size = size(root);
    let vectors = vectors(&model);
    let pose = pose(root, &model, found);
    let (Some(size), Some(vectors), Some(pose)) = (size, vectors, pose) else {
        return;
    };
    if let Some(camera) = camera(root, &model, &vectors, (&product, size), found) {
        found.image(RoverImage {
            image_id: product,
            time,
            camera,
            pose,
            link: link(root),
        });
    }
}

/// A keyword of the identification, which VICAR keeps in a section of its own.
fn identity(root: &Section, key: &str) -> Option<String> {
    let own = root.tables("IDENTIFICATION");
    let section = own.first().filter(|s| s.has(key)).unwrap_or(root);
    section.has(key).then(|| section.name(key))?
}

fn model_group<'a>(root: &Section<'a>) -> Option<Section<'a>> {
    ["GEOMETRIC_CAMERA_MODEL", "GEOMETRIC_CAMERA_MODEL_PARMS"]
        .into_iter()
        .find_map(|key| root.tables(key).into_iter().next())
}

/// The table that says how many lines a picture has.
fn image_section<'a>(root: &Section<'a>) -> Option<Section<'a>> {
    ["IMAGE", "IMAGE_DATA"]
        .into_iter()
        .find_map(|key| root.tables(key).into_iter().find(|s| s.has("LINES")))
}

fn size(root: &Section) -> Option<[u32; 2]> {
    let Some(image) = image_section(root) else {
        root.fault("IMAGE.LINES", "nothing", "the picture's size in pixels");
        return None;
    };
    let side = |key: &str| {
        let expected = "the picture's size in pixels";
        let side = required(&image, key, expected, |s, key| {
            s.integer(key, 1..=1_000_000)
        });
        side.and_then(|n| u32::try_from(n).ok())
    };
    let (width, height) = (side("LINE_SAMPLES"), side("LINES"));
    Some([width?, height?])
}

fn vectors(model: &Section) -> Option<Vectors> {
    let kind = required(model, "MODEL_TYPE", "CAHV, CAHVOR or CAHVORE", |s, key| {
        s.word(key, &["CAHV", "CAHVOR", "CAHVORE"])
    })?;
    // The components are numbered in the order that the identifiers name.
    let letters = if model.has("MODEL_COMPONENT_ID") {
        model.texts("MODEL_COMPONENT_ID")?
    } else {
        ["C", "A", "H", "V", "O", "R", "E", "T", "P"]
            .map(str::to_owned)
            .to_vec()
    };
    let key = |letter: &str| {
        let index = letters.iter().position(|l| l == letter);
        if index.is_none() {
            let found = letters.join(", ");
            model.fault("MODEL_COMPONENT_ID", found, format!("{letter} among them"));
        }
        index.map(|i| format!("MODEL_COMPONENT_{}", i + 1))
    };
    let triple = |letter: &str| {
        let key = key(letter)?;
        required(model, &key, "3 finite numbers", |s, key| s.triple(key))
    };
    let number = |letter: &str| {
        let key = key(letter)?;
        required(model, &key, "a number", |s, key| {
            s.number(key, .., "a finite number")
        })
    };
    let cahv = ["C", "A", "H", "V"].map(triple);
    let or = (kind != "CAHV").then(|| ["O", "R"].map(triple));
    let e = (kind == "CAHVORE").then(|| (triple("E"), number("T"), number("P")));
    let [c, a, h, v] = cahv;
    let mut vectors = Vectors {
        cahv: [c?, a?, h?, v?],
        or: None,
        e: None,
    };
    if let Some([o, r]) = or {
        vectors.or = Some([o?, r?]);
    }
    if let Some((e, mtype, parameter)) = e {
        let mtype = mtype?;
        let Some(linearity) = linearity(mtype, parameter?) else {
            model.fault("MODEL_COMPONENT_8", mtype, "1, 2 or 3");
            return None;
        };
        vectors.e = Some((e?, linearity));
    }
    Some(vectors)
}

/// The camera of a picture: labels of subframes and of averaged pictures give the vectors in pixels of
/// the picture or of the whole detector, and do not say which.
fn camera(
    root: &Section,
    model: &Section,
    vectors: &Vectors,
    (name, size): (&str, [u32; 2]),
    found: &mut Found,
) -> Option<Camera> {
    let window = window(root)?;
    let in_picture = || vectors.camera(model, "", name, size);
    let is_linearized = identity(root, "GEOMETRY_PROJECTION_TYPE").as_deref() == Some("LINEARIZED");
    if window.is_whole() || is_linearized {
        return in_picture();
    }
    let ([x, y], [n, m]) = (window.first, window.averaged);
    let part =
        format!("a picture from column {x}, row {y} of its detector, {n} x {m} pixels averaged");
    let Some(detector) = detector(root) else {
        found.note(format!(
            "{part}, of a detector of unknown size: the camera model is taken to count the picture's pixels"
        ));
        return in_picture();
    };
    let Ok(readout) = window.readout(detector, size) else {
        let [columns, rows] = detector;
        found.note(format!(
            "{part}, which a detector of {columns} x {rows} does not hold: the camera model is taken to count the picture's pixels"
        ));
        return in_picture();
    };
    if counts(vectors, &readout) == Counts::Picture {
        found.note(format!(
            "{part}: the camera model counts the picture's pixels"
        ));
        return in_picture();
    }
    found.note(format!(
        "{part}: the camera model counts the detector's pixels"
    ));
    let whole = vectors.camera(model, "", name, detector)?;
    let shown = whole.subframe(window.part(size)).ok()?;
    shown.binned(window.averaged).ok()
}

/// Which pixels of the detector the picture is made of; `None` where the label is at fault.
fn window(root: &Section) -> Option<Window> {
    let image = image_section(root);
    let state = root.tables("INSTRUMENT_STATE_PARMS");
    let number = |section: Option<&Section>, key: &str| {
        let counters = section?.counters(key)?;
        counters.first().copied().filter(|x| *x >= 1.0)
    };
    let told = |sections: [Option<&Section>; 2], key: &str| {
        let told = sections.into_iter().find_map(|s| number(s, key));
        let whole = told.map_or(Some(1), whole_number);
        if let (None, Some(x)) = (whole, told) {
            root.fault(key, x, "a whole number above zero");
        }
        whole
    };
    let averaged = |key| told([state.first(), image.as_ref()], key);
    let first = |key| told([image.as_ref(), None], key).map(|n| n - 1);
    Some(Window {
        first: [first("FIRST_LINE_SAMPLE")?, first("FIRST_LINE")?],
        averaged: [
            averaged("PIXEL_AVERAGING_WIDTH")?,
            averaged("PIXEL_AVERAGING_HEIGHT")?,
        ],
    })
}

/// Columns and rows of the detector: as the label says, or the 1024 of the engineering cameras.
fn detector(root: &Section) -> Option<[u32; 2]> {
    let tables = ["INSTRUMENT_STATE_PARMS", "IMAGE", "IMAGE_DATA"].map(|key| root.tables(key));
    let told = |key: &str| {
        let mut all = tables.iter().flatten();
        all.find_map(|s| s.counters(key))
            .and_then(|c| c.first().copied())
            .and_then(whole_number)
    };
    if let (Some(columns), Some(rows)) = (
        told("DETECTOR_LINE_SAMPLES").or(told("DETECTOR_SAMPLES")),
        told("DETECTOR_LINES"),
    ) {
        return Some([columns, rows]);
    }
    let instrument = identity(root, "INSTRUMENT_ID")?;
    let engineering = ["NAV", "HAZ", "PANCAM", "IDC", "ICC", "SSI"];
    engineering
        .iter()
        .any(|name| instrument.contains(name))
        .then_some([1024, 1024])
}

/// A coordinate system of the label: where its origin is in another, and how it is turned.
struct Frame<'a> {
    section: Section<'a>,
    name: String,
    index: Option<Vec<f64>>,
}

/// The pose of the frame that the camera model is written in, in its site frame; the outer `None`
/// where the label is at fault.
fn pose(root: &Section, model: &Section, found: &mut Found) -> Option<RoverPose> {
    let frames: Vec<Frame> = root
        .groups()
        .into_iter()
        .filter(|(key, _)| key.contains("COORDINATE_SYSTEM"))
        .filter_map(|(_, section)| {
            let name = section.text("COORDINATE_SYSTEM_NAME")?;
            let index = section.counters("COORDINATE_SYSTEM_INDEX");
            Some(Frame {
                section,
                name,
                index,
            })
        })
        .collect();
    let mut name = required(model, "REFERENCE_COORD_SYSTEM_NAME", "a frame", |s, key| {
        s.text(key)
    })?;
    let mut index = model.counters("REFERENCE_COORD_SYSTEM_INDEX");
    let mut total: RigidTransform<Enu, Body> = RigidTransform::identity();
    for _ in 0..LONGEST_CHAIN {
        if name == "SITE_FRAME" {
            let site = index
                .and_then(|i| i.first().copied())
                .and_then(whole_number);
            return Some(RoverPose::of_ned(&total, site));
        }
        let Some(frame) = frames.iter().find(|f| f.name == name) else {
            found.note(format!("nothing is said of the {name}: no pose"));
            return Some(RoverPose::default());
        };
        if let (Some(wanted), Some(has)) = (&index, &frame.index)
            && wanted.iter().zip(has).any(|(a, b)| a != b)
        {
            let expected = format!("{wanted:?}, the index of the frame that refers to it");
            let found = format!("{has:?}");
            frame
                .section
                .fault("COORDINATE_SYSTEM_INDEX", found, expected);
            return None;
        }
        total = after(&up(&frame.section)?, &total);
        let key = "REFERENCE_COORD_SYSTEM_NAME";
        name = required(&frame.section, key, "a frame", |s, key| s.text(key))?;
        index = frame.section.counters("REFERENCE_COORD_SYSTEM_INDEX");
    }
    let expected = "frames that lead to a SITE_FRAME";
    model.fault(
        "REFERENCE_COORD_SYSTEM_NAME",
        "frames that refer to each other",
        expected,
    );
    None
}

/// Where the site lies in the one before it, for labels that tell it of frames with parallel axes.
fn link(root: &Section) -> Option<SiteLink> {
    let groups = ["SITE_COORDINATE_SYSTEM", "SITE_COORDINATE_SYSTEM_PARMS"];
    let site = groups
        .into_iter()
        .find_map(|key| root.tables(key).into_iter().next())?;
    let number = |key: &str| site.counters(key)?.first().copied().and_then(whole_number);
    let offset = site.counters("ORIGIN_OFFSET_VECTOR")?;
    let offset = place(<[f64; 3]>::try_from(offset).ok()?);
    let turned = site.counters("ORIGIN_ROTATION_QUATERNION");
    let parallel = turned.is_none_or(|q| q.iter().skip(1).all(|x| x.abs() < 1e-9));
    parallel.then_some(SiteLink {
        site: number("COORDINATE_SYSTEM_INDEX")?,
        reference: number("REFERENCE_COORD_SYSTEM_INDEX")?,
        offset: offset - Point::origin(),
    })
}

pub(super) fn whole_number(x: f64) -> Option<u32> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to be whole and in range"
    )]
    (x.fract() == 0.0 && (0.0..1e6).contains(&x)).then_some(x as u32)
}

/// The step from a frame to the one it is given in. Both have x forward or north, y right or east,
/// z down; a label that says otherwise is not understood.
fn up(frame: &Section) -> Option<RigidTransform<Enu, Body>> {
    for (key, known) in [
        ("POSITIVE_AZIMUTH_DIRECTION", "CLOCKWISE"),
        ("POSITIVE_ELEVATION_DIRECTION", "UP"),
    ] {
        if frame.has(key) {
            frame.word(key, &[known])?;
        }
    }
    let offset = required(
        frame,
        "ORIGIN_OFFSET_VECTOR",
        "3 finite numbers",
        |s, key| s.triple(key),
    );
    let key = "ORIGIN_ROTATION_QUATERNION";
    let quaternion = required(frame, key, "a quaternion", |s, key| s.numbers(key, &[4]));
    let &[w, x, y, z] = quaternion?.as_slice() else {
        return None;
    };
    let length = (w * w + x * x + y * y + z * z).sqrt();
    if (length - 1.0).abs() > 0.01 {
        let found = format!("a quaternion of length {length:.4}");
        frame.fault(key, found, "a unit quaternion");
        return None;
    }
    step(offset?, [w, x, y, z])
}
