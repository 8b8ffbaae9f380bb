//! The layers of the map, each described once.

use geo::{Coord, MultiPolygon, Polygon};

use super::Scene;
use super::corrected::Correction;
use super::ground::Cartographer;
use super::layer::{Column, Geometry, Kind, Layer, lon_lat, rounded};
use super::rock::{Evidence, Rock, objects_covered};
use crate::frame::{Ellipse, Enu, Geodetic, Point, covariance_ellipse};
use crate::project::Placed;
use crate::view::View;

/// Corners of an ellipse.
const CORNERS: u32 = 64;

/// Columns by what a row is.
type OfRock<'a> = Column<'a, &'a Rock>;
type OfFootprint<'a> = Column<'a, usize>;
type OfView<'a> = Column<'a, (&'a View, Geodetic, Option<Correction>)>;
type OfWay<'a> = Column<'a, Way<'a>>;
type OfDetection<'a> = Column<'a, (usize, &'a Placed, Geodetic, Ellipse)>;
type OfMember<'a> = Column<'a, (&'a Rock, &'a Evidence, &'a Placed)>;

impl Scene<'_> {
    /// Where the rocks are.
    pub(super) fn rocks(&self, rocks: &[Rock], run_id: &str) -> Layer {
        let mut columns: Vec<OfRock<'_>> = vec![
            OfRock::text("rock_id", "name, within this run", |r| {
                Some(r.rock_id.clone())
            }),
            OfRock::text("class", "class its detections carry", |r| r.class.clone()),
            OfRock::real("p_exist", 4, "probability that it exists", |r| {
                r.object.p_exist
            }),
            OfRock::count("n_views", "views that detected it", |r| r.detected_by.len()),
            OfRock::count(
                "n_missed",
                "views that cover it and did not detect it",
                |r| r.missed_by.len(),
            ),
            OfRock::count("n_detections", "detections that belong to it", |r| {
                r.n_detections
            }),
            OfRock::real(
                "sigma_major_m",
                4,
                "long half-axis of its 1-sigma ellipse, m",
                |r| Some(r.ellipse.sigma_major_m),
            ),
            OfRock::real(
                "sigma_minor_m",
                4,
                "short half-axis of its 1-sigma ellipse, m",
                |r| Some(r.ellipse.sigma_minor_m),
            ),
            OfRock::real(
                "sigma_az_deg",
                4,
                "azimuth of the long axis, degrees",
                |r| Some(r.ellipse.azimuth.to_degrees()),
            ),
            OfRock::real("diameter_m", 4, "diameter, m", |r| r.diameter_m),
            OfRock::real("height_m", 4, self.height_about(), |r| {
                self.height_m(r.geodetic)
            }),
            OfRock::real("score", 4, "score of the detection that counts most", |r| {
                r.score
            }),
            OfRock::text("best_image", "view in which it is largest", |r| {
                r.best_view.map(|v| self.views[v].image_id.clone())
            }),
            OfRock::time("first_seen", "first view that detected it", |r| {
                r.seen.map(|s| s.0)
            }),
            OfRock::time("last_seen", "last view that detected it", |r| {
                r.seen.map(|s| s.1)
            }),
            OfRock::text("run_id", "the run", |_| Some(run_id.to_owned())),
        ];
        if rocks.iter().any(|r| r.object.p_class.is_some()) {
            let about = "probability that it is of its class";
            columns.insert(2, OfRock::real("p_class", 4, about, |r| r.object.p_class));
        }
        let about = ("rocks", "Rocks", "where the rocks are");
        let rows = rocks.iter().map(|rock| {
            let point = Geometry::Point(lon_lat(rock.geodetic, self.site.planet()));
            (rock.rock_id.clone(), Some(point), rock)
        });
        self.layer(about, Kind::Point).filled(columns, rows)
    }

    /// Where each rock is with 95 % probability.
    pub(super) fn ellipses(&self, rocks: &[Rock]) -> Layer {
        let columns: Vec<OfRock<'_>> = vec![
            OfRock::text("rock_id", "the rock", |r| Some(r.rock_id.clone())),
            OfRock::real("p_exist", 4, "probability that it exists", |r| {
                r.object.p_exist
            }),
            OfRock::real(
                "confidence",
                2,
                "probability that the rock is inside",
                |_| Some(0.95),
            ),
        ];
        let about = (
            "ellipses",
            "95 % ellipses",
            "where each rock is with 95 % probability",
        );
        let rows = rocks.iter().map(|rock| {
            let outline = self.ellipse(rock);
            let area = self.on_map(rock.object.place.xyz.z, &outline.into());
            (rock.rock_id.clone(), Some(Geometry::Polygons(area)), rock)
        });
        self.layer(about, Kind::Polygon).filled(columns, rows)
    }

    /// What each view could have seen.
    pub(super) fn footprint_layer(&self, rocks: &[Rock]) -> Layer {
        let covered = objects_covered(rocks);
        let mut detections = vec![0_usize; self.views.len()];
        for placed in self.placed {
            detections[placed.view] += 1;
        }
        let columns: Vec<OfFootprint<'_>> = vec![
            OfFootprint::text("image_id", "the view", |&i| {
                Some(self.views[i].image_id.clone())
            }),
            OfFootprint::text("camera", "its camera", |&i| {
                self.views[i].camera_name().map(str::to_owned)
            }),
            OfFootprint::time("time", "when it was taken", |&i| self.views[i].time),
            OfFootprint::real("area_m2", 3, "area, m^2", |&i| {
                Some(self.footprints.of(i).area_m2())
            }),
            OfFootprint::count("n_detections", "its detections on the ground", |&i| {
                detections[i]
            }),
            OfFootprint::count("n_objects", "rocks it detected or covers", |i| {
                covered.get(i).copied().unwrap_or(0)
            }),
        ];
        let about = (
            "footprints",
            "Footprints",
            "the ground that each view could have seen",
        );
        let rows = self.views.iter().enumerate().map(|(i, view)| {
            let area = self.on_map(view.origin().xyz.z, self.footprints.of(i).ground());
            (view.image_id.clone(), Some(Geometry::Polygons(area)), i)
        });
        self.layer(about, Kind::Polygon).filled(columns, rows)
    }

    /// Where every view was taken from.
    pub(super) fn view_layer(&self) -> Layer {
        // Rounded first: what rounds up to a full turn is north.
        let yaw_deg = |yaw: f64| rounded(yaw.to_degrees(), 4).rem_euclid(360.0);
        let columns: Vec<OfView<'_>> = vec![
            OfView::text("image_id", "the view", |(view, ..)| {
                Some(view.image_id.clone())
            }),
            OfView::text("camera", "its camera", |(view, ..)| {
                view.camera_name().map(str::to_owned)
            }),
            OfView::time("time", "when it was taken", |(view, ..)| view.time),
            OfView::real("height_m", 4, self.height_about(), |(_, place, _)| {
                self.height_m(*place)
            }),
            OfView::real(
                "yaw_deg",
                4,
                "heading of the body, degrees",
                |(view, ..)| view.yaw().map(yaw_deg),
            ),
            OfView::real("pose_shift_m", 4, "how far its pose was moved, m", |row| {
                row.2.map(|c| c.shift_m)
            }),
            OfView::real(
                "pose_turn_deg",
                4,
                "how far its pose was turned, degrees",
                |row| row.2.map(|c| c.turn.to_degrees()),
            ),
        ];
        let about = ("views", "Views", "where every view was taken from");
        let rows = self.views.iter().enumerate().map(|(i, view)| {
            let place = self.site.geodetic(view.origin());
            let point = Geometry::Point(lon_lat(place, self.site.planet()));
            let row = (view, place, self.correction(i));
            (view.image_id.clone(), Some(point), row)
        });
        self.layer(about, Kind::Point).filled(columns, rows)
    }

    /// The way of each platform, through its views in the order of acquisition.
    pub(super) fn traverses(&self, site_name: &str) -> Layer {
        let columns: Vec<OfWay<'_>> = vec![
            OfWay::text("traverse_id", "the platform", |way| Some(way.id.to_owned())),
            OfWay::real("length_m", 3, "length, m", |way| {
                Some(way.stops.windows(2).map(|w| w[0].distance(w[1])).sum())
            }),
            OfWay::time("first_seen", "first view", |way| {
                way.views.iter().filter_map(|v| v.time).min()
            }),
            OfWay::time("last_seen", "last view", |way| {
                way.views.iter().filter_map(|v| v.time).max()
            }),
        ];
        let about = ("traverse", "Traverse", "the way of each platform");
        let rows = self.ways(site_name).into_iter().map(|way| {
            let places: Vec<_> = way.stops.iter().map(|&p| self.site.geodetic(p)).collect();
            let lines = Cartographer::line(self.site.planet(), &places);
            (way.id.to_owned(), Some(Geometry::Lines(lines)), way)
        });
        self.layer(about, Kind::Line).filled(columns, rows)
    }

    /// The platforms with two or more views: a line has at least two ends.
    fn ways<'a>(&'a self, site_name: &'a str) -> Vec<Way<'a>> {
        let mut ways: Vec<Way<'a>> = Vec::new();
        for view in self.views {
            let platform = view.platform.as_deref();
            let stop = view.pose.enu_from_body.origin();
            match ways.iter_mut().find(|way| way.platform == platform) {
                Some(way) => {
                    way.views.push(view);
                    way.stops.push(stop);
                }
                None => ways.push(Way {
                    platform,
                    id: platform.unwrap_or(site_name),
                    views: vec![view],
                    stops: vec![stop],
                }),
            }
        }
        ways.retain(|way| way.stops.len() > 1);
        ways
    }

    /// The single-view map. `rock_of` gives the rock a detection belongs to.
    pub(super) fn detections(&self, rock_of: &dyn Fn(usize) -> Option<String>) -> Layer {
        let columns: Vec<OfDetection<'_>> = vec![
            OfDetection::text("image_id", "the view", |(_, p, ..)| {
                Some(p.detection.image_id.clone())
            }),
            OfDetection::text("det_id", "name, within the view", |(_, p, ..)| {
                Some(p.detection.det_id.clone())
            }),
            OfDetection::text("class", "class", |(_, p, ..)| p.detection.class.clone()),
            OfDetection::real("score", 4, "the detector's score", |(_, p, ..)| {
                p.detection.score
            }),
            OfDetection::real(
                "range_m",
                4,
                "slant distance from the camera, m",
                |(_, p, ..)| Some(p.hit.slant_range_m),
            ),
            OfDetection::real(
                "sigma_major_m",
                4,
                "long half-axis of its 1-sigma ellipse, m",
                |r| Some(r.3.sigma_major_m),
            ),
            OfDetection::real(
                "sigma_minor_m",
                4,
                "short half-axis of its 1-sigma ellipse, m",
                |r| Some(r.3.sigma_minor_m),
            ),
            OfDetection::real(
                "sigma_az_deg",
                4,
                "azimuth of the long axis, degrees",
                |r| Some(r.3.azimuth.to_degrees()),
            ),
            OfDetection::real("diameter_m", 4, "diameter, m", |(_, p, ..)| p.diameter_m),
            OfDetection::real("height_m", 4, self.height_about(), |r| self.height_m(r.2)),
            OfDetection::text("rock_id", "the rock it belongs to", |(i, ..)| rock_of(*i)),
        ];
        let about = ("detections", "Detections", "every detection by itself");
        let rows = self.placed.iter().enumerate().map(|(i, placed)| {
            let place = self.site.geodetic(placed.hit.point);
            let row = (i, placed, place, self.ellipse_of(placed));
            let point = Geometry::Point(lon_lat(place, self.site.planet()));
            (placed.detection.key(), Some(point), row)
        });
        self.layer(about, Kind::Point).filled(columns, rows)
    }

    /// What each rock rests on: every membership of at least 0.01.
    pub(super) fn evidence(&self, rocks: &[Rock]) -> Layer {
        let columns: Vec<OfMember<'_>> = vec![
            OfMember::text("rock_id", "the rock", |(rock, ..)| {
                Some(rock.rock_id.clone())
            }),
            OfMember::text("image_id", "the view", |(.., p)| {
                Some(p.detection.image_id.clone())
            }),
            OfMember::text("det_id", "the detection", |(.., p)| {
                Some(p.detection.det_id.clone())
            }),
            OfMember::real(
                "weight",
                6,
                "probability that it is of the rock",
                |(_, e, _)| Some(e.weight),
            ),
            OfMember::real(
                "residual_px",
                3,
                "from mark to rock in the picture, px",
                |(_, e, _)| e.residual_px,
            ),
            OfMember::real(
                "residual_m",
                4,
                "from detection to rock on the ground, m",
                |(_, e, _)| Some(e.residual_m),
            ),
        ];
        let about = ("evidence", "Evidence", "the detections each rock rests on");
        let members = rocks
            .iter()
            .flat_map(|rock| rock.evidence.iter().map(move |e| (rock, e)));
        let rows =
            members.map(|(rock, e)| (String::new(), None, (rock, e, &self.placed[e.placed])));
        Layer::new(about, None, self.site.planet()).filled(columns, rows)
    }

    fn layer(&self, about: (&'static str, &'static str, &'static str), kind: Kind) -> Layer {
        Layer::new(about, Some(kind), self.site.planet())
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

/// A platform's views, with the places of its body.
struct Way<'a> {
    platform: Option<&'a str>,
    id: &'a str,
    views: Vec<&'a View>,
    stops: Vec<Point<Enu>>,
}
