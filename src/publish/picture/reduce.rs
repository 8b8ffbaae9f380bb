//! Parts of a picture, made smaller.

use super::Picture;

impl Picture {
    /// A part of the picture, in no more than `side` columns and rows: each pixel is the mean of
    /// those it stands for. `None` where the part leaves the picture or is empty.
    pub fn reduced(
        &self,
        column: u32,
        row: u32,
        width: u32,
        height: u32,
        side: u32,
    ) -> Option<Self> {
        let fits = |start: u32, length: u32, end: u32| {
            length > 0 && start.checked_add(length).is_some_and(|stop| stop <= end)
        };
        if !(fits(column, width, self.width) && fits(row, height, self.height)) || side == 0 {
            return None;
        }
        let longest = width.max(height).max(side);
        let shorter = |length: u32| {
            let scaled = u64::from(length) * u64::from(side) / u64::from(longest);
            u32::try_from(scaled).unwrap_or(side).max(1)
        };
        let (columns, rows) = (shorter(width), shorter(height));
        let span = |i: u32, of: u32, length: u32, start: u32| {
            let edge = |i: u32| {
                let at = u64::from(i) * u64::from(length) / u64::from(of);
                start + u32::try_from(at).unwrap_or(length)
            };
            edge(i)..edge(i + 1)
        };
        Self::from_fn(columns, rows, |x, y| {
            let mut sum = [0_u64; 3];
            let mut count = 0;
            for v in span(y, rows, height, row) {
                for u in span(x, columns, width, column) {
                    let colour = self.colour(u, v).unwrap_or_default();
                    for (sum, sample) in sum.iter_mut().zip(colour) {
                        *sum += u64::from(sample);
                    }
                    count += 1;
                }
            }
            sum.map(|s| u8::try_from((s + count / 2) / count.max(1)).unwrap_or(u8::MAX))
        })
        .ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_means_of_those_they_stand_for() {
        let tens = |i: u32| u8::try_from(10 * i).unwrap();
        let picture = Picture::from_fn(8, 4, |x, y| [tens(x), tens(y), 7]).unwrap();
        let half = picture.reduced(0, 0, 8, 4, 4).unwrap();
        assert_eq!((half.width(), half.height()), (4, 2));
        assert_eq!(half.colour(0, 0), Some([5, 5, 7]));
        assert_eq!(half.colour(3, 1), Some([65, 25, 7]));
        let same = picture.reduced(5, 1, 2, 3, 100).unwrap();
        assert_eq!((same.width(), same.height()), (2, 3));
        assert_eq!(same.colour(1, 2), picture.colour(6, 3));
        assert!(picture.reduced(7, 0, 2, 1, 4).is_none());
        assert!(picture.reduced(0, 0, 0, 1, 4).is_none());
    }
}
