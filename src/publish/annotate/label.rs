//! Names beside the rings, where there is room.

use super::canvas::Canvas;
use super::grid::Grid;
use super::marks::Ring;
use super::style::{Colour, Frame, Style};
use super::text::{CAP_HEIGHT, Face, Typesetter};

/// Above which probability of existence a name stands alone.
const CERTAIN: f64 = 0.95;

/// A name and where it stands.
pub(super) struct Label {
    pub(super) text: String,
    pub(super) frame: Frame,
    colour: Colour,
}

/// Finds room for the names: the likeliest objects first, larger ones before smaller ones, each
/// where it hides nothing. Names without room are left out, and on a small picture all of them.
pub(super) fn place(
    rings: &[Ring],
    grid: &mut Grid,
    style: &Style,
    typesetter: &Typesetter,
) -> Vec<Label> {
    if !style.has_labels {
        return Vec::new();
    }
    let likelihood = |ring: &Ring| ring.object.p_exist.unwrap_or(1.0);
    let mut order: Vec<&Ring> = rings
        .iter()
        .filter(|ring| !ring.object.label.is_empty())
        .collect();
    // The sort is stable: ties stay in the order given.
    order.sort_by(|a, b| {
        likelihood(b)
            .total_cmp(&likelihood(a))
            .then(b.radius.total_cmp(&a.radius))
    });
    let mut labels = Vec::new();
    for ring in order {
        let text = words(ring);
        let width = typesetter.width(&text, Face::Label);
        let height = typesetter.size(Face::Label) * CAP_HEIGHT;
        let best = candidates(ring, style, width, height)
            .into_iter()
            .filter(|frame| style.picture().contains(frame))
            .filter_map(|frame| Some((grid.cost(padded(frame, style))?, frame)))
            .reduce(|best, next| if next.0 < best.0 { next } else { best });
        if let Some((_, frame)) = best {
            grid.take(padded(frame, style));
            labels.push(Label {
                text,
                frame,
                colour: style.hue(ring.object.detected),
            });
        }
    }
    labels
}

/// Writes the names.
pub(super) fn draw(labels: &[Label], canvas: &mut Canvas, typesetter: &Typesetter) {
    for label in labels {
        let start = [label.frame.left, label.frame.bottom];
        typesetter.write(
            canvas,
            &label.text,
            Face::Label,
            start,
            (label.colour, true),
        );
    }
}

fn words(ring: &Ring) -> String {
    let label = &ring.object.label;
    match ring.object.p_exist {
        Some(p) if p < CERTAIN => format!("{label} {:.0} %", p.clamp(0.0, 1.0) * 100.0),
        _ => label.clone(),
    }
}

/// The eight places about a ring, the best liked first, as cartographers have them.
fn candidates(ring: &Ring, style: &Style, width: f64, height: f64) -> [Frame; 8] {
    let away = ring.radius + 5.0 * style.unit;
    let aside = std::f64::consts::FRAC_1_SQRT_2 * away;
    let (u, v) = (ring.object.centre.u, ring.object.centre.v);
    let at = |left: f64, top: f64| Frame {
        left,
        top,
        right: left + width,
        bottom: top + height,
    };
    let (middle, centre) = (v - height / 2.0, u - width / 2.0);
    [
        at(u + aside, v - aside - height),
        at(u + away, middle),
        at(u + aside, v + aside),
        at(centre, v - away - height),
        at(centre, v + away),
        at(u - aside - width, v - aside - height),
        at(u - away - width, middle),
        at(u - aside - width, v + aside),
    ]
}

fn padded(frame: Frame, style: &Style) -> Frame {
    let by = 1.5 * style.unit;
    Frame {
        left: frame.left - by,
        top: frame.top - by,
        right: frame.right + by,
        bottom: frame.bottom + by,
    }
}
