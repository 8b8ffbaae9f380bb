//! The layers of a `GeoPackage` as GeoJSON, which the readers of maps take.

use std::path::Path;

use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, OptionalExtension as _, Row};
use serde_json::{Map, Value, json};

use crate::error::{Error, Fault, Place};
use crate::frame::{Crs, CrsError, Geodetic, Planet};

/// A layer of a `GeoPackage` as the text of a GeoJSON file: the one of this name, or where there is
/// none, with `kind`, the first of this type of geometry; `None` where there is none of it either.
///
/// Places on a map projection are taken to the latitudes and longitudes of its planet.
///
/// # Errors
/// What is no `GeoPackage`, a system without a code, a geometry that is no point and no polygon.
pub(super) fn layer(path: &Path, name: &str, kind: Option<&str>) -> Result<Option<String>, Error> {
    let shown = path.display().to_string();
    let failed = |e: rusqlite::Error| {
        let text = format!("not a GeoPackage: {e}");
        Error::from(Fault::new(Place::file(shown.clone()), "", text))
    };
    let fault = |found: String, expected: &str| {
        Error::from(Fault::found(
            Place::file(shown.clone()),
            name,
            found,
            expected,
        ))
    };
    // SQLite would make a file that is not there.
    if !path.is_file() {
        let absent = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(Error::io(path, "read", absent));
    }
    let db = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).map_err(failed)?;
    let Some(table) = table(&db, name, kind).map_err(failed)? else {
        return Ok(None);
    };
    let Some(system) = System::of(&table.authority, table.code) else {
        let found = format!("the system {}:{}", table.authority, table.code);
        let expected = "a system of EPSG on Earth or of IAU_2015 that PROJ knows";
        return Err(fault(found, expected));
    };
    let mut features = Vec::new();
    for row in rows(&db, &table).map_err(failed)? {
        let (properties, blob) = row;
        let mut geometry = match blob {
            None => Value::Null,
            Some(blob) => geometry(&blob).ok_or_else(|| {
                fault(
                    "a geometry of another kind".to_owned(),
                    "points or polygons",
                )
            })?,
        };
        if let (Some(map), Some(coordinates)) = (&system.map, geometry.get_mut("coordinates")) {
            let off_map = |e: CrsError| fault(e.to_string(), "places of its system");
            off_the_map(map, system.planet, coordinates).map_err(off_map)?;
        }
        features.push(json!({ "type": "Feature", "geometry": geometry, "properties": properties }));
    }
    let mut root = json!({ "type": "FeatureCollection", "features": features });
    if let Some(name) = system.name {
        root["crs"] = json!({ "type": "name", "properties": { "name": name } });
    }
    Ok(Some(root.to_string()))
}

/// What the code of a layer's system stands for.
struct System {
    /// The name its planet's latitudes and longitudes have in GeoJSON; none on Earth.
    name: Option<String>,
    planet: Planet,
    /// The map projection, where places are not latitudes and longitudes already.
    map: Option<Crs>,
}

impl System {
    fn of(authority: &str, code: i64) -> Option<Self> {
        let authority = authority.to_ascii_uppercase();
        let urn = |code: i64| Some(format!("urn:ogc:def:crs:IAU:2015:{code}"));
        if authority == "EPSG" {
            let map = match code {
                4326 | 4979 => None,
                _ => Some(Crs::for_map(&format!("EPSG:{code}"), Planet::EARTH).ok()?),
            };
            return Some(Self {
                name: None,
                planet: Planet::EARTH,
                map,
            });
        }
        if !authority.starts_with("IAU") {
            return None;
        }
        let named = |code: i64| Planet::named(&format!("IAU_2015:{code}"));
        if let Some(planet) = named(code) {
            return Some(Self {
                name: urn(code),
                planet,
                map: None,
            });
        }
        // Codes are a body's number and two digits, the sphere's own system the first of them.
        let sphere = code / 100 * 100;
        let planet = named(sphere)?.eastward();
        let map = Crs::for_map(&format!("IAU_2015:{code}"), planet).ok()?;
        Some(Self {
            name: urn(sphere),
            planet,
            map: Some(map),
        })
    }
}

/// Positions of a map, at whatever depth, as longitudes and latitudes in degrees.
fn off_the_map(map: &Crs, planet: Planet, coordinates: &mut Value) -> Result<(), CrsError> {
    let Some(parts) = coordinates.as_array_mut() else {
        return Ok(());
    };
    let position = match &parts[..] {
        [x, y] => x.as_f64().zip(y.as_f64()),
        _ => None,
    };
    if let Some((x, y)) = position {
        let (lon, lat) = map.lon_lat(x, y)?;
        let place = Geodetic {
            lat,
            lon,
            height_m: 0.0,
        };
        let (lat_deg, lon_deg) = planet.lat_lon_deg(place);
        *coordinates = json!([lon_deg, lat_deg]);
        return Ok(());
    }
    parts
        .iter_mut()
        .try_for_each(|part| off_the_map(map, planet, part))
}

/// Where a layer is, and in which system.
struct Table {
    name: String,
    geometry: String,
    authority: String,
    code: i64,
}

fn table(db: &Connection, name: &str, kind: Option<&str>) -> rusqlite::Result<Option<Table>> {
    let sql = "SELECT c.table_name, g.column_name, s.organization, s.organization_coordsys_id \
               FROM gpkg_contents c JOIN gpkg_geometry_columns g USING (table_name) \
               JOIN gpkg_spatial_ref_sys s ON s.srs_id = g.srs_id \
               WHERE c.table_name = ?1 OR g.geometry_type_name = ?2 \
               ORDER BY c.table_name <> ?1, c.rowid LIMIT 1";
    let of_row = |row: &Row<'_>| {
        Ok(Table {
            name: row.get(0)?,
            geometry: row.get(1)?,
            authority: row.get(2)?,
            code: row.get(3)?,
        })
    };
    db.query_row(sql, (name, kind), of_row).optional()
}

/// The rows in the order of their keys: properties, and the geometry's bytes.
type Feature = (Map<String, Value>, Option<Vec<u8>>);

fn rows(db: &Connection, table: &Table) -> rusqlite::Result<Vec<Feature>> {
    let sql = format!(
        "SELECT * FROM \"{}\" ORDER BY rowid",
        table.name.replace('"', "\"\"")
    );
    let mut statement = db.prepare(&sql)?;
    let names: Vec<String> = statement
        .column_names()
        .into_iter()
        .map(str::to_owned)
        .collect();
    let feature = |row: &Row<'_>| {
        let (mut properties, mut geometry) = (Map::new(), None);
        for (i, name) in names.iter().enumerate() {
            let value = match row.get_ref(i)? {
                ValueRef::Blob(bytes) => {
                    if *name == table.geometry {
                        geometry = Some(bytes.to_vec());
                    }
                    continue;
                }
                ValueRef::Null => Value::Null,
                ValueRef::Integer(n) => n.into(),
                ValueRef::Real(x) => x.into(),
                ValueRef::Text(text) => String::from_utf8_lossy(text).into_owned().into(),
            };
            if *name != table.geometry {
                properties.insert(name.clone(), value);
            }
        }
        Ok((properties, geometry))
    };
    statement.query_map([], feature)?.collect()
}

/// A geometry of a `GeoPackage` (OGC 12-128r17, 2.1.3): a header with an envelope of a stated size,
/// then well-known binary. `None` for what is no point and no polygon.
fn geometry(blob: &[u8]) -> Option<Value> {
    let flags = *blob.get(3)?;
    if blob.get(..2)? != b"GP" {
        return None;
    }
    let envelope = match flags >> 1 & 0b111 {
        0 => 0,
        1 => 32,
        2 | 3 => 48,
        4 => 64,
        _ => return None,
    };
    let is_empty = flags >> 4 & 1 == 1;
    if is_empty {
        return Some(Value::Null);
    }
    Wkb(blob.get(8 + envelope..)?).geometry()
}

/// What is left of some well-known binary.
struct Wkb<'a>(&'a [u8]);

impl Wkb<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn count(&mut self, is_little: bool) -> Option<u32> {
        let bytes = self.take()?;
        Some(if is_little {
            u32::from_le_bytes(bytes)
        } else {
            u32::from_be_bytes(bytes)
        })
    }

    fn number(&mut self, is_little: bool) -> Option<f64> {
        let bytes = self.take()?;
        Some(if is_little {
            f64::from_le_bytes(bytes)
        } else {
            f64::from_be_bytes(bytes)
        })
    }

    fn geometry(&mut self) -> Option<Value> {
        let (kind, coordinates) = self.part()?;
        let name = match kind {
            1 => "Point",
            3 => "Polygon",
            _ => "MultiPolygon",
        };
        Some(json!({ "type": name, "coordinates": coordinates }))
    }

    /// The type of a geometry in two dimensions, and its coordinates.
    fn part(&mut self) -> Option<(u32, Value)> {
        let is_little = self.take::<1>()?[0] == 1;
        let (kind, width) = match self.count(is_little)? {
            kind @ (1 | 3 | 6) => (kind, 2),
            kind @ (1001 | 1003 | 1006) => (kind - 1000, 3),
            _ => return None,
        };
        let coordinates = match kind {
            1 => self.corner(is_little, width)?,
            3 => {
                let rings = 0..self.count(is_little)?;
                rings
                    .map(|_| {
                        let corners = 0..self.count(is_little)?;
                        corners
                            .map(|_| self.corner(is_little, width))
                            .collect::<Option<Value>>()
                    })
                    .collect::<Option<Value>>()?
            }
            _ => {
                let parts = 0..self.count(is_little)?;
                parts
                    .map(|_| Some(self.part()?.1))
                    .collect::<Option<Value>>()?
            }
        };
        Some((kind, coordinates))
    }

    fn corner(&mut self, is_little: bool, width: usize) -> Option<Value> {
        let numbers: Option<Vec<f64>> = (0..width).map(|_| self.number(is_little)).collect();
        Some(json!(numbers?[..2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blob(flags: u8, envelope: usize, wkb: &[u8]) -> Vec<u8> {
        [b"GP\0", &[flags][..], &[0; 4], &vec![0; envelope], wkb].concat()
    }

    #[test]
    fn geometries_of_either_byte_order_are_read() {
        let mut little = vec![1, 1, 0, 0, 0];
        little.extend(1.5f64.to_le_bytes());
        little.extend((-2.0f64).to_le_bytes());
        let point = json!({ "type": "Point", "coordinates": [1.5, -2.0] });
        assert_eq!(geometry(&blob(1, 0, &little)), Some(point.clone()));
        assert_eq!(geometry(&blob(0b11, 32, &little)), Some(point.clone()));
        let mut big = vec![0, 0, 0, 3, 233]; // with a height
        for x in [1.5f64, -2.0, 7.0] {
            big.extend(x.to_be_bytes());
        }
        assert_eq!(geometry(&blob(0, 0, &big)), Some(point));
        assert_eq!(geometry(&blob(0b1_0001, 0, &[])), Some(Value::Null));
        assert_eq!(geometry(&blob(1, 0, &little[..12])), None);
        assert_eq!(geometry(b"PG\0\x01"), None);
        let line = [1, 2, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(geometry(&blob(1, 0, &line)), None);
    }

    #[test]
    fn systems_are_known_by_their_codes() {
        let plain = System::of("epsg", 4326).unwrap();
        assert!(plain.map.is_none() && plain.name.is_none());
        let mars = System::of("IAU_2015", 49910).unwrap();
        assert_eq!(mars.name.unwrap(), "urn:ogc:def:crs:IAU:2015:49900");
        // Equirectangular on a sphere of 3396190 m: lengths are angles.
        let degree = 3_396_190_f64.to_radians();
        let mut ring = json!([[[degree, 2.0 * degree], [-degree, 0.0]]]);
        off_the_map(&mars.map.unwrap(), mars.planet, &mut ring).unwrap();
        for (at, expected) in [(&ring[0][0], [1.0, 2.0]), (&ring[0][1], [-1.0, 0.0])] {
            for (found, expected) in at.as_array().unwrap().iter().zip(expected) {
                assert!((found.as_f64().unwrap() - expected).abs() < 1e-12, "{ring}");
            }
        }
        for (authority, code) in [("NONE", -1), ("EPSG", 1), ("EPSG", 5773), ("IAU_2015", 7)] {
            assert!(System::of(authority, code).is_none(), "{authority}:{code}");
        }
    }

    #[test]
    fn what_is_no_geopackage_is_said() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("a.gpkg");
        std::fs::write(
            &path,
            "not a database, but long enough to be looked at as one",
        )
        .unwrap();
        let error = layer(&path, "rocks", None).unwrap_err().to_string();
        let expected = "not a GeoPackage: file is not a database";
        assert!(error.ends_with(expected), "{error}");
        let absent = layer(&home.path().join("b.gpkg"), "rocks", None).unwrap_err();
        assert!(absent.to_string().contains("cannot read"), "{absent}");
    }
}
