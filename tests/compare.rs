//! Two simulated nights at one site: the rocks that came, went and moved in between are found.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rockmap::frame::{Enu, Geodetic, Point};
use rockmap::pipeline::{self, Config, Overrides, Silent};
use rockmap::simulate::{Scene, Simulation, revisit, simulate, write};
use serde_json::Value;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn map(simulation: &Simulation, home: &Path, name: &str) -> PathBuf {
    let data = home.join(format!("{name}-data"));
    write(simulation, &data).unwrap();
    let overrides = Overrides {
        out: Some(home.join(name)),
        ..Overrides::default()
    };
    let config = Config::read(&data.join("pipeline.toml"), &overrides).unwrap();
    pipeline::run(&config, false, &Silent).unwrap();
    home.join(name)
}

fn compare(arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rockmap"));
    command.arg("compare").args(arguments).output().unwrap()
}

/// The second night: of the first night's rocks every seventh is gone, every seventh has rolled
/// 0.7 m to the north, and one has come for every seventh, 2 m aside.
fn second_night(first: &Simulation) -> Simulation {
    let mut rocks = Vec::new();
    for (i, rock) in first.rocks.iter().enumerate() {
        let mut rock = rock.clone();
        match i % 7 {
            0 => continue,
            1 => rock.place = first.ground.point(rock.place.xyz.x, rock.place.xyz.y + 0.7),
            2 => {
                let mut new = rock.clone();
                new.object_id = format!("new-{i}");
                new.place = first.ground.point(rock.place.xyz.x + 2.0, rock.place.xyz.y);
                rocks.push(new);
            }
            _ => {}
        }
        rocks.push(rock);
    }
    revisit(first, rocks, first.scene.seed + 1)
}

#[test]
fn two_nights_with_known_changes() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    let mut scene = Scene::read(&root().join("fixtures/scenes/rocks-200.toml")).unwrap();
    // What the fusion makes of poor data is not the question here.
    scene.detector.clutter_per_image = 0.0;
    scene.poses.scale = 0.2;
    let first = simulate(&scene);
    let second = second_night(&first);
    let a = map(&first, home, "a");
    let b = map(&second, home, "b");
    let out = home.join("changes");
    let [a, b, out] = [&a, &b, &out].map(|path| path.to_str().unwrap());
    let output = compare(&[a, b, "--out", out, "--align", "--json"]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written = fs::read(Path::new(out).join("compare.json")).unwrap();
    assert_eq!(summary, serde_json::from_slice::<Value>(&written).unwrap());

    let layer = fs::read(Path::new(out).join("compare.geojson")).unwrap();
    let layer: Value = serde_json::from_slice(&layer).unwrap();
    let features = layer["features"].as_array().unwrap();
    let total: u64 = summary["counts"]
        .as_object()
        .unwrap()
        .values()
        .map(|n| n.as_u64().unwrap())
        .sum();
    assert_eq!(features.len() as u64, total);
    let site = &first.scene.site;
    let placed: Vec<(&str, Point<Enu>)> = features
        .iter()
        .map(|f| {
            let [lon, lat] = [0, 1].map(|i| f["geometry"]["coordinates"][i].as_f64().unwrap());
            let height_m = site.origin().height_m;
            let at = site.enu(Geodetic::from_degrees(lat, lon, height_m));
            (f["properties"]["status"].as_str().unwrap(), at)
        })
        .collect();
    let told = |status: &str, rocks: &[Point<Enu>]| {
        let found = |rock: &&Point<Enu>| {
            let near =
                |(s, at): &(&str, Point<Enu>)| *s == status && at.horizontal_distance(**rock) < 0.3;
            placed.iter().any(near)
        };
        (rocks.iter().filter(found).count(), rocks.len())
    };
    // Only of rocks that were detected often enough in each night can a change be known.
    let often = |night: &Simulation| -> Vec<(String, Point<Enu>)> {
        let counts = night.n_detections();
        let rocks = night.rocks.iter().zip(counts).filter(|(_, n)| *n >= 3);
        rocks
            .map(|(rock, _)| (rock.object_id.clone(), rock.place))
            .collect()
    };
    let (then, now) = (often(&first), often(&second));
    let rolled = |id: &str| {
        first
            .rocks
            .iter()
            .position(|r| r.object_id == id)
            .is_some_and(|i| i % 7 == 1)
    };
    let stands =
        |rocks: &[(String, Point<Enu>)], id: &str| rocks.iter().any(|(other, _)| other == id);
    let both = now.iter().filter(|(id, _)| stands(&then, id));
    let (moved, same): (Vec<_>, Vec<_>) = both.partition(|(id, _)| rolled(id));
    let exists = |id: &str| second.rocks.iter().any(|r| r.object_id == id);
    let gone = then.iter().filter(|(id, _)| !exists(id));
    let new = now.iter().filter(|(id, _)| id.starts_with("new-"));
    let places = |rocks: Vec<&(String, Point<Enu>)>| -> Vec<Point<Enu>> {
        rocks.iter().map(|r| r.1).collect()
    };
    let scores = [
        ("same", places(same)),
        ("moved", places(moved)),
        ("gone", places(gone.collect())),
        ("new", places(new.collect())),
    ]
    .map(|(status, rocks)| (status, told(status, &rocks)));
    for (status, (found, n)) in scores {
        let lost = n - found;
        assert!(n >= 5 && lost <= 2, "{status}: {found} of {n}");
    }

    // Another comparison takes the folder's place only where that is asked for.
    let output = compare(&[a, b, "--out", out]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("or --force to replace them"), "{stderr}");
    let output = compare(&[a, b, "--out", out, "--force"]);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.starts_with("same              "), "{table}");
}

#[test]
fn geopackages_compare_as_geojson_does() {
    let home = tempfile::tempdir().unwrap();
    let home = home.path();
    let run = |name: &str, set: &[&str]| {
        let overrides = Overrides {
            out: Some(home.join(name)),
            set: set.iter().map(|&s| s.to_owned()).collect(),
            ..Overrides::default()
        };
        let config = Config::read(&root().join("fixtures/tiny/pipeline.toml"), &overrides).unwrap();
        pipeline::run(&config, false, &Silent).unwrap();
        home.join(name)
    };
    let both = run("both", &["output.report=false"]);
    let paper = "fusion.method=\"paper\"";
    let package = run("package", &["output.formats=[\"gpkg\"]", paper]);
    let text = run(
        "text",
        &["output.formats=[\"geojson\"]", paper, "output.report=false"],
    );
    let compared = |a: &Path, b: &Path, name: &str| -> (Value, String) {
        let out = home.join(name);
        let [a, b, at] = [a, b, &out].map(|path| path.to_str().unwrap());
        let output = compare(&[a, b, "--out", at, "--json"]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        let report = fs::read_to_string(out.join("report.html")).unwrap();
        (summary, report)
    };
    let (of_text, page) = compared(&both, &text, "1");
    let (of_package, report) = compared(&both, &package, "2");
    let (of_file, _) = compared(&both, &package.join("rockmap.gpkg"), "3");
    for other in [&of_package, &of_file] {
        for part in ["counts", "agreement", "shift"] {
            assert_eq!(other[part], of_text[part], "{part}");
        }
        assert_eq!(other["b"]["footprints"], true);
    }
    assert!(of_text["counts"]["same"].as_u64() > Some(5), "{of_text}");
    // In another system they are where they were, to its last decimal.
    let projected = run(
        "projected",
        &[
            "output.formats=[\"gpkg\"]",
            "output.crs=\"EPSG:32719\"",
            paper,
            "output.report=false",
        ],
    );
    let (of_projected, _) = compared(&both, &projected, "projected-changes");
    assert_eq!(of_projected["counts"], of_text["counts"]);
    assert_eq!(of_projected["b"]["footprints"], true);
    let rms = |summary: &Value| summary["agreement"]["rms_m"].as_f64().unwrap();
    assert!((rms(&of_projected) - rms(&of_text)).abs() < 2e-4);

    // With the later run's report, its page with a section more; without, a page of that alone.
    assert!(report.contains("<h1>tiny</h1>") && report.contains("id=\"map\""));
    assert!(report.contains("\"changes\":{") && !report.contains("\"annotated/"));
    assert!(page.contains("rockmap compare</title>") && !page.contains("id=\"map\""));
    let nowhere = home.join("nowhere.gpkg");
    let output = compare(&[
        nowhere.to_str().unwrap(),
        text.to_str().unwrap(),
        "--out",
        home.join("4").to_str().unwrap(),
    ]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.contains("nowhere.gpkg: cannot read: no such file"),
        "{stderr}"
    );
}
