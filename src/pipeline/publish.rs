//! The stage that publishes.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::Observer;
use super::annotated::{self, Earlier, Row, slashed};
use super::config::Config;
use super::digest::hexadecimal;
use super::manifest::{pretty, run_json, timing_json};
use super::read::Inputs;
use super::stages::{Clock, Ground};
use super::summary::Summary;
use crate::error::{Error, Fault, Place};
use crate::fuse::Fusion;
use crate::input::Reject;
use crate::publish::mosaic::encode;
use crate::publish::report::{self, CropPlan, CutCrop};
use crate::publish::{
    Annotation, Folder, Format, Layer, Picture, Product, Rock, Scene, annotate_panels, picture,
    qgis, reject_table, stac, table,
};
use crate::view::View;

/// A folder that holds another run is replaced only where that is asked for.
pub(crate) fn may_replace(folder: &Folder, run_id: &str, force: bool) -> Result<(), Error> {
    match folder.earlier_run() {
        Some(earlier) if earlier != run_id && !force => {
            let place = Place::file(folder.target().display().to_string());
            let found = format!("the outputs of another run, {earlier}");
            Err(Fault::found(
                place,
                "",
                found,
                "an empty folder, or --force to replace them",
            )
            .into())
        }
        _ => Ok(()),
    }
}

/// A finished map on its way to disk.
pub(super) struct Map<'a> {
    config: &'a Config,
    inputs: &'a Inputs,
    ground: &'a Ground,
    fusion: Option<&'a Fusion>,
    scene: Scene<'a>,
    rocks: Vec<Rock>,
    crops: CropPlan,
    /// What the annotated picture of each view is called, below their folder.
    names: Vec<Option<PathBuf>>,
    run_id: String,
}

/// What was written so far.
#[derive(Default)]
pub(super) struct Written {
    files: Vec<String>,
    n_annotated: usize,
    n_carried: usize,
    /// Pieces of pictures for the report.
    crops: Vec<CutCrop>,
    warnings: Vec<String>,
}

/// What was made of a picture.
#[derive(Default)]
struct Handled {
    annotated: Option<Row>,
    is_carried: bool,
    crops: Vec<CutCrop>,
}

/// A picture to be drawn.
struct Plan {
    panels: Vec<Annotation>,
    format: picture::Format,
    path: PathBuf,
    /// What the list will say of it, but for its content.
    row: Row,
}

impl<'a> Map<'a> {
    /// The fused map.
    pub(super) fn new(
        config: &'a Config,
        inputs: &'a Inputs,
        ground: &'a Ground,
        fusion: &'a Fusion,
        run_id: String,
    ) -> Self {
        let mut map = Self::single_view(config, inputs, ground, run_id);
        map.rocks = map.scene.rock_map(fusion);
        map.fusion = Some(fusion);
        if config.output.annotate {
            let originals = inputs.views.iter().map(|view| map.original(view));
            let originals: Vec<_> = originals.collect();
            map.names = annotated::names(&originals, config.output.picture_format);
        }
        if config.output.report {
            map.crops = CropPlan::new(&map.scene, &map.rocks);
        }
        map
    }

    /// The map of every detection by itself.
    pub(super) fn single_view(
        config: &'a Config,
        inputs: &'a Inputs,
        ground: &'a Ground,
        run_id: String,
    ) -> Self {
        Self {
            config,
            inputs,
            ground,
            fusion: None,
            scene: ground.scene(config, inputs),
            rocks: Vec::new(),
            crops: CropPlan::empty(),
            names: vec![None; inputs.views.len()],
            run_id,
        }
    }

    /// Writes maps, tables and pictures into the folder in the making.
    pub(super) fn write(&self, folder: &Folder, observer: &dyn Observer) -> Result<Written, Error> {
        let pictures = self.pictures();
        observer.begin("publish", Some(pictures.len()));
        let mut files = Vec::new();
        let (mosaic, warnings) = self.mosaic()?;
        for product in self.products(mosaic)? {
            folder.write(&product)?;
            files.push(product.name);
        }
        let warnings = Mutex::new([warnings, self.unknown_images()].concat());
        let earlier = Earlier::of(folder.target());
        let mut handled: Vec<Handled> = pictures
            .par_iter()
            .map(|&(view, picture)| {
                let handled = self.handle((folder, &earlier), view, picture, &warnings);
                observer.step();
                handled
            })
            .collect::<Result<_, Error>>()?;
        let mut warnings: Vec<String> = warnings.into_inner().unwrap_or_default();
        warnings.sort();
        let n_carried = handled.iter().filter(|h| h.is_carried).count();
        let rows = handled.iter_mut().filter_map(|h| h.annotated.take());
        let rows: Vec<Row> = rows.collect();
        if !rows.is_empty() {
            folder.write(&annotated::index(&rows)?)?;
        }
        let carried = match n_carried {
            0 => String::new(),
            n => format!(", {n} of them carried over"),
        };
        observer.end(&format!("{} pictures annotated{carried}", rows.len()));
        Ok(Written {
            files,
            n_annotated: rows.len(),
            n_carried,
            crops: handled.into_iter().flat_map(|h| h.crops).collect(),
            warnings,
        })
    }

    /// A warning for each image that is to be annotated and is none of the run's.
    fn unknown_images(&self) -> Vec<String> {
        let is_known = |id: &&String| self.inputs.views.iter().any(|v| v.image_id == **id);
        let only = self.config.output.annotate_only.iter();
        let unknown = only.filter(|id| !is_known(id));
        unknown
            .map(|id| {
                format!("output.annotate_only: found {id:?}, expected the image_id of a view")
            })
            .collect()
    }

    /// The pictures laid on the ground, where that is asked for, and what was odd about it.
    fn mosaic(&self) -> Result<(Option<Product>, Vec<String>), Error> {
        let output = &self.config.output;
        if !output.mosaic {
            return Ok((None, Vec::new()));
        }
        let (mosaic, mut warnings) = self.scene.mosaic(output.mosaic_m_per_px)?;
        let Some(mosaic) = mosaic else {
            warnings.push("no mosaic: no picture shows ground".to_owned());
            return Ok((None, warnings));
        };
        let content = encode(mosaic, self.scene.site)?;
        Ok((Some(Product::new("mosaic.tif", content)), warnings))
    }

    fn products(&self, mosaic: Option<Product>) -> Result<Vec<Product>, Error> {
        let layers = self.layers();
        let formats = &self.config.output.formats;
        let mut products: Vec<Product> = mosaic.into_iter().collect();
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
        let has_mosaic = products.iter().any(|p| p.name == "mosaic.tif");
        products.extend(self.project_file(&layers, &on_map, has_mosaic)?);
        products.extend(self.catalogue_item(&layers, &products));
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
            has_mosaic,
        };
        Ok(Some(Product::new("rockmap.qgz", qgis::qgz(&project)?)))
    }

    fn catalogue_item(&self, layers: &[Layer], products: &[Product]) -> Option<Product> {
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
                .collect(),
        };
        Some(Product::new("stac.json", stac::text(&item)?))
    }

    /// The views whose pictures are looked at, each with its picture.
    fn pictures(&self) -> Vec<(usize, &View)> {
        let views = self.inputs.views.iter().enumerate();
        views
            .filter(|&(index, _)| self.names[index].is_some() || self.crops.needs(index))
            .collect()
    }

    /// The name of a view's picture, if it is to be annotated.
    fn original(&self, view: &'a View) -> Option<&'a str> {
        let only = &self.config.output.annotate_only;
        let is_wanted = only.is_empty() || only.contains(&view.image_id);
        let picture = view.picture.as_ref().filter(|_| view.camera.is_some())?;
        is_wanted.then_some(picture.name.as_str())
    }

    /// Cuts what the report needs from one picture, and annotates it; one that cannot be decoded
    /// costs a warning.
    fn handle(
        &self,
        (folder, earlier): (&Folder, &Earlier),
        index: usize,
        view: &View,
        warnings: &Mutex<Vec<String>>,
    ) -> Result<Handled, Error> {
        let Some(source) = &view.picture else {
            return Ok(Handled::default());
        };
        let plan = self.plan(folder, index, view)?;
        let mut handled = Handled::default();
        if let Some(plan) = &plan
            && let Some(sha256) = earlier.carry(&plan.row.file, &plan.row.key, &plan.path)
        {
            handled.is_carried = true;
            handled.annotated = Some(Row {
                sha256,
                ..plan.row.clone()
            });
            if !self.crops.needs(index) {
                return Ok(handled);
            }
        }
        let picture = match Picture::read(&source.path, &source.name) {
            Ok(picture) => picture,
            Err(error) => {
                if let Ok(mut warnings) = warnings.lock() {
                    warnings.push(format!("image {}: {error}", view.image_id));
                }
                return Ok(handled);
            }
        };
        handled.crops = self.crops.cut(index, &picture);
        if let Some(plan) = plan.filter(|_| !handled.is_carried) {
            handled.annotated = Some(self.draw(plan, picture)?);
        }
        Ok(handled)
    }

    /// What is to be drawn of a view, if anything is.
    fn plan(&self, folder: &Folder, index: usize, view: &View) -> Result<Option<Plan>, Error> {
        let (Some(name), Some(source)) = (&self.names[index], &view.picture) else {
            return Ok(None);
        };
        let output = &self.config.output;
        let panels = self
            .scene
            .panels_of(index, &self.rocks, output.annotate_layout);
        let format = picture::Format::by_name(name).unwrap_or(picture::Format::Png);
        // A picture whose content is not known is like no earlier one.
        let key = source
            .sha256
            .map(|content| annotated::key(content, &panels, format, output));
        Ok(Some(Plan {
            panels,
            format,
            path: folder.path_of(&Path::new(annotated::FOLDER).join(name))?,
            row: Row {
                image_id: view.image_id.clone(),
                picture: source.name.clone(),
                file: slashed(name),
                key: key.unwrap_or_default(),
                sha256: String::new(),
            },
        }))
    }

    /// Draws a picture and writes it.
    fn draw(&self, plan: Plan, picture: Picture) -> Result<Row, Error> {
        let words =
            |why: &dyn std::fmt::Display| Error::Output(format!("{}: {why}", plan.path.display()));
        let drawn = annotate_panels(picture, &plan.panels).map_err(|e| words(&e))?;
        let quality = self.config.output.picture_quality;
        let content = drawn.encode(plan.format, quality).map_err(|e| words(&e))?;
        std::fs::write(&plan.path, &content).map_err(|e| Error::io(&plan.path, "write", e))?;
        Ok(Row {
            sha256: hexadecimal(&Sha256::digest(&content)),
            ..plan.row
        })
    }

    /// report.html, which says of the run what run.json does.
    fn report(
        &self,
        manifest: &serde_json::Value,
        rejects: &[Reject],
        crops: &[CutCrop],
    ) -> Product {
        let annotated = |name: &Option<PathBuf>| {
            let name = name.as_ref()?;
            Some(slashed(&Path::new(annotated::FOLDER).join(name)))
        };
        let pictures: Vec<Option<String>> = self.names.iter().map(annotated).collect();
        let run = report::Run {
            title: &self.config.site.name,
            manifest,
            rejects,
            pictures: &pictures,
            plan: &self.crops,
            crops,
        };
        self.scene.report(&self.rocks, &run)
    }

    /// Writes what is said of the run itself and puts the folder in its place.
    pub(super) fn finish(
        self,
        folder: Folder,
        written: Written,
        clock: Clock,
    ) -> Result<Summary, Error> {
        let rejects: Vec<Reject> = [
            self.inputs.rejects.as_slice(),
            self.ground.misses.as_slice(),
        ]
        .concat();
        let mut summary = Summary::new(self.config, self.inputs, rejects);
        summary.n_placed = self.ground.placed.len();
        summary.n_objects = self.fusion.map(|_| self.rocks.len());
        summary.n_annotated = written.n_annotated;
        summary.n_carried = written.n_carried;
        summary.warnings.extend(written.warnings);
        folder.write(&reject_table(&summary.rejects)?)?;
        let mut outputs = written.files;
        outputs.extend(["rejects.csv", "run.json", "timing.json"].map(str::to_owned));
        let is_reported = self.fusion.is_some() && self.config.output.report;
        outputs.extend(is_reported.then(|| "report.html".to_owned()));
        outputs.sort();
        let manifest = run_json(
            self.config,
            self.inputs,
            self.fusion,
            &self.run_id,
            &summary,
            &outputs,
        );
        if is_reported {
            folder.write(&self.report(&manifest, &summary.rejects, &written.crops))?;
        }
        folder.write(&Product::new("run.json", pretty(&manifest)))?;
        let timing = timing_json(&clock.stages, rayon::current_num_threads());
        folder.write(&Product::new("timing.json", timing))?;
        summary.stages = clock.stages;
        summary.run_id = Some(self.run_id);
        summary.folder = Some(folder.publish()?);
        Ok(summary)
    }
}
