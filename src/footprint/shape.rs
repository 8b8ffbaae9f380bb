//! The one place where areas become parry's shapes and back.

use geo::{MultiPolygon, TriangulateEarcut};
use parry2d::bounding_volume::Aabb;
use parry2d::math::Vec2;
use parry2d::query::PointQuery;
use parry2d::shape::{Shape as _, TriMesh};

/// An area as a mesh of triangles under a tree of boxes: containment in a time that grows with the
/// logarithm of its corners, holes and several parts included.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    mesh: TriMesh,
}

impl Shape {
    /// `None` for an area without any extent.
    pub(super) fn new(area: &MultiPolygon<f64>) -> Option<Self> {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for polygon in area {
            let raw = polygon.earcut_triangles_raw();
            let first = u32::try_from(vertices.len()).ok()?;
            vertices.extend(raw.vertices.iter().map(|p| Vec2::new(p[0], p[1])));
            for corners in raw.triangle_indices.chunks_exact(3) {
                let index = |i: usize| u32::try_from(corners[i]).ok().map(|i| i + first);
                triangles.push([index(0)?, index(1)?, index(2)?]);
            }
        }
        let mesh = TriMesh::new(vertices, triangles).ok()?;
        Some(Self { mesh })
    }

    pub(super) fn contains(&self, east_m: f64, north_m: f64) -> bool {
        self.mesh.contains_local_point(Vec2::new(east_m, north_m))
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.mesh.compute_local_aabb()
    }
}

/// A box around one place.
pub(super) fn point_bounds(east_m: f64, north_m: f64) -> Aabb {
    let place = Vec2::new(east_m, north_m);
    Aabb::new(place, place)
}
