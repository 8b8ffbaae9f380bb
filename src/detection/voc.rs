//! Detections in the XML of Pascal VOC, one picture a file.

use super::{Detection, DetectionFile, Mark, MarkSigma, PixelBox};
use crate::error::Error;
use crate::input::{Document, Reject, Section, image_id_of};

/// Reads the boxes, the `file`-th detections of the run. VOC counts pixels from 1, and `xmax` and
/// `ymax` are the last pixels within: a box from 1 to 20 covers the pixels 0 to 19, from -0.5 to
/// 19.5. The image is `filename` without its extension; `det_id` counts the objects from 0.
///
/// # Errors
/// What is not such XML; a faulty object is set aside in the result.
pub(super) fn read(text: &str, shown: &str, file: usize) -> Result<DetectionFile, Error> {
    let document = Document::parse_xml(text, shown)?;
    let root = document.root();
    if !root.has("annotation") {
        root.fault("annotation", "nothing", "an annotation of Pascal VOC");
    }
    let annotation = root.section("annotation");
    if annotation.is_present() && !annotation.has("filename") {
        annotation.fault("filename", "nothing", "the picture's file name");
    }
    let name = annotation.name("filename");
    let faults = document.take_faults();
    let (Some(name), true) = (name, faults.is_empty()) else {
        return Err(Error::Faults(faults));
    };
    let image_id = image_id_of(&name);
    let mut read = DetectionFile {
        detections: Vec::new(),
        rejects: Vec::new(),
        unknown_columns: Vec::new(),
        has_azimuth: false,
    };
    for (index, object) in annotation.tables("object").iter().enumerate() {
        let mark = pixel_box(object);
        let class = object.name("name");
        let score = object
            .has("score")
            .then(|| object.number("score", 0.0..=1.0, "0 to 1"));
        let fault = document.take_faults().into_iter().next();
        match (mark, fault) {
            (Some(mark), None) => read.detections.push(Detection {
                image_id: image_id.clone(),
                det_id: index.to_string(),
                class,
                score: score.flatten(),
                diameter_m: None,
                mark: Mark::Box(mark),
                range_m: None,
                sigma: MarkSigma::default(),
                file,
                line: object.place("").line.unwrap_or(1),
            }),
            (_, Some(fault)) => {
                let record = format!("{image_id}/{index}");
                read.rejects.push(Reject::from_fault(fault, record));
            }
            (None, None) => {}
        }
    }
    Ok(read)
}

fn pixel_box(object: &Section) -> Option<PixelBox> {
    if !object.has("bndbox") {
        object.fault("bndbox", "nothing", "xmin, ymin, xmax, ymax");
        return None;
    }
    let bounds = object.section("bndbox");
    let side = |key: &str| {
        if !bounds.has(key) {
            bounds.fault(key, "nothing", "a number");
        }
        bounds.number(key, .., "a finite number")
    };
    let [x_min, y_min, x_max, y_max] = ["xmin", "ymin", "xmax", "ymax"].map(side);
    let (x_min, y_min, x_max, y_max) = (x_min?, y_min?, x_max?, y_max?);
    for (key, low, high) in [("xmax", x_min, x_max), ("ymax", y_min, y_max)] {
        if high < low {
            let other = key.replace("max", "min");
            bounds.fault(key, high, format!("at least {other}, {low}"));
            return None;
        }
    }
    Some(PixelBox {
        x_min: x_min - 1.5,
        y_min: y_min - 1.5,
        x_max: x_max - 0.5,
        y_max: y_max - 0.5,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> String {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/voc.xml");
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn pixels_count_from_one_and_the_last_is_within() {
        let file = read(&sample(), "voc.xml", 1).unwrap();
        assert!(file.rejects.is_empty());
        let [first, second] = &file.detections[..] else {
            panic!("two boxes");
        };
        let expected = PixelBox {
            x_min: -0.5,
            y_min: 238.5,
            x_max: 187.5,
            y_max: 361.5,
        };
        assert_eq!(first.mark, Mark::Box(expected));
        assert_eq!((first.key().as_str(), first.line), ("r_0007/0", 10));
        assert_eq!(second.class.as_deref(), Some("boulder"));
        assert_eq!(second.key(), "r_0007/1");
        // The sample's second box ends at the picture's last row, 480 of 480.
        assert!(matches!(second.mark, Mark::Box(b) if b.y_max == 479.5));
    }

    #[test]
    fn faulty_objects_are_set_aside() {
        let rejects = |from: &str, to: &str| {
            let file = read(&sample().replacen(from, to, 1), "voc.xml", 0).unwrap();
            assert_eq!((file.rejects.len(), file.detections.len()), (1, 1));
            file.rejects[0].to_string()
        };
        assert_eq!(
            rejects("<xmin>1<", "<xmin>201<"),
            "voc.xml:18: annotation.object[0].bndbox.xmax: found 188, expected at least xmin, 201"
        );
        assert_eq!(
            rejects("<ymin>240<", "<ymin>24O<"),
            "voc.xml:17: annotation.object[0].bndbox.ymin: found \"24O\", expected a finite number"
        );
        assert_eq!(
            rejects("<xmin>1</xmin>", ""),
            "voc.xml:15: annotation.object[0].bndbox.xmin: found nothing, expected a number"
        );
    }

    #[test]
    fn what_is_no_annotation_is_refused() {
        let error = |text: &str| read(text, "v.xml", 0).unwrap_err().to_string();
        assert_eq!(
            error("<a><b>1</b></a>"),
            "v.xml: annotation: found nothing, expected an annotation of Pascal VOC"
        );
        assert_eq!(
            error("<annotation>\n<object><name>x</name></object></annotation>"),
            "v.xml:1:1: annotation.filename: found nothing, expected the picture's file name"
        );
        assert_eq!(
            error("<annotation>"),
            "v.xml:1:1: not XML: the root node was opened but never closed"
        );
    }
}
