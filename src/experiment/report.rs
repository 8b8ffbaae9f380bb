//! The numbers behind the figures, as CSV and for the terminal.

use std::fmt::{self, Write as _};

use super::Reproduction;
use super::circle::{CircleMethod, Trial};
use super::circle_figures::{CircleRow, Column};
use super::field::{FieldCounts, Found};
use super::statistics::Mean;

/// Figure 5: every detection, object and centre.
pub(super) fn trial_table(trial: &Trial, noise: f64) -> String {
    let mut text = "what,x,y\n".to_owned();
    let mut rows = |what: &str, places: &[nalgebra::Vector2<f64>]| {
        for place in places {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{what},{:.6},{:.6}", place.x, place.y);
        }
    };
    rows("object", &trial.objects);
    for (view, places) in trial.views.iter().enumerate() {
        rows(&format!("view {}", view + 1), places);
    }
    for method in CircleMethod::fusing() {
        rows(
            &format!("centre {}", method.name()),
            &method.find(trial, noise),
        );
    }
    text
}

/// Figures 6 and 7: means, medians, quartiles, notches and whiskers.
pub(super) fn circle_table(rows: &[CircleRow]) -> String {
    let mut text = "noise,n_views,method,n_trials,mean,standard_error,median,lower_quartile,\
                    upper_quartile,notch_low,notch_high,whisker_low,whisker_high,\
                    paired_mean,paired_standard_error,bound\n"
        .to_owned();
    for row in rows {
        let written = |mean: &Mean| {
            let error = mean.standard_error;
            let error = error.map_or_else(String::new, |e| format!("{e:.6}"));
            format!("{:.6},{error}", mean.mean)
        };
        let s = &row.spread;
        let _ = writeln!(
            text,
            "{:.2},{},{},{},{},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{},{:.6}",
            row.noise,
            row.n_views,
            row.method,
            row.error.n,
            written(&row.error),
            s.median,
            s.lower_quartile,
            s.upper_quartile,
            s.notch[0],
            s.notch[1],
            s.whiskers[0],
            s.whiskers[1],
            written(&row.paired_error),
            row.bound
        );
    }
    text
}

/// The error of every method in every trial.
pub(super) fn error_table(columns: &[Column]) -> String {
    let names = CircleMethod::ALL.map(CircleMethod::name).join(",");
    let mut text = format!("noise,n_views,trial,{names}\n");
    for column in columns {
        let n_trials = column.scores.first().map_or(0, Vec::len);
        for trial in 0..n_trials {
            let errors = column.scores.iter();
            let errors = errors.map(|s| format!("{:.6}", s[trial].error));
            let errors: Vec<String> = errors.collect();
            let (noise, n_views) = (column.circle.noise, column.circle.n_views);
            let _ = writeln!(
                text,
                "{noise:.2},{n_views},{},{}",
                trial + 1,
                errors.join(",")
            );
        }
    }
    text
}

/// The sign test of every method against standard EM.
pub(super) fn sign_table(rows: &[CircleRow]) -> String {
    let mut text =
        "noise,n_views,method,against,wins,losses,ties,chi_square,chi_square_one_cell,p_value\n"
            .to_owned();
    for row in rows {
        let Some(test) = row.against_em else {
            continue;
        };
        let _ = writeln!(
            text,
            "{:.2},{},{},em,{},{},{},{:.4},{:.4},{:.3e}",
            row.noise,
            row.n_views,
            row.method,
            test.wins,
            test.losses,
            test.ties,
            test.chi_square,
            test.chi_square_one_cell,
            test.p_value
        );
    }
    text
}

/// Figures 11 and 12: rocks found within the common field of view.
pub(super) fn field_table(counts: &FieldCounts) -> String {
    let mut text = "map,n_rocks,correct,wrong\n".to_owned();
    let fused = counts.fused.iter().map(|by| (by.method, by.found));
    for (map, found) in std::iter::once(("single view", counts.single)).chain(fused) {
        let (n, correct, wrong) = (counts.n_rocks, found.correct, found.wrong);
        let _ = writeln!(text, "{map},{n},{correct},{wrong}");
    }
    text
}

impl fmt::Display for Reproduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Figure 6: error against noise, {} trials", self.n_trials)?;
        let noise = |row: &CircleRow| format!("{:.2}", row.noise);
        write_rows(f, &self.by_noise, noise, |row| &row.error)?;
        writeln!(f, "\nObjects and estimates paired best")?;
        write_rows(f, &self.by_noise, noise, |row| &row.paired_error)?;
        writeln!(
            f,
            "\nFigure 7: error against views, {} trials",
            self.n_trials
        )?;
        let views = |row: &CircleRow| row.n_views.to_string();
        write_rows(f, &self.by_views, views, |row| &row.error)?;
        writeln!(f, "\nObjects and estimates paired best")?;
        write_rows(f, &self.by_views, views, |row| &row.paired_error)?;
        writeln!(f, "\nSign test: trials with lower error than em's")?;
        for row in &self.by_noise {
            if let Some(test) = row.against_em {
                writeln!(
                    f,
                    "{:<8}{:<8}{:>3} of {:<5}chi-square {:>6.2}, p {:.1e}",
                    format!("{:.2}", row.noise),
                    row.method,
                    test.wins,
                    test.wins + test.losses,
                    test.chi_square,
                    test.p_value
                )?;
            }
        }
        let field = &self.field;
        write!(
            f,
            "\nFigures 11 and 12: of {} rocks that both views could see, {} found by one view \
             ({} wrong)",
            field.n_rocks, field.single.correct, field.single.wrong
        )?;
        for by in &field.fused {
            let Found { correct, wrong } = by.found;
            write!(f, ", {correct} by both ({wrong} wrong) with {}", by.method)?;
        }
        writeln!(f)
    }
}

/// A line for every noise or number of views: mean and standard error by method, and the bound.
fn write_rows(
    f: &mut fmt::Formatter<'_>,
    rows: &[CircleRow],
    key: impl Fn(&CircleRow) -> String,
    value: impl Fn(&CircleRow) -> &Mean,
) -> fmt::Result {
    write!(f, "{:<8}", "")?;
    for method in CircleMethod::ALL {
        write!(f, "{:<20}", method.name())?;
    }
    writeln!(f, "bound")?;
    for line in rows.chunks(CircleMethod::ALL.len()) {
        write!(f, "{:<8}", line.first().map(&key).unwrap_or_default())?;
        for row in line {
            let mean = value(row);
            let error = mean.standard_error.unwrap_or(0.0);
            write!(f, "{:<20}", format!("{:.4} ± {error:.4}", mean.mean))?;
        }
        let bound = line.first().map_or(0.0, |row| row.bound);
        writeln!(f, "{bound:.4}")?;
    }
    Ok(())
}
