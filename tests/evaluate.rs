//! A whole evaluation, from files to table, and the scores of a real truth.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use rockmap::evaluate::{Options, Sources, evaluate, picture, read_truth};

/// One mapped object: id, class, probability, longitude, latitude, 1-sigma ellipse.
fn feature(id: &str, class: &str, p_exist: f64, place: (f64, f64)) -> String {
    let (lat_deg, lon_deg) = place;
    format!(
        "{{\"type\":\"Feature\",\"id\":\"{id}\",\"properties\":{{\"rock_id\":\"{id}\",\
         \"class\":\"{class}\",\"p_exist\":{p_exist},\"sigma_major_m\":0.2,\
         \"sigma_minor_m\":0.1,\"sigma_az_deg\":0.0}},\"geometry\":{{\"type\":\"Point\",\
         \"coordinates\":[{lon_deg:.9},{lat_deg:.9}]}}}}"
    )
}

fn write_map(path: &Path, features: &[String]) {
    let features = features.join(",\n");
    let text = format!("{{\"type\":\"FeatureCollection\",\"features\":[\n{features}\n]}}\n");
    std::fs::write(path, text).unwrap();
}

fn sources(folder: &Path, map: &Path) -> Sources {
    Sources {
        map: map.to_owned(),
        truth: folder.join("truth.csv"),
        ignore: Some(folder.join("ignore.csv")).filter(|path| path.exists()),
        labels: None,
        evidence: None,
    }
}

#[test]
fn files_become_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "truth.csv",
        "object_id,class,lat_deg,lon_deg,n_detections\n\
         a,rock,49,8.4,5\nb,rock,49.0001,8.4,5\nc,rock,49.0002,8.4,1\n",
    );
    write("ignore.csv", "class,lat_deg,lon_deg\nrock,49.0003,8.4\n");
    write("labels.csv", "det_id,object_id\n0,a\n1,a\n2,b\n3,\n");
    write(
        "evidence.csv",
        "rock_id,image_id,det_id,weight\nr1,x,0,1\nr1,y,1,1\nr3,y,3,1\n",
    );
    let map = folder.path().join("rocks.geojson");
    write_map(
        &map,
        &[
            feature("r1", "rock", 0.95, (49.000_001, 8.4)),
            feature("r2", "rock", 0.25, (49.0001, 8.4)),
            feature("r3", "rock", 0.75, (49.0005, 8.4)),
            feature("r4", "rock", 0.85, (49.0003, 8.4)),
        ],
    );
    let sources = Sources {
        labels: Some(folder.path().join("labels.csv")),
        ..sources(folder.path(), &map)
    };
    let options = Options {
        min_detections: 2,
        by_class: true,
        ..Options::default()
    };
    let evaluation = evaluate(&sources, &options).unwrap();
    let table = evaluation.report.to_string();
    assert_eq!(table, TABLE, "found:\n{table}");
    let json = serde_json::to_value(&evaluation.report).unwrap();
    assert_eq!(json["detection"]["n_matched"], 1);
    assert_eq!(json["association"]["purity"], 2.0 / 3.0);
    assert!(picture(&evaluation, "a site").contains("1  true, missed"));
}

const TABLE: &str = "\
mapped objects counted             2  of 4 in the map; 1 with p_exist below 0.5 left out; 1 near what is ignored left out
true objects counted               2  of 3 in the truth; 1 in fewer than 2 detections left out

matched                            1  matches nearer than 0.3 m
precision                     0.5000  1 of 2
recall                        0.5000  1 of 2
F1                            0.5000  1 missed, 1 false
RMSE                        0.1112 m
median error                0.1112 m  at most 0.1112 m
bias east, north            0.0000 m  0.1112 m

GOSPA                       0.5122 m  p = 2, alpha = 2, c = 0.5 m
  localisation             0.0124 m2  1 matched
  missed                   0.1250 m2  1 missed
  false                    0.1250 m2  1 false
OSPA                        0.3622 m  p = 2, c = 0.5 m

NEES                           0.309  expected 2
NEES / 2                       0.155  expected 1
coverage at 95 %              1.0000  expected 0.95; 1 matches with an ellipse

detections in objects              2  of 3 labelled detections
clutter in objects                 1  of 1 clutter detections
purity                        0.6667
completeness                  0.6667
pair precision                1.0000
pair recall                   1.0000
pair F1                       1.0000

Brier score                   0.3758  3 objects with p_exist
calibration error             0.5167

p_exist            n    mean p     exist
0.0 to 0.1         0         -         -
0.1 to 0.2         0         -         -
0.2 to 0.3         1    0.2500    1.0000
0.3 to 0.4         0         -         -
0.4 to 0.5         0         -         -
0.5 to 0.6         0         -         -
0.6 to 0.7         0         -         -
0.7 to 0.8         1    0.7500    0.0000
0.8 to 0.9         0         -         -
0.9 to 1.0         1    0.9500    1.0000

class      matched     missed      false  precision     recall         F1       RMSE
rock             1          1          1     0.5000     0.5000     0.5000   0.1112 m
";

#[test]
fn a_missing_evidence_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let truth = folder.path().join("truth.csv");
    std::fs::write(&truth, "object_id,class,lat_deg,lon_deg\na,rock,49,8.4\n").unwrap();
    let labels = folder.path().join("labels.csv");
    std::fs::write(&labels, "det_id,object_id\n0,a\n").unwrap();
    let map = folder.path().join("rocks.geojson");
    write_map(&map, &[]);
    let sources = Sources {
        labels: Some(labels),
        ..sources(folder.path(), &map)
    };
    let error = evaluate(&sources, &Options::default()).unwrap_err();
    let expected = format!(
        "{}: cannot read: no such file or folder",
        folder.path().join("evidence.csv").display()
    );
    assert_eq!(error.to_string(), expected);
}

/// A map made from the truth of kitti-0001 by a rule: places moved by up to two metres, some left
/// out, some false, some near the moving cars. The expected numbers are those of an independent
/// scorer in Python (scipy's assignment, pyproj's geodesy) on the same file.
#[test]
fn a_real_truth_with_ignored_places_scores_as_by_an_independent_program() {
    let data =
        std::env::var_os("ROCKMAP_DATA").map_or_else(|| "../shared/data".into(), PathBuf::from);
    let folder = data.join("kitti-0001");
    if !folder.join("truth.csv").exists() {
        println!("skipped: no kitti-0001 under {}", data.display());
        return;
    }
    let scratch = tempfile::tempdir().unwrap();
    let map = scratch.path().join("rocks.geojson");
    write_map(&map, &moved_truth(&folder));
    // The other program takes heights as zero, not 115 m: lengths differ by 2e-5.
    for (radius_m, cutoff_m, min_detections, min_exist, expected) in EXPECTED {
        let options = Options {
            radius_m,
            cutoff_m,
            min_detections,
            min_exist,
            by_class: false,
        };
        let report = evaluate(&sources(&folder, &map), &options).unwrap().report;
        let d = &report.detection;
        let counts = [d.n_matched + d.n_false, d.n_matched + d.n_missed];
        assert_eq!(counts, expected.0, "{options:?}");
        let found = [
            d.precision.unwrap(),
            d.recall.unwrap(),
            d.f1.unwrap(),
            d.rmse_m.unwrap(),
            report.gospa.gospa_m,
        ];
        for (x, y) in found.into_iter().zip(expected.1) {
            assert!((x / y - 1.0).abs() < 1e-4, "{found:?} {:?}", expected.1);
        }
    }
}

/// Radius, cut-off, least detections, least existence; counted objects of map and truth; precision,
/// recall, F1, RMSE, GOSPA.
type Expected = (f64, f64, u32, f64, ([usize; 2], [f64; 5]));

const EXPECTED: [Expected; 4] = [
    (
        3.0,
        0.5,
        1,
        0.5,
        (
            [54, 75],
            [0.7222222, 0.5200000, 0.6046512, 1.4744275, 3.9243527],
        ),
    ),
    (
        3.0,
        3.0,
        3,
        0.5,
        (
            [54, 74],
            [0.7222222, 0.5270270, 0.6093750, 1.4744275, 17.6006682],
        ),
    ),
    (
        1.5,
        1.0,
        20,
        0.0,
        (
            [75, 52],
            [0.2933333, 0.4230769, 0.3464567, 0.8558455, 7.3378868],
        ),
    ),
    (
        0.8,
        0.8,
        3,
        0.7,
        (
            [46, 74],
            [0.1956522, 0.1216216, 0.1500000, 0.5816506, 5.9736803],
        ),
    ),
];

fn moved_truth(folder: &Path) -> Vec<String> {
    let truth = read_truth(&folder.join("truth.csv"), "truth.csv").unwrap();
    let mut features = Vec::new();
    for (i, object) in (0u32..).zip(&truth) {
        let turn = f64::from(i);
        let (lat, lon) = (object.place.lat_deg(), object.place.lon_deg());
        let by = |m: f64| {
            let (sin, cos) = turn.sin_cos();
            (lat + m * cos / 111_200.0, lon + m * sin / 73_100.0)
        };
        let p_exist = 0.3 + 0.7 * (0.5 + 0.5 * (1.7 * turn).sin());
        if i % 6 != 0 {
            let place = by(2.0 * (0.37 * turn).sin().abs());
            features.push(feature(&format!("r{i}"), "car", p_exist, place));
        }
        if i % 5 == 0 {
            features.push(feature(&format!("f{i}"), "car", p_exist, by(4.0)));
        }
        if i % 9 == 0 {
            // Beside the first of the moving cars of ignore.csv.
            let place = (49.000_052 + 1e-6 * turn, 8.400_837);
            features.push(feature(&format!("m{i}"), "car", 0.9, place));
        }
    }
    features
}
