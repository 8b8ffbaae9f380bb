//! The stage that reads: all inputs, checked against each other, or all their faults.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use super::Observer;
use super::checks::cross_checks;
use super::config::Config;
use super::digest::{InputFile, digest};
use super::paths::Source;
use super::pictures::PictureDigest;
use super::read_site::{datum, geoid_files, origin, site, terrain};
use crate::camera::{Camera, CameraFile, read_camera_file};
use crate::detection::{Detection, DetectionFile, read_detections};
use crate::error::{Error, Fault, Place};
use crate::frame::{Site, VerticalDatum};
use crate::input::{Reason, Reject};
use crate::pose::{PoseFile, read_poses};
use crate::terrain::Terrain;
use crate::view::{self, ImageFile, Sources, View, read_images};

/// Everything a run starts from.
pub struct Inputs {
    /// The site.
    pub site: Site,
    /// What heights of the inputs and of the map are above, where it is not the ellipsoid.
    pub datum: Option<VerticalDatum>,
    /// The ground; `None` where the run names none and every detection has a range.
    pub terrain: Option<Terrain>,
    /// The views, in the order of acquisition.
    pub views: Vec<View>,
    /// The detections of these views, by view, each with its view's index.
    pub detections: Vec<(usize, Detection)>,
    /// Names of the detection files, by [`Detection::file`].
    pub detection_files: Vec<String>,
    /// Records set aside.
    pub rejects: Vec<Reject>,
    /// What is odd and does no harm.
    pub warnings: Vec<String>,
    /// The files read.
    pub files: Vec<InputFile>,
    /// Sizes and hash of all pictures together, where they are part of the run.
    pub pictures: PictureDigest,
}

/// A file with the path it was read from and the name it goes by.
pub(super) type Read<T> = (PathBuf, String, T);

/// Reads and checks all inputs of a run.
///
/// # Errors
/// All faults that keep the run from starting, at once. Bad records are set aside in the result.
pub fn read(config: &Config, observer: &dyn Observer) -> Result<Inputs, Error> {
    observer.begin("read", None);
    let mut faults = Faults::default();
    let crs = config.site.crs.as_ref();
    let input = &config.input;
    let planet = config.site.planet;
    let mut poses = faults.read_all(&input.poses, |s, _| {
        read_poses(&s.path, &s.shown, planet, crs)
    });
    let is_log = poses.iter().any(|(_, _, p)| !p.is_per_image);
    let images = faults.read_all(&input.images, |s, _| read_images(&s.path, &s.shown, is_log));
    let cameras = faults.read_all(&input.cameras, |s, _| read_camera_file(&s.path, &s.shown));
    let detections = faults.read_all(&input.detections, |s, i| {
        read_detections(&s.path, &s.shown, i)
    });
    let datum = datum(config, &poses, &mut faults);
    let origin = origin(config, &mut poses, datum.as_ref(), &mut faults);
    let site = site(config, origin, &poses, &mut faults);
    let terrain = terrain(config, site, datum.as_ref(), &mut faults);
    cross_checks(config, &poses, &detections, &mut faults);
    let notes: Vec<String> = cameras.iter().flat_map(|c| c.2.notes.clone()).collect();
    let cameras = all_cameras(cameras, &mut faults);
    faults.none()?;

    let mut files = input_files(config, &poses, &images, &detections)?;
    files.extend(geoid_files(datum.as_ref(), terrain.as_ref())?);
    let mut assembly = view::assemble(&Sources {
        poses: &poses,
        images: &images,
        cameras: (!input.cameras.is_empty()).then_some(&cameras),
        site: &site,
        pose_sigma: config.noise.pose,
        max_gap_s: config.view.max_gap_s,
        clock_offset_s: input.clock_offset_s,
    });
    let mut inputs = Inputs {
        site,
        datum,
        terrain,
        views: std::mem::take(&mut assembly.views),
        detections: Vec::new(),
        detection_files: input.detections.iter().map(|s| s.shown.clone()).collect(),
        rejects: Vec::new(),
        warnings: notes,
        files,
        pictures: PictureDigest::default(),
    };
    inputs.set_aside_rows(&poses, &images, &detections, &mut assembly.rejected_images);
    inputs.rejects.append(&mut assembly.rejects);
    inputs.check_pictures(config.output.annotate, &mut assembly.rejected_images);
    inputs.place_detections(detections, &assembly.rejected_images);
    inputs.check_views(config)?;
    observer.end(&format!(
        "{} views, {} detections",
        inputs.views.len(),
        inputs.detections.len()
    ));
    Ok(inputs)
}

/// All files of a run with their digests, the tables among them with their rows.
fn input_files(
    config: &Config,
    poses: &[Read<PoseFile>],
    images: &[Read<ImageFile>],
    detections: &[Read<DetectionFile>],
) -> Result<Vec<InputFile>, Error> {
    let input = &config.input;
    let mut files = Vec::new();
    let kinds = [
        (
            "poses",
            &input.poses,
            Some(poses.iter().map(|p| p.2.n_rows()).collect::<Vec<_>>()),
        ),
        (
            "images",
            &input.images,
            Some(images.iter().map(|p| p.2.n_rows()).collect()),
        ),
        ("cameras", &input.cameras, None),
        (
            "detections",
            &input.detections,
            Some(detections.iter().map(|p| p.2.n_rows()).collect()),
        ),
        ("terrain", &config.terrain.path, None),
    ];
    for (kind, sources, rows) in kinds {
        for (i, source) in sources.iter().enumerate() {
            files.push(digest(kind, source, rows.as_ref().map(|r| r[i]))?);
        }
    }
    Ok(files)
}

/// Faults of all inputs, so that they are told together.
#[derive(Default)]
pub(super) struct Faults {
    pub(super) faults: Vec<Fault>,
}

impl Faults {
    fn read_all<T>(
        &mut self,
        sources: &[Source],
        read: impl Fn(&Source, usize) -> Result<T, Error>,
    ) -> Vec<Read<T>> {
        let mut all = Vec::new();
        for (i, source) in sources.iter().enumerate() {
            match read(source, i) {
                Ok(file) => all.push((source.path.clone(), source.shown.clone(), file)),
                Err(error) => self.add(error),
            }
        }
        all
    }

    pub(super) fn add(&mut self, error: Error) {
        match error {
            Error::Faults(faults) => self.faults.extend(faults),
            other => self
                .faults
                .push(Fault::new(Place::default(), "", other.to_string())),
        }
    }

    fn none(self) -> Result<(), Error> {
        Error::check(self.faults)
    }
}

fn all_cameras(files: Vec<Read<CameraFile>>, faults: &mut Faults) -> BTreeMap<String, Arc<Camera>> {
    let mut all = BTreeMap::new();
    for (_, shown, file) in files {
        for (name, camera) in file.cameras {
            if all.insert(name.clone(), Arc::new(camera)).is_some() {
                let field = format!("cameras.{name}");
                let fault = Fault::found(Place::file(&shown), field, "the camera twice", "it once");
                faults.faults.push(fault);
            }
        }
    }
    all
}

impl PoseFile {
    fn n_rows(&self) -> usize {
        self.rows.len() + self.rejects.len()
    }
}

impl ImageFile {
    fn n_rows(&self) -> usize {
        self.rows.len() + self.rejects.len()
    }
}

impl DetectionFile {
    fn n_rows(&self) -> usize {
        self.detections.len() + self.rejects.len()
    }
}

impl Inputs {
    /// Takes over the rows the readers could not read, and warns of columns nobody knows.
    fn set_aside_rows(
        &mut self,
        poses: &[Read<PoseFile>],
        images: &[Read<ImageFile>],
        detections: &[Read<DetectionFile>],
        rejected_images: &mut HashMap<String, Reason>,
    ) {
        let have: HashSet<&str> = self.views.iter().map(|v| v.image_id.as_str()).collect();
        let mut image_rejects: Vec<&Reject> = Vec::new();
        for (_, shown, file) in poses {
            warn_of_columns(shown, &file.unknown_columns, &mut self.warnings);
            self.rejects.extend(file.rejects.iter().cloned());
            if file.is_per_image {
                image_rejects.extend(&file.rejects);
            }
        }
        for (_, shown, file) in images {
            warn_of_columns(shown, &file.unknown_columns, &mut self.warnings);
            self.rejects.extend(file.rejects.iter().cloned());
            image_rejects.extend(&file.rejects);
        }
        for (_, shown, file) in detections {
            warn_of_columns(shown, &file.unknown_columns, &mut self.warnings);
            self.rejects.extend(file.rejects.iter().cloned());
        }
        for reject in image_rejects {
            if !have.contains(reject.record.as_str()) {
                rejected_images.insert(reject.record.clone(), reject.reason);
            }
        }
    }

    /// Gives every detection its view, sorted by view and then as the files have them.
    fn place_detections(
        &mut self,
        files: Vec<Read<DetectionFile>>,
        rejected_images: &HashMap<String, Reason>,
    ) {
        let index: HashMap<&str, usize> = self
            .views
            .iter()
            .enumerate()
            .map(|(i, v)| (v.image_id.as_str(), i))
            .collect();
        let mut seen: HashSet<(usize, String)> = HashSet::new();
        for (_, shown, file) in files {
            for detection in file.detections {
                let image = detection.image_id.as_str();
                let (reason, detail) = match (index.get(image), rejected_images.get(image)) {
                    (Some(&view), _) if seen.insert((view, detection.det_id.clone())) => {
                        self.detections.push((view, detection));
                        continue;
                    }
                    (Some(_), _) => (
                        Reason::Duplicate,
                        "det_id: found this detection a second time, expected it once".to_owned(),
                    ),
                    (None, Some(why)) => (
                        Reason::ImageRejected,
                        format!("image_id: image {image} was itself rejected, {why}"),
                    ),
                    (None, None) => (
                        Reason::UnknownImage,
                        format!("image_id: found {image:?}, expected an image of the run"),
                    ),
                };
                self.rejects.push(Reject {
                    file: shown.clone(),
                    line: Some(detection.line),
                    record: detection.key(),
                    reason,
                    detail,
                });
            }
        }
        self.detections.sort_by_key(|&(view, _)| view);
    }
}

fn warn_of_columns(shown: &str, columns: &[String], warnings: &mut Vec<String>) {
    if !columns.is_empty() {
        let columns = columns.join(", ");
        warnings.push(format!(
            "{shown}: ignored columns that mean nothing here: {columns}"
        ));
    }
}
