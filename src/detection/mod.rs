//! What a detector marked in the pictures.

mod coco;
mod reader;
mod voc;
mod writer;

pub use reader::{DetectionFile, read_detections};
pub use writer::{DetectionRecord, MeasurementRecord, write_detections};

use crate::frame::Pixel;

/// One mark of a detector, as its file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// The image it was made in.
    pub image_id: String,
    /// Its name within the image.
    pub det_id: String,
    /// What it is said to be.
    pub class: Option<String>,
    /// How sure the detector was, 0 to 1.
    pub score: Option<f64>,
    /// Size of the object where the detector measured it, metres.
    pub diameter_m: Option<f64>,
    /// Where the mark is.
    pub mark: Mark,
    /// Slant range from the camera's centre (the body's origin without a camera), metres.
    pub range_m: Option<f64>,
    /// Standard deviations that the record itself gives.
    pub sigma: MarkSigma,
    /// Which of the run's detection files it comes from, by index.
    pub file: usize,
    /// Its line in that file.
    pub line: u64,
}

/// Where a detector put its mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A box in the raw picture.
    Box(PixelBox),
    /// A point of the raw picture.
    Point(Pixel),
    /// A direction in the body's x-y plane, radians clockwise from its x (forward) axis; always
    /// with a range.
    Bearing(f64),
    /// A direction in the local horizontal plane, radians clockwise from true north; always with a
    /// range.
    Azimuth(f64),
}

/// A box by its edges, pixels; an edge may lie outside the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelBox {
    /// Left edge.
    pub x_min: f64,
    /// Upper edge.
    pub y_min: f64,
    /// Right edge.
    pub x_max: f64,
    /// Lower edge.
    pub y_max: f64,
}

/// Standard deviations of one mark, where its file gives them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MarkSigma {
    /// Of the column, pixels.
    pub u_px: Option<f64>,
    /// Of the row, pixels.
    pub v_px: Option<f64>,
    /// Of the range, metres.
    pub range_m: Option<f64>,
    /// Of the bearing or azimuth, radians.
    pub bearing: Option<f64>,
}

/// Which point of a box is taken for the object's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// A share of the box's height from its top: 0.5 is the centre, 1 the bottom's middle.
    HeightShare(f64),
}

impl Aim {
    /// The middle of the box.
    pub const CENTER: Self = Self::HeightShare(0.5);
    /// The middle of its lower edge.
    pub const BOTTOM: Self = Self::HeightShare(1.0);
}

impl PixelBox {
    /// The aim point; the box's true one, also where the box leaves the picture.
    pub fn aim_point(&self, aim: Aim) -> Pixel {
        let Aim::HeightShare(share) = aim;
        Pixel::new(
            0.5 * (self.x_min + self.x_max),
            self.y_min + share * (self.y_max - self.y_min),
        )
    }

    /// Width, pixels.
    pub fn width(&self) -> f64 {
        self.x_max - self.x_min
    }

    /// Height, pixels.
    pub fn height(&self) -> f64 {
        self.y_max - self.y_min
    }

    /// Whether any of it lies in a picture of this size.
    pub fn meets(&self, width: u32, height: u32) -> bool {
        self.x_max >= -0.5
            && self.y_max >= -0.5
            && self.x_min <= f64::from(width) - 0.5
            && self.y_min <= f64::from(height) - 0.5
    }

    /// Whether all of it lies at least `margin` pixels inside a picture of this size.
    pub fn is_whole(&self, width: u32, height: u32, margin: f64) -> bool {
        self.x_min >= margin - 0.5
            && self.y_min >= margin - 0.5
            && self.x_max <= f64::from(width) - 0.5 - margin
            && self.y_max <= f64::from(height) - 0.5 - margin
    }

    /// Which ends, low and high, of its width and of its height the border of a picture of this size
    /// cuts: those within `margin` pixels of it. A box that reaches farther out is as large as its
    /// detector takes the object to be.
    pub fn cut_ends(&self, width: u32, height: u32, margin: f64) -> [(bool, bool); 2] {
        let cut = |low: f64, high: f64, length: u32| {
            let lies_on = |end: f64, border: f64| (end - border).abs() < margin;
            (lies_on(low, -0.5), lies_on(high, f64::from(length) - 0.5))
        };
        [
            cut(self.x_min, self.x_max, width),
            cut(self.y_min, self.y_max, height),
        ]
    }

    /// What the border of a picture of this size takes away of it, as [`PixelBox::cut_ends`], and
    /// where an object's aim point lies from the ends that are left.
    pub fn cut(&self, width: u32, height: u32, margin: f64, aim: Aim) -> Cut {
        let [across, down] = self.cut_ends(width, height, margin);
        let Aim::HeightShare(share) = aim;
        Cut {
            across: Side::new(across, (self.x_min, self.x_max), 0.5),
            down: Side::new(down, (self.y_min, self.y_max), share),
        }
    }
}

/// What a picture's border takes away of a box.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut {
    /// Of its width.
    pub across: Side,
    /// Of its height.
    pub down: Side,
}

/// What a picture's border takes away of a box along one of its sides.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Side {
    /// Nothing.
    #[default]
    Whole,
    /// One of its ends: the object goes on beyond the border.
    Cut {
        /// The end that is left, pixels.
        end_px: f64,
        /// From that end to the aim point of the whole object, as a share of the whole's length.
        to_aim: f64,
    },
    /// Both ends.
    Lost,
}

impl Side {
    /// A side whose ends, low and high, are cut or not, with the share of its length that lies
    /// before the aim point.
    fn new(cut: (bool, bool), (low_px, high_px): (f64, f64), share: f64) -> Self {
        match cut {
            (false, false) => Self::Whole,
            (true, true) => Self::Lost,
            (true, false) => Self::Cut {
                end_px: high_px,
                to_aim: share - 1.0,
            },
            (false, true) => Self::Cut {
                end_px: low_px,
                to_aim: share,
            },
        }
    }
}

impl Cut {
    /// Nothing.
    pub const NONE: Self = Self {
        across: Side::Whole,
        down: Side::Whole,
    };

    /// Whether it takes anything.
    pub fn is_any(self) -> bool {
        self != Self::NONE
    }
}

impl Detection {
    /// The mark in the picture under an aim, if it is one.
    pub fn aim_point(&self, aim: Aim) -> Option<Pixel> {
        match self.mark {
            Mark::Box(b) => Some(b.aim_point(aim)),
            Mark::Point(pixel) => Some(pixel),
            Mark::Bearing(_) | Mark::Azimuth(_) => None,
        }
    }

    /// The key its rejects and evidence name it by.
    pub fn key(&self) -> String {
        format!("{}/{}", self.image_id, self.det_id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_cut_what_ends_at_them_and_no_more() {
        let cut = |x_min, y_min, x_max, y_max| {
            let b = PixelBox {
                x_min,
                y_min,
                x_max,
                y_max,
            };
            let cut = b.cut(640, 480, 3.0, Aim::BOTTOM);
            (cut.across, cut.down)
        };
        let left = |end_px, to_aim| Side::Cut { end_px, to_aim };
        let whole = Side::Whole;
        assert_eq!(cut(10.0, 10.0, 50.0, 50.0), (whole, whole));
        assert_eq!(cut(-0.5, 10.0, 50.0, 50.0), (left(50.0, -0.5), whole));
        let corner = (left(600.0, 0.5), left(450.0, 1.0));
        assert_eq!(cut(600.0, 450.0, 637.0, 481.0), corner);
        // What stands at the lower edge is left where the upper one is cut.
        assert_eq!(cut(10.0, 0.0, 50.0, 50.0), (whole, left(50.0, 0.0)));
        assert_eq!(cut(-1.0, 10.0, 639.0, 50.0), (Side::Lost, whole));
        // Too far out for a border that cuts.
        assert_eq!(cut(-9.0, 10.0, 50.0, 485.0), (whole, whole));
    }
}
