//! Blocks of the inverse of a factored matrix, by Takahashi's recurrences (Erisman and Tinney 1975):
//! only those within the factor's pattern, the only ones that covariances of unknowns that are
//! coupled need.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::SMatrix;

use super::sparse::Factor;

/// The inverse of what a factor is of, within the factor's pattern.
#[derive(Debug)]
pub(super) struct SelectedInverse<'a, const A: usize> {
    factor: &'a Factor<A>,
    nodes: Option<Nodes<'a>>,
    /// As the values of the factor, both triangles of the supernodes' own squares.
    values: Mat<f64>,
}

/// The supernodes of a factor.
#[derive(Debug)]
struct Nodes<'a> {
    factor: SupernodalLltRef<'a, usize, f64>,
    /// The supernode of each column.
    of_column: Vec<usize>,
}

/// Matrices that hold one supernode after another.
struct Workspace {
    /// The inverse of the rows below.
    behind: Mat<f64>,
    /// `L_below L_own^-1`.
    gain: Mat<f64>,
    /// `L_own^-1`.
    own: Mat<f64>,
    rows: Vec<usize>,
}

impl<'a, const A: usize> SelectedInverse<'a, A> {
    pub(super) fn new(factor: &'a Factor<A>) -> Self {
        let nodes = factor.supernodes().map(Nodes::new);
        let n_values = nodes.as_ref().map_or(0, |n| n.factor.values().len());
        let mut values = Mat::zeros(n_values, 1);
        if let Some(nodes) = &nodes {
            let mut work = Workspace::new(nodes);
            for s in (0..nodes.factor.symbolic().n_supernodes()).rev() {
                nodes.invert(s, values.col_as_slice_mut(0), &mut work);
            }
        }
        Self {
            factor,
            nodes,
            values,
        }
    }

    /// A block, of either triangle, whose unknowns are coupled; zeros of others.
    pub(super) fn block(&self, a: usize, b: usize) -> SMatrix<f64, A, A> {
        let (a, b) = (self.factor.place[a], self.factor.place[b]);
        let (row, column) = (A * a.max(b), A * a.min(b));
        let Some(lower) = self.nodes.as_ref().and_then(|n| n.find(row, column)) else {
            return SMatrix::zeros();
        };
        let (scale, values) = (&self.factor.scale, self.values.col_as_slice(0));
        // The rows of a block have one pattern, and follow upon each other in every supernode.
        SMatrix::from_fn(|r, c| {
            let (r, c) = if a >= b { (r, c) } else { (c, r) };
            values[lower.start + c * lower.stride + r] * scale[row + r] * scale[column + c]
        })
    }
}

/// Where a block begins among the values, and how far its columns are apart.
struct Found {
    start: usize,
    stride: usize,
}

impl<'a> Nodes<'a> {
    fn new(factor: SupernodalLltRef<'a, usize, f64>) -> Self {
        let symbolic = factor.symbolic();
        let bounds = symbolic
            .supernode_begin()
            .iter()
            .zip(symbolic.supernode_end());
        let of_column = bounds
            .enumerate()
            .flat_map(|(s, (begin, end))| std::iter::repeat_n(s, end - begin))
            .collect();
        Self { factor, of_column }
    }

    /// Where an entry of the lower triangle stands, if it is in the pattern.
    fn find(&self, row: usize, column: usize) -> Option<Found> {
        let s = self.of_column[column];
        let node = self.factor.supernode(s);
        let own = row - node.start();
        let at = if own < node.val().ncols() {
            own
        } else {
            node.val().ncols() + node.pattern().binary_search(&row).ok()?
        };
        let stride = node.val().nrows();
        Some(Found {
            start: self.values_of(s).start + (column - node.start()) * stride + at,
            stride,
        })
    }

    fn values_of(&self, s: usize) -> std::ops::Range<usize> {
        let first = self.factor.symbolic().col_ptr_for_val();
        first[s]..first[s + 1]
    }

    /// The inverse within one supernode, that of all behind it being there:
    /// `Z_below,own = -Z_below,below G` and `Z_own,own = (L_own L_own^T)^-1 - G^T Z_below,own`, with
    /// `G = L_below L_own^-1`.
    fn invert(&self, s: usize, values: &mut [f64], work: &mut Workspace) {
        let node = self.factor.supernode(s);
        let width = node.val().ncols();
        let below = node.pattern().len();
        self.gather(node.pattern(), values, work);
        let (top, bottom) = node.val().split_at_row(width);
        let behind = work.behind.as_ref().submatrix(0, 0, below, below);
        let mut gain = work.gain.as_mut().submatrix_mut(0, 0, below, width);
        let mut own = work.own.as_mut().submatrix_mut(0, 0, width, width);
        own.fill(0.0);
        own.rb_mut().diagonal_mut().fill(1.0);
        solve_lower_triangular_in_place(top, own.rb_mut(), Par::Seq);
        triangular::matmul(
            gain.rb_mut(),
            BlockStructure::Rectangular,
            Accum::Replace,
            bottom,
            BlockStructure::Rectangular,
            own.rb(),
            BlockStructure::TriangularLower,
            1.0,
            Par::Seq,
        );
        let values = &mut values[self.values_of(s)];
        let inverse = MatMut::from_column_major_slice_mut(values, width + below, width);
        let (mut square, mut rest) = inverse.split_at_row_mut(width);
        subtract_symmetric(rest.rb_mut(), behind, gain.rb());
        matmul(
            square.rb_mut(),
            Accum::Replace,
            own.rb().transpose(),
            own.rb(),
            1.0,
            Par::Seq,
        );
        matmul(
            square,
            Accum::Add,
            gain.rb().transpose(),
            rest.rb(),
            -1.0,
            Par::Seq,
        );
    }

    /// Fills the lower triangle of `work.behind` with the inverse between the rows of a pattern.
    /// These are coupled with each other, as each is with the supernode.
    fn gather(&self, pattern: &[usize], values: &[f64], work: &mut Workspace) {
        let mut from = 0;
        while from < pattern.len() {
            let s = self.of_column[pattern[from]];
            let node = self.factor.supernode(s);
            let (start, width) = (node.start(), node.val().ncols());
            let to = from + pattern[from..].partition_point(|&row| row < start + width);
            // Where the rows of the pattern stand in the supernode.
            work.rows.clear();
            work.rows
                .extend(pattern[from..to].iter().map(|row| row - start));
            let mut theirs = node.pattern().iter().enumerate();
            work.rows.extend(pattern[to..].iter().filter_map(|row| {
                let (at, _) = theirs.find(|(_, r)| *r == row)?;
                Some(width + at)
            }));
            let values = &values[self.values_of(s)];
            for c in from..to {
                let column = &values[(pattern[c] - start) * node.val().nrows()..];
                let out = &mut work.behind.col_as_slice_mut(c)[c..];
                for (value, &row) in out.iter_mut().zip(&work.rows[c - from..]) {
                    *value = column[row];
                }
            }
            from = to;
        }
    }
}

/// `-B G`, where only the lower triangle of the symmetric B is there.
fn subtract_symmetric(mut out: MatMut<'_, f64>, lower: MatRef<'_, f64>, gain: MatRef<'_, f64>) {
    let parts = [
        (Accum::Replace, lower, BlockStructure::TriangularLower),
        (
            Accum::Add,
            lower.transpose(),
            BlockStructure::StrictTriangularUpper,
        ),
    ];
    for (accum, part, structure) in parts {
        triangular::matmul(
            out.rb_mut(),
            BlockStructure::Rectangular,
            accum,
            part,
            structure,
            gain,
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
    }
}

impl Workspace {
    fn new(nodes: &Nodes<'_>) -> Self {
        let (mut width, mut below) = (0, 0);
        for s in 0..nodes.factor.symbolic().n_supernodes() {
            let node = nodes.factor.supernode(s);
            width = width.max(node.val().ncols());
            below = below.max(node.pattern().len());
        }
        Self {
            behind: Mat::zeros(below, below),
            gain: Mat::zeros(below, width),
            own: Mat::zeros(width, width),
            rows: Vec::with_capacity(below),
        }
    }
}
