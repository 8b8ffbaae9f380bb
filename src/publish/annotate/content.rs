//! An annotation as bytes, by which two are told apart.

use super::{Annotation, DetectionMark};
use crate::frame::Pixel;

impl Annotation {
    /// Everything that decides how the annotation is drawn: the same bytes, the same drawing.
    pub fn content(&self) -> Vec<u8> {
        let mut content = Content(Vec::new());
        content.text(&self.title);
        content.count(self.covered.len());
        for ring in &self.covered {
            content.count(ring.len());
            ring.iter().for_each(|&pixel| content.pixel(pixel));
        }
        content.count(self.detections.len());
        for detection in &self.detections {
            match *detection {
                DetectionMark::Box {
                    x_min,
                    y_min,
                    x_max,
                    y_max,
                } => content.numbers(b'b', &[x_min, y_min, x_max, y_max]),
                DetectionMark::Point(at) => content.numbers(b'p', &[at.u, at.v]),
            }
        }
        content.count(self.placed.len());
        for mark in &self.placed {
            content.pixel(mark.centre);
            content.numbers(b'r', &[mark.radius_px]);
        }
        content.count(self.objects.len());
        for object in &self.objects {
            content.text(&object.label);
            content.pixel(object.centre);
            content.numbers(b'r', &[object.radius_px]);
            content.numbers(b'c', object.covariance_px.as_slice());
            content.0.push(u8::from(object.detected));
            match object.p_exist {
                Some(p_exist) => content.numbers(b'e', &[p_exist]),
                None => content.0.push(b'n'),
            }
        }
        content.0
    }
}

struct Content(Vec<u8>);

impl Content {
    fn count(&mut self, count: usize) {
        self.0.extend_from_slice(&(count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.extend_from_slice(text.as_bytes());
    }

    fn pixel(&mut self, pixel: Pixel) {
        self.numbers(b'@', &[pixel.u, pixel.v]);
    }

    fn numbers(&mut self, kind: u8, numbers: &[f64]) {
        self.0.push(kind);
        for number in numbers {
            self.0.extend_from_slice(&number.to_bits().to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ObjectMark, PlacedMark};
    use super::*;
    use nalgebra::Matrix2;

    fn annotation() -> Annotation {
        Annotation {
            title: "v".to_owned(),
            covered: vec![vec![Pixel::new(1.0, 2.0); 3]],
            detections: vec![DetectionMark::Point(Pixel::new(3.0, 4.0))],
            placed: vec![PlacedMark {
                centre: Pixel::new(5.0, 6.0),
                radius_px: 7.0,
            }],
            objects: vec![ObjectMark {
                label: "r".to_owned(),
                centre: Pixel::new(8.0, 9.0),
                radius_px: 10.0,
                covariance_px: Matrix2::identity(),
                detected: true,
                p_exist: Some(0.5),
            }],
        }
    }

    #[test]
    fn every_change_shows() {
        let changes: [fn(&mut Annotation); 12] = [
            |a| a.title.push('w'),
            |a| a.covered[0][2].v = 2.5,
            |a| a.covered.push(Vec::new()),
            |a| a.detections[0] = DetectionMark::Point(Pixel::new(3.0, 4.5)),
            |a| a.detections.clear(),
            |a| a.placed[0].radius_px = 7.5,
            |a| a.placed[0].centre.u = 5.5,
            |a| a.objects[0].label.clear(),
            |a| a.objects[0].radius_px = 10.5,
            |a| a.objects[0].covariance_px[(0, 1)] = 0.5,
            |a| a.objects[0].detected = false,
            |a| a.objects[0].p_exist = None,
        ];
        let mut seen = vec![annotation().content()];
        for change in changes {
            let mut changed = annotation();
            change(&mut changed);
            let content = changed.content();
            assert!(!seen.contains(&content), "{changed:?}");
            seen.push(content);
        }
        assert_eq!(seen[0], annotation().content());
    }
}
