//! A layer of the map, described once: what every format writes.

use geo::{BoundingRect, Coord, MultiPolygon, Rect};

use crate::frame::{Crs, CrsError, CrsText, Geodetic, Planet};
use crate::pose::Time;

/// A layer: features of one kind of geometry with the same properties in each, or a table without
/// geometries.
#[derive(Debug, Clone)]
pub struct Layer {
    /// Its name, which files and tables take.
    pub name: &'static str,
    /// What it is called on a map.
    pub title: &'static str,
    /// What it holds, a sentence.
    pub about: &'static str,
    /// The kind of its geometries; `None` for a table.
    pub geometry: Option<Kind>,
    /// The planet its places are on.
    pub planet: Planet,
    /// The system its geometries are in, where it is not the planet's map.
    pub crs: Option<Crs>,
    /// Its properties.
    pub fields: Vec<Field>,
    /// Its features: those with a geometry sorted by id, rows of a table as they came.
    pub features: Vec<Feature>,
}

/// A kind of geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A place.
    Point,
    /// Lines.
    Line,
    /// Areas.
    Polygon,
}

/// A property of every feature of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name, with its unit.
    pub name: &'static str,
    /// The type of its values.
    pub kind: FieldKind,
    /// What it means.
    pub about: &'static str,
}

/// The type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// Text.
    Text,
    /// A whole number.
    Integer,
    /// A number, rounded to so many decimals.
    Real(usize),
    /// An instant.
    Time,
}

/// A property's value; any may be absent.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Absent.
    Null,
    /// Text.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// An instant.
    Time(Time),
}

/// A feature.
#[derive(Debug, Clone)]
pub struct Feature {
    /// Its name, unique in the layer.
    pub id: String,
    /// Its place; `None` for the row of a table.
    pub geometry: Option<Geometry>,
    /// Its values, in the order of the layer's fields.
    pub values: Vec<Value>,
}

/// A geometry in (longitude, latitude) of the planet's map, degrees, or in the layer's own system.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A place.
    Point(Coord<f64>),
    /// Lines; one where nothing cuts them.
    Lines(Vec<Vec<Coord<f64>>>),
    /// Polygons; one where nothing cuts them. None is a feature without a geometry.
    Polygons(MultiPolygon<f64>),
}

/// A field with where its value comes from in a row of `Row`.
pub struct Column<'a, Row> {
    field: Field,
    value: Box<dyn Fn(&Row) -> Value + 'a>,
}

impl<'a, Row> Column<'a, Row> {
    /// A column of text.
    pub fn text(
        name: &'static str,
        about: &'static str,
        value: impl Fn(&Row) -> Option<String> + 'a,
    ) -> Self {
        Self::new(name, FieldKind::Text, about, move |row| {
            value(row).map(Value::Text)
        })
    }

    /// A column of counts.
    pub fn count(
        name: &'static str,
        about: &'static str,
        value: impl Fn(&Row) -> usize + 'a,
    ) -> Self {
        Self::new(name, FieldKind::Integer, about, move |row| {
            i64::try_from(value(row)).ok().map(Value::Integer)
        })
    }

    /// A column of numbers, rounded to `decimals`.
    pub fn real(
        name: &'static str,
        decimals: usize,
        about: &'static str,
        value: impl Fn(&Row) -> Option<f64> + 'a,
    ) -> Self {
        Self::new(name, FieldKind::Real(decimals), about, move |row| {
            value(row).map(|x| Value::Real(rounded(x, decimals)))
        })
    }

    /// A column of instants.
    pub fn time(
        name: &'static str,
        about: &'static str,
        value: impl Fn(&Row) -> Option<Time> + 'a,
    ) -> Self {
        Self::new(name, FieldKind::Time, about, move |row| {
            value(row).map(Value::Time)
        })
    }

    fn new(
        name: &'static str,
        kind: FieldKind,
        about: &'static str,
        value: impl Fn(&Row) -> Option<Value> + 'a,
    ) -> Self {
        Self {
            field: Field { name, kind, about },
            value: Box::new(move |row| value(row).unwrap_or(Value::Null)),
        }
    }
}

impl Layer {
    /// An empty layer without fields.
    pub fn new(
        (name, title, about): (&'static str, &'static str, &'static str),
        geometry: Option<Kind>,
        planet: Planet,
    ) -> Self {
        Self {
            name,
            title,
            about,
            geometry,
            planet,
            crs: None,
            fields: Vec::new(),
            features: Vec::new(),
        }
    }

    /// The layer with these columns, and a feature for each row.
    pub fn filled<Row>(
        mut self,
        columns: Vec<Column<'_, Row>>,
        rows: impl IntoIterator<Item = (String, Option<Geometry>, Row)>,
    ) -> Self {
        let feature = |(id, geometry, row)| Feature {
            id,
            geometry,
            values: columns.iter().map(|c| (c.value)(&row)).collect(),
        };
        self.features = rows.into_iter().map(feature).collect();
        if self.geometry.is_some() {
            self.features.sort_by(|a, b| a.id.cmp(&b.id));
        }
        self.fields = columns.into_iter().map(|c| c.field).collect();
        self
    }

    /// What other programs call the system its geometries are in.
    ///
    /// # Errors
    /// [`CrsError::Unknown`] where PROJ does not know it.
    pub fn crs_text(&self) -> Result<CrsText, CrsError> {
        match &self.crs {
            None => CrsText::of_map(self.planet),
            Some(crs) => CrsText::of(crs.definition()),
        }
    }

    /// Decimals of its coordinates: a tenth of a millimetre on Earth.
    pub fn decimals(&self) -> usize {
        match &self.crs {
            Some(crs) if crs.is_projected() => DECIMALS_OF_LENGTHS,
            _ => DECIMALS,
        }
    }

    /// The box around all its geometries, in the units of its system; `None` where there are none.
    pub fn bounds(&self) -> Option<Rect<f64>> {
        let all = self.features.iter().filter_map(|f| f.geometry.as_ref());
        all.filter_map(Geometry::bounds).reduce(union)
    }
}

impl Geometry {
    /// The box around it; `None` where it is empty.
    pub fn bounds(&self) -> Option<Rect<f64>> {
        match self {
            Self::Point(at) => Some(Rect::new(*at, *at)),
            Self::Lines(lines) => {
                let boxes = lines.iter().flatten().map(|at| Rect::new(*at, *at));
                boxes.reduce(union)
            }
            Self::Polygons(polygons) => polygons.bounding_rect(),
        }
    }

    /// Whether there is nothing of it.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Point(_) => false,
            Self::Lines(lines) => lines.is_empty(),
            Self::Polygons(polygons) => polygons.0.is_empty(),
        }
    }
}

/// The box around two boxes.
pub fn union(a: Rect<f64>, b: Rect<f64>) -> Rect<f64> {
    Rect::new(
        Coord {
            x: a.min().x.min(b.min().x),
            y: a.min().y.min(b.min().y),
        },
        Coord {
            x: a.max().x.max(b.max().x),
            y: a.max().y.max(b.max().y),
        },
    )
}

/// Decimals of coordinates in degrees: a tenth of a millimetre on Earth.
pub const DECIMALS: usize = 9;

/// Decimals of coordinates in metres, or in feet.
pub const DECIMALS_OF_LENGTHS: usize = 4;

/// A number rounded to `decimals` places; never a negative zero.
pub fn rounded(x: f64, decimals: usize) -> f64 {
    let scale = 10f64.powi(i32::try_from(decimals).unwrap_or(0));
    (x * scale).round() / scale + 0.0
}

/// A place as (longitude, latitude), degrees, to the decimals of the map: latitudes as the planet's
/// files have them, longitudes eastward in every format.
pub fn lon_lat(place: Geodetic, planet: Planet) -> Coord<f64> {
    let (y, x) = planet.eastward().lat_lon_deg(place);
    on_grid(Coord { x, y }, DECIMALS)
}

/// The nearest coordinate that so many decimals can write.
pub fn on_grid(at: Coord<f64>, decimals: usize) -> Coord<f64> {
    Coord {
        x: rounded(at.x, decimals),
        y: rounded(at.y, decimals),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_leaves_no_negative_zero() {
        assert!(rounded(-0.0001, 3).is_sign_positive());
        assert_eq!(rounded(1.23456, 3), 1.235);
        assert_eq!(rounded(-70.123_456_789_4, 9), -70.123_456_789);
    }

    #[test]
    fn features_are_sorted_and_rows_of_tables_are_not() {
        let columns = || vec![Column::text("id", "", |row: &&str| Some((*row).to_owned()))];
        let rows = |place: Option<Geometry>| {
            ["b", "a"]
                .map(|id| (id.to_owned(), place.clone(), id))
                .to_vec()
        };
        let about = ("l", "", "");
        let at = Geometry::Point(Coord { x: 1.0, y: 2.0 });
        let points = Layer::new(about, Some(Kind::Point), Planet::EARTH);
        let points = points.filled(columns(), rows(Some(at)));
        assert_eq!(points.features[0].id, "a");
        assert_eq!(points.features[0].values, [Value::Text("a".to_owned())]);
        let table = Layer::new(about, None, Planet::EARTH).filled(columns(), rows(None));
        assert_eq!(table.features[0].id, "b");
        assert_eq!(table.bounds(), None);
        assert_eq!(points.bounds().unwrap().center(), Coord { x: 1.0, y: 2.0 });
    }
}
