//! Which objects are real, and how often real ones are detected.
//!
//! Given edges (which measurement is of which object) and an adjusted [`State`], this module says
//! what every view was expected to see ([`Pairs`]), weighs for every object the evidence that it is
//! real ([`log_odds`]), and learns the numbers both rest on from the data ([`learn`]): the [`Model`].
//!
//! Equations are numbered as in the description of the method: 3.1 predicted quantities, 3.4 the
//! adjustment, 3.5 what is learnt.

mod curve;
mod evidence;
mod learn;
mod model;
mod pairs;
mod size;

pub use curve::DetectionCurve;
pub use evidence::{clutter_log_intensity, log_odds, probability};
pub use learn::learn;
pub use model::{Exposure, LogNormal, Model, Prior};
pub use pairs::{Pair, Pairs};
pub use size::Sizes;

use crate::adjust::{Adjustment, Conditional, State};

/// What is believed at one moment: the edges and their noise, the unknowns and how well they are
/// known, the sizes and the model.
#[derive(Clone, Copy)]
pub struct Belief<'a> {
    /// The problem, its edges and the noise.
    pub adjustment: Adjustment<'a>,
    /// Places and pose errors.
    pub state: &'a State,
    /// How well they are known.
    pub conditional: &'a Conditional,
    /// How large the objects are.
    pub sizes: &'a Sizes,
    /// The numbers that are learnt.
    pub model: &'a Model,
}
