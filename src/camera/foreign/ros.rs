//! Camera calibrations of ROS: the YAML that `camera_calibration` writes and `camera_info_manager`
//! reads, and a printed `sensor_msgs/CameraInfo` message.

use super::Found;
use super::fields::{NO_MOUNT, fisheye, of_matrix, required, side, spelling, standard, unmounted};
use crate::camera::{BadReadout, Camera, Intrinsics, Lens, Subframe};
use crate::input::Section;

const MODELS: [&str; 3] = ["plumb_bob", "rational_polynomial", "equidistant"];

pub(super) fn read(root: &Section, stem: &str, found: &mut Found) {
    let width = side(root, spelling(root, &["image_width", "width"]));
    let height = side(root, spelling(root, &["image_height", "height"]));
    let intrinsics = intrinsics(root);
    let model = required(root, "distortion_model", "the name of a model", |s, key| {
        // Drivers of ideal cameras leave the name empty.
        match s.shown(key).as_str() {
            "\"\"" => Some(String::new()),
            _ => s.word(key, &MODELS),
        }
    });
    let key = spelling(root, &["distortion_coefficients", "D", "d"]);
    let distortion = coefficients(root, key);
    let name = root.name("camera_name").filter(|n| !n.is_empty());
    let used_up = (|| {
        let (model, distortion) = (model?, distortion?);
        let lens = lens(root, key, &model, intrinsics?, &distortion)?;
        let name = name.unwrap_or_else(|| stem.to_owned());
        let camera = unmounted(name, [width?, height?], lens);
        found.cameras.push(read_out(root, camera)?);
        Some(())
    })();
    if used_up.is_some() {
        let unused = [
            "projection_matrix",
            "rectification_matrix",
            "P",
            "p",
            "R",
            "r",
        ];
        let there: Vec<&str> = unused.into_iter().filter(|key| root.has(key)).collect();
        if there.is_empty() {
            found.note(NO_MOUNT);
        } else {
            let there = there.join(" and ");
            found.note(format!(
                "{there} not used, since marks are in the raw picture; {NO_MOUNT}"
            ));
        }
    }
}

fn intrinsics(root: &Section) -> Option<Intrinsics> {
    let key = spelling(root, &["camera_matrix", "K", "k"]);
    let matrix = if key == "camera_matrix" {
        if !root.has(key) {
            root.fault(key, "nothing", "the camera matrix");
            return None;
        }
        root.section(key).numbers("data", &[9])?
    } else {
        root.numbers(key, &[9])?
    };
    of_matrix(root, key, &matrix)
}

fn coefficients(root: &Section, key: &str) -> Option<Vec<f64>> {
    let expected = "the distortion coefficients";
    required(root, key, expected, |s, key| match key {
        "distortion_coefficients" => {
            let table = s.section(key);
            required(&table, "data", expected, |s, key| s.number_list(key))
        }
        _ => s.number_list(key),
    })
}

fn lens(
    root: &Section,
    key: &str,
    model: &str,
    intrinsics: Intrinsics,
    distortion: &[f64],
) -> Option<Lens> {
    let counts: &[usize] = match model {
        "plumb_bob" => &[0, 4, 5],
        "rational_polynomial" => &[8, 12, 14],
        "equidistant" => &[4],
        _ => &[0],
    };
    if !counts.contains(&distortion.len()) {
        let texts: Vec<String> = counts.iter().map(usize::to_string).collect();
        let expected = format!("{} for {model:?}", texts.join(" or "));
        root.fault(key, format!("{} coefficients", distortion.len()), expected);
        return None;
    }
    match model {
        "equidistant" => fisheye(root, key, intrinsics, distortion),
        _ => standard(root, key, intrinsics, distortion),
    }
}

/// The calibration is of the full sensor; a message may tell of a part of it, in the sensor's pixels,
/// and of pixels that are averaged into one (`sensor_msgs/CameraInfo`: `roi`, `binning_x`).
fn read_out(root: &Section, camera: Camera) -> Option<Camera> {
    let number = |section: &Section, key: &str| {
        if !section.has(key) {
            return Some(0);
        }
        u32::try_from(section.integer(key, 0..=1_000_000)?).ok()
    };
    let bad = |key, bad: BadReadout| root.problem(key, bad.to_string());
    let mut camera = camera;
    if root.has("roi") {
        let roi = root.section("roi");
        let part = Subframe {
            first_u_px: number(&roi, "x_offset")?,
            first_v_px: number(&roi, "y_offset")?,
            width: number(&roi, "width")?,
            height: number(&roi, "height")?,
        };
        // All zero is the whole sensor.
        if [part.first_u_px, part.first_v_px, part.width, part.height] != [0; 4] {
            let cut = camera.subframe(part);
            camera = cut.map_err(|error| bad("roi", error)).ok()?;
        }
    }
    // Zero is one.
    let binning = ["binning_x", "binning_y"].map(|key| number(root, key).map(|n| n.max(1)));
    let binned = camera.binned([binning[0]?, binning[1]?]);
    binned.map_err(|error| bad("binning_x", error)).ok()
}
