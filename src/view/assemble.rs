//! Poses, image list and cameras put together into views.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{ImageFile, ImageRow, Picture, View};
use crate::camera::{Camera, PanTilt};
use crate::frame::{Point, Site};
use crate::input::{Reason, Reject};
use crate::pose::{Pose, PoseFile, PoseKey, PoseRow, PoseSigma, Time, Track};

/// What views are made from.
pub struct Sources<'a> {
    /// The pose files, each with the path it was read from and the name it goes by.
    pub poses: &'a [(PathBuf, String, PoseFile)],
    /// The image lists, likewise; may be empty where the poses are keyed by image.
    pub images: &'a [(PathBuf, String, ImageFile)],
    /// The cameras; `None` where the run has none, and views look around without.
    pub cameras: Option<&'a BTreeMap<String, Arc<Camera>>>,
    /// The site.
    pub site: &'a Site,
    /// Standard deviations for poses that give none of their own.
    pub pose_sigma: PoseSigma,
    /// Longest gap of a pose log to interpolate over, seconds.
    pub max_gap_s: f64,
    /// What the clock of the pose log shows more than that of the images, seconds.
    pub clock_offset_s: f64,
}

/// The views, in the order of acquisition, and what was set aside on the way.
#[derive(Debug, Default)]
pub struct Assembly {
    /// The views: by time where all have one, else in the order of the files.
    pub views: Vec<View>,
    /// Rows of pose files and image lists that made no view.
    pub rejects: Vec<Reject>,
    /// The images among them, with the reason each was set aside for.
    pub rejected_images: HashMap<String, Reason>,
}

/// Puts views together.
pub fn assemble(sources: &Sources<'_>) -> Assembly {
    let mut assembly = Assembly::default();
    let located = locate(sources, &mut assembly);
    let is_log = sources.poses.iter().any(|(_, _, file)| !file.is_per_image);
    let rows = if is_log {
        from_log(sources, &located, &mut assembly)
    } else {
        per_image(sources, &located, &mut assembly)
    };
    let mut seen = HashSet::new();
    for row in rows {
        let view = view(sources, &row);
        match view {
            Ok(_) if !seen.insert(row.image.image_id.clone()) => {
                let detail = "found this image_id a second time, expected it once";
                row.reject(Reason::Duplicate, detail.to_owned(), &mut assembly);
            }
            Ok(view) => assembly.views.push(view),
            Err((reason, detail)) => row.reject(reason, detail, &mut assembly),
        }
    }
    if assembly.views.iter().all(|v| v.time.is_some()) {
        assembly.views.sort_by_key(|v| v.time);
    }
    for image in &seen {
        assembly.rejected_images.remove(image);
    }
    assembly
}

/// A pose row with its pose in the site.
struct Located<'a> {
    file: &'a Path,
    shown: &'a str,
    row: &'a PoseRow,
    pose: Pose,
}

/// An image with its pose, on its way to a view.
struct Posed<'a> {
    /// The list it stands in, beside which its picture lies.
    file: &'a Path,
    shown: &'a str,
    image: ImageRow,
    pose: Pose,
}

impl Posed<'_> {
    fn reject(&self, reason: Reason, detail: String, assembly: &mut Assembly) {
        set_aside(self.shown, &self.image, reason, detail, assembly);
    }
}

fn set_aside(
    shown: &str,
    image: &ImageRow,
    reason: Reason,
    detail: String,
    assembly: &mut Assembly,
) {
    assembly
        .rejected_images
        .entry(image.image_id.clone())
        .or_insert(reason);
    assembly.rejects.push(Reject {
        file: shown.to_owned(),
        line: Some(image.line),
        record: image.image_id.clone(),
        reason,
        detail,
    });
}

/// All pose rows that lie on the site.
fn locate<'a>(sources: &Sources<'a>, assembly: &mut Assembly) -> Vec<Located<'a>> {
    let mut located = Vec::new();
    for (path, shown, file) in sources.poses {
        for row in &file.rows {
            let pose = row.resolve(sources.site, sources.pose_sigma);
            let away_m = pose.enu_from_body.origin().distance(Point::origin());
            if away_m > Site::REACH_M {
                if let PoseKey::Image { image_id, .. } = &row.key {
                    let reasons = &mut assembly.rejected_images;
                    reasons.entry(image_id.clone()).or_insert(Reason::OffSite);
                }
                assembly.rejects.push(Reject {
                    file: shown.clone(),
                    line: Some(row.line),
                    record: row.key.record(),
                    reason: Reason::OffSite,
                    detail: format!(
                        "found a pose {:.1} km from the site's origin, expected at most {:.0} km",
                        away_m / 1e3,
                        Site::REACH_M / 1e3
                    ),
                });
                continue;
            }
            located.push(Located {
                file: path,
                shown,
                row,
                pose,
            });
        }
    }
    located
}

/// Images of the lists, each with its pose interpolated from the log of its platform.
fn from_log<'a>(
    sources: &Sources<'a>,
    located: &[Located<'a>],
    assembly: &mut Assembly,
) -> Vec<Posed<'a>> {
    let tracks = tracks(located, &mut assembly.rejects);
    let mut posed = Vec::new();
    for (path, shown, file) in sources.images {
        for image in &file.rows {
            let found = pose_of(image, &tracks, sources);
            match found {
                Ok(pose) => posed.push(Posed {
                    file: path,
                    shown,
                    image: image.clone(),
                    pose,
                }),
                Err((reason, detail)) => set_aside(shown, image, reason, detail, assembly),
            }
        }
    }
    posed
}

fn pose_of(
    image: &ImageRow,
    tracks: &BTreeMap<Option<String>, Track>,
    sources: &Sources<'_>,
) -> Result<Pose, (Reason, String)> {
    let no_pose = |detail: String| (Reason::NoPose, detail);
    let time = image
        .time
        .ok_or_else(|| no_pose("found no time, expected one".into()))?;
    let track = tracks.get(&image.platform).ok_or_else(|| {
        no_pose(match &image.platform {
            Some(name) => format!("found no pose log of platform {name}, expected one"),
            None => "found no pose log without a platform, expected one".into(),
        })
    })?;
    let in_log = time.later_by(sources.clock_offset_s);
    track.at(in_log, sources.max_gap_s).map_err(|why| {
        let reason = match why {
            crate::pose::NoPose::OutsideLog { .. } => Reason::NoPose,
            crate::pose::NoPose::Gap { .. } => Reason::PoseGap,
        };
        (reason, why.to_string())
    })
}

/// One track a platform; second samples at one time are set aside.
fn tracks(located: &[Located<'_>], rejects: &mut Vec<Reject>) -> BTreeMap<Option<String>, Track> {
    let mut samples: BTreeMap<Option<String>, Vec<(Time, Pose)>> = BTreeMap::new();
    let mut seen: HashSet<(Option<&str>, Time)> = HashSet::new();
    for Located {
        shown, row, pose, ..
    } in located
    {
        let PoseKey::Time(time) = row.key else {
            continue;
        };
        if !seen.insert((row.platform.as_deref(), time)) {
            rejects.push(Reject {
                file: (*shown).to_owned(),
                line: Some(row.line),
                record: time.to_string(),
                reason: Reason::Duplicate,
                detail: "found this time a second time, expected it once".to_owned(),
            });
            continue;
        }
        samples
            .entry(row.platform.clone())
            .or_default()
            .push((time, *pose));
    }
    let tracks = samples.into_iter();
    tracks
        .filter_map(|(platform, samples)| Some((platform, Track::new(samples)?)))
        .collect()
}

/// Poses keyed by image; where there is an image list too, it says which images there are.
fn per_image<'a>(
    sources: &Sources<'a>,
    located: &[Located<'a>],
    assembly: &mut Assembly,
) -> Vec<Posed<'a>> {
    if sources.images.is_empty() {
        let rows = located.iter().filter_map(|l| {
            Some(Posed {
                file: l.file,
                shown: l.shown,
                image: image_of(l.row)?,
                pose: l.pose,
            })
        });
        return rows.collect();
    }
    let mut poses: HashMap<String, &Located<'a>> = HashMap::new();
    for l in located {
        let image = l.row.key.record();
        if poses.contains_key(&image) {
            assembly.rejects.push(Reject {
                file: l.shown.to_owned(),
                line: Some(l.row.line),
                record: image,
                reason: Reason::Duplicate,
                detail: "found this image_id a second time, expected it once".to_owned(),
            });
            continue;
        }
        poses.insert(image, l);
    }
    let mut posed = Vec::new();
    for (path, shown, file) in sources.images {
        for image in &file.rows {
            let Some(l) = poses.get(&image.image_id) else {
                let detail = "found no pose of this image, expected one".to_owned();
                set_aside(shown, image, Reason::NoPose, detail, assembly);
                continue;
            };
            let mut image = image.clone();
            image.time = image.time.or(image_of(l.row).and_then(|i| i.time));
            posed.push(Posed {
                file: path,
                shown,
                image,
                pose: l.pose,
            });
        }
    }
    posed
}

fn image_of(row: &PoseRow) -> Option<ImageRow> {
    match &row.key {
        PoseKey::Time(_) => None,
        PoseKey::Image {
            image_id,
            time,
            camera,
            path,
            pan_tilt,
        } => Some(ImageRow {
            line: row.line,
            image_id: image_id.clone(),
            time: *time,
            camera: camera.clone(),
            path: path.clone(),
            platform: row.platform.clone(),
            pan_tilt: *pan_tilt,
        }),
    }
}

fn view(sources: &Sources<'_>, posed: &Posed<'_>) -> Result<View, (Reason, String)> {
    let image = &posed.image;
    let camera = sources
        .cameras
        .map(|cameras| camera_of(cameras, image.camera.as_deref()))
        .transpose()?;
    let picture = image.path.as_ref().map(|name| Picture {
        name: name.clone(),
        path: posed.file.parent().unwrap_or(Path::new("")).join(name),
        sha256: None,
    });
    let place = sources.site.geodetic(posed.pose.enu_from_body.origin());
    let [pan, tilt] = image.pan_tilt;
    Ok(View {
        image_id: image.image_id.clone(),
        listed: (posed.shown.to_owned(), image.line),
        time: image.time,
        platform: image.platform.clone(),
        picture,
        camera,
        head: PanTilt { pan, tilt },
        pose: posed.pose,
        enu_from_local: sources.site.enu_from_local(place),
    })
}

/// The camera of a name; a run with one camera need not name it.
fn camera_of(
    cameras: &BTreeMap<String, Arc<Camera>>,
    name: Option<&str>,
) -> Result<Arc<Camera>, (Reason, String)> {
    let found = match name {
        Some(name) => cameras.get(name),
        None if cameras.len() == 1 => cameras.values().next(),
        None => None,
    };
    found.cloned().ok_or_else(|| {
        let known: Vec<&str> = cameras.keys().map(String::as_str).collect();
        let found = name.map_or("no camera".to_owned(), |n| format!("camera {n:?}"));
        let detail = format!(
            "camera: found {found}, expected one of {}",
            known.join(", ")
        );
        (Reason::UnknownCamera, detail)
    })
}
