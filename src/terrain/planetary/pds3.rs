//! PDS3: a label of `KEY = VALUE` lines, at the head of the image or in a file beside it.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::Problem;
use super::image::{Image, Kind, SampleType};
use super::label::Group;
use super::label_map::LabelMap;
use super::map::metres;
use crate::error::Error;
use crate::input::Document;
use crate::terrain::HeightGrid;

/// Labels are far shorter than this.
const LONGEST_LABEL: u64 = 1 << 20;

/// Whether a file begins with a PDS3 label.
pub(in crate::terrain) fn is_pds3(start: &[u8]) -> bool {
    let head = &start[..start.len().min(400)];
    head.windows(14).any(|word| word == b"PDS_VERSION_ID")
}

/// Reads a height model from a PDS3 label and its image: of one band, on a map of the planet (the
/// equirectangular, simple cylindrical, sinusoidal or polar stereographic projection; PDS Data
/// Dictionary, `IMAGE_MAP_PROJECTION`) or of a rover's site (`SURFACE_PROJECTION_PARMS`). Samples become
/// metres by `SCALING_FACTOR`, `OFFSET` and `UNIT`; those that are radii from the body's centre become
/// heights above the map's sphere.
///
/// # Errors
/// [`Error::Io`] where label or image cannot be read, and faults that name the key.
pub(in crate::terrain) fn read_pds3(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LONGEST_LABEL).read_to_end(&mut bytes))
        .map_err(|error| Error::io(path, "read", error))?;
    let document = Document::parse_odl(&String::from_utf8_lossy(&bytes), shown)?;
    let label = Group::root(document.root());
    let told = |problem: Problem| Error::from(problem.fault(shown));
    let (file, offset) = pointer(&label, path).map_err(told)?;
    let (image, map) = image(&label, offset).map_err(told)?;
    let posts = image.read(&file)?.map_err(told)?;
    map.grid([image.columns, image.rows], posts)
        .map_err(|error| told(Problem::new("", error)))
}

/// The file of the image, and where in it the image begins: `^IMAGE = 3`, `"X.IMG"`, `("X.IMG", 3)`, a
/// number of records, or of bytes, from 1.
fn pointer(label: &Group, path: &Path) -> Result<(PathBuf, u64), Problem> {
    let key = "^IMAGE";
    let expected = "where the image is";
    let inner = label.find(&["UNCOMPRESSED_FILE", "FILE"]);
    let holder = match &inner {
        Some(inner) if !label.has(key) => inner,
        _ => label,
    };
    let words = holder
        .words(key)
        .ok_or_else(|| holder.missing(key, expected))?;
    let bad = || holder.found(key, words.join(", "), expected);
    let units = holder.words("^IMAGE__UNIT").unwrap_or_default();
    let (file, start) = match &words[..] {
        [only] if only.parse::<f64>().is_ok() => (None, Some(only)),
        [file] => (Some(file), None),
        [file, start] => (Some(file), Some(start)),
        _ => return Err(bad()),
    };
    let offset = match start {
        None => 0,
        Some(start) => {
            let first: u64 = start.parse().map_err(|_| bad())?;
            let records = first.checked_sub(1).ok_or_else(bad)?;
            let record = if units.iter().any(|unit| unit.starts_with("BYTE")) {
                1
            } else {
                let bytes = label.count("RECORD_BYTES")?;
                bytes.ok_or_else(|| label.missing("RECORD_BYTES", "bytes of a record"))?
            };
            records.checked_mul(record).ok_or_else(bad)?
        }
    };
    let file = match file {
        None => path.to_owned(),
        // Archives spell names in capitals, file systems keep them in either.
        Some(name) => [name.to_owned(), name.to_lowercase(), name.to_uppercase()]
            .into_iter()
            .map(|name| path.with_file_name(name))
            .find(|file| file.exists())
            .unwrap_or_else(|| path.with_file_name(name)),
    };
    Ok((file, offset))
}

/// The image, and the map it is on.
fn image(label: &Group, offset: u64) -> Result<(Image, LabelMap), Problem> {
    let image = label
        .find(&["IMAGE"])
        .ok_or_else(|| label.missing("IMAGE", "the object that describes the image"))?;
    if let Some(bands) = image.count("BANDS")?.filter(|&bands| bands != 1) {
        return Err(image.found("BANDS", bands, "1, a band of heights"));
    }
    if let Some(coding) = image.text("ENCODING_TYPE") {
        return Err(image.found("ENCODING_TYPE", coding, "plain samples"));
    }
    let (columns, rows) = (image.side("LINE_SAMPLES")?, image.side("LINES")?);
    let map = LabelMap::of(label, [columns, rows])?;
    let unit_m = match image.text("UNIT") {
        None => 1.0,
        Some(unit) => {
            metres(&unit).ok_or_else(|| image.found("UNIT", unit, "METER or KILOMETER"))?
        }
    };
    let shift_m = image.number("OFFSET")?.unwrap_or(0.0) * unit_m;
    let image = Image {
        columns,
        rows,
        offset,
        sample: sample_type(&image)?,
        prefix: image.count("LINE_PREFIX_BYTES")?.unwrap_or(0),
        suffix: image.count("LINE_SUFFIX_BYTES")?.unwrap_or(0),
        scale: image.number("SCALING_FACTOR")?.unwrap_or(1.0) * unit_m * map.sign,
        shift: map.height_shift_m(shift_m) * map.sign,
        unknown: unknown(&image)?,
    };
    Ok((image, map))
}

/// The samples that stand for nothing.
pub(super) fn unknown(image: &Group) -> Result<Vec<f64>, Problem> {
    let mut unknown = Vec::new();
    for key in [
        "MISSING_CONSTANT",
        "MISSING",
        "INVALID_CONSTANT",
        "CORE_NULL",
        "CORE_LOW_REPR_SATURATION",
        "CORE_LOW_INSTR_SATURATION",
        "CORE_HIGH_REPR_SATURATION",
        "CORE_HIGH_INSTR_SATURATION",
    ] {
        unknown.extend(image.numbers(key)?);
    }
    Ok(unknown)
}

fn sample_type(image: &Group) -> Result<SampleType, Problem> {
    let expected = "a type such as MSB_INTEGER, LSB_INTEGER, IEEE_REAL or PC_REAL";
    let name = image
        .text("SAMPLE_TYPE")
        .ok_or_else(|| image.missing("SAMPLE_TYPE", expected))?;
    let (kind, is_little_endian) = match name.as_str() {
        "MSB_INTEGER" | "SUN_INTEGER" | "MAC_INTEGER" | "INTEGER" => (Kind::Signed, false),
        "LSB_INTEGER" | "PC_INTEGER" | "VAX_INTEGER" => (Kind::Signed, true),
        "MSB_UNSIGNED_INTEGER"
        | "SUN_UNSIGNED_INTEGER"
        | "MAC_UNSIGNED_INTEGER"
        | "UNSIGNED_INTEGER" => (Kind::Unsigned, false),
        "LSB_UNSIGNED_INTEGER" | "PC_UNSIGNED_INTEGER" | "VAX_UNSIGNED_INTEGER" => {
            (Kind::Unsigned, true)
        }
        "IEEE_REAL" | "MAC_REAL" | "SUN_REAL" | "REAL" | "FLOAT" => (Kind::Real, false),
        "PC_REAL" => (Kind::Real, true),
        _ => return Err(image.found("SAMPLE_TYPE", name, expected)),
    };
    let bits = image.count("SAMPLE_BITS")?;
    let bits = bits.ok_or_else(|| image.missing("SAMPLE_BITS", "8, 16, 32 or 64"))?;
    let bytes = match (kind, bits) {
        (Kind::Real, 32) | (_, 32) => 4,
        (Kind::Real, 64) => 8,
        (Kind::Signed | Kind::Unsigned, 8) => 1,
        (Kind::Signed | Kind::Unsigned, 16) => 2,
        _ => {
            let expected = "8, 16 or 32, and 32 or 64 of real numbers";
            return Err(image.found("SAMPLE_BITS", bits, expected));
        }
    };
    Ok(SampleType {
        kind,
        bytes,
        is_little_endian,
    })
}
