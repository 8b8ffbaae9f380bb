//! Means over seeds, as Markdown and CSV.

use std::fmt::Write as _;

use super::{Contender, Scores};
use crate::experiment::statistics::{Mean, count};

/// Means of one contender on one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchRow {
    /// The scene.
    pub scene: String,
    /// The contender's name.
    pub method: &'static str,
    /// Seeds.
    pub n_seeds: usize,
    /// The means, by column of the table; none where no seed has the score.
    pub means: Vec<Option<Mean>>,
}

/// The table of a bench, in the order of scenes and contenders.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchTable {
    /// Its rows.
    pub rows: Vec<BenchRow>,
}

/// A column: its heading, its name in CSV, its decimals, its score.
type Column = (
    &'static str,
    &'static str,
    usize,
    fn(&Scores) -> Option<f64>,
);

/// The columns of the table. What a run takes is not one of them: it is another with every run.
const COLUMNS: [Column; 8] = [
    ("GOSPA (m)", "gospa_m", 2, |s| Some(s.gospa_m)),
    ("F1", "f1", 3, |s| s.f1),
    ("RMSE (m)", "rmse_m", 4, |s| s.rmse_m),
    ("missed", "n_missed", 1, |s| Some(count(s.n_missed))),
    ("false", "n_false", 1, |s| Some(count(s.n_false))),
    ("NEES/2", "nees_per_dof", 2, |s| s.nees_per_dof),
    ("coverage", "coverage_95", 3, |s| s.coverage_95),
    ("rocks", "n_truths", 0, |s| Some(count(s.n_truths))),
];

impl BenchRow {
    /// The means of these scores, one a seed.
    pub(super) fn of(scene: &str, contender: Contender, scores: &[Scores]) -> Self {
        let mean = |(_, _, _, get): &Column| {
            let values: Vec<f64> = scores.iter().filter_map(get).collect();
            Mean::of(&values)
        };
        Self {
            scene: scene.to_owned(),
            method: contender.name(),
            n_seeds: scores.len(),
            means: COLUMNS.iter().map(mean).collect(),
        }
    }

    /// The mean of a column by its name in CSV.
    pub fn mean(&self, column: &str) -> Option<Mean> {
        let index = COLUMNS.iter().position(|(_, name, ..)| *name == column)?;
        self.means[index]
    }
}

impl BenchTable {
    /// The table in Markdown: means, with their standard errors behind a plus-minus sign.
    pub fn to_markdown(&self) -> String {
        let headings: Vec<&str> = COLUMNS.iter().map(|c| c.0).collect();
        let mut text = format!("| scene | method | seeds | {} |\n", headings.join(" | "));
        text += "|---|---|--:|";
        text += &"--:|".repeat(COLUMNS.len());
        text.push('\n');
        for row in &self.rows {
            let cells = COLUMNS.iter().zip(&row.means);
            let cells: Vec<String> = cells.map(|(column, mean)| cell(column, *mean)).collect();
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} |",
                row.scene,
                row.method,
                row.n_seeds,
                cells.join(" | ")
            );
        }
        text
    }

    /// The table as CSV: a mean and a standard error a column, empty where there is none.
    pub fn to_csv(&self) -> String {
        let mut text = "scene,method,n_seeds".to_owned();
        for (_, name, ..) in COLUMNS {
            let _ = write!(text, ",{name},{name}_se");
        }
        text.push('\n');
        for row in &self.rows {
            let _ = write!(text, "{},{},{}", row.scene, row.method, row.n_seeds);
            for mean in &row.means {
                let value = mean.map_or_else(String::new, |m| format!("{:.6}", m.mean));
                let error = mean.and_then(|m| m.standard_error);
                let error = error.map_or_else(String::new, |e| format!("{e:.6}"));
                let _ = write!(text, ",{value},{error}");
            }
            text.push('\n');
        }
        text
    }
}

fn cell((_, _, decimals, _): &Column, mean: Option<Mean>) -> String {
    let Some(mean) = mean else {
        return "-".to_owned();
    };
    match mean.standard_error {
        Some(error) => format!("{:.decimals$} ± {error:.decimals$}", mean.mean),
        None => format!("{:.decimals$}", mean.mean),
    }
}
