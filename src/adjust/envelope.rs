//! Cholesky factors of symmetric matrices kept within their envelope: every row from its first
//! entry to the diagonal. A factor fills nothing outside the envelope of its matrix, and the views
//! of a traverse, in the order of acquisition, share objects with near ones alone.

/// A symmetric matrix by the rows of its lower triangle, each from its first entry on.
#[derive(Debug, Clone)]
pub(super) struct Envelope {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

/// `S = D^-1 L L^T D^-1`, D a diagonal that gives the factored matrix ones on its diagonal: poses
/// hold metres and radians, and their informations differ by many orders of magnitude.
#[derive(Debug)]
pub(super) struct Factor {
    lower: Envelope,
    scale: Vec<f64>,
}

impl Envelope {
    /// Zeros, each row from the column `first` to the diagonal.
    pub(super) fn zeros(first: Vec<usize>) -> Self {
        let rows = first
            .iter()
            .enumerate()
            .map(|(i, &f)| vec![0.0; i + 1 - f])
            .collect();
        Self { first, rows }
    }

    fn len(&self) -> usize {
        self.rows.len()
    }

    /// Adds to an entry of the lower triangle, which must lie in the envelope.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column - self.first[row]] += value;
    }

    /// An entry, of either triangle, within the envelope.
    pub(super) fn at(&self, a: usize, b: usize) -> f64 {
        let (row, column) = if a >= b { (a, b) } else { (b, a) };
        self.rows[row][column - self.first[row]]
    }

    /// The Cholesky factor; `None` where the matrix is not positive definite.
    pub(super) fn cholesky(mut self) -> Option<Factor> {
        let n = self.len();
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / self.at(i, i).sqrt()).collect();
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        for i in 0..n {
            let (above, rest) = self.rows.split_at_mut(i);
            let (row, first) = (&mut rest[0], self.first[i]);
            for (offset, value) in row.iter_mut().enumerate() {
                *value *= scale[i] * scale[first + offset];
            }
            for j in first..i {
                let start = first.max(self.first[j]);
                let theirs = &above[j][start - self.first[j]..];
                let (pivot, theirs) = theirs.split_last()?;
                let mine = &row[start - first..j - first];
                let dot: f64 = mine.iter().zip(theirs).map(|(a, b)| a * b).sum();
                row[j - first] = (row[j - first] - dot) / pivot;
            }
            let (diagonal, left) = row.split_last_mut()?;
            let rest = *diagonal - left.iter().map(|x| x * x).sum::<f64>();
            // A pivot at the level of rounding says nothing about the unknown.
            if rest.is_nan() || rest <= 1e-14 {
                return None;
            }
            *diagonal = rest.sqrt();
        }
        Some(Factor { lower: self, scale })
    }
}

impl Factor {
    /// Logarithm of the determinant of `S`.
    pub(super) fn ln_det(&self) -> f64 {
        let pivots = self.lower.rows.iter().zip(&self.scale);
        pivots
            .filter_map(|(row, scale)| Some(2.0 * (row.last()? / scale).ln()))
            .sum()
    }

    /// The solution of `S x = b`.
    pub(super) fn solve(&self, mut b: Vec<f64>) -> Vec<f64> {
        let n = self.lower.len();
        for (x, s) in b.iter_mut().zip(&self.scale) {
            *x *= s;
        }
        for i in 0..n {
            let (first, row) = (self.lower.first[i], &self.lower.rows[i]);
            let dot: f64 = row[..i - first]
                .iter()
                .zip(&b[first..i])
                .map(|(a, x)| a * x)
                .sum();
            b[i] = (b[i] - dot) / row[i - first];
        }
        for i in (0..n).rev() {
            let (first, row) = (self.lower.first[i], &self.lower.rows[i]);
            let x = b[i] / row[i - first];
            b[i] = x;
            for (earlier, l) in b[first..i].iter_mut().zip(row) {
                *earlier -= l * x;
            }
        }
        for (x, s) in b.iter_mut().zip(&self.scale) {
            *x *= s;
        }
        b
    }

    /// The entries of `S^-1` within the envelope, by Takahashi's recurrences: the only ones that
    /// covariances of the unknowns coupled in `S` need.
    pub(super) fn selected_inverse(&self) -> Envelope {
        let (n, lower) = (self.lower.len(), &self.lower);
        let mut inverse = Envelope::zeros(lower.first.clone());
        let mut column = vec![0.0; n];
        let mut product = vec![0.0; n];
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); n];
        for i in 0..n {
            for rows in &mut below[lower.first[i]..i] {
                rows.push(i);
            }
        }
        for j in (0..n).rev() {
            for &k in &below[j] {
                column[k] = lower.at(k, j);
                product[k] = 0.0;
            }
            // product = (inverse of what is behind j) times (column j of L), row by row.
            for &k in &below[j] {
                let start = lower.first[k].max(j + 1);
                let row = &inverse.rows[k][start - lower.first[k]..];
                let weight = column[k];
                let mut dot = row[row.len() - 1] * weight;
                for ((z, l), p) in row[..row.len() - 1]
                    .iter()
                    .zip(&column[start..k])
                    .zip(&mut product[start..k])
                {
                    dot += z * l;
                    *p += z * weight;
                }
                product[k] += dot;
            }
            let pivot = lower.at(j, j);
            let mut diagonal = 1.0 / pivot;
            for &k in &below[j] {
                let value = -product[k] / pivot;
                inverse.add(k, j, value);
                diagonal -= column[k] * value;
            }
            inverse.add(j, j, diagonal / pivot);
            for &k in &below[j] {
                column[k] = 0.0;
            }
        }
        for i in 0..n {
            let first = lower.first[i];
            for (offset, value) in inverse.rows[i].iter_mut().enumerate() {
                *value *= self.scale[i] * self.scale[first + offset];
            }
        }
        inverse
    }

    /// Logarithm of the determinant of `S`.
    #[cfg(test)]
    fn ln_determinant(&self) -> f64 {
        let pivots = (0..self.lower.len()).map(|i| self.lower.at(i, i) / self.scale[i]);
        2.0 * pivots.map(f64::ln).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A positive definite matrix with a ragged envelope and badly scaled unknowns.
    fn ragged(n: usize) -> (Envelope, DMatrix<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let first: Vec<usize> = (0..n)
            .map(|i| i.saturating_sub(random.random_range(0..9)))
            .collect();
        let mut envelope = Envelope::zeros(first.clone());
        let mut dense = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in first[i]..=i {
                let mut value: f64 = random.random_range(-1.0..1.0);
                if i == j {
                    value += 12.0;
                }
                let unit = |k: usize| if k.is_multiple_of(2) { 1.0 } else { 1e4 };
                let value = value * unit(i) * unit(j);
                envelope.add(i, j, value);
                dense[(i, j)] = value;
                dense[(j, i)] = value;
            }
        }
        (envelope, dense)
    }

    #[test]
    fn agrees_with_the_dense_inverse() {
        let (envelope, dense) = ragged(60);
        let inverse = dense.clone().try_inverse().unwrap();
        let factor = envelope.clone().cholesky().unwrap();
        let b = DVector::from_fn(60, |i, _| f64::from(u32::try_from(i).unwrap()).sin());
        let x = factor.solve(b.as_slice().to_vec());
        let residual = &dense * DVector::from_vec(x) - &b;
        assert!(residual.amax() < 1e-10, "{}", residual.amax());
        let selected = factor.selected_inverse();
        for i in 0..60 {
            for j in envelope.first[i]..=i {
                let scale = (inverse[(i, i)] * inverse[(j, j)]).sqrt();
                assert!((selected.at(i, j) - inverse[(i, j)]).abs() < 1e-12 * scale);
            }
        }
        let expected = dense.cholesky().unwrap().ln_determinant();
        assert!((factor.ln_determinant() - expected).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let mut envelope = Envelope::zeros(vec![0, 0]);
        envelope.add(0, 0, 1.0);
        envelope.add(1, 0, 2.0);
        envelope.add(1, 1, 4.0);
        assert!(envelope.cholesky().is_none());
        assert!(Envelope::zeros(vec![0]).cholesky().is_none());
    }
}
