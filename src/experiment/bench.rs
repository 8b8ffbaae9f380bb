//! Methods over many scenes and seeds: each scene is simulated, mapped and scored, and the table
//! holds the means with their standard errors.
//!
//! Every result is a small file of its own, named by what it depends on, so that a bench that was
//! broken off goes on where it stopped, and one that is widened computes only what is new.

mod record;
mod table;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::{Error, Fault, Place, suggestion};
use crate::evaluate;
use crate::pipeline::{Bound, Method, Observer};
use crate::simulate::Scene;

pub use record::Scores;
pub use table::{BenchRow, BenchTable};

/// What is run.
#[derive(Debug, Clone)]
pub struct BenchOptions {
    /// Scene files; each is named in the table by its file's name.
    pub scenes: Vec<PathBuf>,
    /// The seeds of every scene, the last included.
    pub seeds: RangeInclusive<u64>,
    /// What is compared.
    pub contenders: Vec<Contender>,
    /// `KEY.PATH=VALUE` laid over the pipeline file of every data set.
    pub set: Vec<String>,
    /// How maps are scored.
    pub scoring: evaluate::Options,
    /// The folder of results and tables.
    pub out: PathBuf,
}

/// What stands in a row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contender {
    /// A fusion method.
    Method(Method),
    /// The best map that the labels allow.
    Bound(Bound),
}

impl Contender {
    /// All there are.
    pub fn all() -> Vec<Self> {
        let bounds = [Bound::Clairvoyant, Bound::Fair].map(Self::Bound);
        let methods = Method::ALL.into_iter().map(Self::Method);
        methods.chain(bounds).collect()
    }

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Method(method) => method.name(),
            Self::Bound(bound) => bound.name(),
        }
    }

    /// Those of a list of names between commas.
    ///
    /// # Errors
    /// A name that is none, or that stands twice.
    pub fn parse_list(text: &str) -> Result<Vec<Self>, Error> {
        let mut found: Vec<Self> = Vec::new();
        for name in text.split(',').map(str::trim) {
            let known = Self::all();
            let named = known.iter().find(|c| c.name() == name);
            match named {
                Some(contender) if found.contains(contender) => {
                    return Err(option_fault(
                        "--methods",
                        format!("{name} again"),
                        "it once",
                    ));
                }
                Some(contender) => found.push(*contender),
                None => {
                    let names: Vec<&str> = known.iter().map(|c| c.name()).collect();
                    let mut expected = format!("a list of {}", names.join(", "));
                    if let Some(meant) = suggestion(name, names) {
                        expected += &format!(" (is {meant} meant?)");
                    }
                    return Err(option_fault("--methods", format!("{name:?}"), &expected));
                }
            }
        }
        Ok(found)
    }
}

/// Seeds as `A..B`, both included, or a single one.
///
/// # Errors
/// Anything else, and a range that runs backwards.
pub fn parse_seeds(text: &str) -> Result<RangeInclusive<u64>, Error> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    match (first.trim().parse::<u64>(), last.trim().parse::<u64>()) {
        (Ok(first), Ok(last)) if first <= last => Ok(first..=last),
        _ => {
            let expected = "A..B, whole numbers, A not above B";
            Err(option_fault("--seeds", format!("{text:?}"), expected))
        }
    }
}

fn option_fault(option: &str, found: String, expected: &str) -> Error {
    Fault::found(Place::default(), option, found, expected).into()
}

/// Runs the bench and writes `accuracy.md`, `accuracy.csv` and `results/` into the folder. Results
/// that stand there already, of the same program version, scene, seed, method and settings, are
/// taken as they are.
///
/// # Errors
/// All faults of options and scenes at once; a folder that cannot be written; a run that fails.
/// Results that were ready before stay.
pub fn bench_accuracy(
    options: &BenchOptions,
    observer: &dyn Observer,
) -> Result<BenchTable, Error> {
    options.scoring.check()?;
    let scenes = read_scenes(&options.scenes)?;
    let jobs: Vec<(&str, &Scene, u64)> = scenes
        .iter()
        .flat_map(|(name, scene)| {
            let seeds = options.seeds.clone();
            seeds.map(move |seed| (name.as_str(), scene, seed))
        })
        .collect();
    observer.begin("bench", Some(jobs.len()));
    let store = record::Store::open(&options.out)?;
    let finished: Vec<Vec<Scores>> = jobs
        .par_iter()
        .map(|&(name, scene, seed)| {
            let scores = record::scores(name, scene, seed, options, &store);
            observer.step();
            scores
        })
        .collect::<Result<_, Error>>()?;
    let mut by_row: BTreeMap<(usize, usize), Vec<Scores>> = BTreeMap::new();
    let n_seeds = jobs.len() / scenes.len().max(1);
    for (job, scores) in finished.into_iter().enumerate() {
        for (contender, scores) in scores.into_iter().enumerate() {
            let row = (job / n_seeds.max(1), contender);
            by_row.entry(row).or_default().push(scores);
        }
    }
    let row = |((scene, contender), scores): (&(usize, usize), &Vec<Scores>)| {
        BenchRow::of(&scenes[*scene].0, options.contenders[*contender], scores)
    };
    let table = BenchTable {
        rows: by_row.iter().map(row).collect(),
    };
    store.write_tables(&table)?;
    observer.end(&format!("{} runs", jobs.len() * options.contenders.len()));
    Ok(table)
}

/// The scenes with the names of their files.
fn read_scenes(paths: &[PathBuf]) -> Result<Vec<(String, Scene)>, Error> {
    let mut scenes: Vec<(String, Scene)> = Vec::new();
    let mut faults = Vec::new();
    for path in paths {
        let name = stem(path);
        if scenes.iter().any(|(known, _)| *known == name) {
            let place = Place::file(path.display().to_string());
            let found = format!("a second scene named {name}");
            faults.push(Fault::found(place, "", found, "names that differ"));
            continue;
        }
        match Scene::read(path) {
            Ok(mut scene) => {
                // Pictures have no part in scores.
                scene.render = None;
                scenes.push((name, scene));
            }
            Err(Error::Faults(more)) => faults.extend(more),
            Err(other) => return Err(other),
        }
    }
    if scenes.is_empty() && faults.is_empty() {
        return Err(option_fault("SCENES", "none".to_owned(), "at least one"));
    }
    Error::check(faults)?;
    Ok(scenes)
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests;
