//! The pictures with the fused rocks drawn back into them.

use std::iter::once;

use geo::{Coord, Densify, Euclidean, LineString};

use serde::Serialize;

use super::Scene;
use super::annotate::{Annotation, DetectionMark, ObjectMark, PlacedMark};
use super::rock::{Rock, project_covariance};
use crate::detection::Mark;
use crate::frame::{Enu, Pixel, Point};
use crate::project::Placed;
use crate::view::View;

/// Outlines of covered ground are followed in steps of at most this, metres, so that straight edges
/// bend with the lens and the terrain.
const STEP_M: f64 = 0.25;
/// The radius a rock of unknown size is drawn with, metres.
const UNKNOWN_RADIUS_M: f64 = 0.1;

/// What the annotated pictures show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// The rocks of all views, beside the view's own detections, as in Figure 12 of Thompson and
    /// Wettergreen (2005).
    #[default]
    Fused,
    /// What the view alone detected, as in their Figure 11.
    Single,
    /// The one at the left, the other at the right.
    SideBySide,
}

impl Layout {
    /// All layouts there are.
    pub const ALL: [Self; 3] = [Self::Fused, Self::Single, Self::SideBySide];

    /// Its name in pipeline files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fused => "fused",
            Self::Single => "single",
            Self::SideBySide => "side-by-side",
        }
    }
}

impl Scene<'_> {
    /// What is drawn into the picture of a view, by panel.
    pub(super) fn panels(
        &self,
        view_index: usize,
        rocks: &[Rock],
        layout: Layout,
    ) -> Vec<Annotation> {
        let fused = self.annotation(view_index, rocks);
        let titled = |annotation: Annotation, what: &str| Annotation {
            title: format!("{} \u{b7} {what}", annotation.title),
            ..annotation
        };
        let single = |fused: &Annotation| Annotation {
            placed: self.placed_marks(view_index),
            objects: Vec::new(),
            ..titled(fused.clone(), "this view alone")
        };
        match layout {
            Layout::Fused => vec![fused],
            Layout::Single => vec![single(&fused)],
            Layout::SideBySide => vec![single(&fused), titled(fused, "all views fused")],
        }
    }

    /// What is drawn of the fused map.
    pub(super) fn annotation(&self, view_index: usize, rocks: &[Rock]) -> Annotation {
        let view = &self.views[view_index];
        let title = match view.camera_name() {
            Some(camera) => format!("{} \u{b7} {camera}", view.image_id),
            None => view.image_id.clone(),
        };
        Annotation {
            title,
            covered: self.covered(view_index),
            detections: self.detection_marks(view_index),
            placed: Vec::new(),
            objects: self.object_marks(view_index, rocks),
        }
    }

    /// Outlines, in the picture, of the ground that other views cover.
    fn covered(&self, view_index: usize) -> Vec<Vec<Pixel>> {
        let view = &self.views[view_index];
        let area = self.footprints.covered_by_others(view_index);
        let mut rings = Vec::new();
        for polygon in &area {
            for ring in once(polygon.exterior()).chain(polygon.interiors()) {
                rings.extend(self.ring_in_picture(view, ring));
            }
        }
        rings
    }

    fn ring_in_picture(&self, view: &View, ring: &LineString<f64>) -> Option<Vec<Pixel>> {
        let camera = view.camera.as_ref()?;
        let camera_from_enu = view.enu_from_camera()?.inverse();
        let fine = Euclidean.densify(ring, STEP_M);
        let pixels = fine.coords().filter_map(|at: &Coord<f64>| {
            let up = self.terrain?.ground_at(at.x, at.y)?.point.xyz.z;
            let place = Point::new(at.x, at.y, up);
            camera.pixel(camera_from_enu * place).ok()
        });
        let pixels: Vec<Pixel> = pixels.collect();
        (pixels.len() > 2).then_some(pixels)
    }

    fn detection_marks(&self, view_index: usize) -> Vec<DetectionMark> {
        let start = self
            .detections
            .partition_point(|(view, _)| *view < view_index);
        let rest = self.detections[start..].iter();
        let here = rest.take_while(|(view, _)| *view == view_index);
        here.filter_map(|(_, detection)| match detection.mark {
            Mark::Box(b) => Some(DetectionMark::Box {
                x_min: b.x_min,
                y_min: b.y_min,
                x_max: b.x_max,
                y_max: b.y_max,
            }),
            Mark::Point(pixel) => Some(DetectionMark::Point(pixel)),
            Mark::Bearing(_) | Mark::Azimuth(_) => None,
        })
        .collect()
    }

    /// The view's detections that have a place on the ground: about their own aim points, or where
    /// the place projects if they are no marks in the picture.
    fn placed_marks(&self, view_index: usize) -> Vec<PlacedMark> {
        let view = &self.views[view_index];
        let mark = |placed: &Placed| {
            let (at, _) = project_covariance(view, placed.hit.point, &placed.covariance)?;
            let centre = placed.detection.aim_point(self.aim).unwrap_or(at);
            let radius_px = match placed.detection.mark {
                Mark::Box(b) => 0.5 * b.width(),
                _ => placed.diameter_m.map_or(0.0, |diameter_m| {
                    radius_px(view, 0.5 * diameter_m, placed.hit.point, centre).unwrap_or(0.0)
                }),
            };
            Some(PlacedMark { centre, radius_px })
        };
        let here = self.placed.iter().filter(|p| p.view == view_index);
        here.filter_map(mark).collect()
    }

    fn object_marks(&self, view_index: usize, rocks: &[Rock]) -> Vec<ObjectMark> {
        let view = &self.views[view_index];
        let concerns = |rock: &&Rock| {
            rock.detected_by.contains(&view_index) || rock.missed_by.contains(&view_index)
        };
        let mark = |rock: &Rock| {
            let object = &rock.object;
            let (centre, covariance_px) =
                project_covariance(view, object.place, &object.covariance)?;
            Some(ObjectMark {
                label: rock.rock_id.clone(),
                centre,
                radius_px: apparent_radius_px(view, rock, centre)?,
                covariance_px,
                detected: rock.detected_by.contains(&view_index),
                p_exist: object.p_exist,
            })
        };
        rocks.iter().filter(concerns).filter_map(mark).collect()
    }
}

/// How large a rock appears in a view that has it at `centre`, pixels; `None` where the lens does
/// not see it.
pub(super) fn apparent_radius_px(view: &View, rock: &Rock, centre: Pixel) -> Option<f64> {
    let radius_m = rock.diameter_m.map_or(UNKNOWN_RADIUS_M, |d| 0.5 * d);
    radius_px(view, radius_m, rock.object.place, centre)
}

fn radius_px(view: &View, radius_m: f64, place: Point<Enu>, centre: Pixel) -> Option<f64> {
    let distance_m = view.origin().distance(place);
    let (_, by_pixel) = view.camera.as_ref()?.ray_with_jacobian(centre).ok()?;
    Some(radius_m / (distance_m * by_pixel.direction.column(0).norm()))
}
