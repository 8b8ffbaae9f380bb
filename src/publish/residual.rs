//! How far a detection lies from its rock drawn back into the picture.
//!
//! Of a box that the picture's border cuts only a part is seen, and the middle of that part is not
//! the middle of the rock. Such a box is first made whole, outwards over the border: by its other side
//! where that is not cut, or else as large as the rock looks from there. What it marks then is
//! compared with the rock like any other.

use super::Scene;
use super::rock::project;
use crate::detection::{Detection, Mark, PixelBox};
use crate::frame::{Enu, Pixel, Point};
use crate::fuse::Member;
use crate::view::View;

/// Boxes nearer than this to the picture's border are taken for cut by it, pixels.
const BORDER_PX: f64 = 1.0;

/// How large a rock is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    /// Its diameter across the line of sight, metres.
    pub(crate) diameter_m: f64,
    /// Height over width of the boxes that show it whole.
    pub(crate) aspect: f64,
}

/// How large a rock is by the detections that belong to it, those that show it whole; `None`
/// where none does.
pub(super) fn extent(
    scene: &Scene<'_>,
    members: &[Member],
    diameter_m: Option<f64>,
) -> Option<Extent> {
    let (mut sum, mut weight) = (0.0, 0.0);
    for member in members {
        let placed = &scene.placed[member.observation];
        let camera = scene.views[placed.view].camera.as_deref();
        let (Mark::Box(b), Some(camera)) = (placed.detection.mark, camera) else {
            continue;
        };
        if b.is_whole(camera.width, camera.height, BORDER_PX) && b.width() > 0.0 && b.height() > 0.0
        {
            sum += member.weight * (b.height() / b.width()).ln();
            weight += member.weight;
        }
    }
    (weight > 0.0).then_some(Extent {
        diameter_m: diameter_m?,
        aspect: (sum / weight).exp(),
    })
}

impl Scene<'_> {
    /// From a detection's mark to a place drawn back into its picture, pixels; `None` where the
    /// mark is no place in a picture or the lens does not see the place.
    pub(super) fn residual_px(
        &self,
        (view, detection): (&View, &Detection),
        place: Point<Enu>,
        extent: Option<Extent>,
    ) -> Option<f64> {
        let (drawn, _) = project(view, place)?;
        let mark = match detection.mark {
            Mark::Box(b) => {
                let whole = whole_box(b, view, (place, drawn), extent);
                whole.unwrap_or(b).aim_point(self.aim)
            }
            _ => detection.aim_point(self.aim)?,
        };
        Some(mark.distance(drawn))
    }
}

/// A box as it would be if the picture went on; `None` where it is not known how large its rock is.
pub(super) fn whole_box(
    b: PixelBox,
    view: &View,
    (place, drawn): (Point<Enu>, Pixel),
    extent: Option<Extent>,
) -> Option<PixelBox> {
    let (camera, extent) = (view.camera.as_deref()?, extent?);
    let width_px = apparent_width_px(view, place, drawn, extent.diameter_m)?;
    let size = (camera.width, camera.height);
    Some(whole(b, size, width_px, extent.aspect))
}

/// How wide something at a place looks, pixels.
fn apparent_width_px(view: &View, place: Point<Enu>, drawn: Pixel, width_m: f64) -> Option<f64> {
    let (_, by_pixel) = view.camera.as_ref()?.ray_with_jacobian(drawn).ok()?;
    let pixel = by_pixel.direction.column(0).norm();
    Some(width_m / (view.origin().distance(place) * pixel))
}

/// A box with a side that the border of a picture (columns, rows) cuts moved outwards: so far that
/// its height is its width times `aspect`, or where both are cut that it is `width_px` wide.
fn whole(b: PixelBox, (columns, rows): (u32, u32), width_px: f64, aspect: f64) -> PixelBox {
    let [across, down] = b.cut_ends(columns, rows, BORDER_PX);
    let (width, height) = match (across, down) {
        (_, (false, false)) => (b.height() / aspect, b.height()),
        ((false, false), _) => (b.width(), b.width() * aspect),
        _ => (width_px, width_px * aspect),
    };
    let moved = |low: f64, high: f64, cut: (bool, bool), size: f64| match cut {
        (true, false) => (low.min(high - size), high),
        (false, true) => (low, high.max(low + size)),
        _ => (low, high),
    };
    let (x_min, x_max) = moved(b.x_min, b.x_max, across, width);
    let (y_min, y_max) = moved(b.y_min, b.y_max, down, height);
    PixelBox {
        x_min,
        y_min,
        x_max,
        y_max,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x_min: f64, y_min: f64, x_max: f64, y_max: f64) -> PixelBox {
        PixelBox {
            x_min,
            y_min,
            x_max,
            y_max,
        }
    }

    #[test]
    fn a_box_grows_over_the_border_that_cuts_it() {
        let whole = |b| whole(b, (640, 480), 60.0, 0.5);
        let inside = square(100.0, 100.0, 120.0, 110.0);
        assert_eq!(whole(inside), inside);
        // By its own height, which is not cut.
        let left = whole(square(-0.5, 100.0, 19.5, 130.0));
        assert_eq!(left, square(-40.5, 100.0, 19.5, 130.0));
        let right = whole(square(630.0, 100.0, 639.5, 120.0));
        assert_eq!(right, square(630.0, 100.0, 670.0, 120.0));
        let bottom = whole(square(100.0, 470.0, 140.0, 479.5));
        assert_eq!(bottom, square(100.0, 470.0, 140.0, 490.0));
        // By what the rock looks like.
        let corner = whole(square(620.0, 470.0, 639.5, 479.5));
        assert_eq!(corner, square(620.0, 470.0, 680.0, 500.0));
        let beyond = square(-12.0, 100.0, 19.5, 130.0);
        assert_eq!(whole(beyond), beyond);
        // Larger than that: it stays. Cut on both sides: nobody knows where to grow.
        let large = square(-0.5, 100.0, 99.5, 130.0);
        assert_eq!(whole(large), large);
        let across = square(-0.5, 100.0, 639.5, 130.0);
        assert_eq!(whole(across), across);
    }
}
