//! Reads what is known of the truth: objects, places to ignore, and which detection is which.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::error::{Error, Fault, Place};
use crate::frame::Geodetic;
use crate::input::{Row, Table};

/// One true object.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueObject {
    /// Its name.
    pub object_id: String,
    /// What it is, where the file says.
    pub class: Option<String>,
    /// Where it is; the height is zero where the file gives none.
    pub place: Geodetic,
    /// In how many detections it appears, where the file says.
    pub n_detections: Option<f64>,
}

/// A place where a mapped object is neither right nor wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct IgnoredPlace {
    /// The class it holds for; every class where there is none.
    pub class: Option<String>,
    /// Where it is; heights play no part.
    pub place: Geodetic,
}

/// What names a detection.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct DetectionKey {
    /// The image; empty where `det_id` alone names a detection.
    pub image_id: String,
    /// The detection.
    pub det_id: String,
}

/// The true object of every labelled detection.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    /// The name faults call the file by.
    pub file: String,
    /// Object by detection; `None` where the detection is known to be of no object (clutter).
    pub object_of: BTreeMap<DetectionKey, Option<String>>,
    /// Whether keys hold the image.
    pub by_image: bool,
}

/// The memberships of detections in mapped objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evidence {
    /// The name faults call the file by.
    pub file: String,
    /// The memberships, in the order of the file.
    pub memberships: Vec<Membership>,
    /// Whether keys hold the image.
    pub by_image: bool,
}

/// One membership of a detection in a mapped object.
#[derive(Debug, Clone, PartialEq)]
pub struct Membership {
    /// The mapped object.
    pub rock_id: String,
    /// The detection.
    pub detection: DetectionKey,
    /// The probability that the detection is of this object.
    pub weight: f64,
}

/// Reads truth.csv: `object_id, class, lat_deg, lon_deg`, optional `alt_m, n_detections`.
///
/// # Errors
/// A file that cannot be read, a missing column, and every row at fault.
pub fn read_truth(path: &Path, shown: &str) -> Result<Vec<TrueObject>, Error> {
    truth_of(Table::open(path, shown)?)
}

/// Reads ignore.csv: `class, lat_deg, lon_deg`.
///
/// # Errors
/// As [`read_truth`].
pub fn read_ignored(path: &Path, shown: &str) -> Result<Vec<IgnoredPlace>, Error> {
    ignored_of(Table::open(path, shown)?)
}

/// Reads labels.csv: `det_id, object_id`, and `image_id` where `det_id` repeats. An empty
/// `object_id` says that the detection is of no object.
///
/// # Errors
/// As [`read_truth`], and a detection that stands twice.
pub fn read_labels(path: &Path, shown: &str) -> Result<Labels, Error> {
    labels_of(Table::open(path, shown)?)
}

/// Reads evidence.csv: `rock_id, det_id`, optional `image_id, weight` (1 where absent).
///
/// # Errors
/// As [`read_truth`].
pub fn read_evidence(path: &Path, shown: &str) -> Result<Evidence, Error> {
    evidence_of(Table::open(path, shown)?)
}

fn truth_of(table: Table) -> Result<Vec<TrueObject>, Error> {
    let whole = Place::file(table.file());
    let mut known = BTreeSet::new();
    let required = ["object_id", "class", "lat_deg", "lon_deg"];
    let objects = rows(table, &required, |row| {
        let object_id = row.required_text("object_id")?.to_owned();
        if !known.insert(object_id.clone()) {
            return Err(row.fault("object_id", format!("{object_id} again"), "it once"));
        }
        let n_detections = row.number_above_zero("n_detections", false)?;
        let mut place = place(row)?;
        place.height_m = row.number("alt_m")?.unwrap_or(0.0);
        Ok(TrueObject {
            object_id,
            class: row.text("class").map(str::to_owned),
            place,
            n_detections,
        })
    })?;
    if objects.is_empty() {
        return Err(Fault::found(whole, "", "no objects", "at least one").into());
    }
    Ok(objects)
}

fn ignored_of(table: Table) -> Result<Vec<IgnoredPlace>, Error> {
    rows(table, &["class", "lat_deg", "lon_deg"], |row| {
        Ok(IgnoredPlace {
            class: row.text("class").map(str::to_owned),
            place: place(row)?,
        })
    })
}

fn labels_of(table: Table) -> Result<Labels, Error> {
    let (file, by_image) = (table.file().to_owned(), table.has("image_id"));
    let mut object_of = BTreeMap::new();
    rows(table, &["det_id", "object_id"], |row| {
        let key = detection(row, by_image)?;
        let object = row.text("object_id").map(str::to_owned);
        if object_of.insert(key.clone(), object).is_some() {
            let found = format!("{} again", key.det_id);
            let expected = if by_image {
                "it once an image"
            } else {
                "it once, or a column image_id"
            };
            return Err(row.fault("det_id", found, expected));
        }
        Ok(())
    })?;
    Ok(Labels {
        file,
        object_of,
        by_image,
    })
}

fn evidence_of(table: Table) -> Result<Evidence, Error> {
    let (file, by_image) = (table.file().to_owned(), table.has("image_id"));
    let memberships = rows(table, &["rock_id", "det_id"], |row| {
        Ok(Membership {
            rock_id: row.required_text("rock_id")?.to_owned(),
            detection: detection(row, by_image)?,
            weight: row.number_within("weight", 0.0, 1.0)?.unwrap_or(1.0),
        })
    })?;
    Ok(Evidence {
        file,
        memberships,
        by_image,
    })
}

/// All rows of a table, or all of their faults.
fn rows<T>(
    mut table: Table,
    required: &[&str],
    mut read: impl FnMut(&Row<'_>) -> Result<T, Fault>,
) -> Result<Vec<T>, Error> {
    table.require(required)?;
    let (mut records, mut faults) = (Vec::new(), Vec::new());
    while let Some(row) = table.next_row() {
        match row.and_then(|row| read(&row)) {
            Ok(record) => records.push(record),
            Err(fault) => faults.push(fault),
        }
    }
    Error::check(faults)?;
    Ok(records)
}

fn place(row: &Row<'_>) -> Result<Geodetic, Fault> {
    let within = |column, low, high| {
        row.required_number(column)?;
        row.number_within(column, low, high)
    };
    let lat_deg = within("lat_deg", -90.0, 90.0)?.unwrap_or_default();
    let lon_deg = within("lon_deg", -360.0, 360.0)?.unwrap_or_default();
    Ok(Geodetic::from_degrees(lat_deg, lon_deg, 0.0))
}

fn detection(row: &Row<'_>, by_image: bool) -> Result<DetectionKey, Fault> {
    let image_id = if by_image {
        row.required_text("image_id")?.to_owned()
    } else {
        String::new()
    };
    Ok(DetectionKey {
        image_id,
        det_id: row.required_text("det_id")?.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str, name: &str) -> Table {
        Table::from_bytes(text.as_bytes(), name).unwrap()
    }

    #[test]
    fn truth_is_read_with_and_without_its_optional_columns() {
        let full = "object_id,class,lat_deg,lon_deg,alt_m,n_detections,more\n\
                    a,rock,49,8.4,115.5,3,x\nb,,49.1,8.5,,,\n";
        let truth = truth_of(table(full, "truth.csv")).unwrap();
        assert_eq!(truth[0].place, Geodetic::from_degrees(49.0, 8.4, 115.5));
        assert_eq!(truth[0].class.as_deref(), Some("rock"));
        assert_eq!(truth[0].n_detections, Some(3.0));
        assert_eq!((&truth[1].class, truth[1].n_detections), (&None, None));
        assert_eq!(truth[1].place.height_m, 0.0);
    }

    #[test]
    fn every_row_at_fault_is_named() {
        let text = "object_id,class,lat_deg,lon_deg,n_detections\n\
                    a,rock,49,8.4,1\na,rock,49,8.4,1\nb,rock,95,8.4,1\nc,rock,,8.4,1\n\
                    d,rock,49,8.4,-1\n,rock,49,8.4,1\n";
        assert_eq!(
            truth_of(table(text, "truth.csv")).unwrap_err().to_string(),
            "truth.csv:3: object_id: found a again, expected it once\n\
             truth.csv:4: lat_deg: found 95, expected -90 to 90\n\
             truth.csv:5: lat_deg: found nothing, expected a number\n\
             truth.csv:6: n_detections: found -1, expected a number not below zero\n\
             truth.csv:7: object_id: found nothing, expected a value"
        );
        assert_eq!(
            truth_of(table("object_id,class,lat_deg,lon_deg\n", "truth.csv"))
                .unwrap_err()
                .to_string(),
            "truth.csv: found no objects, expected at least one"
        );
        assert_eq!(
            truth_of(table("object_id,class,lat,lon_deg\n", "truth.csv"))
                .unwrap_err()
                .to_string(),
            "truth.csv:1: lat_deg: found columns object_id, class, lat, lon_deg, expected a \
             column lat_deg (is lon_deg meant?)"
        );
    }

    #[test]
    fn ignored_places_may_hold_for_every_class() {
        let text = "class,image_id,lat_deg,lon_deg\ncar,7,49,8.4\n,8,49,8.5\n";
        let ignored = ignored_of(table(text, "ignore.csv")).unwrap();
        assert_eq!(ignored[0].class.as_deref(), Some("car"));
        assert_eq!(ignored[1].class, None);
    }

    #[test]
    fn labels_are_keyed_by_image_where_det_id_repeats() {
        let labels = labels_of(table("det_id,object_id\n1,a\n2,\n", "labels.csv")).unwrap();
        let key = |image: &str, det: &str| DetectionKey {
            image_id: image.to_owned(),
            det_id: det.to_owned(),
        };
        assert_eq!(labels.object_of[&key("", "1")].as_deref(), Some("a"));
        assert_eq!(labels.object_of[&key("", "2")], None);
        assert_eq!(
            labels_of(table("det_id,object_id\n1,a\n1,b\n", "labels.csv"))
                .unwrap_err()
                .to_string(),
            "labels.csv:3: det_id: found 1 again, expected it once, or a column image_id"
        );
        let text = "det_id,image_id,object_id\n1,x,a\n1,y,b\n1,y,c\n";
        assert_eq!(
            labels_of(table(text, "labels.csv"))
                .unwrap_err()
                .to_string(),
            "labels.csv:4: det_id: found 1 again, expected it once an image"
        );
    }

    #[test]
    fn evidence_weights_are_probabilities() {
        let text = "rock_id,image_id,det_id,weight\nr1,x,1,0.25\nr1,x,2,\nr2,x,3,1.5\n";
        assert_eq!(
            evidence_of(table(text, "evidence.csv"))
                .unwrap_err()
                .to_string(),
            "evidence.csv:4: weight: found 1.5, expected 0 to 1"
        );
        let text = "rock_id,det_id\nr1,1\n";
        let evidence = evidence_of(table(text, "evidence.csv")).unwrap();
        assert_eq!(evidence.memberships[0].weight, 1.0);
    }
}
