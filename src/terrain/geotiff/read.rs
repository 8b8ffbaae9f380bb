//! Reads height models from GeoTIFF files.

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::{PhotometricInterpretation, Tag};
use tiff::{ColorType, TiffError, TiffFormatError};

use crate::error::{Error, Fault, Place};
use crate::terrain::{Affine, HeightGrid, Posts};

use super::keys::{GeoKeys, KeyFault, RASTER_TYPE};
use super::{place, projection};

/// GDAL's tag for scale, offset and the like.
const GDAL_METADATA: Tag = Tag::Unknown(42112);

/// The most posts a file may hold.
const MAX_POSTS: u64 = 1 << 31;

/// No compression packs denser than this (deflate: 1032 to 1), bytes a byte.
const DENSEST: u64 = 1100;

type Reader = Decoder<BufReader<File>>;

/// Reads a height model: the first image of a GeoTIFF, of one band of any sample type, in strips or
/// tiles. Posts are at the centres of the pixels, or at their corners where the file says
/// `PixelIsPoint`; those of the nodata value and those that are no numbers are unknown. Feet
/// become metres, and GDAL's scale and offset are applied. Messages call the file `shown`.
///
/// # Errors
/// [`Error::Io`] where the file cannot be opened, and faults that name what was found and expected
/// where it is no TIFF, has no georeferencing or no usable CRS, or more than one band.
pub fn read_geotiff(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
    let size = file
        .metadata()
        .map_err(|error| Error::io(path, "read", error))?
        .len();
    let place = Place::file(shown);
    Ok(read(BufReader::new(file), size).map_err(|problem| problem.fault(place))?)
}

/// What is wrong, without the file's name.
enum Problem {
    Field(&'static str, String),
    Decoding(TiffError),
}

impl From<TiffError> for Problem {
    fn from(error: TiffError) -> Self {
        Self::Decoding(error)
    }
}

impl From<KeyFault> for Problem {
    fn from(fault: KeyFault) -> Self {
        Self::Field(fault.key, fault.problem)
    }
}

impl Problem {
    fn found(field: &'static str, found: impl std::fmt::Display, expected: &str) -> Self {
        Self::Field(field, format!("found {found}, expected {expected}"))
    }

    fn fault(self, place: Place) -> Fault {
        match self {
            Self::Field(field, problem) => Fault::new(place, field, problem),
            Self::Decoding(TiffError::IoError(error))
                if error.kind() == ErrorKind::UnexpectedEof =>
            {
                Fault::found(place, "", "a file that ends early", "a whole TIFF file")
            }
            Self::Decoding(error) => Fault::new(place, "", format!("cannot be decoded: {error}")),
        }
    }
}

fn read(file: BufReader<File>, size: u64) -> Result<HeightGrid, Problem> {
    let mut reader = Decoder::new(file).map_err(|error| match error {
        TiffError::FormatError(
            TiffFormatError::TiffSignatureNotFound | TiffFormatError::TiffSignatureInvalid,
        ) => Problem::found("", "no TIFF file", "a GeoTIFF height model"),
        other => other.into(),
    })?;
    reader = reader.with_limits(limits());
    let (width, height) = check_image(&mut reader, size)?;
    let keys = geo_keys(&mut reader)?;
    let definition = projection::crs(&keys)?;
    let unit_m = keys.vertical_unit_m()?;
    let is_point = keys.code(RASTER_TYPE) == Some(2);
    let map = crs_from_post(&mut reader, is_point)?;
    let nodata = nodata(&mut reader)?;
    let scaling = scaling(&mut reader);
    let samples = samples(&mut reader, width, height, nodata)?;
    let posts = match (samples, scaling.0 * unit_m, scaling.1 * unit_m) {
        (samples, 1.0, 0.0) => samples,
        (samples, scale, offset) => Posts::F64(
            (0..samples.len())
                .map(|i| samples.get(i) * scale + offset)
                .collect(),
        ),
    };
    if (0..posts.len()).all(|i| posts.get(i).is_nan()) {
        return Err(Problem::found("", "no known height", "some"));
    }
    let grid = HeightGrid::new(width as usize, height as usize, posts, map, definition)
        .map_err(|error| Problem::Field("", error.to_string()))?;
    Ok(grid.with_heights_above(keys.heights_above()))
}

/// One chunk may be as large as a whole file; sizes are checked before anything is read.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::MAX / 2;
    limits.intermediate_buffer_size = usize::MAX / 2;
    limits.ifd_value_size = 1 << 30;
    limits
}

/// Whether the first image can be heights; its width and height.
fn check_image(reader: &mut Reader, size: u64) -> Result<(u32, u32), Problem> {
    let (width, height) = reader.dimensions()?;
    let bands = reader
        .find_tag_unsigned::<u16>(Tag::SamplesPerPixel)?
        .unwrap_or(1);
    if bands != 1 {
        return Err(Problem::found(
            "SamplesPerPixel",
            bands,
            "1, a band of heights",
        ));
    }
    // Uncompressed, LZW, deflate by its two codes, PackBits, Zstandard.
    let compression = reader
        .find_tag_unsigned::<u16>(Tag::Compression)?
        .unwrap_or(1);
    if ![1, 5, 8, 32773, 32946, 50000].contains(&compression) {
        return Err(Problem::found(
            "Compression",
            match compression {
                34887 => "method 34887 (LERC)".to_owned(),
                7 => "method 7 (JPEG)".to_owned(),
                50001 => "method 50001 (WebP)".to_owned(),
                _ => format!("method {compression}"),
            },
            "1 (none), 5 (LZW), 8 (deflate), 32773 (PackBits) or 50000 (Zstandard)",
        ));
    }
    // The decoder would turn the heights upside down.
    let shown = reader.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)?;
    if shown == Some(PhotometricInterpretation::WhiteIsZero.to_u16()) {
        return Err(Problem::found(
            "PhotometricInterpretation",
            "WhiteIsZero",
            "BlackIsZero",
        ));
    }
    let bits = match reader.colortype()? {
        ColorType::Gray(bits) => u64::from(bits),
        other => return Err(Problem::found("", format!("{other:?} samples"), "heights")),
    };
    if bits < 8 {
        return Err(Problem::found("BitsPerSample", bits, "8, 16, 32 or 64"));
    }
    let posts = u64::from(width) * u64::from(height);
    if posts > MAX_POSTS || posts * bits / 8 > size.saturating_mul(DENSEST) + (1 << 28) {
        return Err(Problem::found(
            "",
            format!("{width} x {height} posts in {size} bytes"),
            "as many as the file can hold, and at most 2147483648",
        ));
    }
    Ok((width, height))
}

fn geo_keys(reader: &mut Reader) -> Result<GeoKeys, Problem> {
    let directory = match reader.find_tag(Tag::GeoKeyDirectoryTag)? {
        Some(value) => value.into_u16_vec()?,
        None => Vec::new(),
    };
    if directory.is_empty() {
        return Err(Problem::found(
            "GeoKeyDirectory",
            "none",
            "the keys of a coordinate reference system",
        ));
    }
    let doubles = match reader.find_tag(Tag::GeoDoubleParamsTag)? {
        Some(value) => value.into_f64_vec()?,
        None => Vec::new(),
    };
    let text = match reader.find_tag(Tag::GeoAsciiParamsTag)? {
        Some(value) => value.into_string()?,
        None => String::new(),
    };
    let keys = GeoKeys::parse(&directory, &doubles, &text)?;
    if keys.is_empty() {
        return Err(projection::crs(&keys).err().map_or_else(
            || Problem::found("GeoKeyDirectory", "none", "keys"),
            Problem::from,
        ));
    }
    Ok(keys)
}

fn crs_from_post(reader: &mut Reader, is_point: bool) -> Result<Affine, Problem> {
    let mut doubles = |tag| -> Result<Vec<f64>, Problem> {
        Ok(match reader.find_tag(tag)? {
            Some(value) => value.into_f64_vec()?,
            None => Vec::new(),
        })
    };
    let matrix = doubles(Tag::ModelTransformationTag)?;
    let tie = doubles(Tag::ModelTiepointTag)?;
    let scale = doubles(Tag::ModelPixelScaleTag)?;
    Ok(place::crs_from_post(&matrix, &tie, &scale, is_point)?)
}

fn nodata(reader: &mut Reader) -> Result<Option<f64>, Problem> {
    let Some(value) = reader.find_tag(Tag::GdalNodata)? else {
        return Ok(None);
    };
    let text = value.into_string()?;
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    text.parse()
        .map(Some)
        .map_err(|_| Problem::found("GDAL_NODATA", format!("{text:?}"), "a number"))
}

/// GDAL's scale and offset of the band, `<Item name="SCALE" sample="0" role="scale">0.5</Item>`.
fn scaling(reader: &mut Reader) -> (f64, f64) {
    let text = reader
        .find_tag(GDAL_METADATA)
        .ok()
        .flatten()
        .and_then(|value| value.into_string().ok())
        .unwrap_or_default();
    let role = |role: &str| {
        let item = &text[text.find(&format!("role=\"{role}\""))?..];
        let (_, rest) = item.split_once('>')?;
        rest.split_once('<')?.0.trim().parse::<f64>().ok()
    };
    (role("scale").unwrap_or(1.0), role("offset").unwrap_or(0.0))
}

/// All heights, chunk by chunk; chunks that a sparse file leaves out are unknown.
fn samples(
    reader: &mut Reader,
    width: u32,
    height: u32,
    nodata: Option<f64>,
) -> Result<Posts, Problem> {
    let (chunks, sizes) = match reader.get_chunk_type() {
        ChunkType::Strip => (reader.strip_count()?, Tag::StripByteCounts),
        ChunkType::Tile => (reader.tile_count()?, Tag::TileByteCounts),
    };
    let stored = reader.get_tag_u64_vec(sizes)?;
    let (chunk_width, chunk_height) = reader.chunk_dimensions();
    let across = width.div_ceil(chunk_width.max(1));
    let count = width as usize * height as usize;
    let mut posts: Option<Posts> = None;
    for chunk in 0..chunks {
        if stored.get(chunk as usize) == Some(&0) {
            continue;
        }
        let (columns, rows) = reader.chunk_data_dimensions(chunk);
        let (left, top) = (chunk % across * chunk_width, chunk / across * chunk_height);
        let chunk = heights(reader.read_chunk(chunk)?, nodata);
        if chunk.len() < columns as usize * rows as usize {
            return Err(Problem::found("", "a chunk that ends early", "a whole one"));
        }
        let posts = posts.get_or_insert_with(|| match chunk {
            Posts::F32(_) => Posts::F32(vec![f32::NAN; count]),
            Posts::F64(_) => Posts::F64(vec![f64::NAN; count]),
        });
        for row in 0..rows.min(height.saturating_sub(top)) {
            let target = (top + row) as usize * width as usize + left as usize;
            let source = row as usize * columns as usize;
            let columns = columns.min(width.saturating_sub(left)) as usize;
            match (&mut *posts, &chunk) {
                (Posts::F32(all), Posts::F32(part)) => {
                    all[target..target + columns].copy_from_slice(&part[source..source + columns]);
                }
                (Posts::F64(all), Posts::F64(part)) => {
                    all[target..target + columns].copy_from_slice(&part[source..source + columns]);
                }
                _ => return Err(Problem::found("", "chunks of two sample types", "one")),
            }
        }
    }
    Ok(posts.unwrap_or_else(|| Posts::F32(vec![f32::NAN; count])))
}

/// Samples as heights, unknown where they equal the nodata value in their own type or are not
/// finite.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "nodata is compared as the samples are stored; heights are far below 2^53"
)]
fn heights(samples: DecodingResult, nodata: Option<f64>) -> Posts {
    let single = nodata.map(|nodata| nodata as f32);
    let known_f32 = |h: f32| {
        if h.is_finite() && Some(h) != single {
            h
        } else {
            f32::NAN
        }
    };
    let known = |h: f64| {
        if h.is_finite() && Some(h) != nodata {
            h
        } else {
            f64::NAN
        }
    };
    match samples {
        DecodingResult::U8(all) => {
            Posts::F32(all.into_iter().map(|h| known_f32(h.into())).collect())
        }
        DecodingResult::I8(all) => {
            Posts::F32(all.into_iter().map(|h| known_f32(h.into())).collect())
        }
        DecodingResult::U16(all) => {
            Posts::F32(all.into_iter().map(|h| known_f32(h.into())).collect())
        }
        DecodingResult::I16(all) => {
            Posts::F32(all.into_iter().map(|h| known_f32(h.into())).collect())
        }
        DecodingResult::F16(all) => {
            Posts::F32(all.into_iter().map(|h| known_f32(h.to_f32())).collect())
        }
        DecodingResult::F32(all) => Posts::F32(all.into_iter().map(known_f32).collect()),
        DecodingResult::U32(all) => Posts::F64(all.into_iter().map(|h| known(h.into())).collect()),
        DecodingResult::I32(all) => Posts::F64(all.into_iter().map(|h| known(h.into())).collect()),
        DecodingResult::U64(all) => Posts::F64(all.into_iter().map(|h| known(h as f64)).collect()),
        DecodingResult::I64(all) => Posts::F64(all.into_iter().map(|h| known(h as f64)).collect()),
        DecodingResult::F64(all) => Posts::F64(all.into_iter().map(known).collect()),
    }
}
