//! Height models in GeoTIFF files (OGC GeoTIFF 1.1, and GDAL's tags for nodata and scale).

mod keys;
mod place;
mod projection;
mod read;
mod words;
mod write;

#[cfg(test)]
mod tests;

pub use read::read_geotiff;
pub(super) use words::georeference;
pub use write::write_geotiff;
