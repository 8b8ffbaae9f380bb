//! What is said of the marks: counts, legend, names.

use super::*;

#[test]
fn counts_are_of_what_lies_in_the_picture() {
    let mut uncertain = ring(100.0, 100.0, 10.0, true);
    uncertain.covariance_px = Matrix2::new(100.0, 0.0, 0.0, 4.0);
    let mut certain = ring(200.0, 100.0, 10.0, false);
    certain.covariance_px = Matrix2::identity() * 0.01;
    let annotation = Annotation {
        objects: vec![
            uncertain,
            certain,
            ring(-3.0, 100.0, 10.0, false), // its ring reaches in
            ring(-300.0, 100.0, 10.0, true),
            ring(f64::NAN, 100.0, 10.0, true),
            ring(10.0, 10.0, f64::INFINITY, true),
        ],
        detections: vec![
            DetectionMark::Point(Pixel::new(5.0, 5.0)),
            DetectionMark::Point(Pixel::new(641.0, 5.0)),
            DetectionMark::Box {
                x_min: 90.0,
                y_min: -1e30,
                x_max: 1e30,
                y_max: 110.0,
            },
            DetectionMark::Box {
                x_min: 700.0,
                y_min: 0.0,
                x_max: 800.0,
                y_max: 9.0,
            },
            DetectionMark::Box {
                x_min: f64::NAN,
                y_min: 0.0,
                x_max: 8.0,
                y_max: 9.0,
            },
        ],
        ..Annotation::default()
    };
    let expected = Counts {
        boxes: 1,
        points: 1,
        placed: 0,
        detected: 1,
        missed: 2,
        ellipses: 1,
        covered: false,
    };
    assert_eq!(annotation.counts(640, 480), expected);
    assert_eq!(annotate(&mut plain(90), &annotation), expected);
}

#[test]
fn the_legend_says_what_there_is() {
    let words = |counts: &Counts, (width, height)| -> Option<Vec<String>> {
        let style = Style::for_size(width, height);
        let (typesetter, grid) = (Typesetter::new(&style), Grid::new(&style));
        let legend = legend::lay_out("v012", counts, &style, &typesetter, &grid)?;
        assert!(style.picture().contains(&legend.frame));
        let rows = legend.rows.into_iter().map(|row| row.words);
        Some(std::iter::once(legend.title).chain(rows).collect())
    };
    let counts = Counts {
        boxes: 52,
        points: 1,
        placed: 0,
        detected: 41,
        missed: 1,
        ellipses: 40,
        covered: true,
    };
    let expected = [
        "v012",
        "41 fused rocks, detected here",
        "1 fused rock, not detected here",
        "95 % ellipses",
        "52 detections",
        "1 point detection",
        "ground that other views cover",
    ];
    for size in [(640, 480), (1242, 375), (6000, 4000), (375, 1242)] {
        assert_eq!(words(&counts, size).unwrap(), expected, "{size:?}");
    }
    assert_eq!(
        words(&counts, (320, 240)).unwrap(),
        ["v012", "41", "1", "52", "1"]
    );
    assert_eq!(
        words(&Counts::default(), (640, 480)).unwrap(),
        ["v012", "no rocks, no detections"]
    );
    assert_eq!(words(&counts, (24, 20)), None);
}

#[test]
fn the_legend_takes_the_emptiest_corner() {
    let style = Style::for_size(640, 480);
    let typesetter = Typesetter::new(&style);
    let counts = Counts {
        detected: 3,
        ..Counts::default()
    };
    let place = |taken: &[[f64; 2]]| {
        let mut grid = Grid::new(&style);
        for &centre in taken {
            grid.take_disc(centre, 20.0);
        }
        let legend = legend::lay_out("v012", &counts, &style, &typesetter, &grid).unwrap();
        let frame = legend.frame;
        (frame.left > 320.0, frame.top > 240.0)
    };
    assert_eq!(place(&[]), (false, false));
    assert_eq!(place(&[[40.0, 30.0]]), (true, false));
    assert_eq!(place(&[[40.0, 30.0], [600.0, 30.0]]), (false, true));
    let three = [[40.0, 30.0], [600.0, 30.0], [40.0, 450.0]];
    assert_eq!(place(&three), (true, true));
}

#[test]
fn names_hide_neither_rings_nor_names_nor_the_legend() {
    let style = Style::for_size(640, 480);
    let objects: Vec<ObjectMark> = (0..200u32)
        .map(|index| {
            let t = f64::from(index);
            let (u, v) = (
                640.0 * (t * 0.754_877).fract(),
                480.0 * (t * 0.569_84).fract(),
            );
            let mut object = ring(u, v, 4.0 + 20.0 * (t * 0.381).fract(), index % 3 != 0);
            object.label = format!("r{index:04}");
            object.p_exist = Some((t * 0.17).fract());
            object
        })
        .collect();
    let annotation = of_objects(objects);
    let marks = Marks::of(&annotation, &style);
    let typesetter = Typesetter::new(&style);
    let mut grid = Grid::new(&style);
    marks.occupy(&mut grid, &style);
    let legend = legend::lay_out("v012", &marks.counts, &style, &typesetter, &grid).unwrap();
    grid.take(legend.frame);
    let labels = label::place(&marks.rings, &mut grid, &style, &typesetter);
    assert!((10..200).contains(&labels.len()), "{}", labels.len());
    for (index, label) in labels.iter().enumerate() {
        assert!(style.picture().contains(&label.frame));
        assert!(!label.frame.meets(&legend.frame));
        assert!(
            labels[..index]
                .iter()
                .all(|other| !other.frame.meets(&label.frame))
        );
        for ring in &marks.rings {
            let (u, v) = (ring.object.centre.u, ring.object.centre.v);
            let near_u = u.clamp(label.frame.left, label.frame.right);
            let near_v = v.clamp(label.frame.top, label.frame.bottom);
            assert!(
                (near_u - u).hypot(near_v - v) > ring.radius,
                "{}",
                label.text
            );
        }
    }
    assert!(labels.iter().any(|label| label.text.ends_with(" %")));
    // On a small picture there are none.
    let small = Style::for_size(320, 240);
    let labels = label::place(&marks.rings, &mut Grid::new(&small), &small, &typesetter);
    assert!(labels.is_empty());
}
