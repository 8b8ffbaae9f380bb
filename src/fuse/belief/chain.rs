//! Normal equations of many poses whose errors drift, and of few objects.
//!
//! Eliminated, either family would couple all of the other. Poses and their drifts are a chain, whose
//! factor keeps its band; objects border it: `[[P, B], [B^T, O]]`, solved by `O - B^T P^-1 B`.

use nalgebra::{DMatrix, DVector, SMatrix, Vector4, Vector6};
use rayon::prelude::*;

use super::system::{Coupling, ObjectBlock, PoseBlock, Steps};
use crate::adjust::arrow::{Arrow, Solved};

/// Solved equations of a chain and its border.
pub(super) struct Bordered {
    chain: Solved<6, 4>,
    /// `P^-1 B`, by its columns, four an object.
    outward: Vec<Vec<Vector6<f64>>>,
    /// `(O - B^T P^-1 B)^-1`.
    covariance: DMatrix<f64>,
    /// Logarithm of the determinant of it all.
    pub(super) ln_det: f64,
}

impl Bordered {
    /// `None` where the system is not positive definite.
    pub(super) fn new(
        objects: &[ObjectBlock],
        poses: &[PoseBlock],
        links: Vec<(usize, usize, SMatrix<f64, 6, 6>)>,
        couplings: &[Coupling],
    ) -> Option<Self> {
        let arrow = Arrow {
            kept: poses.to_vec(),
            eliminated: Vec::new(),
            couplings: Vec::new(),
            links,
        };
        let chain: Solved<6, 4> = arrow.solve()?;
        let n = 4 * objects.len();
        let mut border = vec![vec![Vector6::zeros(); poses.len()]; n];
        for (object, pose, block) in couplings {
            for i in 0..4 {
                border[4 * object + i][*pose] += block.row(i).transpose();
            }
        }
        let outward: Vec<Vec<Vector6<f64>>> = border
            .par_iter()
            .map(|column| chain.again(column, &[]).0)
            .collect();
        drop(border);
        let mut left = DMatrix::<f64>::zeros(n, n);
        for (k, (block, _)) in objects.iter().enumerate() {
            left.fixed_view_mut::<4, 4>(4 * k, 4 * k).copy_from(block);
        }
        for (object, pose, block) in couplings {
            for (c, column) in outward.iter().enumerate() {
                let share = block * column[*pose];
                for i in 0..4 {
                    left[(4 * object + i, c)] -= share[i];
                }
            }
        }
        let factor = left.cholesky()?;
        let ln_det = chain.ln_det() + factor.ln_determinant();
        Some(Self {
            chain,
            outward,
            covariance: factor.inverse(),
            ln_det,
        })
    }

    /// The solution for these right-hand sides, of objects and of poses.
    pub(super) fn solve(&self, objects: &[Vector4<f64>], poses: &[Vector6<f64>]) -> Steps {
        let left = DVector::from_fn(4 * objects.len(), |c, _| {
            let back = self.outward[c].iter().zip(poses);
            objects[c / 4][c % 4] - back.map(|(w, p)| w.dot(p)).sum::<f64>()
        });
        let steps = &self.covariance * left;
        let mut turns = self.chain.again(poses, &[]).0;
        for (column, step) in self.outward.iter().zip(steps.iter()) {
            for (turn, w) in turns.iter_mut().zip(column) {
                *turn -= w * *step;
            }
        }
        let steps = steps.as_slice().chunks_exact(4);
        (steps.map(Vector4::from_column_slice).collect(), turns)
    }

    /// Marginal covariances of objects and of poses.
    pub(super) fn covariances(&self) -> (Vec<SMatrix<f64, 4, 4>>, Vec<SMatrix<f64, 6, 6>>) {
        let n = self.outward.len();
        let objects = (0..n / 4).map(|k| self.covariance.fixed_view::<4, 4>(4 * k, 4 * k).into());
        let mut poses = self.chain.covariances().0;
        for (p, cov) in poses.iter_mut().enumerate() {
            let by_object = DMatrix::from_fn(6, n, |i, c| self.outward[c][p][i]);
            let more = &by_object * &self.covariance * by_object.transpose();
            *cov += more.fixed_view::<6, 6>(0, 0);
        }
        (objects.collect(), poses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The same system, solved whole.
    #[test]
    fn a_bordered_chain_agrees_with_the_whole_system() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut draw = || random.random_range(-1.0..1.0);
        let (n, m) = (5, 2);
        let size = 6 * n + 4 * m;
        let mut whole = DMatrix::<f64>::identity(size, size) * 30.0;
        let mut links = Vec::new();
        for p in 1..n {
            let block = Matrix6::from_fn(|_, _| draw());
            whole
                .fixed_view_mut::<6, 6>(6 * p, 6 * p - 6)
                .copy_from(&block);
            whole
                .fixed_view_mut::<6, 6>(6 * p - 6, 6 * p)
                .copy_from(&block.transpose());
            links.push((p, p - 1, block));
        }
        let mut couplings = Vec::new();
        for (k, p) in [(0, 0), (0, 2), (1, 2), (1, 4), (1, 4)] {
            let block = SMatrix::<f64, 4, 6>::from_fn(|_, _| draw());
            let (row, column) = (6 * n + 4 * k, 6 * p);
            let mut view = whole.fixed_view_mut::<4, 6>(row, column);
            view += block;
            let mut view = whole.fixed_view_mut::<6, 4>(column, row);
            view += block.transpose();
            couplings.push((k, p, block));
        }
        let right = DVector::from_fn(size, |_, _| draw());
        let objects: Vec<Vector4<f64>> = (0..m)
            .map(|k| right.fixed_rows::<4>(6 * n + 4 * k).into())
            .collect();
        let poses: Vec<Vector6<f64>> = (0..n)
            .map(|p| right.fixed_rows::<6>(6 * p).into())
            .collect();
        let object = |k: usize| (SMatrix::identity() * 30.0, objects[k]);
        let pose = |p: usize| (Matrix6::identity() * 30.0, poses[p]);
        let object_blocks: Vec<ObjectBlock> = (0..m).map(object).collect();
        let pose_blocks: Vec<PoseBlock> = (0..n).map(pose).collect();
        let bordered = Bordered::new(&object_blocks, &pose_blocks, links, &couplings).unwrap();
        let inverse = whole.try_inverse().unwrap();
        let expected = &inverse * right;
        let (steps, turns) = bordered.solve(&objects, &poses);
        let (object_cov, pose_cov) = bordered.covariances();
        assert!((bordered.ln_det + inverse.determinant().ln()).abs() < 1e-11);
        for k in 0..m {
            let at = 6 * n + 4 * k;
            assert!((steps[k] - expected.fixed_rows::<4>(at)).amax() < 1e-14);
            assert!((object_cov[k] - inverse.fixed_view::<4, 4>(at, at)).amax() < 1e-14);
        }
        for p in 0..n {
            assert!((turns[p] - expected.fixed_rows::<6>(6 * p)).amax() < 1e-14);
            assert!((pose_cov[p] - inverse.fixed_view::<6, 6>(6 * p, 6 * p)).amax() < 1e-14);
        }
    }
}
