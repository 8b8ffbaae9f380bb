//! Figures 5, 6 and 7, and the sign test.

use serde::Serialize;

use super::circle::{Circle, CircleMethod, Score, Trial};
use super::plot::{
    Axis, BLUE, GREEN, GREY, PURPLE, Plot, RED, Scale, Shape, VIEWS, cross, mark, polygon, polyline,
};
use super::statistics::{BoxStatistics, Mean, SignTest, count};
use crate::publish::svg::{Frame, Svg, line, text, title};

/// Two errors that differ by less are equal: methods that stop at the same place differ in the
/// last digits.
const TIE: f64 = 1e-9;

/// Scores of all methods under one circle.
#[derive(Debug, Clone)]
pub struct Column {
    /// The circle.
    pub circle: Circle,
    /// Scores by method of [`CircleMethod::ALL`] and trial.
    pub scores: Vec<Vec<Score>>,
}

/// One row of the table of the circle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CircleRow {
    /// The method's name.
    pub method: &'static str,
    /// Standard deviation of a detection.
    pub noise: f64,
    /// Views.
    pub n_views: usize,
    /// Mean error over the trials.
    pub error: Mean,
    /// Mean error over the trials where objects and estimates are paired best.
    pub paired_error: Mean,
    /// Median and quartiles of the error.
    pub spread: BoxStatistics,
    /// The least mean error possible.
    pub bound: f64,
    /// Whether the method beats standard EM, trial by trial; none for standard EM itself and for
    /// what is no method of fusion.
    pub against_em: Option<SignTest>,
}

impl Column {
    /// Runs all methods.
    pub fn new(circle: Circle, n_trials: usize, seed: u64) -> Self {
        Self {
            circle,
            scores: circle.scores(&CircleMethod::ALL, n_trials, seed),
        }
    }

    /// The errors of a method by trial.
    fn of(&self, method: CircleMethod) -> Vec<f64> {
        self.scores_of(method).iter().map(|s| s.error).collect()
    }

    fn scores_of(&self, method: CircleMethod) -> &[Score] {
        let index = CircleMethod::ALL.iter().position(|m| *m == method);
        index.map_or(&[], |index| &self.scores[index])
    }

    /// The rows of a table, by method.
    pub fn rows(&self) -> Vec<CircleRow> {
        let row = |method: CircleMethod| {
            let errors = self.of(method);
            let paired = self.scores_of(method).iter().map(|s| s.paired);
            let tested = method != CircleMethod::Em
                && CircleMethod::fusing().any(|fusing| fusing == method)
                && !errors.is_empty();
            Some(CircleRow {
                method: method.name(),
                noise: self.circle.noise,
                n_views: self.circle.n_views,
                error: Mean::of(&errors)?,
                paired_error: Mean::of(&paired.collect::<Vec<_>>())?,
                spread: BoxStatistics::of(&errors)?,
                bound: self.circle.bound(),
                against_em: tested.then(|| SignTest::of(&errors, &self.of(CircleMethod::Em), TIE)),
            })
        };
        CircleMethod::ALL.into_iter().filter_map(row).collect()
    }
}

/// The colour of a method's lines.
fn colour(method: CircleMethod) -> &'static str {
    let order = [GREY, BLUE, RED, GREEN, PURPLE];
    let index = CircleMethod::ALL.iter().position(|m| *m == method);
    order[index.unwrap_or(0) % order.len()]
}

/// Figure 5: the detections of a trial by view, and the centres that each fusing method finds.
pub fn figure_5(trial: &Trial, noise: f64) -> String {
    const SIDE: f64 = 360.0;
    const TOP: f64 = 40.0;
    const GAP: f64 = 72.0;
    let methods: Vec<CircleMethod> = CircleMethod::fusing().collect();
    let width = 12.0 + count(methods.len()) * (SIDE + GAP);
    let mut svg = Svg::new(width, TOP + SIDE + 92.0);
    for (panel, &method) in methods.iter().enumerate() {
        let reach = 1.2 + 2.0 * noise;
        let axis = |label| Axis::linear(-reach, reach, label);
        let plot = Plot {
            frame: Frame {
                x: 64.0 + count(panel) * (SIDE + GAP),
                y: TOP,
                width: SIDE,
                height: SIDE,
            },
            x: axis("x (radii)"),
            y: axis("y (radii)"),
        };
        svg.push(&scatter(&plot, trial, method, noise));
    }
    svg.push(&legend_5(trial.views.len(), 64.0, TOP + SIDE + 72.0));
    svg.finish()
}

fn scatter(plot: &Plot, trial: &Trial, method: CircleMethod, noise: f64) -> String {
    let centres = method.find(trial, noise);
    let Frame { x, y, .. } = plot.frame;
    let heading = format!("{}: error {:.3}", method.title(), trial.error(&centres));
    let mut drawn = text(
        x,
        y - 14.0,
        &heading,
        "font-size=\"14\" font-weight=\"600\"",
    );
    drawn += &plot.axes([5.0, 5.0]);
    for (view, places) in trial.views.iter().enumerate() {
        let (shape, colour) = VIEWS[view % VIEWS.len()];
        let look = format!("fill=\"{colour}\" fill-opacity=\"0.75\"");
        for place in places {
            drawn += &mark(shape, plot.at(place.x, place.y), 3.4, &look);
        }
    }
    for object in &trial.objects {
        drawn += &cross(plot.at(object.x, object.y), 4.0, TRUE_PLACE);
    }
    for centre in &centres {
        drawn += &mark(Shape::Circle, plot.at(centre.x, centre.y), 10.0, CENTRE);
    }
    drawn
}

const TRUE_PLACE: &str = "stroke=\"#000\" stroke-width=\"1.2\"";
const CENTRE: &str = "fill=\"none\" stroke=\"#000\" stroke-width=\"1.6\"";

fn legend_5(n_views: usize, left: f64, y: f64) -> String {
    let mut drawn = String::new();
    let mut x = left + 8.0;
    let mut entry = |symbol: &dyn Fn((f64, f64)) -> String, label: &str, width: f64| {
        drawn += &symbol((x, y - 4.5));
        drawn += &text(x + 13.0, y, label, "font-size=\"12\"");
        x += width;
    };
    for view in 0..n_views {
        let (shape, colour) = VIEWS[view % VIEWS.len()];
        let look = format!("fill=\"{colour}\" fill-opacity=\"0.75\"");
        let label = format!("view {}", view + 1);
        entry(&|at| mark(shape, at, 4.0, &look), &label, 72.0);
    }
    entry(&|at| cross(at, 4.0, TRUE_PLACE), "object", 76.0);
    entry(
        &|at| mark(Shape::Circle, at, 8.0, CENTRE),
        "cluster centre",
        110.0,
    );
    drawn
}

/// Figure 6: error against noise, means with their standard errors.
pub fn figure_6(columns: &[Column]) -> String {
    let noise = |c: &Column| c.circle.noise;
    let low = columns.iter().map(noise).fold(f64::INFINITY, f64::min);
    let high = columns.iter().map(noise).fold(0.0, f64::max);
    let margin = 0.05 * (high - low).max(0.01);
    let top = columns.iter().flat_map(Column::rows);
    let top = top.map(|r| r.error.mean + r.error.standard_error.unwrap_or(0.0));
    let plot = Plot {
        frame: Frame {
            x: 68.0,
            y: 20.0,
            width: 540.0,
            height: 340.0,
        },
        x: Axis::linear(
            low - margin,
            high + margin,
            "standard deviation of the detections (radii)",
        ),
        y: Axis::linear(
            0.0,
            1.06 * top.fold(0.0, f64::max),
            "error (sum of squares)",
        ),
    };
    let mut svg = Svg::new(640.0, 420.0);
    svg.push(&plot.axes([5.0, 6.0]));
    let bound = columns.iter().map(|c| plot.at(noise(c), c.circle.bound()));
    svg.push(&polyline(bound, BOUND));
    for method in CircleMethod::ALL {
        svg.push(&curve(&plot, columns, method));
    }
    svg.push(&legend_6(&plot));
    svg.finish()
}

const BOUND: &str = "stroke=\"#000\" stroke-width=\"1.4\" stroke-dasharray=\"5 4\"";

fn curve(plot: &Plot, columns: &[Column], method: CircleMethod) -> String {
    let colour = colour(method);
    let strong = format!("stroke=\"{colour}\" stroke-width=\"1.8\"");
    let means: Vec<(f64, Mean)> = columns
        .iter()
        .filter_map(|c| Some((c.circle.noise, Mean::of(&c.of(method))?)))
        .collect();
    let mut drawn = polyline(means.iter().map(|(x, m)| plot.at(*x, m.mean)), &strong);
    for (x, mean) in means {
        let half = mean.standard_error.unwrap_or(0.0);
        let (below, above) = (plot.at(x, mean.mean - half), plot.at(x, mean.mean + half));
        drawn += &line(below, above, &strong);
        for end in [below, above] {
            drawn += &line((end.0 - 4.0, end.1), (end.0 + 4.0, end.1), &strong);
        }
        let note = title(&format!(
            "{}, noise {x:.2}: {:.4} ± {half:.4}",
            method.title(),
            mean.mean
        ));
        let fill = format!("fill=\"{colour}\"");
        drawn += &format!(
            "<g>{}{note}</g>\n",
            mark(shape(method), plot.at(x, mean.mean), 4.2, &fill)
        );
    }
    drawn
}

fn shape(method: CircleMethod) -> Shape {
    let index = CircleMethod::ALL.iter().position(|m| *m == method);
    VIEWS[index.unwrap_or(0) % VIEWS.len()].0
}

fn legend_6(plot: &Plot) -> String {
    let (x, mut y) = (plot.frame.x + 18.0, plot.frame.y + 24.0);
    let mut drawn = String::new();
    let mut entry = |symbol: String, label: &str| {
        drawn += &symbol.replace("@Y", &format!("{:.2}", y - 4.5));
        drawn += &text(x + 40.0, y, label, "font-size=\"13\"");
        y += 21.0;
    };
    for method in CircleMethod::ALL {
        let colour = colour(method);
        let stroke = format!("stroke=\"{colour}\" stroke-width=\"1.8\"");
        let at = |dx: f64| format!("{:.2}", x + dx);
        let sample = format!(
            "<line x1=\"{}\" y1=\"@Y\" x2=\"{}\" y2=\"@Y\" {stroke}/>\n<g transform=\"translate({} @Y)\">{}</g>\n",
            at(0.0),
            at(30.0),
            at(15.0),
            mark(
                shape(method),
                (0.0, 0.0),
                4.2,
                &format!("fill=\"{colour}\"")
            )
        );
        entry(sample, method.title());
    }
    let dashes = format!(
        "<line x1=\"{x:.2}\" y1=\"@Y\" x2=\"{:.2}\" y2=\"@Y\" {BOUND}/>\n",
        x + 30.0
    );
    entry(dashes, "bound: n 2 s² / V");
    drawn
}

/// Figure 7: error against the number of views, as notched boxes.
pub fn figure_7(columns: &[Column]) -> String {
    let methods: Vec<CircleMethod> = CircleMethod::fusing().collect();
    let of_columns = |m: &CircleMethod| columns.iter().flat_map(|c| c.of(*m)).collect();
    let errors: Vec<f64> = methods.iter().flat_map::<Vec<f64>, _>(of_columns).collect();
    let bottom = errors
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min)
        .max(1e-9);
    let top = errors.iter().copied().fold(bottom, f64::max);
    let plot = Plot {
        frame: Frame {
            x: 68.0,
            y: 44.0,
            width: 640.0,
            height: 360.0,
        },
        x: Axis::linear(0.5, count(columns.len()) + 0.5, ""),
        y: Axis {
            scale: Scale::Logarithmic,
            ..Axis::linear(0.8 * bottom, 1.3 * top, "error (sum of squares)")
        },
    };
    let mut svg = Svg::new(740.0, 468.0);
    svg.push(&plot.y_axis(6.0));
    svg.push(&plot.frame.outline());
    let foot = plot.frame.y + plot.frame.height;
    let middle = "font-size=\"13\" text-anchor=\"middle\"";
    for (index, column) in columns.iter().enumerate() {
        let x = count(index) + 1.0;
        let views = column.circle.n_views.to_string();
        svg.push(&text(plot.at(x, top).0, foot + 18.0, &views, middle));
        let bound = column.circle.bound();
        svg.push(&line(
            plot.at(x - 0.42, bound),
            plot.at(x + 0.42, bound),
            BOUND,
        ));
        for (m, &method) in methods.iter().enumerate() {
            let slot = 0.8 / count(methods.len());
            let centre = x - 0.4 + slot * (count(m) + 0.5);
            if let Some(statistics) = BoxStatistics::of(&column.of(method)) {
                svg.push(&notched_box(
                    &plot,
                    centre,
                    0.36 * slot,
                    &statistics,
                    method,
                ));
            }
        }
    }
    let centre = plot.frame.x + plot.frame.width / 2.0;
    svg.push(&text(centre, foot + 40.0, "views", middle));
    svg.push(&legend_7(&plot, &methods));
    svg.finish()
}

fn notched_box(plot: &Plot, x: f64, half: f64, s: &BoxStatistics, method: CircleMethod) -> String {
    let colour = colour(method);
    let stroke = format!("stroke=\"{colour}\" stroke-width=\"1.4\"");
    let waist = 0.5 * half;
    // A notch that reaches beyond the box folds back, as is the custom.
    let right = [
        (half, s.lower_quartile),
        (half, s.notch[0]),
        (waist, s.median),
        (half, s.notch[1]),
        (half, s.upper_quartile),
    ];
    let left = right.iter().rev().map(|&(dx, y)| (-dx, y));
    let outline = right.iter().copied().chain(left);
    let corners = outline.map(|(dx, y)| plot.at(x + dx, y.max(plot.y.low)));
    let note = title(&format!(
        "{}: median {:.4}, quartiles {:.4} and {:.4}",
        method.title(),
        s.median,
        s.lower_quartile,
        s.upper_quartile
    ));
    let look =
        format!("fill=\"{colour}\" fill-opacity=\"0.18\" stroke-linejoin=\"round\" {stroke}");
    let mut drawn = format!("<g>{note}{}", polygon(corners, &look));
    let heavy = format!("stroke=\"{colour}\" stroke-width=\"2.4\"");
    drawn += &line(
        plot.at(x - waist, s.median),
        plot.at(x + waist, s.median),
        &heavy,
    );
    let ends = [
        (s.lower_quartile, s.whiskers[0]),
        (s.upper_quartile, s.whiskers[1]),
    ];
    for (from, to) in ends {
        drawn += &line(plot.at(x, from), plot.at(x, to), &stroke);
        drawn += &line(plot.at(x - waist, to), plot.at(x + waist, to), &stroke);
    }
    let ring = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1\"");
    for &outlier in &s.outliers {
        drawn += &mark(Shape::Circle, plot.at(x, outlier), 2.4, &ring);
    }
    drawn + "</g>\n"
}

/// One row above the diagram.
fn legend_7(plot: &Plot, methods: &[CircleMethod]) -> String {
    let y = plot.frame.y - 14.0;
    let mut x = plot.frame.x;
    let mut drawn = String::new();
    for &method in methods {
        let colour = colour(method);
        drawn += &format!(
            "<rect x=\"{x:.2}\" y=\"{:.2}\" width=\"22\" height=\"12\" fill=\"{colour}\" \
             fill-opacity=\"0.18\" stroke=\"{colour}\" stroke-width=\"1.4\"/>\n",
            y - 10.5
        );
        drawn += &text(x + 30.0, y, method.title(), "font-size=\"13\"");
        x += 165.0;
    }
    drawn += &line((x, y - 4.5), (x + 22.0, y - 4.5), BOUND);
    drawn + &text(x + 30.0, y, "bound of the mean", "font-size=\"13\"")
}
