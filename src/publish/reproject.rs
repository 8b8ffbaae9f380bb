//! Layers in another coordinate reference system.

use geo::{Coord, LineString, MultiPolygon, Polygon};

use super::layer::{Geometry, Layer, on_grid};
use super::simple::simple;
use crate::frame::{Crs, CrsError, Planet};

/// How far a straight edge may stray from where it was straight, in units of the system of lengths.
const STRAY: f64 = 0.001;

/// How far, in degrees: as much on Earth.
const STRAY_DEG: f64 = 1e-8;

/// An edge is halved at most this often.
const HALVINGS: u32 = 10;

impl Layer {
    /// The layer in another system of its planet. Edges get corners where they would stray by more than
    /// a millimetre from where they are straight in longitude and latitude.
    ///
    /// # Errors
    /// [`CrsError::OutsideDomain`] where the system does not reach a place.
    pub fn on_map(&self, crs: &Crs) -> Result<Self, CrsError> {
        let mut layer = self.clone();
        layer.crs = Some(crs.clone());
        let to_map = ToMap {
            crs,
            planet: self.planet.eastward(),
            decimals: layer.decimals(),
        };
        for feature in &mut layer.features {
            if let Some(geometry) = &feature.geometry {
                feature.geometry = Some(to_map.geometry(geometry)?);
            }
        }
        Ok(layer)
    }
}

/// The way from a planet's map to a system.
struct ToMap<'a> {
    crs: &'a Crs,
    planet: Planet,
    decimals: usize,
}

impl ToMap<'_> {
    fn geometry(&self, geometry: &Geometry) -> Result<Geometry, CrsError> {
        Ok(match geometry {
            Geometry::Point(at) => Geometry::Point(on_grid(self.place(*at)?, self.decimals)),
            Geometry::Lines(lines) => {
                let line = |line: &Vec<Coord<f64>>| -> Result<Vec<Coord<f64>>, CrsError> {
                    let line = self.line(line)?;
                    Ok(line.iter().map(|c| on_grid(*c, self.decimals)).collect())
                };
                Geometry::Lines(lines.iter().map(line).collect::<Result<_, _>>()?)
            }
            Geometry::Polygons(polygons) => {
                let ring = |ring: &LineString<f64>| self.line(&ring.0).map(LineString::new);
                let polygon = |polygon: &Polygon<f64>| -> Result<Polygon<f64>, CrsError> {
                    let holes = polygon.interiors().iter().map(ring);
                    let holes = holes.collect::<Result<_, _>>()?;
                    Ok(Polygon::new(ring(polygon.exterior())?, holes))
                };
                let polygons = polygons.iter().map(polygon).collect::<Result<_, _>>()?;
                Geometry::Polygons(simple(&MultiPolygon::new(polygons), self.decimals))
            }
        })
    }

    fn place(&self, at: Coord<f64>) -> Result<Coord<f64>, CrsError> {
        let place = self.planet.place(at.y, at.x, 0.0);
        let (x, y) = self.crs.xy(place.lon, place.lat)?;
        Ok(Coord { x, y })
    }

    /// The corners of a line, and those between them that keep it where it was.
    fn line(&self, line: &[Coord<f64>]) -> Result<Vec<Coord<f64>>, CrsError> {
        let mut out = Vec::with_capacity(line.len());
        let Some(&first) = line.first() else {
            return Ok(out);
        };
        out.push(self.place(first)?);
        for edge in line.windows(2) {
            let to = self.place(edge[1])?;
            let from = out[out.len() - 1];
            self.halve((edge[0], from), (edge[1], to), HALVINGS, &mut out)?;
            out.push(to);
        }
        Ok(out)
    }

    /// Puts the middle of an edge between its ends, and so on, where it would stray; each end with its place
    /// in both systems.
    fn halve(
        &self,
        from: (Coord<f64>, Coord<f64>),
        to: (Coord<f64>, Coord<f64>),
        times: u32,
        out: &mut Vec<Coord<f64>>,
    ) -> Result<(), CrsError> {
        let middle = (from.0 + to.0) / 2.0;
        let at = self.place(middle)?;
        let off = at - (from.1 + to.1) / 2.0;
        let allowed = if self.crs.is_projected() {
            STRAY
        } else {
            STRAY_DEG
        };
        if times == 0 || off.x.hypot(off.y) <= allowed {
            return Ok(());
        }
        self.halve(from, (middle, at), times - 1, out)?;
        out.push(at);
        self.halve((middle, at), to, times - 1, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::layer::{Column, Kind};
    use geo::{Area, Contains, Point, polygon};

    fn layer(kind: Kind, geometry: Geometry) -> Layer {
        let columns = vec![Column::text("a", "", |_: &()| None)];
        let rows = [("1".to_owned(), Some(geometry), ())];
        Layer::new(("l", "", ""), Some(kind), Planet::EARTH).filled(columns, rows)
    }

    #[test]
    fn a_point_is_where_pyproj_has_it() {
        let at = Geometry::Point(Coord { x: 8.4, y: 49.0 });
        let utm = Crs::new("EPSG:32632", Planet::EARTH).unwrap();
        let layer = layer(Kind::Point, at).on_map(&utm).unwrap();
        assert_eq!(
            layer.features[0].geometry,
            Some(Geometry::Point(Coord {
                x: 456_114.595_9,
                y: 5_427_629.203_9
            }))
        );
        assert_eq!(layer.decimals(), 4);
        assert_eq!(layer.crs_text().unwrap().code, 32632);
    }

    /// The side of a square along a parallel is bent on the map: the middle of the parallel, which two
    /// corners alone would leave out, is within.
    #[test]
    fn long_edges_get_corners() {
        let square =
            polygon![(x: 8.0, y: 60.0), (x: 8.1, y: 60.0), (x: 8.1, y: 60.05), (x: 8.0, y: 60.05)];
        let utm = Crs::new("EPSG:32632", Planet::EARTH).unwrap();
        let layer = layer(Kind::Polygon, Geometry::Polygons(square.into()));
        let layer = layer.on_map(&utm).unwrap();
        let Some(Geometry::Polygons(area)) = &layer.features[0].geometry else {
            panic!("no polygon");
        };
        assert!(area.0[0].exterior().0.len() > 40);
        let (x, y) = utm.xy(8.05f64.to_radians(), 60.0f64.to_radians()).unwrap();
        assert!(area.contains(&Point::new(x, y + 0.003)));
        assert!(!area.contains(&Point::new(x, y - 0.003)));
        let width_m = 6_378_137.0 * 0.1f64.to_radians() * 60f64.to_radians().cos();
        assert!((area.unsigned_area() / (width_m * 5571.0) - 1.0).abs() < 0.01);
    }

    #[test]
    fn places_that_a_map_does_not_reach_are_said() {
        let at = Geometry::Point(Coord { x: 8.4, y: 49.0 });
        let ortho = Crs::new("+proj=ortho +lat_0=-60 +type=crs", Planet::EARTH).unwrap();
        let error = layer(Kind::Point, at).on_map(&ortho).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("lies outside the domain of +proj=ortho"),
            "{error}"
        );
    }
}
