//! The bound of a method that knows which detection is which object.

use nalgebra::Vector6;

use super::{BoundEvidence, BoundMap, Group, NoBound, Partition, objects, starts};
use crate::adjust::{Adjustment, Edge, Noise, Problem, State};

/// Steps are over where no object moves farther, metres.
const STILL_M: f64 = 1e-8;
/// At most this many steps.
const STEPS: usize = 50;

/// The joint least squares of places and poses with every label known; clutter is left out, and
/// nothing is learnt: the noise is as stated.
///
/// # Errors
/// [`NoBound`] where no object is labelled or the equations are singular.
pub fn clairvoyant(problem: &Problem<'_>, partition: &Partition) -> Result<BoundMap, NoBound> {
    let mut groups = partition.objects();
    let points = starts(problem, &mut groups);
    if groups.is_empty() {
        return Err(NoBound::NothingLabelled);
    }
    let edges = edges(&groups);
    let adjustment = Adjustment {
        problem: *problem,
        edges: &edges,
        noise: Noise::default(),
    };
    let mut state = State {
        points,
        poses: vec![Vector6::zeros(); problem.views.len()],
    };
    let (step, iterations) = adjustment.iterate(&mut state, STEPS, STILL_M, false)?;
    // Covariances cost more than the steps: they are taken once, where everything stands still.
    let last = adjustment.step(&mut state, true)?;
    let marginals = last.marginals.ok_or(NoBound::NothingLabelled)?;
    let p_exist = vec![1.0; groups.len()];
    Ok(BoundMap {
        objects: objects(problem, &groups, &state, &marginals, &p_exist),
        poses: state.poses,
        evidence: BoundEvidence {
            iterations: iterations + 1,
            last_move_m: last.move_m,
            converged: step.move_m < STILL_M,
            model: None,
        },
    })
}

/// One edge of full weight a member, by measurement.
pub(super) fn edges(groups: &[Group]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = groups
        .iter()
        .enumerate()
        .flat_map(|(point, group)| {
            let members = group.members.iter();
            members.map(move |&measurement| Edge {
                measurement,
                point,
                weight: 1.0,
            })
        })
        .collect();
    edges.sort_by_key(|edge| edge.measurement);
    edges
}
