//! Pictures: read from JPEG, PNG and TIFF, written as any of them, compared.
//!
//! A picture is held as its raw raster. The orientation tag of EXIF is **not** applied: pixel
//! coordinates of detections and camera models are those of the raster as it was stored, and a
//! picture that is written again carries the tag on, so that a viewer turns both alike.

mod difference;
mod exif;
mod jpeg;
mod metadata;
mod raster;
mod reduce;

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::Path;

use serde::Serialize;
use turbojpeg::Subsamp;

use crate::error::{Error, Fault, Place};
use metadata::Metadata;

pub use difference::perceptual_difference;

/// A colour picture of 8 bits a sample.
///
/// Every pixel takes four bytes, red, green, blue and 255: a renderer can draw on it in place and
/// the JPEG library can decode into it and encode from it without a conversion.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    rgba: Vec<u8>,
    /// What belongs to any copy of the source: EXIF, XMP, colour profile.
    metadata: Metadata,
    /// How coarsely the source JPEG had its colour, so that a copy has it as finely.
    colour: Subsamp,
}

/// The kinds of files that pictures are read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// JPEG (ISO/IEC 10918-1), grey, colour or the CMYK of Adobe, 8 bits.
    Jpeg,
    /// PNG, 8 bits, or 16 bits that are stretched.
    Png,
    /// TIFF, 8 bits, or 16 bits that are stretched; the first picture of the file.
    Tiff,
}

/// Why bytes are not a picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PictureError {
    /// Neither of the formats, by the signature at its start.
    #[error("found {}, expected a JPEG, PNG or TIFF picture", start_of(.0))]
    NotAPicture(
        /// The first bytes, four at most.
        Vec<u8>,
    ),
    /// The start of a picture without its end.
    #[error("found a {0} picture that ends early, expected a whole one")]
    EndsEarly(
        /// What it would have been.
        Format,
    ),
    /// A damaged picture, or one of a kind that is not read.
    #[error("found a {format} picture that cannot be decoded ({why}), expected a sound one")]
    Unreadable {
        /// What it claims to be.
        format: Format,
        /// What the decoder said.
        why: String,
    },
    /// More pixels than [`Picture::MAX_PIXELS`], or none.
    #[error(
        "found {width} x {height} pixels, expected 1 to {}",
        Picture::MAX_PIXELS
    )]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl Picture {
    /// The most pixels a picture may have: a header that claims more is taken for damage.
    pub const MAX_PIXELS: u64 = 1 << 28;
    /// The JPEG quality that pictures are written in unless another is asked for.
    pub const JPEG_QUALITY: u8 = 90;

    /// A picture of one colour (red, green, blue).
    ///
    /// # Errors
    /// [`PictureError::Size`].
    pub fn of_colour(width: u32, height: u32, [r, g, b]: [u8; 3]) -> Result<Self, PictureError> {
        let count = pixel_count(width, height)?;
        Ok(Self::from_parts(
            width,
            height,
            [r, g, b, 255].repeat(count),
        ))
    }

    /// A picture whose colour at column and row is `colour(column, row)`.
    ///
    /// # Errors
    /// [`PictureError::Size`].
    pub fn from_fn(
        width: u32,
        height: u32,
        mut colour: impl FnMut(u32, u32) -> [u8; 3],
    ) -> Result<Self, PictureError> {
        let mut rgba = Vec::with_capacity(pixel_count(width, height)? * 4);
        for row in 0..height {
            for column in 0..width {
                rgba.extend_from_slice(&colour(column, row));
                rgba.push(255);
            }
        }
        Ok(Self::from_parts(width, height, rgba))
    }

    /// Reads a picture file. `shown` is the name faults call it by.
    ///
    /// Transparency is dropped: the colours stand as they are stored. Samples of 16 bits are
    /// stretched linearly to 8, so that the 0.5th percentile of all colour samples becomes 0 and
    /// the 99.5th becomes 255.
    ///
    /// # Errors
    /// A file that cannot be read; a [`PictureError`] as a fault of the file.
    pub fn read(path: &Path, shown: &str) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
        Self::decode(&bytes).map_err(|e| fault(shown, &e))
    }

    /// A picture from the bytes of a file, as [`Picture::read`].
    ///
    /// # Errors
    /// Any [`PictureError`].
    pub fn decode(bytes: &[u8]) -> Result<Self, PictureError> {
        match Format::of(bytes)? {
            Format::Jpeg => jpeg::decode(bytes),
            format => raster::decode(bytes, format),
        }
    }

    /// Columns and rows of a picture file, from its header alone.
    ///
    /// # Errors
    /// As [`Picture::read`].
    pub fn size_of(path: &Path, shown: &str) -> Result<(u32, u32), Error> {
        let mut file = BufReader::new(File::open(path).map_err(|e| Error::io(path, "read", e))?);
        let mut signature = Vec::new();
        (&mut file)
            .take(8)
            .read_to_end(&mut signature)
            .map_err(|e| Error::io(path, "read", e))?;
        let size = match Format::of(&signature) {
            Ok(Format::Jpeg) => jpeg::size(&mut file),
            Ok(format) => raster::size(&mut file, format),
            Err(error) => Err(error),
        };
        size.map_err(|e| fault(shown, &e))
    }

    /// Writes a JPEG (`.jpg`, `.jpeg`) of quality 1 to 100, a PNG (`.png`) or a TIFF (`.tif`, `.tiff`).
    ///
    /// A JPEG has its colour at the resolution of the JPEG it was read from, at full resolution (4:4:4) where
    /// there was none or that was grey, and carries its EXIF, XMP and ICC segments; a PNG carries EXIF. The file is
    /// written under a temporary name beside `path` and renamed, so it is there whole or not at
    /// all. The same picture gives the same bytes.
    ///
    /// # Errors
    /// Another extension, a folder that cannot be written to.
    pub fn write(&self, path: &Path, quality: u8) -> Result<(), Error> {
        let Some(format) = Format::by_name(path) else {
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
            return Err(Error::Output(format!(
                "{}: found extension {extension:?}, expected jpg, jpeg, png, tif or tiff",
                path.display()
            )));
        };
        let bytes = self
            .encode(format, quality)
            .map_err(|why| Error::Output(format!("{}: {why}", path.display())))?;
        write_whole(path, &bytes).map_err(|e| Error::io(path, "write", e))
    }

    /// The bytes of a file of this format, as [`Picture::write`].
    ///
    /// # Errors
    /// The encoder's words.
    pub fn encode(&self, format: Format, quality: u8) -> Result<Vec<u8>, String> {
        match format {
            Format::Jpeg => self.to_jpeg(quality),
            Format::Png => self.to_png(),
            Format::Tiff => raster::encode_tiff(self),
        }
    }

    /// This picture and another at its right, white of `gap` columns between them and below the
    /// lower of the two. Metadata and colour resolution are those of this one.
    ///
    /// # Errors
    /// [`PictureError::Size`].
    pub fn beside(&self, right: &Self, gap: u32) -> Result<Self, PictureError> {
        let height = self.height.max(right.height);
        let width = u64::from(self.width) + u64::from(gap) + u64::from(right.width);
        let width = u32::try_from(width).unwrap_or(u32::MAX);
        let mut joined = Self::of_colour(width, height, [255; 3])?;
        let row_bytes = width as usize * 4;
        for (picture, column) in [(self, 0), (right, self.width as usize + gap as usize)] {
            let bytes = picture.width as usize * 4;
            let rows = picture.rgba.chunks_exact(bytes);
            for (row, onto) in rows.zip(joined.rgba.chunks_exact_mut(row_bytes)) {
                onto[column * 4..column * 4 + bytes].copy_from_slice(row);
            }
        }
        joined.metadata.clone_from(&self.metadata);
        joined.colour = self.colour;
        Ok(joined)
    }

    /// The bytes of a JPEG file of this quality (1 to 100, clamped), as [`Picture::write`].
    ///
    /// # Errors
    /// The encoder's words: a side of more than 65,500 pixels.
    pub fn to_jpeg(&self, quality: u8) -> Result<Vec<u8>, String> {
        jpeg::encode(self, quality)
    }

    /// The bytes of the smallest JPEG file of this quality (1 to 100, clamped): colour at half the
    /// resolution, no metadata.
    ///
    /// # Errors
    /// As [`Picture::to_jpeg`].
    pub fn to_small_jpeg(&self, quality: u8) -> Result<Vec<u8>, String> {
        jpeg::encode_small(self, quality)
    }

    /// The bytes of a PNG file, 8-bit RGB.
    ///
    /// # Errors
    /// The encoder's words.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        raster::encode_png(self)
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Red, green and blue at a column and row, or `None` outside.
    pub fn colour(&self, column: u32, row: u32) -> Option<[u8; 3]> {
        if column >= self.width || row >= self.height {
            return None;
        }
        let at = (row as usize * self.width as usize + column as usize) * 4;
        let pixel = self.rgba.get(at..at + 3)?;
        Some([pixel[0], pixel[1], pixel[2]])
    }

    /// The raster: rows from the top, four bytes a pixel, red, green, blue, 255.
    pub fn rgba(&self) -> &[u8] {
        &self.rgba
    }

    /// The raster to draw on; whoever draws keeps every fourth byte at 255.
    pub(super) fn rgba_mut(&mut self) -> &mut [u8] {
        &mut self.rgba
    }

    /// From a raster whose length fits.
    fn from_parts(width: u32, height: u32, rgba: Vec<u8>) -> Self {
        Self {
            width,
            height,
            rgba,
            metadata: Metadata::default(),
            colour: Subsamp::None,
        }
    }
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture({} x {})", self.width, self.height)
    }
}

impl Format {
    /// The format that a file's extension names.
    pub fn by_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "png" => Some(Self::Png),
            "tif" | "tiff" => Some(Self::Tiff),
            _ => None,
        }
    }

    /// The extension of files of this format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Jpeg => "jpg",
            Self::Png => "png",
            Self::Tiff => "tif",
        }
    }

    /// The format that the first bytes of a file announce.
    ///
    /// # Errors
    /// [`PictureError::NotAPicture`].
    pub fn of(start: &[u8]) -> Result<Self, PictureError> {
        match start {
            [0xff, 0xd8, 0xff, ..] => Ok(Self::Jpeg),
            [0x89, b'P', b'N', b'G', ..] => Ok(Self::Png),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Ok(Self::Tiff),
            _ => Err(PictureError::NotAPicture(
                start.iter().copied().take(4).collect(),
            )),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Jpeg => "JPEG",
            Self::Png => "PNG",
            Self::Tiff => "TIFF",
        })
    }
}

/// The number of pixels, if a picture may have so many.
fn pixel_count(width: u32, height: u32) -> Result<usize, PictureError> {
    let count = u64::from(width) * u64::from(height);
    match usize::try_from(count) {
        Ok(count_here) if (1..=Picture::MAX_PIXELS).contains(&count) => Ok(count_here),
        _ => Err(PictureError::Size { width, height }),
    }
}

fn start_of(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "an empty file".to_owned();
    }
    let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("a file that starts with the bytes {}", hex.join(" "))
}

fn fault(shown: &str, error: &PictureError) -> Error {
    Fault::new(Place::file(shown), "", error.to_string()).into()
}

fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let unfinished = path.with_file_name(format!(".{name}.unfinished"));
    let written = File::create(&unfinished)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| std::fs::rename(&unfinished, path));
    if written.is_err() {
        // The reason that matters is why it was not written; a failure to tidy up adds nothing.
        let _ = std::fs::remove_file(&unfinished);
    }
    written
}

#[cfg(test)]
mod tests;
