//! The formats a map can be written in.

use serde::{Serialize, Serializer};

use super::layer::Layer;
use super::{Product, csv_table, flatgeobuf, geojson, geopackage, geoparquet};
use crate::error::Error;

/// A format of the map's layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// GeoJSON, a file a layer.
    GeoJson,
    /// `GeoPackage`, one file with all layers.
    GeoPackage,
    /// `FlatGeobuf`, a file a layer.
    FlatGeobuf,
    /// `GeoParquet`, a file a layer.
    GeoParquet,
    /// Comma-separated values, a file a layer.
    Csv,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::GeoJson,
        Self::GeoPackage,
        Self::FlatGeobuf,
        Self::GeoParquet,
        Self::Csv,
    ];

    /// Its name in a pipeline file, and another that means the same.
    pub fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::GeoJson => ("geojson", "json"),
            Self::GeoPackage => ("gpkg", "geopackage"),
            Self::FlatGeobuf => ("flatgeobuf", "fgb"),
            Self::GeoParquet => ("geoparquet", "parquet"),
            Self::Csv => ("csv", "csv"),
        }
    }

    /// The format of a name.
    pub fn named(name: &str) -> Option<Self> {
        let is_it = |format: &Self| format.names().0 == name || format.names().1 == name;
        Self::ALL.into_iter().find(is_it)
    }

    /// The file that holds a layer.
    pub fn file_of(self, layer: &str) -> String {
        match self {
            Self::GeoJson => format!("{layer}.geojson"),
            Self::GeoPackage => "rockmap.gpkg".to_owned(),
            Self::FlatGeobuf => format!("{layer}.fgb"),
            Self::GeoParquet => format!("{layer}.parquet"),
            Self::Csv => format!("{layer}.csv"),
        }
    }

    /// The media type of its files.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::GeoJson => "application/geo+json",
            Self::GeoPackage => "application/geopackage+sqlite3",
            Self::FlatGeobuf => "application/vnd.flatgeobuf",
            Self::GeoParquet => "application/vnd.apache.parquet",
            Self::Csv => "text/csv",
        }
    }

    /// Whether QGIS looks for a style beside its files.
    pub fn takes_styles(self) -> bool {
        matches!(self, Self::GeoJson | Self::FlatGeobuf | Self::GeoParquet)
    }

    /// Whether it holds tables without geometries too. Evidence is always written as CSV besides.
    fn holds_tables(self) -> bool {
        matches!(self, Self::GeoPackage | Self::GeoParquet)
    }

    /// The layers in this format.
    ///
    /// # Errors
    /// What cannot be encoded.
    pub fn write(self, layers: &[Layer]) -> Result<Vec<Product>, Error> {
        if self == Self::GeoPackage {
            let content = geopackage::bytes(layers)?;
            return Ok(vec![Product::new(self.file_of(""), content)]);
        }
        let held = layers
            .iter()
            .filter(|l| l.geometry.is_some() || self.holds_tables());
        held.map(|layer| {
            let content = match self {
                Self::FlatGeobuf => flatgeobuf::bytes(layer)?,
                Self::GeoParquet => geoparquet::bytes(layer)?,
                Self::Csv => csv_table::bytes(layer)?,
                Self::GeoJson | Self::GeoPackage => geojson::text(layer).into_bytes(),
            };
            Ok(Product::new(self.file_of(layer.name), content))
        })
        .collect()
    }
}

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.names().0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_finds_its_format() {
        for format in Format::ALL {
            let (name, other) = format.names();
            assert_eq!(Format::named(name), Some(format));
            assert_eq!(Format::named(other), Some(format));
        }
        assert_eq!(Format::named("shapefile"), None);
    }
}
