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
use crate::frame::Crs;

/// A mosaic: red, green, blue, opacity by row from the north-west.
#[derive(Debug, Clone)]
pub struct Mosaic {
    /// Where its pixels are.
    pub grid: MosaicGrid,
    /// Four samples a pixel; the opacity is 0 where no picture shows the ground, 255 elsewhere.
    pub rgba: Vec<u8>,
}

impl Scene<'_> {
    /// The mosaic of the scene's pictures, with what kept pictures out of it; `None` where no
    /// picture shows ground.
    ///
    /// # Errors
    /// A site whose map projection PROJ does not know, or a pixel too small for the site.
    pub fn mosaic(&self, m_per_px: Option<f64>) -> Result<(Option<Mosaic>, Vec<String>), Error> {
        let definition = qgis::local_crs(self.site);
        let crs = Crs::new(&definition, self.site.planet());
        let crs = crs.map_err(|e| Error::Output(e.to_string()))?;
        let Some(grid) = grid::choose(self, &crs, m_per_px)? else {
            return Ok((None, Vec::new()));
        };
        let (mosaic, warnings) = render::render(self, &crs, grid);
        Ok((
            mosaic.rgba.iter().any(|&s| s > 0).then_some(mosaic),
            warnings,
        ))
    }
}

#[cfg(test)]
mod tests;
