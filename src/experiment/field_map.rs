//! Figure 8: a map of the detections of all views.

use geo::{LineString, MultiPolygon};

use super::plot::{Axis, Plot, Shape, VIEWS, mark, polygon};
use super::statistics::count;
use crate::frame::{Enu, Point};
use crate::pipeline::Ground;
use crate::publish::svg::{Frame, Svg, text};
use crate::view::View;

/// The longer side of the map, pixels.
const SIDE: f64 = 600.0;
const LEFT: f64 = 68.0;
const TOP: f64 = 20.0;

/// Draws rocks (their true places and diameters, metres), footprints and detections.
pub(super) fn draw(rocks: &[(Point<Enu>, f64)], views: &[View], ground: &Ground) -> String {
    let plot = plot(views, ground);
    let Frame { width, height, .. } = plot.frame;
    let mut svg = Svg::new(LEFT + width + 24.0, TOP + height + 84.0);
    svg.push(&plot.axes([6.0, 6.0]));
    svg.push(&format!(
        "<clipPath id=\"map\"><rect {}/></clipPath>\n<g clip-path=\"url(#map)\">\n",
        plot.frame.attributes()
    ));
    for (view, footprint) in ground.footprints.all().iter().enumerate() {
        let colour = VIEWS[view % VIEWS.len()].1;
        let look = format!(
            "fill=\"{colour}\" fill-opacity=\"0.07\" stroke=\"{colour}\" stroke-width=\"1.2\""
        );
        for ring in rings(footprint.ground()) {
            let corners = ring.coords().map(|c| plot.at(c.x, c.y));
            svg.push(&polygon(corners, &look));
        }
    }
    for (place, diameter_m) in rocks {
        let radius = 0.5 * diameter_m * plot.scale();
        let at = plot.at(place.xyz.x, place.xyz.y);
        svg.push(&mark(Shape::Circle, at, radius, ROCK));
    }
    for placed in &ground.placed {
        let (shape, colour) = VIEWS[placed.view % VIEWS.len()];
        let at = plot.at(placed.hit.point.xyz.x, placed.hit.point.xyz.y);
        svg.push(&mark(shape, at, 4.2, &detection(colour)));
    }
    for (index, view) in views.iter().enumerate() {
        svg.push(&camera(&plot, index, view));
    }
    svg.push("</g>\n");
    svg.push(&legend(views.len(), TOP + height + 66.0));
    svg.finish()
}

const ROCK: &str = "fill=\"#b9b2a6\" stroke=\"#8d8577\" stroke-width=\"0.6\"";

fn detection(colour: &str) -> String {
    format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.7\"")
}

/// The map's axes: all footprints and cameras with a margin, a metre as long north as east.
fn plot(views: &[View], ground: &Ground) -> Plot {
    let corners = ground.footprints.all().iter().flat_map(|f| {
        let rings = rings(f.ground()).flat_map(|r| r.coords());
        rings.map(|c| (c.x, c.y)).collect::<Vec<_>>()
    });
    let cameras = views.iter().map(|v| (v.origin().xyz.x, v.origin().xyz.y));
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (x, y) in corners.chain(cameras) {
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    }
    let margin_m = 0.5;
    // Below the cameras stand their names.
    let low = low.map(|x| x - 2.0 * margin_m);
    let high = high.map(|x| x + margin_m);
    let size = [high[0] - low[0], high[1] - low[1]];
    let scale = SIDE / size[0].max(size[1]);
    Plot {
        frame: Frame {
            x: LEFT,
            y: TOP,
            width: size[0] * scale,
            height: size[1] * scale,
        },
        x: Axis::linear(low[0], high[0], "east (m)"),
        y: Axis::linear(low[1], high[1], "north (m)"),
    }
}

fn rings(area: &MultiPolygon<f64>) -> impl Iterator<Item = &LineString<f64>> {
    area.iter().map(geo::Polygon::exterior)
}

/// A camera's place, with a stroke the way it looks.
fn camera(plot: &Plot, index: usize, view: &View) -> String {
    let colour = VIEWS[index % VIEWS.len()].1;
    let origin = view.origin();
    let at = plot.at(origin.xyz.x, origin.xyz.y);
    let label = format!("view {}", index + 1);
    let look =
        format!("font-size=\"12\" fill=\"{colour}\" font-weight=\"600\" text-anchor=\"middle\"");
    mark(Shape::Triangle, at, 6.0, &format!("fill=\"{colour}\""))
        + &text(at.0, at.1 + 20.0, &label, &look)
}

fn legend(n_views: usize, y: f64) -> String {
    let mut drawn = String::new();
    for view in 0..n_views {
        let x = LEFT + 8.0 + 190.0 * count(view);
        let (shape, colour) = VIEWS[view % VIEWS.len()];
        drawn += &mark(shape, (x, y - 4.5), 4.6, &detection(colour));
        let label = format!("detections of view {}", view + 1);
        drawn += &text(x + 13.0, y, &label, "font-size=\"12\"");
    }
    let x = LEFT + 8.0 + 190.0 * count(n_views);
    drawn += &mark(Shape::Circle, (x, y - 4.5), 5.5, ROCK);
    drawn + &text(x + 13.0, y, "rocks", "font-size=\"12\"")
}
