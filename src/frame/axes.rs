//! The marker types of the frames. They carry no data: they only name what a point is measured in.

/// Camera axes: x right, y down, z forward along the optical axis; origin at the camera's centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Camera {}

/// Body axes of the platform: x forward, y left, z up (ROS REP-103); origin at the pose's position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {}

/// East, north, up at the site's origin, the frame in which everything is fused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Enu {}

/// East, north, up at a place of its own (a pose, an object), the frame attitudes are logged in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalEnu {}

/// Planet-centred, planet-fixed axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ecef {}
