//! Belief fusion: the map and the errors of the poses together, from what views measured.
//!
//! Objects have four unknowns: east, north, up, and the logarithm of their size. Views have the six
//! errors of their poses. Which detection is of which object is summed over, not decided; how noisy
//! readings are, how dense objects and clutter, how often objects are detected is learnt on the way.
//!
//! The module knows no files. A [`Problem`](crate::adjust::Problem) holds views, measurements and a
//! ground; [`fuse_belief`] makes a [`Belief`] of it:
//!
//! ```
//! use std::sync::Arc;
//!
//! use nalgebra::{UnitQuaternion, Vector2};
//! use rockmap::adjust::{LevelPlane, Measurement, Problem, Reading};
//! use rockmap::camera::{Camera, Intrinsics, Lens, Mount, PanTilt, Pinhole};
//! use rockmap::detection::{Cut, PixelBox};
//! use rockmap::frame::{Point, RigidTransform, Rotation, Vector};
//! use rockmap::fuse::belief::{BeliefSettings, fuse_belief};
//! use rockmap::pose::{Pose, PoseSigma};
//! use rockmap::view::View;
//!
//! // A camera two metres above the ground that looks 20 degrees down, at six places along the way.
//! let intrinsics = Intrinsics { fx: 800.0, fy: 800.0, cx: 639.5, cy: 479.5 };
//! let camera = Arc::new(Camera {
//!     name: "mast".into(),
//!     width: 1280,
//!     height: 960,
//!     lens: Lens::Pinhole(Pinhole::new(intrinsics)?),
//!     mount: Mount::default(),
//!     readout: None,
//! });
//! let down = UnitQuaternion::from_euler_angles(0.0, 20f64.to_radians(), 0.0);
//! let view = |i: u32| View {
//!     image_id: format!("view{i}"),
//!     listed: ("poses.csv".into(), 1),
//!     time: None,
//!     platform: None,
//!     picture: None,
//!     camera: Some(camera.clone()),
//!     head: PanTilt::default(),
//!     pose: Pose {
//!         enu_from_body: RigidTransform::new(
//!             Rotation::from_unit_quaternion(down),
//!             Vector::new(f64::from(i), 0.0, 2.0),
//!         ),
//!         sigma: PoseSigma {
//!             east_m: 0.02,
//!             north_m: 0.02,
//!             up_m: 0.01,
//!             roll: 0.002,
//!             pitch: 0.002,
//!             yaw: 0.002,
//!         },
//!         has_heading: true,
//!     },
//!     enu_from_local: Rotation::identity(),
//! };
//! let views: Vec<View> = (0..6).map(view).collect();
//!
//! // Four rocks of 30 cm, which every view detects where it sees them.
//! let rocks = [[9.0, -1.0], [9.5, 1.5], [11.0, 0.2], [12.5, -2.0]];
//! let mut measurements = Vec::new();
//! for (index, view) in views.iter().enumerate() {
//!     for [east_m, north_m] in rocks {
//!         let place = Point::new(east_m, north_m, 0.0);
//!         let in_camera = view.enu_from_camera().expect("a camera").inverse() * place;
//!         let side_px = 0.3 * intrinsics.fx / in_camera.xyz.z;
//!         let pixel = camera.pixel(in_camera)?;
//!         measurements.push(Measurement {
//!             view: index,
//!             reading: Reading::Pixel {
//!                 pixel,
//!                 sigma_px: Vector2::new(1.5, 1.5),
//!                 range: None,
//!             },
//!             log_size: Some(side_px.ln()),
//!             bounds: Some(PixelBox {
//!                 x_min: pixel.u - 0.5 * side_px,
//!                 x_max: pixel.u + 0.5 * side_px,
//!                 y_min: pixel.v - 0.5 * side_px,
//!                 y_max: pixel.v + 0.5 * side_px,
//!             }),
//!             cut: Cut::NONE,
//!             class: 0,
//!             score: Some(0.9),
//!         });
//!     }
//! }
//!
//! let problem = Problem {
//!     views: &views,
//!     measurements: &measurements,
//!     surface: &LevelPlane::default(),
//!     height_sigma_m: 0.02,
//!     max_range_m: 15.0,
//!     min_range_m: 0.0,
//! };
//! let belief = fuse_belief(&problem, &BeliefSettings::default());
//! let real: Vec<_> = belief.objects.iter().filter(|o| o.p_exist > 0.5).collect();
//! assert_eq!(real.len(), rocks.len());
//! for [east_m, north_m] in rocks {
//!     let rock = Point::new(east_m, north_m, 0.0);
//!     let found = real.iter().find(|o| o.place.distance(rock) < 0.01).expect("every rock");
//!     assert!((found.size_m.expect("boxes say a size") - 0.3).abs() < 0.01);
//!     assert_eq!(found.members.len(), views.len());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Reading order
//!
//! `outcome` is the table of contents: beginnings, stage A, stage B, output. Sections are those of the
//! method's description that the files refer to.
//!
//! | file | step | section |
//! |---|---|---|
//! | `data` | views and detections as the loops read them | 0 |
//! | `algebra` | four and six rows: factors, inverses, spreads | |
//! | `expect` | what a view would read of an object, with derivatives by object and pose | 0 |
//! | `cut` | what is left of boxes that the picture's border cuts | |
//! | `noise` | variances of readings, the contaminated normal, its robust weight | 0, 3.1 |
//! | `engine` | everything believed at one moment; priors of objects, the background of detections | 0, 3.1 |
//! | `ground`, `footprint` | heights looked up; ground and room that views see | 0, 3.1 |
//! | `single` | what one detection says by itself; where everything starts | 0 |
//! | `curve` | how often objects are detected, by apparent size or range | 3.1 |
//! | `classes` | of which class an object is, where the detector takes classes for each other | |
//! | `departure` | how sizes of objects depart from a lognormal law | |
//! | `near` | objects near a place | |
//! | `pairs` | which objects a view expects, and which detections may be of them | 3.1 |
//! | `looks` | how many independent looks a row of looks is worth | 3.x |
//! | `register` | stage A: where a view stands, given the objects so far | 3.6 |
//! | `sequence` | stage A: view after view, over a window that still moves | 3.6 |
//! | `associate` | stage B: memberships, births, deaths | 3.2, 3.3 |
//! | `solve` | stage B: one Gauss-Newton step of places and poses, and covariances | 3.4 |
//! | `drift`, `chain` | stage B: errors of poses that drift, stated or found | 3.4 |
//! | `normal` | the normal equations, row by row | 3.4 |
//! | `system` | the normal equations solved | 3.4 |
//! | `merge` | stage B: objects that are one | 3.3 |
//! | `evidence` | log-odds that each object is real | 3.5 |
//! | `learn` | noise, clutter, density, sizes, detectability | 3.5 |
//! | `bias` | what sensors read too much, all views alike | |
//! | `effect` | how much less views say than as many independent ones | |
//! | `rounds` | stage B: rounds until next to nothing changes | 3.7 |
//! | `outcome` | the whole, and what comes of it | 3.7, 3.8 |
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of several small matrices are indexed together"
)]

mod algebra;
mod associate;
mod bias;
mod chain;
mod classes;
mod curve;
mod cut;
mod data;
mod departure;
mod drift;
mod effect;
mod engine;
mod evidence;
mod expect;
mod footprint;
mod ground;
mod learn;
mod looks;
mod merge;
mod near;
mod noise;
mod normal;
mod outcome;
mod pairs;
mod register;
mod rounds;
mod sequence;

mod single;
mod solve;
mod system;
#[cfg(test)]
mod tests;

pub use bias::{Bias, BiasOf};
pub use classes::Confusion;
pub use drift::Drift;
pub use effect::Repetition;
pub use outcome::{Belief, BeliefEvidence, BeliefObject, Single, fuse_belief};

/// How poses are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoseCorrection {
    /// Not at all: their errors count as noise of the readings.
    Off,
    /// Every view has an error of its own.
    PerView,
    /// Part of the error drifts slowly along the traverse.
    Drift,
}

/// Which side of a box says how large an object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SizeRule {
    /// Its width.
    Width,
    /// Its height: things that stand upright are as high from all sides.
    Height,
}

/// What a run states of its data and its wishes.
#[derive(Debug, Clone, PartialEq)]
pub struct BeliefSettings {
    /// How poses are corrected.
    pub pose_correction: PoseCorrection,
    /// How pose errors drift, where [`PoseCorrection::Drift`] asks for it.
    pub drift: Drift,
    /// Whether the detector's scores count.
    pub scores: bool,
    /// Which side of a box says how large an object is.
    pub size_rule: SizeRule,
    /// Standard deviation of the logarithm of an apparent size.
    pub log_size_sigma: f64,
    /// Where on an object a box sits, one standard deviation as a share of its size.
    pub shape: f64,
    /// How far an object's middle lies behind the face that is marked, metres.
    pub radius_m: f64,
    /// Mean and standard deviation of the objects' sizes, metres, where they are known beforehand.
    pub size_m: Option<(f64, f64)>,
    /// Which classes the detector takes for which; it never does without.
    pub confusion: Option<Confusion>,
    /// Opening angle of views without a camera, radians.
    pub fov: f64,
    /// Errors of readings of one object fade in this time, seconds.
    pub geometry_time_s: f64,
    /// Whether an object is detected again depends on the last look for this time, seconds.
    pub event_time_s: f64,
    /// Errors of readings fade with this share of the range travelled.
    pub look_share: f64,
}

impl Default for BeliefSettings {
    fn default() -> Self {
        Self {
            pose_correction: PoseCorrection::PerView,
            drift: Drift {
                share: 0.8,
                length_m: 16.0,
            },
            scores: true,
            size_rule: SizeRule::Width,
            log_size_sigma: 0.15,
            shape: 0.0,
            radius_m: 0.0,
            size_m: None,
            confusion: None,
            fov: std::f64::consts::TAU,
            geometry_time_s: 1.5,
            event_time_s: 0.5,
            look_share: 0.06,
        }
    }
}
