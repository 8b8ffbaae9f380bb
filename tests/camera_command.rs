//! `rockmap camera` as one types it.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::Write;
use std::process::{Command, Output, Stdio};

const CAMERAS: &str = "\
[cameras.nav]
model = \"pinhole\"
width = 200
height = 100
fx = 100
fy = 100
cx = 100
cy = 50
binning = 2

[cameras.all_around]
model = \"equirectangular\"
width = 720
height = 360
";

/// Runs it in a folder with cameras.toml, with a table on standard input.
fn camera(folder: &tempfile::TempDir, arguments: &[&str], table: &str) -> Output {
    std::fs::write(folder.path().join("cameras.toml"), CAMERAS).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_rockmap"))
        .arg("camera")
        .args(arguments)
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // One that stops at a fault of its own does not read.
    let _ = child.stdin.take().unwrap().write_all(table.as_bytes());
    child.wait_with_output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn rays_from_standard_input_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "rays",
        "cameras.toml",
        "--camera",
        "nav",
        "--frame",
        "camera",
    ];
    let done = camera(&folder, &arguments, "u_px,v_px\n99.75,24.75\n");
    // The middle of a picture binned by two; 1 in depth to 1 to the right.
    let half = 0.5f64.sqrt();
    assert_eq!(text(&done.stderr), "");
    assert_eq!(done.status.code(), Some(0));
    let row = text(&done.stdout).lines().nth(1).unwrap();
    let numbers: Vec<f64> = row.split(',').filter_map(|n| n.parse().ok()).collect();
    let expected = [99.75, 24.75, 0.0, 0.0, 0.0, half, 0.0, half];
    assert_eq!(numbers.len(), expected.len());
    for (found, expected) in numbers.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-15, "{row}");
    }
}

#[test]
fn pixels_from_file_to_file_with_a_record_behind() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("in.csv"), "x_m,y_m,z_m\n2,0,0\n-2,0,0\n").unwrap();
    let arguments = "pixels cameras.toml --camera nav --input in.csv --output out.csv --pan-deg -0";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let done = camera(&folder, &arguments, "");
    assert_eq!(done.status.code(), Some(1));
    assert_eq!(
        text(&done.stderr),
        "warning: 1 of 2 records have no answer, see the column problem\n"
    );
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert_eq!(
        table,
        "x_m,y_m,z_m,u_px,v_px,problem\n2,0,0,49.75,24.75,\n-2,0,0,,,behind the camera\n"
    );
}

#[test]
fn faults_end_it() {
    let folder = tempfile::tempdir().unwrap();
    let unknown = camera(&folder, &["rays", "cameras.toml", "--camera", "nab"], "");
    assert_eq!(unknown.status.code(), Some(2));
    assert_eq!(
        text(&unknown.stderr),
        "error: cameras.toml: camera: found nab, expected one of all_around, nav (is nav meant?)\n"
    );
    let bad = camera(
        &folder,
        &["rays", "cameras.toml", "--camera", "nav"],
        "u_px,v_px\n1,x\n",
    );
    assert_eq!(bad.status.code(), Some(2));
    assert_eq!(
        text(&bad.stderr),
        "error: standard input:2: v_px: found \"x\", expected a number\n"
    );
    assert_eq!(text(&bad.stdout), "");
}

#[test]
fn a_list() {
    let folder = tempfile::tempdir().unwrap();
    let done = camera(&folder, &["list", "cameras.toml"], "");
    assert_eq!(
        text(&done.stdout),
        "name        model            size     field\n\
         all_around  equirectangular  720x360  360.0 deg\n\
         nav         pinhole          100x50   90.0 deg\n"
    );
    let done = camera(&folder, &["list", "cameras.toml", "--json"], "");
    let list: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(list[1]["width"], 100);
}
