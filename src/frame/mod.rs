//! Typed points, rays, transforms and covariances, and the geodesy that ties a site to its planet.
//!
//! Every convention of the program is stated once, on the marker type of its frame:
//!
//! | frame | axes | origin |
//! |---|---|---|
//! | [`Camera`] | x right, y down, z forward (OpenCV, ROS optical frame) | the camera's centre |
//! | [`Body`] | x forward, y left, z up (ROS REP-103) | the pose's position |
//! | [`LocalEnu`] | east, north, up at the place itself | the place |
//! | [`Enu`] | east, north, up at the site's origin | the site's origin |
//! | [`Ecef`] | body-centred, body-fixed: x to latitude 0 longitude 0, z to the north pole | the planet's centre |
//!
//! Transforms are named `to_from_from` (`enu_from_body`) and typed accordingly, so that a transform
//! applied to a point of another frame does not compile:
//!
//! ```compile_fail
//! use rockmap::frame::{Body, Camera, Enu, Point, RigidTransform};
//! let enu_from_body = RigidTransform::<Enu, Body>::identity();
//! let seen = Point::<Camera>::new(0.0, 0.0, 1.0);
//! let wrong = enu_from_body * seen; // a point in camera axes is not a point in body axes
//! ```
//!
//! Lengths are metres and angles radians throughout; degrees exist at file edges alone.

mod axes;
mod covariance;
mod crs;
mod crs_text;
mod definition;
mod geodetic;
mod geoid;
mod pixel;
mod planet;
mod point;
#[allow(
    unsafe_code,
    reason = "PROJ's three-dimensional transformations have no safe binding; this is the one file that calls it"
)]
mod proj_3d;
mod site;
mod transform;
mod vertical;

pub use axes::{Body, Camera, Ecef, Enu, LocalEnu};
pub use covariance::{Ellipse, covariance_ellipse};
pub use crs::{Crs, CrsError};
pub use crs_text::CrsText;
pub use geodetic::{Ellipsoid, Geodetic};
pub use geoid::{GeoidRaster, is_geotiff};
pub use pixel::Pixel;
pub use planet::Planet;
pub use point::{Direction, Point, Ray, Vector};
pub use site::Site;
pub use transform::{RigidTransform, Rotation, skew};
pub use vertical::{DatumError, GeoidGrid, VerticalDatum};
