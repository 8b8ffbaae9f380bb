//! Whole simulations against independent numbers.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::camera::{Lens, read_camera_file};
use crate::frame::{Body, Geodetic, LocalEnu, Rotation, Site};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes")
}

fn scene(name: &str) -> Scene {
    Scene::read(&scenes().join(format!("{name}.toml"))).unwrap()
}

fn all_scenes() -> Vec<Scene> {
    let mut paths: Vec<PathBuf> = fs::read_dir(scenes())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    assert!(paths.len() >= 24);
    paths
        .iter()
        .map(|path| Scene::read(path).unwrap())
        .collect()
}

fn faults(text: &str) -> String {
    Scene::parse(text, "scene.toml").unwrap_err().to_string()
}

#[test]
fn all_faults_of_a_scene_are_listed() {
    let text = "seeds = 3\n\
                [rocks]\narea = { west_m = 3, east_m = 1 }\nheight_ratio = 2\n\
                diameter = { law = \"golombek\" }\n\
                [detector]\npx_50 = 3\np_max = 1.5\nmin_range_m = 20\n\
                [platforms.zoe]\ncameras = [\"nose\"]\npans_deg = []\nstart_time = \"noon\"\n\
                [cameras.mast]\nmodel = \"fisheye\"\ndistortion = [0.1]\n";
    assert_eq!(
        faults(text),
        "scene.toml:1:1: seeds: unknown key, is seed meant?\n\
         scene.toml:3:22: rocks.area.east_m: found 1, expected a number above west_m\n\
         scene.toml:4:1: rocks.height_ratio: found 2, expected 0.05 to 1\n\
         scene.toml:5:14: rocks.diameter.law: found \"golombek\", expected one of exponential, \
         golombek_rapp (is golombek_rapp meant?)\n\
         scene.toml:7:1: detector.px_50: unknown key, is px50 meant?\n\
         scene.toml:8:1: detector.p_max: found 1.5, expected 0 to 1\n\
         scene.toml:9:1: detector.min_range_m: found 20, expected a number below max_range_m\n\
         scene.toml:11:1: platforms.zoe.cameras: found \"nose\", expected one of mast\n\
         scene.toml:12:1: platforms.zoe.pans_deg: found an empty list, expected at least one angle\n\
         scene.toml:13:1: platforms.zoe.start_time: found \"noon\", expected a time such as \
         2005-10-09T15:00:00Z\n\
         scene.toml:16:1: cameras.mast.distortion: found 1 coefficients, expected 4 for a \
         fisheye"
    );
}

#[test]
fn contradictions_are_faults() {
    assert_eq!(
        faults("[rocks]\nnumber = 3\ndensity_per_m2 = 1\n"),
        "scene.toml:3:1: rocks.density_per_m2: found number and density_per_m2, expected one of \
         the two"
    );
    assert_eq!(
        faults("[platforms.r.path]\nwaypoints_east_m = [1, 2]\nwaypoints_north_m = [1]\n"),
        "scene.toml:3:1: platforms.r.path.waypoints_north_m: found 2 and 1 places, expected as \
         many as waypoints_east_m, at least 2"
    );
    assert_eq!(
        faults("[platforms.r.path]\nwaypoints_east_m = [1, 2]\n"),
        "scene.toml:1:14: platforms.r.path.waypoints_north_m: found nothing, expected a list of \
         finite numbers"
    );
}

#[test]
fn a_base_lies_below_and_has_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    fs::write(&path, "base = \"b.toml\"\n[detector]\np_max = 0.25\n").unwrap();
    fs::write(
        folder.path().join("b.toml"),
        "[detector]\npx50 = 7\np_max = 1\n",
    )
    .unwrap();
    let scene = Scene::read(&path).unwrap();
    assert_eq!((scene.detector.p_max, scene.detector.px50), (0.25, 7.0));
    assert_eq!(scene.name, "a");
    fs::write(&path, "base = \"a.toml\"\n").unwrap();
    let text = Scene::read(&path).unwrap_err().to_string();
    assert_eq!(
        text,
        format!(
            "{}: base: found no end, expected at most 8 files over one another",
            path.display()
        )
    );
}

/// The default scene file says in words what the program does without it.
#[test]
fn the_default_scene_file_holds_the_defaults() {
    let written = scene("default");
    let without = Scene::parse("name = \"default\"\n", "scene.toml").unwrap();
    assert_eq!(format!("{written:?}"), format!("{without:?}"));
}

/// The box centres scatter about the true rocks' projections, by the plain pinhole formula, as the
/// scene says.
#[test]
fn boxes_fall_on_true_rocks_in_every_scene() {
    for scene in all_scenes() {
        let simulation = simulate(&scene);
        let (mut squares, mut number) = (0.0, 0.0);
        for detection in &simulation.detections {
            let Some(rock) = detection.rock else { continue };
            let view = &simulation.views[detection.view];
            let camera = &scene.cameras[view.camera];
            let p = (view.enu_from_camera(&scene).inverse() * simulation.rocks[rock].place).xyz;
            let Lens::Pinhole(lens) = &camera.lens else {
                continue;
            };
            let f = lens.intrinsics().fx;
            let u = f * p.x / p.z + 0.5 * (f64::from(camera.width) - 1.0);
            let v = f * p.y / p.z + 0.5 * (f64::from(camera.height) - 1.0);
            let [x_min, y_min, x_max, y_max] = detection.edges_px;
            let seen = appearance(
                camera,
                &view.enu_from_camera(&scene),
                &simulation.rocks[rock],
            );
            let aim = seen.unwrap().aim(scene.detector.extent);
            let error = [0.5 * (x_min + x_max) - u, y_min + aim * (y_max - y_min) - v];
            squares += error.iter().map(|e| e * e).sum::<f64>() / detection.sigma_px.powi(2);
            number += 2.0;
        }
        let mean = squares / number;
        // Within 0.9 to 1.1, or three sampling errors where the boxes are few.
        let tolerance = (3.0 * (2.0f64 / number).sqrt()).max(0.1);
        assert!((mean - 1.0).abs() < tolerance, "{}: {mean}", scene.name);
    }
}

/// Means over three seeds of an independent implementation in numpy of the same scenes; its own
/// sampling error is that of three scenes.
#[test]
fn scenes_have_as_many_detections_as_an_independent_simulator() {
    const SEEDS: u32 = 12;
    let expected = [
        ("default", 962.0),
        ("rocks-200", 461.0),
        ("rocks-1000", 1796.0),
        ("rocks-2000", 3466.0),
        ("clutter-0", 836.0),
        ("clutter-10", 1278.0),
        ("pd-0.5", 591.0),
        ("views-2", 110.0),
        ("views-5", 92.0),
        ("views-15", 339.0),
        ("views-120", 2571.0),
        ("long-range", 1588.0),
        ("outliers", 969.0),
    ];
    for (name, mean) in expected {
        let mut scene = scene(name);
        let counts: Vec<f64> = (0..SEEDS)
            .map(|seed| {
                scene.seed = u64::from(seed);
                f64::from(u32::try_from(simulate(&scene).detections.len()).unwrap())
            })
            .collect();
        let n = f64::from(SEEDS);
        let found = counts.iter().sum::<f64>() / n;
        let variance = counts.iter().map(|c| (c - found).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n + variance / 3.0).sqrt();
        assert!(
            (found - mean).abs() < 3.0 * error,
            "{name}: {found} +- {error}, expected {mean}"
        );
    }
}

#[test]
fn clusters_are_denser_than_chance() {
    let text = "[rocks]\nnumber = 400\nclusters = { parents = 10, sigma_m = 0.5 }\n";
    let neighbours = |text: &str| {
        let simulation = simulate(&Scene::parse(text, "scene.toml").unwrap());
        let rocks = simulation.rocks;
        let near = |a: &Rock, b: &Rock| a.place.horizontal_distance(b.place) < 1.0;
        let pairs = rocks
            .iter()
            .map(|a| rocks.iter().filter(|b| near(a, b)).count());
        pairs.sum::<usize>() / rocks.len()
    };
    assert!(neighbours(text) > 5 * neighbours("[rocks]\nnumber = 400\n"));
}

#[test]
fn rocks_that_may_not_overlap_do_not() {
    let rocks = simulate(&scene("tiny")).rocks;
    for (i, a) in rocks.iter().enumerate() {
        for b in &rocks[..i] {
            let gap = a.place.horizontal_distance(b.place);
            assert!(gap > 0.5 * (a.diameter_m + b.diameter_m));
        }
    }
}

/// One rock behind a larger one, and one beside it.
#[test]
fn a_nearer_rock_hides_the_one_behind() {
    let text = "[rocks]\nnumber = 50\narea = { west_m = 5, east_m = 11, south_m = -2, north_m = 2 }\n\
                diameter = { min_m = 0.4, mean_excess_m = 0.2 }\noverlap = false\n\
                [detector]\np_max = 1\npx50 = 0\nclutter_per_image = 0\n\
                [platforms.r]\nstations = 1\npans_deg = [0]\n";
    let count = |hide: &str| {
        let text = text.replace("p_max = 1", &format!("p_max = 1\n{hide}"));
        let simulation = simulate(&Scene::parse(&text, "scene.toml").unwrap());
        simulation.detections.len()
    };
    let (all, seen) = (count(""), count("rocks_hide = true"));
    assert!(seen < all - 3 && seen > all / 3, "{seen} of {all}");
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            let bytes = fs::read(&path).unwrap();
            found.insert(path, bytes);
        }
    }
    found
}

fn written(simulation: &Simulation, threads: usize) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap()
        .install(|| write(simulation, folder.path()))
        .unwrap();
    let strip = |path: &Path| path.strip_prefix(folder.path()).unwrap().to_owned();
    let all = files(folder.path());
    all.into_iter()
        .map(|(p, bytes)| (strip(&p), bytes))
        .collect()
}

#[test]
fn the_same_scene_is_the_same_bytes_at_any_number_of_threads() {
    let mut scene = scene("tiny");
    scene.ground.roughness_m = 0.02;
    scene.ground.model = TerrainModel::Raster {
        post_m: 0.5,
        error_m: 0.01,
        error_length_m: 5.0,
    };
    scene.platforms[0].stations = 2;
    let first = written(&simulate(&scene), 1);
    let second = written(&simulate(&scene), 3);
    assert!(first == second);
    let names: Vec<String> = first.keys().map(|p| p.display().to_string()).collect();
    assert_eq!(
        names,
        [
            "cameras.toml",
            "detections.csv",
            "images/rover_0000.jpg",
            "images/rover_0001.jpg",
            "labels.csv",
            "pipeline.toml",
            "poses.csv",
            "poses_true.csv",
            "terrain.tif",
            "truth.csv"
        ]
    );
    // Pictures, and the noise of the poses, change nothing of what the detector does.
    scene.render = None;
    scene.poses.scale = 3.0;
    let bare = written(&simulate(&scene), 2);
    for name in ["detections.csv", "labels.csv", "truth.csv"] {
        assert!(first[Path::new(name)] == bare[Path::new(name)]);
    }
    assert!(first[Path::new("poses.csv")] != bare[Path::new("poses.csv")]);
}

/// The columns of a CSV file without quotes.
fn columns(text: &[u8]) -> BTreeMap<String, Vec<String>> {
    let text = std::str::from_utf8(text).unwrap();
    let mut lines = text
        .lines()
        .map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header: Vec<String> = lines.next().unwrap();
    let mut columns: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in lines {
        for (name, value) in header.iter().zip(line) {
            columns.entry(name.clone()).or_default().push(value);
        }
    }
    columns
}

/// What is written, read by the letter of the formats: true poses, cameras and truth project onto
/// the boxes of the labels. The rounding of the files is far below the noise.
#[test]
fn the_files_say_what_the_formats_mean() {
    let mut scene = scene("demo");
    scene.render = None;
    scene.poses.key = PoseKey::Image;
    scene.detector.pixel_px = 0.0;
    scene.detector.extent = BoxExtent::Body;
    let simulation = simulate(&scene);
    let folder = tempfile::tempdir().unwrap();
    write(&simulation, folder.path()).unwrap();
    let table = |name: &str| columns(&fs::read(folder.path().join(name)).unwrap());
    let (poses, truth) = (table("poses_true.csv"), table("truth.csv"));
    let (labels, detections) = (table("labels.csv"), table("detections.csv"));
    let camera = &read_camera_file(&folder.path().join("cameras.toml"), "cameras.toml")
        .unwrap()
        .cameras["mast"];
    let number =
        |t: &BTreeMap<String, Vec<String>>, c: &str, i: usize| -> f64 { t[c][i].parse().unwrap() };
    let place = |t: &BTreeMap<String, Vec<String>>, i: usize| {
        let [lat, lon, alt] = ["lat_deg", "lon_deg", "alt_m"].map(|c| number(t, c, i));
        Geodetic::from_degrees(lat, lon, alt)
    };
    let site = Site::new(scene.site.planet(), scene.site.origin());
    let mut checked = 0;
    for i in 0..labels["det_id"].len() {
        let object = &labels["object_id"][i];
        if object == NO_OBJECT {
            continue;
        }
        let rock = truth["object_id"].iter().position(|o| o == object).unwrap();
        let image = &detections["image_id"][i];
        assert_eq!(image, &labels["image_id"][i]);
        let pose = poses["image_id"].iter().position(|p| p == image).unwrap();
        let at = place(&poses, pose);
        let q = ["qw", "qx", "qy", "qz"].map(|c| number(&poses, c, pose));
        let attitude = Rotation::<LocalEnu, Body>::from_scalar_first(q).unwrap();
        let enu_from_body = crate::frame::RigidTransform::new(
            site.enu_from_local(at) * attitude,
            crate::frame::Vector::from_xyz(site.enu(at).xyz),
        );
        let pose = enu_from_body
            * camera
                .mount
                .body_from_camera(crate::camera::PanTilt::default());
        let seen = camera
            .pixel(pose.inverse() * site.enu(place(&truth, rock)))
            .unwrap();
        let [x_min, x_max] = ["x_min", "x_max"].map(|c| number(&detections, c, i));
        let [y_min, y_max] = ["y_min", "y_max"].map(|c| number(&detections, c, i));
        assert!((0.5 * (x_min + x_max) - seen.u).abs() < 0.02);
        assert!((0.5 * (y_min + y_max) - seen.v).abs() < 0.02);
        checked += 1;
    }
    assert!(checked > 100);
}

#[test]
fn a_log_keyed_by_time_has_images() {
    let mut scene = scene("demo");
    scene.render = None;
    let files = written(&simulate(&scene), 1);
    let images = columns(&files[Path::new("images.csv")]);
    let poses = columns(&files[Path::new("poses.csv")]);
    assert_eq!(images["time"], poses["time"]);
    assert_eq!(images["pan_deg"][0], "-97.000000");
    assert!(!poses.contains_key("image_id"));
    let pipeline = std::str::from_utf8(&files[Path::new("pipeline.toml")]).unwrap();
    assert!(pipeline.contains("images = \"images.csv\"\n"));
}

#[test]
fn the_pipeline_file_is_told_the_scene() {
    let files = written(&simulate(&scene("heights-05")), 1);
    let text = std::str::from_utf8(&files[Path::new("pipeline.toml")]).unwrap();
    assert_eq!(
        text,
        "# Runs the simulated data set of this folder, with the noise of its scene.\n\
         \n[site]\nname = \"heights-05\"\n\
         origin = { lat_deg = -24.45, lon_deg = -69.93, height_m = 1000.0 }\nbody = \"earth\"\n\
         \n[input]\nposes = \"poses.csv\"\ncameras = \"cameras.toml\"\n\
         detections = \"detections.csv\"\n\
         \n[terrain]\nplane_m = 1000.0\nheight_sigma_m = 0.05\n\
         \n[view]\naim = \"center\"\nmax_range_m = 14.0\n\
         \n[noise]\npixel_px = 1.5\npose = { east_m = 0.05, north_m = 0.05, up_m = 0.02, \
         roll_deg = 0.25, pitch_deg = 0.25, yaw_deg = 0.4 }\n\
         \n[fusion]\npose_correction = \"per-view\"\n\
         \n[output]\ndir = \"map\"\nannotate = false\n"
    );
}

/// The silhouette of a rendered rock against its box, rock by rock: left and right edge to a pixel,
/// and its top within the box's.
#[test]
fn a_rendered_rock_fills_its_box() {
    let mut largest = 0.0f64;
    for seed in 0..24 {
        let text = format!(
            "seed = {seed}\n\
             [rocks]\nnumber = 1\narea = {{ west_m = 7, east_m = 9, south_m = -0.3, north_m = 0.3 }}\n\
             diameter = {{ min_m = 0.3, mean_excess_m = 0.05 }}\nirregularity = 0.8\n\
             [cameras.mast]\nwidth = 320\nheight = 240\nhfov_deg = 12\npitch_down_deg = 14\n\
             [platforms.r]\nstations = 1\npans_deg = [0]\n[render]\n"
        );
        let scene = Scene::parse(&text, "scene.toml").unwrap();
        let simulation = simulate(&scene);
        let view = &simulation.views[0];
        let camera = &scene.cameras[0];
        let seen = appearance(camera, &view.enu_from_camera(&scene), &simulation.rocks[0]).unwrap();
        let picture = render(&simulation, &scene.render.unwrap(), 0);
        let pixels = (0..240u32).flat_map(|v| (0..320u32).map(move |u| (u, v)));
        let of_rock: Vec<(f64, f64)> = pixels
            .zip(&picture.rock)
            .filter(|(_, rock)| rock.is_some())
            .map(|((u, v), _)| (f64::from(u), f64::from(v)))
            .collect();
        let u = |pick: fn(f64, f64) -> f64, start| of_rock.iter().map(|p| p.0).fold(start, pick);
        // Pixel centres inside: the edges lie up to half a pixel farther out.
        let left = u(f64::min, f64::INFINITY) - 0.5;
        let right = u(f64::max, f64::NEG_INFINITY) + 0.5;
        let half = 0.5 * seen.width_px;
        largest = largest.max((left - (seen.centre.u - half)).abs());
        largest = largest.max((right - (seen.centre.u + half)).abs());
        let top = of_rock.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let share = (seen.centre.v - top) / seen.above_px;
        assert!((0.7..1.03).contains(&share), "{share}");
        let bottom = of_rock.iter().map(|p| p.1).fold(0.0, f64::max) + 0.5;
        assert!((bottom - seen.centre.v - seen.below_px).abs() <= 1.5);
        assert!(seen.width_px > 40.0);
    }
    assert!(largest <= 1.0, "{largest}");
}
