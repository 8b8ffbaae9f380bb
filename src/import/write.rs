//! Writes what was imported.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Imported, ImportedImage};
use crate::camera::write_cameras;
use crate::error::Error;
use crate::input::write_rows;

/// Writes `cameras.toml` into a folder, which is made where it is missing, and, where there are
/// pictures, `images.csv` and `poses.csv`; gives the names of what was written. Places are offsets
/// from the origin of the rover's site frame, which the run names as `site.origin`.
///
/// # Errors
/// A file that cannot be written, or that stands there already.
pub fn write(imported: &Imported, folder: &Path, force: bool) -> Result<Vec<&'static str>, Error> {
    let mut names = vec!["cameras.toml"];
    if !imported.images.is_empty() {
        names.extend(["images.csv", "poses.csv"]);
    }
    if !force && let Some(name) = names.iter().find(|name| folder.join(name).exists()) {
        let path = folder.join(name);
        return Err(Error::Output(format!(
            "{} stands there already; --force replaces it",
            path.display()
        )));
    }
    fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    write_cameras(&folder.join("cameras.toml"), &imported.cameras)?;
    if !imported.images.is_empty() {
        write_rows(
            &folder.join("images.csv"),
            &images(&imported.images, folder),
        )?;
        write_rows(&folder.join("poses.csv"), &poses(&imported.images))?;
    }
    Ok(names)
}

/// Columns without any value are left out, but for those a table must have.
fn kept<'a>(
    columns: Vec<(&'a str, Vec<String>)>,
    required: &[&str],
) -> Vec<(&'a str, Vec<String>)> {
    let mut columns = columns;
    columns.retain(|(name, values)| {
        required.contains(name) || values.iter().any(|value| !value.is_empty())
    });
    columns
}

fn images(images: &[ImportedImage], folder: &Path) -> Vec<(&'static str, Vec<String>)> {
    let column = |get: &dyn Fn(&ImportedImage) -> String| images.iter().map(get).collect();
    let columns = vec![
        ("image_id", column(&|i| i.image.image_id.clone())),
        (
            "time",
            column(&|i| i.image.time.map_or(String::new(), |t| t.to_string())),
        ),
        ("camera", column(&|i| i.image.camera.name.clone())),
        (
            "path",
            column(&|i| {
                let relative = |p: &PathBuf| relative(p, folder).to_string_lossy().into_owned();
                i.picture.as_ref().map_or(String::new(), relative)
            }),
        ),
    ];
    kept(columns, &["image_id", "camera"])
}

/// Only pictures with a place have a row: a pose without one is none.
fn poses(images: &[ImportedImage]) -> Vec<(&'static str, Vec<String>)> {
    let placed: Vec<&ImportedImage> = images
        .iter()
        .filter(|i| i.image.pose.place.is_some())
        .collect();
    let coordinate = |axis: usize| {
        let place = |i: &&ImportedImage| i.image.pose.place.map(|p| p.xyz[axis]);
        placed.iter().map(|i| number(place(i))).collect()
    };
    let part = |index: usize| {
        let attitude = |i: &&ImportedImage| i.image.pose.attitude.map(|a| a.scalar_first()[index]);
        placed.iter().map(|i| number(attitude(i))).collect()
    };
    let ids = placed.iter().map(|i| i.image.image_id.clone()).collect();
    let columns = vec![
        ("image_id", ids),
        ("x_m", coordinate(0)),
        ("y_m", coordinate(1)),
        ("z_m", coordinate(2)),
        ("qw", part(0)),
        ("qx", part(1)),
        ("qy", part(2)),
        ("qz", part(3)),
    ];
    kept(columns, &["image_id", "x_m", "y_m", "z_m"])
}

/// The shortest text that reads back as the same number.
fn number(x: Option<f64>) -> String {
    // Adding zero takes the sign off a zero.
    x.map_or(String::new(), |x| (x + 0.0).to_string())
}

/// A path as it is written in a file of `folder`: by the steps from there where both lie below one
/// working folder or below the root, else as it is.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned());
    let (path, folder) = (absolute(path), absolute(folder));
    let (to, from): (Vec<_>, Vec<_>) = (path.components().collect(), folder.components().collect());
    let shared = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path;
    }
    let up = std::iter::repeat_n(std::path::Component::ParentDir, from.len() - shared);
    up.chain(to.into_iter().skip(shared)).collect()
}
