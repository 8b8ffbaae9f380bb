//! What one input needs of another.

use super::config::Config;
use super::read::{Faults, Inputs, Read};
use crate::detection::{Detection, DetectionFile, Mark};
use crate::error::{Error, Fault, Place};
use crate::pose::PoseFile;
use crate::view::View;

/// What one file needs of another.
pub(super) fn cross_checks(
    config: &Config,
    poses: &[Read<PoseFile>],
    detections: &[Read<DetectionFile>],
    faults: &mut Faults,
) {
    let mut found = |file: &str, field: &str, found: &str, expected: &str| {
        let place = Place::file(file);
        faults
            .faults
            .push(Fault::found(place, field, found, expected));
    };
    let is_log = |file: &PoseFile| !file.is_per_image;
    if let Some((_, shown, _)) = poses.iter().find(|(_, _, file)| is_log(file)) {
        if config.input.images.is_empty() {
            found(
                shown,
                "time",
                "poses keyed by time",
                "[input] images to say when pictures were taken",
            );
        }
        if let Some((_, other, _)) = poses.iter().find(|(_, _, file)| !is_log(file)) {
            found(
                other,
                "image_id",
                "poses keyed by image",
                "one key in all pose files",
            );
        }
    }
    let level = poses.iter().find(|(_, _, file)| !file.has_attitude);
    let needs_heading = detections.iter().find(|(_, _, file)| !file.has_azimuth);
    if let (Some((_, shown, _)), Some((_, other, _))) = (level, needs_heading) {
        let expected = format!("an attitude, since {other} gives no azimuth_deg");
        found(shown, "qw", "no attitude", &expected);
    }
    let spec = &config.terrain;
    let in_pixels = |(_, _, file): &&Read<DetectionFile>| {
        let needs =
            |d: &Detection| d.range_m.is_none() && matches!(d.mark, Mark::Box(_) | Mark::Point(_));
        file.detections.iter().any(needs)
    };
    if let Some((_, shown, _)) = detections.iter().find(in_pixels) {
        if spec.path.is_empty() && spec.plane_m.is_none() {
            found(
                shown,
                "",
                "detections in pixels",
                "a ground for them: [terrain] plane_m or path",
            );
        }
        if config.input.cameras.is_empty() {
            found(shown, "", "detections in pixels", "[input] cameras");
        }
    }
}

impl Inputs {
    /// What the views need that only shows once they stand.
    pub(super) fn check_views(&self, config: &Config) -> Result<(), Error> {
        self.check_terrain(config)?;
        let headless = |v: &&View| v.camera.is_none() && !v.pose.has_heading;
        if config.view.fov_deg < 360.0
            && let Some(view) = self.views.iter().find(headless)
        {
            let found = format!(
                "{}, and image {} without a heading",
                config.view.fov_deg, view.image_id
            );
            let fault = Fault::found(
                Place::default(),
                "view.fov_deg",
                found,
                "360 where the poses carry no attitude",
            );
            return Err(fault.into());
        }
        Ok(())
    }

    /// A terrain model that no view can see belongs to another site.
    fn check_terrain(&self, config: &Config) -> Result<(), Error> {
        let Some(terrain) = &self.terrain else {
            return Ok(());
        };
        let away = |view: &View| terrain.distance_to(view.origin());
        let Some(nearest_m) = self.views.iter().map(away).min_by(f64::total_cmp) else {
            return Ok(());
        };
        if nearest_m <= config.reach().limit_m() {
            return Ok(());
        }
        let shown: Vec<&str> = config
            .terrain
            .path
            .iter()
            .map(|s| s.shown.as_str())
            .collect();
        let place = Place::file(shown.join(", "));
        let found = format!("a model {:.1} km from the nearest view", nearest_m / 1e3);
        Err(Fault::found(place, "", found, "one that covers the site").into())
    }
}
