//! cameras.txt of COLMAP.

use super::fields::{NO_MOUNT, unmounted};
use super::{CameraFile, CameraFormat, Found};
use crate::camera::{BadLens, BrownConrady, Fisheye, Intrinsics, Lens, Pinhole};
use crate::error::{Error, Fault, Place};

/// The models that are read, with their parameters in the order of the file.
const MODELS: [(&str, &[&str]); 9] = [
    ("SIMPLE_PINHOLE", &["f", "cx", "cy"]),
    ("PINHOLE", &["fx", "fy", "cx", "cy"]),
    ("SIMPLE_RADIAL", &["f", "cx", "cy", "k"]),
    ("RADIAL", &["f", "cx", "cy", "k1", "k2"]),
    ("OPENCV", &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"]),
    (
        "OPENCV_FISHEYE",
        &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
    ),
    (
        "FULL_OPENCV",
        &[
            "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6",
        ],
    ),
    ("SIMPLE_RADIAL_FISHEYE", &["f", "cx", "cy", "k"]),
    ("RADIAL_FISHEYE", &["f", "cx", "cy", "k1", "k2"]),
];

/// Whether a text begins as a cameras.txt does.
pub(super) fn begins(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    let Some(first) = first else {
        return text.starts_with("# Camera list");
    };
    let words: Vec<&str> = first.split_whitespace().collect();
    let is_model = |w: &&str| {
        w.chars().all(|c| c.is_ascii_uppercase() || c == '_') && w.starts_with(char::is_alphabetic)
    };
    words.len() > 4
        && words[0].chars().all(|c| c.is_ascii_digit())
        && is_model(&words[1])
        && words[2].parse::<u32>().is_ok()
}

/// Reads `CAMERA_ID MODEL WIDTH HEIGHT PARAMS...`, one camera a line. The name of a camera is its
/// number. COLMAP counts pixels from the picture's upper left corner, so that half a pixel is taken
/// off the principal point.
pub(super) fn read(text: &str, shown: &str) -> Result<CameraFile, Error> {
    let mut found = Found::new(shown);
    let mut faults = Vec::new();
    for (number, line) in (1u64..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match camera(&words, &Place::line(shown, number)) {
            Ok((name, size, lens)) => found.cameras.push(unmounted(name, size, lens)),
            Err(fault) => faults.push(fault),
        }
    }
    if found.cameras.is_empty() && faults.is_empty() {
        let expected = "lines CAMERA_ID MODEL WIDTH HEIGHT PARAMS";
        faults.push(Fault::found(Place::file(shown), "", "no camera", expected));
    }
    Error::check(faults)?;
    found.note(NO_MOUNT);
    found.finish(CameraFormat::Colmap)
}

fn camera(words: &[&str], place: &Place) -> Result<(String, [u32; 2], Lens), Fault> {
    let fault = |field: &str, found: &str, expected: &str| {
        Fault::found(place.clone(), field, found, expected)
    };
    let [id, model, width, height, parameters @ ..] = words else {
        let found = format!("{} fields", words.len());
        let expected = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS";
        return Err(fault("", &found, expected));
    };
    let side = |field: &str, text: &str| match text.parse::<u32>() {
        Ok(side @ 1..=1_000_000) => Ok(side),
        _ => Err(fault(field, text, "a whole number from 1 to 1000000")),
    };
    let size = [side("WIDTH", width)?, side("HEIGHT", height)?];
    let Some((_, names)) = MODELS.iter().find(|(name, _)| name == model) else {
        let known: Vec<&str> = MODELS.iter().map(|(name, _)| *name).collect();
        let expected = format!("one of {}", known.join(", "));
        return Err(fault("MODEL", model, &expected));
    };
    if parameters.len() != names.len() {
        let found = format!("{} numbers", parameters.len());
        return Err(fault("PARAMS", &found, &names.join(", ")));
    }
    let mut numbers = Vec::new();
    for (name, text) in names.iter().zip(parameters) {
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => numbers.push(number),
            _ => return Err(fault(name, text, "a finite number")),
        }
    }
    let lens = lens(model, &numbers);
    let bad = |bad: BadLens| Fault::new(place.clone(), "PARAMS", bad.to_string());
    Ok(((*id).to_owned(), size, lens.map_err(bad)?))
}

/// The lens of a model's parameters, which are as many as the model has.
fn lens(model: &str, numbers: &[f64]) -> Result<Lens, BadLens> {
    let one_focal = !matches!(model, "PINHOLE") && !model.contains("OPENCV");
    let (focals, rest) = numbers.split_at(if one_focal { 1 } else { 2 });
    let (centre, distortion) = rest.split_at(2);
    let intrinsics = Intrinsics {
        fx: focals[0],
        fy: focals[focals.len() - 1],
        cx: centre[0] - 0.5,
        cy: centre[1] - 0.5,
    };
    // Coefficients that a model does not have are zero in the larger one.
    let padded = |n: usize| {
        let mut all = distortion.to_vec();
        all.resize(n.max(all.len()), 0.0);
        all
    };
    if model.ends_with("FISHEYE") {
        let all = padded(4);
        return Fisheye::new(intrinsics, [all[0], all[1], all[2], all[3]]).map(Lens::Fisheye);
    }
    if distortion.is_empty() {
        return Pinhole::new(intrinsics).map(Lens::Pinhole);
    }
    BrownConrady::new(intrinsics, &padded(4)).map(Lens::BrownConrady)
}
