//! Normal equations of two families of unknowns, each coupled only with the other: the one that is
//! eliminated leaves a small system of the one that is kept.

use nalgebra::{SMatrix, SVector};

use super::envelope::{Envelope, Factor};

/// `[[K, B^T], [B, E]] [x; y] = [k; e]` with K and E block diagonal.
#[derive(Debug)]
pub(crate) struct Arrow<const A: usize, const B: usize> {
    /// Blocks of the kept unknowns, and their right-hand sides.
    pub(crate) kept: Vec<(SMatrix<f64, A, A>, SVector<f64, A>)>,
    /// Blocks of the unknowns to eliminate, and their right-hand sides.
    pub(crate) eliminated: Vec<(SMatrix<f64, B, B>, SVector<f64, B>)>,
    /// Couplings: of an eliminated with a kept unknown, sorted by the former.
    pub(crate) couplings: Vec<(usize, usize, SMatrix<f64, B, A>)>,
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
    factor: Factor,
    inverses: Vec<SMatrix<f64, B, B>>,
    couplings: Vec<(usize, usize, SMatrix<f64, B, A>)>,
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
        let mut matrix = Envelope::zeros(self.first_columns());
        let mut right: Vec<f64> = Vec::with_capacity(A * self.kept.len());
        for (i, (block, side)) in self.kept.iter().enumerate() {
            add_block(&mut matrix, i, i, block);
            right.extend(side.iter());
        }
        for (later, earlier, block) in &self.links {
            add_block(&mut matrix, *later, *earlier, block);
        }
        for group in by_eliminated(&self.couplings) {
            let j = group[0].0;
            for (_, a, by_a) in group {
                let left = by_a.transpose() * inverses[j];
                let share = left * self.eliminated[j].1;
                for r in 0..A {
                    right[A * a + r] -= share[r];
                }
                for (_, b, by_b) in group.iter().filter(|(_, b, _)| b <= a) {
                    add_block(&mut matrix, *a, *b, &-(left * by_b));
                }
            }
        }
        let factor = matrix.cholesky()?;
        let solution = factor.solve(right);
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

    /// The first column of every row of the reduced system: that of the first block it is coupled
    /// with through an eliminated unknown.
    fn first_columns(&self) -> Vec<usize> {
        let mut first: Vec<usize> = (0..self.kept.len()).collect();
        for group in by_eliminated(&self.couplings) {
            let lowest = group.iter().map(|(_, a, _)| *a).min().unwrap_or(0);
            for (_, a, _) in group {
                first[*a] = first[*a].min(lowest);
            }
        }
        for (later, earlier, _) in &self.links {
            first[*later] = first[*later].min(*earlier);
        }
        first.iter().flat_map(|f| [A * f; A]).collect()
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
            .solve(right)
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
        let inverse = self.factor.selected_inverse();
        let block = |a: usize, b: usize| {
            SMatrix::<f64, A, A>::from_fn(|r, c| inverse.at(A * a + r, A * b + c))
        };
        let kept = (0..self.kept.len()).map(|a| block(a, a)).collect();
        let mut eliminated = self.inverses.clone();
        for group in by_eliminated(&self.couplings) {
            let j = group[0].0;
            let mut middle = SMatrix::<f64, B, B>::zeros();
            for (_, a, by_a) in group {
                for (_, b, by_b) in group {
                    middle += by_a * block(*a, *b) * by_b.transpose();
                }
            }
            eliminated[j] += self.inverses[j] * middle * self.inverses[j];
        }
        (kept, eliminated)
    }
}

/// Adds the part of a block that lies in the lower triangle.
fn add_block<const A: usize>(
    matrix: &mut Envelope,
    row: usize,
    column: usize,
    block: &SMatrix<f64, A, A>,
) {
    for r in 0..A {
        for c in 0..A {
            if row > column || c <= r {
                matrix.add(A * row + r, A * column + c, block[(r, c)]);
            }
        }
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
    let mut rest = *block;
    let mut sum = 0.0;
    for i in 0..N {
        sum += rest[(i, i)].ln();
        for r in i + 1..N {
            let share = rest[(r, i)] / rest[(i, i)];
            for c in i + 1..N {
                rest[(r, c)] -= share * rest[(i, c)];
            }
        }
    }
    sum
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
