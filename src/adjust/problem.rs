//! What was measured, by which views, over which ground.

use nalgebra::{Vector2, Vector3};

use super::Surface;
use crate::detection::{Aim, Cut, Detection, Mark, PixelBox};
use crate::frame::Pixel;
use crate::project::{LineOfSight, Miss, Range, Settings, sight};
use crate::view::View;

/// Boxes nearer than this to the picture's border may be cut by it, pixels; they say no size.
const CUT_MARGIN_PX: f64 = 1.0;

/// Views, what they measured, and the ground.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The views, with their poses as measured.
    pub views: &'a [View],
    /// The measurements, by view.
    pub measurements: &'a [Measurement],
    /// The ground.
    pub surface: &'a dyn Surface,
    /// Standard deviation of the heights of objects above the surface, metres; zero pins them to it.
    pub height_sigma_m: f64,
    /// Greatest ground range in which the detector is trusted, metres; infinite for none.
    pub max_range_m: f64,
    /// Least such range, metres.
    pub min_range_m: f64,
}

impl Problem<'_> {
    /// Whether objects lie on the surface itself and have two unknowns, not three.
    pub fn is_pinned(&self) -> bool {
        self.height_sigma_m <= 0.0
    }

    /// How many unknowns an object has.
    pub fn n_unknowns(&self) -> f64 {
        if self.is_pinned() { 2.0 } else { 3.0 }
    }

    /// How far beyond its view an object may be looked for, metres.
    pub fn limit_m(&self) -> f64 {
        if self.max_range_m.is_finite() {
            self.max_range_m
        } else {
            crate::footprint::Reach::UNBOUNDED_M
        }
    }
}

/// One measurement of an object by a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Index of the view.
    pub view: usize,
    /// What was read.
    pub reading: Reading,
    /// Natural logarithm of the apparent width in pixels, where the mark shows a whole object.
    pub log_size: Option<f64>,
    /// The mark's box, where it is one.
    pub bounds: Option<PixelBox>,
    /// What the picture's border takes away of it.
    pub cut: Cut,
    /// What the detector says it is; measurements of one object share it, unless the detector takes
    /// classes for each other.
    pub class: usize,
    /// The detector's score, 0 to 1.
    pub score: Option<f64>,
}

/// What a detector read off a picture or a scan, with its standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// A raw pixel.
    Pixel {
        /// The pixel.
        pixel: Pixel,
        /// Standard deviations of column and row, pixels.
        sigma_px: Vector2<f64>,
        /// A slant range from the camera's centre beside it.
        range: Option<Range>,
    },
    /// A bearing with a slant range from the line of sight's origin.
    Bearing {
        /// Radians clockwise: from the body's forward axis in its x-y plane, or from true north.
        bearing: f64,
        /// Whether it counts from true north.
        is_azimuth: bool,
        /// Standard deviation, radians.
        sigma: f64,
        /// The range.
        range: Range,
    },
}

impl Reading {
    /// How many numbers were read.
    pub fn n_rows(&self) -> usize {
        match self {
            Self::Pixel { range: Some(_), .. } => 3,
            _ => 2,
        }
    }

    /// The numbers read: column, row and range, or bearing and range; zeros behind them.
    pub fn values(&self) -> Vector3<f64> {
        match *self {
            Self::Pixel { pixel, range, .. } => {
                Vector3::new(pixel.u, pixel.v, range.map_or(0.0, |r| r.range_m))
            }
            Self::Bearing { bearing, range, .. } => Vector3::new(bearing, range.range_m, 0.0),
        }
    }

    /// Their standard deviations; ones behind them.
    pub fn sigmas(&self) -> Vector3<f64> {
        match *self {
            Self::Pixel {
                sigma_px, range, ..
            } => Vector3::new(sigma_px.x, sigma_px.y, range.map_or(1.0, |r| r.sigma_m)),
            Self::Bearing { sigma, range, .. } => Vector3::new(sigma, range.sigma_m, 1.0),
        }
    }
}

impl Measurement {
    /// What a detection of a view measured.
    ///
    /// # Errors
    /// As [`sight`].
    pub fn new(
        detection: &Detection,
        (index, view): (usize, &View),
        settings: &Settings,
    ) -> Result<Self, Miss> {
        let sighting = sight(detection, view, settings)?;
        let reading = match sighting.line_of_sight {
            LineOfSight::Ray { sigma_px, .. } => Reading::Pixel {
                pixel: detection.aim_point(settings.aim).ok_or(Miss::NoCamera)?,
                sigma_px,
                range: sighting.range,
            },
            LineOfSight::Bearing {
                bearing,
                is_azimuth,
                sigma,
                ..
            } => Reading::Bearing {
                bearing,
                is_azimuth,
                sigma,
                range: sighting.range.ok_or(Miss::NoTerrain)?,
            },
        };
        Ok(Self {
            view: index,
            reading,
            log_size: log_size(detection, view),
            bounds: match detection.mark {
                Mark::Box(b) => Some(b),
                _ => None,
            },
            cut: cut(detection, view, &reading, settings.aim),
            class: 0,
            score: detection.score,
        })
    }
}

/// Boxes nearer than this to the picture's border are taken for cut by it: pixels, and standard
/// deviations of what is read off boxes, whichever is more.
const BORDER: (f64, f64) = (3.0, 2.0);

fn cut(detection: &Detection, view: &View, reading: &Reading, aim: Aim) -> Cut {
    match (detection.mark, view.camera.as_deref(), reading) {
        (Mark::Box(b), Some(camera), Reading::Pixel { sigma_px, .. }) => {
            let margin = BORDER.0.max(BORDER.1 * sigma_px.max());
            b.cut(camera.width, camera.height, margin, aim)
        }
        _ => Cut::NONE,
    }
}

fn log_size(detection: &Detection, view: &View) -> Option<f64> {
    let (Mark::Box(b), Some(camera)) = (detection.mark, view.camera.as_deref()) else {
        return None;
    };
    let is_whole = b.is_whole(camera.width, camera.height, CUT_MARGIN_PX);
    (is_whole && b.width() > 0.0).then(|| b.width().ln())
}
