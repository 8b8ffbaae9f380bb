//! The paper's field test on a simulated scene: two pictures of a rocky patch, taken 2 m apart
//! (Thompson and Wettergreen 2005, section III.B, Figures 8 to 12).

use std::path::Path;

use serde::Serialize;

use super::field_map;
use crate::error::Error;
use crate::evaluate::{self, Comparison, EstimateOutcome, Truth, TruthOutcome};
use crate::frame::{Enu, Point};
use crate::pipeline::{self, Clock, Config, Ground, Inputs, Mapped, Method, Overrides, Silent};
use crate::publish::{Annotation, Picture, Rock, Scene, annotate};
use crate::simulate::{self, Simulation};

/// The scene, as it stands in `fixtures/scenes/two-views.toml`.
const SCENE: &str = include_str!("../../fixtures/scenes/two-views.toml");

/// The methods that fuse the views. Figure 12 is the first one's, counts and further pictures are
/// of all: a method that joins this list joins them.
const METHODS: [Method; 2] = [Method::Paper, Method::Belief];

/// The width of the paper's Gaussians, metres; it names none. Two well-registered views disagree by
/// much less, and rocks lie closer together than a larger one could tell apart.
const WIDTH_M: f64 = 0.1;

/// A mapped rock is correct within this distance of a true one, metres.
const RADIUS_M: f64 = 0.3;

/// How many rocks are found within the common field of view, by one view and by both.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FieldCounts {
    /// True rocks on the ground that both views see.
    pub n_rocks: usize,
    /// Rocks found by the first view alone.
    pub single: Found,
    /// Rocks found by the two views fused, by method; the first is the paper's.
    pub fused: Vec<FoundBy>,
}

/// What a method's map of both views says of the common field of view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FoundBy {
    /// The method's name.
    pub method: &'static str,
    /// What its map says.
    pub found: Found,
}

/// What a map says of the common field of view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Found {
    /// True rocks with a mapped rock of their own within 0.3 m.
    pub correct: usize,
    /// Mapped rocks that are no true rock's.
    pub wrong: usize,
}

/// The field test, played.
pub struct Field {
    simulation: Simulation,
    config: Config,
    inputs: Inputs,
    ground: Ground,
    /// The maps of both views, by method.
    fused: Vec<(Method, Mapped)>,
}

impl Field {
    /// Plays the scene, writes it as a data set with its pictures into `folder`, and runs the
    /// paper's method on it: its `min_weight` is 0.5, so that rocks seen once count, as in the
    /// paper's figures.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn play(folder: &Path) -> Result<Self, Error> {
        Self::play_scene(&simulate::Scene::parse(SCENE, "two-views.toml")?, folder)
    }

    /// As [`Field::play`], of another scene of two rendered views.
    ///
    /// # Errors
    /// As [`Field::play`], and a scene that renders no pictures.
    pub fn play_scene(scene: &simulate::Scene, folder: &Path) -> Result<Self, Error> {
        let simulation = simulate::simulate(scene);
        simulate::write(&simulation, folder)?;
        let config_of = |method: Method| {
            let overrides = Overrides {
                set: settings(method),
                ..Overrides::default()
            };
            Config::read(&folder.join("pipeline.toml"), &overrides)
        };
        let config = config_of(METHODS[0])?;
        let inputs = pipeline::read(&config, &Silent)?;
        let ground = pipeline::place(&config, &inputs, &Silent);
        let fuse = |method: Method| {
            let mut clock = Clock::start();
            let mapped = pipeline::map(&config_of(method)?, &inputs, &mut clock, &Silent)?;
            Ok((method, mapped))
        };
        let fused = METHODS.into_iter().map(fuse);
        let fused = fused.collect::<Result<_, Error>>()?;
        Ok(Self {
            simulation,
            config,
            inputs,
            ground,
            fused,
        })
    }

    /// Figure 8: both views' detections on the map.
    pub fn map(&self) -> String {
        let rocks = self.simulation.rocks.iter();
        let rocks: Vec<_> = rocks.map(|r| (r.place, r.diameter_m)).collect();
        field_map::draw(&rocks, &self.inputs.views, &self.ground)
    }

    /// The detections on the ground, as a table: view, from 1; its detection; place, metres.
    pub fn detections(&self) -> String {
        let mut table = "view,det_id,east_m,north_m\n".to_owned();
        for placed in &self.ground.placed {
            let (view, at) = (placed.view + 1, placed.hit.point.xyz);
            let id = &placed.detection.det_id;
            table += &format!("{view},{id},{:.4},{:.4}\n", at.x, at.y);
        }
        table
    }

    /// Figures 9 and 10: what a view's camera saw.
    ///
    /// # Errors
    /// A picture that cannot be read.
    pub fn picture(&self, view: usize) -> Result<Picture, Error> {
        let no_picture = || Error::Output(format!("view {view} of the field test has no picture"));
        let view = self.inputs.views.get(view).ok_or_else(no_picture)?;
        let source = view.picture.as_ref().ok_or_else(no_picture)?;
        Picture::read(&source.path, &source.name)
    }

    /// Figure 11: the first view's own detections, the ground that the second sees tinted.
    ///
    /// # Errors
    /// As [`Field::picture`].
    pub fn single_view_picture(&self) -> Result<Picture, Error> {
        self.annotated(&self.scene(), &[], "view 1 alone")
    }

    /// Figure 12: the rocks of both views in the first one's picture, by method, with the picture's
    /// name.
    ///
    /// # Errors
    /// As [`Field::picture`].
    pub fn fused_pictures(&self) -> Result<Vec<(String, Picture)>, Error> {
        let picture = |(index, (method, mapped)): (usize, &(Method, Mapped))| {
            let name = if index == 0 {
                "figure-12.jpg".to_owned()
            } else {
                format!("figure-12-{}.jpg", method.name())
            };
            Ok((name, self.fused_picture(mapped)?))
        };
        self.fused.iter().enumerate().map(picture).collect()
    }

    fn fused_picture(&self, mapped: &Mapped) -> Result<Picture, Error> {
        let scene = mapped.ground.scene(&self.config, &self.inputs);
        let rocks = scene.rock_map(&mapped.fusion);
        let unnamed: Vec<Rock> = rocks
            .into_iter()
            .map(|rock| Rock {
                rock_id: String::new(),
                ..rock
            })
            .collect();
        self.annotated(&scene, &unnamed, "views 1 and 2 fused")
    }

    fn annotated(&self, scene: &Scene<'_>, rocks: &[Rock], title: &str) -> Result<Picture, Error> {
        let mut picture = self.picture(0)?;
        let annotation = Annotation {
            title: title.to_owned(),
            ..scene.annotation_of(0, rocks)
        };
        annotate(&mut picture, &annotation);
        Ok(picture)
    }

    /// How many rocks each map has right within the common field of view.
    ///
    /// # Errors
    /// None that the scene could cause.
    pub fn counts(&self) -> Result<FieldCounts, Error> {
        let rocks = self.simulation.rocks.iter();
        let in_common = |east_m, north_m| {
            let all = self.ground.footprints.all();
            all.iter().all(|f| f.covers(east_m, north_m))
        };
        let n_rocks = rocks.filter(|r| in_common(r.place.xyz.x, r.place.xyz.y));
        let placed = self.ground.placed.iter().filter(|p| p.view == 0);
        let single: Vec<_> = placed.map(|p| p.hit.point).collect();
        let found_by = |(method, mapped): &(Method, Mapped)| {
            let objects = mapped.fusion.objects.iter();
            let real = objects.filter(|o| o.p_exist.is_none_or(|p| p >= 0.5));
            let map: Vec<_> = real.map(|o| o.place).collect();
            Ok(FoundBy {
                method: method.name(),
                found: self.found(&map, &in_common)?,
            })
        };
        Ok(FieldCounts {
            n_rocks: n_rocks.count(),
            single: self.found(&single, &in_common)?,
            fused: self
                .fused
                .iter()
                .map(found_by)
                .collect::<Result<_, Error>>()?,
        })
    }

    fn found(&self, map: &[Point<Enu>], counts: &dyn Fn(f64, f64) -> bool) -> Result<Found, Error> {
        let site = &self.simulation.scene.site;
        let objects: Vec<evaluate::TrueObject> = self
            .simulation
            .rocks
            .iter()
            .map(|rock| evaluate::TrueObject {
                object_id: rock.object_id.clone(),
                class: None,
                place: site.geodetic(rock.place),
                n_detections: None,
            })
            .collect();
        let estimates = map.iter().enumerate();
        let estimate = |(index, place): (usize, &Point<Enu>)| evaluate::Estimate {
            rock_id: index.to_string(),
            class: None,
            place: site.geodetic(*place),
            p_exist: None,
            ellipse: None,
        };
        let rock_map = evaluate::RockMap {
            planet: site.planet(),
            estimates: estimates.map(estimate).collect(),
        };
        let truth = Truth {
            objects,
            ignored: Vec::new(),
        };
        let options = evaluate::Options {
            radius_m: RADIUS_M,
            min_detections: 0,
            ..evaluate::Options::default()
        };
        let comparison = Comparison::new(&rock_map, &truth, &options)?;
        let truths = comparison.truths.iter().zip(&self.simulation.rocks);
        let correct = truths.filter(|(truth, rock)| {
            matches!(truth.outcome, TruthOutcome::Matched(_))
                && counts(rock.place.xyz.x, rock.place.xyz.y)
        });
        let mapped = comparison.estimates.iter().zip(map);
        let wrong = mapped.filter(|(estimate, place)| {
            estimate.outcome == EstimateOutcome::False && counts(place.xyz.x, place.xyz.y)
        });
        Ok(Found {
            correct: correct.count(),
            wrong: wrong.count(),
        })
    }

    fn scene(&self) -> Scene<'_> {
        self.ground.scene(&self.config, &self.inputs)
    }
}

/// What is laid over the scene's pipeline file for a method. A rock seen once counts.
fn settings(method: Method) -> Vec<String> {
    let mut settings = vec![format!("fusion.method={}", method.name())];
    if matches!(method, Method::Em | Method::Paper) {
        settings.push("fusion.min_weight=0.5".to_owned());
        settings.push(format!("fusion.width_m={WIDTH_M}"));
    }
    settings
}
