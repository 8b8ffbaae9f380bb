//! Normal equations of two families of unknowns, each coupled only with the other: the one that is
//! eliminated leaves a small system of the one that is kept.

use nalgebra::{SMatrix, SVector};

use super::selected_inverse::SelectedInverse;
use super::sparse::{BlockMatrix, Factor};

/// The eliminated and the kept unknown, and the block in the rows of the former.
type Coupling<const A: usize, const B: usize> = (usize, usize, SMatrix<f64, B, A>);

/// `[[K, B^T], [B, E]] [x; y] = [k; e]` with K and E block diagonal.
#[derive(Debug)]
pub(crate) struct Arrow<const A: usize, const B: usize> {
    /// Blocks of the kept unknowns, and their right-hand sides.
    pub(crate) kept: Vec<(SMatrix<f64, A, A>, SVector<f64, A>)>,
    /// Blocks of the unknowns to eliminate, and their right-hand sides.
    pub(crate) eliminated: Vec<(SMatrix<f64, B, B>, SVector<f64, B>)>,
    /// Couplings: of an eliminated with a kept unknown, sorted by the former.
    pub(crate) couplings: Vec<Coupling<A, B>>,
    /// Kept unknowns coupled with an earlier one: the later, the earlier, and the block in the later's
    /// rows.
    pub(crate) links: Vec<(usize, usize, SMatrix<f64, A, A>)>,
}

/// A solved system.
#[derive(Debug)]
pub(crate) struct Solved<const A: usize, const B: usize> {
    /// The kept unknowns.
    pub(crate) kept: Vec<SVector<f64, A>>,
    /// The eliminated ones.
    pub(crate) eliminated: Vec<SVector<f64, B>>,
    factor: Factor<A>,
    inverses: Vec<SMatrix<f64, B, B>>,
    couplings: Vec<Coupling<A, B>>,
}

impl<const A: usize, const B: usize> Arrow<A, B> {
    /// Solves by the Schur complement `K - B^T E^-1 B`; `None` where the system is not positive
    /// definite.
    pub(crate) fn solve(self) -> Option<Solved<A, B>> {
        let inverses: Vec<SMatrix<f64, B, B>> = self
            .eliminated
            .iter()
            .map(|(block, _)| inverse(block))
            .collect::<Option<_>>()?;
        let (matrix, right) = self.reduced(&inverses);
        let factor = matrix.cholesky()?;
        let solution = factor.solve(&right);
        let kept: Vec<SVector<f64, A>> = solution
            .chunks_exact(A)
            .map(SVector::from_column_slice)
            .collect();
        let mut eliminated: Vec<SVector<f64, B>> =
            self.eliminated.iter().map(|(_, side)| *side).collect();
        for (j, a, by_a) in &self.couplings {
            eliminated[*j] -= by_a * kept[*a];
        }
        for (value, inverse) in eliminated.iter_mut().zip(&inverses) {
            *value = inverse * *value;
        }
        Some(Solved {
            kept,
            eliminated,
            factor,
            inverses,
            couplings: self.couplings,
        })
    }

    /// The matrix of the Schur complement and its right-hand side.
    fn reduced(&self, inverses: &[SMatrix<f64, B, B>]) -> (BlockMatrix<A>, Vec<f64>) {
        let rows = Rows::new(self);
        let n = self.kept.len();
        let mut matrix = BlockMatrix {
            diagonal: self.kept.iter().map(|(block, _)| *block).collect(),
            first: vec![0],
            columns: Vec::new(),
            blocks: Vec::new(),
        };
        let mut right: Vec<f64> = Vec::with_capacity(A * n);
        // Of each column the block that was last made in it.
        let mut newest: Vec<Option<usize>> = vec![None; n];
        for (a, (_, side)) in self.kept.iter().enumerate() {
            let mut side = *side;
            let start = matrix.columns.len();
            for b in rows.columns(self, a) {
                if newest[b].is_none_or(|at| at < start) {
                    newest[b] = Some(matrix.columns.len());
                    matrix.columns.push(b);
                }
            }
            matrix.columns[start..].sort_unstable();
            for (at, &b) in matrix.columns.iter().enumerate().skip(start) {
                newest[b] = Some(at);
            }
            matrix.blocks.resize(matrix.columns.len(), SMatrix::zeros());
            matrix.first.push(matrix.columns.len());
            for link in &rows.links[a] {
                let (_, earlier, block) = &self.links[*link];
                if let Some(at) = newest[*earlier] {
                    matrix.blocks[at] += block;
                }
            }
            for (group, by_a) in rows.groups(self, a) {
                let j = group[0].0;
                let left = by_a.transpose() * inverses[j];
                side -= left * self.eliminated[j].1;
                for (_, b, by_b) in group {
                    if *b == a {
                        matrix.diagonal[a] -= left * by_b;
                    } else if let (true, Some(at)) = (*b < a, newest[*b]) {
                        matrix.blocks[at] -= left * by_b;
                    }
                }
            }
            right.extend(side.iter());
        }
        (matrix, right)
    }
}

/// What is coupled with each kept unknown.
struct Rows {
    /// Where the couplings of each eliminated unknown begin and end, by coupling.
    groups: Vec<(usize, usize)>,
    /// The couplings of each kept unknown, in their order.
    couplings: Vec<Vec<usize>>,
    /// Its links with earlier ones.
    links: Vec<Vec<usize>>,
}

impl Rows {
    fn new<const A: usize, const B: usize>(arrow: &Arrow<A, B>) -> Self {
        let n = arrow.kept.len();
        let mut rows = Self {
            groups: Vec::with_capacity(arrow.couplings.len()),
            couplings: vec![Vec::new(); n],
            links: vec![Vec::new(); n],
        };
        for group in by_eliminated(&arrow.couplings) {
            let start = rows.groups.len();
            let end = start + group.len();
            rows.groups.resize(end, (start, end));
        }
        for (i, (_, a, _)) in arrow.couplings.iter().enumerate() {
            rows.couplings[*a].push(i);
        }
        for (i, (later, _, _)) in arrow.links.iter().enumerate() {
            rows.links[*later].push(i);
        }
        rows
    }

    /// The eliminated unknowns that a kept one is coupled with, each by all its couplings.
    fn groups<'a, const A: usize, const B: usize>(
        &'a self,
        arrow: &'a Arrow<A, B>,
        a: usize,
    ) -> impl Iterator<Item = (&'a [Coupling<A, B>], &'a SMatrix<f64, B, A>)> {
        self.couplings[a].iter().map(|&i| {
            let (start, end) = self.groups[i];
            (&arrow.couplings[start..end], &arrow.couplings[i].2)
        })
    }

    /// The kept unknowns before one that it is coupled with, some of them several times.
    fn columns<'a, const A: usize, const B: usize>(
        &'a self,
        arrow: &'a Arrow<A, B>,
        a: usize,
    ) -> impl Iterator<Item = usize> {
        let links = self.links[a].iter().map(|&i| arrow.links[i].1);
        let through = self.groups(arrow, a).flat_map(|(group, _)| group);
        links
            .chain(through.map(|(_, b, _)| *b))
            .filter(move |b| *b < a)
    }
}

impl<const A: usize, const B: usize> Solved<A, B> {
    /// Logarithm of the determinant of the whole matrix.
    pub(crate) fn ln_det(&self) -> f64 {
        let eliminated = self.inverses.iter().map(ln_det);
        self.factor.ln_det() - eliminated.sum::<f64>()
    }

    /// The solution for other right-hand sides, of the kept and of the eliminated unknowns.
    pub(crate) fn again(
        &self,
        kept: &[SVector<f64, A>],
        eliminated: &[SVector<f64, B>],
    ) -> (Vec<SVector<f64, A>>, Vec<SVector<f64, B>>) {
        let mut right: Vec<f64> = kept.iter().flat_map(|k| k.iter().copied()).collect();
        for group in by_eliminated(&self.couplings) {
            let j = group[0].0;
            if eliminated[j].iter().all(|x| *x == 0.0) {
                continue;
            }
            let inward = self.inverses[j] * eliminated[j];
            for (_, a, by_a) in group {
                let share = by_a.tr_mul(&inward);
                for r in 0..A {
                    right[A * a + r] -= share[r];
                }
            }
        }
        let kept: Vec<SVector<f64, A>> = self
            .factor
            .solve(&right)
            .chunks_exact(A)
            .map(SVector::from_column_slice)
            .collect();
        let mut outward = eliminated.to_vec();
        for (j, a, by_a) in &self.couplings {
            outward[*j] -= by_a * kept[*a];
        }
        for (value, inverse) in outward.iter_mut().zip(&self.inverses) {
            *value = inverse * *value;
        }
        (kept, outward)
    }

    /// The diagonal blocks of the system's inverse: marginal covariances of the kept and of the
    /// eliminated unknowns.
    pub(crate) fn covariances(&self) -> (Vec<SMatrix<f64, A, A>>, Vec<SMatrix<f64, B, B>>) {
        let inverse = SelectedInverse::new(&self.factor);
        let kept = (0..self.kept.len()).map(|a| inverse.block(a, a)).collect();
        let mut eliminated = self.inverses.clone();
        for group in by_eliminated(&self.couplings) {
            let j = group[0].0;
            let mut middle = SMatrix::<f64, B, B>::zeros();
            for (i, (_, a, by_a)) in group.iter().enumerate() {
                middle += by_a * inverse.block(*a, *a) * by_a.transpose();
                for (_, b, by_b) in &group[..i] {
                    let share = by_a * inverse.block(*a, *b) * by_b.transpose();
                    middle += share + share.transpose();
                }
            }
            eliminated[j] += self.inverses[j] * middle * self.inverses[j];
        }
        (kept, eliminated)
    }
}

fn by_eliminated<T>(couplings: &[(usize, usize, T)]) -> impl Iterator<Item = &[(usize, usize, T)]> {
    couplings.chunk_by(|x, y| x.0 == y.0)
}

/// The inverse of a symmetric positive definite block.
fn inverse<const N: usize>(block: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    // Scaled to ones on the diagonal: pose blocks hold metres and radians.
    let scale = SVector::<f64, N>::from_fn(|i, _| 1.0 / block[(i, i)].sqrt());
    let scaled = SMatrix::<f64, N, N>::from_fn(|r, c| block[(r, c)] * scale[r] * scale[c]);
    let inverse = scaled.try_inverse()?;
    let inverse = SMatrix::<f64, N, N>::from_fn(|r, c| inverse[(r, c)] * scale[r] * scale[c]);
    inverse.iter().all(|x| x.is_finite()).then_some(inverse)
}

/// Logarithm of the determinant of a symmetric positive definite block.
fn ln_det<const N: usize>(block: &SMatrix<f64, N, N>) -> f64 {
    block.cholesky().map_or(f64::NAN, |c| c.ln_determinant())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The same system, solved whole and by elimination, with an unknown coupled twice to another.
    #[test]
    fn elimination_agrees_with_the_whole_system() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut draw = || random.random_range(-1.0..1.0);
        let (n, m) = (4, 5);
        let size = 3 * n + 2 * m;
        let mut whole = DMatrix::<f64>::zeros(size, size);
        let mut couplings = Vec::new();
        for (j, a) in [
            (0, 0),
            (0, 1),
            (1, 1),
            (2, 1),
            (2, 3),
            (3, 3),
            (3, 3),
            (4, 2),
        ] {
            let block = Matrix2x3::from_fn(|_, _| draw());
            couplings.push((j, a, block));
            let (row, column) = (3 * n + 2 * j, 3 * a);
            let mut view = whole.view_mut((row, column), (2, 3));
            view += block;
            let mut view = whole.view_mut((column, row), (3, 2));
            view += block.transpose();
        }
        for i in 0..size {
            whole[(i, i)] = 9.0;
        }
        let right = DVector::from_fn(size, |_, _| draw());
        let arrow = Arrow::<3, 2> {
            kept: (0..n)
                .map(|a| {
                    (
                        Matrix3::identity() * 9.0,
                        right.fixed_rows::<3>(3 * a).into(),
                    )
                })
                .collect(),
            eliminated: (0..m)
                .map(|j| {
                    let side = right.fixed_rows::<2>(3 * n + 2 * j).into();
                    (SMatrix::identity() * 9.0, side)
                })
                .collect(),
            couplings,
            links: Vec::new(),
        };
        let solved = arrow.solve().unwrap();
        let inverse = whole.try_inverse().unwrap();
        assert!((solved.ln_det() + inverse.determinant().ln()).abs() < 1e-12);
        let other = DVector::from_fn(size, |_, _| draw());
        let kept: Vec<_> = (0..n)
            .map(|a| other.fixed_rows::<3>(3 * a).into())
            .collect();
        let rest: Vec<_> = (0..m)
            .map(|j| other.fixed_rows::<2>(3 * n + 2 * j).into())
            .collect();
        let (kept, rest) = solved.again(&kept, &rest);
        let expected = &inverse * other;
        for (a, kept) in kept.iter().enumerate() {
            assert!((kept - expected.fixed_rows::<3>(3 * a)).amax() < 1e-12);
        }
        for (j, rest) in rest.iter().enumerate() {
            assert!((rest - expected.fixed_rows::<2>(3 * n + 2 * j)).amax() < 1e-12);
        }
        let expected = &inverse * right;
        let (kept, eliminated) = solved.covariances();
        for (a, kept) in kept.iter().enumerate() {
            assert!((solved.kept[a] - expected.fixed_rows::<3>(3 * a)).amax() < 1e-12);
            let block = inverse.fixed_view::<3, 3>(3 * a, 3 * a);
            assert!((kept - block).amax() < 1e-12);
        }
        for (j, eliminated) in eliminated.iter().enumerate() {
            let row = 3 * n + 2 * j;
            assert!((solved.eliminated[j] - expected.fixed_rows::<2>(row)).amax() < 1e-12);
            assert!((eliminated - inverse.fixed_view::<2, 2>(row, row)).amax() < 1e-12);
        }
    }
}
