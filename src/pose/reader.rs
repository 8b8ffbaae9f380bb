//! poses.csv in all its variants.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};

use super::lines::{self, LogFormat};
use super::{Attitude, PoseKey, PoseRow, Position, Time, colmap, odometry, tum};
use crate::error::{Error, Fault};
use crate::frame::{Crs, Geodetic, Planet, Point};
use crate::input::{Reject, Row, Table, text};

/// What a poses.csv holds.
#[derive(Debug)]
pub struct PoseFile {
    /// The rows that could be read, in the order of the file.
    pub rows: Vec<PoseRow>,
    /// The rows that could not.
    pub rejects: Vec<Reject>,
    /// Columns that mean nothing here.
    pub unknown_columns: Vec<String>,
    /// Whether the key is the image, rather than the time.
    pub is_per_image: bool,
    /// Whether positions are offsets in the site's ENU, which needs an origin named in the run.
    pub is_local: bool,
    /// Whether the file carries attitudes.
    pub has_attitude: bool,
}

const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
const ANGLES: [&str; 3] = ["roll_deg", "pitch_deg", "yaw_deg"];
const SIGMAS: [&str; 6] = [
    "sigma_e_m",
    "sigma_n_m",
    "sigma_u_m",
    "sigma_roll_deg",
    "sigma_pitch_deg",
    "sigma_yaw_deg",
];
const KNOWN: [&str; 29] = [
    "time",
    "image_id",
    "camera",
    "path",
    "platform",
    "pan_deg",
    "tilt_deg",
    "lat_deg",
    "lon_deg",
    "alt_m",
    "easting_m",
    "northing_m",
    "height_m",
    "x_m",
    "y_m",
    "z_m",
    "qw",
    "qx",
    "qy",
    "qz",
    "roll_deg",
    "pitch_deg",
    "yaw_deg",
    "sigma_e_m",
    "sigma_n_m",
    "sigma_u_m",
    "sigma_roll_deg",
    "sigma_pitch_deg",
    "sigma_yaw_deg",
];

/// Which columns give the position.
#[derive(Clone, Copy, PartialEq)]
enum Positions<'a> {
    Geodetic(Planet),
    Grid(&'a Crs),
    Local,
}

/// Which columns give the attitude.
#[derive(Clone, Copy, PartialEq)]
enum Attitudes {
    Quaternion,
    Angles,
    Yaw,
    None,
}

/// Reads poses.csv, or one of the other logs that the content tells: a trajectory of the TUM
/// benchmarks, images.txt of COLMAP, a table of a ROS odometry topic. Latitudes and longitudes are as
/// the planet's files have them; `crs` is the one easting and northing columns are in, if the run
/// names one. Headings and heights are as logged: [`PoseFile::refer`] puts them into true north and
/// above the ellipsoid.
///
/// # Errors
/// A file that cannot be read, a missing column, or a set of columns that is none of the variants;
/// bad rows are set aside in the result.
pub fn read_poses(
    path: &Path,
    shown: &str,
    planet: Planet,
    crs: Option<&Crs>,
) -> Result<PoseFile, Error> {
    match lines::recognise(path)? {
        Some(LogFormat::Tum) => return Ok(tum::read(&text(path, shown)?, shown)),
        Some(LogFormat::Colmap) => return Ok(colmap::read(&text(path, shown)?, shown)),
        Some(LogFormat::Odometry) => return odometry::read(path, shown),
        None => {}
    }
    let mut table = Table::open(path, shown)?;
    let is_per_image = table.has("image_id");
    if !is_per_image && !table.has("time") {
        return Err(table.missing("time", "a column time or image_id").into());
    }
    let positions = positions(&table, planet, crs)?;
    let attitudes = attitudes(&table)?;
    let mut file = PoseFile {
        rows: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: table.unknown(&KNOWN),
        is_per_image,
        is_local: positions == Positions::Local,
        has_attitude: attitudes != Attitudes::None,
    };
    while let Some(row) = table.next_row() {
        let record = match &row {
            Ok(row) => row
                .text(if is_per_image { "image_id" } else { "time" })
                .unwrap_or("")
                .to_owned(),
            Err(_) => String::new(),
        };
        match row.and_then(|row| pose_row(&row, is_per_image, positions, attitudes)) {
            Ok(row) => file.rows.push(row),
            Err(fault) => file.rejects.push(Reject::from_fault(fault, record)),
        }
    }
    Ok(file)
}

fn positions<'a>(
    table: &Table,
    planet: Planet,
    crs: Option<&'a Crs>,
) -> Result<Positions<'a>, Fault> {
    if table.has("lat_deg") || table.has("lon_deg") {
        table.require(&["lat_deg", "lon_deg"])?;
        return Ok(Positions::Geodetic(planet));
    }
    if table.has("easting_m") || table.has("northing_m") {
        table.require(&["easting_m", "northing_m"])?;
        return crs.map(Positions::Grid).ok_or_else(|| {
            table.missing(
                "easting_m",
                "site.crs in the run, to say what eastings and northings are in",
            )
        });
    }
    if table.has("x_m") || table.has("y_m") {
        table.require(&["x_m", "y_m"])?;
        return Ok(Positions::Local);
    }
    let expected = "columns lat_deg, lon_deg or easting_m, northing_m or x_m, y_m";
    Err(table.missing("lat_deg", expected))
}

fn attitudes(table: &Table) -> Result<Attitudes, Fault> {
    if QUATERNION.iter().any(|c| table.has(c)) {
        table.require(&QUATERNION)?;
        return Ok(Attitudes::Quaternion);
    }
    if table.has("roll_deg") || table.has("pitch_deg") {
        table.require(&ANGLES)?;
        return Ok(Attitudes::Angles);
    }
    Ok(if table.has("yaw_deg") {
        Attitudes::Yaw
    } else {
        Attitudes::None
    })
}

fn pose_row(
    row: &Row<'_>,
    is_per_image: bool,
    positions: Positions<'_>,
    attitudes: Attitudes,
) -> Result<PoseRow, Fault> {
    Ok(PoseRow {
        line: row.line(),
        key: key(row, is_per_image)?,
        platform: row.text("platform").map(str::to_owned),
        position: position(row, positions)?,
        attitude: attitude(row, attitudes)?,
        sigma: sigma(row)?,
    })
}

/// The instant in a row's `time`, if it has one.
pub(crate) fn time(row: &Row<'_>) -> Result<Option<Time>, Fault> {
    let expected = "RFC 3339, or seconds since 1970 as a decimal";
    match row.text("time") {
        None => Ok(None),
        Some(text) => Time::parse(text)
            .map(Some)
            .ok_or_else(|| row.fault("time", format!("{text:?}"), expected)),
    }
}

fn key(row: &Row<'_>, is_per_image: bool) -> Result<PoseKey, Fault> {
    if !is_per_image {
        row.required_text("time")?;
        let instant = time(row)?;
        return instant
            .map(PoseKey::Time)
            .ok_or_else(|| row.fault("time", "nothing", "a value"));
    }
    Ok(PoseKey::Image {
        image_id: row.required_text("image_id")?.to_owned(),
        time: time(row)?,
        camera: row.text("camera").map(str::to_owned),
        path: row.text("path").map(str::to_owned),
        pan_tilt: pan_tilt(row)?,
    })
}

/// Pan and tilt of a head, radians; zero where the columns are absent or empty.
pub(crate) fn pan_tilt(row: &Row<'_>) -> Result<[f64; 2], Fault> {
    let pan = row.number_within("pan_deg", -360.0, 360.0)?.unwrap_or(0.0);
    let tilt = row.number_within("tilt_deg", -180.0, 180.0)?.unwrap_or(0.0);
    Ok([pan.to_radians(), tilt.to_radians()])
}

fn position(row: &Row<'_>, positions: Positions<'_>) -> Result<Position, Fault> {
    match positions {
        Positions::Geodetic(planet) => {
            let lat = required_within(row, "lat_deg", -90.0, 90.0)?;
            let lon = required_within(row, "lon_deg", -180.0, 360.0)?;
            let alt = row.number("alt_m")?.unwrap_or(0.0);
            Ok(Position::Geodetic(planet.place(lat, lon, alt)))
        }
        Positions::Grid(crs) => {
            let easting = row.required_number("easting_m")?;
            let northing = row.required_number("northing_m")?;
            let height_m = row.number("height_m")?.unwrap_or(0.0);
            let (lon, lat) = crs.lon_lat(easting, northing).map_err(|_| {
                let place = format!("({easting}, {northing})");
                row.fault(
                    "easting_m",
                    place,
                    format!("a place in {}", crs.definition()),
                )
            })?;
            Ok(Position::Geodetic(Geodetic { lat, lon, height_m }))
        }
        Positions::Local => Ok(Position::Site(Point::new(
            row.required_number("x_m")?,
            row.required_number("y_m")?,
            row.number("z_m")?.unwrap_or(0.0),
        ))),
    }
}

fn required_within(row: &Row<'_>, column: &str, low: f64, high: f64) -> Result<f64, Fault> {
    row.number_within(column, low, high)?
        .ok_or_else(|| row.fault(column, "nothing", "a number"))
}

fn attitude(row: &Row<'_>, attitudes: Attitudes) -> Result<Attitude, Fault> {
    match attitudes {
        Attitudes::Quaternion => {
            let mut q = [0.0; 4];
            for (value, column) in q.iter_mut().zip(QUATERNION) {
                *value = row.required_number(column)?;
            }
            quaternion(row, q)
        }
        Attitudes::Angles => {
            let mut angles = [0.0; 3];
            for (value, column) in angles.iter_mut().zip(ANGLES) {
                *value = required_within(row, column, -360.0, 360.0)?.to_radians();
            }
            let [roll, pitch, yaw] = angles;
            Ok(Attitude::from_roll_pitch_yaw(roll, pitch, yaw))
        }
        Attitudes::Yaw => {
            let yaw = required_within(row, "yaw_deg", -360.0, 360.0)?;
            Ok(Attitude::from_roll_pitch_yaw(0.0, 0.0, yaw.to_radians()))
        }
        Attitudes::None => Ok(Attitude::Level),
    }
}

/// A logged quaternion may be off unit length by rounding; more than that is another quantity.
fn quaternion(row: &Row<'_>, [w, x, y, z]: [f64; 4]) -> Result<Attitude, Fault> {
    let q = Quaternion::new(w, x, y, z);
    let norm = q.norm();
    if norm < 1e-9 {
        return Err(row.fault("qw", "a quaternion of zero length", "a unit quaternion"));
    }
    if (norm - 1.0).abs() > 0.01 {
        let found = format!("a quaternion of length {norm:.4}");
        return Err(row.fault("qw", found, "a unit quaternion"));
    }
    Ok(Attitude::Measured(UnitQuaternion::from_quaternion(q)))
}

fn sigma(row: &Row<'_>) -> Result<[Option<f64>; 6], Fault> {
    let mut sigma = [None; 6];
    for (index, column) in SIGMAS.into_iter().enumerate() {
        let value = row.number_above_zero(column, false)?;
        let is_angle = column.ends_with("_deg");
        sigma[index] = value.map(|x| if is_angle { x.to_radians() } else { x });
    }
    Ok(sigma)
}
