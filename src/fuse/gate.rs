//! Which observations are near which clusters, by a spatial tree.

use nalgebra::Vector2;
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

type Entry = GeomWithData<[f64; 2], usize>;

/// Points that answer who is near.
pub(super) struct Neighbours {
    tree: RTree<Entry>,
    count: usize,
}

impl Neighbours {
    pub(super) fn new(points: &[Vector2<f64>]) -> Self {
        let entries = points.iter().enumerate();
        let entries = entries.map(|(i, p)| Entry::new([p.x, p.y], i)).collect();
        Self {
            tree: RTree::bulk_load(entries),
            count: points.len(),
        }
    }

    /// Indices of all points within `radius` of a place, ascending.
    fn within(&self, place: Vector2<f64>, radius: f64) -> Vec<usize> {
        if radius.is_infinite() {
            return (0..self.count).collect();
        }
        let reach = AABB::from_corners(
            [place.x - radius, place.y - radius],
            [place.x + radius, place.y + radius],
        );
        let mut found: Vec<usize> = self
            .tree
            .locate_in_envelope(&reach)
            .filter(|e| {
                let [x, y] = *e.geom();
                (x - place.x).powi(2) + (y - place.y).powi(2) <= radius * radius
            })
            .map(|e| e.data)
            .collect();
        found.sort_unstable();
        found
    }

    /// The neighbours of every place, in the order of the places.
    pub(super) fn within_each(&self, places: &[Vector2<f64>], radius: f64) -> Vec<Vec<usize>> {
        places
            .par_iter()
            .with_min_len(256)
            .map(|&place| self.within(place, radius))
            .collect()
    }
}
