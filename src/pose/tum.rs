//! Trajectories of the TUM benchmarks: `timestamp tx ty tz qx qy qz qw`, the scalar last.

use super::lines::{local_file, numbers, rotation};
use super::{Attitude, PoseFile, PoseKey, PoseRow, Position, Time};
use crate::error::{Fault, Place};
use crate::frame::Point;
use crate::input::Reject;

const FIELDS: [&str; 7] = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// Reads a trajectory. Its frame counts as the site's east, north, up, and what moves as the body;
/// bad lines are set aside in the result.
pub(super) fn read(text: &str, shown: &str) -> PoseFile {
    let mut file = local_file(false);
    for (number, line) in (1u64..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match row(&words, &Place::line(shown, number), number) {
            Ok(row) => file.rows.push(row),
            Err(fault) => file.rejects.push(Reject::from_fault(fault, words[0])),
        }
    }
    file
}

fn row(words: &[&str], place: &Place, line: u64) -> Result<PoseRow, Fault> {
    if words.len() != 8 {
        let found = format!("{} fields", words.len());
        let expected = "timestamp tx ty tz qx qy qz qw";
        return Err(Fault::found(place.clone(), "", found, expected));
    }
    let Some(time) = Time::parse(words[0]) else {
        let found = format!("{:?}", words[0]);
        let expected = "seconds since 1970 as a decimal";
        return Err(Fault::found(place.clone(), "timestamp", found, expected));
    };
    let [x, y, z, qx, qy, qz, qw] = numbers(&words[1..], FIELDS, place)?;
    Ok(PoseRow {
        line,
        key: PoseKey::Time(time),
        platform: None,
        position: Position::Site(Point::new(x, y, z)),
        attitude: Attitude::Measured(rotation([qw, qx, qy, qz], "qx", place)?),
        sigma: [None; 6],
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::frame::Planet;
    use crate::pose::read_poses;

    /// The forward axis by `scipy.spatial.transform.Rotation`, whose scalar is last too.
    #[test]
    fn the_scalar_is_last() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/data/formats/trajectory.tum"
        );
        let file = read_poses(path.as_ref(), "trajectory.tum", Planet::EARTH, None).unwrap();
        assert!(file.rejects.is_empty() && file.is_local && file.has_attitude);
        let first = &file.rows[0];
        assert_eq!(first.position, Position::Site(Point::new(2.25, -0.75, 1.5)));
        assert_eq!(
            first.key,
            PoseKey::Time(Time::from_nanoseconds(1_128_870_000_125_004_000))
        );
        let Attitude::Measured(q) = first.attitude else {
            panic!("measured");
        };
        let ahead = Vector3::new(-0.325306622037, 0.921439812155, 0.212424749582);
        assert!((q * Vector3::x() - ahead).norm() < 1e-9);
        assert_eq!((file.rows.len(), file.rows[1].line), (2, 3));
    }

    #[test]
    fn bad_lines_are_set_aside() {
        let text =
            "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\nx 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 2\n5 0 O 0 0 0 0 1\n";
        let file = read(text, "t.txt");
        let rejects: Vec<String> = file.rejects.iter().map(Reject::to_string).collect();
        assert_eq!(
            rejects,
            [
                "t.txt:2: found 7 fields, expected timestamp tx ty tz qx qy qz qw",
                "t.txt:3: timestamp: found \"x\", expected seconds since 1970 as a decimal",
                "t.txt:4: qx: found a quaternion of length 2.0000, expected a unit quaternion",
                "t.txt:5: ty: found \"O\", expected a finite number",
            ]
        );
        assert_eq!((file.rows.len(), file.rejects[2].record.as_str()), (1, "4"));
    }
}
