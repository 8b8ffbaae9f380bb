//! The pipeline file of a simulated data set.

use std::fmt::Write;

use super::scene::{BoxExtent, PoseKey, Scene, TerrainModel};
use super::{Simulation, appearance};

/// A pipeline that runs the data set it stands beside, told the scene's own noise, but neither its
/// drift's length nor anything of its rocks.
pub(super) fn pipeline_toml(simulation: &Simulation) -> String {
    let scene = &simulation.scene;
    let origin = scene.site.origin();
    let mut text = format!(
        "# Runs the simulated data set of this folder, with the noise of its scene.\n\
         \n[site]\nname = \"{}\"\n\
         origin = {{ lat_deg = {:?}, lon_deg = {:?}, height_m = {:?} }}\nbody = \"{}\"\n",
        scene.name.escape_default(),
        degrees(origin.lat_deg()),
        degrees(origin.lon_deg()),
        origin.height_m,
        scene.site.planet().name,
    );
    text.push_str("\n[input]\nposes = \"poses.csv\"\n");
    if scene.poses.key == PoseKey::Time {
        text.push_str("images = \"images.csv\"\n");
    }
    text.push_str("cameras = \"cameras.toml\"\ndetections = \"detections.csv\"\n\n[terrain]\n");
    // Writing to a string does not fail.
    let _ = match scene.ground.model {
        TerrainModel::Plane => writeln!(text, "plane_m = {:?}", scene.ground.height_m),
        TerrainModel::Raster { .. } => writeln!(text, "path = \"terrain.tif\""),
    };
    let _ = writeln!(text, "height_sigma_m = {:?}", height_sigma_m(scene));
    view(simulation, &mut text);
    noise(scene, &mut text);
    let correction = if scene.poses.drift_share > 0.0 {
        "drift"
    } else {
        "per-view"
    };
    let _ = write!(
        text,
        "\n[fusion]\npose_correction = \"{correction}\"\n\
         \n[output]\ndir = \"map\"\nannotate = {}\n",
        scene.render.is_some(),
    );
    text
}

fn view(simulation: &Simulation, text: &mut String) {
    let scene = &simulation.scene;
    let detector = &scene.detector;
    text.push_str("\n[view]\n");
    let _ = match detector.extent {
        BoxExtent::Body => writeln!(text, "aim = \"center\""),
        BoxExtent::Visible => writeln!(text, "aim = {:?}", mean_aim(simulation)),
    };
    if detector.min_range_m > 0.0 {
        let _ = writeln!(text, "min_range_m = {:?}", detector.min_range_m);
    }
    let _ = writeln!(text, "max_range_m = {:?}", detector.max_range_m);
    if scene.poses.key == PoseKey::Time {
        let gaps = scene.platforms.iter().map(|p| p.station_s.max(p.pan_s));
        let _ = writeln!(text, "max_gap_s = {:?}", gaps.fold(1.0, f64::max));
    }
}

/// Where in their boxes the detected rocks' points of the ground lie on average.
fn mean_aim(simulation: &Simulation) -> f64 {
    let scene = &simulation.scene;
    let aims: Vec<f64> = simulation
        .detections
        .iter()
        .filter_map(|detection| {
            let view = &simulation.views[detection.view];
            let camera = &scene.cameras[view.camera];
            let rock = &simulation.rocks[detection.rock?];
            let seen = appearance(camera, &view.enu_from_camera(scene), rock)?;
            Some(seen.aim(scene.detector.extent))
        })
        .collect();
    let number = f64::from(u32::try_from(aims.len()).unwrap_or(u32::MAX));
    let mean = aims.iter().sum::<f64>() / number.max(1.0);
    (mean * 100.0).round() / 100.0
}

fn noise(scene: &Scene, text: &mut String) {
    let s = scene.poses.sigma.scaled(scene.poses.scale);
    let _ = write!(
        text,
        "\n[noise]\npixel_px = {:?}\npose = {{ east_m = {:?}, north_m = {:?}, up_m = {:?}, \
         roll_deg = {:?}, pitch_deg = {:?}, yaw_deg = {:?} }}\n",
        scene.detector.pixel_px,
        rounded(s.east_m),
        rounded(s.north_m),
        rounded(s.up_m),
        rounded(s.roll.to_degrees()),
        rounded(s.pitch.to_degrees()),
        rounded(s.yaw.to_degrees()),
    );
}

/// How far a rock's ground deviates from what the run is told, one standard deviation, and never
/// less than 2 mm, so that heights keep a finite weight.
fn height_sigma_m(scene: &Scene) -> f64 {
    let ground = &scene.ground;
    let unknown_m = match ground.model {
        TerrainModel::Plane => ground.roughness_m,
        TerrainModel::Raster { error_m, .. } => error_m,
    };
    rounded(ground.rock_deviation_m.hypot(unknown_m).max(0.002))
}

/// Without the last digits that conversions to radians and back leave.
fn rounded(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

fn degrees(x: f64) -> f64 {
    (x * 1e12).round() / 1e12
}
