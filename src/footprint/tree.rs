//! All footprints of a run, and the tree over them.

use geo::{BooleanOps, MultiPolygon, unary_union};
use parry2d::bounding_volume::Aabb;
use parry2d::partitioning::{Bvh, BvhBuildStrategy};

use super::shape::point_bounds;
use super::{Footprint, seen_by_at_least};
use crate::frame::{Enu, Point};

/// The footprints of all views, by view index.
pub struct Footprints {
    footprints: Vec<Footprint>,
    /// Over the footprints that are not empty; a leaf's number is the view's.
    tree: Bvh,
}

impl Footprints {
    /// From one footprint a view, in the order of the views.
    pub fn new(footprints: Vec<Footprint>) -> Self {
        let bounds = footprints.iter().enumerate().filter_map(|(view, f)| {
            let shape = f.shape.as_ref()?;
            Some((view, shape.bounds()))
        });
        Self {
            tree: Bvh::from_iter(BvhBuildStrategy::Binned, bounds),
            footprints,
        }
    }

    /// The footprint of a view.
    pub fn of(&self, view: usize) -> &Footprint {
        &self.footprints[view]
    }

    /// All footprints, by view.
    pub fn all(&self) -> &[Footprint] {
        &self.footprints
    }

    /// The views that could have seen a place, ascending.
    pub fn views_covering(&self, place: Point<Enu>) -> Vec<usize> {
        let (east_m, north_m) = (place.xyz.x, place.xyz.y);
        let mut views = self.near(&point_bounds(east_m, north_m));
        views.retain(|&view| self.footprints[view].covers(east_m, north_m));
        views
    }

    /// The other views whose footprints share ground with that of this view, ascending.
    pub fn views_overlapping(&self, view: usize) -> Vec<usize> {
        let mine = &self.footprints[view];
        let Some(shape) = &mine.shape else {
            return Vec::new();
        };
        let mut views = self.near(&shape.bounds());
        views.retain(|&other| {
            let theirs = self.footprints[other].ground();
            other != view && !mine.ground().intersection(theirs).0.is_empty()
        });
        views
    }

    /// The part of a view's footprint that at least one other view covers.
    pub fn covered_by_others(&self, view: usize) -> MultiPolygon<f64> {
        let mine = &self.footprints[view];
        let Some(shape) = &mine.shape else {
            return MultiPolygon::new(Vec::new());
        };
        let others: Vec<&MultiPolygon<f64>> = self
            .near(&shape.bounds())
            .into_iter()
            .filter(|&other| other != view)
            .map(|other| self.footprints[other].ground())
            .collect();
        unary_union(others).intersection(mine.ground())
    }

    /// The ground that at least `k` views see.
    pub fn seen_by_at_least(&self, k: usize) -> MultiPolygon<f64> {
        seen_by_at_least(self.footprints.iter().map(Footprint::ground), k)
    }

    /// Views whose bounding boxes meet this one, ascending.
    fn near(&self, bounds: &Aabb) -> Vec<usize> {
        if self.tree.is_empty() {
            return Vec::new();
        }
        let mut views: Vec<usize> = self
            .tree
            .intersect_aabb(bounds)
            .map(|leaf| leaf as usize)
            .collect();
        views.sort_unstable();
        views
    }
}
