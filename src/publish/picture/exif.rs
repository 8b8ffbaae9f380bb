//! What TIFF files and EXIF blocks say of a picture beside its pixels (CIPA DC-008, TIFF 6.0).
//!
//! An EXIF block is a TIFF file without pixels, so that one reader serves both: the tags of the
//! first directory that describe, and the directories for EXIF, GPS and interoperability below
//! it. Where fields move from one to the other they are written anew, in little-endian order; a
//! maker's note moves as it is, and one that points to places in its file by their offset loses them.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use tiff::TiffResult;
use tiff::encoder::{DirectoryEncoder, TiffEncoder, TiffKindStandard};
use tiff::tags::{Tag, Type};

/// Tags that point to directories below the first, and from that for EXIF to another.
const EXIF_DIRECTORY: u16 = 34_665;
const GPS_DIRECTORY: u16 = 34_853;
const INTEROPERABILITY_DIRECTORY: u16 = 40_965;

const MAKER_NOTE: u16 = 37_500;
const X_RESOLUTION: u16 = 282;
const Y_RESOLUTION: u16 = 283;
const RESOLUTION_UNIT: u16 = 296;
/// The resolution unit of a picture that has none.
const NO_UNIT: &[u8] = &[1, 0];

/// Field types of TIFF 6.0.
const ASCII: u16 = 2;
const LONG: u16 = 4;
/// UTF-8, of EXIF 3.0: written as ASCII, which readers of older versions know.
const UTF8: u16 = 129;

/// The fields of one directory by their tags.
type Directory = BTreeMap<u16, Field>;

/// A field's type and its values, in little-endian order.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Field {
    kind: u16,
    bytes: Vec<u8>,
}

/// What describes a picture.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Exif {
    main: Directory,
    exif: Directory,
    gps: Directory,
    interoperability: Directory,
}

impl Exif {
    /// From a TIFF file, `BigTIFF` too, or an EXIF block; `None` where that says nothing. What is
    /// damaged is left out.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let source = Source::new(bytes)?;
        let all = source.first(|_| true)?;
        let below = |directory: &Directory, tag: u16| {
            let at = directory.get(&tag).and_then(Field::offset);
            at.and_then(|at| source.directory(at, |_| true))
                .unwrap_or_default()
        };
        let mut read = Self {
            exif: below(&all, EXIF_DIRECTORY),
            gps: below(&all, GPS_DIRECTORY),
            ..Self::default()
        };
        read.interoperability = below(&read.exif, INTEROPERABILITY_DIRECTORY);
        read.exif.remove(&INTEROPERABILITY_DIRECTORY);
        read.main = all.into_iter().filter(|&(tag, _)| describes(tag)).collect();
        if read
            .main
            .get(&RESOLUTION_UNIT)
            .is_none_or(|f| f.bytes == NO_UNIT)
        {
            for tag in [X_RESOLUTION, Y_RESOLUTION, RESOLUTION_UNIT] {
                read.main.remove(&tag);
            }
        }
        (read != Self::default()).then_some(read)
    }

    /// The same without the note of the camera's maker, which may be large.
    pub(super) fn without_maker_note(mut self) -> Self {
        self.exif.remove(&MAKER_NOTE);
        self
    }

    /// The bytes of an EXIF block; `None` where they would be too many for their offsets.
    pub(super) fn block(&self) -> Option<Vec<u8>> {
        let mut directories = [
            self.main.clone(),
            self.exif.clone(),
            self.gps.clone(),
            self.interoperability.clone(),
        ];
        // Whose field of which tag points to whom; first as zeros, which have their size.
        let links = [
            (1, INTEROPERABILITY_DIRECTORY, 3),
            (0, EXIF_DIRECTORY, 1),
            (0, GPS_DIRECTORY, 2),
        ];
        for (from, tag, to) in links {
            if !directories[to].is_empty() {
                directories[from].insert(tag, Field::pointer(0));
            }
        }
        let mut starts = [0; 4];
        let mut next = 8;
        for (start, directory) in starts.iter_mut().zip(&directories) {
            *start = u32::try_from(next).ok()?;
            if !directory.is_empty() {
                next += size_of(directory);
            }
        }
        u32::try_from(next).ok()?;
        for (from, tag, to) in links {
            if !directories[to].is_empty() {
                directories[from].insert(tag, Field::pointer(starts[to]));
            }
        }
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        for directory in directories.iter().filter(|d| !d.is_empty()) {
            write_directory(directory, &mut bytes)?;
        }
        Some(bytes)
    }

    /// Writes the directories below the first, and gives what the first is to say.
    pub(super) fn write_below<W: Write + Seek>(
        &self,
        file: &mut TiffEncoder<W, TiffKindStandard>,
    ) -> TiffResult<Vec<(u16, u32)>> {
        let mut pointers = Vec::new();
        let mut exif = self.exif.clone();
        if !self.interoperability.is_empty() {
            let at = write_one(&self.interoperability, file)?;
            exif.insert(INTEROPERABILITY_DIRECTORY, Field::pointer(at));
        }
        for (tag, directory) in [(EXIF_DIRECTORY, &exif), (GPS_DIRECTORY, &self.gps)] {
            if !directory.is_empty() {
                pointers.push((tag, write_one(directory, file)?));
            }
        }
        Ok(pointers)
    }

    /// Writes what describes into the first directory of a TIFF file.
    pub(super) fn write_main<W: Write + Seek>(
        &self,
        directory: &mut DirectoryEncoder<'_, W, TiffKindStandard>,
    ) -> TiffResult<()> {
        write_fields(&self.main, directory)
    }
}

impl Field {
    fn pointer(at: u32) -> Self {
        Self {
            kind: LONG,
            bytes: at.to_le_bytes().to_vec(),
        }
    }

    fn offset(&self) -> Option<usize> {
        let mut bytes = [0; 8];
        bytes
            .get_mut(..self.bytes.len())?
            .copy_from_slice(&self.bytes);
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    }

    fn count(&self) -> Option<u32> {
        u32::try_from(self.bytes.len() / unit(self.kind)?.0).ok()
    }
}

/// The values of a TIFF file's first directory that have these tags, in little-endian order.
pub(super) fn values<const N: usize>(file: &[u8], tags: [u16; N]) -> [Option<Vec<u8>>; N] {
    let directory = Source::new(file).and_then(|source| source.first(|tag| tags.contains(&tag)));
    let mut directory = directory.unwrap_or_default();
    tags.map(|tag| directory.remove(&tag).map(|field| field.bytes))
}

/// Writes one field of a TIFF file, its values in the encoder's order.
pub(super) fn write_bytes<W: Write + Seek>(
    directory: &mut DirectoryEncoder<'_, W, TiffKindStandard>,
    (tag, kind): (u16, Type),
    bytes: &[u8],
) -> TiffResult<()> {
    let entry = directory.write_entry_bytes(kind, bytes)?;
    let mut one = tiff::Directory::empty();
    one.extend([(Tag::from_u16_exhaustive(tag), entry)]);
    directory.extend_from(&one);
    Ok(())
}

/// Whether a tag of the first directory speaks of the picture rather than of how its pixels are
/// stored: TIFF 6.0, and the tags of EXIF and TIFF/EP that some cameras put there.
fn describes(tag: u16) -> bool {
    matches!(
        tag,
        269..=272 // Document name, description, make, model.
            | 274 // Orientation.
            | X_RESOLUTION
            | Y_RESOLUTION
            | 285 // Page name.
            | RESOLUTION_UNIT
            | 305 // Software.
            | 306 // Time.
            | 315 // Artist.
            | 316 // Host computer.
            | 18_246 // Rating.
            | 18_249 // Rating, per cent.
            | 33_432 // Copyright.
            | 33_434 // Exposure time.
            | 33_437 // F number.
            | 33_723 // IPTC.
            | 34_850 // Exposure program.
            | 34_855 // Sensitivity.
            | 36_864..=37_399 // EXIF version to sensing method.
            | 40_091..=40_095 // Title, comment, author, keywords and subject of Windows.
            | 42_016..=42_037 // Identifier, owner, serial numbers, lens.
            | 50_708 // Unique camera model.
            | 50_735 // Serial number of the camera.
    )
}

/// The bytes of one value of a type, and of the numbers it is made of.
fn unit(kind: u16) -> Option<(usize, usize)> {
    match kind {
        1 | 2 | 6 | 7 | UTF8 => Some((1, 1)),
        3 | 8 => Some((2, 2)),
        4 | 9 | 11 | 13 => Some((4, 4)),
        5 | 10 => Some((8, 4)), // Fractions.
        12 | 16..=18 => Some((8, 8)),
        _ => None,
    }
}

/// A TIFF file or EXIF block in memory.
struct Source<'a> {
    bytes: &'a [u8],
    is_little: bool,
    is_big_tiff: bool,
}

impl<'a> Source<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let is_little = match bytes.get(..2)? {
            b"II" => true,
            b"MM" => false,
            _ => return None,
        };
        let mut source = Self {
            bytes,
            is_little,
            is_big_tiff: false,
        };
        source.is_big_tiff = match source.number(2, 2)? {
            42 => false,
            43 => true,
            _ => return None,
        };
        Some(source)
    }

    /// The fields of the first directory whose tags are wanted.
    fn first(&self, wanted: impl Fn(u16) -> bool) -> Option<Directory> {
        let (at, size) = if self.is_big_tiff { (8, 8) } else { (4, 4) };
        self.directory(usize::try_from(self.number(at, size)?).ok()?, wanted)
    }

    /// The fields of the directory at a place whose tags are wanted and whose values are there.
    fn directory(&self, at: usize, wanted: impl Fn(u16) -> bool) -> Option<Directory> {
        let (head, entry) = if self.is_big_tiff { (8, 20) } else { (2, 12) };
        let count = usize::try_from(self.number(at, head)?).ok()?;
        let entries = self.bytes.get(at.checked_add(head)?..)?.len() / entry;
        let mut directory = Directory::new();
        for index in 0..count.min(entries) {
            let at = at + head + index * entry;
            let Some(tag) = self.number(at, 2).and_then(|tag| u16::try_from(tag).ok()) else {
                continue;
            };
            if wanted(tag)
                && let Some(field) = self.field(at)
            {
                directory.entry(tag).or_insert(field);
            }
        }
        Some(directory)
    }

    /// The value of the entry at a place.
    fn field(&self, at: usize) -> Option<Field> {
        let word = if self.is_big_tiff { 8 } else { 4 };
        let kind = u16::try_from(self.number(at + 2, 2)?).ok()?;
        let (size, part) = unit(kind)?;
        let length = usize::try_from(self.number(at + 4, word)?).ok()?;
        let length = length.checked_mul(size)?;
        let start = if length <= word {
            at + 4 + word
        } else {
            usize::try_from(self.number(at + 4 + word, word)?).ok()?
        };
        let mut bytes = self.bytes.get(start..start.checked_add(length)?)?.to_vec();
        if !self.is_little {
            bytes.chunks_exact_mut(part).for_each(<[u8]>::reverse);
        }
        Some(Field {
            kind: if kind == UTF8 { ASCII } else { kind },
            bytes,
        })
    }

    fn number(&self, at: usize, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        let push = |sum: u64, &byte: &u8| sum << 8 | u64::from(byte);
        Some(if self.is_little {
            bytes.iter().rev().fold(0, push)
        } else {
            bytes.iter().fold(0, push)
        })
    }
}

/// The bytes a directory takes in an EXIF block, its values with it.
fn size_of(directory: &Directory) -> usize {
    let values = directory.values().map(|field| field.bytes.len());
    let outside: usize = values
        .filter(|&n| n > 4)
        .map(|n| n.next_multiple_of(2))
        .sum();
    2 + 12 * directory.len() + 4 + outside
}

/// Writes a directory and its values behind it.
fn write_directory(directory: &Directory, onto: &mut Vec<u8>) -> Option<()> {
    let mut values = Vec::new();
    let values_at = onto.len() + 2 + 12 * directory.len() + 4;
    onto.extend(u16::try_from(directory.len()).ok()?.to_le_bytes());
    for (tag, field) in directory {
        onto.extend(tag.to_le_bytes());
        onto.extend(field.kind.to_le_bytes());
        onto.extend(field.count()?.to_le_bytes());
        if field.bytes.len() > 4 {
            onto.extend(u32::try_from(values_at + values.len()).ok()?.to_le_bytes());
            values.extend(&field.bytes);
            values.resize(values.len().next_multiple_of(2), 0);
        } else {
            let mut word = [0; 4];
            word[..field.bytes.len()].copy_from_slice(&field.bytes);
            onto.extend(word);
        }
    }
    onto.extend([0; 4]); // No directory follows.
    onto.extend(values);
    Some(())
}

/// Writes a directory of its own, and gives its place.
fn write_one<W: Write + Seek>(
    fields: &Directory,
    file: &mut TiffEncoder<W, TiffKindStandard>,
) -> TiffResult<u32> {
    let mut directory = file.extra_directory()?;
    write_fields(fields, &mut directory)?;
    Ok(directory.finish_with_offsets()?.offset)
}

fn write_fields<W: Write + Seek>(
    fields: &Directory,
    directory: &mut DirectoryEncoder<'_, W, TiffKindStandard>,
) -> TiffResult<()> {
    for (&tag, field) in fields {
        let (Some(kind), Some((_, part))) = (Type::from_u16(field.kind), unit(field.kind)) else {
            continue;
        };
        let mut bytes = field.bytes.clone();
        if cfg!(target_endian = "big") {
            bytes.chunks_exact_mut(part).for_each(<[u8]>::reverse); // The encoder's order.
        }
        write_bytes(directory, (tag, kind), &bytes)?;
    }
    Ok(())
}
