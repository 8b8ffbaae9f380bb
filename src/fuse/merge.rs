//! Clusters that have collapsed to one point become one.

use nalgebra::Vector2;

use super::gate::Neighbours;

/// Groups of points chained by steps of less than `distance`: for every point the index of its
/// group, groups numbered by their first point. `None` where every point stands alone.
pub(super) fn collapsed(points: &[Vector2<f64>], distance: f64) -> Option<Vec<usize>> {
    let mut parent: Vec<usize> = (0..points.len()).collect();
    let mut any = false;
    let near = Neighbours::new(points).within_each(points, distance);
    for (i, neighbours) in near.iter().enumerate() {
        for &j in neighbours.iter().filter(|&&j| j > i) {
            if (points[i] - points[j]).norm() < distance {
                any = true;
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    if !any {
        return None;
    }
    let mut number = vec![usize::MAX; points.len()];
    let mut next = 0;
    let mut groups = Vec::with_capacity(points.len());
    for i in 0..points.len() {
        let r = root(&mut parent, i);
        if number[r] == usize::MAX {
            number[r] = next;
            next += 1;
        }
        groups.push(number[r]);
    }
    Some(groups)
}

/// The smallest index of a point's group, with the path to it shortened.
fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_become_one_group() {
        let points: Vec<_> = [0.0, 5.0, 0.015, 0.03, 9.0, 5.01]
            .map(|x| Vector2::new(x, 0.0))
            .to_vec();
        assert_eq!(collapsed(&points, 0.02), Some(vec![0, 1, 0, 0, 2, 1]));
        assert_eq!(collapsed(&points, 0.001), None);
    }
}
