//! The map itself.

use std::fmt::Write as _;

use super::super::Evaluation;
use super::super::comparison::{ComparedEstimate, Comparison, EstimateOutcome, TruthOutcome};
use super::Symbol;
use crate::frame::{Ellipse, Enu, Point, covariance_ellipse};
use crate::publish::svg::{Frame, Svg, escaped, labelled, line, round_length, text, title};

/// More objects than this are drawn without titles, which would double the file.
const MOST_TITLED: usize = 20_000;
/// More missed and false objects than this are drawn without their names.
const MOST_NAMED: usize = 30;

/// The part of the ground that is drawn.
pub struct View {
    west: f64,
    east: f64,
    south: f64,
    north: f64,
}

impl View {
    /// All true objects, and the mapped ones that are not far outside of them.
    pub fn of(comparison: &Comparison) -> Self {
        let mut view = Self {
            west: f64::INFINITY,
            east: f64::NEG_INFINITY,
            south: f64::INFINITY,
            north: f64::NEG_INFINITY,
        };
        for truth in &comparison.truths {
            view.include(truth.place);
        }
        let span = (view.east - view.west).max(view.north - view.south);
        let reach = view.widened((0.5 * span).max(100.0 * comparison.options.radius_m));
        for estimate in &comparison.estimates {
            let counts = estimate.outcome != EstimateOutcome::Doubtful;
            if counts && reach.contains(estimate.place) {
                view.include(estimate.place);
            }
        }
        let span = (view.east - view.west).max(view.north - view.south);
        let margin = (0.06 * span).max(3.0 * comparison.options.radius_m);
        view.widened(margin)
    }

    /// The height of a panel of this width that shows the view well, pixels.
    pub fn height(&self, width: f64) -> f64 {
        let shape = (self.north - self.south) / (self.east - self.west);
        (width * shape).clamp(0.5 * width, 1.2 * width)
    }

    fn include(&mut self, place: Point<Enu>) {
        self.west = self.west.min(place.xyz.x);
        self.east = self.east.max(place.xyz.x);
        self.south = self.south.min(place.xyz.y);
        self.north = self.north.max(place.xyz.y);
    }

    fn widened(&self, by: f64) -> Self {
        Self {
            west: self.west - by,
            east: self.east + by,
            south: self.south - by,
            north: self.north + by,
        }
    }

    fn contains(&self, place: Point<Enu>) -> bool {
        (self.west..=self.east).contains(&place.xyz.x)
            && (self.south..=self.north).contains(&place.xyz.y)
    }
}

/// Ground to page.
struct Scale {
    /// Pixels per metre.
    px_per_m: f64,
    /// The page place of the local origin.
    origin: (f64, f64),
    /// The ground that the panel really shows.
    shown: View,
    /// The size of symbols, 1 where there are few.
    symbol: f64,
}

impl Scale {
    fn new(view: &View, panel: Frame, n_objects: usize) -> Self {
        let (width, height) = (view.east - view.west, view.north - view.south);
        let px_per_m = (panel.width / width).min(panel.height / height);
        let middle = (
            (view.west + view.east) / 2.0,
            (view.south + view.north) / 2.0,
        );
        let (half_w, half_h) = (panel.width / px_per_m / 2.0, panel.height / px_per_m / 2.0);
        Self {
            px_per_m,
            origin: (
                panel.x + panel.width / 2.0 - middle.0 * px_per_m,
                panel.y + panel.height / 2.0 + middle.1 * px_per_m,
            ),
            shown: View {
                west: middle.0 - half_w,
                east: middle.0 + half_w,
                south: middle.1 - half_h,
                north: middle.1 + half_h,
            },
            symbol: match n_objects {
                0..=300 => 1.0,
                301..=1_500 => 0.75,
                1_501..=8_000 => 0.5,
                _ => 0.3,
            },
        }
    }

    fn page(&self, place: Point<Enu>) -> (f64, f64) {
        (
            self.origin.0 + place.xyz.x * self.px_per_m,
            self.origin.1 - place.xyz.y * self.px_per_m,
        )
    }
}

/// Draws the map into its panel.
pub fn draw(svg: &mut Svg, evaluation: &Evaluation, view: &View, panel: Frame) {
    let comparison = &evaluation.comparison;
    let n_objects = comparison.estimates.len() + comparison.truths.len();
    let scale = Scale::new(view, panel, n_objects);
    svg.push(&format!(
        "<clipPath id=\"map\"><rect {}/></clipPath>\n",
        panel.attributes()
    ));
    svg.push(&panel.filled("#fbfaf7"));
    svg.push("<g clip-path=\"url(#map)\">\n");
    svg.push(&grid(&scale, panel));
    svg.push(&objects(comparison, &scale, n_objects <= MOST_TITLED));
    svg.push(&names(comparison, &scale));
    svg.push(&scale_bar(&scale, panel));
    svg.push(&north_arrow(panel));
    svg.push("</g>\n");
    svg.push(&panel.outline());
    svg.push(&foot(comparison, &scale, panel));
}

fn grid(scale: &Scale, panel: Frame) -> String {
    let step = round_length(panel.width / scale.px_per_m / 5.0);
    let paint = "stroke=\"#e6e3da\" stroke-width=\"1\"";
    let small = "font-size=\"10\" fill=\"#8a867c\"";
    let mut out = String::new();
    let lines = |low: f64, high: f64| {
        let (mut at, mut all) = ((low / step).ceil() * step, Vec::new());
        while at <= high && all.len() < 100 {
            all.push(at);
            at += step;
        }
        all
    };
    for east in lines(scale.shown.west, scale.shown.east) {
        let x = scale.page(Point::new(east, 0.0, 0.0)).0;
        out += &line((x, panel.y), (x, panel.y + panel.height), paint);
        out += &text(x + 3.0, panel.y + 11.0, &labelled(east, step), small);
    }
    for north in lines(scale.shown.south, scale.shown.north) {
        let y = scale.page(Point::new(0.0, north, 0.0)).1;
        out += &line((panel.x, y), (panel.x + panel.width, y), paint);
        out += &text(panel.x + 3.0, y - 3.0, &labelled(north, step), small);
    }
    out
}

/// Everything that stands somewhere, the quiet first and the telling last.
fn objects(comparison: &Comparison, scale: &Scale, titled: bool) -> String {
    let titled = |content: &dyn Fn() -> String| {
        if titled {
            title(&content())
        } else {
            String::new()
        }
    };
    let mut out = String::new();
    let mut put = |symbol: Symbol, place: Point<Enu>, inside: &str| {
        if scale.shown.contains(place) {
            let (x, y) = scale.page(place);
            out += &symbol.draw(x, y, scale.symbol, inside);
        }
    };
    for &place in &comparison.ignored {
        put(Symbol::IgnoredPlace, place, "");
    }
    let mut truths = |symbol: Symbol| {
        for truth in &comparison.truths {
            if Symbol::of_truth(truth.outcome) == symbol {
                put(symbol, truth.place, &titled(&|| truth.object_id.clone()));
            }
        }
    };
    truths(Symbol::Rare);
    truths(Symbol::MatchedTruth);
    truths(Symbol::Missed);
    let truths_drawn = std::mem::take(&mut out);
    for symbol in [
        Symbol::Doubtful,
        Symbol::IgnoredEstimate,
        Symbol::Matched,
        Symbol::False,
    ] {
        for estimate in &comparison.estimates {
            if Symbol::of_estimate(estimate.outcome) == symbol
                && scale.shown.contains(estimate.place)
            {
                let (x, y) = scale.page(estimate.place);
                let told = titled(&|| told(comparison, estimate));
                out += &symbol.draw(x, y, scale.symbol, &told);
            }
        }
    }
    ellipses(comparison, scale) + &truths_drawn + &joins(comparison, scale) + &out
}

/// What the picture tells of a mapped object under the pointer.
fn told(comparison: &Comparison, estimate: &ComparedEstimate) -> String {
    let mut told = estimate.rock_id.clone();
    if let EstimateOutcome::Matched(truth) = estimate.outcome {
        let truth = &comparison.truths[truth];
        let distance_m = estimate.place.horizontal_distance(truth.place);
        let _ = write!(told, ": {}, {distance_m:.3} m off", truth.object_id);
    }
    if let Some(p) = estimate.p_exist {
        let _ = write!(told, ", p_exist {p:.3}");
    }
    told
}

fn ellipses(comparison: &Comparison, scale: &Scale) -> String {
    let mut out = String::new();
    for estimate in &comparison.estimates {
        let (Some(covariance), true) = (estimate.covariance, scale.shown.contains(estimate.place))
        else {
            continue;
        };
        let ellipse = covariance_ellipse(covariance);
        let reach = Ellipse::scale_95() * scale.px_per_m;
        let (rx, ry) = (ellipse.sigma_major_m * reach, ellipse.sigma_minor_m * reach);
        if rx < 1.0 || estimate.outcome == EstimateOutcome::Doubtful {
            continue;
        }
        let (x, y) = scale.page(estimate.place);
        let turn = ellipse.azimuth.to_degrees() - 90.0;
        let colour = Symbol::of_estimate(estimate.outcome).colour();
        let _ = writeln!(
            out,
            "<ellipse cx=\"{x:.2}\" cy=\"{y:.2}\" rx=\"{rx:.2}\" ry=\"{ry:.2}\" \
             transform=\"rotate({turn:.2} {x:.2} {y:.2})\" fill=\"{colour}\" \
             fill-opacity=\"0.07\" stroke=\"{colour}\" stroke-opacity=\"0.55\" \
             stroke-width=\"0.8\"/>"
        );
    }
    out
}

fn joins(comparison: &Comparison, scale: &Scale) -> String {
    let width = 1.3 * scale.symbol;
    let paint = format!("stroke=\"#0072b2\" stroke-width=\"{width:.2}\"");
    let join = |m: &super::super::Match| {
        let from = scale.page(comparison.estimates[m.estimate].place);
        line(from, scale.page(comparison.truths[m.truth].place), &paint)
    };
    comparison.matches.iter().map(join).collect()
}

/// The names of what was missed and of what is false, where they are few.
fn names(comparison: &Comparison, scale: &Scale) -> String {
    let missed = comparison.truths.iter();
    let missed = missed
        .filter(|t| t.outcome == TruthOutcome::Missed)
        .map(|t| (t.place, &t.object_id, Symbol::Missed));
    let unmatched = comparison.estimates.iter();
    let unmatched = unmatched
        .filter(|e| e.outcome == EstimateOutcome::False)
        .map(|e| (e.place, &e.rock_id, Symbol::False));
    let all: Vec<_> = missed.chain(unmatched).collect();
    if all.len() > MOST_NAMED {
        return String::new();
    }
    let name = |(place, name, symbol): (Point<Enu>, &String, Symbol)| {
        let (x, y) = scale.page(place);
        let colour = symbol.colour();
        format!(
            "<text x=\"{:.2}\" y=\"{:.2}\" font-size=\"10\" fill=\"{colour}\" stroke=\"#fbfaf7\" \
             stroke-width=\"3\" paint-order=\"stroke\">{}</text>\n",
            x + 9.0,
            y + 3.5,
            escaped(name)
        )
    };
    all.into_iter().map(name).collect()
}

fn scale_bar(scale: &Scale, panel: Frame) -> String {
    let length_m = round_length(panel.width / scale.px_per_m / 4.0);
    let length = length_m * scale.px_per_m;
    let (x, y) = (panel.x + 24.0, panel.y + panel.height - 20.0);
    let label = if length_m >= 1000.0 {
        format!("{} km", labelled(length_m / 1000.0, length_m / 1000.0))
    } else {
        format!("{} m", labelled(length_m, length_m))
    };
    let back = Frame {
        x: x - 12.0,
        y: y - 24.0,
        width: length + 24.0,
        height: 34.0,
    };
    let mut out = format!(
        "<rect {} rx=\"4\" fill=\"#ffffff\" fill-opacity=\"0.85\"/>\n",
        back.attributes()
    );
    let _ = writeln!(
        out,
        "<path d=\"M{x:.2} {:.2}v5h{length:.2}v-5\" fill=\"none\" stroke=\"#222\" \
         stroke-width=\"1.6\"/>",
        y - 5.0
    );
    out += &text(
        x + length / 2.0,
        y - 8.0,
        &label,
        "font-size=\"12\" fill=\"#222\" text-anchor=\"middle\"",
    );
    out
}

fn north_arrow(panel: Frame) -> String {
    let (x, y) = (panel.x + panel.width - 26.0, panel.y + 22.0);
    let arrow = format!(
        "<circle cx=\"{x:.2}\" cy=\"{:.2}\" r=\"22\" fill=\"#ffffff\" fill-opacity=\"0.85\"/>\n\
         <path d=\"M{x:.2} {y:.2}l6 18l-6 -4l-6 4z\" fill=\"#222\"/>\n",
        y + 10.0
    );
    let letter = "font-size=\"11\" fill=\"#222\" text-anchor=\"middle\"";
    arrow + &text(x, y - 2.0, "N", letter)
}

fn foot(comparison: &Comparison, scale: &Scale, panel: Frame) -> String {
    let n_outside = comparison
        .estimates
        .iter()
        .filter(|e| e.outcome != EstimateOutcome::Doubtful && !scale.shown.contains(e.place))
        .count();
    let origin = comparison.site.origin();
    let mut note = format!(
        "metres east and north of {:.6}, {:.6}",
        origin.lat_deg(),
        origin.lon_deg()
    );
    if n_outside > 0 {
        let _ = write!(note, "; {n_outside} mapped objects lie outside the picture");
    }
    text(
        panel.x,
        panel.y + panel.height + 18.0,
        &note,
        "font-size=\"11\" fill=\"#555\"",
    )
}
