//! How large an object is, from how large it looks.

use super::Settings;
use crate::detection::{Detection, Mark};
use crate::view::View;

/// Boxes nearer than this to the picture's border may be cut by it, pixels.
const CUT_MARGIN_PX: f64 = 1.0;

/// Diameter of a detected object, metres: the detector's own, or the width of its box at its slant
/// range. `None` where the mark has no size or the picture's border cuts it.
pub fn diameter_m(
    detection: &Detection,
    view: &View,
    slant_range_m: f64,
    settings: &Settings,
) -> Option<f64> {
    if detection.diameter_m.is_some() {
        return detection.diameter_m;
    }
    let Mark::Box(b) = detection.mark else {
        return None;
    };
    let camera = view.camera.as_deref()?;
    if !b.is_whole(camera.width, camera.height, CUT_MARGIN_PX) {
        return None;
    }
    let (_, by_pixel) = camera.ray_with_jacobian(b.aim_point(settings.aim)).ok()?;
    Some(b.width() * by_pixel.direction.column(0).norm() * slant_range_m)
}
