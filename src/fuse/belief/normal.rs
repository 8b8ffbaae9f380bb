//! The normal equations of objects and poses, row by row.

use nalgebra::{SMatrix, Vector6};

use super::algebra::{ByPose, Square4, add_information};
use super::system::{Coupling, PoseBlock};

/// The normal equations on their way.
pub(super) struct Normal {
    pub(super) information: Vec<Square4>,
    pub(super) pull: Vec<[f64; 4]>,
    /// How near the nearest view of each object is, metres.
    pub(super) nearest_m: Vec<f64>,
    pub(super) poses: Vec<PoseBlock>,
    pub(super) couplings: Vec<Coupling>,
    /// Couplings between poses, where they drift.
    pub(super) links: Vec<(usize, usize, SMatrix<f64, 6, 6>)>,
    /// How many unknowns a view has among the poses: itself, and its drift.
    pub(super) spacing: usize,
}

/// The rows of a detection that may be of an object.
pub(super) struct Row {
    pub(super) look: usize,
    pub(super) object: usize,
    pub(super) view: usize,
    pub(super) range_m: f64,
    /// The slant range that is expected.
    pub(super) slant_m: f64,
    pub(super) by_object: Square4,
    pub(super) by_pose: ByPose,
    pub(super) n: usize,
    pub(super) e: [f64; 4],
    /// Weighted information of the rows.
    pub(super) information: Square4,
}

impl Normal {
    pub(super) fn add(&mut self, row: &Row, moving: &[usize], corrects_poses: bool) {
        let k = row.object;
        self.nearest_m[k] = self.nearest_m[k].min(row.range_m);
        let a = &mut self.information[k];
        add_information(a, &row.by_object, &row.information, row.n, 1.0);
        let toward = row.toward();
        for (p, h) in self.pull[k].iter_mut().zip(row.object_pull(&toward)) {
            *p += h;
        }
        if corrects_poses && let Ok(p) = moving.binary_search(&row.view) {
            let p = p * self.spacing;
            let (a, b) = &mut self.poses[p];
            row.add_to_pose(a, b, &toward);
            self.couplings.push((k, p, row.coupling()));
        }
    }
}

impl Row {
    /// The weighted residual.
    pub(super) fn toward(&self) -> [f64; 4] {
        times(&self.information, &self.e)
    }

    pub(super) fn object_pull(&self, toward: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| (0..self.n).map(|r| self.by_object[r][i] * toward[r]).sum())
    }

    /// Adds to a pose's information; the rows' own is diagonal where poses move.
    fn add_to_pose(&self, a: &mut SMatrix<f64, 6, 6>, b: &mut Vector6<f64>, toward: &[f64; 4]) {
        for r in 0..self.n {
            let w = self.information[r][r];
            if w == 0.0 {
                continue;
            }
            let h = &self.by_pose[r];
            for c in 0..6 {
                b[c] += h[c] * toward[r];
                let scale = w * h[c];
                let mut column = a.column_mut(c);
                for (x, y) in column.iter_mut().zip(h) {
                    *x += scale * y;
                }
            }
        }
    }

    fn coupling(&self) -> SMatrix<f64, 4, 6> {
        let mut out = SMatrix::<f64, 4, 6>::zeros();
        for r in 0..self.n {
            let w = self.information[r][r];
            for c in 0..6 {
                let scale = w * self.by_pose[r][c];
                for i in 0..4 {
                    out[(i, c)] += scale * self.by_object[r][i];
                }
            }
        }
        out
    }
}

pub(super) fn times(a: &Square4, b: &[f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| a[i].iter().zip(b).map(|(a, b)| a * b).sum())
}
