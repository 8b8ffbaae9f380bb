//! What a scene is made of.

use crate::camera::Camera;
use crate::frame::Site;
use crate::pose::PoseSigma;

use super::diameters::DiameterLaw;

/// Everything a simulation depends on: the same scene gives the same bytes.
#[derive(Debug, Clone)]
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// From which all randomness follows.
    pub seed: u64,
    /// The site, whose local frame the scene's metres are in.
    pub site: Site,
    /// The rocks.
    pub rocks: RockPlan,
    /// The ground, and the model of it.
    pub ground: GroundPlan,
    /// The cameras, sorted by name.
    pub cameras: Vec<Camera>,
    /// The platforms, in the order of the file.
    pub platforms: Vec<Platform>,
    /// The errors of the measured poses.
    pub poses: PosePlan,
    /// The detector.
    pub detector: Detector,
    /// How pictures are rendered; none are where absent.
    pub render: Option<RenderPlan>,
}

/// A rectangle of the ground, in ENU metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Its western edge.
    pub west_m: f64,
    /// Its eastern edge.
    pub east_m: f64,
    /// Its southern edge.
    pub south_m: f64,
    /// Its northern edge.
    pub north_m: f64,
}

impl Area {
    /// Square metres.
    pub fn size_m2(&self) -> f64 {
        (self.east_m - self.west_m) * (self.north_m - self.south_m)
    }

    /// Whether a place lies in it.
    pub fn holds(&self, east_m: f64, north_m: f64) -> bool {
        (self.west_m..=self.east_m).contains(&east_m)
            && (self.south_m..=self.north_m).contains(&north_m)
    }
}

/// How rocks lie on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct RockPlan {
    /// How many.
    pub number: usize,
    /// Where.
    pub area: Area,
    /// How large.
    pub diameter: DiameterLaw,
    /// In clusters, or uniformly.
    pub clusters: Option<Clusters>,
    /// Whether one may lie across another.
    pub overlap: bool,
    /// Height above the ground by diameter.
    pub height_ratio: f64,
    /// How far outlines depart from circles, 0 to 1.
    pub irregularity: f64,
    /// The class of the detections and of the truth.
    pub class: String,
}

/// A Thomas process (Neyman-Scott with normal clusters): parents uniform over the area, every rock
/// normally distributed about one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clusters {
    /// How many.
    pub parents: usize,
    /// Standard deviation of a rock's place about its parent, along each axis, metres.
    pub sigma_m: f64,
    /// The share of rocks in clusters; the others are uniform.
    pub share: f64,
}

/// The true ground and the model of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPlan {
    /// Height above the ellipsoid at the origin, metres.
    pub height_m: f64,
    /// Steepness of its mean plane, radians.
    pub slope: f64,
    /// The direction in which it rises, radians clockwise from north.
    pub slope_azimuth: f64,
    /// Root mean square of its undulations, metres.
    pub roughness_m: f64,
    /// Their coarsest scale, metres.
    pub roughness_length_m: f64,
    /// Standard deviation of each rock's own ground from that surface, metres: new for every rock.
    pub rock_deviation_m: f64,
    /// What the run is given.
    pub model: TerrainModel,
}

impl GroundPlan {
    /// A surface of constant height, which the run is told.
    pub fn flat(height_m: f64) -> Self {
        Self {
            height_m,
            slope: 0.0,
            slope_azimuth: 0.0,
            roughness_m: 0.0,
            roughness_length_m: 5.0,
            rock_deviation_m: 0.0,
            model: TerrainModel::Plane,
        }
    }
}

/// What a run knows of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TerrainModel {
    /// A surface of constant height, that of the true ground at the origin.
    Plane,
    /// A height model, written as `terrain.tif`.
    Raster {
        /// The spacing of its posts, metres.
        post_m: f64,
        /// Root mean square of its smooth error, metres.
        error_m: f64,
        /// The error's coarsest scale, metres.
        error_length_m: f64,
    },
}

/// A rover's traverse and what it looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct Platform {
    /// Its name, with which its images' names begin.
    pub name: String,
    /// Indices of its cameras in [`Scene::cameras`]; each takes a picture at each pan of a station.
    pub cameras: Vec<usize>,
    /// The way it goes.
    pub path: Path,
    /// How many stations.
    pub stations: usize,
    /// The way between two, metres.
    pub spacing_m: f64,
    /// The pans of a station in turn, radians clockwise seen from above.
    pub pans: Vec<f64>,
    /// Height of the body's origin above the ground, metres.
    pub height_m: f64,
    /// Whether it rolls and pitches with the ground, or stays level.
    pub follows_ground: bool,
    /// Time of its first image, seconds since 1970.
    pub start_s: f64,
    /// Seconds from one station's first image to the next's.
    pub station_s: f64,
    /// Seconds from one pan to the next.
    pub pan_s: f64,
}

/// The way a platform goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// A straight line that sways.
    Line {
        /// Where it starts, east and north, metres.
        start_m: [f64; 2],
        /// Its direction, radians clockwise from north.
        azimuth: f64,
        /// How far it sways to the left, `sway_m sin(x / sway_scale_m)` at `x` along the line.
        sway_m: f64,
        /// See `sway_m`, metres.
        sway_scale_m: f64,
        /// How far the heading sways to the left, radians, `yaw_sway sin(x / yaw_sway_scale_m)`.
        yaw_sway: f64,
        /// See `yaw_sway`, metres.
        yaw_sway_scale_m: f64,
    },
    /// Straight legs between places, east and north, metres; the heading is that of the leg.
    Waypoints(Vec<[f64; 2]>),
}

/// How the measured poses err.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosePlan {
    /// One standard deviation, before `scale`.
    pub sigma: PoseSigma,
    /// Multiplies all of them.
    pub scale: f64,
    /// The share of the variance that drifts from station to station; the rest is new in each view.
    pub drift_share: f64,
    /// After how many stations the drift's correlation has fallen to 1/e (Ornstein-Uhlenbeck).
    pub drift_stations: f64,
    /// Whether `poses.csv` carries the standard deviations.
    pub write_sigmas: bool,
    /// What `poses.csv` is keyed by.
    pub key: PoseKey,
}

/// What `poses.csv` is keyed by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseKey {
    /// The image: the pan is part of the pose.
    Image,
    /// The time: the pan stands in `images.csv`.
    Time,
}

/// A detector of rocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    /// The probability of detecting a large rock.
    pub p_max: f64,
    /// The apparent diameter at which it is half of that, pixels.
    pub px50: f64,
    /// The width of the logistic curve between, pixels.
    pub px_width: f64,
    /// The nearest ground range at which it detects, metres.
    pub min_range_m: f64,
    /// The farthest, metres.
    pub max_range_m: f64,
    /// Mean number of false alarms an image, before those beyond the range are dropped.
    pub clutter_per_image: f64,
    /// Median apparent diameter of a false alarm, pixels.
    pub clutter_px: f64,
    /// Standard deviation of its logarithm.
    pub clutter_sigma: f64,
    /// Standard deviation of a box's centre along each axis, pixels.
    pub pixel_px: f64,
    /// The share of boxes whose centre errs `outlier_factor` times as much.
    pub outlier_share: f64,
    /// See `outlier_share`.
    pub outlier_factor: f64,
    /// Standard deviation of the logarithm of a box's size.
    pub box_sigma: f64,
    /// Scores of true detections.
    pub score_true: ScoreLaw,
    /// Scores of false ones.
    pub score_false: ScoreLaw,
    /// What hides a rock.
    pub occlusion: Occlusion,
    /// What becomes of boxes that reach beyond the picture.
    pub border: Border,
    /// What a box is drawn around.
    pub extent: BoxExtent,
}

/// A logit-normal law of scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreLaw {
    /// The median.
    pub median: f64,
    /// Standard deviation of the logit.
    pub spread: f64,
}

/// What may hide a rock from a camera: one more than half hidden is not detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Occlusion {
    /// Nearer rocks do.
    pub rocks: bool,
    /// The ground does.
    pub ground: bool,
}

/// What a box is drawn around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxExtent {
    /// The whole body with its buried half: the rock's point of the ground is the box's centre.
    Body,
    /// What stands out of the ground, as detectors draw it: the rock's point of the ground lies
    /// below the box's centre, the lower the flatter it is seen.
    Visible,
}

/// What becomes of a box that reaches beyond the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Border {
    /// It stays as it is.
    Keep,
    /// It is cut at the picture's edge, so that its centre moves.
    Clip,
    /// There is no such detection.
    Drop,
}

/// How pictures are rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderPlan {
    /// The pictures' format.
    pub format: PictureFormat,
    /// The sun's azimuth, radians clockwise from north.
    pub sun_azimuth: f64,
    /// The sun's elevation, radians.
    pub sun_elevation: f64,
    /// The colours.
    pub palette: Palette,
    /// Pebbles too small to be rocks, a square metre.
    pub pebbles_per_m2: f64,
    /// Standard deviation of the sensor's noise, grey levels of 255.
    pub sensor_noise: f64,
}

/// A format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Lossless.
    Png,
    /// JPEG of quality 92.
    Jpeg,
}

impl PictureFormat {
    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// The colours of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// Atacama: pale ochre ground, grey-brown rocks, blue sky.
    Desert,
    /// Mars: rust ground, dark basalt, butterscotch sky.
    Mars,
    /// The Moon: grey ground, black sky.
    Moon,
}
