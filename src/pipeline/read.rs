//! The stage that reads: all inputs, checked against each other, or all their faults.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use super::Observer;
use super::checks::cross_checks;
use super::config::{Config, Heights};
use super::digest::{InputFile, digest};
use super::paths::Source;
use super::pictures::PictureDigest;
use crate::camera::{Camera, CameraFile, read_camera_file};
use crate::detection::{Detection, DetectionFile, read_detections};
use crate::error::{Error, Fault, Place};
use crate::frame::{DatumError, Geodetic, Site, VerticalDatum};
use crate::input::{Reason, Reject};
use crate::pose::{PoseFile, read_poses};
use crate::terrain::{Terrain, datum_of_grid, vertical_datum};
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

/// The grids that heights are shifted by, each once.
fn geoid_files(
    datum: Option<&VerticalDatum>,
    terrain: Option<&Terrain>,
) -> Result<Vec<InputFile>, Error> {
    let own = datum.map_or(&[][..], VerticalDatum::grids);
    let grids = own
        .iter()
        .chain(terrain.map_or(&[][..], Terrain::geoid_grids));
    let mut files = Vec::new();
    let mut seen = HashSet::new();
    for grid in grids {
        if seen.insert(&grid.path) {
            let source = Source {
                path: grid.path.clone(),
                shown: grid.name.clone(),
            };
            files.push(digest("geoid", &source, None)?);
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

/// The first pose that has a place on the planet.
fn first_place(poses: &[Read<PoseFile>]) -> Option<Geodetic> {
    let mut rows = poses.iter().flat_map(|(_, _, file)| &file.rows);
    rows.find_map(crate::pose::PoseRow::geodetic)
}

/// What heights are above, around the run's origin; `None` for the ellipsoid.
fn datum(config: &Config, poses: &[Read<PoseFile>], faults: &mut Faults) -> Option<VerticalDatum> {
    let around = config.site.origin.or_else(|| first_place(poses))?;
    let datum = match config.site.height.as_ref()? {
        Heights::Crs(code) => vertical_datum(code, config.site.planet, around),
        Heights::Grid(grid) => datum_of_grid(&grid.path, &grid.shown, config.site.planet, around),
    };
    let told = |error: &_| Fault::new(Place::default(), "site.height", format!("{error}"));
    datum
        .map_err(|error: DatumError| faults.faults.push(told(&error)))
        .ok()
}

/// The origin that the run names, with its height above the ellipsoid; on the way all poses are put
/// into true north and ellipsoidal heights.
fn origin(
    config: &Config,
    poses: &mut [Read<PoseFile>],
    datum: Option<&VerticalDatum>,
    faults: &mut Faults,
) -> Option<Geodetic> {
    let origin = match (config.site.origin, datum) {
        (Some(origin), Some(datum)) => match datum.to_ellipsoidal(origin) {
            Ok(origin) => Some(origin),
            Err(error) => {
                let fault = Fault::new(Place::default(), "site.origin", error.to_string());
                faults.faults.push(fault);
                Some(origin)
            }
        },
        (origin, _) => origin,
    };
    let heading = config.heading();
    for (_, shown, file) in poses {
        file.refer(shown, &heading, datum, origin);
    }
    origin
}

/// The site of a run: its named origin, or the first pose.
fn site(
    config: &Config,
    origin: Option<Geodetic>,
    poses: &[Read<PoseFile>],
    faults: &mut Faults,
) -> Site {
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
    let origin = origin.or_else(|| first_place(poses));
    let nowhere = Geodetic::from_degrees(0.0, 0.0, 0.0);
    Site::new(config.site.planet, origin.unwrap_or(nowhere))
}

fn terrain(
    config: &Config,
    site: Site,
    datum: Option<&VerticalDatum>,
    faults: &mut Faults,
) -> Option<Terrain> {
    let spec = &config.terrain;
    // A surface of one height above a geoid is taken for one above the ellipsoid, as at the origin.
    let plane_m = match (spec.plane_m, datum) {
        (Some(height_m), Some(datum)) => {
            let place = Geodetic {
                height_m,
                ..site.origin()
            };
            let place = datum.to_ellipsoidal(place).map_err(|error| {
                let fault = Fault::new(Place::default(), "terrain.plane_m", error.to_string());
                faults.faults.push(fault);
            });
            Some(place.ok()?.height_m)
        }
        (plane_m, _) => plane_m,
    };
    if spec.path.is_empty() {
        return Some(Terrain::constant_height(site, plane_m?));
    }
    let files: Vec<(PathBuf, String)> = spec
        .path
        .iter()
        .map(|s| (s.path.clone(), s.shown.clone()))
        .collect();
    match Terrain::open(site, &files, plane_m, datum) {
        Ok(terrain) => Some(terrain),
        Err(error) => {
            faults.add(error);
            None
        }
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
