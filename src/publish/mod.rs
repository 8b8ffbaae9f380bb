//! What a run writes: maps, tables, annotated pictures.
//!
//! Everything is made in memory as named [`Product`]s; [`Folder`] puts them on disk, all or none.

pub mod annotate;
mod annotated;
mod corrected;
mod folder;
pub mod geojson;
mod ground;
mod layers;
pub mod picture;
mod rock;
mod scene;
pub(crate) mod svg;
mod tables;

pub use annotate::{Annotation, annotate};
pub use folder::Folder;
pub use picture::Picture;
pub use rock::{Evidence, Rock};
pub use scene::Scene;

use crate::error::Error;
use crate::fuse::{Fusion, Member};
use crate::input::Reject;

/// A file of the output folder.
pub struct Product {
    /// Its name, relative to the folder.
    pub name: &'static str,
    /// Its content.
    pub content: Vec<u8>,
}

impl Product {
    /// A file of this name and content.
    pub fn new(name: &'static str, content: impl Into<Vec<u8>>) -> Self {
        Self {
            name,
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
        Product::new("rocks.geojson", self.rocks(rocks, run_id).to_text())
    }

    /// The map's layers and tables.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn map(
        &self,
        rocks: &[Rock],
        run_id: &str,
        site_name: &str,
    ) -> Result<Vec<Product>, Error> {
        let corrected = self.corrected_poses().transpose()?;
        let corrected = corrected.map(|poses| Product::new("poses_corrected.csv", poses));
        let mut products = vec![
            self.rocks_geojson(rocks, run_id),
            Product::new("ellipses.geojson", self.ellipses(rocks).to_text()),
            Product::new("footprints.geojson", self.footprint_layer(rocks).to_text()),
            Product::new("views.geojson", self.view_layer().to_text()),
            Product::new("traverse.geojson", self.traverses(site_name).to_text()),
            Product::new("evidence.csv", self.evidence(rocks)?),
        ];
        products.extend(corrected);
        Ok(products)
    }

    /// The single-view map: every detection by itself, with the rock it belongs to if there are any.
    pub fn single_view_map(&self, rocks: &[Rock]) -> Product {
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
        Product::new("detections.geojson", self.detections(&rock_of).to_text())
    }

    /// footprints.geojson alone, where nothing is fused.
    pub fn footprint_map(&self) -> Product {
        Product::new("footprints.geojson", self.footprint_layer(&[]).to_text())
    }

    /// views.geojson alone, where nothing is fused.
    pub fn view_map(&self) -> Product {
        Product::new("views.geojson", self.view_layer().to_text())
    }

    /// What is drawn into the picture of a view.
    pub fn annotation_of(&self, view: usize, rocks: &[Rock]) -> Annotation {
        self.annotation(view, rocks)
    }
}

/// rejects.csv, in the order of files and lines.
///
/// # Errors
/// A table that cannot be written.
pub fn reject_table(rejects: &[Reject]) -> Result<Product, Error> {
    Ok(Product::new("rejects.csv", tables::rejects(rejects)?))
}
