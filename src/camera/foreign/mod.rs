//! Cameras in the formats of others: calibrations, reconstructions, labels of rover pictures.
//!
//! [`read_camera_file`] tells the formats apart and gives cameras of this program's own models and
//! conventions; what a format counts otherwise (half pixels, quaternions with the scalar last, axes
//! that point down) is turned here and nowhere else.

mod colmap;
mod fields;
mod kalibr;
mod label;
mod mars2020;
mod opencv;
mod ros;
mod rover;
mod window;

use std::fmt;
use std::path::Path;

use super::{Camera, Cameras, cameras_from_toml};
use crate::error::{Error, Fault, Place};
use crate::input::Document;

pub use rover::{RoverImage, RoverPose, SiteLink, attitude as attitude_of_ned};

/// A format that cameras are read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFormat {
    /// cameras.toml, this program's own.
    Native,
    /// A `camera_info` YAML of ROS.
    Ros,
    /// A camchain YAML of Kalibr.
    Kalibr,
    /// A `FileStorage` of OpenCV, in YAML, XML or JSON.
    OpenCv,
    /// cameras.txt of COLMAP.
    Colmap,
    /// A label in ODL (PDS3), attached or by itself.
    OdlLabel,
    /// A label of a VICAR picture.
    VicarLabel,
    /// JSON of the Mars 2020 raw pictures.
    Mars2020,
}

impl fmt::Display for CameraFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Native => "cameras.toml",
            Self::Ros => "camera_info of ROS",
            Self::Kalibr => "camchain of Kalibr",
            Self::OpenCv => "FileStorage of OpenCV",
            Self::Colmap => "cameras.txt of COLMAP",
            Self::OdlLabel => "PDS label",
            Self::VicarLabel => "VICAR label",
            Self::Mars2020 => "Mars 2020 JSON",
        })
    }
}

/// What a camera file holds.
#[derive(Debug)]
pub struct CameraFile {
    /// Its format.
    pub format: CameraFormat,
    /// Its cameras.
    pub cameras: Cameras,
    /// The pictures it speaks of, with their poses: labels and JSON of rovers. The camera of each is
    /// among `cameras`.
    pub images: Vec<RoverImage>,
    /// What it says that is not used, and what was taken for granted.
    pub notes: Vec<String>,
}

/// The cameras of a file in any format; `shown` is the name faults call it by.
///
/// # Errors
/// A file that cannot be read, and every fault in it at once, each with its line.
pub fn read_camera_file(path: &Path, shown: &str) -> Result<CameraFile, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    cameras_from_bytes(&bytes, path, shown)
}

/// The cameras of a file's content. What the content does not tell, the name of `path` does: the
/// format where several begin alike, and the name of a camera without one.
///
/// # Errors
/// As [`read_camera_file`].
pub fn cameras_from_bytes(bytes: &[u8], path: &Path, shown: &str) -> Result<CameraFile, Error> {
    let format = recognise(bytes, path);
    let is_label = matches!(format, CameraFormat::OdlLabel | CameraFormat::VicarLabel);
    // Behind an attached label stands a picture, which is no text.
    let lossy = || String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST_LABEL)]).into_owned();
    let text = match String::from_utf8(bytes.to_vec()) {
        Ok(text) if !is_label => text,
        Err(_) if !is_label => {
            let found = "bytes that are not UTF-8";
            return Err(Fault::found(Place::file(shown), "", found, "text").into());
        }
        _ => lossy(),
    };
    let stem = stem_of(path);
    let document = match format {
        CameraFormat::Native => {
            return Ok(CameraFile {
                format,
                cameras: cameras_from_toml(&text, shown)?,
                images: Vec::new(),
                notes: Vec::new(),
            });
        }
        CameraFormat::Colmap => return colmap::read(&text, shown),
        CameraFormat::OdlLabel => Document::parse_odl(&text, shown)?,
        CameraFormat::VicarLabel => Document::parse_vicar(&text, shown)?,
        CameraFormat::Mars2020 => Document::parse_json(&text, shown)?,
        CameraFormat::OpenCv => opencv::parse(&text, shown)?,
        CameraFormat::Ros | CameraFormat::Kalibr => Document::parse_yaml(&text, shown)?,
    };
    let mut found = Found::new(shown);
    match format {
        CameraFormat::Ros => ros::read(&document.root(), &stem, &mut found),
        CameraFormat::Kalibr => kalibr::read(&document.root(), &mut found),
        CameraFormat::OpenCv => opencv::read(&document.root(), &stem, &mut found),
        CameraFormat::Mars2020 => mars2020::read(&document.root(), &mut found),
        _ => label::read(&document.root(), &stem, &mut found),
    }
    Error::check(document.into_faults())?;
    found.finish(format)
}

/// Longer than any label.
const LONGEST_LABEL: usize = 4 << 20;

/// The name of a file without folder and extension.
fn stem_of(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |s| s.to_string_lossy().into_owned())
}

/// Tells the formats apart, by content first and by the file's name where that is not enough.
fn recognise(bytes: &[u8], path: &Path) -> CameraFormat {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(1 << 16)]);
    let text = head.trim_start_matches('\u{feff}').trim_start();
    let extension = path
        .extension()
        .map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    let begins = |heads: &[&str]| heads.iter().any(|h| text.starts_with(h));
    let has_key = |key: &str| {
        text.lines().any(|line| {
            line.strip_prefix(key)
                .is_some_and(|rest| rest.trim_start().starts_with(':'))
        })
    };
    if begins(&["PDS_VERSION_ID", "ODL_VERSION_ID", "CCSD3ZF"]) {
        return CameraFormat::OdlLabel;
    }
    if begins(&["LBLSIZE="]) {
        return CameraFormat::VicarLabel;
    }
    if begins(&["<"]) || begins(&["%YAML:"]) || text.contains("opencv-matrix") {
        return CameraFormat::OpenCv;
    }
    if begins(&["{"]) || extension == "json" {
        return CameraFormat::Mars2020;
    }
    if (0..10).any(|n| has_key(&format!("cam{n}"))) {
        return CameraFormat::Kalibr;
    }
    if matches!(extension.as_str(), "yaml" | "yml") || has_key("camera_matrix") {
        return CameraFormat::Ros;
    }
    if extension == "txt" || colmap::begins(text) {
        return CameraFormat::Colmap;
    }
    if matches!(extension.as_str(), "lbl" | "img") {
        return CameraFormat::OdlLabel;
    }
    CameraFormat::Native
}

/// What is found in a file as it is read.
struct Found<'a> {
    shown: &'a str,
    cameras: Vec<Camera>,
    images: Vec<RoverImage>,
    notes: Vec<String>,
}

impl<'a> Found<'a> {
    fn new(shown: &'a str) -> Self {
        Self {
            shown,
            cameras: Vec::new(),
            images: Vec::new(),
            notes: Vec::new(),
        }
    }

    fn note(&mut self, note: impl fmt::Display) {
        self.notes.push(format!("{}: {note}", self.shown));
    }

    /// The picture of a rover, whose camera is of this one picture.
    fn image(&mut self, image: RoverImage) {
        self.cameras.push(image.camera.clone());
        self.images.push(image);
    }

    fn finish(self, format: CameraFormat) -> Result<CameraFile, Error> {
        let mut cameras = Cameras::new();
        for camera in self.cameras {
            let name = camera.name.clone();
            if cameras.insert(name.clone(), camera).is_some() {
                let place = Place::file(self.shown);
                return Err(Fault::found(place, name, "the camera twice", "it once").into());
            }
        }
        Ok(CameraFile {
            format,
            cameras,
            images: self.images,
            notes: self.notes,
        })
    }
}

#[cfg(test)]
mod tests;
