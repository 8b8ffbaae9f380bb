//! Marks: where they lie, how they look.

mod words;

use super::*;
use crate::publish::picture::perceptual_difference;
use std::f64::consts::TAU;

fn plain(grey: u8) -> Picture {
    Picture::of_colour(640, 480, [grey; 3]).unwrap()
}

fn ring(u: f64, v: f64, radius_px: f64, detected: bool) -> ObjectMark {
    ObjectMark {
        label: String::new(),
        centre: Pixel::new(u, v),
        radius_px,
        covariance_px: Matrix2::zeros(),
        detected,
        p_exist: None,
    }
}

fn of_objects(objects: Vec<ObjectMark>) -> Annotation {
    Annotation {
        objects,
        ..Annotation::default()
    }
}

fn drawn(grey: u8, annotation: &Annotation) -> Picture {
    let mut picture = plain(grey);
    annotate(&mut picture, annotation);
    picture
}

fn at(picture: &Picture, u: f64, v: f64) -> [u8; 3] {
    let [x, y] = [u, v].map(|value| grid::whole(value.round()));
    picture
        .colour(u32::try_from(x).unwrap(), u32::try_from(y).unwrap())
        .unwrap()
}

/// Relative luminance and contrast ratio of WCAG 2.2.
fn luminance(rgb: [u8; 3]) -> f64 {
    let [r, g, b] = rgb.map(|value| {
        let v = f64::from(value) / 255.0;
        if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    });
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    (a / b).max(b / a)
}

#[test]
fn a_ring_lies_where_the_object_is() {
    let picture = drawn(60, &of_objects(vec![ring(400.0, 300.0, 40.0, true)]));
    for step in 0..72u32 {
        let (sin, cos) = (f64::from(step) / 72.0 * TAU).sin_cos();
        let on = |radius: f64| at(&picture, 400.0 + radius * cos, 300.0 + radius * sin);
        let [r, g, b] = on(40.0);
        assert!(r > b + 70 && g > b + 70, "{step}: {:?}", on(40.0));
        assert_eq!((on(35.0), on(45.0)), ([60; 3], [60; 3]), "{step}");
    }
    assert_eq!(at(&picture, 400.0, 300.0), [60; 3]);
}

#[test]
fn a_tiny_object_has_a_ring_that_can_be_seen() {
    let style = Style::for_size(640, 480);
    let picture = drawn(60, &of_objects(vec![ring(400.0, 300.0, 0.1, true)]));
    let [r, _, b] = at(&picture, 400.0 + style.min_ring_radius, 300.0);
    assert!(r > 150 && b < 110);
    assert_eq!(at(&picture, 400.0, 300.0), [60; 3]);
}

#[test]
fn only_what_was_not_detected_is_dashed() {
    for (radius, grey) in [(40.0, 30), (5.0, 30), (40.0, 225), (5.0, 225)] {
        let objects = vec![
            ring(200.0, 300.0, radius, true),
            ring(400.0, 300.0, radius, false),
        ];
        let picture = drawn(grey, &of_objects(objects));
        let radius = radius.max(Style::for_size(640, 480).min_ring_radius);
        let share = |u: f64| {
            let untouched = (0..360u32).filter(|&step| {
                let (sin, cos) = (f64::from(step) / 360.0 * TAU).sin_cos();
                at(&picture, u + radius * cos, 300.0 + radius * sin) == [grey; 3]
            });
            f64::from(u32::try_from(untouched.count()).unwrap()) / 360.0
        };
        assert_eq!(share(200.0), 0.0);
        let gaps = share(400.0);
        assert!((0.1..0.5).contains(&gaps), "{radius} on {grey}: {gaps}");
    }
}

#[test]
fn rings_stand_out_on_every_grey() {
    for detected in [true, false] {
        for grey in (0..=255).step_by(5) {
            let picture = drawn(grey, &of_objects(vec![ring(400.0, 300.0, 40.0, detected)]));
            // The bright part of a dash is some half of its period; a solid ring stands out all around, but for
            // where its pixels share their colours with both of its edges.
            let legible = (0..48u32).filter(|&step| {
                let (sin, cos) = (f64::from(step) / 48.0 * TAU).sin_cos();
                let best = (0..32u32)
                    .map(|i| 36.0 + f64::from(i) * 0.25)
                    .map(|r| contrast(at(&picture, 400.0 + r * cos, 300.0 + r * sin), [grey; 3]))
                    .fold(0.0, f64::max);
                best >= 3.0
            });
            let legible = legible.count();
            let least = if detected { 36 } else { 12 };
            assert!(
                legible >= least,
                "{legible} of 48 on {grey}, detected: {detected}"
            );
        }
    }
}

#[test]
fn detections_stand_out_on_every_grey() {
    let annotation = Annotation {
        detections: vec![DetectionMark::Box {
            x_min: 350.0,
            y_min: 250.0,
            x_max: 450.0,
            y_max: 350.0,
        }],
        ..Annotation::default()
    };
    for grey in (0..=255).step_by(5) {
        let picture = drawn(grey, &annotation);
        let across: Vec<[u8; 3]> = (345..356)
            .map(|x| picture.colour(x, 300).unwrap())
            .collect();
        let best = across.iter().map(|&c| contrast(c, [grey; 3]));
        let best = best.fold(0.0, f64::max);
        assert!(best >= 3.0, "{best} on {grey}");
        assert_eq!(at(&picture, 400.0, 300.0), [grey; 3]);
    }
}

#[test]
fn the_tint_is_even_odd_and_ends_at_its_ring() {
    let block = |left: f64, top: f64, right: f64, bottom: f64| {
        [(left, top), (right, top), (right, bottom), (left, bottom)]
            .map(|(u, v)| Pixel::new(u, v))
            .to_vec()
    };
    let annotation = Annotation {
        covered: vec![
            block(300.0, 250.0, 5000.0, 9000.0),
            block(400.0, 300.0, 500.0, 400.0),
        ],
        ..Annotation::default()
    };
    let picture = drawn(100, &annotation);
    let tinted = at(&picture, 350.0, 350.0);
    assert!(tinted[2] > 120 && tinted[2] > tinted[0], "{tinted:?}");
    // A translucent tint leaves most of the picture's own contrast.
    let darker = at(&drawn(60, &annotation), 350.0, 350.0);
    assert!(tinted[1] - darker[1] >= 28);
    for (u, v, is_tinted) in [
        (600.0, 470.0, true),
        (639.0, 479.0, true),
        (450.0, 350.0, false),
        (290.0, 400.0, false),
        (350.0, 240.0, false),
    ] {
        let expected = if is_tinted { tinted } else { [100; 3] };
        assert_eq!(at(&picture, u, v), expected, "({u}, {v})");
    }
    assert!(annotation.counts(640, 480).covered);
    assert!(!annotation.counts(250, 200).covered);
}

#[test]
fn an_ellipse_as_long_as_the_horizon_is_drawn_as_its_lines() {
    let mut object = ring(320.0, 400.0, 8.0, true);
    object.covariance_px = Matrix2::new(1e8, 0.0, 0.0, 25.0);
    let picture = drawn(60, &of_objects(vec![object.clone()]));
    let half = 5.0 * 5.991_464_547f64.sqrt();
    for u in [3.0, 200.0, 600.0, 638.0] {
        let best = |v: f64| {
            (-1..=1)
                .map(|d| at(&picture, u, v + f64::from(d))[0])
                .max()
                .unwrap()
        };
        assert!(best(400.0 - half) > 130 && best(400.0 + half) > 130, "{u}");
        assert_eq!(at(&picture, u, 380.0), [60; 3]);
    }
    // One that means nothing is left out.
    object.covariance_px *= 1e12;
    assert_eq!(of_objects(vec![object]).counts(640, 480).ellipses, 0);
}

/// A scene with a mark of every kind.
fn scene() -> Annotation {
    let mut annotation = of_objects(vec![
        ring(150.0, 300.0, 30.0, true),
        ring(300.0, 200.0, 4.0, true),
        ring(420.0, 330.0, 14.0, false),
    ]);
    for (object, label) in annotation
        .objects
        .iter_mut()
        .zip(["r0001", "r0002", "r0003"])
    {
        object.label = label.to_owned();
        object.covariance_px = Matrix2::new(90.0, 20.0, 20.0, 40.0);
    }
    annotation.title = "v012 · mast camera".to_owned();
    annotation.detections = vec![
        DetectionMark::Point(Pixel::new(520.0, 120.0)),
        DetectionMark::Box {
            x_min: 120.0,
            y_min: 275.0,
            x_max: 180.0,
            y_max: 330.0,
        },
    ];
    annotation.covered = vec![vec![
        Pixel::new(-50.0, 500.0),
        Pixel::new(250.0, 150.0),
        Pixel::new(700.0, 250.0),
    ]];
    annotation
}

#[test]
fn the_same_marks_give_the_same_bytes_on_any_thread() {
    let here = drawn(90, &scene());
    let there = std::thread::spawn(|| drawn(90, &scene())).join().unwrap();
    assert_eq!(here, there);
    assert_eq!(here, drawn(90, &scene()));
    assert!(here.rgba().chunks_exact(4).all(|pixel| pixel[3] == 255));
}

#[test]
fn a_missing_ring_differs_more_than_coding_does() {
    let textured = || {
        let mut state = 7u32;
        Picture::from_fn(640, 480, |x, y| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let base = 90 + (x / 8 + y / 5) % 40 + (state >> 27);
            [base + 10, base, base - 12].map(|v| u8::try_from(v).unwrap())
        })
        .unwrap()
    };
    let with = |annotation: &Annotation| {
        let mut picture = textured();
        annotate(&mut picture, annotation);
        picture
    };
    let whole = with(&scene());
    for quality in [80, 90, 95] {
        let coded = Picture::decode(&whole.to_jpeg(quality).unwrap()).unwrap();
        let noise = perceptual_difference(&whole, &coded);
        assert!(noise > 0.0 && noise < 0.03, "quality {quality}: {noise}");
    }
    for missing in 0..3 {
        let mut other = scene();
        other.objects[missing].covariance_px = Matrix2::zeros();
        other.objects[missing].label.clear();
        let without_ellipse = perceptual_difference(&whole, &with(&other));
        assert!(without_ellipse > 0.06, "{missing}: {without_ellipse}");
        let moved = other.clone();
        other.objects[missing].detected = !other.objects[missing].detected;
        let difference = perceptual_difference(&with(&moved), &with(&other));
        assert!(difference > 0.06, "{missing}: {difference}");
    }
}

/// Pictures of a pixel or a line, and marks on every border, must only not fail.
#[test]
fn any_size_can_be_drawn_on() {
    for (width, height) in [(1, 1), (1, 500), (700, 2), (17, 33), (9000, 12)] {
        let mut picture = Picture::of_colour(width, height, [128; 3]).unwrap();
        annotate(&mut picture, &scene());
        assert_eq!((picture.width(), picture.height()), (width, height));
    }
}

#[test]
fn what_this_view_alone_placed_is_circled_in_white() {
    let annotation = Annotation {
        placed: vec![
            PlacedMark {
                centre: Pixel::new(400.0, 300.0),
                radius_px: 40.0,
            },
            PlacedMark {
                centre: Pixel::new(-100.0, 300.0),
                radius_px: 40.0,
            },
            PlacedMark {
                centre: Pixel::new(200.0, f64::NAN),
                radius_px: 40.0,
            },
        ],
        ..Annotation::default()
    };
    assert_eq!(annotation.counts(640, 480).placed, 1);
    let picture = drawn(60, &annotation);
    for step in 0..72u32 {
        let (sin, cos) = (f64::from(step) / 72.0 * TAU).sin_cos();
        let [r, g, b] = at(&picture, 400.0 + 40.0 * cos, 300.0 + 40.0 * sin);
        let is_grey = r.abs_diff(g) < 10 && g.abs_diff(b) < 10;
        assert!(r > 120 && is_grey, "{step}: {r} {g} {b}");
    }
    assert_eq!(at(&picture, 400.0, 300.0), [60; 3]);
}

#[test]
fn panels_are_the_same_picture_drawn_twice_side_by_side() {
    let left = of_objects(vec![ring(400.0, 300.0, 40.0, true)]);
    let right = of_objects(vec![ring(300.0, 200.0, 40.0, false)]);
    let panels = annotate_panels(plain(60), &[left.clone(), right.clone()]).unwrap();
    let gap = Style::for_size(640, 480).gap;
    assert_eq!((panels.width(), panels.height()), (1280 + gap, 480));
    let (one, two) = (drawn(60, &left), drawn(60, &right));
    for y in 0..480 {
        for x in 0..640 {
            assert_eq!(panels.colour(x, y), one.colour(x, y));
            assert_eq!(panels.colour(x + 640 + gap, y), two.colour(x, y));
        }
        assert_eq!(panels.colour(640, y), Some([255; 3]));
    }
    assert_eq!(annotate_panels(plain(60), &[left]).unwrap(), one);
    assert_eq!(annotate_panels(plain(60), &[]).unwrap(), plain(60));
}
