//! The ground mosaic: the pictures laid on the ground, each place as the view shows it that shows
//! it best.
//!
//! The best view of a place is the one with most of its pixels on a square metre of the ground
//! there: near, and looking down rather than along. Seams are hard, nothing is blended, so that every
//! pixel of the mosaic is one picture's.

mod cog;
mod grid;
mod render;

pub use cog::encode;
pub use grid::{MosaicGrid, MosaicScale};

use super::{Scene, qgis};
use crate::error::Error;
use crate::frame::{Crs, CrsError, CrsText, Site};

/// A mosaic: red, green, blue, opacity by row from the north-west.
#[derive(Debug, Clone)]
pub struct Mosaic {
    /// Where its pixels are.
    pub grid: MosaicGrid,
    /// Four samples a pixel; the opacity is 0 where no picture shows the ground, 255 elsewhere.
    pub rgba: Vec<u8>,
}

/// The system a mosaic is written in: the one that the run asks for, where it is a map of metres
/// eastwards and northwards with a code of EPSG, by which a GeoTIFF names it; else that of the QGIS project.
///
/// # Errors
/// [`CrsError::Unknown`] of a site whose map projection PROJ does not know.
pub fn system(site: &Site, wanted: Option<&Crs>) -> Result<Crs, CrsError> {
    if let Some(wanted) = wanted {
        let text = CrsText::of(wanted.definition())?;
        let axes = text.projjson["coordinate_system"]["axis"].as_array();
        let is_along = |way: &str| axes.is_some_and(|a| a.iter().any(|a| a["direction"] == way));
        let has_code = text.authority == "EPSG" && u16::try_from(text.code).is_ok();
        let is_map = wanted.is_projected() && text.is_in_metres;
        if has_code && is_map && is_along("east") && is_along("north") {
            return Ok(wanted.clone());
        }
    }
    Crs::new(&qgis::local_crs(site), site.planet())
}

impl Scene<'_> {
    /// The mosaic of the scene's pictures in a system, with what kept pictures out of it; `None`
    /// where no picture shows ground.
    ///
    /// # Errors
    /// A pixel too small for the site.
    pub fn mosaic(
        &self,
        crs: &Crs,
        m_per_px: Option<f64>,
    ) -> Result<(Option<Mosaic>, Vec<String>), Error> {
        let Some(grid) = grid::choose(self, crs, m_per_px)? else {
            return Ok((None, Vec::new()));
        };
        let (mosaic, warnings) = render::render(self, crs, grid);
        Ok((
            mosaic.rgba.iter().any(|&s| s > 0).then_some(mosaic),
            warnings,
        ))
    }
}

#[cfg(test)]
mod tests;
