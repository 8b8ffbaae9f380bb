//! Areas and lines of the site's ENU as longitudes and latitudes, cut where the map is.

use geo::{BooleanOps, Coord, LineString, MultiPolygon, Polygon};

use crate::frame::{Enu, Geodetic, Point, Site};

/// Turns horizontal ENU into longitudes and latitudes. `up_m` says how high the ground is at a
/// place: away from the origin the tangent plane leaves the planet.
pub(super) struct Cartographer<'a> {
    pub(super) site: &'a Site,
    pub(super) up_m: &'a dyn Fn(f64, f64) -> f64,
}

/// How far the site's half-planes reach on either side of the meridian that cuts the map, metres.
const BEYOND_M: f64 = 1e6;

impl Cartographer<'_> {
    fn geodetic(&self, at: Coord<f64>) -> Geodetic {
        let up = (self.up_m)(at.x, at.y);
        self.site.geodetic(Point::<Enu>::new(at.x, at.y, up))
    }

    /// An area, cut along the antimeridian where it crosses it and closed over the pole where it
    /// holds it (RFC 7946, section 3.1.9).
    pub(super) fn area(&self, area: &MultiPolygon<f64>) -> MultiPolygon<f64> {
        let mut out = Vec::new();
        for polygon in area {
            if !self.meets_the_cut(polygon) {
                out.push(self.polygon(polygon, None));
                continue;
            }
            let [east, west] = self.hemispheres();
            for (hemisphere, side) in [(east, Side::East), (west, Side::West)] {
                for part in &polygon.intersection(&hemisphere) {
                    out.push(self.polygon(part, Some(side)));
                }
            }
        }
        MultiPolygon::new(out)
    }

    /// A line, cut along the antimeridian where it crosses it.
    pub(super) fn line(places: &[Geodetic]) -> Vec<Vec<Coord<f64>>> {
        let mut parts = vec![Vec::new()];
        let mut last: Option<Coord<f64>> = None;
        for place in places {
            let at = super::layer::lon_lat(*place);
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

    /// Whether a polygon crosses the antimeridian or holds a pole: then some edge of it steps over
    /// half the map.
    fn meets_the_cut(&self, polygon: &Polygon<f64>) -> bool {
        let lons: Vec<f64> = polygon
            .exterior()
            .coords()
            .map(|&c| self.geodetic(c).lon_deg())
            .collect();
        lons.windows(2).any(|w| (w[1] - w[0]).abs() > 180.0)
    }

    /// The two sides of the plane through the axis and the meridians 0 and 180, in the tangent
    /// plane: where longitudes are positive, and where they are negative.
    fn hemispheres(&self) -> [Polygon<f64>; 2] {
        // The unit vector towards longitude 90 is this plane's normal; written in ENU it is the
        // gradient of "how far east of the plane".
        let origin = self.site.origin();
        let (sin_lon, cos_lon) = origin.lon.sin_cos();
        let sin_lat = origin.lat.sin();
        let normal = nalgebra::Vector2::new(cos_lon, -sin_lat * sin_lon);
        let ellipsoid = self.site.planet().ellipsoid;
        let offset_m = ellipsoid.to_ecef(origin).xyz.y;
        let norm = normal.norm().max(1e-12);
        let (n, d) = (normal / norm, offset_m / norm);
        let along = nalgebra::Vector2::new(-n.y, n.x);
        let foot = n * -d;
        let side = |sign: f64| {
            let corners = [
                foot - along * BEYOND_M,
                foot + along * BEYOND_M,
                foot + along * BEYOND_M + n * (sign * BEYOND_M),
                foot - along * BEYOND_M + n * (sign * BEYOND_M),
            ];
            let ring: Vec<Coord<f64>> = corners.iter().map(|c| Coord { x: c.x, y: c.y }).collect();
            Polygon::new(LineString::new(ring), Vec::new())
        };
        [side(1.0), side(-1.0)]
    }

    fn polygon(&self, polygon: &Polygon<f64>, side: Option<Side>) -> Polygon<f64> {
        let ring = |ring: &LineString<f64>| self.ring(ring, side);
        let holes = polygon.interiors().iter().map(ring).collect();
        Polygon::new(ring(polygon.exterior()), holes)
    }

    fn ring(&self, ring: &LineString<f64>, side: Option<Side>) -> LineString<f64> {
        let mut out: Vec<Coord<f64>> = Vec::new();
        for &coord in ring.coords() {
            let place = self.geodetic(coord);
            let mut at = super::layer::lon_lat(place);
            if let Some(side) = side {
                at.x = side.snapped(at.x);
                if let Some(&before) = out.last()
                    && (at.x - before.x).abs() > 90.0
                {
                    // The cut runs over the pole: on the map it is an edge along the pole's
                    // latitude.
                    let pole = 90f64.copysign(place.lat);
                    out.push(Coord {
                        x: before.x,
                        y: pole,
                    });
                    out.push(Coord { x: at.x, y: pole });
                }
            }
            out.push(at);
        }
        out.dedup();
        LineString::new(out)
    }
}

/// Which half of the map a part lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    East,
    West,
}

impl Side {
    /// Longitudes on the cut itself come out of arithmetic with either sign, and a hair off.
    fn snapped(self, lon_deg: f64) -> f64 {
        const HAIR_DEG: f64 = 1e-5;
        let lon = match self {
            Self::East if lon_deg < -90.0 => 180.0,
            Self::East if lon_deg < 0.0 => 0.0,
            Self::West if lon_deg > 90.0 => -180.0,
            Self::West if lon_deg > 0.0 => 0.0,
            _ => lon_deg,
        };
        if lon.abs() > 180.0 - HAIR_DEG {
            180f64.copysign(lon)
        } else if lon.abs() < HAIR_DEG {
            0.0
        } else {
            lon
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Planet;
    use geo::{Area, Validation};

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
            assert_eq!(drawn.0.len(), 2);
            assert!(drawn.is_valid(), "{lat}: {drawn:?}");
            // Every longitude is seen from the pole: both halves reach it and span 180 degrees.
            for polygon in &drawn {
                let coords: Vec<_> = polygon.exterior().coords().copied().collect();
                let at_pole = coords.iter().filter(|c| c.y.abs() == 90.0).count();
                assert!(at_pole >= 2, "{lat}: {coords:?}");
            }
        }
    }

    #[test]
    fn lines_are_cut_too() {
        let site = Site::new(Planet::EARTH, Geodetic::from_degrees(0.0, 180.0, 0.0));
        let cartographer = Cartographer {
            site: &site,
            up_m: &|_, _| 0.0,
        };
        let places: Vec<Geodetic> = [179.5, -179.5, -179.0]
            .map(|lon| Geodetic::from_degrees(1.0, lon, 0.0))
            .to_vec();
        let parts = cartographer.line(&places);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0].last(), Some(&Coord { x: 180.0, y: 1.0 }));
        assert_eq!(parts[1][0], Coord { x: -180.0, y: 1.0 });
    }
}
