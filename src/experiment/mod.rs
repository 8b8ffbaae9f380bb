//! The experiments of Thompson and Wettergreen (2005), and a bench of methods over many scenes.
//!
//! [`reproduce`] makes the paper's figures anew: the circle (Figures 5 to 7 and the sign test) and
//! the field test on a simulated scene (Figures 8 to 12). [`bench::bench_accuracy`] simulates
//! scenes of many seeds, maps them by every method and puts the mean scores into a table.

pub mod bench;
pub mod circle;
pub mod circle_figures;
pub mod field;
mod field_map;
mod plot;
mod report;
pub mod statistics;

use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::error::Error;
use crate::pipeline::{Observer, hexadecimal, may_replace};
use crate::publish::{Folder, Product};
use circle::Circle;
use circle_figures::{CircleRow, Column, figure_5, figure_6, figure_7};
use field::{Field, FieldCounts};

/// Objects on the circle.
const N_OBJECTS: usize = 12;
/// Views of Figures 5 and 6.
const N_VIEWS: usize = 4;
/// Noise of Figures 5 and 7, and of the sign test, radii.
const NOISE: f64 = 0.15;
/// Noise of Figure 6, radii.
const NOISES: [f64; 6] = [0.05, 0.10, 0.15, 0.20, 0.25, 0.30];
/// Views of Figure 7.
const VIEW_COUNTS: [usize; 5] = [1, 2, 3, 4, 5];
/// Quality of the figures that are pictures.
const JPEG_QUALITY: u8 = 70;

/// What is reproduced, and where.
#[derive(Debug, Clone)]
pub struct ReproduceOptions {
    /// The folder, which appears whole.
    pub out: PathBuf,
    /// Seed of the circle's noise. The scene of the field test has one of its own.
    pub seed: u64,
    /// Trials of Figures 6 and 7.
    pub n_trials: usize,
    /// Whether figures of other options are replaced.
    pub force: bool,
}

impl ReproduceOptions {
    /// The seed unless another is asked for.
    pub const SEED: u64 = 2005;
    /// The paper's trials.
    pub const N_TRIALS: usize = 50;

    /// The paper's number of trials.
    pub fn new(out: PathBuf) -> Self {
        Self {
            out,
            seed: Self::SEED,
            n_trials: Self::N_TRIALS,
            force: false,
        }
    }
}

/// The numbers behind the figures; it shows as the tables of a terminal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reproduction {
    /// Names the options.
    pub run_id: String,
    /// The program's version.
    pub version: &'static str,
    /// Seed of the circle's noise.
    pub seed: u64,
    /// Trials.
    pub n_trials: usize,
    /// Figure 6, with the sign test of every noise: by noise and method.
    pub by_noise: Vec<CircleRow>,
    /// Figure 7: by number of views and method.
    pub by_views: Vec<CircleRow>,
    /// Figures 11 and 12.
    pub field: FieldCounts,
}

/// Makes all figures and their tables: `figure-5.svg` to `figure-12.jpg`, a CSV beside each that
/// has numbers, `sign-test.csv`, the field test's data set under `field/`, all numbers in
/// `run.json`. The same options give the same bytes.
///
/// # Errors
/// A folder with other things in it or, without `force`, with figures of other options; one that
/// cannot be written.
pub fn reproduce(
    options: &ReproduceOptions,
    observer: &dyn Observer,
) -> Result<Reproduction, Error> {
    let folder = Folder::claim(&options.out)?;
    let run_id = run_id(options);
    may_replace(&folder, &run_id, options.force)?;

    observer.begin("circle", Some(NOISES.len() + VIEW_COUNTS.len()));
    let column = |noise: f64, n_views: usize| {
        let column = Column::new(circle(noise, n_views), options.n_trials, options.seed);
        observer.step();
        column
    };
    let by_noise: Vec<Column> = NOISES.into_iter().map(|s| column(s, N_VIEWS)).collect();
    let by_views: Vec<Column> = VIEW_COUNTS.into_iter().map(|n| column(NOISE, n)).collect();
    circle_products(options, &by_noise, &by_views)
        .iter()
        .try_for_each(|product| folder.write(product))?;
    observer.end(&format!("{} trials", options.n_trials));

    observer.begin("field", None);
    let field = field_figures(&folder)?;
    observer.end(&format!("{} rocks by one view", field.single.correct));

    let reproduction = Reproduction {
        run_id,
        version: env!("CARGO_PKG_VERSION"),
        seed: options.seed,
        n_trials: options.n_trials,
        by_noise: by_noise.iter().flat_map(Column::rows).collect(),
        by_views: by_views.iter().flat_map(Column::rows).collect(),
        field,
    };
    let manifest = serde_json::to_string_pretty(&reproduction);
    let manifest = manifest.map_err(|e| Error::Output(format!("run.json: {e}")))?;
    folder.write(&Product::new("run.json", manifest + "\n"))?;
    folder.publish()?;
    Ok(reproduction)
}

fn circle(noise: f64, n_views: usize) -> Circle {
    Circle {
        n_objects: N_OBJECTS,
        n_views,
        noise,
    }
}

/// Names the figures by what they depend on.
fn run_id(options: &ReproduceOptions) -> String {
    let identity = format!(
        "reproduce {} {} {}",
        env!("CARGO_PKG_VERSION"),
        options.seed,
        options.n_trials
    );
    hexadecimal(&Sha256::digest(identity))[..16].to_owned()
}

fn circle_products(
    options: &ReproduceOptions,
    by_noise: &[Column],
    by_views: &[Column],
) -> Vec<Product> {
    let trial = circle(NOISE, N_VIEWS).trial(options.seed, 0);
    let rows = |columns: &[Column]| columns.iter().flat_map(Column::rows).collect::<Vec<_>>();
    let (noise_rows, view_rows) = (rows(by_noise), rows(by_views));
    vec![
        Product::new("figure-5.svg", figure_5(&trial, NOISE)),
        Product::new("figure-5.csv", report::trial_table(&trial, NOISE)),
        Product::new("figure-6.svg", figure_6(by_noise)),
        Product::new("figure-6.csv", report::circle_table(&noise_rows)),
        Product::new("figure-6-trials.csv", report::error_table(by_noise)),
        Product::new("sign-test.csv", report::sign_table(&noise_rows)),
        Product::new("figure-7.svg", figure_7(by_views)),
        Product::new("figure-7.csv", report::circle_table(&view_rows)),
        Product::new("figure-7-trials.csv", report::error_table(by_views)),
    ]
}

fn field_figures(folder: &Folder) -> Result<FieldCounts, Error> {
    let field = Field::play(&folder.path_of(Path::new("field"))?)?;
    folder.write(&Product::new("figure-8.svg", field.map()))?;
    folder.write(&Product::new("figure-8.csv", field.detections()))?;
    let pictures = [
        ("figure-9.jpg", field.picture(0)?),
        ("figure-10.jpg", field.picture(1)?),
        ("figure-11.jpg", field.single_view_picture()?),
    ];
    let mut pictures = pictures.map(|(name, p)| (name.to_owned(), p)).to_vec();
    pictures.extend(field.fused_pictures()?);
    for (name, picture) in pictures {
        picture.write(&folder.path_of(Path::new(&name))?, JPEG_QUALITY)?;
    }
    let counts = field.counts()?;
    let table = Product::new("figures-11-12.csv", report::field_table(&counts));
    folder.write(&table)?;
    Ok(counts)
}

#[cfg(test)]
mod tests;
