//! VICAR images: a label of `KEY=VALUE` at the head of the file, of which a second part may stand at
//! its end.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::Problem;
use super::image::{Image, Kind, SampleType};
use super::label::Group;
use super::label_map::LabelMap;
use super::map::metres;
use super::pds3::unknown;
use crate::error::Error;
use crate::input::Document;
use crate::terrain::HeightGrid;

/// Labels are far shorter than this.
const LONGEST_LABEL: u64 = 4 << 20;

/// Whether a file begins with a VICAR label.
pub(in crate::terrain) fn is_vicar(start: &[u8]) -> bool {
    start.starts_with(b"LBLSIZE=")
}

/// Reads a height model from a VICAR image of one band, on a map of the planet (a property
/// `IMAGE_MAP_PROJECTION` or `MAP`, or the keys of a `GEOTIFF` property) or of a rover's site
/// (`SURFACE_PROJECTION_PARMS`). Missing and invalid constants are unknown heights, and so is what no
/// height can be.
///
/// # Errors
/// [`Error::Io`] where it cannot be read, and faults that name the key.
pub(in crate::terrain) fn read_vicar(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let io = |error| Error::io(path, "read", error);
    let mut file = File::open(path).map_err(io)?;
    let told = |problem: Problem| Error::from(problem.fault(shown));
    let head = part(&mut file, 0).map_err(io)?;
    let head = Document::parse_vicar(&head, shown)?;
    let label = Group::root(head.root());
    let layout = Layout::of(&label).map_err(told)?;
    let tail = match layout.tail {
        None => None,
        Some(at) => {
            let tail = part(&mut file, at).map_err(io)?;
            if !is_vicar(tail.as_bytes()) {
                let found = format!("no label at byte {at}");
                let expected = "the label's second part, which EOL=1 announces";
                return Err(told(label.found("EOL", found, expected)));
            }
            Some(Document::parse_vicar(
                &tail,
                &format!("{shown} at byte {at}"),
            )?)
        }
    };
    let whole = match tail {
        None => head,
        Some(tail) => head.over(tail),
    };
    let label = Group::root(whole.root());
    let (image, map) = image(&label, &layout).map_err(told)?;
    let posts = image.read(path)?.map_err(told)?;
    map.grid([image.columns, image.rows], posts)
        .map_err(|error| told(Problem::new("", error)))
}

/// The text of a label that begins at a byte.
fn part(file: &mut File, at: u64) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(at))?;
    file.take(LONGEST_LABEL).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// How the bytes of a file are laid out (VICAR Run-Time Library Reference, system labels).
struct Layout {
    columns: usize,
    rows: usize,
    sample: SampleType,
    /// Bytes before the first row.
    offset: u64,
    /// Bytes at the head of every record.
    prefix: u64,
    /// Where the second part of the label begins.
    tail: Option<u64>,
}

impl Layout {
    fn of(label: &Group) -> Result<Self, Problem> {
        let (columns, rows) = (label.side("NS")?, label.side("NL")?);
        if let Some(bands) = label.count("NB")?.filter(|&bands| bands != 1) {
            return Err(label.found("NB", bands, "1, a band of heights"));
        }
        let coding = label.text("COMPRESS");
        if let Some(coding) = coding.filter(|coding| coding != "NONE") {
            return Err(label.found("COMPRESS", coding, "plain samples"));
        }
        let sample = sample_type(label)?;
        let count = |key: &str| -> Result<u64, Problem> { Ok(label.count(key)?.unwrap_or(0)) };
        let (prefix, headers) = (count("NBB")?, count("NLB")?);
        let order = label.text("ORG").unwrap_or_else(|| "BSQ".to_owned());
        match order.as_str() {
            "BSQ" | "BIL" => {}
            // One band has its pixels in the same order in all of them, but a record is a pixel here.
            "BIP" if prefix == 0 && headers == 0 => {}
            "BIP" => {
                let found = format!("BIP with NBB={prefix}, NLB={headers}");
                return Err(label.found("ORG", found, "BSQ or BIL, or no binary labels"));
            }
            _ => return Err(label.found("ORG", order, "BSQ, BIL or BIP")),
        }
        let size = label.count("LBLSIZE")?;
        let size = size.ok_or_else(|| label.missing("LBLSIZE", "the label's length"))?;
        let row = (columns as u64).saturating_mul(sample.bytes as u64);
        let record = prefix.saturating_add(row);
        if let Some(told) = label
            .count("RECSIZE")?
            .filter(|&told| order != "BIP" && told != record)
        {
            let expected = format!("{record}, NBB and NS samples of {} bytes", sample.bytes);
            return Err(label.found("RECSIZE", told, &expected));
        }
        let offset = size.saturating_add(headers.saturating_mul(record));
        let end = offset.saturating_add(record.saturating_mul(rows as u64));
        let has_tail = count("EOL")? != 0;
        Ok(Self {
            columns,
            rows,
            sample,
            offset,
            prefix,
            tail: has_tail.then_some(end),
        })
    }
}

fn sample_type(label: &Group) -> Result<SampleType, Problem> {
    let expected = "BYTE, HALF, FULL, REAL or DOUB";
    let format = label
        .text("FORMAT")
        .ok_or_else(|| label.missing("FORMAT", expected))?;
    let (kind, bytes) = match format.as_str() {
        "BYTE" => (Kind::Unsigned, 1),
        "HALF" | "WORD" => (Kind::Signed, 2),
        "FULL" | "LONG" => (Kind::Signed, 4),
        "REAL" => (Kind::Real, 4),
        "DOUB" => (Kind::Real, 8),
        _ => return Err(label.found("FORMAT", format, expected)),
    };
    // Labels without these are of the days of the VAX.
    let (key, default) = match kind {
        Kind::Real => ("REALFMT", "VAX"),
        _ => ("INTFMT", "LOW"),
    };
    let order = label.text(key).unwrap_or_else(|| default.to_owned());
    let is_little_endian = match (kind, order.as_str()) {
        (Kind::Real, "RIEEE") | (Kind::Signed | Kind::Unsigned, "LOW") => true,
        (Kind::Real, "IEEE") | (Kind::Signed | Kind::Unsigned, "HIGH") => false,
        (Kind::Real, _) => {
            let expected = "IEEE or RIEEE: numbers of the VAX are not read";
            return Err(label.found(key, order, expected));
        }
        _ => return Err(label.found(key, order, "HIGH or LOW")),
    };
    Ok(SampleType {
        kind,
        bytes,
        is_little_endian,
    })
}

/// The image, and the map it is on.
fn image(label: &Group, layout: &Layout) -> Result<(Image, LabelMap), Problem> {
    let map = LabelMap::of(label, [layout.columns, layout.rows])?;
    let data = label.find(&["IMAGE_DATA", "IMAGE"]);
    let data = data.as_ref().unwrap_or(label);
    let unit_m = match data.text("UNIT") {
        None => 1.0,
        Some(unit) => {
            metres(&unit).ok_or_else(|| data.found("UNIT", unit, "METER or KILOMETER"))?
        }
    };
    let shift_m = data.number("OFFSET")?.unwrap_or(0.0) * unit_m;
    let scale = data.number("SCALING_FACTOR")?.unwrap_or(1.0) * unit_m;
    let image = Image {
        columns: layout.columns,
        rows: layout.rows,
        offset: layout.offset,
        sample: layout.sample,
        prefix: layout.prefix,
        suffix: 0,
        scale: scale * map.sign,
        shift: map.height_shift_m(shift_m) * map.sign,
        unknown: unknown(data)?,
    };
    Ok((image, map))
}
