//! What the calibration formats have in common: sizes, camera matrices, coefficients.

pub(super) use crate::camera::read::{required, side};
use crate::camera::{BadLens, BrownConrady, Camera, Fisheye, Intrinsics, Lens, Mount, Pinhole};
use crate::input::Section;

/// The one of several spellings of a key that the section has; the first where it has none.
pub(super) fn spelling<'k>(section: &Section, keys: &[&'k str]) -> &'k str {
    let first = keys.first().copied().unwrap_or_default();
    keys.iter()
        .copied()
        .find(|key| section.has(key))
        .unwrap_or(first)
}

/// The lens, or the fault that its parameters make none.
pub(super) fn made<T>(section: &Section, key: &str, lens: Result<T, BadLens>) -> Option<T> {
    lens.map_err(|bad| section.problem(key, bad.to_string()))
        .ok()
}

/// Focal lengths and principal point of a camera matrix, row by row.
pub(super) fn of_matrix(section: &Section, key: &str, matrix: &[f64]) -> Option<Intrinsics> {
    let &[fx, skew, cx, zero, fy, cy, a, b, one] = matrix else {
        section.fault(key, format!("{} numbers", matrix.len()), "9");
        return None;
    };
    if [zero, a, b].iter().any(|&x| x != 0.0) || one != 1.0 {
        let found = format!("rows that end in {zero}, {fy}, {cy}; {a}, {b}, {one}");
        section.fault(key, found, "0, fy, cy; 0, 0, 1");
        return None;
    }
    if skew != 0.0 {
        section.fault(key, format!("a skew of {skew}"), "0: no model has one");
        return None;
    }
    Some(Intrinsics { fx, fy, cx, cy })
}

/// OpenCV's standard model, or the ideal camera where there is no coefficient.
pub(super) fn standard(
    section: &Section,
    key: &str,
    intrinsics: Intrinsics,
    distortion: &[f64],
) -> Option<Lens> {
    if distortion.is_empty() {
        return made(section, key, Pinhole::new(intrinsics)).map(Lens::Pinhole);
    }
    let lens = BrownConrady::new(intrinsics, distortion);
    made(section, key, lens).map(Lens::BrownConrady)
}

/// OpenCV's fisheye model.
pub(super) fn fisheye(
    section: &Section,
    key: &str,
    intrinsics: Intrinsics,
    distortion: &[f64],
) -> Option<Lens> {
    let Ok(distortion) = <[f64; 4]>::try_from(distortion) else {
        section.fault(key, format!("{} coefficients", distortion.len()), "4");
        return None;
    };
    made(section, key, Fisheye::new(intrinsics, distortion)).map(Lens::Fisheye)
}

/// A camera that the file gives no place on the platform.
pub(super) fn unmounted(name: String, size: [u32; 2], lens: Lens) -> Camera {
    let [width, height] = size;
    Camera {
        name,
        width,
        height,
        lens,
        mount: Mount::default(),
        readout: None,
    }
}

/// What is said of a camera without a place on its platform.
pub(super) const NO_MOUNT: &str =
    "the file says nothing of the mount: the camera looks forward from the body's origin";
