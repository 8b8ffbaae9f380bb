//! The pictures with the fused rocks drawn back into them.

use geo::{Coord, Densify, Euclidean, LineString};

use super::Scene;
use super::annotate::{Annotation, DetectionMark, ObjectMark};
use super::rock::{Rock, project_covariance};
use crate::detection::Mark;
use crate::frame::{Pixel, Point};
use crate::view::View;

/// Outlines of covered ground are followed in steps of at most this, metres, so that straight edges
/// bend with the lens and the terrain.
const STEP_M: f64 = 0.25;
/// The radius a rock of unknown size is drawn with, metres.
const UNKNOWN_RADIUS_M: f64 = 0.1;

impl Scene<'_> {
    /// What is drawn into the picture of a view.
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
            objects: self.object_marks(view_index, rocks),
        }
    }

    /// Outlines, in the picture, of the ground that other views cover.
    fn covered(&self, view_index: usize) -> Vec<Vec<Pixel>> {
        let view = &self.views[view_index];
        let area = self.footprints.covered_by_others(view_index);
        let mut rings = Vec::new();
        for polygon in &area {
            for ring in std::iter::once(polygon.exterior()).chain(polygon.interiors()) {
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
    let distance_m = view.origin().distance(rock.object.place);
    let radius_m = rock.diameter_m.map_or(UNKNOWN_RADIUS_M, |d| 0.5 * d);
    let (_, by_pixel) = view.camera.as_ref()?.ray_with_jacobian(centre).ok()?;
    Some(radius_m / (distance_m * by_pixel.direction.column(0).norm()))
}
