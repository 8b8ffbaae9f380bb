//! Runs every case under fixtures/ and compares what it writes with what is expected.
//!
//! A case is a folder with a `pipeline.toml`, its inputs and an `expected/` folder. Numbers must
//! agree within the tolerances below, pictures by their perceptual difference, everything else
//! exactly. `rockmap.gpkg`, `rockmap.qgz` and `report.html` are not compared here: their own tests
//! open them.
//! `ROCKMAP_RENEW=1` writes the expected outputs anew; read the difference before you
//! commit it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rockmap::pipeline::{self, Config, Overrides, Silent};
use rockmap::publish::Picture;
use rockmap::publish::picture::perceptual_difference;
use serde_json::Value;

/// Coordinates may differ by about a millimetre, degrees.
const COORDINATE: f64 = 1e-8;
/// Other numbers may differ by this, or by this share of themselves.
const NUMBER: f64 = 1e-3;
/// Pictures may differ by this.
const PICTURE: f64 = 0.03;
/// What differs from run to run or version to version.
const PASSING: [&str; 2] = ["run_id", "version"];

#[test]
fn every_fixture_gives_what_is_expected() {
    let cases = cases();
    assert!(
        cases.len() >= 3,
        "found {} cases under fixtures/",
        cases.len()
    );
    let faults: Vec<String> = cases.iter().flat_map(|case| run(case)).collect();
    assert!(faults.is_empty(), "\n{}\n", faults.join("\n"));
}

/// All folders under fixtures/ that hold a pipeline file.
fn cases() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let folders = fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut cases: Vec<PathBuf> = folders
        .filter(|f| f.join("pipeline.toml").exists())
        .collect();
    cases.sort();
    cases
}

fn run(case: &Path) -> Vec<String> {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let overrides = Overrides {
        out: Some(out.clone()),
        ..Overrides::default()
    };
    let name = case.file_name().unwrap().to_string_lossy();
    let config = Config::read(&case.join("pipeline.toml"), &overrides);
    let done = config.and_then(|config| pipeline::run(&config, false, &Silent));
    if let Err(error) = done {
        return vec![format!("{name}: {error}")];
    }
    for passing in ["timing.json", "rockmap.gpkg", "rockmap.qgz", "report.html"] {
        fs::remove_file(out.join(passing)).unwrap();
    }
    // Hashes of pictures, which are compared themselves, and more tolerantly.
    let _ = fs::remove_file(out.join("annotated/index.csv"));
    let expected = case.join("expected");
    if std::env::var_os("ROCKMAP_RENEW").is_some() {
        renew(&out, &expected);
    }
    compare(&out, &expected)
        .into_iter()
        .map(|fault| format!("{name}: {fault}"))
        .collect()
}

fn renew(out: &Path, expected: &Path) {
    if expected.exists() {
        fs::remove_dir_all(expected).unwrap();
    }
    for file in files(out) {
        let target = expected.join(&file);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(out.join(&file), target).unwrap();
    }
}

/// All files below a folder, relative to it.
fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        let Ok(entries) = fs::read_dir(&next) else {
            continue;
        };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned());
            }
        }
    }
    found
}

fn compare(out: &Path, expected: &Path) -> Vec<String> {
    let (made, wanted) = (files(out), files(expected));
    let missing = wanted
        .difference(&made)
        .map(|f| format!("{} is missing", f.display()));
    let surplus = made
        .difference(&wanted)
        .map(|f| format!("{} is not expected", f.display()));
    let mut faults: Vec<String> = missing.chain(surplus).collect();
    for file in made.intersection(&wanted) {
        let (a, b) = (out.join(file), expected.join(file));
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        let difference = match &*extension {
            "json" | "geojson" => compare_json(&read_json(&a), &read_json(&b), ""),
            "qml" => (read(&a) != read(&b)).then(|| "styles differ".to_owned()),
            "csv" => compare_csv(&read(&a), &read(&b)),
            _ => compare_pictures(&a, &b),
        };
        faults.extend(difference.map(|d| format!("{}: {d}", file.display())));
    }
    faults
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

fn read_json(path: &Path) -> Value {
    let mut json: Value = serde_json::from_str(&read(path)).unwrap();
    if path.ends_with("stac.json") {
        // It ends in the run's.
        json["id"] = Value::Null;
    }
    json
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()).max(1.0)
}

/// The first difference between two values, if any.
fn compare_json(found: &Value, expected: &Value, at: &str) -> Option<String> {
    match (found, expected) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            let same = if at.contains(".coordinates") {
                (a - b).abs() <= COORDINATE
            } else {
                close(a, b, NUMBER)
            };
            (!same).then(|| format!("{at}: found {a}, expected {b}"))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => a
            .iter()
            .zip(b)
            .enumerate()
            .find_map(|(i, (a, b))| compare_json(a, b, &format!("{at}[{i}]"))),
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => a
            .iter()
            .filter(|(key, _)| !PASSING.contains(&key.as_str()))
            .find_map(|(key, a)| compare_json(a, &b[key], &format!("{at}.{key}"))),
        (a, b) => (a != b).then(|| format!("{at}: found {a}, expected {b}")),
    }
}

fn compare_csv(found: &str, expected: &str) -> Option<String> {
    let (a, b) = (found.lines().count(), expected.lines().count());
    if a != b {
        return Some(format!("found {a} lines, expected {b}"));
    }
    let lines = found.lines().zip(expected.lines()).enumerate();
    lines.into_iter().find_map(|(i, (a, b))| {
        let same = |(a, b): (&str, &str)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => close(a, b, NUMBER),
            _ => a == b,
        };
        let all = a.split(',').count() == b.split(',').count()
            && a.split(',').zip(b.split(',')).all(same);
        (!all).then(|| format!("line {}: found {a}, expected {b}", i + 1))
    })
}

fn compare_pictures(found: &Path, expected: &Path) -> Option<String> {
    let picture = |path: &Path| Picture::read(path, &path.display().to_string()).unwrap();
    let difference = perceptual_difference(&picture(found), &picture(expected));
    (difference > PICTURE).then(|| format!("pictures differ by {difference:.3}"))
}

#[test]
fn the_comparison_finds_what_differs() {
    let json = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    let expected = json(r#"{"coordinates": [1.0, 2.0], "n": 10.0, "run_id": "a"}"#);
    let same = json(r#"{"coordinates": [1.000000001, 2.0], "n": 10.001, "run_id": "b"}"#);
    assert_eq!(compare_json(&same, &expected, ""), None);
    let moved = json(r#"{"coordinates": [1.0000001, 2.0], "n": 10.0, "run_id": "a"}"#);
    assert_eq!(
        compare_json(&moved, &expected, "").unwrap(),
        ".coordinates[0]: found 1.0000001, expected 1"
    );
    assert!(compare_json(&json(r#"{"n": 10.0}"#), &expected, "").is_some());
    assert!(compare_csv("a,b\n1,x\n", "a,b\n1,y\n").is_some());
    assert!(compare_csv("a,b\n1.0001,x\n", "a,b\n1,x\n").is_none());
}
