//! Writes `poses.csv` and `images.csv`, with fixed decimals, so that the same poses are the same
//! bytes.

use std::path::Path;

use jiff::Timestamp;

use super::PoseSigma;
use crate::error::Error;
use crate::frame::{Body, Geodetic, LocalEnu, Rotation};
use crate::input::{rows_text, write_rows};

/// One row of `poses.csv`. A column is written where at least one record has a value for it.
#[derive(Debug, Clone)]
pub struct PoseRecord {
    /// The image the pose belongs to, where the log is keyed by image.
    pub image_id: Option<String>,
    /// The camera that took the image.
    pub camera: Option<String>,
    /// The picture, relative to the file.
    pub path: Option<String>,
    /// Which of several platforms.
    pub platform: Option<String>,
    /// Seconds since 1970.
    pub time_s: Option<f64>,
    /// Where the body's origin is.
    pub place: Geodetic,
    /// Rotates body axes into east, north, up at `place`.
    pub attitude: Rotation<LocalEnu, Body>,
    /// Standard deviations of the pose.
    pub sigma: Option<PoseSigma>,
}

/// One row of `images.csv`. Optional columns are written where at least one record has a value.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageRecord {
    /// The image.
    pub image_id: String,
    /// Seconds since 1970.
    pub time_s: f64,
    /// The camera that took it.
    pub camera: String,
    /// The picture, relative to the file; empty where it is not at hand.
    pub path: String,
    /// Which of several platforms.
    pub platform: Option<String>,
    /// Pan of the head, radians clockwise seen from above.
    pub pan: Option<f64>,
    /// Tilt of the head, radians, up positive.
    pub tilt: Option<f64>,
}

/// A time as RFC 3339 in UTC with milliseconds.
///
/// # Errors
/// A time beyond the calendar (years -9999 to 9999).
pub fn format_time(time_s: f64) -> Result<String, Error> {
    let unknown = || Error::Output(format!("found time {time_s}, expected one in the calendar"));
    let millis = (time_s * 1e3).round();
    if !(-3e14..=3e14).contains(&millis) {
        return Err(unknown());
    }
    #[expect(clippy::cast_possible_truncation, reason = "whole and in range")]
    let stamp = Timestamp::from_millisecond(millis as i64).map_err(|_| unknown())?;
    Ok(format!("{stamp:.3}"))
}

fn time_text(time_s: Option<f64>) -> Result<String, Error> {
    time_s.map_or(Ok(String::new()), format_time)
}

/// Writes `poses.csv`: latitude and longitude with 10 decimals (0.01 mm), heights with 5,
/// quaternions with 10.
///
/// # Errors
/// A file that cannot be written, or a time beyond the calendar.
pub fn write_poses(path: &Path, records: &[PoseRecord]) -> Result<(), Error> {
    std::fs::write(path, poses_text(records)?).map_err(|e| Error::io(path, "write", e))
}

/// The text of `poses.csv`, as [`write_poses`] writes it.
///
/// # Errors
/// A time beyond the calendar.
pub fn poses_text(records: &[PoseRecord]) -> Result<Vec<u8>, Error> {
    let text = |get: fn(&PoseRecord) -> &Option<String>| {
        records
            .iter()
            .map(|r| get(r).clone().unwrap_or_default())
            .collect()
    };
    let number = |decimals: usize, get: fn(&PoseRecord) -> f64| {
        records.iter().map(|r| fixed(get(r), decimals)).collect()
    };
    let sigma = |decimals: usize, get: fn(PoseSigma) -> f64| {
        let one = |r: &PoseRecord| r.sigma.map_or(String::new(), |s| fixed(get(s), decimals));
        records.iter().map(one).collect()
    };
    let times: Result<Vec<String>, Error> = records.iter().map(|r| time_text(r.time_s)).collect();
    let mut columns: Vec<(&str, Vec<String>)> = vec![
        ("image_id", text(|r| &r.image_id)),
        ("camera", text(|r| &r.camera)),
        ("path", text(|r| &r.path)),
        ("platform", text(|r| &r.platform)),
        ("time", times?),
    ];
    columns.retain(|(_, values)| values.iter().any(|v| !v.is_empty()));
    columns.push(("lat_deg", number(10, |r| r.place.lat_deg())));
    columns.push(("lon_deg", number(10, |r| r.place.lon_deg())));
    columns.push(("alt_m", number(5, |r| r.place.height_m)));
    columns.push(("qw", number(10, |r| r.attitude.scalar_first()[0])));
    columns.push(("qx", number(10, |r| r.attitude.scalar_first()[1])));
    columns.push(("qy", number(10, |r| r.attitude.scalar_first()[2])));
    columns.push(("qz", number(10, |r| r.attitude.scalar_first()[3])));
    if records.iter().any(|r| r.sigma.is_some()) {
        columns.push(("sigma_e_m", sigma(5, |s| s.east_m)));
        columns.push(("sigma_n_m", sigma(5, |s| s.north_m)));
        columns.push(("sigma_u_m", sigma(5, |s| s.up_m)));
        columns.push(("sigma_roll_deg", sigma(5, |s| s.roll.to_degrees())));
        columns.push(("sigma_pitch_deg", sigma(5, |s| s.pitch.to_degrees())));
        columns.push(("sigma_yaw_deg", sigma(5, |s| s.yaw.to_degrees())));
    }
    rows_text(&columns)
}

/// Writes `images.csv`.
///
/// # Errors
/// As [`write_poses`].
pub fn write_images(path: &Path, records: &[ImageRecord]) -> Result<(), Error> {
    let column = |get: &dyn Fn(&ImageRecord) -> String| records.iter().map(get).collect();
    let times: Result<Vec<String>, Error> = records.iter().map(|r| format_time(r.time_s)).collect();
    let angle = |a: Option<f64>| a.map_or(String::new(), |a| fixed(a.to_degrees(), 6));
    let mut columns: Vec<(&str, Vec<String>)> = vec![
        ("image_id", column(&|r| r.image_id.clone())),
        ("time", times?),
        ("camera", column(&|r| r.camera.clone())),
        ("path", column(&|r| r.path.clone())),
    ];
    let optional: [(&str, Vec<String>); 3] = [
        (
            "platform",
            column(&|r| r.platform.clone().unwrap_or_default()),
        ),
        ("pan_deg", column(&|r| angle(r.pan))),
        ("tilt_deg", column(&|r| angle(r.tilt))),
    ];
    columns.extend(
        optional
            .into_iter()
            .filter(|(_, values)| values.iter().any(|v| !v.is_empty())),
    );
    write_rows(path, &columns)
}

/// A number with fixed decimals, without a minus before zero.
fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    if text.starts_with('-') && text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.')) {
        text[1..].to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(image_id: Option<&str>, time_s: Option<f64>) -> PoseRecord {
        PoseRecord {
            image_id: image_id.map(str::to_owned),
            camera: None,
            path: None,
            platform: None,
            time_s,
            place: Geodetic::from_degrees(-24.45, -69.93, 1002.0),
            attitude: Rotation::identity(),
            sigma: None,
        }
    }

    #[test]
    fn only_columns_with_values_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.csv");
        let mut first = pose(Some("a,b"), None);
        first.sigma = Some(PoseSigma {
            east_m: 0.05,
            north_m: 0.05,
            up_m: 0.02,
            roll: 0.0,
            pitch: 0.0,
            yaw: 0.4f64.to_radians(),
        });
        write_poses(&path, &[first, pose(Some("c"), None)]).unwrap();
        assert_eq!(
            std::fs::read_to_string(path).unwrap(),
            "image_id,lat_deg,lon_deg,alt_m,qw,qx,qy,qz,\
             sigma_e_m,sigma_n_m,sigma_u_m,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg\n\
             \"a,b\",-24.4500000000,-69.9300000000,1002.00000,\
             1.0000000000,0.0000000000,0.0000000000,0.0000000000,\
             0.05000,0.05000,0.02000,0.00000,0.00000,0.40000\n\
             c,-24.4500000000,-69.9300000000,1002.00000,\
             1.0000000000,0.0000000000,0.0000000000,0.0000000000,,,,,,\n"
        );
    }

    #[test]
    fn times_are_rfc_3339() {
        assert_eq!(
            format_time(1_128_870_000.25).unwrap(),
            "2005-10-09T15:00:00.250Z"
        );
        assert_eq!(
            format_time(1e18).unwrap_err().to_string(),
            "found time 1000000000000000000, expected one in the calendar"
        );
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(fixed(-1e-12, 3), "0.000");
        assert_eq!(fixed(-0.001, 3), "-0.001");
    }

    #[test]
    fn images_carry_pan_only_where_there_is_a_head() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("images.csv");
        let mut image = ImageRecord {
            image_id: "r_0000".to_owned(),
            time_s: 0.0,
            camera: "mast".to_owned(),
            path: String::new(),
            platform: None,
            pan: None,
            tilt: None,
        };
        write_images(&path, std::slice::from_ref(&image)).unwrap();
        let bare = "image_id,time,camera,path\nr_0000,1970-01-01T00:00:00.000Z,mast,\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), bare);
        image.pan = Some(-30f64.to_radians());
        write_images(&path, &[image]).unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            "image_id,time,camera,path,pan_deg\nr_0000,1970-01-01T00:00:00.000Z,mast,,-30.000000\n"
        );
    }
}
