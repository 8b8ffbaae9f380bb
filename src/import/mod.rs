//! Files of others turned into this program's own: cameras into `cameras.toml`, and the poses that
//! labels and JSON of rover pictures carry into `poses.csv` and `images.csv`.

mod sites;
mod write;

use std::path::{Path, PathBuf};

use crate::camera::{Cameras, RoverImage, read_camera_file};
use crate::error::{Error, Fault, Place};
use crate::frame::{Body, Enu, Rotation};

pub use write::write;

/// What was read from all files together.
#[derive(Debug, Default)]
pub struct Imported {
    /// All cameras.
    pub cameras: Cameras,
    /// The pictures of rovers, in the order of the files.
    pub images: Vec<ImportedImage>,
    /// What the files say that is not used, and what was taken for granted.
    pub notes: Vec<String>,
}

/// A picture of a rover, and where its file is.
#[derive(Debug, Clone)]
pub struct ImportedImage {
    /// What its label or record says.
    pub image: RoverImage,
    /// The picture, where one lies beside the label.
    pub picture: Option<PathBuf>,
}

/// Reads all files. The places of all pictures are told from the first one's site. A record without an attitude gets `attitude`, if it is given.
///
/// # Errors
/// All faults in the files at once; a camera that two files have, or pictures of different sites
/// that no label ties together.
pub fn read(files: &[PathBuf], attitude: Option<Rotation<Enu, Body>>) -> Result<Imported, Error> {
    let mut imported = Imported::default();
    let mut faults = Vec::new();
    let mut origins = Vec::new();
    for path in files {
        let shown = path.display().to_string();
        let file = match read_camera_file(path, &shown) {
            Ok(file) => file,
            Err(Error::Faults(more)) => {
                faults.extend(more);
                continue;
            }
            Err(other) => {
                faults.push(Fault::new(Place::default(), "", other.to_string()));
                continue;
            }
        };
        for (name, camera) in file.cameras {
            if imported.cameras.insert(name.clone(), camera).is_some() {
                let place = Place::file(&shown);
                faults.push(Fault::found(place, name, "the camera twice", "it once"));
            }
        }
        let mut notes = file.notes;
        for mut image in file.images {
            image.pose.attitude = image.pose.attitude.or(attitude);
            let id = &image.image_id;
            match (image.pose.place, image.pose.attitude) {
                (None, _) => notes.push(format!("{shown}: {id}: no position is told, so no pose")),
                (_, None) => notes.push(format!("{shown}: {id}: no attitude is told")),
                _ => {}
            }
            let picture = picture_beside(path, &image.image_id);
            imported.images.push(ImportedImage { image, picture });
            origins.push(shown.clone());
        }
        imported.notes.extend(notes);
    }
    faults.extend(sites::join(&mut imported.images, &origins));
    Error::check(faults)?;
    Ok(imported)
}

/// The picture of a label: a file beside it, named as the label or as the product is.
fn picture_beside(label: &Path, image_id: &str) -> Option<PathBuf> {
    let folder = label.parent().unwrap_or(Path::new(""));
    let stem = label.file_stem()?.to_string_lossy().into_owned();
    let stem = stem.strip_suffix("-metadata").unwrap_or(&stem).to_owned();
    // A label kept as text: NAME.lbl.txt.
    let inner = stem.strip_suffix(".lbl").unwrap_or(&stem).to_owned();
    let mut names = vec![stem, inner, image_id.to_owned()];
    names.dedup();
    for name in names {
        for extension in [
            "png", "jpg", "jpeg", "tif", "tiff", "PNG", "JPG", "JPEG", "TIF",
        ] {
            let path = folder.join(format!("{name}.{extension}"));
            if path.is_file() {
                return Some(path);
            }
        }
    }
    None
}
