//! Tables of a ROS pose topic, as `rostopic echo -p` prints `nav_msgs/Odometry`,
//! `geometry_msgs/PoseWithCovarianceStamped` and `geometry_msgs/PoseStamped`.

use std::path::Path;

use nalgebra::{Matrix3, UnitQuaternion};

use super::lines::{local_file, rotation};
use super::{Attitude, PoseFile, PoseKey, PoseRow, Position, Time};
use crate::error::{Error, Fault};
use crate::frame::Point;
use crate::input::{Reject, Row, Table};

const STAMP: &str = "field.header.stamp";

/// Reads a table: stamps in nanoseconds, the quaternion with its scalar last. The frame of the topic
/// counts as the site's east, north, up. Where the covariance is given, its diagonal makes the
/// standard deviations; zeros and negative numbers, which ROS writes for unknown, do not. Bad rows
/// are set aside in the result.
///
/// # Errors
/// A file that cannot be read, or a missing column.
pub(super) fn read(path: &Path, shown: &str) -> Result<PoseFile, Error> {
    let mut table = Table::open(path, shown)?;
    let nested = table.has("field.pose.pose.position.x");
    let prefix = if nested {
        "field.pose.pose"
    } else {
        "field.pose"
    };
    let columns: Vec<String> = [
        "position.x",
        "position.y",
        "position.z",
        "orientation.w",
        "orientation.x",
        "orientation.y",
        "orientation.z",
    ]
    .iter()
    .map(|name| format!("{prefix}.{name}"))
    .collect();
    let mut required = vec![STAMP];
    required.extend(columns.iter().map(String::as_str));
    table.require(&required)?;
    let mut file = local_file(false);
    while let Some(row) = table.next_row() {
        let record = match &row {
            Ok(row) => row.text(STAMP).unwrap_or("").to_owned(),
            Err(_) => String::new(),
        };
        match row.and_then(|row| pose_row(&row, &columns)) {
            Ok(row) => file.rows.push(row),
            Err(fault) => file.rejects.push(Reject::from_fault(fault, record)),
        }
    }
    Ok(file)
}

fn pose_row(row: &Row<'_>, columns: &[String]) -> Result<PoseRow, Fault> {
    let stamp = row.required_text(STAMP)?;
    let nanoseconds: i64 = stamp.parse().map_err(|_| {
        let found = format!("{stamp:?}");
        row.fault(STAMP, found, "nanoseconds since 1970")
    })?;
    let mut numbers = [0.0; 7];
    for (number, column) in numbers.iter_mut().zip(columns) {
        *number = row.required_number(column)?;
    }
    let [x, y, z, qw, qx, qy, qz] = numbers;
    let attitude = rotation([qw, qx, qy, qz], &columns[3], &row.place())?;
    Ok(PoseRow {
        line: row.line(),
        key: PoseKey::Time(Time::from_nanoseconds(nanoseconds)),
        platform: None,
        position: Position::Site(Point::new(x, y, z)),
        attitude: Attitude::Measured(attitude),
        sigma: sigma(row, attitude)?,
    })
}

/// Standard deviations from the 6 x 6 covariance, row by row; its rotations are about the fixed axes
/// and are turned to the body's.
fn sigma(row: &Row<'_>, attitude: UnitQuaternion<f64>) -> Result<[Option<f64>; 6], Fault> {
    let at = |i: usize, j: usize| row.number(&format!("field.pose.covariance{}", 6 * i + j));
    let mut sigma = [None; 6];
    for (i, sigma) in sigma.iter_mut().take(3).enumerate() {
        *sigma = at(i, i)?.filter(|v| *v > 0.0).map(f64::sqrt);
    }
    let mut fixed = Matrix3::zeros();
    for i in 0..3 {
        for j in 0..3 {
            fixed[(i, j)] = at(3 + i, 3 + j)?.unwrap_or(0.0);
        }
    }
    if (0..3).all(|i| fixed[(i, i)] > 0.0) {
        let turn = attitude.to_rotation_matrix().into_inner();
        let body = turn.transpose() * fixed * turn;
        for i in 0..3 {
            sigma[3 + i] = Some(body[(i, i)]).filter(|v| *v > 0.0).map(f64::sqrt);
        }
    }
    Ok(sigma)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::frame::Planet;
    use crate::pose::read_poses;

    fn table(covariance: [f64; 6]) -> String {
        let mut head =
            "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.child_frame_id,\
            field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.position.z,\
            field.pose.pose.orientation.x,field.pose.pose.orientation.y,\
            field.pose.pose.orientation.z,field.pose.pose.orientation.w"
                .to_owned();
        let mut row =
            "1128870000300000000,7,1128870000250000000,odom,base_link,1.5,-2,0.25,0,0,0.6,0.8"
                .to_owned();
        for i in 0..36 {
            head += &format!(",field.pose.covariance{i}");
            let value = if i % 7 == 0 { covariance[i / 7] } else { 0.0 };
            row += &format!(",{value}");
        }
        format!("{head}\n{row}\n")
    }

    fn read(text: &str) -> Result<PoseFile, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("odom.csv");
        std::fs::write(&path, text).unwrap();
        read_poses(&path, "odom.csv", Planet::EARTH, None)
    }

    #[test]
    fn stamps_are_nanoseconds_and_the_scalar_is_last() {
        let file = read(&table([0.04, 0.09, 0.0, 0.01, 0.04, 0.25])).unwrap();
        assert!(file.rejects.is_empty() && file.is_local && !file.is_per_image);
        let row = &file.rows[0];
        assert_eq!(
            row.key,
            PoseKey::Time(Time::parse("1128870000.25").unwrap())
        );
        assert_eq!(row.position, Position::Site(Point::new(1.5, -2.0, 0.25)));
        let Attitude::Measured(q) = row.attitude else {
            panic!("measured");
        };
        // 2 atan(0.6 / 0.8) about the vertical: cos 0.28, sin 0.96.
        assert!((q * Vector3::x() - Vector3::new(0.28, 0.96, 0.0)).norm() < 1e-12);
        assert_eq!(row.sigma[..3], [Some(0.2), Some(0.3), None]);
        // Variances 0.01 and 0.04 about fixed x and y, in axes turned by that angle.
        let expected = [
            (0.28f64.powi(2) * 0.01 + 0.96f64.powi(2) * 0.04).sqrt(),
            (0.96f64.powi(2) * 0.01 + 0.28f64.powi(2) * 0.04).sqrt(),
            0.5,
        ];
        for (sigma, expected) in row.sigma[3..].iter().zip(expected) {
            assert!((sigma.unwrap() - expected).abs() < 1e-12);
        }
        let unknown = read(&table([0.0; 6])).unwrap();
        assert_eq!(unknown.rows[0].sigma, [None; 6]);
    }

    #[test]
    fn bad_rows_are_set_aside_and_missing_columns_told() {
        let text = table([0.0; 6]).replace(",1128870000250000000,", ",now,");
        let file = read(&text).unwrap();
        assert_eq!(
            file.rejects[0].to_string(),
            "odom.csv:2: field.header.stamp: found \"now\", expected nanoseconds since 1970"
        );
        let text = table([0.0; 6]).replace("0,0,0.6,0.8", "0,0,0.6,1.8");
        assert_eq!(
            read(&text).unwrap().rejects[0].to_string(),
            "odom.csv:2: field.pose.pose.orientation.w: found a quaternion of length 1.8974, expected a unit quaternion"
        );
        let error = read("%time,field.header.stamp,field.data\n1,1,2\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "odom.csv:1: field.pose.position.x: found columns %time, field.header.stamp, field.data, \
             expected a column field.pose.position.x"
        );
    }
}
