//! Geometries as well-known text and binary (OGC 06-103r4), always Multi but for points.

use std::fmt::Write as _;

use geo::{Coord, Orient, Polygon, orient::Direction};

use super::layer::Geometry;

/// A geometry as text, its coordinates with so many decimals.
pub fn text(geometry: &Geometry, decimals: usize) -> String {
    let list = |coords: &[Coord<f64>]| list(coords, decimals);
    let (kind, parts): (&str, Vec<String>) = match geometry {
        Geometry::Point(at) => return format!("POINT ({})", pair(at, decimals)),
        Geometry::Lines(lines) => ("MULTILINESTRING", lines.iter().map(|l| list(l)).collect()),
        Geometry::Polygons(polygons) => {
            let polygons = polygons.orient(Direction::Default);
            let rings = |p: &Polygon<f64>| {
                let rings: Vec<String> = rings(p).map(list).collect();
                format!("({})", rings.join(", "))
            };
            ("MULTIPOLYGON", polygons.iter().map(rings).collect())
        }
    };
    if parts.is_empty() {
        return format!("{kind} EMPTY");
    }
    format!("{kind} ({})", parts.join(", "))
}

/// A geometry as little-endian binary.
pub fn binary(geometry: &Geometry) -> Vec<u8> {
    let mut out = Vec::new();
    match geometry {
        Geometry::Point(at) => {
            header(&mut out, 1);
            coordinate(&mut out, at);
        }
        Geometry::Lines(lines) => {
            header(&mut out, 5);
            count(&mut out, lines.len());
            for line in lines {
                header(&mut out, 2);
                coordinates(&mut out, line);
            }
        }
        Geometry::Polygons(polygons) => {
            header(&mut out, 6);
            count(&mut out, polygons.0.len());
            for polygon in &polygons.orient(Direction::Default) {
                header(&mut out, 3);
                count(&mut out, 1 + polygon.interiors().len());
                for ring in rings(polygon) {
                    coordinates(&mut out, ring);
                }
            }
        }
    }
    out
}

fn rings(polygon: &Polygon<f64>) -> impl Iterator<Item = &[Coord<f64>]> {
    let rings = std::iter::once(polygon.exterior()).chain(polygon.interiors());
    rings.map(|ring| ring.0.as_slice())
}

fn pair(at: &Coord<f64>, decimals: usize) -> String {
    format!("{:.decimals$} {:.decimals$}", at.x, at.y)
}

fn list(coords: &[Coord<f64>], decimals: usize) -> String {
    let mut text = String::from("(");
    for (i, at) in coords.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{}{}",
            if i == 0 { "" } else { ", " },
            pair(at, decimals)
        );
    }
    text.push(')');
    text
}

/// Byte order and type.
fn header(out: &mut Vec<u8>, kind: u32) {
    out.push(1);
    out.extend(kind.to_le_bytes());
}

fn count(out: &mut Vec<u8>, n: usize) {
    // A layer of 2^32 corners would not fit into memory.
    out.extend(u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes());
}

fn coordinates(out: &mut Vec<u8>, coords: &[Coord<f64>]) {
    count(out, coords.len());
    for at in coords {
        coordinate(out, at);
    }
}

fn coordinate(out: &mut Vec<u8>, at: &Coord<f64>) {
    out.extend(at.x.to_le_bytes());
    out.extend(at.y.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use geo::polygon;

    #[test]
    fn text_and_binary_of_each_kind() {
        let at = |x: f64, y: f64| Coord { x, y };
        let point = Geometry::Point(at(1.5, -2.0));
        assert_eq!(text(&point, 9), "POINT (1.500000000 -2.000000000)");
        // The bytes that PostGIS gives for POINT(1.5 -2).
        let hex: String = binary(&point).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(hex, "0101000000000000000000f83f00000000000000c0");
        let lines = Geometry::Lines(vec![vec![at(0.0, 0.0), at(1.0, 0.0)]]);
        assert!(text(&lines, 9).starts_with("MULTILINESTRING ((0.000000000 0.0"));
        assert_eq!(binary(&lines).len(), 5 + 4 + 5 + 4 + 2 * 16);
        let clockwise = polygon![(x: 0.0, y: 0.0), (x: 0.0, y: 1.0), (x: 1.0, y: 1.0)];
        let area = Geometry::Polygons(clockwise.into());
        assert_eq!(
            text(&area, 9),
            "MULTIPOLYGON (((0.000000000 0.000000000, 1.000000000 1.000000000, \
             0.000000000 1.000000000, 0.000000000 0.000000000)))"
        );
        assert_eq!(binary(&area).len(), 5 + 4 + 5 + 4 + 4 + 4 * 16);
    }
}
