//! What a mark says by itself, before it meets the ground.

use nalgebra::Vector2;

use super::{Miss, Settings};
use crate::camera::{Camera, RayJacobian};
use crate::detection::{Detection, Mark};
use crate::frame::{Body, Pixel, Point, Ray};
use crate::view::View;

/// A mark in body axes.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Where it points.
    pub line_of_sight: LineOfSight,
    /// How far, if the detector measured that.
    pub range: Option<Range>,
}

/// Where a sighting points.
#[derive(Debug, Clone, Copy)]
pub enum LineOfSight {
    /// Along a ray.
    Ray {
        /// The ray in body axes.
        ray: Ray<Body>,
        /// Derivatives of its origin and unit direction by the pixel, in body axes.
        by_pixel: RayJacobian,
        /// Standard deviations of column and row, pixels.
        sigma_px: Vector2<f64>,
    },
    /// Along a bearing whose elevation is not known.
    Bearing {
        /// Where it starts.
        origin: Point<Body>,
        /// Clockwise from the body's forward axis in the body's x-y plane, or from true north in
        /// the horizontal plane at the platform's own place; radians.
        bearing: f64,
        /// Whether it counts from true north.
        is_azimuth: bool,
        /// Standard deviation, radians.
        sigma: f64,
    },
}

/// A measured slant range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// From the line of sight's origin, metres.
    pub range_m: f64,
    /// Standard deviation, metres.
    pub sigma_m: f64,
}

/// The sighting of a detection in its view.
///
/// # Errors
/// A mark outside its picture or lens, a score too low, a mark that the view cannot place.
pub fn sight(detection: &Detection, view: &View, settings: &Settings) -> Result<Sighting, Miss> {
    if let Some(score) = detection.score
        && score < settings.min_score
    {
        let min_score = settings.min_score;
        return Err(Miss::LowScore { score, min_score });
    }
    let range = detection.range_m.map(|range_m| Range {
        range_m,
        sigma_m: detection.sigma.range_m.unwrap_or(settings.noise.range_m),
    });
    let line_of_sight = match detection.mark {
        Mark::Box(_) | Mark::Point(_) => ray(detection, view, settings)?,
        Mark::Bearing(bearing) if view.pose.has_heading => {
            along(detection, view, settings, bearing, false)
        }
        Mark::Bearing(_) => return Err(Miss::NoHeading),
        Mark::Azimuth(azimuth) => along(detection, view, settings, azimuth, true),
    };
    Ok(Sighting {
        line_of_sight,
        range,
    })
}

fn ray(detection: &Detection, view: &View, settings: &Settings) -> Result<LineOfSight, Miss> {
    let camera = view.camera.as_deref().ok_or(Miss::NoCamera)?;
    let body_from_camera = view.body_from_camera().ok_or(Miss::NoCamera)?;
    inside(detection, camera)?;
    let aim = detection.aim_point(settings.aim).ok_or(Miss::NoCamera)?;
    let (ray, by_pixel) = camera.ray_with_jacobian(aim)?;
    let sigma = |own: Option<f64>| own.unwrap_or(settings.noise.pixel_px);
    Ok(LineOfSight::Ray {
        ray: body_from_camera * ray,
        by_pixel: by_pixel.turned(&body_from_camera.rotation.matrix()),
        sigma_px: Vector2::new(sigma(detection.sigma.u_px), sigma(detection.sigma.v_px)),
    })
}

/// A mark must lie at least partly in its picture; where it leaves it, its true centre is kept.
fn inside(detection: &Detection, camera: &Camera) -> Result<(), Miss> {
    let (width, height) = (camera.width, camera.height);
    let found = match detection.mark {
        Mark::Box(b) if !b.meets(width, height) => {
            format!("a box {} {} {} {}", b.x_min, b.y_min, b.x_max, b.y_max)
        }
        Mark::Point(Pixel { u, v }) if !Pixel::new(u, v).is_inside(width, height) => {
            format!("a point {u} {v}")
        }
        _ => return Ok(()),
    };
    Err(Miss::OutsidePicture {
        found,
        width,
        height,
    })
}

fn along(
    detection: &Detection,
    view: &View,
    settings: &Settings,
    bearing: f64,
    is_azimuth: bool,
) -> LineOfSight {
    LineOfSight::Bearing {
        origin: view
            .body_from_camera()
            .map_or(Point::origin(), |t| t.origin()),
        bearing,
        is_azimuth,
        sigma: detection.sigma.bearing.unwrap_or(settings.noise.bearing),
    }
}
