//! The normal equations solved, whichever family of unknowns makes the smaller system kept.

use nalgebra::{SMatrix, Vector4, Vector6};

use super::algebra::to_matrix4;
use super::chain::Bordered;
use super::normal::Normal;
use crate::adjust::arrow::{Arrow, Solved};

pub(super) type ObjectBlock = (SMatrix<f64, 4, 4>, Vector4<f64>);
pub(super) type PoseBlock = (SMatrix<f64, 6, 6>, Vector6<f64>);
pub(super) type Coupling = (usize, usize, SMatrix<f64, 4, 6>);
pub(super) type Steps = (Vec<Vector4<f64>>, Vec<Vector6<f64>>);

/// Solved normal equations, with whichever family of unknowns makes the smaller system kept.
pub(super) enum System {
    PosesKept(Solved<6, 4>),
    ObjectsKept(Solved<4, 6>),
    /// Poses that drift are a chain, which few objects border.
    Bordered(Box<Bordered>),
}

impl System {
    /// The system, and the steps of objects and poses; `None` where it is not positive definite.
    pub(super) fn new(normal: Normal) -> Option<(Self, Steps)> {
        let objects: Vec<ObjectBlock> = normal
            .information
            .iter()
            .zip(&normal.pull)
            .map(|(a, b)| (to_matrix4(a), Vector4::from(*b)))
            .collect();
        let Normal {
            poses,
            couplings,
            links,
            spacing,
            ..
        } = normal;
        if spacing == 2 && super::drift::few(poses.len() / 2, objects.len()) {
            let bordered = Bordered::new(&objects, &poses, links, &couplings)?;
            let sides: Vec<Vector4<f64>> = objects.iter().map(|o| o.1).collect();
            let pulls: Vec<Vector6<f64>> = poses.iter().map(|p| p.1).collect();
            let both = bordered.solve(&sides, &pulls);
            return Some((Self::Bordered(Box::new(bordered)), both));
        }
        if spacing == 1 && 4 * objects.len() < 6 * poses.len() {
            let mut solved = objects_kept(objects, poses, &couplings)?;
            let steps = solved.kept.clone();
            let turns = std::mem::take(&mut solved.eliminated);
            return Some((Self::ObjectsKept(solved), (steps, turns)));
        }
        let mut solved = poses_kept(objects, poses, links, &couplings)?;
        let turns = solved.kept.clone();
        let steps = std::mem::take(&mut solved.eliminated);
        Some((Self::PosesKept(solved), (steps, turns)))
    }

    /// The solution for other right-hand sides, of objects and of poses.
    pub(super) fn again(&self, objects: &[Vector4<f64>], poses: &[Vector6<f64>]) -> Steps {
        match self {
            Self::PosesKept(solved) => {
                let (poses, objects) = solved.again(poses, objects);
                (objects, poses)
            }
            Self::ObjectsKept(solved) => solved.again(objects, poses),
            Self::Bordered(bordered) => bordered.solve(objects, poses),
        }
    }

    /// Logarithm of the determinant of the normal equations.
    pub(super) fn ln_det(&self) -> f64 {
        match self {
            Self::PosesKept(solved) => solved.ln_det(),
            Self::ObjectsKept(solved) => solved.ln_det(),
            Self::Bordered(bordered) => bordered.ln_det,
        }
    }

    /// Marginal covariances of objects and of poses.
    pub(super) fn covariances(&self) -> (Vec<SMatrix<f64, 4, 4>>, Vec<SMatrix<f64, 6, 6>>) {
        match self {
            Self::PosesKept(solved) => {
                let (poses, objects) = solved.covariances();
                (objects, poses)
            }
            Self::ObjectsKept(solved) => solved.covariances(),
            Self::Bordered(bordered) => bordered.covariances(),
        }
    }
}

fn poses_kept(
    objects: Vec<ObjectBlock>,
    poses: Vec<PoseBlock>,
    links: Vec<(usize, usize, SMatrix<f64, 6, 6>)>,
    couplings: &[Coupling],
) -> Option<Solved<6, 4>> {
    let arrow = Arrow {
        links,
        kept: poses,
        eliminated: objects,
        couplings: sorted(couplings, |c| (c.0, c.1))
            .map(|c| (c.0, c.1, c.2))
            .collect(),
    };
    arrow.solve()
}

fn objects_kept(
    objects: Vec<ObjectBlock>,
    poses: Vec<PoseBlock>,
    couplings: &[Coupling],
) -> Option<Solved<4, 6>> {
    let arrow = Arrow {
        links: Vec::new(),
        kept: objects,
        eliminated: poses,
        couplings: sorted(couplings, |c| (c.1, c.0))
            .map(|c| (c.1, c.0, c.2.transpose()))
            .collect(),
    };
    arrow.solve()
}

/// Couplings in an order: numbers are sorted, for the blocks are heavy.
fn sorted(
    couplings: &[Coupling],
    key: impl Fn(&Coupling) -> (usize, usize),
) -> impl Iterator<Item = &Coupling> {
    let mut order: Vec<((usize, usize), usize)> = couplings
        .iter()
        .enumerate()
        .map(|(i, c)| (key(c), i))
        .collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| &couplings[i])
}
