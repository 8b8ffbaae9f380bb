//! What the page is made from.

use std::collections::BTreeMap;

use geo::{BoundingRect, MultiPolygon, Simplify};
use serde::Serialize;
use serde_json::Value;

use super::Run;
use super::charts::{Histogram, RockAbundance, SizeFrequency};
use super::coverage::{Coverage, coverage};
use super::crops::{Crop, Limits};
use super::packed::Packed;
use crate::footprint::Footprint;
use crate::frame::{Enu, Point};
use crate::input::{Reason, Reject};
use crate::publish::layer;
use crate::publish::rock::Evidence;
use crate::publish::{Rock, Scene};
use crate::view::View;

/// Outlines of footprints may deviate by this share of their size, or by [`FINE_M`].
const SIMPLER: f64 = 0.002;
/// Metres.
const FINE_M: f64 = 0.01;
/// The most rejects listed by themselves; all are counted.
const MAX_REJECTS: usize = 200;
/// Bins of a histogram of lengths.
const BINS: u32 = 30;
/// Bins of a histogram of counts.
const COUNT_BINS: usize = 40;
const DEG_PER_RAD: f64 = 180.0 / std::f64::consts::PI;
/// Abundances whose laws are drawn beside the measured sizes.
const ABUNDANCES: [f64; 4] = [0.03, 0.1, 0.2, 0.4];

/// Corners of a ring: east and north, metres.
type Ring = Vec<[f64; 2]>;

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Page<'a> {
    title: &'a str,
    manifest: &'a Value,
    rocks: Rocks<'a>,
    detections: Detections<'a>,
    views: Views<'a>,
    ways: Vec<Packed>,
    coverage: Option<Coverage>,
    crops: Vec<Crop>,
    crop_limits: Limits,
    charts: Charts,
    rejects: Rejects<'a>,
}

/// A column of each value, with an entry a rock. Places and covariances are in the site's ENU.
#[derive(Debug, Serialize)]
struct Rocks<'a> {
    id: Vec<&'a str>,
    /// Index of the name in `classes`.
    class: Packed,
    classes: Vec<Option<&'a str>>,
    east_m: Packed,
    north_m: Packed,
    lat_deg: Packed,
    lon_deg: Packed,
    height_m: Packed,
    /// 1-sigma half-axes, and the azimuth of the long one, degrees.
    sigma_major_m: Packed,
    sigma_minor_m: Packed,
    sigma_az_deg: Packed,
    /// East-east, east-north, east-up, north-north, north-up, up-up of each rock in turn, m^2.
    covariance_m2: Packed,
    diameter_m: Packed,
    p_exist: Packed,
    n_views: Packed,
    /// Where the members of each rock begin in the next four columns.
    members: Packed,
    member: Packed,
    weight: Packed,
    residual_px: Packed,
    residual_m: Packed,
    /// Where the views that missed each rock begin in the next column.
    misses: Packed,
    missed_by: Packed,
}

/// A column of each value, with an entry a detection on the ground.
#[derive(Debug, Serialize)]
struct Detections<'a> {
    id: Vec<&'a str>,
    view: Packed,
    east_m: Packed,
    north_m: Packed,
    range_m: Packed,
    score: Packed,
}

/// A column of each value, with an entry a view.
#[derive(Debug, Serialize)]
struct Views<'a> {
    id: Vec<&'a str>,
    camera: Vec<Option<&'a str>>,
    time: Vec<Option<String>>,
    /// The annotated picture, relative to the page.
    picture: &'a [Option<String>],
    east_m: Packed,
    north_m: Packed,
    yaw_deg: Packed,
    area_m2: Packed,
    n_detections: Packed,
    /// How far poses were corrected; NaN where they are as measured.
    shift_m: Packed,
    turn_deg: Packed,
    /// East, north, up at the platform, metres, and roll, pitch, yaw, degrees, of each correction
    /// in turn; NaN likewise.
    correction: Packed,
    /// How far along its platform's way the view is, metres.
    along_m: Packed,
    /// Where the rings of each footprint begin in `rings`, where each ring in `corners`, and
    /// these: east and north in turn, metres.
    footprints: Packed,
    rings: Packed,
    corners: Packed,
}

/// Distributions; absent where there is nothing to distribute.
#[derive(Debug, Serialize)]
struct Charts {
    sizes: Option<SizeFrequency>,
    /// Laws to compare with.
    laws: Vec<RockAbundance>,
    existence: Option<Histogram>,
    residual_px: Option<Histogram>,
    residual_m: Option<Histogram>,
    views_by_rock: Option<Histogram>,
    detections_by_view: Option<Histogram>,
}

/// Records set aside.
#[derive(Debug, Serialize)]
struct Rejects<'a> {
    by_reason: BTreeMap<Reason, usize>,
    /// File, line, record, reason, detail of the first ones.
    first: Vec<(&'a str, Option<u64>, &'a str, Reason, &'a str)>,
}

/// Gathers the page.
pub(super) fn page<'a>(scene: &'a Scene<'a>, rocks: &'a [Rock], run: &'a Run<'a>) -> Page<'a> {
    let coverage = coverage(scene.footprints);
    let seen_m2 = coverage
        .as_ref()
        .and_then(|c| c.seen_by_at_least_m2.first().copied());
    Page {
        title: run.title,
        manifest: run.manifest,
        rocks: rock_columns(scene, rocks),
        detections: detections(scene),
        views: views(scene, run),
        ways: ways(scene),
        charts: charts(scene, rocks, seen_m2.unwrap_or(0.0)),
        coverage,
        crops: run.plan.kept(run.crops),
        crop_limits: run.plan.limits(),
        rejects: rejects(run.rejects),
    }
}

fn rock_columns<'a>(scene: &'a Scene<'a>, rocks: &'a [Rock]) -> Rocks<'a> {
    let planet = scene.site.planet();
    let of = |value: &dyn Fn(&Rock) -> Option<f64>| Packed::f32(rocks.iter().map(value));
    let members = || rocks.iter().flat_map(|r| &r.evidence);
    let of_member = |value: &dyn Fn(&Evidence) -> Option<f64>| Packed::f32(members().map(value));
    Rocks {
        id: rocks.iter().map(|r| r.rock_id.as_str()).collect(),
        class: Packed::indices(rocks.iter().map(|r| Some(r.object.class))),
        classes: scene.classes.iter().map(Option::as_deref).collect(),
        east_m: of(&|r| Some(r.object.place.xyz.x)),
        north_m: of(&|r| Some(r.object.place.xyz.y)),
        lat_deg: Packed::f64(rocks.iter().map(|r| layer::lon_lat(r.geodetic, planet).y)),
        lon_deg: Packed::f64(rocks.iter().map(|r| layer::lon_lat(r.geodetic, planet).x)),
        height_m: Packed::f64(rocks.iter().map(|r| r.geodetic.height_m)),
        sigma_major_m: of(&|r| Some(r.ellipse.sigma_major_m)),
        sigma_minor_m: of(&|r| Some(r.ellipse.sigma_minor_m)),
        sigma_az_deg: of(&|r| Some(r.ellipse.azimuth.to_degrees())),
        covariance_m2: Packed::f32(rocks.iter().flat_map(|r| {
            let c = &r.object.covariance;
            [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| Some(c[at]))
        })),
        diameter_m: of(&|r| r.diameter_m),
        p_exist: of(&|r| r.object.p_exist),
        n_views: Packed::indices(rocks.iter().map(|r| Some(r.detected_by.len()))),
        members: Packed::offsets(rocks.iter().map(|r| r.evidence.len())),
        member: Packed::indices(members().map(|e| Some(e.placed))),
        weight: of_member(&|e| Some(e.weight)),
        residual_px: of_member(&|e| e.residual_px),
        residual_m: of_member(&|e| Some(e.residual_m)),
        misses: Packed::offsets(rocks.iter().map(|r| r.missed_by.len())),
        missed_by: Packed::indices(rocks.iter().flat_map(|r| &r.missed_by).map(|&v| Some(v))),
    }
}

fn detections<'a>(scene: &'a Scene<'a>) -> Detections<'a> {
    let placed = scene.placed;
    Detections {
        id: placed.iter().map(|p| p.detection.det_id.as_str()).collect(),
        view: Packed::indices(placed.iter().map(|p| Some(p.view))),
        east_m: Packed::f32(placed.iter().map(|p| Some(p.hit.point.xyz.x))),
        north_m: Packed::f32(placed.iter().map(|p| Some(p.hit.point.xyz.y))),
        range_m: Packed::f32(placed.iter().map(|p| Some(p.hit.slant_range_m))),
        score: Packed::f32(placed.iter().map(|p| p.detection.score)),
    }
}

fn views<'a>(scene: &'a Scene<'a>, run: &'a Run<'a>) -> Views<'a> {
    let views = scene.views;
    let grounds = scene.footprints.all().iter().map(Footprint::ground);
    let all: Vec<Vec<Ring>> = grounds.map(outline).collect();
    let flat = || all.iter().flatten();
    let corrections: Vec<_> = (0..views.len()).map(|v| scene.correction(v)).collect();
    Views {
        id: views.iter().map(|v| v.image_id.as_str()).collect(),
        camera: views.iter().map(|v| v.camera_name()).collect(),
        time: views
            .iter()
            .map(|v| v.time.map(|t| t.to_string()))
            .collect(),
        picture: run.pictures,
        east_m: Packed::f32(views.iter().map(|v| Some(v.origin().xyz.x))),
        north_m: Packed::f32(views.iter().map(|v| Some(v.origin().xyz.y))),
        yaw_deg: Packed::f32(views.iter().map(|v| v.yaw().map(f64::to_degrees))),
        area_m2: Packed::f32(scene.footprints.all().iter().map(|f| Some(f.area_m2()))),
        n_detections: Packed::indices(detections_by_view(scene).into_iter().map(Some)),
        shift_m: Packed::f32(corrections.iter().map(|c| c.map(|c| c.shift_m))),
        turn_deg: Packed::f32(corrections.iter().map(|c| c.map(|c| c.turn.to_degrees()))),
        correction: Packed::f32(corrections.iter().flat_map(|c| {
            let of = |i: usize| c.map(|c| c.parts[i] * if i < 3 { 1.0 } else { DEG_PER_RAD });
            [0, 1, 2, 3, 4, 5].map(of)
        })),
        along_m: Packed::f32(along_m(views).into_iter().map(Some)),
        footprints: Packed::offsets(all.iter().map(Vec::len)),
        rings: Packed::offsets(flat().map(Vec::len)),
        corners: Packed::f32(flat().flatten().flatten().map(|&x| Some(x))),
    }
}

/// The rings of an area, without corners that hardly show.
fn outline(area: &MultiPolygon<f64>) -> Vec<Ring> {
    let Some(bounds) = area.bounding_rect() else {
        return Vec::new();
    };
    let size_m = bounds.width().max(bounds.height());
    let simple = area.simplify((SIMPLER * size_m).max(FINE_M));
    let mut rings = Vec::new();
    for polygon in &simple {
        for ring in std::iter::once(polygon.exterior()).chain(polygon.interiors()) {
            rings.push(ring.coords().map(|c| [c.x, c.y]).collect());
        }
    }
    rings
}

/// How far along the way of its platform each view is, metres.
fn along_m(views: &[View]) -> Vec<f64> {
    let mut so_far: BTreeMap<Option<&str>, (Point<Enu>, f64)> = BTreeMap::new();
    let places = views.iter().map(|view| {
        let here = view.pose.enu_from_body.origin();
        let before = so_far.get(&view.platform.as_deref());
        let along = before.map_or(0.0, |&(last, along)| along + last.distance(here));
        so_far.insert(view.platform.as_deref(), (here, along));
        along
    });
    places.collect()
}

fn detections_by_view(scene: &Scene<'_>) -> Vec<usize> {
    let mut counts = vec![0; scene.views.len()];
    for placed in scene.placed {
        counts[placed.view] += 1;
    }
    counts
}

/// The way of each platform: east and north in turn, metres.
fn ways(scene: &Scene<'_>) -> Vec<Packed> {
    let mut ways: BTreeMap<Option<&str>, Vec<Option<f64>>> = BTreeMap::new();
    for view in scene.views {
        let at = view.pose.enu_from_body.origin().xyz;
        let way = ways.entry(view.platform.as_deref()).or_default();
        way.extend([Some(at.x), Some(at.y)]);
    }
    ways.into_values().map(Packed::f32).collect()
}

fn charts(scene: &Scene<'_>, rocks: &[Rock], seen_m2: f64) -> Charts {
    let firm: Vec<&Evidence> = rocks
        .iter()
        .flat_map(|r| &r.evidence)
        .filter(|e| e.is_firm())
        .collect();
    let px: Vec<f64> = firm.iter().filter_map(|e| e.residual_px).collect();
    let m: Vec<f64> = firm.iter().map(|e| e.residual_m).collect();
    let existence: Vec<f64> = rocks.iter().filter_map(|r| r.object.p_exist).collect();
    let n_views: Vec<usize> = rocks.iter().map(|r| r.detected_by.len()).collect();
    Charts {
        sizes: SizeFrequency::of(rocks.iter().filter_map(|r| r.diameter_m), seen_m2),
        laws: ABUNDANCES.map(RockAbundance::new).to_vec(),
        existence: Histogram::of_shares(&existence),
        residual_px: Histogram::of(&px, BINS),
        residual_m: Histogram::of(&m, BINS),
        views_by_rock: Histogram::of_counts(&n_views, COUNT_BINS),
        detections_by_view: Histogram::of_counts(&detections_by_view(scene), COUNT_BINS),
    }
}

fn rejects(rejects: &[Reject]) -> Rejects<'_> {
    let mut by_reason = BTreeMap::new();
    for reject in rejects {
        *by_reason.entry(reject.reason).or_insert(0) += 1;
    }
    let first = rejects.iter().take(MAX_REJECTS);
    Rejects {
        by_reason,
        first: first
            .map(|r| {
                (
                    r.file.as_str(),
                    r.line,
                    r.record.as_str(),
                    r.reason,
                    r.detail.as_str(),
                )
            })
            .collect(),
    }
}
