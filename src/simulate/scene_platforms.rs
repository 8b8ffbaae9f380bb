//! The platforms of a scene file.

use crate::input::Section;

use super::scene::{Path, Platform};
use super::scene_file::{above_zero, count, degrees, metres, not_below_zero};

/// The platforms of a scene in the order of the file; one named `rover` with all defaults where it
/// names none. `cameras` are the names of the scene's cameras.
pub(super) fn platforms(section: &Section, cameras: &[String]) -> Vec<Platform> {
    let named: Vec<Platform> = section
        .sections()
        .into_iter()
        .map(|(name, platform_section)| platform(&name, platform_section, cameras))
        .collect();
    if named.is_empty() {
        return vec![platform("rover", section.section("rover"), cameras)];
    }
    named
}

fn platform(name: &str, section: Section, cameras: &[String]) -> Platform {
    let pans = section.number_list("pans_deg");
    if pans.as_ref().is_some_and(Vec::is_empty) {
        section.fault("pans_deg", "an empty list", "at least one angle");
    }
    let pans = pans.unwrap_or_else(|| vec![30.0, 0.0, -30.0]);
    let platform = Platform {
        name: name.to_owned(),
        cameras: carried(&section, cameras),
        path: path(section.section("path")),
        stations: count(&section, "stations", 1).unwrap_or(15),
        spacing_m: not_below_zero(&section, "spacing_m", 2.0),
        pans: pans.into_iter().map(f64::to_radians).collect(),
        height_m: section
            .number("height_m", -1e3..=1e5, "-1000 to 100000")
            .unwrap_or(2.0),
        follows_ground: section.boolean("follows_ground").unwrap_or(false),
        start_s: start(&section),
        station_s: above_zero(&section, "station_s", 60.0),
        pan_s: above_zero(&section, "pan_s", 5.0),
    };
    section.finish();
    platform
}

/// The cameras a platform carries: those it names, or the first of the scene.
fn carried(section: &Section, cameras: &[String]) -> Vec<usize> {
    let Some(names) = section.texts("cameras") else {
        return vec![0];
    };
    let known = cameras.join(", ");
    names
        .iter()
        .filter_map(|name| {
            let index = cameras.iter().position(|c| c == name);
            if index.is_none() {
                section.fault("cameras", format!("{name:?}"), format!("one of {known}"));
            }
            index
        })
        .collect()
}

fn start(section: &Section) -> f64 {
    // A morning of the traverse that the field test of Thompson and Wettergreen (2005) was part of.
    const DEFAULT_S: f64 = 1_128_870_000.0;
    let Some(text) = section.text("start_time") else {
        return DEFAULT_S;
    };
    match text.parse::<jiff::Timestamp>() {
        #[expect(clippy::cast_precision_loss, reason = "milliseconds of the calendar")]
        Ok(stamp) => stamp.as_millisecond() as f64 / 1e3,
        Err(_) => {
            let expected = "a time such as 2005-10-09T15:00:00Z";
            section.fault("start_time", format!("{text:?}"), expected);
            DEFAULT_S
        }
    }
}

fn path(section: Section) -> Path {
    let east = section.number_list("waypoints_east_m");
    let north = section.number_list("waypoints_north_m");
    let start = section.numbers("start_m", &[2]).unwrap_or(vec![0.0, 0.0]);
    let line = Path::Line {
        start_m: [start[0], start[1]],
        azimuth: degrees(&section, "azimuth_deg", 360.0, 90.0),
        sway_m: metres(&section, "sway_m", 0.3),
        sway_scale_m: above_zero(&section, "sway_scale_m", 5.0),
        yaw_sway: section
            .number("yaw_sway_deg", -180.0..=180.0, "-180 to 180")
            .map_or(0.1, f64::to_radians),
        yaw_sway_scale_m: above_zero(&section, "yaw_sway_scale_m", 7.0),
    };
    let path = match (east, north) {
        (Some(east), Some(north)) => {
            if east.len() != north.len() || east.len() < 2 {
                let found = format!("{} and {} places", east.len(), north.len());
                section.fault(
                    "waypoints_north_m",
                    found,
                    "as many as waypoints_east_m, at least 2",
                );
            }
            Path::Waypoints(east.into_iter().zip(north).map(|(e, n)| [e, n]).collect())
        }
        (Some(_), None) if !section.has("waypoints_north_m") => {
            section.fault("waypoints_north_m", "nothing", "a list of finite numbers");
            line
        }
        (None, Some(_)) if !section.has("waypoints_east_m") => {
            section.fault("waypoints_east_m", "nothing", "a list of finite numbers");
            line
        }
        _ => line,
    };
    section.finish();
    path
}
