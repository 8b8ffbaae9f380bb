//! Polygons that are simple to the last decimal that is written.

use geo::{
    BooleanOps, BoundingRect, ConvexHull, Coord, MapCoords, MultiPolygon, Polygon, Rect, Validation,
};

use super::layer::on_grid;

/// How often an area is mended before its hull must do.
const ROUNDS: usize = 5;

/// An area whose corners have so many decimals, and which is valid with exactly those:
/// rounding can fold what is thinner than the last decimal. What has no extent then is gone.
pub(super) fn simple(area: &MultiPolygon<f64>, decimals: usize) -> MultiPolygon<f64> {
    let on_the_grid = |area: &MultiPolygon<f64>| on_the_grid(area, decimals);
    let mut rounded = on_the_grid(area);
    for _ in 0..ROUNDS {
        if rounded.is_valid() {
            return rounded;
        }
        rounded = on_the_grid(&united(&rounded));
    }
    let hulls = rounded.iter().map(ConvexHull::convex_hull).collect();
    let hulls: MultiPolygon<f64> = on_the_grid(&MultiPolygon::new(hulls));
    if hulls.is_valid() {
        hulls
    } else {
        on_the_grid(&MultiPolygon::from(rounded.convex_hull()))
    }
}

/// The area with rounded corners, without rings that have shrunk to a line or a point.
fn on_the_grid(area: &MultiPolygon<f64>, decimals: usize) -> MultiPolygon<f64> {
    let ring = |ring: &geo::LineString<f64>| {
        let mut coords: Vec<Coord<f64>> = ring.coords().map(|c| on_grid(*c, decimals)).collect();
        coords.dedup();
        geo::LineString::new(coords)
    };
    let polygons = area.iter().map(|polygon| {
        let holes = polygon.interiors().iter().map(ring);
        let holes = holes.filter(has_extent).collect();
        Polygon::new(ring(polygon.exterior()), holes)
    });
    polygons.filter(|p| has_extent(p.exterior())).collect()
}

/// Whether a ring, with its first corner again at the end, has three different ones.
fn has_extent(ring: &geo::LineString<f64>) -> bool {
    ring.0.len() > 3
}

/// The area with its folds undone. Both axes are stretched to the unit square: the Boolean
/// operations work with 30 bits of the larger extent.
fn united(area: &MultiPolygon<f64>) -> MultiPolygon<f64> {
    let Some(bounds) = area.bounding_rect() else {
        return area.clone();
    };
    let to_unit = |c: Coord<f64>| Coord {
        x: share(c.x, bounds.min().x, bounds.width()),
        y: share(c.y, bounds.min().y, bounds.height()),
    };
    let from_unit = |c: Coord<f64>| Coord {
        x: bounds.min().x + c.x * bounds.width(),
        y: bounds.min().y + c.y * bounds.height(),
    };
    let page = Rect::new((-1.0, -1.0), (2.0, 2.0)).to_polygon();
    let parts = area
        .iter()
        .map(|p| p.map_coords(to_unit).intersection(&page));
    let whole = parts.reduce(|a, b| a.union(&b));
    whole.map_or(area.clone(), |whole| whole.map_coords(from_unit))
}

fn share(x: f64, min: f64, extent: f64) -> f64 {
    if extent > 0.0 {
        (x - min) / extent
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::layer::DECIMALS;
    use geo::{Area, polygon};

    #[test]
    fn a_valid_area_is_only_rounded() {
        let square: MultiPolygon<f64> =
            polygon![(x: 0.0, y: 0.0), (x: 1.0, y: 0.0), (x: 1.000_000_000_4, y: 1.0), (x: 0.0, y: 1.0)]
                .into();
        let out = simple(&square, DECIMALS);
        assert_eq!(out.unsigned_area(), 1.0);
    }

    #[test]
    fn a_bow_tie_becomes_two_triangles() {
        let tie = polygon![(x: 0.0, y: 0.0), (x: 1.0, y: 1.0), (x: 1.0, y: 0.0), (x: 0.0, y: 1.0)];
        let out = simple(&tie.into(), DECIMALS);
        assert!(out.is_valid());
        assert_eq!(out.0.len(), 2);
        assert!((out.unsigned_area() - 0.5).abs() < 1e-8);
    }

    /// Ellipses a few grid cells thin, at every azimuth.
    #[test]
    fn thin_ellipses_stay_simple() {
        for degree in 0..180 {
            for thin in [1e-9, 2.5e-9, 9e-9, 1e-7] {
                let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                let corner = |i: i32| {
                    let (across, along) = (f64::from(i) * std::f64::consts::TAU / 64.0).sin_cos();
                    let (along, across) = (along * 3e-5, across * thin);
                    Coord {
                        x: 8.4 + along * sin - across * cos,
                        y: 49.0 + along * cos + across * sin,
                    }
                };
                let ring: Vec<Coord<f64>> = (0..64).map(corner).collect();
                let ellipse = Polygon::new(ring.into(), Vec::new());
                let out = simple(&ellipse.into(), DECIMALS);
                assert!(out.is_valid(), "{degree} {thin}: {out:?}");
            }
        }
    }

    #[test]
    fn what_is_smaller_than_the_grid_is_gone() {
        let speck = polygon![(x: 0.0, y: 0.0), (x: 1e-10, y: 0.0), (x: 0.0, y: 1e-10)];
        assert!(simple(&speck.into(), DECIMALS).0.is_empty());
    }
}
