//! A diagram on two linear axes, and the marks that go into it.

use crate::publish::svg::{Frame, labelled, line, round_length, text};

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// How numbers run along it.
    pub scale: Scale,
    /// The number at its start.
    pub low: f64,
    /// The number at its end.
    pub high: f64,
    /// What it measures, with its unit.
    pub label: &'static str,
}

/// How numbers run along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm; all are above zero.
    Logarithmic,
}

/// Two axes over a frame of the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plot {
    /// Where on the page.
    pub frame: Frame,
    /// From left to right.
    pub x: Axis,
    /// From bottom to top.
    pub y: Axis,
}

/// The shape of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A disc or ring.
    Circle,
    /// A square on its side.
    Square,
    /// A triangle that points up.
    Triangle,
    /// A square on its corner.
    Diamond,
    /// A triangle that points down.
    Wedge,
}

/// The colours of Okabe and Ito (Color universal design, 2008), which colour-blind eyes tell apart.
pub const BLUE: &str = "#0072b2";
/// Vermilion.
pub const RED: &str = "#d55e00";
/// Bluish green.
pub const GREEN: &str = "#009e73";
/// Reddish purple.
pub const PURPLE: &str = "#cc79a7";
/// Orange.
pub const ORANGE: &str = "#e69f00";
/// For what serves as a comparison only.
pub const GREY: &str = "#777777";

/// Shapes and colours of views, in their order; they repeat.
pub const VIEWS: [(Shape, &str); 5] = [
    (Shape::Circle, BLUE),
    (Shape::Square, ORANGE),
    (Shape::Triangle, GREEN),
    (Shape::Diamond, PURPLE),
    (Shape::Wedge, GREY),
];

impl Axis {
    /// A linear one.
    pub fn linear(low: f64, high: f64, label: &'static str) -> Self {
        Self {
            scale: Scale::Linear,
            low,
            high,
            label,
        }
    }

    /// Where along the axis a number lies, 0 to 1 from its start to its end.
    fn share(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    /// Its ticks with their labels: of a linear axis about `n`, of a logarithmic one 1, 2 and 5
    /// times the powers of ten.
    fn ticks(&self, n: f64) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => self.even_ticks(round_length((self.high - self.low) / n)),
            Scale::Logarithmic => self.decade_ticks(),
        }
    }

    fn even_ticks(&self, step: f64) -> Vec<(f64, String)> {
        let slack = 1e-9 * step;
        let mut k = ((self.low - slack) / step).ceil();
        let mut ticks = Vec::new();
        while k * step <= self.high + slack {
            ticks.push((k * step, labelled(k * step, step)));
            k += 1.0;
        }
        ticks
    }

    fn decade_ticks(&self) -> Vec<(f64, String)> {
        let mut ticks = Vec::new();
        let mut power = 10f64.powf(self.low.log10().floor());
        while power <= self.high {
            for digit in [1.0, 2.0, 5.0] {
                let tick = digit * power;
                if (self.low * (1.0 - 1e-9)..=self.high * (1.0 + 1e-9)).contains(&tick) {
                    ticks.push((tick, labelled(tick, tick)));
                }
            }
            power *= 10.0;
        }
        ticks
    }
}

impl Plot {
    /// Where a pair of numbers stands on the page.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.frame.x + self.x.share(x) * self.frame.width,
            self.frame.y + (1.0 - self.y.share(y)) * self.frame.height,
        )
    }

    /// Pixels of the page for one unit of the x axis.
    pub fn scale(&self) -> f64 {
        self.frame.width / (self.x.high - self.x.low)
    }

    /// Grid, frame, ticks and labels; `n_ticks` by axis is a wish.
    pub fn axes(&self, n_ticks: [f64; 2]) -> String {
        let bottom = self.frame.y + self.frame.height;
        let mut drawn = String::new();
        for (tick, label) in self.x.ticks(n_ticks[0]) {
            let (x, _) = self.at(tick, self.y.low);
            drawn += &line((x, self.frame.y), (x, bottom), GRID);
            drawn += &text(
                x,
                bottom + 17.0,
                &label,
                "font-size=\"12\" text-anchor=\"middle\"",
            );
        }
        drawn += &text(
            self.frame.x + self.frame.width / 2.0,
            bottom + 38.0,
            self.x.label,
            "font-size=\"13\" text-anchor=\"middle\"",
        );
        drawn + &self.y_axis(n_ticks[1]) + &self.frame.outline()
    }

    /// Grid, ticks and label of the y axis alone.
    pub fn y_axis(&self, n_ticks: f64) -> String {
        let right = self.frame.x + self.frame.width;
        let mut drawn = String::new();
        for (tick, label) in self.y.ticks(n_ticks) {
            let (_, y) = self.at(self.x.low, tick);
            drawn += &line((self.frame.x, y), (right, y), GRID);
            let look = "font-size=\"12\" text-anchor=\"end\"";
            drawn += &text(self.frame.x - 7.0, y + 4.0, &label, look);
        }
        let (x, y) = (self.frame.x - 44.0, self.frame.y + self.frame.height / 2.0);
        let turned = format!(
            "font-size=\"13\" text-anchor=\"middle\" transform=\"rotate(-90 {x:.2} {y:.2})\""
        );
        drawn + &text(x, y, self.y.label, &turned)
    }
}

const GRID: &str = "stroke=\"#e6e6e6\" stroke-width=\"1\"";

/// A mark of a size (the radius of a circle of about its area) with these attributes.
pub fn mark(shape: Shape, (x, y): (f64, f64), size: f64, attributes: &str) -> String {
    let corners: &[(f64, f64)] = match shape {
        Shape::Circle => {
            return format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{size:.2}\" {attributes}/>\n");
        }
        Shape::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        Shape::Triangle => &[(0.0, -1.25), (1.15, 0.75), (-1.15, 0.75)],
        Shape::Diamond => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
        Shape::Wedge => &[(0.0, 1.25), (1.15, -0.75), (-1.15, -0.75)],
    };
    let place = |&(dx, dy): &(f64, f64)| (x + dx * size, y + dy * size);
    polygon(corners.iter().map(place), attributes)
}

/// A closed outline with these attributes.
pub fn polygon(corners: impl Iterator<Item = (f64, f64)>, attributes: &str) -> String {
    format!("<polygon points=\"{}\" {attributes}/>\n", points(corners))
}

/// An open line with these attributes.
pub fn polyline(corners: impl Iterator<Item = (f64, f64)>, attributes: &str) -> String {
    let corners = points(corners);
    format!("<polyline points=\"{corners}\" fill=\"none\" {attributes}/>\n")
}

/// A saltire: the mark of true places.
pub fn cross((x, y): (f64, f64), size: f64, attributes: &str) -> String {
    line((x - size, y - size), (x + size, y + size), attributes)
        + &line((x - size, y + size), (x + size, y - size), attributes)
}

fn points(corners: impl Iterator<Item = (f64, f64)>) -> String {
    let written: Vec<String> = corners.map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
    written.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_the_axes() {
        let plot = Plot {
            frame: Frame {
                x: 50.0,
                y: 10.0,
                width: 200.0,
                height: 100.0,
            },
            x: Axis::linear(0.0, 0.4, ""),
            y: Axis::linear(-1.0, 1.0, ""),
        };
        assert_eq!(plot.at(0.1, 1.0), (100.0, 10.0));
        assert_eq!(plot.at(0.4, 0.0), (250.0, 60.0));
        assert_eq!(plot.scale(), 500.0);
        let labels = |axis: Axis| axis.ticks(4.0).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(labels(plot.x), ["0.0", "0.1", "0.2", "0.3", "0.4"]);
        let decades = Axis {
            scale: Scale::Logarithmic,
            ..Axis::linear(0.05, 10.0, "")
        };
        assert_eq!(
            labels(decades),
            ["0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10"]
        );
        assert!((decades.share(f64::sqrt(0.5)) - 0.5).abs() < 1e-12);
    }
}
