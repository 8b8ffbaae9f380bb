//! Which part of a sensor the pictures show, and how coarsely.

use nalgebra::Vector2;

use crate::frame::Pixel;

/// How pixels of the sensor become pixels of the picture; by columns and by rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reduction {
    /// One by one.
    Full,
    /// Every pixel is the average of a block of so many columns and rows, and its centre the
    /// block's: `u' = (u + 0.5) / n - 0.5`. A block that the subframe does not fill is dropped.
    Binning([u32; 2]),
    /// Every so-many-th column and row, from the first of the subframe on: `u' = u / n`.
    Downsampling([u32; 2]),
}

/// A part of the sensor, in its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subframe {
    /// First column, from 0.
    pub first_u_px: u32,
    /// First row, from 0.
    pub first_v_px: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

/// Pictures that show a subframe of their sensor, perhaps binned or downsampled.
///
/// The lens model of such a camera is that of the full sensor, whose pixels it answers in. With
/// `u` a column of the sensor, counted from the subframe's first one, and `u'` that of the picture,
/// [`Reduction`] states the convention of each kind; rows likewise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Readout {
    sensor: [u32; 2],
    subframe: Subframe,
    reduction: Reduction,
}

/// A readout the sensor does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BadReadout {
    /// A subframe that is empty or reaches beyond the picture it is taken from.
    #[error(
        "found a subframe of {}x{} from column {} and row {}, expected a part of the {}x{} there are",
        .subframe.width, .subframe.height, .subframe.first_u_px, .subframe.first_v_px, .size[0], .size[1]
    )]
    Subframe {
        /// The subframe asked for.
        subframe: Subframe,
        /// Columns and rows of the picture it was to be taken from.
        size: [u32; 2],
    },
    /// A step that is zero or leaves no pixel.
    #[error(
        "found {} by {}, expected whole numbers from 1 to the {}x{} pixels there are",
        .by[0], .by[1], .size[0], .size[1]
    )]
    Factor {
        /// Columns and rows asked for.
        by: [u32; 2],
        /// Columns and rows of the picture that was to be reduced.
        size: [u32; 2],
    },
    /// Averages of samples, or samples of averages.
    #[error("pictures are binned or downsampled, not both")]
    Both,
}

impl Readout {
    /// All of a sensor of this size.
    pub fn whole(width: u32, height: u32) -> Self {
        Self {
            sensor: [width, height],
            subframe: Subframe {
                first_u_px: 0,
                first_v_px: 0,
                width,
                height,
            },
            reduction: Reduction::Full,
        }
    }

    /// Whether the pictures show all of the sensor, pixel by pixel.
    pub fn is_whole(&self) -> bool {
        let [width, height] = self.sensor;
        *self == Self::whole(width, height)
    }

    /// Columns and rows of the full sensor.
    pub fn sensor(&self) -> [u32; 2] {
        self.sensor
    }

    /// The part that the pictures show.
    pub fn subframe(&self) -> Subframe {
        self.subframe
    }

    /// How coarsely they show it.
    pub fn reduction(&self) -> Reduction {
        self.reduction
    }

    /// Columns and rows of the pictures.
    pub fn size(&self) -> [u32; 2] {
        let shown = [self.subframe.width, self.subframe.height];
        match self.reduction {
            Reduction::Full => shown,
            Reduction::Binning([n, m]) => [shown[0] / n, shown[1] / m],
            Reduction::Downsampling([n, m]) => [shown[0].div_ceil(n), shown[1].div_ceil(m)],
        }
    }

    /// A part of these pictures, in their own pixels.
    ///
    /// # Errors
    /// [`BadReadout::Subframe`].
    pub fn cut(&self, part: Subframe) -> Result<Self, BadReadout> {
        let size = self.size();
        let bad = BadReadout::Subframe {
            subframe: part,
            size,
        };
        let within = |first: u32, count: u32, all: u32| {
            count > 0 && first.checked_add(count).is_some_and(|end| end <= all)
        };
        if !within(part.first_u_px, part.width, size[0])
            || !within(part.first_v_px, part.height, size[1])
        {
            return Err(bad);
        }
        let [n, m] = self.factors();
        // Of the last downsampled column, only the sample itself need be there.
        let span = |count: u32, n: u32| match self.reduction {
            Reduction::Downsampling(_) => (count - 1) * n + 1,
            _ => count * n,
        };
        Ok(Self {
            subframe: Subframe {
                first_u_px: self.subframe.first_u_px + part.first_u_px * n,
                first_v_px: self.subframe.first_v_px + part.first_v_px * m,
                width: span(part.width, n),
                height: span(part.height, m),
            },
            ..*self
        })
    }

    /// These pictures with every pixel the average of a block of `by` columns and rows.
    ///
    /// # Errors
    /// [`BadReadout::Factor`]; [`BadReadout::Both`] where they are downsampled.
    pub fn binned(&self, by: [u32; 2]) -> Result<Self, BadReadout> {
        match self.reduction {
            Reduction::Downsampling(_) => Err(BadReadout::Both),
            _ => self.reduced(by, Reduction::Binning),
        }
    }

    /// Every so-many-th column and row of these pictures, from the first on.
    ///
    /// # Errors
    /// [`BadReadout::Factor`]; [`BadReadout::Both`] where they are binned.
    pub fn downsampled(&self, by: [u32; 2]) -> Result<Self, BadReadout> {
        match self.reduction {
            Reduction::Binning(_) => Err(BadReadout::Both),
            _ => self.reduced(by, Reduction::Downsampling),
        }
    }

    /// Where on the full sensor a pixel of the pictures is.
    #[inline]
    pub fn on_sensor(&self, pixel: Pixel) -> Pixel {
        let (offset, step) = self.affine();
        (offset + pixel.to_vector().component_mul(&step)).into()
    }

    /// Where in the pictures a pixel of the full sensor is.
    #[inline]
    pub fn in_picture(&self, sensor: Pixel) -> Pixel {
        let (offset, step) = self.affine();
        (sensor.to_vector() - offset).component_div(&step).into()
    }

    /// Pixels of the sensor per pixel of the pictures, by columns and rows.
    #[inline]
    pub fn step(&self) -> Vector2<f64> {
        let [n, m] = self.factors();
        Vector2::new(f64::from(n), f64::from(m))
    }

    fn reduced(
        &self,
        by: [u32; 2],
        kind: impl Fn([u32; 2]) -> Reduction,
    ) -> Result<Self, BadReadout> {
        let size = self.size();
        if (0..2).any(|i| by[i] == 0 || by[i] > size[i]) {
            return Err(BadReadout::Factor { by, size });
        }
        let [n, m] = self.factors();
        Ok(Self {
            reduction: match [n * by[0], m * by[1]] {
                [1, 1] => Reduction::Full,
                factors => kind(factors),
            },
            ..*self
        })
    }

    #[inline]
    fn factors(&self) -> [u32; 2] {
        match self.reduction {
            Reduction::Full => [1, 1],
            Reduction::Binning(by) | Reduction::Downsampling(by) => by,
        }
    }

    /// `sensor = offset + picture * step`.
    #[inline]
    fn affine(&self) -> (Vector2<f64>, Vector2<f64>) {
        let step = self.step();
        let first = Vector2::new(
            f64::from(self.subframe.first_u_px),
            f64::from(self.subframe.first_v_px),
        );
        let offset = match self.reduction {
            // The centre of a block of n pixels is (n - 1) / 2 from the centre of its first.
            Reduction::Binning(_) => first + (step - Vector2::repeat(1.0)) * 0.5,
            _ => first,
        };
        (offset, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(first_u_px: u32, first_v_px: u32, width: u32, height: u32) -> Subframe {
        Subframe {
            first_u_px,
            first_v_px,
            width,
            height,
        }
    }

    #[test]
    fn pixel_centres_are_where_the_conventions_put_them() {
        let sensor = Readout::whole(101, 60);
        // The block of columns 4 and 5 and rows 0 to 2 has its centre at 4.5, 1.
        let binned = sensor.binned([2, 3]).unwrap();
        assert_eq!(binned.size(), [50, 20]);
        assert_eq!(binned.on_sensor(Pixel::new(2.0, 0.0)), Pixel::new(4.5, 1.0));
        for u in [-0.5, 0.0, 3.7, 99.5] {
            let seen = binned.in_picture(Pixel::new(u, 0.0)).u;
            assert!((seen - ((u + 0.5) / 2.0 - 0.5)).abs() < 1e-14);
        }
        // The border stays the border.
        assert_eq!(
            binned.in_picture(Pixel::new(-0.5, -0.5)),
            Pixel::new(-0.5, -0.5)
        );
        // Samples 0, 3, ... 99 are 34; the centre of each is the sample's own.
        let sampled = sensor.downsampled([3, 1]).unwrap();
        assert_eq!(sampled.size(), [34, 60]);
        assert_eq!(
            sampled.on_sensor(Pixel::new(33.0, 7.0)),
            Pixel::new(99.0, 7.0)
        );
        assert_eq!(
            sampled.in_picture(Pixel::new(4.0, 7.0)),
            Pixel::new(4.0 / 3.0, 7.0)
        );
        let cut = sensor.cut(part(10, 20, 30, 40)).unwrap();
        assert_eq!(cut.on_sensor(Pixel::new(1.0, 2.0)), Pixel::new(11.0, 22.0));
    }

    /// A part of a reduced picture is the reduction of a part, whichever is asked for first.
    #[test]
    fn readouts_of_readouts() {
        let sensor = Readout::whole(100, 80);
        for reduce in [Readout::binned, Readout::downsampled] {
            let halved = reduce(&sensor, [2, 2]).unwrap();
            let cut = halved.cut(part(5, 6, 11, 12)).unwrap();
            assert_eq!(cut.size(), [11, 12]);
            let pixel = Pixel::new(3.25, 4.5);
            let shifted = Pixel::new(pixel.u + 5.0, pixel.v + 6.0);
            assert_eq!(cut.on_sensor(pixel), halved.on_sensor(shifted));
            let again = reduce(&cut, [3, 1]).unwrap();
            let back = again.in_picture(again.on_sensor(pixel));
            assert!(back.distance(pixel) < 1e-14);
            // Two steps make one of the product.
            let once = reduce(&sensor, [6, 4]).unwrap();
            let twice = reduce(&halved, [3, 2]).unwrap();
            assert_eq!((once, once.size()), (twice, twice.size()));
        }
        assert_eq!(sensor.binned([1, 1]).unwrap(), sensor);
    }

    #[test]
    fn what_the_sensor_does_not_have_is_refused() {
        let sensor = Readout::whole(100, 80);
        let words = |bad: Result<Readout, BadReadout>| bad.unwrap_err().to_string();
        assert_eq!(
            words(sensor.cut(part(90, 0, 11, 80))),
            "found a subframe of 11x80 from column 90 and row 0, expected a part of the 100x80 there are"
        );
        assert!(sensor.cut(part(u32::MAX, 0, 2, 2)).is_err());
        assert!(sensor.cut(part(0, 0, 0, 2)).is_err());
        assert_eq!(
            words(sensor.binned([101, 1])),
            "found 101 by 1, expected whole numbers from 1 to the 100x80 pixels there are"
        );
        assert!(sensor.downsampled([2, 0]).is_err());
        let binned = sensor.binned([2, 2]).unwrap();
        assert_eq!(
            words(binned.downsampled([2, 2])),
            "pictures are binned or downsampled, not both"
        );
    }
}
