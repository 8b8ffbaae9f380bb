//! Reads cameras.toml.

use std::path::Path;

use super::{
    BadLens, BodyAxes, BrownConrady, Cahv, CahvVectors, Cahvor, Cahvore, Camera, Cameras,
    Equirectangular, Fisheye, Intrinsics, Lens, Linearity, Mount, Pinhole,
};
use crate::error::Error;
use crate::frame::{Point, Vector};
use crate::input::{Document, Section};

const MODELS: [&str; 7] = [
    "pinhole",
    "brown_conrady",
    "fisheye",
    "equirectangular",
    "cahv",
    "cahvor",
    "cahvore",
];

const THREE: &str = "a list of 3 finite numbers";

/// The cameras of a cameras.toml. `shown` is the name faults call the file by.
///
/// # Errors
/// A file that cannot be read, and every fault in it at once, with line and column.
pub fn read_cameras(path: &Path, shown: &str) -> Result<Cameras, Error> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
    cameras_from_toml(&text, shown)
}

/// The cameras of a cameras.toml's text: `[cameras.NAME]` with a lens, and `[cameras.NAME.mount]`,
/// without which the camera looks forward from the body's origin.
///
/// # Errors
/// Every fault in the text at once, with line and column.
pub fn cameras_from_toml(text: &str, shown: &str) -> Result<Cameras, Error> {
    let document = Document::parse(text, shown)?;
    let root = document.root();
    let all = root.section("cameras");
    let sections = all.sections();
    if sections.is_empty() && !all.is_present() && !root.has("cameras") {
        root.fault(
            "cameras",
            "nothing",
            "a table [cameras.NAME] for every camera",
        );
    } else if sections.is_empty() && all.is_present() {
        all.fault("", "no camera", "a table [cameras.NAME] for every camera");
    }
    let cameras: Vec<Option<Camera>> = sections
        .into_iter()
        .map(|(name, section)| camera(name, section))
        .collect();
    root.finish();
    let faults = document.into_faults();
    if !faults.is_empty() {
        return Err(Error::Faults(faults));
    }
    let named = cameras.into_iter().flatten().map(|c| (c.name.clone(), c));
    Ok(named.collect())
}

/// The camera of one `[cameras.NAME]` table; `None` where it has faults, which the document keeps.
pub(crate) fn camera(name: String, section: Section) -> Option<Camera> {
    if !section.is_present() {
        return None;
    }
    let width = side(&section, "width");
    let height = side(&section, "height");
    let Some(model) = required(&section, "model", "the name of a lens model", |s, key| {
        s.word(key, &MODELS)
    }) else {
        // Which keys belong here depends on the model, so the others are not judged.
        return None;
    };
    let mount = section.section("mount");
    let camera = if model.starts_with("cahv") {
        cahv_family(&section, &model).map(|(lens, place)| {
            let pivot = mount.triple("pivot_m");
            for key in ["translation_m", "quaternion"] {
                if mount.has(key) {
                    mount.problem(
                        key,
                        "C, A, H and V place this camera, so only pivot_m may stand here",
                    );
                }
            }
            (lens, with_pivot(place, pivot))
        })
    } else {
        let lens = lens(&section, &model, width, height);
        let mount = read_mount(&mount);
        lens.zip(mount)
    };
    if mount.is_present() && !(camera.is_none() && model.starts_with("cahv")) {
        mount.finish();
    }
    section.finish();
    let (lens, mount) = camera?;
    Some(Camera {
        name,
        width: width?,
        height: height?,
        lens,
        mount,
    })
}

/// A key that must be there.
fn required<T>(
    section: &Section,
    key: &str,
    expected: &str,
    read: impl FnOnce(&Section, &str) -> Option<T>,
) -> Option<T> {
    if !section.has(key) {
        section.fault(key, "nothing", expected);
        return None;
    }
    read(section, key)
}

fn side(section: &Section, key: &str) -> Option<u32> {
    let expected = "the picture's size in pixels";
    let side = required(section, key, expected, |s, key| {
        s.integer(key, 1..=1_000_000)
    })?;
    u32::try_from(side).ok()
}

fn required_triple(section: &Section, key: &str) -> Option<[f64; 3]> {
    required(section, key, THREE, |s, key| s.triple(key))
}

/// The lens, or the fault that its parameters make none.
fn made<T>(section: &Section, key: &str, lens: Result<T, BadLens>) -> Option<T> {
    lens.map_err(|bad| section.problem(key, bad.to_string()))
        .ok()
}

/// A lens by focal lengths and distortion, or a panorama.
fn lens(section: &Section, model: &str, width: Option<u32>, height: Option<u32>) -> Option<Lens> {
    if model == "equirectangular" {
        return Some(Lens::Equirectangular(Equirectangular::new(width?, height?)));
    }
    let intrinsics = intrinsics(section);
    if model == "pinhole" {
        if section.has("distortion") {
            let meant = "a pinhole camera has no distortion, is model = \"brown_conrady\" meant?";
            section.problem("distortion", meant);
        }
        return made(section, "", Pinhole::new(intrinsics?)).map(Lens::Pinhole);
    }
    let counts: &[usize] = if model == "fisheye" {
        &[4]
    } else {
        &BrownConrady::COUNTS
    };
    let expected = "the distortion coefficients in OpenCV's order";
    let distortion = required(section, "distortion", expected, |s, key| {
        s.numbers(key, counts)
    })?;
    let intrinsics = intrinsics?;
    if model == "fisheye" {
        let lens = Fisheye::new(intrinsics, distortion.try_into().ok()?);
        return made(section, "distortion", lens).map(Lens::Fisheye);
    }
    let lens = BrownConrady::new(intrinsics, &distortion);
    made(section, "distortion", lens).map(Lens::BrownConrady)
}

fn intrinsics(section: &Section) -> Option<Intrinsics> {
    let above_zero = f64::MIN_POSITIVE..;
    let focal = |key| {
        required(section, key, "a focal length in pixels", |s, key| {
            s.number(key, above_zero.clone(), "a number above zero")
        })
    };
    let centre = |key| {
        required(section, key, "the principal point in pixels", |s, key| {
            s.number(key, .., "a finite number")
        })
    };
    let (fx, fy, cx, cy) = (focal("fx"), focal("fy"), centre("cx"), centre("cy"));
    Some(Intrinsics {
        fx: fx?,
        fy: fy?,
        cx: cx?,
        cy: cy?,
    })
}

fn read_mount(section: &Section) -> Option<Mount> {
    let has = |key| section.has(key);
    let (has_translation, has_quaternion) = (has("translation_m"), has("quaternion"));
    let translation = section.triple("translation_m");
    let quaternion = section.numbers("quaternion", &[4]);
    let pivot = section.triple("pivot_m");
    let translation = match translation {
        Some([x, y, z]) => Vector::new(x, y, z),
        None if has_translation => return None,
        None => Vector::new(0.0, 0.0, 0.0),
    };
    let quaternion = match quaternion {
        Some(numbers) => numbers.try_into().ok()?,
        None if has_quaternion => return None,
        None => Mount::FORWARD,
    };
    let mount = Mount::new(translation, quaternion);
    if mount.is_none() {
        section.fault(
            "quaternion",
            "a quaternion of length zero",
            "one that rotates",
        );
    }
    Some(with_pivot(mount?, pivot))
}

fn with_pivot(mount: Mount, pivot: Option<[f64; 3]>) -> Mount {
    match pivot {
        Some([x, y, z]) => mount.with_pivot(Point::new(x, y, z)),
        None => mount,
    }
}

/// A lens by JPL's vectors, which place the camera too.
fn cahv_family(section: &Section, model: &str) -> Option<(Lens, Mount)> {
    let axes = required(section, "axes", "\"flu\" or \"frd\"", |s, key| {
        s.word(key, &["flu", "frd"])
    });
    let [c, a, h, v] = ["C", "A", "H", "V"].map(|key| required_triple(section, key));
    let distorted = model != "cahv";
    let o = distorted.then(|| required_triple(section, "O")).flatten();
    let r = distorted.then(|| required_triple(section, "R")).flatten();
    let moving = model == "cahvore";
    let e = moving.then(|| required_triple(section, "E")).flatten();
    let linearity = linearity(section, moving);
    let vectors = CahvVectors {
        axes: if axes? == "frd" {
            BodyAxes::Frd
        } else {
            BodyAxes::Flu
        },
        centre: c?,
        axis: a?,
        horizontal: h?,
        vertical: v?,
    };
    if moving {
        let lens = made(section, "", Cahvore::new(vectors, o?, r?, e?, linearity?))?;
        let mount = lens.linear().mount();
        return Some((Lens::Cahvore(lens), mount));
    }
    if distorted {
        let lens = made(section, "", Cahvor::new(vectors, o?, r?))?;
        let mount = lens.linear().mount();
        return Some((Lens::Cahvor(lens), mount));
    }
    let lens = made(section, "", Cahv::new(vectors))?;
    let mount = lens.mount();
    Some((Lens::Cahv(lens), mount))
}

/// `mtype` and `linearity`. Records of CAHV and CAHVOR cameras carry them as well and mean nothing
/// by them; records of the types 1 and 2 often leave the linearity at zero.
fn linearity(section: &Section, moving: bool) -> Option<Linearity> {
    let mtype = if moving {
        required(section, "mtype", "1, 2 or 3", |s, key| {
            s.integer(key, 1..=3)
        })
    } else {
        section.integer("mtype", 1..=3)
    };
    let given = section.number("linearity", .., "a finite number");
    let linearity = match mtype? {
        1 => Linearity::Perspective,
        2 => Linearity::Fisheye,
        _ if moving => {
            Linearity::General(required(section, "linearity", "a number", |_, _| given)?)
        }
        _ => return None,
    };
    if let (true, Some(given), Linearity::Perspective | Linearity::Fisheye) =
        (moving, given, linearity)
        && given != 0.0
        && given != linearity.value()
    {
        let expected = format!("{} (mtype = 3 takes any)", linearity.value());
        section.fault("linearity", given, expected);
    }
    Some(linearity)
}
