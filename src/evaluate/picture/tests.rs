use super::*;
use crate::evaluate::{
    Comparison, Estimate, Evaluation, Options, Report, RockMap, TrueObject, Truth,
};
use crate::frame::{Ellipse, Geodetic, Planet};

/// One match with an ellipse, one missed, one false, one far away.
fn evaluation() -> Evaluation {
    let place = |lat_deg, lon_deg| Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
    let rock = |id: &str, place| Estimate {
        rock_id: id.to_owned(),
        class: None,
        place,
        p_exist: Some(0.9),
        ellipse: Some(Ellipse {
            sigma_major_m: 0.4,
            sigma_minor_m: 0.2,
            azimuth: 0.5,
        }),
    };
    let object = |id: &str, place| TrueObject {
        object_id: id.to_owned(),
        class: None,
        place,
        n_detections: None,
    };
    let map = RockMap {
        planet: Planet::EARTH,
        estimates: vec![
            rock("r<1>", place(49.0, 8.400_001)),
            rock("r2", place(49.0001, 8.4)),
            rock("far", place(50.0, 8.4)),
        ],
    };
    let truth = Truth {
        objects: vec![
            object("a & b", place(49.0, 8.4)),
            object("c", place(49.0, 8.4002)),
        ],
        ignored: Vec::new(),
    };
    let comparison = Comparison::new(&map, &truth, &Options::default()).unwrap();
    let report = Report::new(&comparison);
    Evaluation {
        truth,
        comparison,
        report,
    }
}

#[test]
fn everything_is_drawn_once_and_named_safely() {
    let svg = picture(&evaluation(), "a <title>");
    let count = |what: &str| svg.matches(what).count();
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert_eq!(count(">a &lt;title&gt;</text>"), 1);
    assert_eq!(
        count("<title>r&lt;1&gt;: a &amp; b, 0.073 m off, p_exist 0.900</title>"),
        1
    );
    assert_eq!(count("<title>c</title>"), 1);
    assert_eq!(count("<title>r2, p_exist 0.900</title>"), 1);
    assert_eq!(count("<ellipse "), 2);
    assert_eq!(count("1  true, missed"), 1);
    assert_eq!(count("2  mapped, false"), 1);
    assert_eq!(count("1 mapped objects lie outside the picture"), 1);
    assert_eq!(count("reliability of p_exist"), 1);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// Every element that opens also closes, in order.
#[test]
fn the_document_is_well_formed() {
    let svg = picture(&evaluation(), "x");
    let mut open: Vec<String> = Vec::new();
    for tag in svg.split('<').skip(1).map(|t| t.split('>').next().unwrap()) {
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap().to_owned());
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn the_same_evaluation_gives_the_same_bytes() {
    assert_eq!(picture(&evaluation(), "x"), picture(&evaluation(), "x"));
}
