//! Joint adjustment: places of objects and errors of poses that agree best with what was measured,
//! when it is known (or believed, by weights) which measurement is of which object.
//!
//! A [`Problem`] holds views, measurements and the ground. A [`State`] holds the unknowns: of every
//! object its east, its north and its height above the [`Surface`], of every view the six errors of
//! its pose. [`Adjustment`] minimises
//!
//! ```text
//! sum over edges of w (z - h(x, p))^T R^-1 (z - h(x, p))
//!   + sum over views of d^T L d + sum over objects of height^2 / sigma_z^2
//! ```
//!
//! by Gauss-Newton steps, with whichever of objects and poses are more eliminated by a Schur
//! complement and a sparse Cholesky factor of the rest. Where the height of the ground is known
//! exactly (`sigma_z` = 0) heights stay zero and objects have two unknowns.

pub(crate) mod arrow;
mod joint;
mod predict;
mod problem;
mod selected_inverse;
mod sparse;
mod surface;

pub use joint::{Adjustment, Conditional, Edge, Marginals, NoSolution, Noise, State, Step};
pub(crate) use predict::right_jacobian;
pub use predict::{CorrectedPose, Prediction, Sight};
pub use problem::{Measurement, Problem, Reading};
pub use surface::{LevelPlane, PlatformLevel, Surface};
