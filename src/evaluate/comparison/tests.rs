use super::*;
use crate::frame::{Ellipse, Planet};

const ORIGIN: (f64, f64) = (49.0, 8.4);

fn site() -> Site {
    let origin = Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, 0.0);
    Site::new(Planet::EARTH, origin)
}

fn at(east_m: f64, north_m: f64) -> Geodetic {
    let place = site().geodetic(Point::new(east_m, north_m, 0.0));
    Geodetic {
        height_m: 0.0,
        ..place
    }
}

fn rock(id: &str, east_m: f64, north_m: f64) -> Estimate {
    Estimate {
        rock_id: id.to_owned(),
        class: None,
        place: at(east_m, north_m),
        p_exist: None,
        ellipse: None,
    }
}

fn object(id: &str, east_m: f64, north_m: f64) -> TrueObject {
    TrueObject {
        object_id: id.to_owned(),
        class: None,
        place: at(east_m, north_m),
        n_detections: None,
    }
}

fn map(estimates: Vec<Estimate>) -> RockMap {
    RockMap {
        planet: Planet::EARTH,
        estimates,
    }
}

fn truth(objects: Vec<TrueObject>) -> Truth {
    Truth {
        objects,
        ignored: Vec::new(),
    }
}

fn compare(estimates: Vec<Estimate>, truth: &Truth, options: &Options) -> Comparison {
    Comparison::new(&map(estimates), truth, options).unwrap()
}

fn outcomes(comparison: &Comparison) -> Vec<EstimateOutcome> {
    comparison.estimates.iter().map(|e| e.outcome).collect()
}

#[test]
fn places_are_metres_from_the_first_object() {
    let truth = truth(vec![object("a", 0.0, 0.0), object("b", 300.0, -40.0)]);
    let c = compare(vec![rock("r", 300.1, -40.2)], &truth, &Options::default());
    assert!(c.truths[1].place.distance(Point::new(300.0, -40.0, 0.0)) < 1e-4);
    assert_eq!(outcomes(&c), [EstimateOutcome::Matched(1)]);
    assert_eq!(c.truths[0].outcome, TruthOutcome::Missed);
    assert!((c.matches[0].error_m - Vector2::new(0.1, -0.2)).norm() < 1e-5);
}

#[test]
fn unmatched_ones_near_the_ignored_and_the_rare_are_not_counted() {
    let mut known = truth(vec![
        object("a", 0.0, 0.0),
        TrueObject {
            n_detections: Some(2.0),
            ..object("rare", 10.0, 0.0)
        },
    ]);
    known.ignored.push(IgnoredPlace {
        class: Some("car".to_owned()),
        place: at(0.1, 0.0),
    });
    let options = Options {
        min_detections: 3,
        ..Options::default()
    };
    let estimates = vec![
        rock("match, though near what is ignored", 0.05, 0.0),
        rock("near what is ignored", 0.3, 0.0),
        rock("near the rare", 10.0, 0.2),
        rock("just too far from both", 0.45, 0.0),
    ];
    let c = compare(estimates, &known, &options);
    assert_eq!(
        outcomes(&c),
        [
            EstimateOutcome::Matched(0),
            EstimateOutcome::Ignored,
            EstimateOutcome::Ignored,
            EstimateOutcome::False,
        ]
    );
    assert_eq!(c.truths[1].outcome, TruthOutcome::Rare);
    let exists: Vec<_> = c.estimates.iter().map(|e| e.exists).collect();
    assert_eq!(exists, [Some(true), None, None, Some(false)]);
    assert_eq!(c.counted_estimates(), [0, 3]);
    assert_eq!(c.counted_truths(), [0]);
}

#[test]
fn improbable_ones_do_not_count_but_tell_of_calibration() {
    let known = truth(vec![object("a", 0.0, 0.0), object("b", 5.0, 0.0)]);
    let probable = |id, east_m, p| Estimate {
        p_exist: Some(p),
        ..rock(id, east_m, 0.0)
    };
    let estimates = vec![
        probable("found", 0.2, 0.5),
        probable("nearer, improbable twin", 0.0, 0.49),
        probable("improbable and there", 5.1, 0.1),
        probable("improbable and not there", 7.0, 0.1),
    ];
    let c = compare(estimates, &known, &Options::default());
    let doubtful = EstimateOutcome::Doubtful;
    assert_eq!(
        outcomes(&c),
        [EstimateOutcome::Matched(0), doubtful, doubtful, doubtful]
    );
    let exists: Vec<_> = c.estimates.iter().map(|e| e.exists).collect();
    assert_eq!(exists, [Some(true), Some(false), Some(true), Some(false)]);
    assert_eq!(c.truths[1].outcome, TruthOutcome::Missed);
}

#[test]
fn classes_keep_apart_where_asked() {
    let classed = |class: &str, object: TrueObject| TrueObject {
        class: Some(class.to_owned()),
        ..object
    };
    let mut known = truth(vec![
        classed("car", object("a", 0.0, 0.0)),
        classed("van", object("b", 5.0, 0.0)),
    ]);
    known.ignored.push(IgnoredPlace {
        class: Some("car".to_owned()),
        place: at(9.0, 0.0),
    });
    let van = |id, east_m| Estimate {
        class: Some("van".to_owned()),
        ..rock(id, east_m, 0.0)
    };
    let estimates = vec![van("x", 0.1), rock("no class", 5.1, 0.0), van("y", 9.0)];
    let plain = compare(estimates.clone(), &known, &Options::default());
    assert_eq!(
        outcomes(&plain),
        [
            EstimateOutcome::Matched(0),
            EstimateOutcome::Matched(1),
            EstimateOutcome::Ignored,
        ]
    );
    let options = Options {
        by_class: true,
        ..Options::default()
    };
    let strict = compare(estimates, &known, &options);
    assert_eq!(
        outcomes(&strict),
        [
            EstimateOutcome::False,
            EstimateOutcome::Matched(1),
            EstimateOutcome::False,
        ]
    );
    let report = crate::evaluate::Report::new(&strict);
    let of = |i: usize| {
        let c = &report.by_class[i];
        let d = &c.detection;
        (c.class.clone().unwrap(), d.n_matched, d.n_missed, d.n_false)
    };
    assert_eq!(of(0), ("car".to_owned(), 0, 1, 0));
    assert_eq!(of(1), ("van".to_owned(), 1, 0, 2));
}

/// The ellipse's long axis points 30 degrees east of north: the error along it is one sigma, the
/// one across three.
#[test]
fn covariances_turn_with_their_azimuth() {
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let ellipse = Ellipse {
        sigma_major_m: 0.2,
        sigma_minor_m: 0.05,
        azimuth: 30f64.to_radians(),
    };
    let shifted = |along: f64, across: f64| Estimate {
        ellipse: Some(ellipse),
        ..rock("r", along * sin + across * cos, along * cos - across * sin)
    };
    let known = truth(vec![object("a", 0.0, 0.0)]);
    for (along, across, nees) in [(0.2, 0.0, 1.0), (0.0, 0.15, 9.0), (0.2, 0.15, 10.0)] {
        let c = compare(vec![shifted(along, across)], &known, &Options::default());
        let found = crate::evaluate::Consistency::new(&c).nees.unwrap();
        assert!((found - nees).abs() < 1e-4, "{found} {nees}");
    }
}

#[test]
fn what_is_far_away_is_false_and_never_folds_back() {
    let known = truth(vec![object("a", 0.0, 0.0)]);
    let mut antipode = rock("antipode", 0.0, 0.0);
    antipode.place = Geodetic::from_degrees(-ORIGIN.0, ORIGIN.1 - 180.0 + 1e-4, 0.0);
    let c = compare(vec![antipode], &known, &Options::default());
    assert_eq!(outcomes(&c), [EstimateOutcome::False]);
    let report = crate::evaluate::Report::new(&c);
    assert_eq!(
        report.warnings,
        [
            "1 of 1 mapped objects lie more than 100 km from the truth: are map and truth of one \
          site, longitude first?"
        ]
    );
}

#[test]
fn options_and_truth_are_checked() {
    let message = |truth: &Truth, options: &Options| {
        let error = Comparison::new(&map(Vec::new()), truth, options).unwrap_err();
        error.to_string()
    };
    let known = truth(vec![object("a", 0.0, 0.0)]);
    let wrong = Options {
        radius_m: -1.0,
        cutoff_m: f64::NAN,
        min_exist: 1.5,
        ..Options::default()
    };
    assert_eq!(
        message(&known, &wrong),
        "--radius: found -1, expected a number above zero\n\
         --cutoff: found NaN, expected a number above zero\n\
         --min-exist: found 1.5, expected 0 to 1"
    );
    let wide = truth(vec![object("a", 0.0, 0.0), object("b", 250_000.0, 0.0)]);
    assert_eq!(
        message(&wide, &Options::default()),
        "truth: b: found 249.9 km from the first object, expected at most 100 km"
    );
}

#[test]
fn a_map_of_nothing_is_scored() {
    let known = truth(vec![object("a", 0.0, 0.0)]);
    let report = crate::evaluate::Report::new(&compare(vec![], &known, &Options::default()));
    assert_eq!(report.detection.recall, Some(0.0));
    assert_eq!(report.detection.precision, None);
    assert!((report.gospa.gospa_m - 0.125f64.sqrt()).abs() < 1e-12);
    assert_eq!(report.warnings, ["no mapped object counts"]);
}

#[test]
fn a_radius_that_pairs_all_with_all_is_refused() {
    let crowd = 8_000;
    let name = |i: u32| format!("{i}");
    let known = truth((0..crowd).map(|i| object(&name(i), 0.0, 0.0)).collect());
    let estimates = (0..crowd).map(|i| rock(&name(i), 0.0, 0.0)).collect();
    let error = Comparison::new(&map(estimates), &known, &Options::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "--radius: found 0.3 m, with 64000000 pairs of objects within it, expected at most \
         50000000 pairs"
    );
}
