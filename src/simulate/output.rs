//! Writes a simulation as a data set in the native formats, with a pipeline file that runs it.
//!
//! | file | what |
//! |---|---|
//! | `poses.csv` | the measured poses |
//! | `images.csv` | where the poses are keyed by time |
//! | `cameras.toml`, `detections.csv` | |
//! | `terrain.tif` | the model of the ground, where it is more than a height |
//! | `truth.csv` | all rocks: with how often each was detected and in how many images it lay |
//! | `labels.csv` | which detection is which rock; a false alarm is [`NO_OBJECT`] |
//! | `poses_true.csv` | the true poses |
//! | `images/` | rendered pictures |
//! | `pipeline.toml` | a run with the scene's own noise |

use std::fs;
use std::path::{Path, PathBuf};

use crate::camera::write_cameras;
use crate::detection::{DetectionRecord, MeasurementRecord, write_detections};
use crate::error::Error;
use crate::frame::{Body, Enu, RigidTransform};
use crate::input::write_rows;
use crate::pose::{ImageRecord, PoseRecord, write_images, write_poses};

use super::pipeline_file::pipeline_toml;
use super::scene::{PoseKey, TerrainModel};
use super::{Simulation, View};

/// What `labels.csv` calls the object of a false alarm.
pub const NO_OBJECT: &str = "";

/// Writes the data set into `dir`, which is made where it is missing. Files appear whole: they are
/// written under a folder `.partial` and moved into place when all are there. Files of other names
/// in `dir` stay.
///
/// # Errors
/// A file that cannot be written.
pub fn write(simulation: &Simulation, dir: &Path) -> Result<(), Error> {
    let partial = dir.join(".partial");
    if partial.exists() {
        fs::remove_dir_all(&partial).map_err(|e| Error::io(&partial, "remove", e))?;
    }
    fs::create_dir_all(&partial).map_err(|e| Error::io(&partial, "create", e))?;
    write_files(simulation, &partial)?;
    for name in names_in(&partial)? {
        let (from, to) = (partial.join(&name), dir.join(&name));
        if from.is_dir() {
            fs::create_dir_all(&to).map_err(|e| Error::io(&to, "create", e))?;
            for inner in names_in(&from)? {
                let to = to.join(&inner);
                fs::rename(from.join(&inner), &to).map_err(|e| Error::io(&to, "create", e))?;
            }
        } else {
            fs::rename(&from, &to).map_err(|e| Error::io(&to, "create", e))?;
        }
    }
    fs::remove_dir_all(&partial).map_err(|e| Error::io(&partial, "remove", e))
}

fn names_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |e| Error::io(folder, "read", e);
    let entries = fs::read_dir(folder).map_err(failed)?;
    entries
        .map(|entry| entry.map(|e| PathBuf::from(e.file_name())).map_err(failed))
        .collect()
}

fn write_files(simulation: &Simulation, dir: &Path) -> Result<(), Error> {
    let scene = &simulation.scene;
    let measured = poses(simulation, scene.poses.key, |view| &view.measured);
    write_poses(&dir.join("poses.csv"), &measured)?;
    let truth: Vec<PoseRecord> = poses(simulation, PoseKey::Image, |view| &view.enu_from_body)
        .into_iter()
        .map(|record| PoseRecord {
            sigma: None,
            ..record
        })
        .collect();
    write_poses(&dir.join("poses_true.csv"), &truth)?;
    if scene.poses.key == PoseKey::Time {
        write_images(&dir.join("images.csv"), &images(simulation))?;
    }
    let cameras = scene.cameras.iter().cloned();
    let cameras = cameras.map(|c| (c.name.clone(), c)).collect();
    write_cameras(&dir.join("cameras.toml"), &cameras)?;
    write_detections(&dir.join("detections.csv"), &detections(simulation))?;
    write_rows(&dir.join("labels.csv"), &labels(simulation))?;
    write_rows(&dir.join("truth.csv"), &truth_columns(simulation))?;
    if let TerrainModel::Raster { post_m, .. } = scene.ground.model {
        super::terrain_file::write_terrain(simulation, post_m, &dir.join("terrain.tif"))?;
    }
    if let Some(plan) = &scene.render {
        let folder = dir.join("images");
        fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, "create", e))?;
        for index in 0..simulation.views.len() {
            let picture = super::render::render(simulation, plan, index);
            super::render::write_picture(&picture, &dir.join(picture_path(simulation, index)))?;
        }
    }
    let path = dir.join("pipeline.toml");
    fs::write(&path, pipeline_toml(simulation)).map_err(|e| Error::io(&path, "write", e))
}

/// A picture's path within the data set, empty where none is rendered.
pub(super) fn picture_path(simulation: &Simulation, view: usize) -> String {
    let Some(plan) = &simulation.scene.render else {
        return String::new();
    };
    let id = &simulation.views[view].image_id;
    format!("images/{id}.{}", plan.format.extension())
}

/// The platform's name, where there are several.
fn platform_name(simulation: &Simulation, view: &View) -> Option<String> {
    let platforms = &simulation.scene.platforms;
    (platforms.len() > 1).then(|| platforms[view.platform].name.clone())
}

fn poses(
    simulation: &Simulation,
    key: PoseKey,
    pose: impl Fn(&View) -> &RigidTransform<Enu, Body>,
) -> Vec<PoseRecord> {
    let scene = &simulation.scene;
    let site = &scene.site;
    let mut records: Vec<PoseRecord> = Vec::new();
    let mut previous: Option<(usize, f64)> = None;
    for (index, view) in simulation.views.iter().enumerate() {
        let moment = (view.platform, view.time_s);
        // A log keyed by time says once where the platform stood when several cameras looked.
        if key == PoseKey::Time && previous.replace(moment) == Some(moment) {
            continue;
        }
        let pose = pose(view);
        let place = site.geodetic(pose.origin());
        let by_image = key == PoseKey::Image;
        let path = picture_path(simulation, index);
        records.push(PoseRecord {
            image_id: by_image.then(|| view.image_id.clone()),
            camera: by_image.then(|| scene.cameras[view.camera].name.clone()),
            path: (by_image && !path.is_empty()).then_some(path),
            platform: platform_name(simulation, view),
            time_s: Some(view.time_s),
            place,
            attitude: site.enu_from_local(place).inverse() * pose.rotation,
            sigma: scene
                .poses
                .write_sigmas
                .then(|| scene.poses.sigma.scaled(scene.poses.scale)),
        });
    }
    records
}

fn images(simulation: &Simulation) -> Vec<ImageRecord> {
    let scene = &simulation.scene;
    let has_head = |view: &View| {
        scene.platforms[view.platform]
            .pans
            .iter()
            .any(|&p| p != 0.0)
    };
    let one = |(index, view): (usize, &View)| ImageRecord {
        image_id: view.image_id.clone(),
        time_s: view.time_s,
        camera: scene.cameras[view.camera].name.clone(),
        path: picture_path(simulation, index),
        platform: platform_name(simulation, view),
        pan: has_head(view).then_some(view.head.pan),
        tilt: has_head(view).then_some(view.head.tilt),
    };
    simulation.views.iter().enumerate().map(one).collect()
}

fn detections(simulation: &Simulation) -> Vec<DetectionRecord> {
    let class = &simulation.scene.rocks.class;
    let numbered = simulation.detections.iter().enumerate();
    let one = |(det_id, detection): (usize, &super::SimulatedDetection)| {
        let [x_min, y_min, x_max, y_max] = detection.edges_px;
        DetectionRecord {
            image_id: simulation.views[detection.view].image_id.clone(),
            det_id: det_id.to_string(),
            class: Some(class.clone()),
            score: Some(detection.score),
            diameter_m: None,
            measurement: MeasurementRecord::Box {
                x_min,
                y_min,
                x_max,
                y_max,
            },
            range_m: None,
        }
    };
    numbered.map(one).collect()
}

fn labels(simulation: &Simulation) -> [(&'static str, Vec<String>); 3] {
    let detections = &simulation.detections;
    let ids = (0..detections.len()).map(|i| i.to_string()).collect();
    let objects = detections.iter().map(|d| match d.rock {
        Some(rock) => simulation.rocks[rock].object_id.clone(),
        None => NO_OBJECT.to_owned(),
    });
    let images = detections
        .iter()
        .map(|d| simulation.views[d.view].image_id.clone());
    [
        ("det_id", ids),
        ("object_id", objects.collect()),
        ("image_id", images.collect()),
    ]
}

fn truth_columns(simulation: &Simulation) -> Vec<(&'static str, Vec<String>)> {
    let rocks = &simulation.rocks;
    let site = &simulation.scene.site;
    let places: Vec<_> = rocks.iter().map(|r| site.geodetic(r.place)).collect();
    let degrees = |x: f64| format!("{x:.10}");
    let counts = |n: Vec<usize>| n.iter().map(usize::to_string).collect();
    let class = &simulation.scene.rocks.class;
    vec![
        (
            "object_id",
            rocks.iter().map(|r| r.object_id.clone()).collect(),
        ),
        ("class", vec![class.clone(); rocks.len()]),
        (
            "lat_deg",
            places.iter().map(|p| degrees(p.lat_deg())).collect(),
        ),
        (
            "lon_deg",
            places.iter().map(|p| degrees(p.lon_deg())).collect(),
        ),
        (
            "alt_m",
            places
                .iter()
                .map(|p| format!("{:.5}", p.height_m))
                .collect(),
        ),
        (
            "diameter_m",
            rocks
                .iter()
                .map(|r| format!("{:.4}", r.diameter_m))
                .collect(),
        ),
        ("n_detections", counts(simulation.n_detections())),
        ("n_visible", counts(simulation.n_visible.clone())),
    ]
}
