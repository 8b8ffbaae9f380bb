//! The stage that reads: all inputs, checked against each other, or all their faults.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::Observer;
use super::config::Config;
use super::paths::Source;
use crate::camera::{Camera, read_cameras};
use crate::detection::{Detection, DetectionFile, Mark, read_detections};
use crate::error::{Error, Fault, Place};
use crate::frame::{Geodetic, Site};
use crate::input::{Reason, Reject};
use crate::pose::{PoseFile, read_poses};
use crate::publish::Picture;
use crate::terrain::Terrain;
use crate::view::{self, ImageFile, Sources, View, read_images};

/// Everything a run starts from.
pub struct Inputs {
    /// The site.
    pub site: Site,
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

/// A file that was read.
#[derive(Debug, Clone, Serialize)]
pub struct InputFile {
    /// What it was read as: `poses`, `images`, `cameras`, `detections`, `terrain`.
    pub kind: &'static str,
    /// As the run names it.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
    /// Its records, where it is a table.
    pub rows: Option<usize>,
}

/// The pictures of a run, taken together.
#[derive(Debug, Clone, Default, Serialize)]
pub struct PictureDigest {
    /// How many are at hand.
    pub count: usize,
    /// Their size together.
    pub bytes: u64,
    /// SHA-256 over the SHA-256 of each, in the order of the views.
    pub sha256: String,
}

/// A file with the path it was read from and the name it goes by.
type Read<T> = (PathBuf, String, T);

/// Reads and checks all inputs of a run.
///
/// # Errors
/// All faults that keep the run from starting, at once. Bad records are set aside in the result.
pub fn read(config: &Config, observer: &dyn Observer) -> Result<Inputs, Error> {
    observer.begin("read", None);
    let mut faults = Faults::default();
    let crs = config.site.crs.as_ref();
    let input = &config.input;
    let poses = faults.read_all(&input.poses, |s, _| read_poses(&s.path, &s.shown, crs));
    let is_log = poses.iter().any(|(_, _, p)| !p.is_per_image);
    let images = faults.read_all(&input.images, |s, _| read_images(&s.path, &s.shown, is_log));
    let cameras = faults.read_all(&input.cameras, |s, _| read_cameras(&s.path, &s.shown));
    let detections = faults.read_all(&input.detections, |s, i| {
        read_detections(&s.path, &s.shown, i)
    });
    let site = site(config, &poses, &mut faults);
    let terrain = terrain(config, site, &mut faults);
    cross_checks(config, &poses, &detections, &mut faults);
    let cameras = all_cameras(cameras, &mut faults);
    faults.none()?;

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
    let mut assembly = view::assemble(&Sources {
        poses: &poses,
        images: &images,
        cameras: (!input.cameras.is_empty()).then_some(&cameras),
        site: &site,
        pose_sigma: config.noise.pose,
        max_gap_s: config.view.max_gap_s,
    });
    let mut inputs = Inputs {
        site,
        terrain,
        views: std::mem::take(&mut assembly.views),
        detections: Vec::new(),
        detection_files: input.detections.iter().map(|s| s.shown.clone()).collect(),
        rejects: Vec::new(),
        warnings: Vec::new(),
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

/// Faults of all inputs, so that they are told together.
#[derive(Default)]
struct Faults {
    faults: Vec<Fault>,
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

    fn add(&mut self, error: Error) {
        match error {
            Error::Faults(faults) => self.faults.extend(faults),
            other => self
                .faults
                .push(Fault::new(Place::default(), "", other.to_string())),
        }
    }

    fn none(self) -> Result<(), Error> {
        if self.faults.is_empty() {
            Ok(())
        } else {
            Err(Error::Faults(self.faults))
        }
    }
}

/// The site of a run: its named origin, or the first pose.
fn site(config: &Config, poses: &[Read<PoseFile>], faults: &mut Faults) -> Site {
    let first = || {
        let rows = poses.iter().flat_map(|(_, _, file)| &file.rows);
        rows.into_iter().find_map(crate::pose::PoseRow::geodetic)
    };
    if config.site.origin.is_none()
        && let Some((_, shown, _)) = poses.iter().find(|(_, _, file)| file.is_local)
    {
        faults.faults.push(Fault::found(
            Place::file(shown),
            "x_m",
            "offsets from an origin",
            "the run to name it: [site] origin = { lat_deg = ..., lon_deg = ..., height_m = ... }",
        ));
    }
    let origin = config.site.origin.or_else(first);
    let nowhere = Geodetic::from_degrees(0.0, 0.0, 0.0);
    Site::new(config.site.planet, origin.unwrap_or(nowhere))
}

fn terrain(config: &Config, site: Site, faults: &mut Faults) -> Option<Terrain> {
    let spec = &config.terrain;
    if spec.path.is_empty() {
        return Some(Terrain::constant_height(site, spec.plane_m?));
    }
    let files: Vec<(PathBuf, String)> = spec
        .path
        .iter()
        .map(|s| (s.path.clone(), s.shown.clone()))
        .collect();
    match Terrain::open(site, &files, spec.plane_m) {
        Ok(terrain) => Some(terrain),
        Err(error) => {
            faults.add(error);
            None
        }
    }
}

/// What one file needs of another.
fn cross_checks(
    config: &Config,
    poses: &[Read<PoseFile>],
    detections: &[Read<DetectionFile>],
    faults: &mut Faults,
) {
    let mut found = |file: &str, field: &str, found: &str, expected: &str| {
        let place = Place::file(file);
        faults
            .faults
            .push(Fault::found(place, field, found, expected));
    };
    let is_log = |file: &PoseFile| !file.is_per_image;
    if let Some((_, shown, _)) = poses.iter().find(|(_, _, file)| is_log(file)) {
        if config.input.images.is_empty() {
            found(
                shown,
                "time",
                "poses keyed by time",
                "[input] images to say when pictures were taken",
            );
        }
        if let Some((_, other, _)) = poses.iter().find(|(_, _, file)| !is_log(file)) {
            found(
                other,
                "image_id",
                "poses keyed by image",
                "one key in all pose files",
            );
        }
    }
    let level = poses.iter().find(|(_, _, file)| !file.has_attitude);
    let needs_heading = detections.iter().find(|(_, _, file)| !file.has_azimuth);
    if let (Some((_, shown, _)), Some((_, other, _))) = (level, needs_heading) {
        let expected = format!("an attitude, since {other} gives no azimuth_deg");
        found(shown, "qw", "no attitude", &expected);
    }
    let spec = &config.terrain;
    let in_pixels = |(_, _, file): &&Read<DetectionFile>| {
        let needs =
            |d: &Detection| d.range_m.is_none() && matches!(d.mark, Mark::Box(_) | Mark::Point(_));
        file.detections.iter().any(needs)
    };
    if let Some((_, shown, _)) = detections.iter().find(in_pixels) {
        if spec.path.is_empty() && spec.plane_m.is_none() {
            found(
                shown,
                "",
                "detections in pixels",
                "a ground for them: [terrain] plane_m or path",
            );
        }
        if config.input.cameras.is_empty() {
            found(shown, "", "detections in pixels", "[input] cameras");
        }
    }
}

fn all_cameras(
    files: Vec<Read<crate::camera::Cameras>>,
    faults: &mut Faults,
) -> BTreeMap<String, Arc<Camera>> {
    let mut all = BTreeMap::new();
    for (_, shown, cameras) in files {
        for (name, camera) in cameras {
            if all.insert(name.clone(), Arc::new(camera)).is_some() {
                let field = format!("cameras.{name}");
                let fault = Fault::found(Place::file(&shown), field, "the camera twice", "it once");
                faults.faults.push(fault);
            }
        }
    }
    all
}

fn digest(kind: &'static str, source: &Source, rows: Option<usize>) -> Result<InputFile, Error> {
    let content = std::fs::read(&source.path).map_err(|e| Error::io(&source.path, "read", e))?;
    Ok(InputFile {
        kind,
        file: source.shown.clone(),
        bytes: content.len() as u64,
        sha256: hexadecimal(&Sha256::digest(&content)),
        rows,
    })
}

/// Bytes as lower-case hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
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

    /// Looks at the header of every picture. One that is missing or no picture costs a warning and
    /// the view stays; one whose size is not its camera's belongs to another camera, and the view
    /// goes.
    fn check_pictures(&mut self, hash: bool, rejected_images: &mut HashMap<String, Reason>) {
        let looked: Vec<_> = self
            .views
            .par_iter()
            .map(|view| {
                let picture = view.picture.as_ref()?;
                let size = Picture::size_of(&picture.path, &picture.name);
                let content = match (&size, hash) {
                    (Ok(_), true) => std::fs::read(&picture.path).ok(),
                    _ => None,
                };
                let digest = content.map(|c| (c.len() as u64, Sha256::digest(&c)));
                Some((size.map_err(|e| e.to_string()), digest))
            })
            .collect();
        let mut all = Sha256::new();
        let mut kept = Vec::with_capacity(self.views.len());
        for (mut view, looked) in std::mem::take(&mut self.views).into_iter().zip(looked) {
            match looked {
                None => {}
                Some((Err(error), _)) => {
                    self.warnings
                        .push(format!("image {}: {error}", view.image_id));
                    view.picture = None;
                }
                Some((Ok((width, height)), digest)) => {
                    if let Some(camera) = &view.camera
                        && (camera.width, camera.height) != (width, height)
                    {
                        let detail = format!(
                            "found a picture of {width}x{height}, expected {}x{} as camera {} has",
                            camera.width, camera.height, camera.name
                        );
                        self.rejects
                            .push(self.image_reject(&view, Reason::PictureSize, detail));
                        rejected_images.insert(view.image_id.clone(), Reason::PictureSize);
                        continue;
                    }
                    if let Some((bytes, digest)) = digest {
                        self.pictures.count += 1;
                        self.pictures.bytes += bytes;
                        all.update(digest);
                    }
                }
            }
            kept.push(view);
        }
        self.views = kept;
        self.pictures.sha256 = hexadecimal(&all.finalize());
    }

    fn image_reject(&self, view: &View, reason: Reason, detail: String) -> Reject {
        Reject {
            file: view.listed.0.clone(),
            line: Some(view.listed.1),
            record: view.image_id.clone(),
            reason,
            detail,
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

    /// What the views need that only shows once they stand.
    fn check_views(&self, config: &Config) -> Result<(), Error> {
        self.check_terrain(config)?;
        let headless = |v: &&View| v.camera.is_none() && !v.pose.has_heading;
        if config.view.fov_deg < 360.0
            && let Some(view) = self.views.iter().find(headless)
        {
            let found = format!(
                "{}, and image {} without a heading",
                config.view.fov_deg, view.image_id
            );
            let fault = Fault::found(
                Place::default(),
                "view.fov_deg",
                found,
                "360 where the poses carry no attitude",
            );
            return Err(fault.into());
        }
        Ok(())
    }
}

impl Inputs {
    /// A terrain model that no view can see belongs to another site.
    fn check_terrain(&self, config: &Config) -> Result<(), Error> {
        let Some(terrain) = &self.terrain else {
            return Ok(());
        };
        let away = |view: &View| terrain.distance_to(view.origin());
        let Some(nearest_m) = self.views.iter().map(away).min_by(f64::total_cmp) else {
            return Ok(());
        };
        if nearest_m <= config.reach().limit_m() {
            return Ok(());
        }
        let shown: Vec<&str> = config
            .terrain
            .path
            .iter()
            .map(|s| s.shown.as_str())
            .collect();
        let place = Place::file(shown.join(", "));
        let found = format!("a model {:.1} km from the nearest view", nearest_m / 1e3);
        Err(Fault::found(place, "", found, "one that covers the site").into())
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
