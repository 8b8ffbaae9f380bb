//! The comparison of a map with the truth, drawn as one SVG that opens in a browser.

mod map_panel;
mod side_panels;

use super::Evaluation;
use super::comparison::{EstimateOutcome, TruthOutcome};
use crate::publish::svg::{Frame, Svg, text};

/// Outer margin, pixels.
const MARGIN: f64 = 24.0;
/// Height of the title above the panels, pixels.
const HEADER: f64 = 64.0;
/// Width of the map, pixels.
const MAP_WIDTH: f64 = 800.0;
/// Width of the column of legend and diagrams, pixels.
const SIDE_WIDTH: f64 = 300.0;
/// Gap between the two, pixels.
const GAP: f64 = 28.0;

/// What a symbol of the picture stands for, in the order of the legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symbol {
    Matched,
    MatchedTruth,
    Missed,
    False,
    IgnoredEstimate,
    Doubtful,
    Rare,
    IgnoredPlace,
}

impl Symbol {
    const ALL: [Self; 8] = [
        Self::Matched,
        Self::MatchedTruth,
        Self::Missed,
        Self::False,
        Self::IgnoredEstimate,
        Self::Doubtful,
        Self::Rare,
        Self::IgnoredPlace,
    ];

    const fn legend(self) -> &'static str {
        match self {
            Self::Matched => "mapped, matched",
            Self::MatchedTruth => "true, matched",
            Self::Missed => "true, missed",
            Self::False => "mapped, false",
            Self::IgnoredEstimate => "mapped, near what is ignored",
            Self::Doubtful => "mapped, improbable, not counted",
            Self::Rare => "true, in few detections, not counted",
            Self::IgnoredPlace => "places to ignore",
        }
    }

    /// Colours that readers with any colour vision tell apart (Okabe and Ito).
    const fn colour(self) -> &'static str {
        match self {
            Self::Matched => "#0072b2",
            Self::MatchedTruth => "#1a1a1a",
            Self::Missed => "#d55e00",
            Self::False => "#b3247e",
            Self::IgnoredEstimate | Self::Rare => "#707070",
            Self::Doubtful | Self::IgnoredPlace => "#a8a8a8",
        }
    }

    fn of_estimate(outcome: EstimateOutcome) -> Self {
        match outcome {
            EstimateOutcome::Matched(_) => Self::Matched,
            EstimateOutcome::False => Self::False,
            EstimateOutcome::Ignored => Self::IgnoredEstimate,
            EstimateOutcome::Doubtful => Self::Doubtful,
        }
    }

    fn of_truth(outcome: TruthOutcome) -> Self {
        match outcome {
            TruthOutcome::Matched(_) => Self::MatchedTruth,
            TruthOutcome::Missed => Self::Missed,
            TruthOutcome::Rare => Self::Rare,
        }
    }

    /// The symbol's element around a place, `size` 1 being that of the legend. `inside` is what
    /// stands within the element, a title or nothing.
    fn draw(self, x: f64, y: f64, size: f64, inside: &str) -> String {
        let colour = self.colour();
        let path = |d: String, width: f64| {
            let width = (width * size).max(0.4);
            format!(
                "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width:.2}\">\
                 {inside}</path>\n"
            )
        };
        let circle = |r: f64, paint: &str| {
            let r = r * size;
            format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{r:.2}\" {paint}>{inside}</circle>\n")
        };
        let filled = format!("fill=\"{colour}\"");
        let open = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"");
        let diamond = |r: f64| {
            let r = r * size;
            format!(
                "M{x:.2} {:.2}l{r:.2} {r:.2}l-{r:.2} {r:.2}l-{r:.2} -{r:.2}z",
                y - r
            )
        };
        let cross = |r: f64| {
            let (r, d) = (r * size, 2.0 * r * size);
            let (left, top, bottom) = (x - r, y - r, y + r);
            format!("M{left:.2} {top:.2}l{d:.2} {d:.2}M{left:.2} {bottom:.2}l{d:.2} -{d:.2}")
        };
        let plus = |r: f64| {
            let (r, d) = (r * size, 2.0 * r * size);
            format!("M{:.2} {y:.2}h{d:.2}M{x:.2} {:.2}v{d:.2}", x - r, y - r)
        };
        match self {
            Self::Matched => circle(3.4, &filled),
            Self::MatchedTruth => path(plus(5.0), 1.4),
            Self::Missed => path(diamond(6.5), 2.2),
            Self::False => path(cross(4.5), 2.2),
            Self::IgnoredEstimate => circle(3.4, &open),
            Self::Doubtful => circle(2.2, &open),
            Self::Rare => path(diamond(5.0), 1.2),
            Self::IgnoredPlace => circle(1.3, &filled),
        }
    }
}

/// Draws what became of every object: the map with matches joined to their truth, missed, false
/// and ignored objects and the 95 % ellipses; beside it a legend with counts, the errors of the
/// matches, and the reliability of the probabilities where the map states any.
///
/// The same evaluation gives the same bytes. Objects far outside the truth are named at the foot
/// and not drawn.
pub fn picture(evaluation: &Evaluation, title: &str) -> String {
    let view = map_panel::View::of(&evaluation.comparison);
    let side = side_panels::height(evaluation);
    let map = Frame {
        x: MARGIN,
        y: HEADER,
        width: MAP_WIDTH,
        height: view.height(MAP_WIDTH).max(side),
    };
    let width = MARGIN + MAP_WIDTH + GAP + SIDE_WIDTH + MARGIN;
    let mut svg = Svg::new(width, HEADER + map.height + 40.0);
    header(&mut svg, evaluation, title);
    map_panel::draw(&mut svg, evaluation, &view, map);
    let column = Frame {
        x: MARGIN + MAP_WIDTH + GAP,
        width: SIDE_WIDTH,
        ..map
    };
    side_panels::draw(&mut svg, evaluation, column);
    svg.finish()
}

fn header(svg: &mut Svg, evaluation: &Evaluation, title: &str) {
    let report = &evaluation.report;
    let share = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.3}"));
    let rmse = report.detection.rmse_m;
    let scores = format!(
        "precision {}   recall {}   F1 {} within {} m   RMSE {} m   GOSPA {:.3} m (c = {} m)",
        share(report.detection.precision),
        share(report.detection.recall),
        share(report.detection.f1),
        report.options.radius_m,
        share(rmse),
        report.gospa.gospa_m,
        report.options.cutoff_m,
    );
    svg.push(&text(
        MARGIN,
        30.0,
        title,
        "font-size=\"19\" font-weight=\"bold\"",
    ));
    svg.push(&text(
        MARGIN,
        51.0,
        &scores,
        "font-size=\"13\" fill=\"#444\" xml:space=\"preserve\"",
    ));
}

#[cfg(test)]
mod tests;
