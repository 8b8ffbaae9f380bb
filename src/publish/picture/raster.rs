//! PNG and TIFF by the image crate, and 16 bits made 8.

use std::error::Error as _;
use std::io::{BufRead, Cursor, ErrorKind, Read, Seek, SeekFrom};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::error::UnsupportedErrorKind;
use image::{
    DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageFormat,
    ImageReader,
};
use tiff::TiffResult;
use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder};

use super::metadata::Metadata;
use super::{Format, Picture, PictureError, pixel_count};

/// The bytes of a PNG's signature and its header chunk.
const PNG_HEADER: usize = 33;

/// The shares of all samples that a stretch sends to black and to white, per cent of two hundred.
const BLACK_PER_200: u64 = 1;
const WHITE_PER_200: u64 = 199;

/// Decodes a PNG or TIFF.
pub(super) fn decode(bytes: &[u8], format: Format) -> Result<Picture, PictureError> {
    let (width, height) = size(&mut Cursor::new(bytes), format)?;
    pixel_count(width, height)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), kind(format));
    reader.no_limits();
    let mut decoder = reader.into_decoder().map_err(|e| problem(&e, format))?;
    let metadata = match format {
        Format::Tiff => Metadata::of_tiff(bytes),
        _ => png_metadata(&mut decoder),
    };
    let image = DynamicImage::from_decoder(decoder).map_err(|e| problem(&e, format))?;
    let image = match image {
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => stretched_grey(&image),
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => stretched_colour(&image),
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            return Err(PictureError::Unreadable {
                format,
                why: "samples of 32 bits".to_owned(),
            });
        }
        eight_bits => eight_bits,
    };
    let mut rgba = image.into_rgba8().into_raw();
    for pixel in rgba.chunks_exact_mut(4) {
        pixel[3] = 255;
    }
    let mut picture = Picture::from_parts(width, height, rgba);
    picture.metadata = metadata;
    Ok(picture)
}

/// Columns and rows from the header; the start of the file may have been read already.
pub(super) fn size<R: BufRead + Seek>(
    file: &mut R,
    format: Format,
) -> Result<(u32, u32), PictureError> {
    file.seek(SeekFrom::Start(0))
        .map_err(|e| problem(&ImageError::IoError(e), format))?;
    let (width, height) = match format {
        Format::Png => png_size(file),
        _ => tiff_size(file),
    }?;
    pixel_count(width, height).map(|_| (width, height))
}

/// The bytes of an 8-bit RGB PNG.
pub(super) fn encode_png(picture: &Picture) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    if let Some(exif) = picture.metadata.exif() {
        encoder
            .set_exif_metadata(exif.to_vec())
            .map_err(|e| e.to_string())?;
    }
    if let Some(profile) = picture.metadata.icc() {
        encoder
            .set_icc_profile(profile.to_vec())
            .map_err(|e| e.to_string())?;
    }
    let (width, height) = (picture.width, picture.height);
    encoder
        .write_image(&rgb(picture), width, height, ExtendedColorType::Rgb8)
        .map_err(|e| e.to_string())?;
    if let Some(packet) = picture.metadata.xmp_text() {
        let chunk = xmp_chunk(packet).ok_or("XMP of more than four gigabytes")?;
        bytes.splice(PNG_HEADER..PNG_HEADER, chunk);
    }
    Ok(bytes)
}

/// The bytes of an 8-bit RGB TIFF, deflated.
pub(super) fn encode_tiff(picture: &Picture) -> Result<Vec<u8>, String> {
    tiff_file(picture).map_err(|e| e.to_string())
}

fn tiff_file(picture: &Picture) -> TiffResult<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let mut file = TiffEncoder::new(&mut bytes)?
        .with_compression(Compression::Deflate(DeflateLevel::Fast))
        .with_predictor(Predictor::Horizontal);
    let size = (picture.width, picture.height);
    let image = picture.metadata.begin_tiff(&mut file, size)?;
    image.write_data(&rgb(picture))?;
    Ok(bytes.into_inner())
}

/// What a PNG says beside its pixels, ahead of them; a part that cannot be read is not there.
fn png_metadata(decoder: &mut impl ImageDecoder) -> Metadata {
    let exif = decoder.exif_metadata().ok().flatten();
    let xmp = decoder.xmp_metadata().ok().flatten();
    let icc = decoder.icc_profile().ok().flatten();
    Metadata::new(exif, xmp, icc)
}

/// An XMP packet as the chunk of a PNG: XMP specification, part 3, 1.1.5; PNG specification, 5.3
/// and 11.3.3.4.
fn xmp_chunk(packet: &str) -> Option<Vec<u8>> {
    // Neither compressed nor in a language nor with a name in one.
    let content = [b"iTXtXML:com.adobe.xmp\0\0\0\0\0", packet.as_bytes()].concat();
    let length = u32::try_from(content.len() - 4).ok()?;
    let mut check = flate2::Crc::new();
    check.update(&content);
    let parts = [
        &length.to_be_bytes(),
        content.as_slice(),
        &check.sum().to_be_bytes(),
    ];
    Some(parts.concat())
}

fn rgb(picture: &Picture) -> Vec<u8> {
    let pixels = picture.rgba.chunks_exact(4);
    pixels
        .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
        .collect()
}

/// The PNG specification, 5.2 and 11.2.1: signature, chunk length and name, then both sides.
fn png_size(file: &mut impl Read) -> Result<(u32, u32), PictureError> {
    let mut header = [0; 24];
    file.read_exact(&mut header)
        .map_err(|e| problem(&ImageError::IoError(e), Format::Png))?;
    if header[..8] != *b"\x89PNG\r\n\x1a\n" || header[12..16] != *b"IHDR" {
        return Err(PictureError::Unreadable {
            format: Format::Png,
            why: "no header".to_owned(),
        });
    }
    let side = |at: usize| {
        u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
    };
    Ok((side(16), side(20)))
}

fn tiff_size<R: Read + Seek>(file: &mut R) -> Result<(u32, u32), PictureError> {
    let header = tiff::decoder::Decoder::new(file).and_then(|mut decoder| decoder.dimensions());
    header.map_err(|error| match error {
        tiff::TiffError::IoError(e) => problem(&ImageError::IoError(e), Format::Tiff),
        other => PictureError::Unreadable {
            format: Format::Tiff,
            why: other.to_string(),
        },
    })
}

fn stretched_grey(image: &DynamicImage) -> DynamicImage {
    let samples = image.to_luma16();
    let table = stretch(samples.as_raw());
    DynamicImage::ImageLuma8(image::GrayImage::from_fn(
        samples.width(),
        samples.height(),
        |x, y| image::Luma([table[usize::from(samples.get_pixel(x, y)[0])]]),
    ))
}

/// All channels share one stretch, which keeps the hues.
fn stretched_colour(image: &DynamicImage) -> DynamicImage {
    let samples = image.to_rgb16();
    let table = stretch(samples.as_raw());
    DynamicImage::ImageRgb8(image::RgbImage::from_fn(
        samples.width(),
        samples.height(),
        |x, y| image::Rgb(samples.get_pixel(x, y).0.map(|v| table[usize::from(v)])),
    ))
}

/// For each 16-bit value its 8-bit one: linear between the 0.5th and the 99.5th percentile, and a
/// picture of one value becomes black.
fn stretch(samples: &[u16]) -> Vec<u8> {
    let mut histogram = vec![0u64; 1 << 16];
    for &sample in samples {
        histogram[usize::from(sample)] += 1;
    }
    let low = percentile(&histogram, samples.len() as u64 * BLACK_PER_200);
    let high = percentile(&histogram, samples.len() as u64 * WHITE_PER_200);
    let span = u32::from(high - low).max(1);
    (0..=u16::MAX)
        .map(|value| {
            let above = u32::from(value.clamp(low, high) - low);
            u8::try_from((above * 255 + span / 2) / span).unwrap_or(u8::MAX)
        })
        .collect()
}

/// The smallest value that at least `rank / 200` samples do not exceed.
fn percentile(histogram: &[u64], rank: u64) -> u16 {
    let mut so_far = 0;
    for (value, &count) in (0..=u16::MAX).zip(histogram) {
        so_far += count;
        if so_far > 0 && so_far * 200 >= rank {
            return value;
        }
    }
    u16::MAX
}

fn kind(format: Format) -> ImageFormat {
    match format {
        Format::Jpeg => ImageFormat::Jpeg,
        Format::Png => ImageFormat::Png,
        Format::Tiff => ImageFormat::Tiff,
    }
}

fn problem(error: &ImageError, format: Format) -> PictureError {
    if ends_early(error) {
        return PictureError::EndsEarly(format);
    }
    let kind = match error {
        ImageError::Unsupported(e) => Some(e.kind()),
        _ => None,
    };
    let why = match kind {
        Some(UnsupportedErrorKind::Color(ExtendedColorType::Unknown(bits))) => {
            format!("pixels of {bits} bits of a kind that is not read")
        }
        Some(UnsupportedErrorKind::GenericFeature(what)) => what,
        _ => error.source().map_or(error.to_string(), |e| e.to_string()),
    };
    PictureError::Unreadable { format, why }
}

/// Whether a read past the end lies at the bottom of the error.
fn ends_early(error: &ImageError) -> bool {
    if let ImageError::IoError(e) = error {
        return e.kind() == ErrorKind::UnexpectedEof;
    }
    let mut cause = error.source();
    while let Some(error) = cause {
        let by_kind = error
            .downcast_ref::<std::io::Error>()
            .is_some_and(|e| e.kind() == ErrorKind::UnexpectedEof);
        if by_kind || error.to_string().contains("unexpected end of") {
            return true;
        }
        cause = error.source();
    }
    false
}
