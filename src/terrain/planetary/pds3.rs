//! PDS3: a label of `KEY = VALUE` lines, at the head of the image or in a file beside it.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::Problem;
use super::image::{Image, Kind, SampleType};
use super::map::{Projection, height_shift_m, is_north, metres};
use super::odl::Label;
use crate::error::Error;
use crate::terrain::{Affine, HeightGrid};

const IMAGE: &str = "IMAGE";
const MAP: &str = "IMAGE_MAP_PROJECTION";

/// Labels are far shorter than this.
const LONGEST_LABEL: u64 = 1 << 20;

/// Whether a file begins with a PDS3 label.
pub(in crate::terrain) fn is_pds3(start: &[u8]) -> bool {
    let head = &start[..start.len().min(400)];
    head.windows(14).any(|word| word == b"PDS_VERSION_ID")
}

/// Reads a height model from a PDS3 label and its image: of one band, in the equirectangular, simple
/// cylindrical, sinusoidal or polar stereographic projection (PDS Data Dictionary,
/// `IMAGE_MAP_PROJECTION`). Samples become metres by `SCALING_FACTOR`, `OFFSET` and `UNIT`; those that are
/// radii from the body's centre become heights above the map's sphere.
///
/// # Errors
/// [`Error::Io`] where label or image cannot be read, and faults that name the key.
pub(in crate::terrain) fn read_pds3(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LONGEST_LABEL).read_to_end(&mut bytes))
        .map_err(|error| Error::io(path, "read", error))?;
    let label = Label::parse(&String::from_utf8_lossy(&bytes));
    let told = |problem: Problem| Error::from(problem.fault(shown));
    let (file, offset) = pointer(&label, path).map_err(told)?;
    let (map, radius_m) = projection(&label).map_err(told)?;
    let image = image(&label, offset, radius_m).map_err(told)?;
    let posts = image.read(&file)?.map_err(told)?;
    let affine = crs_from_post(&label, map, radius_m).map_err(told)?;
    HeightGrid::new(
        image.columns,
        image.rows,
        posts,
        affine,
        map.definition(radius_m),
    )
    .map_err(|error| {
        told(Problem {
            field: String::new(),
            problem: error.to_string(),
        })
    })
}

/// The file of the image, and where in it the image begins: `^IMAGE = 3`, `"X.IMG"`, `("X.IMG", 3)`, a
/// number of records, or of bytes, from 1.
fn pointer(label: &Label, path: &Path) -> Result<(PathBuf, u64), Problem> {
    let key = "^IMAGE";
    let expected = "where the image is";
    let value = ["", "UNCOMPRESSED_FILE", "FILE"]
        .into_iter()
        .find_map(|object| label.raw(object, key))
        .ok_or_else(|| Problem::missing(key, expected))?;
    let bad = || Problem::found(key, value, expected);
    let parts = value.trim_matches(['(', ')', '{', '}']).split(',');
    let (mut file, mut start) = (None, None);
    for part in parts.map(str::trim) {
        if let Some(name) = part.strip_prefix('"') {
            file = Some(name.trim_end_matches('"'));
        } else {
            start = Some(part);
        }
    }
    let offset = match start {
        None => 0,
        Some(start) => {
            let (number, unit) = start.split_once('<').unwrap_or((start, ""));
            let first: u64 = number.trim().parse().map_err(|_| bad())?;
            let records = first.checked_sub(1).ok_or_else(bad)?;
            let record = if unit.starts_with("BYTES") {
                1
            } else {
                let bytes = label.count("", "RECORD_BYTES")?;
                bytes.ok_or_else(|| Problem::missing("RECORD_BYTES", "bytes of a record"))?
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

fn image(label: &Label, offset: u64, radius_m: f64) -> Result<Image, Problem> {
    let size = |key: &str| -> Result<usize, Problem> {
        let expected = "a whole number above 1";
        let count = label.count(IMAGE, key)?;
        let count = count.ok_or_else(|| Problem::missing(key, expected))?;
        let count = usize::try_from(count).ok().filter(|&n| n > 1);
        count.ok_or_else(|| Problem::found(key, "less", expected))
    };
    if let Some(bands) = label.count(IMAGE, "BANDS")?.filter(|&bands| bands != 1) {
        return Err(Problem::found("BANDS", bands, "1, a band of heights"));
    }
    if let Some(coding) = label.text(IMAGE, "ENCODING_TYPE") {
        return Err(Problem::found("ENCODING_TYPE", coding, "plain samples"));
    }
    let factor = |key: &str, default: f64| -> Result<f64, Problem> {
        Ok(label.number(IMAGE, key)?.map_or(default, |(x, _)| x))
    };
    let unit_m = match label.text(IMAGE, "UNIT") {
        None => 1.0,
        Some(unit) => {
            metres(unit).ok_or_else(|| Problem::found("UNIT", unit, "METER or KILOMETER"))?
        }
    };
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
        unknown.extend(label.number(IMAGE, key)?.map(|(x, _)| x));
    }
    Ok(Image {
        columns: size("LINE_SAMPLES")?,
        rows: size("LINES")?,
        offset,
        sample: sample_type(label)?,
        prefix: label.count(IMAGE, "LINE_PREFIX_BYTES")?.unwrap_or(0),
        suffix: label.count(IMAGE, "LINE_SUFFIX_BYTES")?.unwrap_or(0),
        scale: factor("SCALING_FACTOR", 1.0)? * unit_m,
        shift: height_shift_m(factor("OFFSET", 0.0)? * unit_m, radius_m),
        unknown,
    })
}

fn sample_type(label: &Label) -> Result<SampleType, Problem> {
    let expected = "a type such as MSB_INTEGER, LSB_INTEGER, IEEE_REAL or PC_REAL";
    let name = label
        .text(IMAGE, "SAMPLE_TYPE")
        .ok_or_else(|| Problem::missing("SAMPLE_TYPE", expected))?;
    let (kind, is_little_endian) = match name {
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
        _ => return Err(Problem::found("SAMPLE_TYPE", name, expected)),
    };
    let bits = label.count(IMAGE, "SAMPLE_BITS")?;
    let bits = bits.ok_or_else(|| Problem::missing("SAMPLE_BITS", "8, 16, 32 or 64"))?;
    let bytes = match (kind, bits) {
        (Kind::Real, 32) | (_, 32) => 4,
        (Kind::Real, 64) => 8,
        (Kind::Signed | Kind::Unsigned, 8) => 1,
        (Kind::Signed | Kind::Unsigned, 16) => 2,
        _ => {
            let expected = "8, 16 or 32, and 32 or 64 of real numbers";
            return Err(Problem::found("SAMPLE_BITS", bits, expected));
        }
    };
    Ok(SampleType {
        kind,
        bytes,
        is_little_endian,
    })
}

fn required(label: &Label, key: &str) -> Result<f64, Problem> {
    let number = label.number(MAP, key)?;
    Ok(number.ok_or_else(|| Problem::missing(key, "a number"))?.0)
}

/// The projection, and the radius of its sphere in metres.
fn projection(label: &Label) -> Result<(Projection, f64), Problem> {
    let key = "MAP_PROJECTION_TYPE";
    let expected = "EQUIRECTANGULAR, SIMPLE CYLINDRICAL, SINUSOIDAL or POLAR STEREOGRAPHIC";
    let name = label
        .text(MAP, key)
        .ok_or_else(|| Problem::missing(key, expected))?
        .replace('_', " ")
        .to_ascii_uppercase();
    // Labels give lengths in kilometres where they do not say.
    let axis = |key: &str| -> Result<Option<f64>, Problem> {
        let Some((length, unit)) = label.number(MAP, key)? else {
            return Ok(None);
        };
        let unit_m = if unit.is_empty() {
            Some(1000.0)
        } else {
            metres(unit)
        };
        let unit_m = unit_m.ok_or_else(|| Problem::found(key, unit, "KM or M"))?;
        Ok(Some(length * unit_m))
    };
    let equatorial_m = axis("A_AXIS_RADIUS")?
        .filter(|&radius| radius > 0.0)
        .ok_or_else(|| Problem::missing("A_AXIS_RADIUS", "the body's radius"))?;
    let direction = label.text(MAP, "POSITIVE_LONGITUDE_DIRECTION");
    let sign = if direction.is_some_and(|d| d.eq_ignore_ascii_case("WEST")) {
        -1.0
    } else {
        1.0
    };
    let lon_deg = sign * required(label, "CENTER_LONGITUDE")?;
    let center = |key: &str| required(label, key);
    let map = match name.as_str() {
        "EQUIRECTANGULAR" => Projection::Equirectangular {
            true_lat_deg: center("CENTER_LATITUDE")?,
            lon_deg,
        },
        "SIMPLE CYLINDRICAL" => Projection::Equirectangular {
            true_lat_deg: 0.0,
            lon_deg,
        },
        "SINUSOIDAL" => Projection::Sinusoidal { lon_deg },
        "POLAR STEREOGRAPHIC" => Projection::PolarStereographic {
            is_north: is_north("CENTER_LATITUDE", center("CENTER_LATITUDE")?)?,
            lon_deg,
            scale: 1.0,
        },
        _ => return Err(Problem::found(key, format!("{name:?}"), expected)),
    };
    Ok((map, map.radius_m(equatorial_m, axis("C_AXIS_RADIUS")?)))
}

/// The first post is a number of steps, the projection offsets, left of and above the map's origin.
fn crs_from_post(label: &Label, map: Projection, radius_m: f64) -> Result<Affine, Problem> {
    let by_resolution = label
        .number(MAP, "MAP_RESOLUTION")?
        .map(|(pixels, _)| radius_m.to_radians() / pixels);
    let by_scale = match label.number(MAP, "MAP_SCALE")? {
        None => None,
        Some((scale, unit)) => {
            let length = unit.split('/').next().unwrap_or("");
            let unit_m = if unit.is_empty() {
                Some(1000.0)
            } else {
                metres(length)
            };
            let expected = "METERS/PIXEL or KM/PIXEL";
            Some(scale * unit_m.ok_or_else(|| Problem::found("MAP_SCALE", unit, expected))?)
        }
    };
    // Global maps count in pixels a degree, and their scale is rounded.
    let step_m = match map {
        Projection::Equirectangular {
            true_lat_deg: 0.0, ..
        } => by_resolution.or(by_scale),
        _ => by_scale.or(by_resolution),
    };
    let step_m = step_m
        .filter(|&step| step > 0.0 && step.is_finite())
        .ok_or_else(|| Problem::missing("MAP_SCALE", "the length of a pixel"))?;
    let left = required(label, "SAMPLE_PROJECTION_OFFSET")?;
    let above = required(label, "LINE_PROJECTION_OFFSET")?;
    Ok(Affine::north_up(-left * step_m, above * step_m, step_m))
}
