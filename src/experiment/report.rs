//! The numbers behind the figures, as CSV and for the terminal.

use std::fmt::{self, Write as _};

use super::Reproduction;
use super::circle::{CircleMethod, Trial};
use super::circle_figures::{CircleRow, Column};
use super::field::FieldCounts;

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
                    upper_quartile,notch_low,notch_high,whisker_low,whisker_high,bound\n"
        .to_owned();
    for row in rows {
        let error = row.error.standard_error;
        let error = error.map_or_else(String::new, |e| format!("{e:.6}"));
        let s = &row.spread;
        let _ = writeln!(
            text,
            "{:.2},{},{},{},{:.6},{error},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}",
            row.noise,
            row.n_views,
            row.method,
            row.error.n,
            row.error.mean,
            s.median,
            s.lower_quartile,
            s.upper_quartile,
            s.notch[0],
            s.notch[1],
            s.whiskers[0],
            s.whiskers[1],
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
        let n_trials = column.errors.first().map_or(0, Vec::len);
        for trial in 0..n_trials {
            let errors = column.errors.iter().map(|e| format!("{:.6}", e[trial]));
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
    for (map, found) in [
        ("single view", counts.single),
        (counts.method, counts.fused),
    ] {
        let (n, correct, wrong) = (counts.n_rocks, found.correct, found.wrong);
        let _ = writeln!(text, "{map},{n},{correct},{wrong}");
    }
    text
}

impl fmt::Display for Reproduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Figure 6: error against noise, {} trials", self.n_trials)?;
        write_rows(f, &self.by_noise, |row| format!("{:.2}", row.noise))?;
        writeln!(
            f,
            "\nFigure 7: error against views, {} trials",
            self.n_trials
        )?;
        write_rows(f, &self.by_views, |row| row.n_views.to_string())?;
        writeln!(f, "\nSign test: trials with lower error than em's")?;
        for row in &self.by_noise {
            if let Some(test) = row.against_em {
                writeln!(
                    f,
                    "{:<8}{:<8}{:>3} of {:<4}chi-square {:>6.2}, p {:.1e}",
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
        writeln!(
            f,
            "\nFigures 11 and 12: of {} rocks that both views could see, {} found by one view \
             ({} wrong), {} by both ({} wrong)",
            field.n_rocks,
            field.single.correct,
            field.single.wrong,
            field.fused.correct,
            field.fused.wrong
        )
    }
}

/// A line for every noise or number of views: mean and standard error by method, and the bound.
fn write_rows(
    f: &mut fmt::Formatter<'_>,
    rows: &[CircleRow],
    key: impl Fn(&CircleRow) -> String,
) -> fmt::Result {
    write!(f, "{:<8}", "")?;
    for method in CircleMethod::ALL {
        write!(f, "{:<20}", method.name())?;
    }
    writeln!(f, "bound")?;
    for line in rows.chunks(CircleMethod::ALL.len()) {
        write!(f, "{:<8}", line.first().map(&key).unwrap_or_default())?;
        for row in line {
            let error = row.error.standard_error.unwrap_or(0.0);
            write!(f, "{:<20}", format!("{:.4} ± {error:.4}", row.error.mean))?;
        }
        let bound = line.first().map_or(0.0, |row| row.bound);
        writeln!(f, "{bound:.4}")?;
    }
    Ok(())
}
