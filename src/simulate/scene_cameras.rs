//! The cameras of a scene file.

use crate::frame::{RigidTransform, Rotation, Vector};
use crate::input::Section;
use nalgebra::{Matrix3, Vector3};

use super::lens_shim::{Camera, Mount};
use super::scene_file::degrees;

/// The cameras of a scene, sorted by name; one named `mast` with all defaults where it names none.
pub(super) fn cameras(section: &Section) -> Vec<Camera> {
    let mut cameras: Vec<Camera> = section
        .sections()
        .into_iter()
        .map(|(name, s)| camera(&name, s))
        .collect();
    if cameras.is_empty() {
        cameras.push(camera("mast", section.section("mast")));
    }
    cameras.sort_by(|a, b| a.name.cmp(&b.name));
    cameras
}

fn camera(name: &str, section: Section) -> Camera {
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
    let pitch = degrees(&section, "pitch_down_deg", 90.0, 16.0);
    let [x, y, z] = section.triple("translation_m").unwrap_or([0.0; 3]);
    section.finish();
    let forward = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rotation = Rotation::from_matrix(forward).perturbed(Vector3::new(-pitch, 0.0, 0.0));
    Camera {
        name: name.to_owned(),
        width,
        height,
        f: 0.5 * f64::from(width) / (0.5 * hfov).tan(),
        mount: Mount {
            body_from_camera: RigidTransform::new(rotation, Vector::new(x, y, z)),
        },
    }
}
