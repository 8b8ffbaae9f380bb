//! Calibrations in OpenCV's `FileStorage`: YAML, XML or JSON, under the names that its calibration
//! samples write and the variants in use.

use super::Found;
use super::fields::{NO_MOUNT, fisheye, of_matrix, required, side, spelling, standard, unmounted};
use crate::error::Fault;
use crate::input::{Document, Section};

const WIDTH: [&str; 4] = ["image_width", "image_Width", "imageWidth", "width"];
const HEIGHT: [&str; 4] = ["image_height", "image_Height", "imageHeight", "height"];
const MATRIX: [&str; 7] = [
    "camera_matrix",
    "Camera_Matrix",
    "cameraMatrix",
    "CameraMatrix",
    "intrinsic_matrix",
    "K",
    "M1",
];
const DISTORTION: [&str; 8] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "distortionCoefficients",
    "DistCoeffs",
    "D",
    "D1",
];

/// The document of a storage, by the syntax it is written in.
pub(super) fn parse(text: &str, shown: &str) -> Result<Document, Fault> {
    match text
        .trim_start_matches('\u{feff}')
        .trim_start()
        .chars()
        .next()
    {
        Some('<') => Document::parse_xml(text, shown),
        Some('{') => Document::parse_json(text, shown),
        _ => Document::parse_yaml(text, shown),
    }
}

pub(super) fn read(root: &Section, stem: &str, found: &mut Found) {
    if root.has("opencv_storage") {
        storage(&root.section("opencv_storage"), stem, found);
    } else {
        storage(root, stem, found);
    }
}

fn storage(root: &Section, stem: &str, found: &mut Found) {
    let width = side(root, spelling(root, &WIDTH));
    let height = side(root, spelling(root, &HEIGHT));
    let key = spelling(root, &MATRIX);
    let camera = matrix(root, key).and_then(|m| of_matrix(root, key, &m));
    let key = spelling(root, &DISTORTION);
    let distortion = matrix(root, key);
    let is_fisheye =
        root.has("fisheye_model") && (root.boolean_or_number("fisheye_model")).unwrap_or_default();
    let name = root.name("camera_name").filter(|n| !n.is_empty());
    let camera = (|| {
        let (camera, distortion) = (camera?, distortion?);
        let lens = if is_fisheye {
            fisheye(root, key, camera, &distortion)?
        } else {
            standard(root, key, camera, &distortion)?
        };
        let name = name.unwrap_or_else(|| stem.to_owned());
        Some(unmounted(name, [width?, height?], lens))
    })();
    if let Some(camera) = camera {
        found.cameras.push(camera);
        found.note(NO_MOUNT);
    }
}

/// The numbers of a matrix, whatever its shape, that has as many as its rows and columns say.
fn matrix(root: &Section, key: &str) -> Option<Vec<f64>> {
    if !root.has(key) {
        root.fault(key, "nothing", "a matrix");
        return None;
    }
    let table = root.section(key);
    let whole = |key: &str| required(&table, key, "a count", |s, key| s.integer(key, 0..=1000));
    let (rows, columns) = (whole("rows"), whole("cols"));
    let numbers = required(&table, "data", "the numbers", |s, key| s.number_words(key))?;
    let count = rows?.checked_mul(columns?)?;
    if numbers.len() as u64 != count {
        let found = format!("{} numbers", numbers.len());
        table.fault("data", found, format!("{count}, rows times cols"));
        return None;
    }
    Some(numbers)
}
