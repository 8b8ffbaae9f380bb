//! Detections in COCO's JSON: a data set with its `images`, `categories` and `annotations`, or a bare
//! list of results.

use std::collections::HashMap;

use super::{Detection, DetectionFile, Mark, MarkSigma, PixelBox};
use crate::error::{Error, Fault, Place};
use crate::input::{Document, Reject, Section, image_id_of};

/// Reads the boxes, the `file`-th detections of the run. COCO's `[x, y, width, height]` counts from
/// the upper left corner of the picture, so that half a pixel is taken off both. Where the images are
/// listed, an image is its file name without the extension, else its number.
///
/// # Errors
/// What is not JSON or holds no annotations; a faulty annotation is set aside in the result.
pub(super) fn read(text: &str, shown: &str, file: usize) -> Result<DetectionFile, Error> {
    let document = Document::parse_json(text, shown)?;
    let root = document.root();
    let names = names(&root, "images", "file_name").map(|names| {
        let stems = names.into_iter();
        stems.map(|(id, name)| (id, image_id_of(&name))).collect()
    });
    let classes = names_or_none(&root);
    let annotations = match root.rows() {
        Some(rows) => rows,
        None if root.has("annotations") => root.tables("annotations"),
        None => {
            let expected = "COCO's annotations, or a list of results";
            return Err(
                Fault::found(Place::file(shown), "annotations", "nothing", expected).into(),
            );
        }
    };
    Error::check(document.take_faults())?;
    let mut read = DetectionFile {
        detections: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: Vec::new(),
        has_azimuth: false,
    };
    for (index, annotation) in annotations.iter().enumerate() {
        let lists = Lists {
            images: names.as_ref(),
            classes: classes.as_ref(),
        };
        let detection = detection(annotation, index, &lists, file);
        let fault = document.take_faults().into_iter().next();
        match (detection, fault) {
            (Some(detection), None) => read.detections.push(detection),
            (_, Some(fault)) => {
                let image = annotation.name("image_id").unwrap_or_default();
                let id = annotation.name("id").unwrap_or_else(|| index.to_string());
                document.take_faults();
                read.rejects
                    .push(Reject::from_fault(fault, format!("{image}/{id}")));
            }
            (None, None) => {}
        }
    }
    Ok(read)
}

/// What the data set says of its images and categories, by their numbers.
struct Lists<'a> {
    images: Option<&'a HashMap<String, String>>,
    classes: Option<&'a HashMap<String, String>>,
}

fn names_or_none(root: &Section) -> Option<HashMap<String, String>> {
    names(root, "categories", "name")
}

/// The names of a list by their `id`; `None` where there is no such list.
fn names(root: &Section, list: &str, field: &str) -> Option<HashMap<String, String>> {
    if root.rows().is_some() || !root.has(list) {
        return None;
    }
    let entries = root.tables(list).into_iter().filter_map(|entry| {
        for key in ["id", field] {
            if !entry.has(key) {
                entry.fault(key, "nothing", "a value");
            }
        }
        Some((entry.name("id")?, entry.name(field)?))
    });
    Some(entries.collect())
}

fn detection(
    annotation: &Section,
    index: usize,
    lists: &Lists<'_>,
    file: usize,
) -> Option<Detection> {
    let id = |key: &str, list: Option<&HashMap<String, String>>, of: &str| {
        let number = annotation.name(key)?;
        match list {
            None => Some(number),
            Some(list) => {
                let named = list.get(&number).cloned();
                if named.is_none() {
                    annotation.fault(key, number, format!("the id of one of the {of}"));
                }
                named
            }
        }
    };
    if !annotation.has("image_id") {
        annotation.fault("image_id", "nothing", "a value");
    }
    let image_id = id("image_id", lists.images, "images");
    let class = if annotation.has("category_id") {
        Some(id("category_id", lists.classes, "categories")?)
    } else {
        None
    };
    if annotation.has("iscrowd") && annotation.boolean_or_number("iscrowd") == Some(true) {
        annotation.fault("iscrowd", 1, "0, a box of one object");
    }
    let mark = pixel_box(annotation)?;
    let score = if annotation.has("score") {
        Some(annotation.number("score", 0.0..=1.0, "0 to 1")?)
    } else {
        None
    };
    Some(Detection {
        image_id: image_id?,
        det_id: annotation.name("id").unwrap_or_else(|| index.to_string()),
        class,
        score,
        diameter_m: None,
        mark: Mark::Box(mark),
        range_m: None,
        sigma: MarkSigma::default(),
        file,
        line: annotation.place("").line.unwrap_or(1),
    })
}

fn pixel_box(annotation: &Section) -> Option<PixelBox> {
    if !annotation.has("bbox") {
        annotation.fault("bbox", "nothing", "[x, y, width, height]");
        return None;
    }
    let numbers = annotation.numbers("bbox", &[4])?;
    let &[x, y, width, height] = numbers.as_slice() else {
        return None;
    };
    if !(width > 0.0 && height > 0.0) {
        let found = format!("a width of {width} and a height of {height}");
        annotation.fault("bbox", found, "both above zero");
        return None;
    }
    Some(PixelBox {
        x_min: x - 0.5,
        y_min: y - 0.5,
        x_max: x + width - 0.5,
        y_max: y + height - 0.5,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(name: &str) -> String {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/");
        std::fs::read_to_string(format!("{folder}{name}")).unwrap()
    }

    fn edges(detection: &Detection) -> [f64; 4] {
        match detection.mark {
            Mark::Box(b) => [b.x_min, b.y_min, b.x_max, b.y_max],
            _ => panic!("a box"),
        }
    }

    #[test]
    fn boxes_count_from_the_corner_of_the_picture() {
        let file = read(&sample("coco.json"), "coco.json", 3).unwrap();
        assert!(file.rejects.is_empty());
        let [first, second] = &file.detections[..] else {
            panic!("two boxes");
        };
        // A box at 0 with a width of 20 covers the pixels 0 to 19, whose edges are -0.5 and 19.5.
        assert_eq!(edges(first), [-0.5, 10.0, 19.5, 15.0]);
        assert_eq!(first.key(), "left/r_0007/41");
        assert_eq!(
            (first.class.as_deref(), first.score),
            (Some("boulder"), None)
        );
        assert_eq!((first.file, first.line), (3, 12));
        assert_eq!(edges(second), [99.75, 199.5, 108.25, 205.5]);
        assert_eq!(second.key(), "left/r_0008/42");
        assert_eq!(
            (second.class.as_deref(), second.score),
            (Some("rock"), Some(0.75))
        );
    }

    #[test]
    fn results_name_images_and_classes_by_number() {
        let file = read(&sample("coco-results.json"), "results.json", 0).unwrap();
        let keys: Vec<String> = file.detections.iter().map(Detection::key).collect();
        assert_eq!(keys, ["7/0", "9/1"]);
        assert_eq!(file.detections[0].class.as_deref(), Some("3"));
        assert_eq!(file.detections[0].score, Some(0.625));
        let [_, _, x_max, y_max] = edges(&file.detections[0]);
        assert!((x_max - 178.25).abs() < 1e-9 && (y_max - 94.25).abs() < 1e-9);
    }

    #[test]
    fn faulty_annotations_are_set_aside() {
        let text = "[\n{\"image_id\": 1, \"bbox\": [0, 0, 5]},\n{\"image_id\": 1, \"bbox\": [0, 0, 5, 0]},\n\
            {\"image_id\": 1, \"bbox\": [0, 0, 5, 5], \"score\": 1.83},\n{\"bbox\": [0, 0, 5, 5]},\n\
            {\"image_id\": 1, \"bbox\": [0, 0, 5, 5], \"iscrowd\": 1},\n7,\n{\"image_id\": 1, \"bbox\": [0, 0, 5, 5]}\n]";
        let file = read(text, "r.json", 0).unwrap();
        let rejects: Vec<String> = file.rejects.iter().map(Reject::to_string).collect();
        assert_eq!(
            rejects,
            [
                "r.json:2: [0].bbox: found a list of 3, expected a list of 4 finite numbers",
                "r.json:3: [1].bbox: found a width of 5 and a height of 0, expected both above zero",
                "r.json:4: [2].score: found 1.83, expected 0 to 1",
                "r.json:5: [3].image_id: found nothing, expected a value",
                "r.json:6: [4].iscrowd: found 1, expected 0, a box of one object",
                "r.json:7: [5].image_id: found nothing, expected a value",
            ]
        );
        assert_eq!(file.rejects[0].record, "1/0");
        assert_eq!(file.detections.len(), 1);
        let text = sample("coco.json").replace("\"image_id\": 8", "\"image_id\": 9");
        let file = read(&text, "coco.json", 0).unwrap();
        assert_eq!(
            file.rejects[0].to_string(),
            "coco.json:13: annotations[1].image_id: found 9, expected the id of one of the images"
        );
    }

    #[test]
    fn what_is_no_coco_is_refused() {
        let error = |text: &str| read(text, "c.json", 0).unwrap_err().to_string();
        assert_eq!(
            error("{\"shapes\": []}"),
            "c.json: annotations: found nothing, expected COCO's annotations, or a list of results"
        );
        assert_eq!(
            error("{\"images\": [{\"id\": 1}], \"annotations\": []}"),
            "c.json:1:13: images[0].file_name: found nothing, expected a value"
        );
        assert_eq!(
            error("[1,"),
            "c.json:1:3: not JSON: EOF while parsing a value"
        );
    }
}
