//! JPEG by libjpeg-turbo, and the segments around its picture.

use std::io::{BufRead, Cursor, ErrorKind, Read, Seek, SeekFrom};

use turbojpeg::{Compressor, Decompressor, Image, PixelFormat, Subsamp};

use super::metadata::Metadata;
use super::{Format, Picture, PictureError, pixel_count};

/// Marker codes of ISO/IEC 10918-1, table B.1.
const START_OF_SCAN: u8 = 0xda;
const END_OF_IMAGE: u8 = 0xd9;
const APP0: u8 = 0xe0;
const APP14: u8 = 0xee;
const APP15: u8 = 0xef;

/// What libjpeg complains of in files that decode as they should.
const HARMLESS: [&str; 4] = [
    "extraneous bytes before marker",
    "unknown JFIF revision",
    "Unknown Adobe color transform",
    "Invalid SOS parameters",
];

/// Decodes a grey or colour JPEG, in printing colours or not.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, PictureError> {
    let frame = frame(&mut Cursor::new(bytes))?;
    let (width, height, is_print) = (frame.width, frame.height, frame.n_components == 4);
    if is_print && !is_adobe(bytes) {
        return Err(unsound(
            "CMYK without Adobe's segment, by which 0 is all ink",
        ));
    }
    let mut rgba = vec![0; pixel_count(width, height)? * 4];
    let mut decompressor = Decompressor::new().map_err(|e| problem(&e))?;
    let decoded = decompressor.decompress(
        bytes,
        Image {
            pixels: rgba.as_mut_slice(),
            width: width as usize,
            pitch: width as usize * 4,
            height: height as usize,
            format: if is_print {
                PixelFormat::CMYK
            } else {
                PixelFormat::RGBA
            },
        },
    );
    match decoded {
        Err(error) if !is_harmless(&error) => return Err(problem(&error)),
        _ => {}
    }
    if is_print {
        light_of_inks(&mut rgba);
    }
    let mut picture = Picture::from_parts(width, height, rgba);
    picture.metadata = metadata(bytes);
    picture.colour = match decompressor.read_header(bytes).map(|header| header.subsamp) {
        // What is drawn on a grey picture is in colour.
        Ok(Subsamp::Gray) | Err(_) => Subsamp::None,
        Ok(known) => known,
    };
    Ok(picture)
}

/// Whether an Adobe program, or one that does alike, wrote the file: inks then count from 255 for
/// none to 0 for all (Adobe Technical Note 5116).
fn is_adobe(bytes: &[u8]) -> bool {
    Segments::new(bytes)
        .any(|s| s.marker == APP14 && bytes[s.start + 4..s.end].starts_with(b"Adobe"))
}

/// Red, green and blue of cyan, magenta, yellow and black by Adobe's count: the light that the ink
/// of one colour lets through, less what the black one takes. What the inks of some press would look
/// like, which a profile would say, is not asked.
fn light_of_inks(pixels: &mut [u8]) {
    for pixel in pixels.chunks_exact_mut(4) {
        let black = u32::from(pixel[3]);
        for ink in &mut pixel[..3] {
            *ink = u8::try_from((u32::from(*ink) * black + 127) / 255).unwrap_or(u8::MAX);
        }
        pixel[3] = 255;
    }
}

/// Encodes with colour as fine as in the source, and with the metadata after the JFIF header.
pub(super) fn encode(picture: &Picture, quality: u8) -> Result<Vec<u8>, String> {
    let plain = compress(picture, quality, picture.colour, false)?;
    let body = Segments::new(&plain)
        .take_while(|segment| segment.marker == APP0)
        .last()
        .map_or(2, |segment| segment.end);
    let segments = picture.metadata.segments();
    if segments.is_empty() {
        return Ok(plain);
    }
    let extra: usize = segments.iter().map(|(_, content)| content.len() + 4).sum();
    let mut bytes = Vec::with_capacity(plain.len() + extra);
    bytes.extend_from_slice(&plain[..body]);
    for (number, content) in &segments {
        let length = u16::try_from(content.len() + 2).map_err(|e| e.to_string())?;
        bytes.extend([0xff, APP0 + number]);
        bytes.extend(length.to_be_bytes());
        bytes.extend_from_slice(content);
    }
    bytes.extend_from_slice(&plain[body..]);
    Ok(bytes)
}

/// Encodes in 4:2:0 with Huffman tables of its own, without metadata.
pub(super) fn encode_small(picture: &Picture, quality: u8) -> Result<Vec<u8>, String> {
    compress(picture, quality, Subsamp::Sub2x2, true)
}

fn compress(
    picture: &Picture,
    quality: u8,
    subsamp: Subsamp,
    is_optimized: bool,
) -> Result<Vec<u8>, String> {
    let words = |error: turbojpeg::Error| message(&error);
    let mut compressor = Compressor::new().map_err(words)?;
    compressor
        .set_quality(i32::from(quality.clamp(1, 100)))
        .map_err(words)?;
    compressor.set_subsamp(subsamp).map_err(words)?;
    compressor.set_optimize(is_optimized).map_err(words)?;
    let width = picture.width as usize;
    let image = Image {
        pixels: picture.rgba.as_slice(),
        width,
        pitch: width * 4,
        height: picture.height as usize,
        format: PixelFormat::RGBX,
    };
    let bytes = compressor.compress_to_owned(image).map_err(words)?;
    Ok(bytes.to_vec())
}

/// Columns and rows from the frame header, reading no further.
pub(super) fn size<R: BufRead + Seek>(file: &mut R) -> Result<(u32, u32), PictureError> {
    frame(file).map(|frame| (frame.width, frame.height))
}

/// What a frame header says.
struct Frame {
    width: u32,
    height: u32,
    /// One of grey, three of colour, four of CMYK.
    n_components: u8,
}

/// The frame header, reading no further.
fn frame<R: BufRead + Seek>(file: &mut R) -> Result<Frame, PictureError> {
    let early = |error: std::io::Error| match error.kind() {
        ErrorKind::UnexpectedEof => PictureError::EndsEarly(Format::Jpeg),
        _ => unsound(&error.to_string()),
    };
    file.seek(SeekFrom::Start(2)).map_err(early)?;
    loop {
        let mut byte = [0];
        file.read_exact(&mut byte).map_err(early)?;
        if byte[0] != 0xff {
            return Err(unsound("a segment without a marker"));
        }
        while byte[0] == 0xff {
            file.read_exact(&mut byte).map_err(early)?;
        }
        match byte[0] {
            // Markers that stand alone.
            0x01 | 0xd0..=0xd8 => {}
            // SOF0 to SOF15, without DHT, JPG and DAC, which share their range.
            0xc0..=0xcf if !matches!(byte[0], 0xc4 | 0xc8 | 0xcc) => {
                let mut frame = [0; 8];
                file.read_exact(&mut frame).map_err(early)?;
                let height = u32::from(u16::from_be_bytes([frame[3], frame[4]]));
                let width = u32::from(u16::from_be_bytes([frame[5], frame[6]]));
                return pixel_count(width, height).map(|_| Frame {
                    width,
                    height,
                    n_components: frame[7],
                });
            }
            START_OF_SCAN | END_OF_IMAGE => return Err(unsound("no frame header")),
            _ => {
                let mut length = [0; 2];
                file.read_exact(&mut length).map_err(early)?;
                let content = u64::from(u16::from_be_bytes(length)).saturating_sub(2);
                let skipped = std::io::copy(&mut file.take(content), &mut std::io::sink());
                if skipped.map_err(early)? < content {
                    return Err(PictureError::EndsEarly(Format::Jpeg));
                }
            }
        }
    }
}

/// What the segments for applications hold.
fn metadata(bytes: &[u8]) -> Metadata {
    let segments = Segments::new(bytes).filter(|s| (APP0..=APP15).contains(&s.marker));
    Metadata::of_jpeg(segments.map(|segment| &bytes[segment.start + 4..segment.end]))
}

/// One marker segment: from its 0xff to the end of its content.
struct Segment {
    marker: u8,
    start: usize,
    end: usize,
}

/// The segments before the first scan.
struct Segments<'a> {
    bytes: &'a [u8],
    next: usize,
}

impl<'a> Segments<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, next: 2 }
    }
}

impl Iterator for Segments<'_> {
    type Item = Segment;

    fn next(&mut self) -> Option<Segment> {
        let mut start = self.next;
        while self.bytes.get(start..start + 2) == Some(&[0xff, 0xff]) {
            start += 1; // Fill bytes may precede a marker.
        }
        let &[0xff, marker, high, low] = self.bytes.get(start..start + 4)? else {
            return None;
        };
        let end = start + 2 + usize::from(u16::from_be_bytes([high, low]));
        if marker == START_OF_SCAN || end < start + 4 || end > self.bytes.len() {
            return None;
        }
        self.next = end;
        Some(Segment { marker, start, end })
    }
}

fn message(error: &turbojpeg::Error) -> String {
    match error {
        turbojpeg::Error::TurboJpegError(words) => words.clone(),
        other => other.to_string(),
    }
}

fn is_harmless(error: &turbojpeg::Error) -> bool {
    let words = message(error);
    HARMLESS.iter().any(|harmless| words.contains(harmless))
}

fn problem(error: &turbojpeg::Error) -> PictureError {
    let words = message(error);
    let ends = ["Premature end", "premature end", "missing SOS"];
    if ends.iter().any(|end| words.contains(end)) {
        return PictureError::EndsEarly(Format::Jpeg);
    }
    unsound(&words)
}

fn unsound(why: &str) -> PictureError {
    PictureError::Unreadable {
        format: Format::Jpeg,
        why: why.to_owned(),
    }
}
