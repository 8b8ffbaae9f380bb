//! Cholesky factors of sparse symmetric matrices of square blocks.
//!
//! Blocks are reordered by approximate minimum degree, so that views of a traverse that comes back
//! to where it has been fill little more of the factor than those of one that does not. Ordering and
//! factor are faer's; the factor is supernodal, columns of one pattern being dense matrices. All of
//! it is computed in sequence, and in memory that is aligned alike each time, for sums of vectors
//! are split where the alignment says.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::cholesky::supernodal::{
    self, SupernodalLltRef, SymbolicSupernodalCholesky,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, Par, Side};
use nalgebra::SMatrix;

/// The least square of a pivot, in units of the diagonal: at the level of rounding it says nothing
/// about the unknown.
const LEAST_PIVOT: f64 = 1e-14;

/// A symmetric matrix by the rows of its lower triangle.
#[derive(Debug, Clone)]
pub(super) struct BlockMatrix<const A: usize> {
    pub(super) diagonal: Vec<SMatrix<f64, A, A>>,
    /// Where the blocks of each row begin, and where the last ends.
    pub(super) first: Vec<usize>,
    /// The columns of the blocks left of the diagonal, ascending within a row.
    pub(super) columns: Vec<usize>,
    /// These blocks.
    pub(super) blocks: Vec<SMatrix<f64, A, A>>,
}

/// `P S P^T = D^-1 L L^T D^-1`, P a permutation of blocks and D a diagonal that gives the factored
/// matrix ones on its diagonal: poses hold metres and radians, and their informations differ by many
/// orders of magnitude.
#[derive(Debug)]
pub(super) struct Factor<const A: usize> {
    symbolic: SymbolicCholesky<usize>,
    /// A column, the matrices of all supernodes one after another.
    values: Mat<f64>,
    /// D.
    pub(super) scale: Vec<f64>,
    /// Where each block of the matrix went.
    pub(super) place: Vec<usize>,
}

/// A block of the permuted lower triangle.
#[derive(Clone, Copy)]
struct Entry {
    row: usize,
    column: usize,
    /// Which block of the matrix it is, and whether that is its transpose.
    block: usize,
    is_transposed: bool,
}

/// Entries in an order, and where those of each row or column begin.
struct Sorted {
    first: Vec<usize>,
    entries: Vec<Entry>,
}

impl<const A: usize> BlockMatrix<A> {
    /// How many blocks the diagonal has.
    fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// The Cholesky factor; `None` where the matrix is not positive definite.
    pub(super) fn cholesky(self) -> Option<Factor<A>> {
        let n = self.len();
        let (order, place) = self.ordering()?;
        let scale: Vec<f64> = order
            .iter()
            .flat_map(|&i| self.diagonal[i].diagonal().map(|x| 1.0 / x.sqrt()).data.0[0])
            .collect();
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let (by_row, by_column) = self.permuted(&place);
        let symbolic = by_row.analyse::<A>(n)?;
        drop(by_row);
        let mut values = Mat::zeros(symbolic.len_val(), 1);
        if let SymbolicCholeskyRaw::Supernodal(nodes) = symbolic.raw() {
            self.factorise(
                nodes,
                &by_column,
                &order,
                &scale,
                values.col_as_slice_mut(0),
            )?;
        }
        Some(Factor {
            symbolic,
            values,
            scale,
            place,
        })
    }

    /// The blocks in the order of elimination, and the place of each therein.
    fn ordering(&self) -> Option<(Vec<usize>, Vec<usize>)> {
        let n = self.len();
        let (mut order, mut place) = (vec![0; n], vec![0; n]);
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.first, None, &self.columns);
        let scratch = amd::order_scratch::<usize>(n, self.columns.len());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        let stack = MemStack::new(&mut memory);
        amd::order(
            &mut order,
            &mut place,
            pattern,
            amd::Control::default(),
            stack,
        )
        .ok()?;
        Some((order, place))
    }

    /// The entries left of the diagonal after the permutation: by rows, and by columns.
    fn permuted(&self, place: &[usize]) -> (Sorted, Sorted) {
        let n = self.len();
        let mut entries = Vec::with_capacity(self.columns.len());
        for (a, range) in self.first.windows(2).enumerate() {
            for block in range[0]..range[1] {
                let (row, column) = (place[a], place[self.columns[block]]);
                entries.push(Entry {
                    row: row.max(column),
                    column: row.min(column),
                    block,
                    is_transposed: row < column,
                });
            }
        }
        // Each pass keeps the order of the one before.
        let by_column = Sorted::by(n, &entries, |e| e.column);
        let by_row = Sorted::by(n, &by_column.entries, |e| e.row);
        let by_column = Sorted::by(n, &by_row.entries, |e| e.column);
        (by_row, by_column)
    }

    /// Writes the factor; `None` where the matrix is not positive definite.
    fn factorise(
        &self,
        nodes: &SymbolicSupernodalCholesky<usize>,
        by_column: &Sorted,
        order: &[usize],
        scale: &[f64],
        values: &mut [f64],
    ) -> Option<()> {
        let n = self.len();
        let entries = n * (A * (A + 1) / 2) + A * A * by_column.entries.len();
        let mut first = Vec::with_capacity(A * n + 1);
        let mut rows = Vec::with_capacity(entries);
        let mut lower = Vec::with_capacity(entries);
        first.push(0);
        for (k, &block) in order.iter().enumerate() {
            for c in 0..A {
                let mut push = |row: usize, value: f64| {
                    rows.push(row);
                    lower.push(value * scale[row] * scale[A * k + c]);
                };
                for r in c..A {
                    push(A * k + r, self.diagonal[block][(r, c)]);
                }
                for entry in by_column.of(k) {
                    let block = &self.blocks[entry.block];
                    for r in 0..A {
                        let at = if entry.is_transposed { (c, r) } else { (r, c) };
                        push(A * entry.row + r, block[at]);
                    }
                }
                first.push(rows.len());
            }
        }
        let pattern = SymbolicSparseColMatRef::new_checked(A * n, A * n, &first, None, &rows);
        let matrix = SparseColMatRef::new(pattern, &lower[..]);
        let mut memory = memory(supernodal::factorize_supernodal_numeric_llt_scratch::<
            usize,
            f64,
        >(nodes, Par::Seq, Default::default()))?;
        supernodal::factorize_supernodal_numeric_llt(
            values,
            matrix,
            Default::default(),
            nodes,
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .ok()?;
        let factor = SupernodalLltRef::new(nodes, values);
        let is_definite = (0..nodes.n_supernodes()).all(|s| {
            let node = factor.supernode(s).val();
            (0..node.ncols()).all(|c| node[(c, c)] * node[(c, c)] > LEAST_PIVOT)
        });
        is_definite.then_some(())
    }
}

impl Sorted {
    fn by(n: usize, entries: &[Entry], key: impl Fn(&Entry) -> usize) -> Self {
        let mut first = vec![0; n + 1];
        for entry in entries {
            first[key(entry) + 1] += 1;
        }
        for i in 0..n {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut sorted = entries.to_vec();
        for entry in entries {
            let at = &mut next[key(entry)];
            sorted[*at] = *entry;
            *at += 1;
        }
        Self {
            first,
            entries: sorted,
        }
    }

    fn of(&self, i: usize) -> &[Entry] {
        &self.entries[self.first[i]..self.first[i + 1]]
    }

    /// The pattern of the factor, from entries by rows: these are the columns of the upper
    /// triangle.
    fn analyse<const A: usize>(&self, n: usize) -> Option<SymbolicCholesky<usize>> {
        let mut first = Vec::with_capacity(A * n + 1);
        let mut rows = Vec::new();
        first.push(0);
        for k in 0..n {
            for c in 0..A {
                for entry in self.of(k) {
                    rows.extend(A * entry.column..A * (entry.column + 1));
                }
                rows.extend(A * k..=A * k + c);
                first.push(rows.len());
            }
        }
        let pattern = SymbolicSparseColMatRef::new_checked(A * n, A * n, &first, None, &rows);
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let ordering = SymmetricOrdering::Identity;
        factorize_symbolic_cholesky(pattern, Side::Upper, ordering, parameters).ok()
    }
}

impl<const A: usize> Factor<A> {
    /// The supernodes with their values; none where nothing is unknown.
    pub(super) fn supernodes(&self) -> Option<SupernodalLltRef<'_, usize, f64>> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(nodes) => {
                Some(SupernodalLltRef::new(nodes, self.values.col_as_slice(0)))
            }
            SymbolicCholeskyRaw::Simplicial(_) => None,
        }
    }

    /// The solution of `S x = b`.
    pub(super) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let Some(nodes) = self.supernodes() else {
            return b.to_vec();
        };
        let at = |i: usize| A * self.place[i / A] + i % A;
        let mut x = Mat::<f64>::zeros(b.len(), 1);
        for (i, b) in b.iter().enumerate() {
            x[(at(i), 0)] = b * self.scale[at(i)];
        }
        let scratch = nodes.symbolic().solve_in_place_scratch::<f64>(1, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        nodes.solve_in_place_with_conj(Conj::No, x.as_mut(), Par::Seq, stack);
        (0..b.len())
            .map(|i| x[(at(i), 0)] * self.scale[at(i)])
            .collect()
    }

    /// Logarithm of the determinant of `S`.
    pub(super) fn ln_det(&self) -> f64 {
        let scales = self.scale.iter().map(|s| s.ln()).sum::<f64>();
        let pivots = self.supernodes().map_or(0.0, |nodes| {
            let of_node = |s: usize| {
                let node = nodes.supernode(s).val();
                (0..node.ncols()).map(|c| node[(c, c)].ln()).sum::<f64>()
            };
            (0..nodes.symbolic().n_supernodes())
                .map(of_node)
                .sum::<f64>()
        });
        2.0 * (pivots - scales)
    }
}

fn memory(scratch: StackReq) -> Option<MemBuffer> {
    MemBuffer::try_new(scratch).ok()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::adjust::selected_inverse::SelectedInverse;

    /// A positive definite matrix with badly scaled unknowns, coupled where `couples` says.
    fn matrix<const A: usize>(
        n: usize,
        couples: impl Fn(usize, usize) -> bool,
    ) -> (BlockMatrix<A>, DMatrix<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let unit = |i: usize| if i.is_multiple_of(2) { 1.0 } else { 1e4 };
        let mut draw = || SMatrix::<f64, A, A>::from_fn(|_, _| random.random_range(-1.0..1.0));
        let scaled = |row: usize, column: usize, block: SMatrix<f64, A, A>| {
            SMatrix::from_fn(|r, c| block[(r, c)] * unit(A * row + r) * unit(A * column + c))
        };
        let mut sparse = BlockMatrix {
            diagonal: Vec::new(),
            first: vec![0],
            columns: Vec::new(),
            blocks: Vec::new(),
        };
        let mut dense = DMatrix::zeros(A * n, A * n);
        for row in 0..n {
            for column in (0..row).filter(|&column| couples(row, column)) {
                let block: SMatrix<f64, A, A> = scaled(row, column, draw());
                sparse.columns.push(column);
                sparse.blocks.push(block);
                dense
                    .view_mut((A * row, A * column), (A, A))
                    .copy_from(&block);
                let transposed = block.transpose();
                dense
                    .view_mut((A * column, A * row), (A, A))
                    .copy_from(&transposed);
            }
            sparse.first.push(sparse.columns.len());
            let block = draw();
            let block = block + block.transpose() + SMatrix::identity() * 60.0;
            let block: SMatrix<f64, A, A> = scaled(row, row, block);
            sparse.diagonal.push(block);
            dense.view_mut((A * row, A * row), (A, A)).copy_from(&block);
        }
        (sparse, dense)
    }

    fn agrees<const A: usize>(n: usize, couples: impl Fn(usize, usize) -> bool) {
        let (sparse, dense) = matrix::<A>(n, couples);
        let expected = dense.clone().try_inverse().unwrap();
        let factor = sparse.clone().cholesky().unwrap();
        let b = DVector::from_fn(A * n, |i, _| f64::from(u32::try_from(i).unwrap()).sin());
        let x = DVector::from_vec(factor.solve(b.as_slice()));
        let residual = &dense * x - &b;
        assert!(residual.amax() < 1e-10, "{}", residual.amax());
        let pivots = dense.clone().cholesky().unwrap().l().diagonal();
        let ln_det: f64 = pivots.iter().map(|p| 2.0 * p.ln()).sum();
        assert!((factor.ln_det() - ln_det).abs() < 1e-9 * ln_det.abs().max(1.0));
        let inverse = SelectedInverse::new(&factor);
        let close = |row: usize, column: usize| {
            let block = inverse.block(row, column);
            for (r, c) in (0..A).flat_map(|r| (0..A).map(move |c| (r, c))) {
                let (i, j) = (A * row + r, A * column + c);
                let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
                let off = (block[(r, c)] - expected[(i, j)]).abs();
                assert!(off < 1e-12 * scale, "{i} {j}: {off} of {scale}");
            }
        };
        for row in 0..n {
            close(row, row);
            for &column in &sparse.columns[sparse.first[row]..sparse.first[row + 1]] {
                close(row, column);
                close(column, row);
            }
        }
    }

    #[test]
    fn agrees_with_the_dense_inverse_along_a_traverse() {
        agrees::<6>(40, |row, column| row - column < 1 + row % 5);
        agrees::<1>(7, |row, column| row - column < 3);
        agrees::<4>(1, |_, _| true);
    }

    #[test]
    fn agrees_with_the_dense_inverse_where_the_traverse_returns() {
        // There and back, a loop, and lines of a lawn-mower.
        let n = 60;
        agrees::<3>(n, |row, column| {
            row - column < 3 || (row + column).abs_diff(n) < 3
        });
        agrees::<6>(n, |row, column| row - column < 4 || row - column > n - 4);
        let place = |i: usize| {
            (
                i / 8,
                if (i / 8).is_multiple_of(2) {
                    i % 8
                } else {
                    7 - i % 8
                },
            )
        };
        agrees::<4>(n, |row, column| {
            let ((a, b), (c, d)) = (place(row), place(column));
            a.abs_diff(c) < 2 && b.abs_diff(d) < 2
        });
    }

    #[test]
    fn agrees_with_the_dense_inverse_where_parts_are_apart_or_all_are_coupled() {
        agrees::<6>(20, |row, column| row / 4 == column / 4);
        agrees::<4>(20, |_, _| false);
        agrees::<6>(20, |_, _| true);
    }

    #[test]
    fn nothing_unknown_is_solved() {
        let (sparse, _) = matrix::<6>(0, |_, _| true);
        let factor = sparse.cholesky().unwrap();
        assert!(factor.solve(&[]).is_empty());
        SelectedInverse::new(&factor);
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let singular = |corner: f64| BlockMatrix::<1> {
            diagonal: vec![SMatrix::from([[1.0]]), SMatrix::from([[corner]])],
            first: vec![0, 0, 1],
            columns: vec![0],
            blocks: vec![SMatrix::from([[2.0]])],
        };
        assert!(singular(4.1).cholesky().is_some());
        for corner in [4.0, 4.0 + 1e-14, 3.0, 0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(singular(corner).cholesky().is_none(), "{corner}");
        }
        let (mut sparse, _) = matrix::<6>(12, |row, column| row - column < 4);
        sparse.blocks[7][(2, 3)] = f64::NAN;
        assert!(sparse.cholesky().is_none());
    }

    #[test]
    fn bits_are_the_same_wherever_memory_lies() {
        let bits = |odd: usize| {
            let _before = vec![0u8; odd];
            let (sparse, _) = matrix::<6>(70, |row, column| {
                row - column < 6 || (row + column).abs_diff(70) < 5
            });
            let _between = vec![0u8; 8 * odd];
            let factor = sparse.cholesky().unwrap();
            let b: Vec<f64> = (0..6 * 70).map(|i| f64::from(i).cos()).collect();
            let x = factor.solve(&b);
            let inverse = SelectedInverse::new(&factor);
            let blocks = (0..70).flat_map(|i| inverse.block(i, i).data.0.concat());
            let bits: Vec<u64> = x.into_iter().chain(blocks).map(f64::to_bits).collect();
            bits
        };
        let expected = bits(0);
        std::thread::scope(|scope| {
            let others: Vec<_> = (1..8).map(|i| scope.spawn(move || bits(i * 9))).collect();
            for other in others {
                assert!(other.join().unwrap() == expected);
            }
        });
    }
}
