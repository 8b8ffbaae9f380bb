//! One result: computed, or read where it stands already.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};

use super::table::BenchTable;
use super::{BenchOptions, Contender};
use crate::error::Error;
use crate::evaluate::{self, Comparison, Report, RockMap, Truth, map_from_bytes, read_truth};
use crate::pipeline::{self, Clock, Config, Inputs, Mapped, Method, Overrides, Silent};
use crate::simulate::{self, Scene};

/// Part of what names a result. It goes up whenever a change of the program changes scores without
/// a new version.
const FORMAT: u32 = 1;

/// The scores of one map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// True rocks that count.
    pub n_truths: usize,
    /// Mapped rocks that count.
    pub n_estimates: usize,
    /// GOSPA, metres.
    pub gospa_m: f64,
    /// F1 within the radius.
    pub f1: Option<f64>,
    /// Root mean square error of the matches within the radius, metres.
    pub rmse_m: Option<f64>,
    /// True rocks without a match within the cut-off.
    pub n_missed: usize,
    /// Mapped rocks without a match within the cut-off.
    pub n_false: usize,
    /// NEES by degree of freedom.
    pub nees_per_dof: Option<f64>,
    /// Share of matches within their 95 % ellipse.
    pub coverage_95: Option<f64>,
    /// What fusing took, seconds: no part of the table.
    pub seconds: f64,
}

/// The folder of a bench.
pub(super) struct Store {
    out: PathBuf,
    /// Data sets while they are in use; gone with this.
    making: PathBuf,
}

impl Store {
    pub(super) fn open(out: &Path) -> Result<Self, Error> {
        let results = out.join("results");
        fs::create_dir_all(&results).map_err(|e| Error::io(&results, "create", e))?;
        let making = out.join(format!(".data-{}", std::process::id()));
        Ok(Self {
            out: out.to_owned(),
            making,
        })
    }

    fn path(&self, scene: &str, seed: u64, contender: Contender, hash: &str) -> PathBuf {
        let name = format!("{scene}-{seed}-{}-{hash}.json", contender.name());
        self.out.join("results").join(name)
    }

    /// A result that stands there; one that cannot be read is computed anew.
    fn known(path: &Path) -> Option<Scores> {
        serde_json::from_slice(&fs::read(path).ok()?).ok()
    }

    fn keep(path: &Path, scores: &Scores) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(scores);
        let text = text.map_err(|e| Error::Output(format!("{}: {e}", path.display())))?;
        write_whole(path, &(text + "\n"))
    }

    pub(super) fn write_tables(&self, table: &BenchTable) -> Result<(), Error> {
        write_whole(&self.out.join("accuracy.md"), &table.to_markdown())?;
        write_whole(&self.out.join("accuracy.csv"), &table.to_csv())
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // Nothing more can be done about a folder that cannot be removed.
        let _ = fs::remove_dir_all(&self.making);
    }
}

/// Writes a file under a temporary name and renames it, so that it is there whole or not at all.
fn write_whole(path: &Path, text: &str) -> Result<(), Error> {
    let partial = path.with_extension("partial");
    fs::write(&partial, text).map_err(|e| Error::io(&partial, "write", e))?;
    fs::rename(&partial, path).map_err(|e| Error::io(path, "write", e))
}

/// The scores of all contenders on one scene and seed, in their order.
pub(super) fn scores(
    name: &str,
    scene: &Scene,
    seed: u64,
    options: &BenchOptions,
    store: &Store,
) -> Result<Vec<Scores>, Error> {
    let scene = Scene {
        seed,
        ..scene.clone()
    };
    let paths: Vec<PathBuf> = options
        .contenders
        .iter()
        .map(|&c| store.path(name, seed, c, &hash(&scene, c, options)))
        .collect();
    let known: Vec<Option<Scores>> = paths.iter().map(|p| Store::known(p)).collect();
    if known.iter().all(Option::is_some) {
        return Ok(known.into_iter().flatten().collect());
    }
    let folder = store.making.join(format!("{name}-{seed}"));
    simulate::write(&simulate::simulate(&scene), &folder)?;
    let run = Run::new(&folder, options)?;
    let mut scores = Vec::new();
    for ((known, path), &contender) in known.into_iter().zip(&paths).zip(&options.contenders) {
        scores.push(match known {
            Some(known) => known,
            None => {
                let found = run.scores(contender, &options.scoring)?;
                Store::keep(path, &found)?;
                found
            }
        });
    }
    fs::remove_dir_all(&folder).map_err(|e| Error::io(&folder, "remove", e))?;
    Ok(scores)
}

/// Names a result by all that it depends on.
fn hash(scene: &Scene, contender: Contender, options: &BenchOptions) -> String {
    let identity = json!({
        "format": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        // Every field of the scene, with all digits.
        "scene": format!("{scene:?}"),
        "contender": contender.name(),
        "set": options.set,
        "scoring": options.scoring,
    });
    let digest = Sha256::digest(identity.to_string());
    pipeline::hexadecimal(&digest)[..16].to_owned()
}

/// A data set, read and put on the ground once for all contenders.
struct Run {
    config: Config,
    inputs: Inputs,
    truth: Truth,
    labels: PathBuf,
}

impl Run {
    fn new(folder: &Path, options: &BenchOptions) -> Result<Self, Error> {
        // The file's own method need not be one that is compared.
        let first = options.contenders.iter().filter_map(|c| match c {
            Contender::Method(method) => Some(format!("fusion.method={}", method.name())),
            Contender::Bound(_) => None,
        });
        let no_pictures = "output.annotate=false".to_owned();
        let overrides = Overrides {
            set: first
                .take(1)
                .chain([no_pictures])
                .chain(options.set.clone())
                .collect(),
            ..Overrides::default()
        };
        let config = Config::read(&folder.join("pipeline.toml"), &overrides)?;
        let inputs = pipeline::read(&config, &Silent)?;
        let objects = read_truth(&folder.join("truth.csv"), "truth.csv")?;
        Ok(Self {
            config,
            inputs,
            truth: Truth {
                objects,
                ignored: Vec::new(),
            },
            labels: folder.join("labels.csv"),
        })
    }

    fn scores(&self, contender: Contender, scoring: &evaluate::Options) -> Result<Scores, Error> {
        let start = Instant::now();
        let (map, seconds) = match contender {
            Contender::Method(method) => self.fused(method)?,
            Contender::Bound(bound) => {
                let truth = &self.truth.objects;
                let bounded = pipeline::bound(&self.config, &self.labels, truth, bound, &Silent)?;
                (bounded.map, start.elapsed().as_secs_f64())
            }
        };
        let report = Report::new(&Comparison::new(&map, &self.truth, scoring)?);
        Ok(Scores {
            n_truths: report.counts.n_truths_counted,
            n_estimates: report.counts.n_estimates_counted,
            gospa_m: report.gospa.gospa_m,
            f1: report.detection.f1,
            rmse_m: report.detection.rmse_m,
            n_missed: report.gospa.n_missed,
            n_false: report.gospa.n_false,
            nees_per_dof: report.consistency.nees_per_dof,
            coverage_95: report.consistency.coverage_95,
            seconds,
        })
    }

    /// The map of a method, as a run writes it, and the time that fusing took, seconds.
    fn fused(&self, method: Method) -> Result<(RockMap, f64), Error> {
        let mut config = self.config.clone();
        config.fusion.method = method;
        let mut clock = Clock::start();
        let Mapped { ground, fusion } = pipeline::map(&config, &self.inputs, &mut clock, &Silent)?;
        let fusing = clock.stages.iter().find(|s| s.stage == "fuse");
        let seconds = fusing.map_or(0.0, |s| s.seconds);
        let scene = ground.scene(&config, &self.inputs);
        let map = scene.rocks_geojson(&scene.rock_map(&fusion), "");
        Ok((map_from_bytes(&map.content, &map.name)?, seconds))
    }
}
