//! PDS4: an XML label beside the image.

use std::path::Path;

use roxmltree::{Document, Node};

use super::Problem;
use super::image::{Image, Kind, SampleType};
use super::map::{Projection, height_shift_m, is_north, metres};
use crate::error::Error;
use crate::terrain::{Affine, HeightGrid};

/// Whether a file begins like a PDS4 label.
pub(in crate::terrain) fn is_pds4(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    start.trim_ascii_start().starts_with(b"<")
}

/// Reads a height model from a PDS4 label and its image: the first two-dimensional array, or
/// three-dimensional of one band, in the equirectangular, sinusoidal or polar stereographic projection
/// of the cartography dictionary. Samples become metres by scaling factor, offset and unit; those that
/// are radii from the body's centre become heights above the map's sphere.
///
/// # Errors
/// [`Error::Io`] where label or image cannot be read, and faults that name the element.
pub(in crate::terrain) fn read_pds4(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, "read", error))?;
    let told = |problem: Problem| Error::from(problem.fault(shown));
    let document = Document::parse(&text)
        .map_err(|error| told(Problem::new("", format!("not XML: {error}"))))?;
    let root = document.root_element();
    let label = label(root).map_err(told)?;
    let posts = label
        .image
        .read(&path.with_file_name(&label.file))?
        .map_err(told)?;
    let (columns, rows) = (label.image.columns, label.image.rows);
    HeightGrid::new(columns, rows, posts, label.map, label.crs)
        .map_err(|error| told(Problem::new("", error)))
}

/// What a label says.
struct Label {
    file: String,
    image: Image,
    map: Affine,
    crs: String,
}

/// The first element of a name below a node, in whatever name space.
fn below<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.descendants().find(|n| n.tag_name().name() == name)
}

fn text<'a>(node: Node<'a, 'a>, name: &str) -> Option<&'a str> {
    below(node, name)?
        .text()
        .map(str::trim)
        .filter(|t| !t.is_empty())
}

fn element<'a>(node: Node<'a, 'a>, name: &str, expected: &str) -> Result<Node<'a, 'a>, Problem> {
    below(node, name).ok_or_else(|| Problem::missing(name, expected))
}

fn number(node: Node<'_, '_>, name: &str) -> Result<Option<f64>, Problem> {
    let Some(found) = below(node, name) else {
        return Ok(None);
    };
    let text = found.text().unwrap_or("").trim();
    let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
    number
        .map(Some)
        .ok_or_else(|| Problem::found(name, format!("{text:?}"), "a number"))
}

/// A length in metres, by its `unit` attribute.
fn length(node: Node<'_, '_>, name: &str) -> Result<Option<f64>, Problem> {
    let Some(length) = number(node, name)? else {
        return Ok(None);
    };
    let unit = below(node, name)
        .and_then(|n| n.attribute("unit"))
        .unwrap_or("m");
    let unit_m = metres(unit.split('/').next().unwrap_or(""));
    let unit_m = unit_m.ok_or_else(|| Problem::found(name, format!("unit {unit}"), "m or km"))?;
    Ok(Some(length * unit_m))
}

fn label(root: Node<'_, '_>) -> Result<Label, Problem> {
    let area = element(
        root,
        "File_Area_Observational",
        "the image's file and array",
    )?;
    let file = text(area, "file_name").ok_or_else(|| Problem::missing("file_name", "a file"))?;
    let array = area
        .children()
        .find(|n| {
            n.tag_name().name().starts_with("Array_2D")
                || n.tag_name().name().starts_with("Array_3D")
        })
        .ok_or_else(|| Problem::missing("Array_2D_Image", "an array of heights"))?;
    let cartography = element(root, "Cartography", "the map the image is on")?;
    let (projection, radius_m) = projection(cartography)?;
    let image = image(array, radius_m)?;
    Ok(Label {
        file: file.to_owned(),
        image,
        map: crs_from_post(cartography)?,
        crs: projection.definition(radius_m),
    })
}

fn image(array: Node<'_, '_>, radius_m: f64) -> Result<Image, Problem> {
    let (mut columns, mut rows) = (None, None);
    for axis in array
        .children()
        .filter(|n| n.tag_name().name() == "Axis_Array")
    {
        let name = text(axis, "axis_name").unwrap_or("");
        let elements = text(axis, "elements").and_then(|t| t.parse::<usize>().ok());
        let elements = elements.ok_or_else(|| Problem::missing("elements", "a whole number"))?;
        match name {
            "Line" => rows = Some(elements),
            "Sample" => columns = Some(elements),
            _ if elements == 1 => {}
            _ => {
                let found = format!("{elements} along {name}");
                return Err(Problem::found("elements", found, "1, a band of heights"));
            }
        }
    }
    if let Some(order) = text(array, "axis_index_order").filter(|&o| o != "Last Index Fastest") {
        let expected = "Last Index Fastest";
        return Err(Problem::found("axis_index_order", order, expected));
    }
    let size = |axis: &str, size: Option<usize>| {
        let expected = format!("an axis {axis} of 2 elements or more");
        size.filter(|&n| n > 1)
            .ok_or_else(|| Problem::missing("Axis_Array", &expected))
    };
    let unit_m = match text(array, "unit") {
        None => 1.0,
        Some(unit) => metres(unit).ok_or_else(|| Problem::found("unit", unit, "m or km"))?,
    };
    let mut unknown = Vec::new();
    if let Some(special) = below(array, "Special_Constants") {
        for constant in special.children().filter(Node::is_element) {
            // Bounds of what is valid are given beside what is not.
            let name = constant.tag_name().name();
            if !name.starts_with("valid") {
                unknown.extend(number(special, name)?);
            }
        }
    }
    let offset = number(array, "offset")?.unwrap_or(0.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "negative and fractional offsets saturate, and no file holds what they point to"
    )]
    let offset = offset as u64;
    Ok(Image {
        columns: size("Sample", columns)?,
        rows: size("Line", rows)?,
        offset,
        sample: sample_type(array)?,
        prefix: 0,
        suffix: 0,
        scale: number(array, "scaling_factor")?.unwrap_or(1.0) * unit_m,
        shift: height_shift_m(
            number(array, "value_offset")?.unwrap_or(0.0) * unit_m,
            radius_m,
        ),
        unknown,
    })
}

fn sample_type(array: Node<'_, '_>) -> Result<SampleType, Problem> {
    let expected = "a type such as SignedLSB2 or IEEE754LSBSingle";
    let name = text(array, "data_type").ok_or_else(|| Problem::missing("data_type", expected))?;
    let of = |kind, bytes, is_little_endian| SampleType {
        kind,
        bytes,
        is_little_endian,
    };
    let bytes = || {
        name.chars()
            .last()
            .and_then(|c| c.to_digit(10))
            .filter(|n| [2, 4, 8].contains(n))
    };
    let whole = |kind, is_little_endian| {
        let bytes = bytes().ok_or_else(|| Problem::found("data_type", name, expected))?;
        Ok(of(kind, bytes as usize, is_little_endian))
    };
    match name {
        "IEEE754LSBSingle" => Ok(of(Kind::Real, 4, true)),
        "IEEE754MSBSingle" => Ok(of(Kind::Real, 4, false)),
        "IEEE754LSBDouble" => Ok(of(Kind::Real, 8, true)),
        "IEEE754MSBDouble" => Ok(of(Kind::Real, 8, false)),
        "UnsignedByte" => Ok(of(Kind::Unsigned, 1, true)),
        "SignedByte" => Ok(of(Kind::Signed, 1, true)),
        _ if name.starts_with("SignedLSB") => whole(Kind::Signed, true),
        _ if name.starts_with("SignedMSB") => whole(Kind::Signed, false),
        _ if name.starts_with("UnsignedLSB") => whole(Kind::Unsigned, true),
        _ if name.starts_with("UnsignedMSB") => whole(Kind::Unsigned, false),
        _ => Err(Problem::found("data_type", name, expected)),
    }
}

/// The projection, and the radius of its sphere in metres.
fn projection(cartography: Node<'_, '_>) -> Result<(Projection, f64), Problem> {
    let map = element(cartography, "Map_Projection", "the projection")?;
    let name = text(map, "map_projection_name").unwrap_or("");
    let sign = match text(cartography, "longitude_direction") {
        Some(direction) if direction.contains("West") => -1.0,
        _ => 1.0,
    };
    let degrees = |names: &[&str]| -> Result<f64, Problem> {
        for name in names {
            if let Some(degrees) = number(map, name)? {
                return Ok(degrees);
            }
        }
        Err(Problem::missing(names[0], "a number of degrees"))
    };
    let meridians = [
        "longitude_of_central_meridian",
        "straight_vertical_longitude_from_pole",
    ];
    let lon_deg = sign * degrees(&meridians)?;
    let projection = match name {
        "Equirectangular" | "Equidistant Cylindrical" | "Simple Cylindrical" => {
            Projection::Equirectangular {
                true_lat_deg: number(map, "standard_parallel_1")?.unwrap_or(0.0),
                lon_deg,
            }
        }
        "Sinusoidal" => Projection::Sinusoidal { lon_deg },
        "Polar Stereographic" => {
            let field = "latitude_of_projection_origin";
            Projection::PolarStereographic {
                is_north: is_north(field, degrees(&[field, "standard_parallel_1"])?)?,
                lon_deg,
                scale: number(map, "scale_factor_at_projection_origin")?.unwrap_or(1.0),
            }
        }
        _ => {
            let expected = "Equirectangular, Sinusoidal or Polar Stereographic";
            let found = format!("{name:?}");
            return Err(Problem::found("map_projection_name", found, expected));
        }
    };
    let axis = |names: [&str; 2]| -> Result<Option<f64>, Problem> {
        for name in names {
            if let Some(radius) = length(cartography, name)? {
                return Ok(Some(radius));
            }
        }
        Ok(None)
    };
    let equatorial_m = axis(["a_axis_radius", "semi_major_radius"])?
        .filter(|&radius| radius > 0.0)
        .ok_or_else(|| Problem::missing("a_axis_radius", "the body's radius"))?;
    let polar_m = axis(["c_axis_radius", "polar_radius"])?;
    Ok((projection, projection.radius_m(equatorial_m, polar_m)))
}

/// The upper left corner is that of the first pixel, and posts are in the middle of theirs.
fn crs_from_post(cartography: Node<'_, '_>) -> Result<Affine, Problem> {
    let required = |name: &str| -> Result<f64, Problem> {
        length(cartography, name)?.ok_or_else(|| Problem::missing(name, "a length"))
    };
    let (step_x, step_y) = (
        required("pixel_resolution_x")?,
        required("pixel_resolution_y")?,
    );
    let corner_x = required("upperleft_corner_x")?;
    let corner_y = required("upperleft_corner_y")?;
    let first = [corner_x + 0.5 * step_x, corner_y - 0.5 * step_y];
    Ok(Affine::north_up_by(first, [step_x, step_y]))
}
