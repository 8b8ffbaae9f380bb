//! images.txt of COLMAP: two lines an image, `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME` and the
//! points seen in it.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use super::lines::{local_file, numbers, rotation};
use super::{Attitude, PoseFile, PoseKey, PoseRow, Position};
use crate::error::{Fault, Place};
use crate::frame::Point;
use crate::input::{Reject, image_id_of};

const FIELDS: [&str; 7] = ["QW", "QX", "QY", "QZ", "TX", "TY", "TZ"];

/// Reads the poses. The world of the reconstruction counts as the site's east, north, up, which it is
/// where it was aligned so. COLMAP's quaternion and translation take points of the world into the
/// camera; here the camera stands at the body's origin and looks forward, as the cameras of
/// cameras.txt do. An image is its name without the extension, its camera the number of cameras.txt.
/// Bad lines are set aside in the result.
pub(super) fn read(text: &str, shown: &str) -> PoseFile {
    let mut file = local_file(true);
    let mut is_points = false;
    for (number, line) in (1u64..).zip(text.lines()) {
        let line = line.trim();
        if line.starts_with('#') || (line.is_empty() && !is_points) {
            continue;
        }
        // The second line of an image may be empty.
        let skipped = is_points;
        is_points = !is_points;
        if skipped {
            continue;
        }
        match row(line, &Place::line(shown, number), number) {
            Ok(row) => file.rows.push(row),
            Err(fault) => {
                let record = line.split_whitespace().last().unwrap_or("");
                file.rejects.push(Reject::from_fault(fault, record));
            }
        }
    }
    file
}

fn row(line: &str, place: &Place, number: u64) -> Result<PoseRow, Fault> {
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.len() < 10 {
        let found = format!("{} fields", words.len());
        let expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
        return Err(Fault::found(place.clone(), "", found, expected));
    }
    let [w, x, y, z, tx, ty, tz] = numbers(&words[1..], FIELDS, place)?;
    let camera_from_world = rotation([w, x, y, z], "QW", place)?;
    let world_from_camera = camera_from_world.inverse();
    let centre = world_from_camera * -nalgebra::Vector3::new(tx, ty, tz);
    // A name may hold blanks: it is all that follows the ninth field.
    let name = after_fields(line, 9);
    Ok(PoseRow {
        line: number,
        key: PoseKey::Image {
            image_id: image_id_of(name),
            time: None,
            camera: Some(words[8].to_owned()),
            path: Some(name.to_owned()),
            pan_tilt: [0.0; 2],
        },
        platform: None,
        position: Position::Site(Point::from_xyz(centre)),
        attitude: Attitude::Measured(world_from_camera * camera_from_body()),
        sigma: [None; 6],
    })
}

/// What follows so many fields.
fn after_fields(line: &str, count: usize) -> &str {
    (0..count).fold(line.trim_start(), |rest, _| {
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        rest[end..].trim_start()
    })
}

/// Body axes (forward, left, up) into those of a camera that looks forward (right, down, forward).
fn camera_from_body() -> UnitQuaternion<f64> {
    let axes = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::frame::Planet;
    use crate::pose::read_poses;

    /// Centres and axes by `scipy.spatial.transform.Rotation`.
    #[test]
    fn the_world_to_camera_transform_is_turned_round() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/images.txt");
        let file = read_poses(path.as_ref(), "images.txt", Planet::EARTH, None).unwrap();
        assert!(file.rejects.is_empty() && file.is_per_image && file.is_local);
        assert_eq!(file.rows.len(), 2);
        let expected = [
            (
                ("DSC_0041", "1", "DSC_0041.JPG"),
                [4.29537348555, -0.047724549766, 0.457228593791],
                [-0.969647917911, -0.182732739737, 0.162455104933],
                [0.055122266952, 0.483945381528, 0.873360408642],
            ),
            (
                ("flight 2/DSC_0042", "2", "flight 2/DSC_0042.JPG"),
                [1.5, -2.0, -0.25],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, 1.0],
            ),
        ];
        for (row, (names, centre, ahead, right)) in file.rows.iter().zip(expected) {
            let PoseKey::Image {
                image_id,
                camera,
                path,
                ..
            } = &row.key
            else {
                panic!("by image");
            };
            let named = (
                image_id.as_str(),
                camera.as_deref().unwrap(),
                path.as_deref().unwrap(),
            );
            assert_eq!(named, names);
            let (Position::Site(place), Attitude::Measured(q)) = (row.position, row.attitude)
            else {
                panic!("measured in the site");
            };
            assert!(
                (place.xyz - Vector3::from(centre)).norm() < 1e-5,
                "{place:?}"
            );
            assert!((q * Vector3::x() - Vector3::from(ahead)).norm() < 1e-6);
            assert!((q * -Vector3::y() - Vector3::from(right)).norm() < 1e-6);
        }
    }

    #[test]
    fn bad_lines_are_set_aside() {
        let text = "1 1 0 0 0 1 2 3 1 a.jpg\n\n2 1 0 0 0 1 2 3 1\n\n3 2 0 0 0 1 2 3 1 c.jpg\n\n4 1 0 0 0 1 x 3 1 d.jpg\n\n";
        let file = read(text, "images.txt");
        let rejects: Vec<String> = file.rejects.iter().map(Reject::to_string).collect();
        assert_eq!(
            rejects,
            [
                "images.txt:3: found 9 fields, expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME",
                "images.txt:5: QW: found a quaternion of length 2.0000, expected a unit quaternion",
                "images.txt:7: TY: found \"x\", expected a finite number",
            ]
        );
        assert_eq!(
            (file.rows.len(), file.rejects[1].record.as_str()),
            (1, "c.jpg")
        );
    }
}
