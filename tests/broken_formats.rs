//! Files of others cut short and with letters changed anywhere: a fault or another value, never a
//! panic.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};

use rockmap::camera::cameras_from_bytes;
use rockmap::detection::read_detections;
use rockmap::frame::Planet;
use rockmap::pose::read_poses;

fn sample(name: &str) -> Vec<u8> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats");
    fs::read(folder.join(name)).unwrap()
}

/// The text cut, and with one letter changed, at every `step`-th place.
fn broken(text: &[u8], step: usize) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for at in (0..text.len()).step_by(step) {
        all.push(text[..at].to_vec());
        for letter in [
            b'"', b'(', b']', b'}', b'<', b'=', b'-', b'9', b'e', b'\n', b'\xc3',
        ] {
            let mut changed = text.to_vec();
            changed[at] = letter;
            all.push(changed);
        }
    }
    all
}

#[test]
fn broken_cameras_are_faults() {
    for name in [
        "ros.yaml",
        "ros-message.yaml",
        "kalibr.yaml",
        "opencv.yml",
        "opencv-fisheye.xml",
        "opencv-2.xml",
        "cameras.txt",
        "rover.lbl",
        "feed.json",
    ] {
        let text = sample(name);
        assert!(cameras_from_bytes(&text, Path::new(name), name).is_ok());
        let mut faulty = 0;
        for changed in broken(&text, 7) {
            match cameras_from_bytes(&changed, Path::new(name), name) {
                Ok(file) => assert!(file.cameras.values().all(|c| c.width > 0 && c.height > 0)),
                Err(error) => {
                    let named = |line: &str| line.starts_with(name);
                    assert!(error.to_string().lines().all(named), "{error}");
                    faulty += 1;
                }
            }
        }
        assert!(faulty > 100, "{name}: {faulty}");
    }
}

#[test]
fn broken_detections_and_poses_are_faults() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("file");
    for name in ["coco.json", "coco-results.json", "voc.xml"] {
        let mut faulty = 0;
        for changed in broken(&sample(name), 61) {
            fs::write(&path, &changed).unwrap();
            let read = read_detections(&path, name, 0);
            faulty += usize::from(read.map_or(true, |file| !file.rejects.is_empty()));
        }
        assert!(faulty > 10, "{name}: {faulty}");
    }
    for name in ["images.txt", "trajectory.tum"] {
        let mut faulty = 0;
        for changed in broken(&sample(name), 31) {
            fs::write(&path, &changed).unwrap();
            let read = read_poses(&path, name, Planet::EARTH, None);
            faulty += usize::from(read.map_or(true, |file| !file.rejects.is_empty()));
        }
        assert!(faulty > 10, "{name}: {faulty}");
    }
}
