//! The legend with its counts, the errors of the matches, and the reliability of probabilities.

use super::super::{Evaluation, Existence};
use super::{SIDE_WIDTH, Symbol};
use crate::publish::svg::{Frame, Svg, labelled, line, round_length, text};

/// Height of a line of the legend, pixels.
const LINE: f64 = 22.0;
/// Side of a diagram, pixels.
const DIAGRAM: f64 = 232.0;
/// Height of a diagram's heading and axis, pixels.
const HEADING: f64 = 56.0;
const BOLD: &str = "font-size=\"13\" font-weight=\"bold\" fill=\"#222\"";
const SMALL: &str = "font-size=\"11\" fill=\"#555\"";
const CENTRED: &str = "font-size=\"11\" fill=\"#555\" text-anchor=\"middle\"";
const RIGHT: &str = "font-size=\"11\" fill=\"#555\" text-anchor=\"end\"";
const FAINT: &str = "stroke=\"#dddddd\" stroke-width=\"1\"";

/// The height the column takes, pixels.
pub fn height(evaluation: &Evaluation) -> f64 {
    let diagrams = if evaluation.report.existence.is_some() {
        2.0
    } else {
        1.0
    };
    let lines = f64::from(u32::try_from(legend_lines(evaluation).len()).unwrap_or(u32::MAX));
    LINE * (lines + 1.0) + diagrams * (DIAGRAM + HEADING) + 8.0
}

/// Draws the column.
pub fn draw(svg: &mut Svg, evaluation: &Evaluation, column: Frame) {
    let mut y = legend(svg, evaluation, column);
    y = errors(svg, evaluation, column, y);
    if let Some(existence) = &evaluation.report.existence {
        reliability(svg, existence, column, y);
    }
}

fn legend_lines(evaluation: &Evaluation) -> Vec<(Symbol, usize)> {
    let comparison = &evaluation.comparison;
    let estimates = |symbol| {
        let outcomes = comparison.estimates.iter().map(|e| e.outcome);
        outcomes
            .filter(|&o| Symbol::of_estimate(o) == symbol)
            .count()
    };
    let truths = |symbol| {
        let outcomes = comparison.truths.iter().map(|t| t.outcome);
        outcomes.filter(|&o| Symbol::of_truth(o) == symbol).count()
    };
    let counted = |symbol| match symbol {
        Symbol::IgnoredPlace => comparison.ignored.len(),
        Symbol::MatchedTruth | Symbol::Missed | Symbol::Rare => truths(symbol),
        _ => estimates(symbol),
    };
    Symbol::ALL
        .into_iter()
        .map(|symbol| (symbol, counted(symbol)))
        .filter(|&(_, n)| n > 0)
        .collect()
}

/// The legend; returns where it ends.
fn legend(svg: &mut Svg, evaluation: &Evaluation, column: Frame) -> f64 {
    let mut y = column.y + 10.0;
    for (symbol, n) in legend_lines(evaluation) {
        svg.push(&symbol.draw(column.x + 8.0, y, 1.0, ""));
        let words = format!("{n}  {}", symbol.legend());
        svg.push(&text(
            column.x + 24.0,
            y + 4.5,
            &words,
            "font-size=\"12.5\" fill=\"#222\"",
        ));
        y += LINE;
    }
    y + LINE - 8.0
}

/// The errors of the matches, east and north; returns where the diagram ends.
fn errors(svg: &mut Svg, evaluation: &Evaluation, column: Frame, y: f64) -> f64 {
    let matches = &evaluation.comparison.matches;
    let radius_m = evaluation.report.options.radius_m;
    let largest = evaluation.report.detection.max_error_m.unwrap_or(radius_m);
    let reach_m = (1.15 * largest).clamp(0.02 * radius_m, 1.08 * radius_m);
    let frame = diagram(svg, "errors of the matches", column, y);
    let (cx, cy) = (frame.x + frame.width / 2.0, frame.y + frame.height / 2.0);
    let px_per_m = frame.width / 2.0 / reach_m;
    svg.push(&line((cx, frame.y), (cx, frame.y + frame.height), FAINT));
    svg.push(&line((frame.x, cy), (frame.x + frame.width, cy), FAINT));
    let step = round_length(reach_m / 1.8);
    let mut ring = step;
    while ring < reach_m {
        let r = ring * px_per_m;
        svg.push(&format!(
            "<circle cx=\"{cx:.2}\" cy=\"{cy:.2}\" r=\"{r:.2}\" fill=\"none\" {FAINT}/>\n"
        ));
        let label = format!("{} m", labelled(ring, step));
        svg.push(&text(cx + 3.0, cy - r + 12.0, &label, SMALL));
        ring += step;
    }
    let size = if matches.len() > 400 { 0.45 } else { 0.8 };
    for m in matches {
        let (x, y) = (cx + m.error_m.x * px_per_m, cy - m.error_m.y * px_per_m);
        svg.push(&Symbol::Matched.draw(x, y, size, ""));
    }
    let detection = &evaluation.report.detection;
    if let (Some(east), Some(north)) = (detection.bias_east_m, detection.bias_north_m) {
        let (x, y) = (cx + east * px_per_m, cy - north * px_per_m);
        svg.push(&Symbol::MatchedTruth.draw(x, y, 1.3, ""));
    }
    svg.push(&frame.outline());
    let below = frame.y + frame.height + 15.0;
    svg.push(&text(cx, below, "east; + is their mean", CENTRED));
    svg.push(&upright(frame.x - 8.0, cy, "north"));
    y + HEADING + DIAGRAM
}

/// Stated probability against the share that exists.
fn reliability(svg: &mut Svg, existence: &Existence, column: Frame, y: f64) {
    let frame = diagram(svg, "reliability of p_exist, objects by bin", column, y);
    let at = |p: f64, share: f64| {
        let (x, y) = (
            frame.x + p * frame.width,
            frame.y + (1.0 - share) * frame.height,
        );
        (x, y)
    };
    for share in [0.25, 0.5, 0.75] {
        svg.push(&line(at(0.0, share), at(1.0, share), FAINT));
        svg.push(&line(at(share, 0.0), at(share, 1.0), FAINT));
    }
    svg.push(&line(
        at(0.0, 0.0),
        at(1.0, 1.0),
        "stroke=\"#888\" stroke-dasharray=\"4 4\"",
    ));
    let mut points = String::new();
    let mut dots = String::new();
    for bin in &existence.bins {
        let (Some(p), Some(share)) = (bin.mean_p, bin.exist) else {
            continue;
        };
        let (x, y) = at(p, share);
        points += &format!("{x:.2},{y:.2} ");
        dots += &Symbol::Matched.draw(x, y, 1.1, "");
        let beside = if share > 0.9 { 14.0 } else { -7.0 };
        let anchor = if p > 0.9 { RIGHT } else { CENTRED };
        dots += &text(x, y + beside, &bin.n.to_string(), anchor);
    }
    let trail = points.trim_end();
    svg.push(&format!(
        "<polyline points=\"{trail}\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.4\"/>\n{dots}"
    ));
    svg.push(&frame.outline());
    for (p, label) in [(0.0, "0"), (0.5, "0.5"), (1.0, "1")] {
        svg.push(&text(
            at(p, 0.0).0,
            frame.y + frame.height + 15.0,
            label,
            CENTRED,
        ));
        svg.push(&text(frame.x - 5.0, at(0.0, p).1 + 4.0, label, RIGHT));
    }
    let middle = frame.y + frame.height / 4.0;
    svg.push(&upright(frame.x - 14.0, middle, "share that exists"));
    svg.push(&text(
        at(0.75, 0.0).0,
        frame.y + frame.height + 15.0,
        "stated p_exist",
        CENTRED,
    ));
}

/// The heading and the frame of a diagram.
fn diagram(svg: &mut Svg, heading: &str, column: Frame, y: f64) -> Frame {
    svg.push(&text(column.x, y + 14.0, heading, BOLD));
    let frame = Frame {
        x: column.x + (SIDE_WIDTH - DIAGRAM) / 2.0,
        y: y + 24.0,
        width: DIAGRAM,
        height: DIAGRAM,
    };
    svg.push(&frame.filled("#fbfaf7"));
    frame
}

/// Text that reads upwards.
fn upright(x: f64, y: f64, words: &str) -> String {
    let turned = format!("{CENTRED} transform=\"rotate(-90 {x:.2} {y:.2})\"");
    text(x, y, words, &turned)
}
