//! Polynomials of one variable, by their coefficients from the constant term upwards.

/// The value and the derivative at `x`.
#[inline(always)]
pub(super) fn evaluate<const N: usize>(coefficients: &[f64; N], x: f64) -> (f64, f64) {
    let (mut value, mut slope) = (coefficients[N - 1], 0.0);
    for i in (0..N - 1).rev() {
        slope = slope * x + value;
        value = value * x + coefficients[i];
    }
    (value, slope)
}

/// The product of two polynomials.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; (a.len() + b.len()).saturating_sub(1)];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            product[i + j] += x * y;
        }
    }
    product
}

/// The difference of two polynomials.
pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    let at = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len()))
        .map(|i| at(a, i) - at(b, i))
        .collect()
}

/// The derivative.
pub(super) fn derivative(coefficients: &[f64]) -> Vec<f64> {
    let powers = (1u32..).map(f64::from);
    let terms = coefficients.iter().skip(1);
    terms.zip(powers).map(|(c, n)| c * n).collect()
}

/// The smallest place above zero where the polynomial changes its sign, if there is one. Where it
/// only touches zero, rounding decides.
pub(super) fn first_positive_root(coefficients: &[f64]) -> Option<f64> {
    positive_roots(coefficients).first().copied()
}

/// All places above zero where the polynomial changes its sign, ascending. Between two neighbouring
/// roots of its derivative it is monotonic, so each such stretch holds one root at most.
fn positive_roots(coefficients: &[f64]) -> Vec<f64> {
    let degree = coefficients.iter().rposition(|&c| c != 0.0).unwrap_or(0);
    if degree == 0 {
        return Vec::new();
    }
    let used = &coefficients[..=degree];
    // Cauchy's bound: no root is larger than this.
    let largest = used[..degree].iter().fold(0.0f64, |m, c| m.max(c.abs()));
    let bound = 1.0 + largest / used[degree].abs();
    let mut marks = vec![0.0];
    marks.extend(positive_roots(&derivative(used)));
    marks.push(bound);
    marks
        .windows(2)
        .filter_map(|ends| bisect(used, ends[0], ends[1]))
        .collect()
}

fn bisect(coefficients: &[f64], mut low: f64, mut high: f64) -> Option<f64> {
    let value = |x: f64| coefficients.iter().rev().fold(0.0, |v, c| v * x + c);
    let rising = value(low) < 0.0;
    if value(low) == 0.0 || (value(high) > 0.0) != rising {
        return None;
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Some(middle);
        }
        if (value(middle) > 0.0) == rising {
            high = middle;
        } else {
            low = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_above_zero_alone_are_found() {
        // (x - 1)(x - 2)(x + 3) = x^3 - 7 x + 6
        let roots = positive_roots(&[6.0, -7.0, 0.0, 1.0]);
        assert_eq!(roots.len(), 2);
        assert!((roots[0] - 1.0).abs() < 1e-14 && (roots[1] - 2.0).abs() < 1e-14);
        // x^2 + 1 has none.
        assert_eq!(first_positive_root(&[1.0, 0.0, 1.0]), None);
        assert_eq!(first_positive_root(&[1.0, 0.0, 0.0]), None);
    }

    #[test]
    fn value_and_slope() {
        // 1 + 2 x + 3 x^2 at 2: 17, slope 14
        assert_eq!(evaluate(&[1.0, 2.0, 3.0], 2.0), (17.0, 14.0));
        assert_eq!(product(&[1.0, 1.0], &[-1.0, 1.0]), [-1.0, 0.0, 1.0]);
        assert_eq!(difference(&[1.0], &[0.0, 2.0]), [1.0, -2.0]);
    }
}
