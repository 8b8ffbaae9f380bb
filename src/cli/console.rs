//! How a run looks on a terminal, and in a log.

use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use serde_json::{Value, json};

use super::tell;
use crate::error::Error;
use crate::pipeline::{Observer, Summary};

/// Shows progress: bars on a terminal, a plain line a stage elsewhere, nothing where quiet.
pub(super) struct Console {
    quiet: bool,
    bar: Mutex<Option<(&'static str, ProgressBar)>>,
}

impl Console {
    pub(super) fn new(quiet: bool) -> Self {
        Self {
            quiet,
            bar: Mutex::new(None),
        }
    }
}

impl Observer for Console {
    fn begin(&self, stage: &'static str, total: Option<usize>) {
        let bar = match (self.quiet || !std::io::stderr().is_terminal(), total) {
            (true, _) => ProgressBar::hidden(),
            (false, Some(total)) => ProgressBar::new(total as u64),
            (false, None) => ProgressBar::new_spinner(),
        };
        let template = match total {
            Some(_) => "{prefix:>10} [{bar:30}] {pos}/{len}",
            None => "{prefix:>10} {spinner}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(stage);
        bar.enable_steady_tick(Duration::from_millis(100));
        if let Ok(mut slot) = self.bar.lock() {
            *slot = Some((stage, bar));
        }
    }

    fn step(&self) {
        if let Ok(slot) = self.bar.lock()
            && let Some((_, bar)) = slot.as_ref()
        {
            bar.inc(1);
        }
    }

    fn end(&self, result: &str) {
        let Some((stage, bar)) = self.bar.lock().ok().and_then(|mut slot| slot.take()) else {
            return;
        };
        bar.finish_and_clear();
        if !self.quiet {
            eprintln!("{stage:>10}  {result}");
        }
    }
}

/// How a job says what came of it.
#[derive(Debug, clap::Args)]
pub(super) struct Closing {
    /// Say nothing but errors and warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
    /// Print what came of it as JSON instead of a table; faults too
    #[arg(long)]
    json: bool,
}

impl Closing {
    /// Does a job, prints what came of it, and turns its end into an exit code.
    pub(super) fn close(
        &self,
        job: impl FnOnce() -> Result<Summary, Error>,
    ) -> Result<ExitCode, Error> {
        let summary = match job() {
            Ok(summary) => summary,
            Err(error) => {
                if self.json {
                    print_json(&tell::json(&error))?;
                }
                return Err(error);
            }
        };
        for warning in &summary.warnings {
            tell::warning(warning);
        }
        if self.json {
            print_json(&json(&summary))?;
        } else if !self.quiet {
            print!("{}", table(&summary));
        }
        if summary.too_many_rejects {
            tell::error_line("more records were faulty than input.max_reject_share allows");
            return Ok(ExitCode::from(1));
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Prints JSON for a script.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::Output(format!("cannot write JSON: {e}")))?;
    println!("{text}");
    Ok(())
}

/// The summary as a script takes it.
fn json(summary: &Summary) -> Value {
    let rejects = summary.rejects.iter().map(|r| {
        json!({
            "file": r.file,
            "line": r.line,
            "record": r.record,
            "reason": r.reason,
            "detail": r.detail,
        })
    });
    json!({
        "run_id": summary.run_id,
        "folder": summary.folder,
        "files": summary.files,
        "n_views": summary.n_views,
        "n_placed": summary.folder.as_ref().map(|_| summary.n_placed),
        "n_objects": summary.n_objects,
        "n_annotated": summary.n_objects.map(|_| summary.n_annotated),
        "n_carried": summary.n_objects.map(|_| summary.n_carried),
        "rejected": summary.rejected(),
        "rejects": rejects.collect::<Vec<_>>(),
        "warnings": summary.warnings,
        "stages": summary.stages,
        "too_many_rejects": summary.too_many_rejects,
    })
}

/// The closing table: inputs, rejects by reason, objects, time a stage.
fn table(summary: &Summary) -> String {
    let mut rows: Vec<[String; 2]> = Vec::new();
    let mut row = |name: &str, value: String| rows.push([name.to_owned(), value]);
    for file in &summary.files {
        let rejected = file.read - file.used;
        let mut value = format!("{} rows", file.read);
        if rejected > 0 {
            value += &format!(", {rejected} rejected");
        }
        row(&file.file, value);
    }
    for (reason, count) in summary.rejected() {
        row(&format!("  {reason}"), count.to_string());
    }
    row("views", summary.n_views.to_string());
    if summary.folder.is_some() {
        row("detections on the ground", summary.n_placed.to_string());
    }
    if let Some(n_objects) = summary.n_objects {
        row("objects", n_objects.to_string());
        row("pictures annotated", summary.n_annotated.to_string());
        if summary.n_carried > 0 {
            row("  carried over", summary.n_carried.to_string());
        }
    }
    for stage in &summary.stages {
        row(
            &format!("{} time", stage.stage),
            format!("{:.2} s", stage.seconds),
        );
    }
    if let Some(folder) = &summary.folder {
        row("written to", folder.display().to_string());
    }
    let width = rows
        .iter()
        .map(|[name, _]| name.chars().count())
        .max()
        .unwrap_or(0);
    let lines = rows
        .iter()
        .map(|[name, value]| format!("{name:<width$}  {value}\n"));
    lines.collect()
}
