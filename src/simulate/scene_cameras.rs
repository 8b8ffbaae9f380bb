//! The cameras of a scene file.

use nalgebra::{Matrix3, Vector3};

use crate::camera::{
    BrownConrady, Camera, Equirectangular, Fisheye, Intrinsics, Lens, Mount, Pinhole, read_camera,
};
use crate::frame::{RigidTransform, Rotation, Vector};
use crate::input::Section;

use super::scene_file::degrees;

/// The cameras of a scene, sorted by name; one named `mast` with all defaults where it names none.
///
/// A table that names vectors (`C`) or a focal length (`fx`) is one of cameras.toml; any other is
/// the short form: `width`, `height`, `hfov_deg`, `model` (pinhole, `brown_conrady` or fisheye) with
/// its `distortion`, `translation_m` and `pitch_down_deg`.
pub(super) fn cameras(section: &Section) -> Vec<Camera> {
    let sections = section.sections();
    let mut cameras: Vec<Camera> = if sections.is_empty() {
        vec![short("mast", section.section("mast"))]
    } else {
        let one = |(name, s): (String, Section)| {
            if s.has("fx") || s.has("C") {
                read_camera(name, s)
            } else {
                Some(short(&name, s))
            }
        };
        sections.into_iter().filter_map(one).collect()
    };
    cameras.sort_by(|a, b| a.name.cmp(&b.name));
    cameras
}

fn short(name: &str, section: Section) -> Camera {
    let pixels = |key, default: u32| {
        let number = section.integer(key, 16..=16384);
        number
            .and_then(|n| u32::try_from(n).ok())
            .unwrap_or(default)
    };
    let (width, height) = (pixels("width", 1280), pixels("height", 960));
    let hfov = section
        .number("hfov_deg", 1.0..=170.0, "1 to 170")
        .unwrap_or(21.0)
        .to_radians();
    // Pixel centres are whole numbers, so the middle of the picture is at half of width - 1.
    let f = 0.5 * f64::from(width) / (0.5 * hfov).tan();
    let intrinsics = Intrinsics {
        fx: f,
        fy: f,
        cx: 0.5 * (f64::from(width) - 1.0),
        cy: 0.5 * (f64::from(height) - 1.0),
    };
    let pitch_down = degrees(&section, "pitch_down_deg", 90.0, 16.0);
    let [x, y, z] = section.triple("translation_m").unwrap_or([0.0; 3]);
    let lens = lens(&section, intrinsics);
    section.finish();
    Camera {
        name: name.to_owned(),
        width,
        height,
        lens,
        mount: mount(pitch_down, Vector::new(x, y, z)),
        readout: None,
    }
}

/// A camera at a place of the body that looks forward and down.
fn mount(pitch_down: f64, translation: Vector<crate::frame::Body>) -> Mount {
    let forward = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rotation = Rotation::from_matrix(forward).perturbed(Vector3::new(-pitch_down, 0.0, 0.0));
    Mount::from_transform(RigidTransform::new(rotation, translation))
}

fn lens(section: &Section, intrinsics: Intrinsics) -> Lens {
    let model = section.word("model", &["pinhole", "brown_conrady", "fisheye"]);
    let distortion = section.number_list("distortion").unwrap_or_default();
    let made = match model.as_deref() {
        Some("brown_conrady") => BrownConrady::new(intrinsics, &distortion).map(Lens::BrownConrady),
        Some("fisheye") => {
            let four = <[f64; 4]>::try_from(distortion).unwrap_or_else(|other| {
                let found = format!("{} coefficients", other.len());
                section.fault("distortion", found, "4 for a fisheye");
                [0.0; 4]
            });
            Fisheye::new(intrinsics, four).map(Lens::Fisheye)
        }
        _ => {
            if !distortion.is_empty() {
                let found = format!("{} coefficients", distortion.len());
                section.fault("distortion", found, "none for a pinhole");
            }
            Pinhole::new(intrinsics).map(Lens::Pinhole)
        }
    };
    made.unwrap_or_else(|bad| {
        section.problem("distortion", bad.to_string());
        // Any lens serves: the scene is refused.
        Lens::Equirectangular(Equirectangular::new(16, 16))
    })
}
