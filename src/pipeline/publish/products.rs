//! The maps and tables of a run, and what helps to open them.

use super::Map;
use crate::error::Error;
use crate::frame::Crs;
use crate::publish::mosaic::{self, MosaicGrid};
use crate::publish::{Format, Layer, Product, qgis, stac, table};

/// The file of the ground mosaic, and where its pixels are.
pub(super) struct MosaicFile {
    file: Product,
    grid: MosaicGrid,
}

impl Map<'_> {
    /// The pictures laid on the ground, where that is asked for, and what was odd about it.
    pub(super) fn mosaic(&self) -> Result<(Option<MosaicFile>, Vec<String>), Error> {
        let output = &self.config.output;
        if !output.mosaic {
            return Ok((None, Vec::new()));
        }
        let crs = self.mosaic_crs()?;
        let (mosaic, mut warnings) = self.scene.mosaic(&crs, output.mosaic_m_per_px)?;
        let Some(mosaic) = mosaic else {
            warnings.push("no mosaic: no picture shows ground".to_owned());
            return Ok((None, warnings));
        };
        let grid = mosaic.grid.clone();
        let content = mosaic::encode(mosaic, self.scene.site)?;
        let file = Product::new("mosaic.tif", content);
        Ok((Some(MosaicFile { file, grid }), warnings))
    }

    fn mosaic_crs(&self) -> Result<Crs, Error> {
        let crs = mosaic::system(self.scene.site, self.config.output.crs.as_ref());
        crs.map_err(|e| Error::Output(e.to_string()))
    }

    pub(super) fn products(&self, mosaic: Option<MosaicFile>) -> Result<Vec<Product>, Error> {
        let layers = self.layers();
        let formats = &self.config.output.formats;
        let (file, grid) = mosaic.map(|m| (m.file, m.grid)).unzip();
        let mut products: Vec<Product> = file.into_iter().collect();
        let on_map = self.on_map(&layers)?;
        for format in formats {
            let layers = if *format == Format::GeoJson {
                &layers
            } else {
                &on_map
            };
            products.extend(format.write(layers)?);
        }
        let evidence = layers.iter().filter(|l| l.geometry.is_none());
        for layer in evidence {
            products.push(table(layer)?);
        }
        if self.fusion.is_some() {
            products.extend(self.scene.corrected_poses()?);
        }
        if formats.iter().any(|f| f.takes_styles()) {
            let shown = layers.iter().filter(|l| l.geometry.is_some());
            products.extend(shown.map(|l| Product::new(format!("{}.qml", l.name), qgis::qml(l))));
        }
        products.extend(self.project_file(&layers, &on_map, grid.is_some())?);
        products.extend(self.catalogue_item(&layers, &products, grid.as_ref()));
        Ok(products)
    }

    /// The layers in the system that the run asks for, which GeoJSON knows nothing of.
    fn on_map(&self, layers: &[Layer]) -> Result<Vec<Layer>, Error> {
        let Some(crs) = &self.config.output.crs else {
            return Ok(layers.to_vec());
        };
        let on_map = layers.iter().map(|layer| match layer.geometry {
            None => Ok(layer.clone()),
            Some(_) => layer.on_map(crs),
        });
        on_map.collect::<Result<_, _>>().map_err(|error| {
            let system = crs.definition();
            Error::Output(format!("cannot write the map in {system}: {error}"))
        })
    }

    fn layers(&self) -> Vec<Layer> {
        let mut layers = if self.fusion.is_some() {
            let site_name = &self.config.site.name;
            self.scene.map(&self.rocks, &self.run_id, site_name)
        } else {
            self.scene.unfused_map()
        };
        if self.fusion.is_none() || self.config.output.detections {
            layers.push(self.scene.single_view_map(&self.rocks));
        }
        layers
    }

    /// A QGIS project over the files of the format that serves it best, if there is one.
    fn project_file(
        &self,
        layers: &[Layer],
        on_map: &[Layer],
        has_mosaic: bool,
    ) -> Result<Option<Product>, Error> {
        let best = [Format::GeoPackage, Format::GeoJson, Format::FlatGeobuf];
        let is_written = |format: &Format| self.config.output.formats.contains(format);
        let Some(format) = best.into_iter().find(is_written) else {
            return Ok(None);
        };
        let project = qgis::Project {
            title: &self.config.site.name,
            layers: if format == Format::GeoJson {
                layers
            } else {
                on_map
            },
            format,
            site: self.scene.site,
            mosaic: if has_mosaic {
                Some(self.mosaic_crs()?)
            } else {
                None
            },
        };
        Ok(Some(Product::new("rockmap.qgz", qgis::qgz(&project)?)))
    }

    fn catalogue_item(
        &self,
        layers: &[Layer],
        products: &[Product],
        mosaic: Option<&MosaicGrid>,
    ) -> Option<Product> {
        let files = products.iter().map(|p| p.name.as_str());
        let item = stac::Item {
            id: format!("{}-{}", self.config.site.name, self.run_id),
            title: &self.config.site.name,
            planet: self.scene.site.planet(),
            layers,
            assets: files
                .chain(["rejects.csv", "run.json"])
                .filter_map(stac::Asset::of)
                .map(|asset| asset.on_map(self.config.output.crs.as_ref()))
                .map(|asset| asset.on_grid(mosaic))
                .collect(),
        };
        Some(Product::new("stac.json", stac::text(&item)?))
    }
}
