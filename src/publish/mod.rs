//! What a run writes: maps, tables, annotated pictures.
//!
//! Everything is made in memory as named [`Product`]s; [`Folder`] puts them on disk, all or none.

pub mod annotate;
mod annotated;
mod corrected;
mod csv_table;
mod flatgeobuf;
mod folder;
mod format;
mod geojson;
mod geopackage;
mod geoparquet;
mod ground;
pub mod layer;
mod layers;
pub mod mosaic;
pub mod picture;
pub mod qgis;
pub mod report;
mod reproject;
mod residual;
mod rock;
mod scene;
mod simple;
pub mod stac;
pub(crate) mod svg;
mod wkt;

pub use annotate::{Annotation, annotate, annotate_panels};
pub use annotated::Layout;
pub use folder::Folder;
pub use format::Format;
pub use layer::Layer;
pub use mosaic::Mosaic;
pub use picture::Picture;
pub use rock::{Evidence, Rock};
pub use scene::Scene;

use crate::error::Error;
use crate::fuse::{Fusion, Member};
use crate::input::Reject;

/// A file of the output folder.
pub struct Product {
    /// Its name, relative to the folder.
    pub name: String,
    /// Its content.
    pub content: Vec<u8>,
}

impl Product {
    /// A file of this name and content.
    pub fn new(name: impl Into<String>, content: impl Into<Vec<u8>>) -> Self {
        Self {
            name: name.into(),
            content: content.into(),
        }
    }
}

impl Scene<'_> {
    /// The fused objects as rocks of the map.
    pub fn rock_map(&self, fusion: &Fusion) -> Vec<Rock> {
        rock::rocks(self, &fusion.objects)
    }

    /// rocks.geojson alone.
    pub fn rocks_geojson(&self, rocks: &[Rock], run_id: &str) -> Product {
        let layer = self.rocks(rocks, run_id);
        Product::new("rocks.geojson", geojson::text(&layer))
    }

    /// The layers of the fused map, with its table of evidence.
    pub fn map(&self, rocks: &[Rock], run_id: &str, site_name: &str) -> Vec<Layer> {
        vec![
            self.rocks(rocks, run_id),
            self.ellipses(rocks),
            self.footprint_layer(rocks),
            self.view_layer(),
            self.traverses(site_name),
            self.evidence(rocks),
        ]
    }

    /// The layers of a map in which nothing is fused, but for the detections.
    pub fn unfused_map(&self) -> Vec<Layer> {
        vec![self.footprint_layer(&[]), self.view_layer()]
    }

    /// The single-view map: every detection by itself, with the rock it belongs to if there are any.
    pub fn single_view_map(&self, rocks: &[Rock]) -> Layer {
        let mut owner: Vec<Option<(f64, usize)>> = vec![None; self.placed.len()];
        for (r, rock) in rocks.iter().enumerate() {
            for &Member {
                observation,
                weight,
            } in &rock.object.members
            {
                let best = owner[observation].map_or(0.5, |(w, _)| w);
                if weight > best || (owner[observation].is_none() && weight >= best) {
                    owner[observation] = Some((weight, r));
                }
            }
        }
        let rock_of = |i: usize| owner[i].map(|(_, r)| rocks[r].rock_id.clone());
        self.detections(&rock_of)
    }

    /// What is drawn into the picture of a view, one annotation a panel.
    pub fn panels_of(&self, view: usize, rocks: &[Rock], layout: Layout) -> Vec<Annotation> {
        self.panels(view, rocks, layout)
    }

    /// What is drawn into the picture of a view.
    pub fn annotation_of(&self, view: usize, rocks: &[Rock]) -> Annotation {
        self.annotation(view, rocks)
    }
}

/// A layer as a CSV file of its name.
///
/// # Errors
/// A table that cannot be written.
pub fn table(layer: &Layer) -> Result<Product, Error> {
    let name = Format::Csv.file_of(layer.name);
    Ok(Product::new(name, csv_table::bytes(layer)?))
}

/// rejects.csv, in the order of files and lines.
///
/// # Errors
/// A table that cannot be written.
pub fn reject_table(rejects: &[Reject]) -> Result<Product, Error> {
    Ok(Product::new("rejects.csv", csv_table::rejects(rejects)?))
}
