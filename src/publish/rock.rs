//! A fused object with everything a map says of it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix2;

use super::Scene;
use super::residual::{Extent, extent};
use crate::detection::{Detection, Mark};
use crate::frame::{Ellipse, Enu, Geodetic, Pixel, Point, covariance_ellipse};
use crate::fuse::{Member, Object};
use crate::pose::Time;
use crate::view::View;

/// A view detected a rock where some membership of its detections is at least this.
const DETECTED: f64 = 0.5;

/// A rock of the map.
#[derive(Debug, Clone)]
pub struct Rock {
    /// Its name in this map.
    pub rock_id: String,
    /// Its class, if detections carry one.
    pub class: Option<String>,
    /// The fused object.
    pub object: Object,
    /// Its place on the planet.
    pub geodetic: Geodetic,
    /// The 1-sigma ellipse at its own place.
    pub ellipse: Ellipse,
    /// Views that detected it, ascending.
    pub detected_by: BTreeSet<usize>,
    /// Views whose footprint covers it and that did not detect it, ascending.
    pub missed_by: BTreeSet<usize>,
    /// Detections that belong to it with at least one half.
    pub n_detections: usize,
    /// Weighted mean of the diameters its detections give, metres.
    pub diameter_m: Option<f64>,
    /// How large its whole boxes are.
    pub(crate) extent: Option<Extent>,
    /// Score of its largest member.
    pub score: Option<f64>,
    /// The view in which it appears largest.
    pub best_view: Option<usize>,
    /// When it was first and last detected.
    pub seen: Option<(Time, Time)>,
    /// Its members with their residuals.
    pub evidence: Vec<Evidence>,
}

/// One detection's part in a rock.
#[derive(Debug, Clone, Copy)]
pub struct Evidence {
    /// Index of the placed detection.
    pub placed: usize,
    /// Its view.
    pub view: usize,
    /// Membership probability.
    pub weight: f64,
    /// From the mark to the rock drawn back into the picture, pixels; a box that the picture's
    /// border cuts is made whole first.
    pub residual_px: Option<f64>,
    /// From the detection's place to the rock's on the ground, metres.
    pub residual_m: f64,
}

impl Evidence {
    /// Whether the detection is the rock's rather than another's.
    pub fn is_firm(&self) -> bool {
        self.weight >= DETECTED
    }
}

/// Names the fused objects and gathers what a map says of each.
pub(super) fn rocks(scene: &Scene<'_>, objects: &[Object]) -> Vec<Rock> {
    let digits = objects.len().to_string().len().max(4);
    let named = objects.iter().enumerate();
    named
        .map(|(i, object)| rock(scene, object, format!("r{:0digits$}", i + 1)))
        .collect()
}

fn rock(scene: &Scene<'_>, object: &Object, rock_id: String) -> Rock {
    let geodetic = scene.site.geodetic(object.place);
    let diameter_m = diameter(scene, &object.members);
    let extent = extent(scene, &object.members, diameter_m);
    let evidence: Vec<Evidence> = object
        .members
        .iter()
        .map(|member| evidence(scene, object.place, member, extent))
        .collect();
    let firm: Vec<&Evidence> = evidence.iter().filter(|e| e.is_firm()).collect();
    let detected_by: BTreeSet<usize> = firm.iter().map(|e| e.view).collect();
    let covering = scene.footprints.views_covering(object.place);
    let missed_by = covering
        .into_iter()
        .filter(|view| !detected_by.contains(view))
        .collect();
    let times: Vec<Time> = detected_by
        .iter()
        .filter_map(|&v| scene.views[v].time)
        .collect();
    Rock {
        class: scene.classes[object.class].clone(),
        geodetic,
        ellipse: local_ellipse(scene, object, geodetic),
        n_detections: firm.len(),
        diameter_m,
        extent,
        score: largest_score(scene, &evidence),
        best_view: best_view(scene, &firm),
        seen: times.iter().min().copied().zip(times.iter().max().copied()),
        object: object.clone(),
        detected_by,
        missed_by,
        evidence,
        rock_id,
    }
}

/// The ellipse in the axes of the object's own place: away from the site's origin, north there is
/// not north here.
fn local_ellipse(scene: &Scene<'_>, object: &Object, place: Geodetic) -> Ellipse {
    let local_from_enu = scene.site.enu_from_local(place).inverse().matrix();
    let covariance = local_from_enu * object.covariance * local_from_enu.transpose();
    covariance_ellipse(covariance.fixed_view::<2, 2>(0, 0).into_owned())
}

fn evidence(
    scene: &Scene<'_>,
    place: Point<Enu>,
    member: &Member,
    extent: Option<Extent>,
) -> Evidence {
    let found = &scene.placed[member.observation];
    let seen = (&scene.views[found.view], &found.detection);
    Evidence {
        placed: member.observation,
        view: found.view,
        weight: member.weight,
        residual_px: scene.residual_px(seen, place, extent),
        residual_m: found.hit.point.horizontal_distance(place),
    }
}

/// Where a place appears in a view's picture, with the covariance there of a place known to
/// `covariance` (m^2); `None` where the lens does not see it.
pub(super) fn project_covariance(
    view: &View,
    place: Point<Enu>,
    covariance: &nalgebra::Matrix3<f64>,
) -> Option<(Pixel, Matrix2<f64>)> {
    let (pixel, by_place) = project(view, place)?;
    Some((pixel, by_place * covariance * by_place.transpose()))
}

/// Where a place appears in a view's picture, with the derivative of the pixel by the place.
pub(super) fn project(view: &View, place: Point<Enu>) -> Option<(Pixel, nalgebra::Matrix2x3<f64>)> {
    let camera = view.camera.as_ref()?;
    let camera_from_enu = view.enu_from_camera()?.inverse();
    let (pixel, by_point) = camera.pixel_with_jacobian(camera_from_enu * place).ok()?;
    Some((pixel, by_point * camera_from_enu.rotation.matrix()))
}

fn diameter(scene: &Scene<'_>, members: &[Member]) -> Option<f64> {
    let mut sum = 0.0;
    let mut weight = 0.0;
    for member in members {
        if let Some(d) = scene.placed[member.observation].diameter_m {
            sum += member.weight * d;
            weight += member.weight;
        }
    }
    (weight > 0.0).then(|| sum / weight)
}

fn largest_score(scene: &Scene<'_>, evidence: &[Evidence]) -> Option<f64> {
    let score = |e: &Evidence| scene.placed[e.placed].detection.score;
    // The first of equals: evidence stands in a fixed order.
    let heaviest = evidence
        .iter()
        .rev()
        .max_by(|a, b| a.weight.total_cmp(&b.weight))?;
    score(heaviest)
}

/// The view with the largest box, or else the nearest one.
fn best_view(scene: &Scene<'_>, firm: &[&Evidence]) -> Option<usize> {
    let largeness = |e: &&&Evidence| {
        let placed = &scene.placed[e.placed];
        (area_px2(&placed.detection), -placed.hit.slant_range_m)
    };
    let larger = |a: &&&Evidence, b: &&&Evidence| {
        let (a, b) = (largeness(a), largeness(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    firm.iter().rev().max_by(larger).map(|e| e.view)
}

fn area_px2(detection: &Detection) -> f64 {
    match detection.mark {
        Mark::Box(b) => b.width() * b.height(),
        Mark::Point(_) | Mark::Bearing(_) | Mark::Azimuth(_) => 0.0,
    }
}

/// Objects detected by each view and covered by each footprint, by view.
pub(super) fn objects_covered(rocks: &[Rock]) -> BTreeMap<usize, usize> {
    let mut covered = BTreeMap::new();
    for rock in rocks {
        for &view in rock.detected_by.union(&rock.missed_by) {
            *covered.entry(view).or_insert(0) += 1;
        }
    }
    covered
}
