//! The layers of the map.

use geo::{Coord, MultiPolygon, Polygon};
use serde_json::{Map, Value, json};

use super::Scene;
use super::geojson::{Geometry, Layer, lon_lat, number, optional};
use super::ground::Cartographer;
use super::rock::{Rock, objects_covered};
use crate::frame::{Ellipse, Enu, Point, covariance_ellipse};
use crate::project::Placed;
use crate::view::View;

/// Corners of an ellipse.
const CORNERS: u32 = 64;

fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// A number of degrees, from radians.
fn degrees(angle: f64) -> Value {
    number(angle.to_degrees(), 4)
}

fn text(value: Option<impl ToString>) -> Value {
    value.map_or(Value::Null, |v| Value::from(v.to_string()))
}

impl Scene<'_> {
    /// rocks.geojson.
    pub(super) fn rocks(&self, rocks: &[Rock], run_id: &str) -> Layer {
        let mut layer = Layer::new("rocks", self.site.planet());
        for rock in rocks {
            let best = rock.best_view.map(|v| &self.views[v].image_id);
            let properties = json!({
                "rock_id": rock.rock_id,
                "class": rock.class,
                "p_exist": optional(rock.object.p_exist, 4),
                "n_views": rock.detected_by.len(),
                "n_missed": rock.missed_by.len(),
                "n_detections": rock.n_detections,
                "sigma_major_m": number(rock.ellipse.sigma_major_m, 4),
                "sigma_minor_m": number(rock.ellipse.sigma_minor_m, 4),
                "sigma_az_deg": degrees(rock.ellipse.azimuth),
                "diameter_m": optional(rock.diameter_m, 4),
                "height_m": number(rock.geodetic.height_m, 4),
                "score": optional(rock.score, 4),
                "best_image": best,
                "first_seen": text(rock.seen.map(|s| s.0)),
                "last_seen": text(rock.seen.map(|s| s.1)),
                "run_id": run_id,
            });
            let point = Geometry::Point(lon_lat(rock.geodetic));
            layer.add(rock.rock_id.clone(), point, object(properties));
        }
        layer
    }

    /// ellipses.geojson: where each rock is with 95 % probability.
    pub(super) fn ellipses(&self, rocks: &[Rock]) -> Layer {
        let mut layer = Layer::new("ellipses", self.site.planet());
        for rock in rocks {
            let properties = json!({
                "rock_id": rock.rock_id,
                "p_exist": optional(rock.object.p_exist, 4),
                "confidence": 0.95,
            });
            let outline = self.ellipse(rock);
            let area = self.on_map(rock.object.place.xyz.z, &outline.into());
            layer.add(
                rock.rock_id.clone(),
                Geometry::Polygons(area),
                object(properties),
            );
        }
        layer
    }

    /// footprints.geojson.
    pub(super) fn footprint_layer(&self, rocks: &[Rock]) -> Layer {
        let mut layer = Layer::new("footprints", self.site.planet());
        let covered = objects_covered(rocks);
        let mut detections = vec![0_usize; self.views.len()];
        for placed in self.placed {
            detections[placed.view] += 1;
        }
        for (i, view) in self.views.iter().enumerate() {
            let footprint = self.footprints.of(i);
            let properties = json!({
                "image_id": view.image_id,
                "camera": view.camera_name(),
                "time": text(view.time),
                "area_m2": number(footprint.area_m2(), 3),
                "n_detections": detections[i],
                "n_objects": covered.get(&i).copied().unwrap_or(0),
            });
            let area = self.on_map(view.origin().xyz.z, footprint.ground());
            layer.add(
                view.image_id.clone(),
                Geometry::Polygons(area),
                object(properties),
            );
        }
        layer
    }

    /// views.geojson: where every view was taken from.
    pub(super) fn view_layer(&self) -> Layer {
        let mut layer = Layer::new("views", self.site.planet());
        for (index, view) in self.views.iter().enumerate() {
            let correction = self.correction(index);
            let place = self.site.geodetic(view.origin());
            // Rounded first: what rounds up to a full turn is north.
            let rounded = |yaw: f64| (yaw.to_degrees() * 1e4).round() / 1e4;
            let yaw_deg = view.yaw().map(|yaw| rounded(yaw).rem_euclid(360.0));
            let properties = json!({
                "image_id": view.image_id,
                "camera": view.camera_name(),
                "time": text(view.time),
                "height_m": number(place.height_m, 4),
                "yaw_deg": optional(yaw_deg, 4),
                "pose_shift_m": optional(correction.map(|c| c.shift_m), 4),
                "pose_turn_deg": optional(correction.map(|c| c.turn.to_degrees()), 4),
            });
            let point = Geometry::Point(lon_lat(place));
            layer.add(view.image_id.clone(), point, object(properties));
        }
        layer
    }

    /// traverse.geojson: the way of each platform, through its views in the order of acquisition.
    pub(super) fn traverses(&self, site_name: &str) -> Layer {
        let mut layer = Layer::new("traverse", self.site.planet());
        let mut platforms: Vec<Option<&str>> = Vec::new();
        for view in self.views {
            if !platforms.contains(&view.platform.as_deref()) {
                platforms.push(view.platform.as_deref());
            }
        }
        for platform in platforms {
            let views: Vec<&View> = self
                .views
                .iter()
                .filter(|v| v.platform.as_deref() == platform)
                .collect();
            let stops: Vec<Point<Enu>> = views
                .iter()
                .map(|v| v.pose.enu_from_body.origin())
                .collect();
            if stops.len() < 2 {
                continue; // A line has at least two ends.
            }
            let length_m: f64 = stops.windows(2).map(|w| w[0].distance(w[1])).sum();
            let id = platform.unwrap_or(site_name);
            let properties = json!({
                "traverse_id": id,
                "length_m": number(length_m, 3),
                "first_seen": text(views.iter().filter_map(|v| v.time).min()),
                "last_seen": text(views.iter().filter_map(|v| v.time).max()),
            });
            let places: Vec<_> = stops.iter().map(|&p| self.site.geodetic(p)).collect();
            let level = |_: f64, _: f64| 0.0;
            let cartographer = Cartographer {
                site: self.site,
                up_m: &level,
            };
            let lines = Geometry::Lines(cartographer.line(&places));
            layer.add(id.to_owned(), lines, object(properties));
        }
        layer
    }

    /// detections.geojson: the single-view map. `rock_of` gives the rock a detection belongs to.
    pub(super) fn detections(&self, rock_of: &dyn Fn(usize) -> Option<String>) -> Layer {
        let mut layer = Layer::new("detections", self.site.planet());
        for (i, placed) in self.placed.iter().enumerate() {
            let place = self.site.geodetic(placed.hit.point);
            let ellipse = self.ellipse_of(placed);
            let detection = &placed.detection;
            let properties = json!({
                "image_id": detection.image_id,
                "det_id": detection.det_id,
                "class": detection.class,
                "score": optional(detection.score, 4),
                "range_m": number(placed.hit.slant_range_m, 4),
                "sigma_major_m": number(ellipse.sigma_major_m, 4),
                "sigma_minor_m": number(ellipse.sigma_minor_m, 4),
                "sigma_az_deg": degrees(ellipse.azimuth),
                "diameter_m": optional(placed.diameter_m, 4),
                "height_m": number(place.height_m, 4),
                "rock_id": rock_of(i),
            });
            layer.add(
                detection.key(),
                Geometry::Point(lon_lat(place)),
                object(properties),
            );
        }
        layer
    }

    fn ellipse_of(&self, placed: &Placed) -> Ellipse {
        let place = self.site.geodetic(placed.hit.point);
        let local_from_enu = self.site.enu_from_local(place).inverse().matrix();
        let covariance = local_from_enu * placed.covariance * local_from_enu.transpose();
        covariance_ellipse(covariance.fixed_view::<2, 2>(0, 0).into_owned())
    }

    /// The outline of a rock's 95 % ellipse in the site's ENU.
    fn ellipse(&self, rock: &Rock) -> Polygon<f64> {
        let enu_from_local = self.site.enu_from_local(rock.geodetic).matrix();
        let (sin_az, cos_az) = rock.ellipse.azimuth.sin_cos();
        let major_m = rock.ellipse.sigma_major_m * Ellipse::scale_95();
        // A polygon must have an extent, however well its centre is known.
        let minor_m = (rock.ellipse.sigma_minor_m * Ellipse::scale_95()).max(1e-3);
        let major_m = major_m.max(minor_m);
        let corner = |i: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(CORNERS);
            let (along, across) = (major_m * angle.cos(), minor_m * angle.sin());
            let local = nalgebra::Vector3::new(
                along * sin_az - across * cos_az,
                along * cos_az + across * sin_az,
                0.0,
            );
            let at = rock.object.place.xyz + enu_from_local * local;
            Coord { x: at.x, y: at.y }
        };
        let ring: Vec<Coord<f64>> = (0..CORNERS).map(corner).collect();
        Polygon::new(ring.into(), Vec::new())
    }

    /// An area of the ground on the map; `up_m` is how high it lies where no terrain says.
    fn on_map(&self, up_m: f64, area: &MultiPolygon<f64>) -> MultiPolygon<f64> {
        let ground = |east_m: f64, north_m: f64| {
            let ground = self.terrain.and_then(|t| t.ground_at(east_m, north_m));
            ground.map_or(up_m, |g| g.point.xyz.z)
        };
        let cartographer = Cartographer {
            site: self.site,
            up_m: &ground,
        };
        cartographer.area(area)
    }
}
