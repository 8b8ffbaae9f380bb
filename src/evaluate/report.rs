//! The scores of a map, and their table.

use std::fmt::{self, Write as _};

use serde::Serialize;

use super::Options;
use super::association::Association;
use super::comparison::{Comparison, EstimateOutcome};
use super::consistency::{Consistency, Existence};
use super::score::{ClassScore, Detection, Gospa, by_class, ospa_m};
use crate::frame::{Point, Site};

/// All scores of a map. It shows as an aligned table, and serialises with these names; what is not
/// defined (a mean of nothing) is null.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// What was asked.
    pub options: Options,
    /// What was counted.
    pub counts: Counts,
    /// Precision, recall and errors, of the matches within the radius.
    pub detection: Detection,
    /// GOSPA and its parts, of the counted sets.
    pub gospa: Gospa,
    /// OSPA of the counted sets, metres.
    pub ospa_m: f64,
    /// Errors against stated covariances.
    pub consistency: Consistency,
    /// Stated probabilities against existence; none where the map states none.
    pub existence: Option<Existence>,
    /// Grouping of detections against labels; none without labels.
    pub association: Option<Association>,
    /// The scores of every class, where asked.
    pub by_class: Vec<ClassScore>,
    /// What the reader should know before trusting the scores.
    pub warnings: Vec<String>,
}

/// What was counted, and what not.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Objects in the map.
    pub n_estimates: usize,
    /// Those that count.
    pub n_estimates_counted: usize,
    /// Those not counted, being less probable than the least existence.
    pub n_estimates_doubtful: usize,
    /// Those not counted, being near an ignored or rarely detected object.
    pub n_estimates_ignored: usize,
    /// Objects in the truth.
    pub n_truths: usize,
    /// Those that count.
    pub n_truths_counted: usize,
    /// Those not counted, being in too few detections.
    pub n_truths_rare: usize,
    /// Places to ignore.
    pub n_ignored_places: usize,
}

impl Report {
    /// The scores of a comparison.
    pub fn new(comparison: &Comparison) -> Self {
        let options = comparison.options.clone();
        let n_estimates = comparison.counted_estimates().len();
        let n_truths = comparison.counted_truths().len();
        let close = &comparison.cutoff_matches;
        let counts = counts(comparison);
        Self {
            detection: Detection::new(&comparison.matches, n_estimates, n_truths),
            gospa: Gospa::new(close, n_estimates, n_truths, options.cutoff_m),
            ospa_m: ospa_m(close, n_estimates, n_truths, options.cutoff_m),
            consistency: Consistency::new(comparison),
            existence: Existence::new(comparison),
            association: None,
            by_class: if options.by_class {
                by_class(comparison)
            } else {
                Vec::new()
            },
            warnings: warnings(comparison, &counts),
            counts,
            options,
        }
    }

    /// Adds the scores of the grouping of detections.
    pub fn set_association(&mut self, association: Association) {
        if association.n_labelled == 0 {
            let nothing = "no label names a true object: is it the truth's labels file?";
            self.warnings.push(nothing.to_owned());
        } else if association.n_associated == 0 {
            let nothing = "no labelled detection is in the evidence: is it the map's own?";
            self.warnings.push(nothing.to_owned());
        }
        self.association = Some(association);
    }
}

fn counts(comparison: &Comparison) -> Counts {
    let estimates = |outcome| {
        let of = comparison.estimates.iter();
        of.filter(|e| e.outcome == outcome).count()
    };
    let n_truths_counted = comparison.counted_truths().len();
    Counts {
        n_estimates: comparison.estimates.len(),
        n_estimates_counted: comparison.counted_estimates().len(),
        n_estimates_doubtful: estimates(EstimateOutcome::Doubtful),
        n_estimates_ignored: estimates(EstimateOutcome::Ignored),
        n_truths: comparison.truths.len(),
        n_truths_counted,
        n_truths_rare: comparison.truths.len() - n_truths_counted,
        n_ignored_places: comparison.ignored.len(),
    }
}

fn warnings(comparison: &Comparison, counts: &Counts) -> Vec<String> {
    let mut warnings = Vec::new();
    let far = |place: Point<_>| place.horizontal_distance(Point::origin()) > Site::REACH_M;
    let n_far = comparison.estimates.iter().filter(|e| far(e.place)).count();
    if n_far > 0 {
        let km = Site::REACH_M / 1e3;
        warnings.push(format!(
            "{n_far} of {} mapped objects lie more than {km:.0} km from the truth: are map and \
             truth of one site, longitude first?",
            counts.n_estimates
        ));
    }
    if counts.n_estimates_counted == 0 {
        warnings.push("no mapped object counts".to_owned());
    }
    if counts.n_truths_counted == 0 {
        warnings.push("no true object counts".to_owned());
    }
    warnings
}

/// A score, its value, and what the value rests on.
type Line = (String, String, String);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        write_lines(f, &self.count_lines())?;
        writeln!(f)?;
        write_lines(f, &self.detection_lines())?;
        writeln!(f)?;
        write_lines(f, &self.metric_lines())?;
        if self.consistency.n > 0 {
            writeln!(f)?;
            write_lines(f, &self.consistency_lines())?;
        }
        if let Some(association) = &self.association {
            writeln!(f)?;
            write_lines(f, &association_lines(association))?;
        }
        if let Some(existence) = &self.existence {
            writeln!(f)?;
            write_existence(f, existence)?;
        }
        if !self.by_class.is_empty() {
            writeln!(f)?;
            write_classes(f, &self.by_class)?;
        }
        Ok(())
    }
}

impl Report {
    fn count_lines(&self) -> Vec<Line> {
        let (c, o) = (&self.counts, &self.options);
        let besides = |n: usize, why: &str| match n {
            0 => String::new(),
            n => format!("; {n} {why} left out"),
        };
        let estimates = format!(
            "of {} in the map{}{}",
            c.n_estimates,
            besides(
                c.n_estimates_doubtful,
                &format!("with p_exist below {}", o.min_exist)
            ),
            besides(c.n_estimates_ignored, "near what is ignored"),
        );
        let truths = format!(
            "of {} in the truth{}",
            c.n_truths,
            besides(
                c.n_truths_rare,
                &format!("in fewer than {} detections", o.min_detections)
            ),
        );
        vec![
            line(
                "mapped objects counted",
                c.n_estimates_counted.to_string(),
                estimates,
            ),
            line(
                "true objects counted",
                c.n_truths_counted.to_string(),
                truths,
            ),
        ]
    }

    fn detection_lines(&self) -> Vec<Line> {
        let d = &self.detection;
        let radius = format!("matches nearer than {} m", self.options.radius_m);
        let of = |n: usize, other: usize| format!("{n} of {}", n + other);
        vec![
            line("matched", d.n_matched.to_string(), radius),
            line("precision", share(d.precision), of(d.n_matched, d.n_false)),
            line("recall", share(d.recall), of(d.n_matched, d.n_missed)),
            line(
                "F1",
                share(d.f1),
                format!("{} missed, {} false", d.n_missed, d.n_false),
            ),
            line("RMSE", metres(d.rmse_m), String::new()),
            line(
                "median error",
                metres(d.median_error_m),
                format!("at most {}", metres(d.max_error_m)),
            ),
            line(
                "bias east, north",
                metres(d.bias_east_m),
                metres(d.bias_north_m),
            ),
        ]
    }

    fn metric_lines(&self) -> Vec<Line> {
        let g = &self.gospa;
        let part = |n: usize, what: &str| format!("{n} {what}");
        let squared = |x: f64| format!("{x:.4} m2");
        vec![
            line(
                "GOSPA",
                metres(Some(g.gospa_m)),
                format!("p = 2, alpha = 2, c = {} m", self.options.cutoff_m),
            ),
            line(
                "  localisation",
                squared(g.localisation_m2),
                part(g.n_matched, "matched"),
            ),
            line("  missed", squared(g.missed_m2), part(g.n_missed, "missed")),
            line("  false", squared(g.false_m2), part(g.n_false, "false")),
            line(
                "OSPA",
                metres(Some(self.ospa_m)),
                format!("p = 2, c = {} m", self.options.cutoff_m),
            ),
        ]
    }

    fn consistency_lines(&self) -> Vec<Line> {
        let c = &self.consistency;
        let interval = c.nees_95.map_or_else(String::new, |[low, high]| {
            format!(", 95 % of consistent maps {low:.2} to {high:.2}")
        });
        let decimals = |x: Option<f64>| x.map_or_else(none, |x| format!("{x:.3}"));
        vec![
            line("NEES", decimals(c.nees), format!("expected 2{interval}")),
            line(
                "NEES / 2",
                decimals(c.nees_per_dof),
                "expected 1".to_owned(),
            ),
            line(
                "coverage at 95 %",
                share(c.coverage_95),
                format!("expected 0.95; {} matches with an ellipse", c.n),
            ),
        ]
    }
}

fn association_lines(a: &Association) -> Vec<Line> {
    let mut labelled = format!("of {} labelled detections", a.n_labelled);
    if a.n_left_out > 0 {
        let _ = write!(labelled, "; {} of no true object left out", a.n_left_out);
    }
    vec![
        line(
            "detections in objects",
            a.n_associated.to_string(),
            labelled,
        ),
        line(
            "clutter in objects",
            a.n_clutter_associated.to_string(),
            format!("of {} clutter detections", a.n_clutter),
        ),
        line("purity", share(a.purity), String::new()),
        line("completeness", share(a.completeness), String::new()),
        line("pair precision", share(a.pair_precision), String::new()),
        line("pair recall", share(a.pair_recall), String::new()),
        line("pair F1", share(a.pair_f1), String::new()),
    ]
}

fn write_lines(f: &mut fmt::Formatter<'_>, lines: &[Line]) -> fmt::Result {
    for (name, value, note) in lines {
        let text = format!("{name:<24}{value:>12}  {note}");
        writeln!(f, "{}", text.trim_end())?;
    }
    Ok(())
}

fn write_existence(f: &mut fmt::Formatter<'_>, e: &Existence) -> fmt::Result {
    let decimals = |x: f64| format!("{x:.4}");
    write_lines(
        f,
        &[
            line(
                "Brier score",
                decimals(e.brier),
                format!("{} objects with p_exist", e.n),
            ),
            line(
                "calibration error",
                decimals(e.calibration_error),
                String::new(),
            ),
        ],
    )?;
    writeln!(
        f,
        "\n{:<12}{:>8}{:>10}{:>10}",
        "p_exist", "n", "mean p", "exist"
    )?;
    for bin in &e.bins {
        let range = format!("{:.1} to {:.1}", bin.low, bin.high);
        let (p, exist) = (share(bin.mean_p), share(bin.exist));
        writeln!(f, "{range:<12}{:>8}{p:>10}{exist:>10}", bin.n)?;
    }
    Ok(())
}

fn write_classes(f: &mut fmt::Formatter<'_>, classes: &[ClassScore]) -> fmt::Result {
    let name = |c: &ClassScore| c.class.clone().unwrap_or_else(|| "(none)".to_owned());
    let width = classes.iter().map(|c| name(c).chars().count()).max();
    let width = width.unwrap_or(0).max("class".len()) + 2;
    let head = [
        "matched",
        "missed",
        "false",
        "precision",
        "recall",
        "F1",
        "RMSE",
    ];
    write!(f, "{:<width$}", "class")?;
    for title in head {
        write!(f, "{title:>11}")?;
    }
    writeln!(f)?;
    for class in classes {
        let d = &class.detection;
        write!(f, "{:<width$}", name(class))?;
        for cell in [
            d.n_matched.to_string(),
            d.n_missed.to_string(),
            d.n_false.to_string(),
            share(d.precision),
            share(d.recall),
            share(d.f1),
            metres(d.rmse_m),
        ] {
            write!(f, "{cell:>11}")?;
        }
        writeln!(f)?;
    }
    Ok(())
}

fn line(name: &str, value: String, note: String) -> Line {
    (name.to_owned(), value, note)
}

fn none() -> String {
    "-".to_owned()
}

fn share(x: Option<f64>) -> String {
    x.map_or_else(none, |x| format!("{x:.4}"))
}

fn metres(x: Option<f64>) -> String {
    match x {
        // What rounds to zero is shown without a sign.
        Some(x) if x.abs() < 5e-5 => "0.0000 m".to_owned(),
        Some(x) => format!("{x:.4} m"),
        None => none(),
    }
}
