//! Where the posts of a GeoTIFF stand.

use super::keys::KeyFault;
use crate::terrain::Affine;

/// Where the posts stand: by one tie point and a pixel scale, or by a matrix (clause 7.4 of the
/// standard). Pixels are areas unless the file says points, and a post is in the middle of its.
///
/// # Errors
/// Where none of these is given, or more tie points than one alone.
pub(super) fn crs_from_post(
    matrix: &[f64],
    tie: &[f64],
    scale: &[f64],
    is_point: bool,
) -> Result<Affine, KeyFault> {
    let corner = match (matrix, tie, scale) {
        (&[a, b, _, x, c, d, _, y, ..], _, _) => Affine {
            x0: x,
            x_column: a,
            x_row: b,
            y0: y,
            y_column: c,
            y_row: d,
        },
        (_, &[i, j, _, x, y, _, ..], &[sx, sy, ..]) => {
            let middle = if is_point { 0.0 } else { 0.5 };
            let first = [x + (middle - i) * sx, y - (middle - j) * sy];
            return Ok(Affine::north_up_by(first, [sx, sy]));
        }
        (_, tie, _) if tie.len() > 6 => {
            return Err(found(
                "ModelTiepoint",
                format!("{} tie points without ModelPixelScale", tie.len() / 6),
                "one and ModelPixelScale, or ModelTransformation",
            ));
        }
        _ => {
            return Err(found(
                "",
                "no georeferencing",
                "ModelTiepoint and ModelPixelScale, or ModelTransformation",
            ));
        }
    };
    let (x0, y0) = if is_point {
        (corner.x0, corner.y0)
    } else {
        corner.apply(0.5, 0.5)
    };
    Ok(Affine { x0, y0, ..corner })
}

fn found(key: &'static str, found: impl std::fmt::Display, expected: &str) -> KeyFault {
    KeyFault::new(key, format!("found {found}, expected {expected}"))
}
