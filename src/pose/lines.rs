//! Logs of others in which a pose is a line of words: what tells them apart, and their fields.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};

use super::PoseFile;
use crate::error::{Error, Fault, Place};

/// A log that is no poses.csv.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LogFormat {
    /// `timestamp tx ty tz qx qy qz qw` of the TUM benchmarks.
    Tum,
    /// images.txt of COLMAP.
    Colmap,
    /// `rostopic echo -p` of an odometry or pose topic.
    Odometry,
}

/// Tells the formats apart by the first line that is no comment; `None` for a poses.csv.
pub(super) fn recognise(path: &Path) -> Result<Option<LogFormat>, Error> {
    let failed = |e| Error::io(path, "read", e);
    let mut head = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(1 << 16).read_to_end(&mut head).map_err(failed)?;
    let head = String::from_utf8_lossy(&head);
    let mut lines = head.lines().map(str::trim);
    let Some(first) = lines.find(|line| !line.is_empty() && !line.starts_with('#')) else {
        return Ok(None);
    };
    if first.starts_with("%time,") {
        return Ok(Some(LogFormat::Odometry));
    }
    let words: Vec<&str> = first.split_whitespace().collect();
    let is_number = |word: &&str| word.parse::<f64>().is_ok();
    if words.len() == 8 && words.iter().all(is_number) {
        return Ok(Some(LogFormat::Tum));
    }
    let is_colmap = words.len() >= 10 && words[..9].iter().all(is_number);
    Ok(is_colmap.then_some(LogFormat::Colmap))
}

/// A file of poses in an unnamed level frame, which counts as the site's.
pub(super) fn local_file(is_per_image: bool) -> PoseFile {
    PoseFile {
        rows: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: Vec::new(),
        is_per_image,
        is_local: true,
        has_attitude: true,
    }
}

/// The numbers of fields, by the names they have in faults.
pub(super) fn numbers<const N: usize>(
    words: &[&str],
    names: [&str; N],
    place: &Place,
) -> Result<[f64; N], Fault> {
    let mut numbers = [0.0; N];
    for (i, name) in names.into_iter().enumerate() {
        let word = words.get(i).copied().unwrap_or("");
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => numbers[i] = number,
            _ => {
                let found = format!("{word:?}");
                return Err(Fault::found(place.clone(), name, found, "a finite number"));
            }
        }
    }
    Ok(numbers)
}

/// A logged quaternion, scalar first, whose length is one but for rounding.
pub(super) fn rotation(
    [w, x, y, z]: [f64; 4],
    field: &str,
    place: &Place,
) -> Result<UnitQuaternion<f64>, Fault> {
    let q = Quaternion::new(w, x, y, z);
    let norm = q.norm();
    if (norm - 1.0).abs() > 0.01 {
        let found = format!("a quaternion of length {norm:.4}");
        return Err(Fault::found(
            place.clone(),
            field,
            found,
            "a unit quaternion",
        ));
    }
    Ok(UnitQuaternion::from_quaternion(q))
}
