//! The stage that publishes.

mod pictures;
mod products;

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rayon::prelude::*;

use super::Observer;
use super::annotated::{self, Earlier, Row, slashed};
use super::config::Config;
use super::manifest::{pretty, run_json, timing_json};
use super::read::Inputs;
use super::stages::{Clock, Ground};
use super::summary::Summary;
use crate::error::{Error, Fault, Place};
use crate::fuse::Fusion;
use crate::input::Reject;
use crate::publish::report::{self, CropPlan, CutCrop};
use crate::publish::{Folder, Product, Rock, Scene, reject_table};
use pictures::Handled;

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
