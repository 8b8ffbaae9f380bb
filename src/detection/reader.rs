//! detections.csv: boxes, points, ranges with bearing or azimuth.

use std::path::Path;

use super::{Detection, Mark, MarkSigma, PixelBox, coco, voc};
use crate::error::{Error, Fault};
use crate::frame::Pixel;
use crate::input::{Reject, Row, Table, first_character, text};

/// What a detections.csv holds.
#[derive(Debug)]
pub struct DetectionFile {
    /// The rows that could be read, in the order of the file.
    pub detections: Vec<Detection>,
    /// The rows that could not.
    pub rejects: Vec<Reject>,
    /// Columns that mean nothing here.
    pub unknown_columns: Vec<String>,
    /// Whether the file can give an azimuth, the one mark that needs no heading.
    pub has_azimuth: bool,
}

const BOX: [&str; 4] = ["x_min", "y_min", "x_max", "y_max"];
const POINT: [&str; 2] = ["u_px", "v_px"];
const KNOWN: [&str; 18] = [
    "image_id",
    "det_id",
    "class",
    "score",
    "diameter_m",
    "x_min",
    "y_min",
    "x_max",
    "y_max",
    "u_px",
    "v_px",
    "azimuth_deg",
    "bearing_deg",
    "range_m",
    "sigma_u_px",
    "sigma_v_px",
    "sigma_range_m",
    "sigma_bearing_deg",
];

/// Which kinds of mark a file's columns can give; where one file mixes them, a row is what its
/// non-empty fields make it.
#[derive(Clone, Copy)]
struct Kinds {
    boxes: bool,
    points: bool,
    azimuths: bool,
    bearings: bool,
}

/// Reads the `file`-th detections of the run: detections.csv, annotations or results of COCO (JSON),
/// or an annotation of Pascal VOC (XML), which the content tells.
///
/// # Errors
/// A file that cannot be read, or a missing column; bad rows are set aside in the result.
pub fn read_detections(path: &Path, shown: &str, file: usize) -> Result<DetectionFile, Error> {
    match first_character(path)? {
        Some('{' | '[') => return coco::read(&text(path, shown)?, shown, file),
        Some('<') => return voc::read(&text(path, shown)?, shown, file),
        _ => {}
    }
    let mut table = Table::open(path, shown)?;
    table.require(&["image_id", "det_id"])?;
    let kinds = kinds(&table)?;
    let mut read = DetectionFile {
        detections: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: table.unknown(&KNOWN),
        has_azimuth: kinds.azimuths,
    };
    while let Some(row) = table.next_row() {
        let record = row.as_ref().map(key).unwrap_or_default();
        match row.and_then(|row| detection(&row, kinds, file)) {
            Ok(detection) => read.detections.push(detection),
            Err(fault) => read.rejects.push(Reject::from_fault(fault, record)),
        }
    }
    Ok(read)
}

fn key(row: &Row<'_>) -> String {
    let (image, det) = (row.text("image_id"), row.text("det_id"));
    format!("{}/{}", image.unwrap_or(""), det.unwrap_or(""))
}

fn kinds(table: &Table) -> Result<Kinds, Fault> {
    let any = |columns: &[&str]| columns.iter().any(|c| table.has(c));
    let kinds = Kinds {
        boxes: any(&BOX),
        points: any(&POINT),
        azimuths: table.has("azimuth_deg"),
        bearings: table.has("bearing_deg"),
    };
    if kinds.boxes {
        table.require(&BOX)?;
    }
    if kinds.points {
        table.require(&POINT)?;
    }
    if kinds.azimuths || kinds.bearings {
        table.require(&["range_m"])?;
    }
    if !(kinds.boxes || kinds.points || kinds.azimuths || kinds.bearings) {
        let expected = "columns x_min, y_min, x_max, y_max or u_px, v_px \
                        or azimuth_deg or bearing_deg with range_m";
        return Err(table.missing("x_min", expected));
    }
    Ok(kinds)
}

fn detection(row: &Row<'_>, kinds: Kinds, file: usize) -> Result<Detection, Fault> {
    let mark = mark(row, kinds)?;
    let range_m = row.number_above_zero("range_m", true)?;
    if range_m.is_none() && matches!(mark, Mark::Azimuth(_) | Mark::Bearing(_)) {
        return Err(row.fault("range_m", "nothing", "a number"));
    }
    let bearing_deg = row.number_above_zero("sigma_bearing_deg", true)?;
    Ok(Detection {
        image_id: row.required_text("image_id")?.to_owned(),
        det_id: row.required_text("det_id")?.to_owned(),
        class: row.text("class").map(str::to_owned),
        score: row.number_within("score", 0.0, 1.0)?,
        diameter_m: row.number_above_zero("diameter_m", true)?,
        mark,
        range_m,
        sigma: MarkSigma {
            u_px: row.number_above_zero("sigma_u_px", true)?,
            v_px: row.number_above_zero("sigma_v_px", true)?,
            range_m: row.number_above_zero("sigma_range_m", true)?,
            bearing: bearing_deg.map(f64::to_radians),
        },
        file,
        line: row.line(),
    })
}

fn mark(row: &Row<'_>, kinds: Kinds) -> Result<Mark, Fault> {
    let given = |columns: &[&str]| columns.iter().any(|c| row.text(c).is_some());
    if kinds.boxes && given(&BOX) {
        return pixel_box(row).map(Mark::Box);
    }
    if kinds.points && given(&POINT) {
        let (u, v) = (row.required_number("u_px")?, row.required_number("v_px")?);
        return Ok(Mark::Point(Pixel::new(u, v)));
    }
    if let Some(azimuth) = row.number_within("azimuth_deg", -360.0, 360.0)? {
        return Ok(Mark::Azimuth(azimuth.to_radians()));
    }
    if let Some(bearing) = row.number_within("bearing_deg", -360.0, 360.0)? {
        return Ok(Mark::Bearing(bearing.to_radians()));
    }
    let column = match kinds {
        Kinds { boxes: true, .. } => BOX[0],
        Kinds { points: true, .. } => POINT[0],
        Kinds { azimuths: true, .. } => "azimuth_deg",
        Kinds { .. } => "bearing_deg",
    };
    Err(row.fault(column, "nothing", "a number"))
}

fn pixel_box(row: &Row<'_>) -> Result<PixelBox, Fault> {
    let b = PixelBox {
        x_min: row.required_number("x_min")?,
        y_min: row.required_number("y_min")?,
        x_max: row.required_number("x_max")?,
        y_max: row.required_number("y_max")?,
    };
    for (column, low, high) in [("x_max", b.x_min, b.x_max), ("y_max", b.y_min, b.y_max)] {
        if high <= low {
            let other = column.replace("max", "min");
            return Err(row.fault(column, high, format!("more than {other}, {low}")));
        }
    }
    Ok(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::Aim;

    fn read(text: &str) -> Result<DetectionFile, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.csv");
        std::fs::write(&path, text).unwrap();
        read_detections(&path, "detections.csv", 0)
    }

    #[test]
    fn every_kind_of_mark() {
        let file = read(
            "image_id,det_id,x_min,y_min,x_max,y_max,u_px,v_px,bearing_deg,azimuth_deg,range_m,sigma_range_m\n\
             a,0,1,2,5,10,,,,,,\n\
             a,1,,,,,3,4,,,7.5,\n\
             a,2,,,,,,,90,,2,0.1\n\
             a,3,,,,,,,,180,2,\n",
        )
        .unwrap();
        assert!(file.rejects.is_empty());
        let marks: Vec<Mark> = file.detections.iter().map(|d| d.mark).collect();
        assert_eq!(marks[1], Mark::Point(Pixel::new(3.0, 4.0)));
        assert_eq!(marks[2], Mark::Bearing(90f64.to_radians()));
        assert_eq!(marks[3], Mark::Azimuth(180f64.to_radians()));
        assert_eq!(file.detections[1].range_m, Some(7.5));
        assert_eq!(file.detections[2].sigma.range_m, Some(0.1));
        let first = &file.detections[0];
        assert_eq!(first.aim_point(Aim::CENTER), Some(Pixel::new(3.0, 6.0)));
        assert_eq!(first.aim_point(Aim::BOTTOM), Some(Pixel::new(3.0, 10.0)));
        assert_eq!(
            first.aim_point(Aim::HeightShare(0.75)),
            Some(Pixel::new(3.0, 8.0))
        );
    }

    #[test]
    fn bad_rows_are_set_aside_with_their_reason() {
        let file = read(
            "image_id,det_id,score,x_min,y_min,x_max,y_max\n\
             a,0,1.83,1,2,5,10\n\
             a,1,0.5,1,2,1,10\n\
             a,2,0.5,1,2,,10\n\
             a,3,0.5,,,,\n\
             ,4,0.5,1,2,5,10\n\
             a,5,0.5,1,2,5,10\n",
        )
        .unwrap();
        let details: Vec<String> = file.rejects.iter().map(Reject::to_string).collect();
        assert_eq!(
            details,
            [
                "detections.csv:2: score: found 1.83, expected 0 to 1",
                "detections.csv:3: x_max: found 1, expected more than x_min, 1",
                "detections.csv:4: x_max: found nothing, expected a number",
                "detections.csv:5: x_min: found nothing, expected a number",
                "detections.csv:6: image_id: found nothing, expected a value",
            ]
        );
        assert_eq!(file.rejects[0].record, "a/0");
        assert_eq!(file.detections.len(), 1);
    }

    #[test]
    fn missing_columns_are_fatal() {
        let error = read("image_id,det_id,range_m\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "detections.csv:1: x_min: found columns image_id, det_id, range_m, expected columns \
             x_min, y_min, x_max, y_max or u_px, v_px or azimuth_deg or bearing_deg with range_m"
        );
        let error = read("image_id,det_id,bearing_deg\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "detections.csv:1: range_m: found columns image_id, det_id, bearing_deg, \
             expected a column range_m"
        );
    }
}
