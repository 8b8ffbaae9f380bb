//! Small pieces of pictures around the rocks.

use std::cmp::Reverse;

use nalgebra::Matrix2;
use serde::Serialize;

use super::packed::base64;
use crate::detection::{Mark, PixelBox};
use crate::frame::Pixel;
use crate::publish::annotated::apparent_radius_px;
use crate::publish::residual::whole_box;
use crate::publish::rock::project_covariance;
use crate::publish::{Picture, Rock, Scene};
use crate::view::View;

/// The most crops of one rock in pictures that detected it.
const MAX_SEEN: usize = 12;
/// The most crops of one rock in pictures that cover it and did not detect it.
const MAX_MISSED: usize = 4;
/// The most crops that are cut in all.
const MAX_CROPS: usize = 1500;
/// The most characters that all crops together take in the page.
const MAX_TEXT: usize = 2_000_000;
/// The longest side of a stored crop, pixels; what is larger in the picture is reduced.
const SIDE_PX: u32 = 112;
/// The least half side in the picture, pixels.
const MIN_HALF_PX: f64 = 28.0;
/// The JPEG quality of crops.
const QUALITY: u8 = 72;

/// The limits that hold for crops, as the page tells them.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Limits {
    seen: usize,
    missed: usize,
    side_px: u32,
    text: usize,
    /// What would have been shown without a limit on all crops together.
    wanted: usize,
}

/// The crops a page would show, with what comes first in front: a first crop of every rock before
/// a second one of any.
pub struct CropPlan {
    wanted: Vec<Wanted>,
    n_wanted: usize,
}

/// A crop that was cut.
pub struct CutCrop {
    index: usize,
    jpeg: Vec<u8>,
}

/// Columns and rows of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Window {
    column: u32,
    row: u32,
    width: u32,
    height: u32,
}

/// A crop to be cut.
#[derive(Debug, Clone, Serialize)]
struct Wanted {
    /// The rock's index.
    rock: usize,
    /// The view's index.
    view: usize,
    /// Index of the detection on the ground; `None` where the view missed the rock.
    detection: Option<usize>,
    #[serde(flatten)]
    window: Window,
    /// Where the rock's place is in the picture, pixels.
    place_px: [f64; 2],
    /// Covariance there, px^2: of columns, of both, of rows.
    covariance_px2: [f64; 3],
    /// The detector's box: left, upper, right, lower edge, pixels; for a point, twice the point. One
    /// that the picture's border cuts is as large as if the picture went on.
    mark_px: Option<[f64; 4]>,
}

/// A crop in the page.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Crop {
    #[serde(flatten)]
    about: Wanted,
    /// The JPEG in base64.
    jpeg: String,
}

impl CropPlan {
    /// What to cut for these rocks.
    pub fn new(scene: &Scene<'_>, rocks: &[Rock]) -> Self {
        let mut ranked = Vec::new();
        for (index, rock) in rocks.iter().enumerate() {
            let seen = seen(scene, index, rock).into_iter().take(MAX_SEEN);
            let missed = missed(scene, index, rock).take(MAX_MISSED);
            // A rock's best crop is worth more than the second of another; misses come after four.
            let seen = seen.enumerate();
            let missed = missed.enumerate().map(|(i, wanted)| (i + 4, wanted));
            for (rank, wanted) in seen.chain(missed) {
                let views = Reverse(rock.detected_by.len());
                ranked.push(((rank, views, index, wanted.detection.is_none()), wanted));
            }
        }
        ranked.sort_by_key(|(rank, _)| *rank);
        let n_wanted = ranked.len();
        ranked.truncate(MAX_CROPS);
        Self {
            wanted: ranked.into_iter().map(|(_, wanted)| wanted).collect(),
            n_wanted,
        }
    }

    /// A plan for a map of nothing.
    pub fn empty() -> Self {
        Self {
            wanted: Vec::new(),
            n_wanted: 0,
        }
    }

    /// Whether anything is cut from the picture of a view.
    pub fn needs(&self, view: usize) -> bool {
        self.wanted.iter().any(|w| w.view == view)
    }

    /// Cuts what is wanted from the picture of a view. One that cannot be encoded is left out.
    pub fn cut(&self, view: usize, picture: &Picture) -> Vec<CutCrop> {
        let here = self
            .wanted
            .iter()
            .enumerate()
            .filter(|(_, w)| w.view == view);
        here.filter_map(|(index, wanted)| {
            let Window {
                column,
                row,
                width,
                height,
            } = wanted.window;
            let crop = picture.reduced(column, row, width, height, SIDE_PX)?;
            let jpeg = crop.to_small_jpeg(QUALITY).ok()?;
            Some(CutCrop { index, jpeg })
        })
        .collect()
    }

    /// The limits, and how many crops there would be without one on all of them.
    pub(super) fn limits(&self) -> Limits {
        Limits {
            seen: MAX_SEEN,
            missed: MAX_MISSED,
            side_px: SIDE_PX,
            text: MAX_TEXT,
            wanted: self.n_wanted,
        }
    }

    /// What of the crops there is room for in the page.
    pub(super) fn kept(&self, cut: &[CutCrop]) -> Vec<Crop> {
        let mut in_order: Vec<&CutCrop> = cut.iter().collect();
        in_order.sort_by_key(|crop| crop.index);
        let mut room = MAX_TEXT;
        let mut kept = Vec::new();
        for crop in in_order {
            let jpeg = base64(&crop.jpeg);
            let Some(rest) = room.checked_sub(jpeg.len()) else {
                break;
            };
            room = rest;
            let about = self.wanted[crop.index].clone();
            kept.push(Crop { about, jpeg });
        }
        kept
    }
}

/// A crop for each detection that belongs to the rock, the largest first.
fn seen(scene: &Scene<'_>, index: usize, rock: &Rock) -> Vec<Wanted> {
    let firm = rock.evidence.iter().filter(|e| e.is_firm());
    let mut crops: Vec<(f64, Wanted)> = firm
        .filter_map(|evidence| {
            let detection = &scene.placed[evidence.placed].detection;
            let mark = match detection.mark {
                Mark::Box(b) => b,
                Mark::Point(p) => PixelBox {
                    x_min: p.u,
                    y_min: p.v,
                    x_max: p.u,
                    y_max: p.v,
                },
                Mark::Bearing(_) | Mark::Azimuth(_) => return None,
            };
            let size = mark.width().max(mark.height());
            let wanted = wanted(scene, index, rock, evidence.view, Some(mark))?;
            let detection = Some(evidence.placed);
            Some((
                size,
                Wanted {
                    detection,
                    ..wanted
                },
            ))
        })
        .collect();
    crops.sort_by(|a, b| b.0.total_cmp(&a.0));
    crops.into_iter().map(|(_, wanted)| wanted).collect()
}

/// A crop for each view that covers the rock and did not detect it.
fn missed<'a>(
    scene: &'a Scene<'a>,
    index: usize,
    rock: &'a Rock,
) -> impl Iterator<Item = Wanted> + 'a {
    let views = rock.missed_by.iter();
    views.filter_map(move |&view| wanted(scene, index, rock, view, None))
}

/// The crop of a rock in a view with a picture, around its place and its mark.
fn wanted(
    scene: &Scene<'_>,
    index: usize,
    rock: &Rock,
    view_index: usize,
    mark: Option<PixelBox>,
) -> Option<Wanted> {
    let view: &View = &scene.views[view_index];
    view.picture.as_ref()?;
    let camera = view.camera.as_ref()?;
    let size = (camera.width, camera.height);
    let (place, covariance) = project_covariance(view, rock.object.place, &rock.object.covariance)?;
    if mark.is_none() && !place.is_inside(size.0, size.1) {
        return None;
    }
    let radius = apparent_radius_px(view, rock, place).unwrap_or(0.0);
    let (centre, extent) = match mark {
        Some(b) => {
            let centre = Pixel::new(0.5 * (b.x_min + b.x_max), 0.5 * (b.y_min + b.y_max));
            let offset = (place.u - centre.u).abs().max((place.v - centre.v).abs());
            (centre, (0.8 * b.width().max(b.height())).max(offset + 14.0))
        }
        None => (place, 1.6 * radius),
    };
    Some(Wanted {
        rock: index,
        view: view_index,
        detection: None,
        window: window(centre, extent.max(MIN_HALF_PX), size)?,
        place_px: [hundredths(place.u), hundredths(place.v)],
        covariance_px2: upper(&covariance),
        mark_px: mark
            .map(|b| whole_box(b, view, (rock.object.place, place), rock.extent).unwrap_or(b))
            .map(|b| [b.x_min, b.y_min, b.x_max, b.y_max].map(hundredths)),
    })
}

/// A square of this half side about a pixel, moved into the picture where it leaves it and cut
/// where the picture is smaller; `None` where none of it lies in the picture.
fn window(centre: Pixel, half_px: f64, (width, height): (u32, u32)) -> Option<Window> {
    let meets = |at: f64, end: u32| at + half_px >= 0.0 && at - half_px <= f64::from(end);
    if !(meets(centre.u, width) && meets(centre.v, height)) {
        return None;
    }
    let along = |at: f64, end: u32| {
        let side = (2.0 * half_px).ceil().min(f64::from(end));
        let start = (at - half_px).round().clamp(0.0, f64::from(end) - side);
        (whole(start), whole(side))
    };
    let ((column, width), (row, height)) = (along(centre.u, width), along(centre.v, height));
    Some(Window {
        column,
        row,
        width,
        height,
    })
}

fn whole(x: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number within a picture"
    )]
    let whole = x as u32;
    whole
}

fn upper(m: &Matrix2<f64>) -> [f64; 3] {
    [m[(0, 0)], m[(0, 1)], m[(1, 1)]].map(hundredths)
}

fn hundredths(x: f64) -> f64 {
    (x * 100.0).round() / 100.0 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_stay_in_the_picture() {
        let at = |u, v, half| window(Pixel::new(u, v), half, (640, 480));
        let square = |column, row, side| {
            Some(Window {
                column,
                row,
                width: side,
                height: side,
            })
        };
        assert_eq!(at(320.0, 240.0, 30.0), square(290, 210, 60));
        assert_eq!(at(3.0, 478.0, 30.0), square(0, 420, 60));
        assert_eq!(at(-31.0, 240.0, 30.0), None);
        let whole = Window {
            column: 0,
            row: 0,
            width: 640,
            height: 480,
        };
        assert_eq!(at(100.0, 100.0, 1000.0), Some(whole));
    }

    fn one(rock: usize) -> Wanted {
        Wanted {
            rock,
            view: 0,
            detection: Some(0),
            window: Window {
                column: 0,
                row: 0,
                width: 8,
                height: 8,
            },
            place_px: [4.0, 4.0],
            covariance_px2: [1.0, 0.0, 1.0],
            mark_px: None,
        }
    }

    #[test]
    fn crops_are_kept_in_order_while_there_is_room() {
        let plan = CropPlan {
            wanted: (0..4).map(one).collect(),
            n_wanted: 4,
        };
        let cut = |index, bytes| CutCrop {
            index,
            jpeg: vec![0; bytes],
        };
        let kept = plan.kept(&[
            cut(2, 30),
            cut(0, 900_000),
            cut(1, 500_000),
            cut(3, 900_000),
        ]);
        let rocks: Vec<usize> = kept.iter().map(|c| c.about.rock).collect();
        assert_eq!(rocks, [0, 1, 2]);
    }

    #[test]
    fn a_crop_is_cut_from_its_own_window() {
        let picture = Picture::from_fn(64, 48, |x, _| if x < 32 { [250; 3] } else { [5; 3] });
        let picture = picture.unwrap();
        let mut wanted = one(0);
        wanted.window = Window {
            column: 30,
            row: 10,
            width: 4,
            height: 8,
        };
        let plan = CropPlan {
            wanted: vec![wanted],
            n_wanted: 1,
        };
        assert!(plan.needs(0) && !plan.needs(1) && plan.cut(1, &picture).is_empty());
        let cut = plan.cut(0, &picture);
        let crop = Picture::decode(&cut[0].jpeg).unwrap();
        assert_eq!((crop.width(), crop.height()), (4, 8));
        assert!(crop.colour(0, 4).unwrap()[0] > 200 && crop.colour(3, 4).unwrap()[0] < 60);
    }
}
