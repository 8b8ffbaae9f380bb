//! Reads cameras.toml.

use super::read_readout::readout;
use super::read_vectors::cahv_family;
use super::{
    BadLens, BrownConrady, Camera, Cameras, Equirectangular, Fisheye, Intrinsics, Lens, Mount,
    Pinhole,
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
    if sections.is_empty() && (all.is_present() || !root.has("cameras")) {
        let expected = "a table [cameras.NAME] for every camera";
        root.fault("cameras", "no camera", expected);
    }
    let cameras: Vec<Option<Camera>> = sections
        .into_iter()
        .map(|(name, section)| camera(name, section))
        .collect();
    root.finish();
    Error::check(document.into_faults())?;
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
        let pivot = pivot_alone(&mount);
        cahv_family(&section, &model).map(|(lens, place)| (lens, with_pivot(place, pivot)))
    } else {
        let lens = lens(&section, &model, width, height);
        lens.zip(read_mount(&mount))
    };
    mount.finish();
    let readout = readout(&section, width, height);
    section.finish();
    let (lens, mount) = camera?;
    let readout = readout?;
    let [width, height] = readout.size();
    Some(Camera {
        name,
        width,
        height,
        lens,
        mount,
        readout: (!readout.is_whole()).then_some(readout),
    })
}

/// A key that must be there.
pub(super) fn required<T>(
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

pub(super) fn side(section: &Section, key: &str) -> Option<u32> {
    let expected = "the picture's size in pixels";
    let side = required(section, key, expected, |s, key| {
        s.integer(key, 1..=1_000_000)
    })?;
    u32::try_from(side).ok()
}

pub(super) fn required_triple(section: &Section, key: &str) -> Option<[f64; 3]> {
    required(section, key, THREE, |s, key| s.triple(key))
}

/// The lens, or the fault that its parameters make none.
pub(super) fn lens_made<T>(section: &Section, key: &str, lens: Result<T, BadLens>) -> Option<T> {
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
        return lens_made(section, "", Pinhole::new(intrinsics?)).map(Lens::Pinhole);
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
        return lens_made(section, "distortion", lens).map(Lens::Fisheye);
    }
    let lens = BrownConrady::new(intrinsics, &distortion);
    lens_made(section, "distortion", lens).map(Lens::BrownConrady)
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

/// All that the mount of a camera by JPL's vectors may say.
fn pivot_alone(section: &Section) -> Option<[f64; 3]> {
    for key in ["translation_m", "quaternion"] {
        if section.has(key) {
            let problem = "C, A, H and V place this camera, only pivot_m may stand here";
            section.problem(key, problem);
        }
    }
    section.triple("pivot_m")
}

fn with_pivot(mount: Mount, pivot: Option<[f64; 3]>) -> Mount {
    match pivot {
        Some([x, y, z]) => mount.with_pivot(Point::new(x, y, z)),
        None => mount,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::read_camera_file;

    fn faults(text: &str) -> Vec<String> {
        let error = cameras_from_toml(text, "cameras.toml").unwrap_err();
        error.to_string().lines().map(str::to_owned).collect()
    }

    const SIZE: &str = "width = 640\nheight = 480\n";

    #[test]
    fn all_faults_of_a_file_are_listed() {
        let text = "\
[cameras.left]
model = \"pinhole\"
width = 1242
hight = 375
fx = 0
fy = 721.5
cx = \"609\"
distortion = [0.1]

[cameras.left.mount]
quaternion = [0, 0, 0, 0]
translation = [1, 2, 3]

[cameras.right]
model = \"brown_conradi\"
width = 12.5
height = 375
[camera]
";
        assert_eq!(
            faults(text),
            [
                "cameras.toml:1:10: cameras.left.height: found nothing, expected the picture's size in pixels",
                "cameras.toml:1:10: cameras.left.cy: found nothing, expected the principal point in pixels",
                "cameras.toml:4:1: cameras.left.hight: unknown key, is height meant?",
                "cameras.toml:5:1: cameras.left.fx: found 0, expected a number above zero",
                "cameras.toml:7:1: cameras.left.cx: found \"609\", expected a finite number",
                "cameras.toml:8:1: cameras.left.distortion: a pinhole camera has no distortion, is model = \"brown_conrady\" meant?",
                "cameras.toml:11:1: cameras.left.mount.quaternion: found a quaternion of length zero, expected one that rotates",
                "cameras.toml:12:1: cameras.left.mount.translation: unknown key, is translation_m meant?",
                "cameras.toml:15:1: cameras.right.model: found \"brown_conradi\", expected one of pinhole, brown_conrady, fisheye, equirectangular, cahv, cahvor, cahvore (is brown_conrady meant?)",
                "cameras.toml:16:1: cameras.right.width: found 12.5, expected a whole number from 1 to 1000000",
                "cameras.toml:18:2: camera: unknown key, is cameras meant?",
            ]
        );
    }

    #[test]
    fn distortion_has_the_models_number_of_coefficients() {
        let lens = "fx = 1.0\nfy = 1.0\ncx = 1.0\ncy = 1.0\n";
        let with = |model: &str, distortion: &str| {
            faults(&format!(
                "[cameras.c]\nmodel = \"{model}\"\n{SIZE}{lens}{distortion}\n"
            ))
        };
        assert_eq!(
            with("brown_conrady", "distortion = [0.1, 0.2, 0.3]"),
            [
                "cameras.toml:9:1: cameras.c.distortion: found a list of 3, expected a list of 4 or 5 or 8 or 12 or 14 finite numbers"
            ]
        );
        assert_eq!(
            with("fisheye", ""),
            [
                "cameras.toml:1:10: cameras.c.distortion: found nothing, expected the distortion coefficients in OpenCV's order"
            ]
        );
    }

    #[test]
    fn vectors_must_span_a_picture() {
        let with = |text: &str| faults(&format!("[cameras.c]\nmodel = \"cahv\"\n{SIZE}{text}"));
        let vectors = "C = [0, 0, 0]\nA = [1, 0, 0]\nH = [5, 0, 0]\nV = [0, 0, 9]\n";
        assert_eq!(
            with(&format!(
                "axes = \"flu\"\n{vectors}[cameras.c.mount]\nquaternion = [1, 0, 0, 0]"
            )),
            [
                "cameras.toml:1:10: cameras.c: found vectors that span no picture, expected A, H and V in three directions",
                "cameras.toml:11:1: cameras.c.mount.quaternion: C, A, H and V place this camera, only pivot_m may stand here",
            ]
        );
        assert_eq!(
            with(&format!("{vectors}O = [1, 0, 0]\n")),
            [
                "cameras.toml:1:10: cameras.c.axes: found nothing, expected \"flu\" or \"frd\"",
                "cameras.toml:9:1: cameras.c.O: unknown key, is A meant?",
            ]
        );
    }

    #[test]
    fn linearity_goes_with_its_type() {
        let with = |text: &str| {
            let vectors = "C = [0, 0, 0]\nA = [1, 0, 0]\nH = [5, -9, 0]\nV = [5, 0, -9]\nO = [1, 0, 0]\nR = [0, 0, 0]\nE = [0, 0, 0]";
            cameras_from_toml(
                &format!(
                    "[cameras.c]\nmodel = \"cahvore\"\n{SIZE}axes = \"flu\"\n{vectors}\n{text}"
                ),
                "cameras.toml",
            )
        };
        assert!(with("mtype = 1").is_ok() && with("mtype = 1\nlinearity = 0.0").is_ok());
        assert!(with("mtype = 3\nlinearity = -0.3").is_ok());
        assert_eq!(
            with("mtype = 3").unwrap_err().to_string(),
            "cameras.toml:1:10: cameras.c.linearity: found nothing, expected a number"
        );
        assert_eq!(
            with("mtype = 2\nlinearity = 0.5").unwrap_err().to_string(),
            "cameras.toml:14:1: cameras.c.linearity: found 0.5, expected 0 (mtype = 3 takes any)"
        );
    }

    #[test]
    fn a_file_without_cameras_is_a_fault() {
        let expected = "cameras: found no camera, expected a table [cameras.NAME] for every camera";
        assert_eq!(faults(""), [format!("cameras.toml: {expected}")]);
        assert_eq!(
            faults("[cameras]\n"),
            [format!("cameras.toml:1:2: {expected}")]
        );
        assert_eq!(
            faults("cameras = 3\n"),
            ["cameras.toml:1:1: cameras: found 3, expected a table"]
        );
        let missing = read_camera_file("no/cameras.toml".as_ref(), "cameras.toml").unwrap_err();
        assert_eq!(
            missing.to_string(),
            "no/cameras.toml: cannot read: no such file or folder"
        );
    }

    #[test]
    fn rover_axes_are_turned_into_body_axes() {
        // Looks forward from 1 m ahead, 2 m to the right and 3 m above, in rover axes.
        let text = "[cameras.c]\nmodel = \"cahv\"\nwidth = 101\nheight = 101\naxes = \"frd\"\n\
            C = [1, 2, -3]\nA = [1, 0, 0]\nH = [50, 100, 0]\nV = [50, 0, 100]\n";
        let camera = &cameras_from_toml(text, "cameras.toml").unwrap()["c"];
        let transform = camera.mount.body_from_camera(Default::default());
        let ray = transform * camera.ray(crate::frame::Pixel::new(150.0, 50.0)).unwrap();
        // 100 pixels right of the centre at a focal length of 100: 45 degrees to the right.
        let half = 0.5f64.sqrt();
        let off = ray.direction.xyz() - nalgebra::Vector3::new(half, -half, 0.0);
        assert!(off.norm() < 1e-14 && ray.origin.distance(Point::new(1.0, -2.0, 3.0)) < 1e-14);
    }
}
