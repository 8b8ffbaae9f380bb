//! Height models in GeoTIFF files (OGC GeoTIFF 1.1, and GDAL's tags for nodata and scale).

mod keys;
mod projection;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use read::read_geotiff;
pub use write::write_geotiff;
