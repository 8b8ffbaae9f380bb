use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal, Uniform};

use super::*;
use crate::evaluate::RockMap;
use crate::frame::{Ellipse, Planet, Point};

fn site() -> Site {
    Site::new(Planet::MARS, Geodetic::from_degrees(-4.6, 137.4, 0.0))
}

/// An object at (east, north) metres, as sure of its place as an ellipse says.
fn estimate(id: &str, at: Vector2<f64>, sigmas_m: (f64, f64), azimuth: f64) -> Estimate {
    let place = site().geodetic(Point::new(at.x, at.y, 0.0));
    Estimate {
        rock_id: id.to_owned(),
        class: None,
        place: Geodetic {
            height_m: 0.0,
            ..place
        },
        p_exist: None,
        ellipse: Some(Ellipse {
            sigma_major_m: sigmas_m.0,
            sigma_minor_m: sigmas_m.1,
            azimuth,
        }),
    }
}

fn round(id: &str, east_m: f64, north_m: f64) -> Estimate {
    estimate(id, Vector2::new(east_m, north_m), (0.1, 0.1), 0.0)
}

fn epoch(estimates: Vec<Estimate>) -> Epoch {
    Epoch {
        name: String::new(),
        map: RockMap {
            planet: Planet::MARS,
            estimates,
        },
        coverage: None,
        sha256: String::new(),
        report: None,
    }
}

fn told(changes: &Changes) -> Vec<(Status, Option<usize>, Option<usize>)> {
    let all = changes.changes.iter();
    all.map(|c| (c.status, c.before, c.after)).collect()
}

#[test]
fn every_status_is_given_to_its_object() {
    let before = epoch(vec![
        round("a", 0.0, 0.0),
        round("b", 5.0, 0.0),
        round("c", 10.0, 0.0),
    ]);
    let after = epoch(vec![
        round("x", 0.2, 0.0),
        round("y", 5.8, 0.0),
        round("z", 20.0, 0.0),
    ]);
    let changes = compare(&before, &after, &Options::default()).unwrap();
    use Status::{Gone, Moved, New, Same};
    assert_eq!(
        told(&changes),
        [
            (Same, Some(0), Some(0)),
            (Moved, Some(1), Some(1)),
            (New, None, Some(2)),
            (Gone, Some(2), None),
        ]
    );
    // Joint variance per axis: 0.1^2 of each map and of the registration.
    let sigma = changes.changes[0].mahalanobis.unwrap();
    assert!((sigma - 0.2 / 0.03f64.sqrt()).abs() < 1e-4, "{sigma}");
    let offset = changes.changes[1].offset_m.unwrap();
    assert!((offset - Vector2::new(0.8, 0.0)).norm() < 1e-4, "{offset}");
}

#[test]
fn ellipses_decide_by_direction() {
    // Long to the north: 0.6 m north is expected, 0.6 m east is not.
    let long = |id: &str, e: f64, n: f64| estimate(id, Vector2::new(e, n), (0.4, 0.05), 0.0);
    let before = epoch(vec![long("a", 0.0, 0.0), long("b", 10.0, 0.0)]);
    let after = epoch(vec![long("a", 0.0, 0.6), long("b", 10.6, 0.0)]);
    let changes = compare(&before, &after, &Options::default()).unwrap();
    assert_eq!(
        told(&changes),
        [
            (Status::Same, Some(0), Some(0)),
            (Status::Moved, Some(1), Some(1))
        ]
    );
}

#[test]
fn the_matching_is_optimal_not_greedy() {
    // The nearest pair is (b, x); taking it would leave a and y alone, 0.55 m apart.
    let before = epoch(vec![round("a", 0.0, 0.0), round("b", 0.3, 0.0)]);
    let after = epoch(vec![round("x", 0.25, 0.0), round("y", 0.55, 0.0)]);
    let changes = compare(&before, &after, &Options::default()).unwrap();
    assert_eq!(
        told(&changes),
        [
            (Status::Same, Some(0), Some(0)),
            (Status::Same, Some(1), Some(1))
        ]
    );
}

#[test]
fn doubtful_objects_are_no_change_but_keep_others_from_being_one() {
    let doubtful = |id: &str, east_m: f64| Estimate {
        p_exist: Some(0.2),
        ..round(id, east_m, 0.0)
    };
    let before = epoch(vec![round("a", 0.0, 0.0), doubtful("b", 5.0)]);
    let after = epoch(vec![doubtful("a", 0.1), doubtful("c", 9.0)]);
    let changes = compare(&before, &after, &Options::default()).unwrap();
    assert_eq!(told(&changes), [(Status::Same, Some(0), Some(0))]);
}

#[test]
fn where_nobody_looked_nothing_is_new_or_gone() {
    let before = epoch(vec![round("a", 0.0, 0.0), round("b", 50.0, 0.0)]);
    let mut after = epoch(vec![]);
    // A degree of longitude is about 59 km: the square holds a and not b.
    let text = "{\"features\":[{\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[[\
                [137.3999,-4.6001],[137.4001,-4.6001],[137.4001,-4.5999],[137.3999,-4.5999],\
                [137.3999,-4.6001]]]}}]}";
    after.coverage = Some(Coverage::from_bytes(text.as_bytes(), "f.geojson").unwrap());
    let changes = compare(&before, &after, &Options::default()).unwrap();
    assert_eq!(
        told(&changes),
        [
            (Status::Gone, Some(0), None),
            (Status::Unseen, Some(1), None)
        ]
    );
    assert_eq!(changes.changes[0].n_covered_after, Some(1));
    let error = Coverage::from_bytes(b"{\"features\":[{\"geometry\":7}]}", "f.geojson");
    assert_eq!(
        error.unwrap_err().to_string(),
        "f.geojson: features[0].geometry: found none, expected a polygon"
    );
}

/// Two maps of 400 rocks with known changes, one of them shifted as a whole.
fn shifted_maps(seed: u64, shift: Vector2<f64>) -> (Epoch, Epoch) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let place = Uniform::new(0.0, 60.0).unwrap();
    let angle = Uniform::new(0.0, std::f64::consts::PI).unwrap();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for i in 0..400 {
        let at = Vector2::new(place.sample(&mut rng), place.sample(&mut rng));
        let mut seen = |by: Vector2<f64>| {
            let azimuth: f64 = angle.sample(&mut rng);
            let (major, minor) = (0.12, 0.04);
            let (x, y): (f64, f64) = (
                StandardNormal.sample(&mut rng),
                StandardNormal.sample(&mut rng),
            );
            let (sin, cos) = azimuth.sin_cos();
            let noise =
                Vector2::new(sin, cos) * (x * major) + Vector2::new(cos, -sin) * (y * minor);
            estimate(&format!("{i}"), at + by + noise, (major, minor), azimuth)
        };
        // Every tenth is gone, every next tenth new.
        let (a, b) = (seen(Vector2::zeros()), seen(shift));
        if i % 10 != 1 {
            before.push(a);
        }
        if i % 10 != 0 {
            after.push(b);
        }
    }
    (epoch(before), epoch(after))
}

#[test]
fn a_common_shift_is_found_and_the_same_objects_agree_as_their_ellipses_say() {
    let shift = Vector2::new(1.1, -0.7);
    let (before, after) = shifted_maps(5, shift);
    let options = Options {
        sigma_m: 0.005,
        align_m: Some(2.0),
        ..Options::default()
    };
    let changes = compare(&before, &after, &options).unwrap();
    let found = changes.shift.clone().unwrap();
    // 320 pairs of about 0.13 m of standard deviation along an axis.
    assert!((found.vector() - shift).norm() < 0.03, "{found:?}");
    assert!(found.sigma_east_m < 0.01 && found.converged, "{found:?}");
    let mean_d2 = changes.mean_d2().unwrap();
    assert!((mean_d2 - 2.0).abs() < 0.35, "{mean_d2}");
    let right = changes.of(Status::Same).filter(|c| {
        let id = |epoch: &Epoch, i: Option<usize>| epoch.map.estimates[i.unwrap()].rock_id.clone();
        id(&before, c.before) == id(&after, c.after)
    });
    let n_same = changes.count(Status::Same);
    assert!(right.count() >= 312 && n_same <= 325, "{n_same}");
    // Without the shift the two maps would hardly agree.
    let unaligned = Options {
        align_m: None,
        ..options
    };
    let unaligned = compare(&before, &after, &unaligned).unwrap();
    assert!(unaligned.count(Status::Same) < 80);
}

#[test]
fn the_gate_passes_as_many_as_it_says() {
    let (before, after) = shifted_maps(9, Vector2::zeros());
    for confidence in [0.5, 0.9] {
        let options = Options {
            sigma_m: 1e-3,
            confidence,
            ..Options::default()
        };
        let changes = compare(&before, &after, &options).unwrap();
        let share = f64::from(u32::try_from(changes.count(Status::Same)).unwrap()) / 320.0;
        assert!((share - confidence).abs() < 0.08, "{confidence}: {share}");
    }
}

#[test]
fn swapped_maps_swap_new_and_gone() {
    let (before, after) = shifted_maps(3, Vector2::new(0.1, 0.05));
    let forth = compare(&before, &after, &Options::default()).unwrap();
    let back = compare(&after, &before, &Options::default()).unwrap();
    assert_eq!(forth.count(Status::New), back.count(Status::Gone));
    assert_eq!(forth.count(Status::Gone), back.count(Status::New));
    assert_eq!(forth.count(Status::Same), back.count(Status::Same));
}

#[test]
fn what_cannot_be_compared_is_said() {
    let message = |before: &Epoch, after: &Epoch, options: &Options| {
        compare(before, after, options).unwrap_err().to_string()
    };
    let mut earth = epoch(vec![]);
    earth.map.planet = Planet::EARTH;
    let mars = epoch(vec![round("a", 0.0, 0.0)]);
    assert_eq!(
        message(&mars, &earth, &Options::default()),
        "the later map: found a map of earth, expected one of mars, as the earlier"
    );
    let wrong = Options {
        sigma_m: 0.0,
        confidence: 1.0,
        ..Options::default()
    };
    assert_eq!(
        message(&mars, &mars, &wrong),
        "--sigma: found 0, expected a number above zero\n\
         --confidence: found 1, expected above 0, below 1"
    );
    let align = Options {
        align_m: Some(2.0),
        ..Options::default()
    };
    assert_eq!(
        message(&mars, &mars, &align),
        "--align: found 1 objects that agree on a shift, expected at least 3"
    );
    let nothing = compare(&epoch(vec![]), &epoch(vec![]), &Options::default()).unwrap();
    assert!(nothing.changes.is_empty());
}
