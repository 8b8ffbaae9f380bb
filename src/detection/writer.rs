//! Writes `detections.csv`, with fixed decimals, so that the same detections are the same bytes.

use std::path::Path;

use crate::error::Error;
use crate::input::write_rows;

/// One row of `detections.csv`. An optional column is written where at least one record has a
/// value for it.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionRecord {
    /// The image it was made in.
    pub image_id: String,
    /// Its name within the file.
    pub det_id: String,
    /// What was detected.
    pub class: Option<String>,
    /// The detector's confidence, 0 to 1.
    pub score: Option<f64>,
    /// The detector's own size estimate, metres.
    pub diameter_m: Option<f64>,
    /// Where it is in the picture, or in which direction.
    pub measurement: MeasurementRecord,
    /// Slant distance from the camera's centre, metres.
    pub range_m: Option<f64>,
}

/// Where a detection is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeasurementRecord {
    /// A box, its edges in raw pixels.
    Box {
        /// Left edge.
        x_min: f64,
        /// Upper edge.
        y_min: f64,
        /// Right edge.
        x_max: f64,
        /// Lower edge.
        y_max: f64,
    },
    /// A place in the raw picture.
    Point {
        /// Column, pixels.
        u_px: f64,
        /// Row, pixels.
        v_px: f64,
    },
    /// An angle clockwise from the body's forward axis, radians.
    Bearing(f64),
    /// An angle clockwise from true north, radians.
    Azimuth(f64),
}

impl MeasurementRecord {
    /// The value of a column, where this kind of measurement has it.
    fn value(&self, column: &str) -> Option<f64> {
        match (*self, column) {
            (Self::Box { x_min, .. }, "x_min") => Some(x_min),
            (Self::Box { y_min, .. }, "y_min") => Some(y_min),
            (Self::Box { x_max, .. }, "x_max") => Some(x_max),
            (Self::Box { y_max, .. }, "y_max") => Some(y_max),
            (Self::Point { u_px, .. }, "u_px") => Some(u_px),
            (Self::Point { v_px, .. }, "v_px") => Some(v_px),
            (Self::Bearing(a), "bearing_deg") | (Self::Azimuth(a), "azimuth_deg") => {
                Some(a.to_degrees())
            }
            _ => None,
        }
    }
}

/// Writes `detections.csv`: pixels with 3 decimals, angles with 6, scores and metres with 4.
///
/// # Errors
/// A file that cannot be written.
pub fn write_detections(path: &Path, records: &[DetectionRecord]) -> Result<(), Error> {
    let text = |get: &dyn Fn(&DetectionRecord) -> String| records.iter().map(get).collect();
    let number = |decimals: usize, get: &dyn Fn(&DetectionRecord) -> Option<f64>| {
        let one = |r: &DetectionRecord| get(r).map_or(String::new(), |x| format!("{x:.decimals$}"));
        records.iter().map(one).collect()
    };
    let mut columns: Vec<(&str, Vec<String>)> = vec![
        ("image_id", text(&|r| r.image_id.clone())),
        ("det_id", text(&|r| r.det_id.clone())),
        ("class", text(&|r| r.class.clone().unwrap_or_default())),
        ("score", number(4, &|r| r.score)),
        ("diameter_m", number(4, &|r| r.diameter_m)),
    ];
    for (column, decimals) in [
        ("x_min", 3),
        ("y_min", 3),
        ("x_max", 3),
        ("y_max", 3),
        ("u_px", 3),
        ("v_px", 3),
        ("bearing_deg", 6),
        ("azimuth_deg", 6),
    ] {
        columns.push((column, number(decimals, &|r| r.measurement.value(column))));
    }
    columns.push(("range_m", number(4, &|r| r.range_m)));
    let is_key = |column: &str| matches!(column, "image_id" | "det_id");
    columns.retain(|(name, values)| is_key(name) || values.iter().any(|v| !v.is_empty()));
    // A file without detections still says what its columns would be.
    if records.is_empty() {
        columns.extend(["x_min", "y_min", "x_max", "y_max"].map(|name| (name, Vec::new())));
    }
    write_rows(path, &columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(det_id: &str, measurement: MeasurementRecord) -> DetectionRecord {
        DetectionRecord {
            image_id: "r_0000".to_owned(),
            det_id: det_id.to_owned(),
            class: Some("rock".to_owned()),
            score: Some(0.5),
            diameter_m: None,
            measurement,
            range_m: None,
        }
    }

    fn written(records: &[DetectionRecord]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("detections.csv");
        write_detections(&path, records).unwrap();
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn boxes_are_written_as_boxes() {
        let measurement = MeasurementRecord::Box {
            x_min: -3.25,
            y_min: 1.0,
            x_max: 20.0,
            y_max: 9.0,
        };
        assert_eq!(
            written(&[record("0", measurement)]),
            "image_id,det_id,class,score,x_min,y_min,x_max,y_max\n\
             r_0000,0,rock,0.5000,-3.250,1.000,20.000,9.000\n"
        );
    }

    #[test]
    fn bearings_are_written_in_degrees_with_their_range() {
        let mut bearing = record("0", MeasurementRecord::Bearing(-0.5f64.to_radians()));
        bearing.range_m = Some(4.5);
        assert_eq!(
            written(&[bearing]),
            "image_id,det_id,class,score,bearing_deg,range_m\nr_0000,0,rock,0.5000,-0.500000,4.5000\n"
        );
    }

    #[test]
    fn a_file_without_detections_has_a_header() {
        assert_eq!(written(&[]), "image_id,det_id,x_min,y_min,x_max,y_max\n");
    }
}
