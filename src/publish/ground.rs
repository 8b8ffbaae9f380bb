//! Areas and lines of the site's ENU as longitudes and latitudes, cut where the map is.

use geo::{BooleanOps, BoundingRect, Coord, LineString, MapCoords, MultiPolygon, Polygon, Rect};

use super::layer::{DECIMALS, lon_lat};
use super::simple::simple;
use crate::frame::{Enu, Geodetic, Planet, Point, Site};

/// Turns horizontal ENU into longitudes and latitudes. `up_m` says how high the ground is at a
/// place: away from the origin the tangent plane leaves the planet.
pub(super) struct Cartographer<'a> {
    pub(super) site: &'a Site,
    pub(super) up_m: &'a dyn Fn(f64, f64) -> f64,
}

/// How far a place may lie from where the map shows it, degrees of longitude.
const TURNS: [f64; 3] = [-360.0, 0.0, 360.0];

impl Cartographer<'_> {
    /// Where on the map a place of the plane is.
    fn lon_lat(&self, at: Coord<f64>) -> Coord<f64> {
        let up = (self.up_m)(at.x, at.y);
        let place = self.site.geodetic(Point::<Enu>::new(at.x, at.y, up));
        lon_lat(place, self.site.planet())
    }

    /// An area, cut along the antimeridian where it crosses it and closed over the pole where it
    /// holds it (RFC 7946, section 3.1.9). Its corners have the decimals of the map, and every
    /// polygon is simple.
    pub(super) fn area(&self, area: &MultiPolygon<f64>) -> MultiPolygon<f64> {
        let mut out = Vec::new();
        for polygon in area {
            match self.unrolled(polygon) {
                Some(unrolled) => out.extend(on_the_map(&unrolled)),
                None => out.extend(self.around_the_pole(polygon)),
            }
        }
        MultiPolygon::new(out)
    }

    /// A polygon with longitudes that do not jump, whatever they add up to; `None` where it goes
    /// around a pole.
    fn unrolled(&self, polygon: &Polygon<f64>) -> Option<Polygon<f64>> {
        let exterior = self.unrolled_ring(polygon.exterior())?;
        let bounds = exterior.bounding_rect()?;
        let mut holes = Vec::new();
        for hole in polygon.interiors() {
            let hole = self.unrolled_ring(hole)?;
            let middle = hole.bounding_rect()?.center().x;
            let turns = ((bounds.center().x - middle) / 360.0).round();
            holes.push(moved(&hole, turns * 360.0));
        }
        Some(Polygon::new(exterior, holes))
    }

    /// A straight edge that misses the pole turns by less than half of the map.
    fn unrolled_ring(&self, ring: &LineString<f64>) -> Option<LineString<f64>> {
        let mut out: Vec<Coord<f64>> = Vec::new();
        for &coord in ring.coords() {
            let mut at = self.lon_lat(coord);
            if let Some(before) = out.last() {
                at.x += ((before.x - at.x) / 360.0).round() * 360.0;
            }
            out.push(at);
        }
        let (first, last) = (out.first()?, out.last()?);
        ((last.x - first.x).abs() < 180.0).then(|| LineString::new(out))
    }

    /// A polygon that goes around a pole, as RFC 7946 has it: from one edge of the map to the other,
    /// and back along the pole's latitude.
    fn around_the_pole(&self, polygon: &Polygon<f64>) -> Vec<Polygon<f64>> {
        let exterior = self.over_the_pole(polygon.exterior());
        let Some(bounds) = exterior.bounding_rect() else {
            return Vec::new();
        };
        // A pole's surroundings span all longitudes and hardly any latitude: both are stretched
        // alike for the 30 bits of the Boolean operations.
        let (pole, height) = (90f64.copysign(bounds.min().y), bounds.height().max(1e-9));
        let to_unit = |c: Coord<f64>| Coord {
            x: c.x / 360.0,
            y: (c.y - pole) / height,
        };
        let from_unit = |c: Coord<f64>| Coord {
            x: to_edge(c.x * 360.0, 1e-5),
            y: pole + c.y * height,
        };
        let mut area = MultiPolygon::from(exterior.map_coords(to_unit));
        for hole in polygon.interiors() {
            let hole = match self.unrolled_ring(hole) {
                Some(ring) => Polygon::new(ring, Vec::new()),
                None => self.over_the_pole(hole),
            };
            for turn in TURNS {
                let hole = hole.map_coords(|c| {
                    to_unit(Coord {
                        x: c.x - turn,
                        y: c.y,
                    })
                });
                area = area.difference(&hole);
            }
        }
        let parts = TURNS.into_iter().flat_map(|turn| {
            let page = Rect::new((-0.5, -2.0), (0.5, 2.0)).to_polygon();
            let moved = area.map_coords(|c| Coord {
                x: c.x - turn / 360.0,
                y: c.y,
            });
            simple(&moved.intersection(&page).map_coords(from_unit), DECIMALS).0
        });
        parts.collect()
    }

    /// The area between a ring around a pole and the pole.
    fn over_the_pole(&self, ring: &LineString<f64>) -> Polygon<f64> {
        let corners = ring.0.len().saturating_sub(1);
        let at = |i: usize| self.lon_lat(ring.0[i % corners]);
        // It begins where it crosses the antimeridian, so that it ends there on the other side.
        let crosses = |&i: &usize| (at(i + 1).x - at(i).x).abs() > 180.0;
        let Some(start) = (0..corners).find(crosses) else {
            return Polygon::new(LineString::new(Vec::new()), Vec::new());
        };
        let (before, after) = (at(start), at(start + 1));
        let (west, east) = (180f64.copysign(after.x), 180f64.copysign(before.x));
        let share = (east - before.x) / (after.x + 2.0 * east - before.x);
        let lat = before.y + share * (after.y - before.y);
        let mut out = vec![Coord { x: west, y: lat }];
        for i in start + 1..=start + corners {
            let mut next = at(i);
            if let Some(last) = out.last() {
                next.x += ((last.x - next.x) / 360.0).round() * 360.0;
            }
            out.push(next);
        }
        let pole = 90f64.copysign(lat);
        out.push(Coord { x: east, y: lat });
        out.push(Coord { x: east, y: pole });
        out.push(Coord { x: west, y: pole });
        Polygon::new(LineString::new(out), Vec::new())
    }

    /// A line, cut along the antimeridian where it crosses it.
    pub(super) fn line(planet: Planet, places: &[Geodetic]) -> Vec<Vec<Coord<f64>>> {
        let mut parts = vec![Vec::new()];
        let mut last: Option<Coord<f64>> = None;
        for place in places {
            let at = lon_lat(*place, planet);
            if let Some(before) = last
                && (at.x - before.x).abs() > 180.0
            {
                let edge = 180f64.copysign(before.x);
                let unwrapped = at.x + 360f64.copysign(before.x);
                let share = (edge - before.x) / (unwrapped - before.x);
                let lat = before.y + share * (at.y - before.y);
                if let Some(part) = parts.last_mut() {
                    part.push(Coord { x: edge, y: lat });
                }
                parts.push(vec![Coord { x: -edge, y: lat }]);
            }
            if let Some(part) = parts.last_mut() {
                part.push(at);
            }
            last = Some(at);
        }
        parts.retain(|part| part.len() > 1);
        parts
    }
}

/// An unrolled polygon on the map of longitudes from -180 to 180: what lies beyond an edge of the
/// map comes in at the other one.
fn on_the_map(unrolled: &Polygon<f64>) -> Vec<Polygon<f64>> {
    let Some(bounds) = unrolled.bounding_rect() else {
        return Vec::new();
    };
    let (min, max) = (bounds.min(), bounds.max());
    if min.x >= -180.0 && max.x <= 180.0 {
        return simple(&unrolled.clone().into(), DECIMALS).0;
    }
    // Near a pole an area spans many longitudes and hardly any latitude: both are stretched alike for
    // the 30 bits of the Boolean operations.
    let stretch = bounds.width() / bounds.height().max(1e-12);
    let flat = unrolled.map_coords(|c| Coord {
        x: c.x,
        y: (c.y - min.y) * stretch,
    });
    // As narrow as it may be: a wider box would cost the intersection decimals.
    let margin = bounds.width();
    // What the intersection's 30 bits make of a longitude on the cut.
    let hair_deg = 1e-8 * margin + 1e-11;
    let parts = TURNS.into_iter().flat_map(|turn| {
        let west = (turn - 180.0).max(min.x - margin);
        let east = (turn + 180.0).min(max.x + margin);
        if west >= max.x || east <= min.x {
            return Vec::new();
        }
        let page = Rect::new((west, -margin), (east, 2.0 * margin));
        let part = flat.intersection(&page.to_polygon());
        simple(
            &part.map_coords(|c| Coord {
                x: to_edge(c.x - turn, hair_deg),
                y: min.y + c.y / stretch,
            }),
            DECIMALS,
        )
        .0
    });
    parts.collect()
}

/// A longitude, on the edge of the map where it is so but for the arithmetic of cutting.
fn to_edge(lon_deg: f64, hair_deg: f64) -> f64 {
    if lon_deg.abs() > 180.0 - hair_deg {
        180f64.copysign(lon_deg)
    } else {
        lon_deg
    }
}

fn moved(ring: &LineString<f64>, by_deg: f64) -> LineString<f64> {
    ring.map_coords(|c| Coord {
        x: c.x + by_deg,
        y: c.y,
    })
}

#[cfg(test)]
mod tests {
    use super::super::geojson;
    use super::super::layer::{Geometry, Kind, Layer};
    use super::*;
    use geo::{Area, Validation, Winding};

    fn ring(radius_m: f64) -> MultiPolygon<f64> {
        let corner = |i: i32| {
            let a = f64::from(i).to_radians() * 10.0;
            Coord {
                x: radius_m * a.cos(),
                y: radius_m * a.sin(),
            }
        };
        Polygon::new((0..36).map(corner).collect::<Vec<_>>().into(), Vec::new()).into()
    }

    fn drawn(lat: f64, lon: f64) -> MultiPolygon<f64> {
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(lat, lon, 0.0));
        let cartographer = Cartographer {
            site: &site,
            up_m: &|_, _| 0.0,
        };
        cartographer.area(&ring(100.0))
    }

    fn area_m2(drawn: &MultiPolygon<f64>, lat: f64) -> f64 {
        drawn.unsigned_area() * 111_320f64.powi(2) * lat.to_radians().cos()
    }

    #[test]
    fn an_ordinary_area_stays_one() {
        let drawn = drawn(10.0, 20.0);
        assert_eq!(drawn.0.len(), 1);
        assert!((area_m2(&drawn, 10.0) / ring(100.0).unsigned_area() - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_antimeridian_cuts_an_area_in_two() {
        for lon in [180.0, -179.9997, 179.9996] {
            let drawn = drawn(10.0, lon);
            assert_eq!(drawn.0.len(), 2, "{lon}");
            assert!(drawn.is_valid());
            assert!((area_m2(&drawn, 10.0) / ring(100.0).unsigned_area() - 1.0).abs() < 0.02);
            for polygon in &drawn {
                let on_map = |c: &Coord<f64>| c.x.abs() <= 180.0 && c.y.abs() <= 90.0;
                assert!(polygon.exterior().coords().all(on_map));
                let lons: Vec<f64> = polygon.exterior().coords().map(|c| c.x.signum()).collect();
                assert!(lons.windows(2).all(|w| w[0] == w[1]));
            }
        }
    }

    #[test]
    fn a_pole_inside_becomes_an_edge_of_the_map() {
        for lat in [90.0, -90.0, 89.9998] {
            let drawn = drawn(lat, 30.0);
            assert_eq!(drawn.0.len(), 1);
            assert!(drawn.is_valid(), "{lat}: {drawn:?}");
            // Every longitude is seen from the pole.
            let bounds = drawn.bounding_rect().unwrap();
            assert_eq!((bounds.min().x, bounds.max().x), (-180.0, 180.0));
            let coords: Vec<_> = drawn.0[0].exterior().coords().copied().collect();
            let at_pole = coords.iter().filter(|c| c.y.abs() == 90.0).count();
            assert!(at_pole >= 2, "{lat}: {coords:?}");
        }
    }

    #[test]
    fn what_is_cut_beside_a_pole_keeps_its_corners() {
        for lat in [90.0, -90.0] {
            let site = Site::new(Planet::EARTH, Geodetic::from_degrees(lat, 0.0, 0.0));
            let cartographer = Cartographer {
                site: &site,
                up_m: &|_, _| 0.0,
            };
            // A disc on the side of the antimeridian, which passes the pole at 5 cm.
            let middle = site.enu(Geodetic::from_degrees(
                lat - 0.15 / 111_694.0 * lat.signum(),
                180.0,
                0.0,
            ));
            let disc = ring(0.1).map_coords(|c| Coord {
                x: c.x + middle.xyz.x,
                y: c.y + middle.xyz.y,
            });
            let drawn = cartographer.area(&disc);
            assert_eq!(drawn.0.len(), 2);
            let corners = drawn.0.iter().flat_map(|p| p.exterior().coords());
            for c in corners.filter(|c| c.x.abs() < 180.0) {
                let at = site.enu(Geodetic::from_degrees(c.y, c.x, 0.0));
                let off_m = at.horizontal_distance(middle) - 0.1;
                assert!(off_m.abs() < 3e-4, "{lat}: {off_m} m at {c:?}");
            }
        }
    }

    #[test]
    fn lines_are_cut_too() {
        let places: Vec<Geodetic> = [179.5, -179.5, -179.0]
            .map(|lon| Geodetic::from_degrees(1.0, lon, 0.0))
            .to_vec();
        let parts = Cartographer::line(Planet::EARTH, &places);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0].last(), Some(&Coord { x: 180.0, y: 1.0 }));
        assert_eq!(parts[1][0], Coord { x: -180.0, y: 1.0 });
    }

    /// Pictures and discs, with holes, everywhere on the map where it is cut, and near by.
    #[test]
    fn every_polygon_is_simple_and_on_the_grid() {
        let annulus = |radius_m: f64| {
            let hole = ring(0.4 * radius_m).0[0].exterior().clone();
            MultiPolygon::from(Polygon::new(
                ring(radius_m).0[0].exterior().clone(),
                vec![hole],
            ))
        };
        let mut count = 0;
        for lat in [0.0, -45.0, 89.0, 89.9991, 89.9996, -89.9999, 90.0, -90.0] {
            for lon in [20.0, 179.9995, 180.0, -179.999, -90.0] {
                for radius_m in [0.001, 0.0173, 1.0, 55.5, 100.0, 900.0] {
                    let site = Site::new(Planet::EARTH, Geodetic::from_degrees(lat, lon, 0.0));
                    let cartographer = Cartographer {
                        site: &site,
                        up_m: &|_, _| 0.0,
                    };
                    let drawn = cartographer.area(&annulus(radius_m));
                    let at = format!("{lat} {lon} {radius_m}: {drawn:?}");
                    assert!(!drawn.0.is_empty() && drawn.is_valid(), "{at}");
                    for polygon in &drawn {
                        for c in polygon.exterior().coords() {
                            assert!(c.x.abs() <= 180.0 && c.y.abs() <= 90.0, "{at}");
                            assert_eq!(*c, super::super::layer::on_grid(*c, DECIMALS), "{at}");
                        }
                    }
                    count += drawn.0.len();
                }
            }
        }
        assert!(count >= 240, "{count}");
    }

    #[test]
    fn the_cut_is_exact_far_from_the_origin() {
        // 60 km west of the cut the ground lies 280 m below the tangent plane.
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(10.0, 179.45, 0.0));
        let edge = site.enu(Geodetic::from_degrees(10.0, 180.0, 0.0));
        let cartographer = Cartographer {
            site: &site,
            up_m: &|_, _| edge.xyz.z,
        };
        let around = ring(100.0).map_coords(|c| Coord {
            x: c.x + edge.xyz.x,
            y: c.y + edge.xyz.y,
        });
        let drawn = cartographer.area(&around);
        assert_eq!(drawn.0.len(), 2);
        let whole = ring(100.0).unsigned_area();
        assert!((area_m2(&drawn, 10.0) / whole - 1.0).abs() < 0.02);
        for polygon in &drawn {
            let on_cut = polygon.exterior().coords().filter(|c| c.x.abs() == 180.0);
            assert!(on_cut.count() >= 2, "{polygon:?}");
        }
    }

    #[test]
    fn what_is_written_winds_counter_clockwise() {
        let layer = Layer::new(("ellipses", "", ""), Some(Kind::Polygon), Planet::EARTH);
        for lon in [20.0, 180.0] {
            let backwards = drawn(10.0, lon).map_coords(|c| Coord { x: c.x, y: -c.y });
            let row = ("a".to_owned(), Some(Geometry::Polygons(backwards)), ());
            let text = geojson::text(&layer.clone().filled(Vec::new(), [row]));
            let json: serde_json::Value = serde_json::from_str(&text).unwrap();
            let geometry = &json["features"][0]["geometry"]["coordinates"];
            let parts = if lon == 180.0 { &geometry[0] } else { geometry };
            let number = |v: &serde_json::Value| v.as_f64().unwrap();
            let exterior = parts[0].as_array().unwrap().iter();
            let exterior: LineString<f64> =
                exterior.map(|c| (number(&c[0]), number(&c[1]))).collect();
            assert!(exterior.is_ccw());
        }
    }
}
