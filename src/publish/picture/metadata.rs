//! What belongs to any copy of a picture beside its pixels: EXIF, XMP, colour profile.

use std::io::{Seek, Write};

use tiff::TiffResult;
use tiff::encoder::colortype::RGB8;
use tiff::encoder::{ImageEncoder, TiffEncoder, TiffKindStandard};
use tiff::tags::{Tag, Type};

use super::exif::{self, Exif};

/// Tags of TIFF: XMP specification, part 3, and ICC.1, annex B.
const XMP: u16 = 700;
const ICC_PROFILE: u16 = 34_675;

/// What the content of a JPEG's segments begins with.
const EXIF_NAME: &[u8] = b"Exif\0\0";
const XMP_NAME: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
const LONG_XMP_NAME: &[u8] = b"http://ns.adobe.com/xmp/extension/\0";
const ICC_NAME: &[u8] = b"ICC_PROFILE\0";

/// The most that a segment of a JPEG holds.
const SEGMENT: usize = 65_533;

/// The metadata of a picture, whatever the format it was read from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Metadata {
    /// An EXIF block, a TIFF file without pixels.
    exif: Option<Vec<u8>>,
    /// An XMP packet.
    xmp: Option<Vec<u8>>,
    /// The parts of an XMP packet that is too long for a JPEG's segment, as segments have them: of
    /// use to a JPEG alone.
    long_xmp: Vec<Vec<u8>>,
    /// A colour profile for red, green and blue, as every picture is written: one for other
    /// channels would make readers see wrong colours.
    icc: Option<Vec<u8>>,
}

impl Metadata {
    /// From the parts that a format's reader has found.
    pub(super) fn new(exif: Option<Vec<u8>>, xmp: Option<Vec<u8>>, icc: Option<Vec<u8>>) -> Self {
        Self {
            exif: exif.filter(|bytes| !bytes.is_empty()),
            xmp: xmp.filter(|bytes| !bytes.is_empty()),
            long_xmp: Vec::new(),
            icc: icc.filter(|profile| is_rgb(profile)),
        }
    }

    /// Of a TIFF file.
    pub(super) fn of_tiff(file: &[u8]) -> Self {
        let [xmp, icc] = exif::values(file, [XMP, ICC_PROFILE]);
        Self::new(Exif::read(file).and_then(|exif| exif.block()), xmp, icc)
    }

    /// From the contents of the segments of a JPEG that are for applications.
    pub(super) fn of_jpeg<'a>(segments: impl Iterator<Item = &'a [u8]>) -> Self {
        let (mut exif, mut xmp) = (None, None);
        let mut long_xmp = Vec::new();
        let mut profile = Vec::new();
        for content in segments {
            // Of the name's two zeros some writers have another for the second.
            if content.starts_with(b"Exif\0") {
                exif = exif.or(content.get(EXIF_NAME.len()..));
            } else if let Some(packet) = content.strip_prefix(XMP_NAME) {
                xmp = xmp.or(Some(packet));
            } else if content.starts_with(LONG_XMP_NAME) {
                long_xmp.push(content.to_vec());
            } else if let Some([number, count, part @ ..]) = content.strip_prefix(ICC_NAME) {
                profile.push((*number, *count, part));
            }
        }
        profile.sort_by_key(|&(number, ..)| number);
        let is_whole = profile.iter().all(|p| usize::from(p.1) == profile.len());
        let icc = is_whole.then(|| profile.iter().flat_map(|p| p.2).copied().collect());
        let whole = |part: Option<&[u8]>| part.map(<[u8]>::to_vec);
        Self {
            long_xmp,
            ..Self::new(whole(exif), whole(xmp), icc)
        }
    }

    /// The contents of the segments of a JPEG, each with the number of its marker, APP0 to APP15.
    pub(super) fn segments(&self) -> Vec<(u8, Vec<u8>)> {
        let mut segments = Vec::new();
        let exif = self.exif.as_deref().and_then(exif_content);
        segments.extend(exif.map(|content| (1, content)));
        let xmp = self.xmp.as_deref().map(|xmp| [XMP_NAME, xmp].concat());
        let xmp = xmp.filter(|content| content.len() <= SEGMENT);
        segments.extend(xmp.map(|content| (1, content)));
        segments.extend(self.long_xmp.iter().map(|part| (1, part.clone())));
        let profile = self.icc.as_deref().unwrap_or_default();
        let parts = profile.chunks(SEGMENT - ICC_NAME.len() - 2);
        // A profile of more parts than can be numbered is not written in part.
        if let Ok(count) = u8::try_from(parts.len()) {
            let numbered = (1..=count).zip(parts);
            segments.extend(
                numbered.map(|(number, part)| (2, [ICC_NAME, &[number, count], part].concat())),
            );
        }
        segments
    }

    /// The EXIF block of a PNG.
    pub(super) fn exif(&self) -> Option<&[u8]> {
        self.exif.as_deref()
    }

    /// The XMP packet of a PNG, which is text.
    pub(super) fn xmp_text(&self) -> Option<&str> {
        std::str::from_utf8(self.xmp.as_deref()?).ok()
    }

    /// The colour profile of a PNG.
    pub(super) fn icc(&self) -> Option<&[u8]> {
        self.icc.as_deref()
    }

    /// Begins a picture of a TIFF file that has this metadata.
    pub(super) fn begin_tiff<'a, W: Write + Seek>(
        &self,
        file: &'a mut TiffEncoder<W, TiffKindStandard>,
        (width, height): (u32, u32),
    ) -> TiffResult<ImageEncoder<'a, W, RGB8, TiffKindStandard>> {
        let exif = self
            .exif
            .as_deref()
            .and_then(Exif::read)
            .unwrap_or_default();
        let pointers = exif.write_below(file)?;
        let mut image = file.new_image::<RGB8>(width, height)?;
        let directory = image.encoder();
        exif.write_main(directory)?;
        for (tag, at) in pointers {
            directory.write_tag(Tag::from_u16_exhaustive(tag), at)?;
        }
        if let Some(xmp) = &self.xmp {
            exif::write_bytes(directory, (XMP, Type::BYTE), xmp)?;
        }
        if let Some(icc) = &self.icc {
            exif::write_bytes(directory, (ICC_PROFILE, Type::UNDEFINED), icc)?;
        }
        Ok(image)
    }
}

/// EXIF as a segment of a JPEG holds it: without the note of the camera's maker where it would
/// not fit with it.
fn exif_content(block: &[u8]) -> Option<Vec<u8>> {
    let content = [EXIF_NAME, block].concat();
    if content.len() <= SEGMENT {
        return Some(content);
    }
    let shorter = Exif::read(block)?.without_maker_note().block()?;
    Some([EXIF_NAME, &shorter].concat()).filter(|content| content.len() <= SEGMENT)
}

/// Whether a colour profile is for red, green and blue (ICC.1, 7.2.6).
fn is_rgb(profile: &[u8]) -> bool {
    profile.get(16..20) == Some(b"RGB ")
}

#[cfg(test)]
mod tests;
