//! The samples of a plain image.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::Problem;
use crate::error::Error;
use crate::terrain::Posts;

/// No height or radius in metres or kilometres is beyond this; what is stands for nothing, as the
/// largest single number does in many files.
const BEYOND_ALL: f64 = 1e30;

/// The most posts a file may hold.
const MAX_POSTS: u64 = 1 << 31;

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampleType {
    pub kind: Kind,
    pub bytes: usize,
    pub is_little_endian: bool,
}

/// What kind of numbers samples are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Signed,
    Unsigned,
    Real,
}

/// Where the samples of an image stand, and how they become heights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Image {
    pub columns: usize,
    pub rows: usize,
    /// Bytes before the first row.
    pub offset: u64,
    pub sample: SampleType,
    /// Bytes around the samples of a row.
    pub prefix: u64,
    pub suffix: u64,
    /// A height in metres is `scale` times the sample plus `shift`.
    pub scale: f64,
    pub shift: f64,
    /// Samples that stand for nothing, as stored.
    pub unknown: Vec<f64>,
}

impl Image {
    /// The heights, row by row, NaN where unknown.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be read; a problem where it is shorter than the label says.
    pub fn read(&self, path: &Path) -> Result<Result<Posts, Problem>, Error> {
        let io = |error| Error::io(path, "read", error);
        let mut file = File::open(path).map_err(io)?;
        let size = file.metadata().map_err(io)?.len();
        let row_bytes = self.columns as u64 * self.sample.bytes as u64;
        let pitch = row_bytes + self.prefix + self.suffix;
        let end = (self.rows as u64)
            .checked_mul(pitch)
            .and_then(|bytes| bytes.checked_add(self.offset));
        let posts = (self.columns as u64).saturating_mul(self.rows as u64);
        if posts > MAX_POSTS || end.is_none_or(|end| end > size + self.suffix) {
            let found = format!("{} x {} posts in {size} bytes", self.columns, self.rows);
            let expected = "as many as the file holds, and at most 2147483648";
            return Ok(Err(Problem::found("", found, expected)));
        }
        let mut heights = Vec::with_capacity(self.columns * self.rows);
        let mut row = vec![0; self.columns * self.sample.bytes];
        for index in 0..self.rows as u64 {
            let start = self.offset + index * pitch + self.prefix;
            file.seek(SeekFrom::Start(start)).map_err(io)?;
            file.read_exact(&mut row).map_err(io)?;
            heights.extend(row.chunks_exact(self.sample.bytes).map(|b| self.height(b)));
        }
        if heights.iter().all(|h| h.is_nan()) {
            return Ok(Err(Problem::found("", "no known height", "some")));
        }
        Ok(Ok(Posts::F64(heights)))
    }

    fn height(&self, bytes: &[u8]) -> f64 {
        let sample = self.sample.value(bytes);
        let is_unknown = |&unknown: &f64| self.sample.rounded(unknown) == sample;
        let known = sample.abs() < BEYOND_ALL && !self.unknown.iter().any(is_unknown);
        if known {
            sample * self.scale + self.shift
        } else {
            f64::NAN
        }
    }
}

impl SampleType {
    /// A number as a sample of this type holds it: labels give `-9999.99` for the nearest single.
    #[expect(clippy::cast_possible_truncation, reason = "rounding is meant")]
    fn rounded(self, number: f64) -> f64 {
        match (self.kind, self.bytes) {
            (Kind::Real, 4) => f64::from(number as f32),
            _ => number,
        }
    }

    /// The number in a sample's bytes.
    #[expect(clippy::cast_precision_loss, reason = "heights are far below 2^53")]
    fn value(self, bytes: &[u8]) -> f64 {
        let mut padded = [0u8; 8];
        for (i, &byte) in bytes.iter().take(8).enumerate() {
            let place = if self.is_little_endian {
                i
            } else {
                self.bytes - 1 - i
            };
            padded[place] = byte;
        }
        let bits = u64::from_le_bytes(padded);
        match (self.kind, self.bytes) {
            (Kind::Real, 8) => f64::from_bits(bits),
            #[expect(clippy::cast_possible_truncation, reason = "four bytes were read")]
            (Kind::Real, _) => f64::from(f32::from_bits(bits as u32)),
            (Kind::Unsigned, _) => bits as f64,
            (Kind::Signed, bytes) => {
                // Shifted up and down again, so that the sign spreads.
                let unused = 64 - 8 * bytes;
                (bits.cast_signed() << unused >> unused) as f64
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_all_kinds_are_read() {
        let value = |kind, is_little_endian, bytes: &[u8]| {
            let sample = SampleType {
                kind,
                bytes: bytes.len(),
                is_little_endian,
            };
            sample.value(bytes)
        };
        assert_eq!(value(Kind::Unsigned, true, &[200]), 200.0);
        assert_eq!(value(Kind::Signed, true, &(-3i8).to_le_bytes()), -3.0);
        assert_eq!(
            value(Kind::Signed, false, &(-4321i16).to_be_bytes()),
            -4321.0
        );
        assert_eq!(
            value(Kind::Unsigned, false, &54_321u16.to_be_bytes()),
            54_321.0
        );
        assert_eq!(
            value(Kind::Signed, true, &(-70_000i32).to_le_bytes()),
            -70_000.0
        );
        assert_eq!(value(Kind::Signed, false, &(-7i64).to_be_bytes()), -7.0);
        assert_eq!(value(Kind::Real, false, &1.5f32.to_be_bytes()), 1.5);
        assert_eq!(value(Kind::Real, true, &(-2.25f64).to_le_bytes()), -2.25);
    }
}
