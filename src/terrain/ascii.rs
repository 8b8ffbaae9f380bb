//! Height models in ESRI's ASCII grid format: a few words of header, then heights from the north on.

use std::path::Path;

use super::grid::{Affine, HeightGrid, Posts};
use crate::error::{Error, Fault, Place};
use crate::frame::Crs;

/// What a height is written as where it is unknown and the header does not say.
const NODATA: f64 = -9999.0;

/// The most posts a file may hold.
const MAX_POSTS: usize = 1 << 31;

/// Reads a height model from an ESRI ASCII grid. The coordinate reference system stands, as WKT, in a
/// file of the same name that ends in `.prj`. Posts are the centres of the cells, wherever the header
/// ties the grid (`xllcorner` or `xllcenter`). Messages call the file `shown`.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, and faults with their line where the header, a height,
/// or the file beside it does not serve.
pub fn read_ascii_grid(path: &Path, shown: &str) -> Result<HeightGrid, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, "read", error))?;
    let crs = beside(path, shown)?;
    Ok(grid(&text, shown, &crs)?)
}

/// Whether a file begins like an ESRI ASCII grid.
pub(super) fn is_ascii_grid(start: &[u8]) -> bool {
    let first = start.trim_ascii_start();
    first.len() > 5
        && (first[..5].eq_ignore_ascii_case(b"ncols") || first[..5].eq_ignore_ascii_case(b"nrows"))
}

/// The coordinate reference system in the `.prj` file.
fn beside(path: &Path, shown: &str) -> Result<String, Error> {
    let prj = path.with_extension("prj");
    let name = Path::new(shown).with_extension("prj");
    let text = match std::fs::read_to_string(&prj) {
        Ok(text) => text.trim().to_owned(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let found = format!("no {} beside it", name.display());
            let expected = "one that names the coordinate reference system, as WKT";
            return Err(Fault::found(Place::file(shown), "crs", found, expected).into());
        }
        Err(error) => return Err(Error::io(&prj, "read", error)),
    };
    // Of all that PROJ understands only WKT is what this file holds.
    let is_wkt = text.ends_with(']') && text.contains('[');
    if !is_wkt || Crs::check(&text).is_err() {
        let first: String = text.lines().next().unwrap_or("").chars().take(60).collect();
        let place = Place::file(name.display().to_string());
        let expected = "a coordinate reference system as WKT that PROJ understands";
        return Err(Fault::found(place, "", format!("{first:?}"), expected).into());
    }
    Ok(text)
}

/// The header's words, each with its line.
#[derive(Default)]
struct Header {
    columns: Option<usize>,
    rows: Option<usize>,
    /// First coordinate of the first column, and whether it is of its cell's middle.
    west: Option<(f64, bool)>,
    /// Second coordinate of the last row, likewise.
    south: Option<(f64, bool)>,
    step_x: Option<f64>,
    step_y: Option<f64>,
    nodata: Option<f64>,
}

impl Header {
    /// Takes a line in; `false` where it is none of a header.
    fn take(&mut self, line: &str, place: &Place) -> Result<bool, Fault> {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else {
            return Ok(true);
        };
        let value = words.next().unwrap_or("");
        let fault = |expected: &str| {
            let found = if value.is_empty() {
                "nothing".to_owned()
            } else {
                format!("{value:?}")
            };
            Fault::found(place.clone(), key, found, expected)
        };
        let count = || {
            let count = value
                .parse::<usize>()
                .ok()
                .filter(|&n| n > 1 && n < MAX_POSTS);
            count.ok_or_else(|| fault("a whole number above 1"))
        };
        let number = || {
            let number = value.parse::<f64>().ok().filter(|x| x.is_finite());
            number.ok_or_else(|| fault("a number"))
        };
        let step = || {
            number()
                .ok()
                .filter(|&x| x > 0.0)
                .ok_or_else(|| fault("a number above zero"))
        };
        match key.to_ascii_lowercase().as_str() {
            "ncols" => self.columns = Some(count()?),
            "nrows" => self.rows = Some(count()?),
            "xllcorner" => self.west = Some((number()?, false)),
            "xllcenter" => self.west = Some((number()?, true)),
            "yllcorner" => self.south = Some((number()?, false)),
            "yllcenter" => self.south = Some((number()?, true)),
            "cellsize" => (self.step_x, self.step_y) = (Some(step()?), Some(step()?)),
            "dx" => self.step_x = Some(step()?),
            "dy" => self.step_y = Some(step()?),
            "nodata_value" => {
                let number = value.parse::<f64>().ok();
                self.nodata = Some(number.ok_or_else(|| fault("a number"))?);
            }
            _ if key.starts_with(|c: char| c.is_ascii_alphabetic()) && !is_height(key) => {
                let expected = "ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, \
                                cellsize, NODATA_value, or heights";
                return Err(Fault::found(
                    place.clone(),
                    "",
                    format!("{key:?}"),
                    expected,
                ));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

/// Whether a word that begins with a letter is a number all the same: nan, inf.
fn is_height(word: &str) -> bool {
    word.parse::<f64>().is_ok()
}

fn grid(text: &str, shown: &str, crs: &str) -> Result<HeightGrid, Fault> {
    let mut header = Header::default();
    let mut lines = (1u64..).zip(text.lines()).peekable();
    while let Some(&(number, line)) = lines.peek() {
        if !header.take(line, &Place::line(shown, number))? {
            break;
        }
        lines.next();
    }
    let missing = |key: &str| {
        let place = Place::file(shown);
        Fault::found(place, key, "nothing", "it in the header")
    };
    let columns = header.columns.ok_or_else(|| missing("ncols"))?;
    let rows = header.rows.ok_or_else(|| missing("nrows"))?;
    let (west, at_middle_x) = header.west.ok_or_else(|| missing("xllcorner"))?;
    let (south, at_middle_y) = header.south.ok_or_else(|| missing("yllcorner"))?;
    let step_x = header.step_x.ok_or_else(|| missing("cellsize"))?;
    let step_y = header.step_y.ok_or_else(|| missing("cellsize"))?;
    let heights = heights(lines, header.nodata.unwrap_or(NODATA), shown)?;
    let count = columns.saturating_mul(rows);
    if heights.len() != count {
        let found = format!("{} heights", heights.len());
        let expected = format!("{count}, one for each of {columns} x {rows} posts");
        return Err(Fault::found(Place::file(shown), "", found, expected));
    }
    if heights.iter().all(|h| h.is_nan()) {
        return Err(Fault::found(
            Place::file(shown),
            "",
            "no known height",
            "some",
        ));
    }
    let middle = |is_middle: bool| if is_middle { 0.0 } else { 0.5 };
    #[expect(clippy::cast_precision_loss, reason = "rows are under 2^31")]
    let up = (rows - 1) as f64 + middle(at_middle_y);
    let first = [west + middle(at_middle_x) * step_x, south + up * step_y];
    let map = Affine::north_up_by(first, [step_x, step_y]);
    HeightGrid::new(columns, rows, Posts::F64(heights), map, crs)
        .map_err(|error| Fault::new(Place::file(shown), "", error.to_string()))
}

fn heights<'a>(
    lines: impl Iterator<Item = (u64, &'a str)>,
    nodata: f64,
    shown: &str,
) -> Result<Vec<f64>, Fault> {
    let mut heights = Vec::new();
    for (number, line) in lines {
        for word in line.split_whitespace() {
            let height = word.parse::<f64>().map_err(|_| {
                Fault::found(
                    Place::line(shown, number),
                    "",
                    format!("{word:?}"),
                    "a height",
                )
            })?;
            let known = height.is_finite() && height != nodata;
            heights.push(if known { height } else { f64::NAN });
        }
    }
    Ok(heights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Planet;

    const UTM: &str = "PROJCS[\"WGS_1984_UTM_Zone_32N\",GEOGCS[\"GCS_WGS_1984\",\
        DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],\
        PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],\
        PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],\
        PARAMETER[\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",9.0],\
        PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],\
        UNIT[\"Meter\",1.0]]";

    const CORNER: &str = "ncols 3\nnrows 2\nxllcorner 456000\nyllcorner 5427000\ncellsize 2\n\
        NODATA_value -99\n1 2 3\n4 -99 6.5\n";

    fn read(text: &str, prj: Option<&str>) -> Result<HeightGrid, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dem.asc");
        std::fs::write(&path, text).unwrap();
        if let Some(prj) = prj {
            std::fs::write(folder.path().join("dem.prj"), prj).unwrap();
        }
        crate::terrain::read_heights(&path, "data/dem.asc").map_err(|error| error.to_string())
    }

    #[test]
    fn corners_and_centres_put_the_same_posts() {
        let grid = read(CORNER, Some(UTM)).unwrap();
        assert_eq!((grid.columns(), grid.rows()), (3, 2));
        assert_eq!(
            grid.crs_from_post().apply(0.0, 0.0),
            (456_001.0, 5_427_003.0)
        );
        assert_eq!(
            grid.crs_from_post().apply(2.0, 1.0),
            (456_005.0, 5_427_001.0)
        );
        assert_eq!((grid.height_m(2, 1), grid.height_m(0, 0)), (6.5, 1.0));
        assert!(grid.height_m(1, 1).is_nan());
        let crs = Crs::new(grid.crs(), Planet::EARTH).unwrap();
        let (x, y) = crs.xy(8.4f64.to_radians(), 49f64.to_radians()).unwrap();
        assert!((x - 456_114.595_9).abs() < 1e-3 && (y - 5_427_629.203_9).abs() < 1e-3);
        let centre = CORNER
            .replace("xllcorner 456000", "XLLCENTER 456001")
            .replace("yllcorner 5427000", "YLLCENTER 5427001")
            .replace("cellsize 2", "dx 2\ndy 2.0");
        assert_eq!(read(&centre, Some(UTM)).unwrap(), grid);
    }

    #[test]
    fn a_grid_without_a_nodata_line_has_the_usual_one() {
        let text = CORNER
            .replace("NODATA_value -99\n", "")
            .replace("-99 6.5", "-9999 nan");
        let grid = read(&text, Some(UTM)).unwrap();
        assert!(grid.height_m(1, 1).is_nan() && grid.height_m(2, 1).is_nan());
    }

    #[test]
    fn what_does_not_serve_is_told_exactly() {
        for (from, to, expected) in [
            (
                "ncols 3",
                "ncols 1",
                ":1: ncols: found \"1\", expected a whole number above 1",
            ),
            (
                "nrows 2",
                "nrows",
                ":2: nrows: found nothing, expected a whole number above 1",
            ),
            (
                "cellsize 2",
                "cellsize 0",
                ":5: cellsize: found \"0\", expected a number above zero",
            ),
            (
                "cellsize 2\n",
                "",
                ": cellsize: found nothing, expected it in the header",
            ),
            (
                "xllcorner 456000",
                "xllcorner west",
                ":3: xllcorner: found \"west\", expected a number",
            ),
            (
                "yllcorner",
                "ylcorner",
                ":4: found \"ylcorner\", expected ncols, nrows, xllcorner or xllcenter, yllcorner or \
                 yllcenter, cellsize, NODATA_value, or heights",
            ),
            ("4 -99 6.5", "4 x 6.5", ":8: found \"x\", expected a height"),
            (
                "4 -99 6.5",
                "4 -99",
                ": found 5 heights, expected 6, one for each of 3 x 2 posts",
            ),
            (
                "1 2 3\n4 -99 6.5",
                "-99 -99 -99 -99 -99 -99",
                ": found no known height, expected some",
            ),
        ] {
            let error = read(&CORNER.replace(from, to), Some(UTM)).unwrap_err();
            assert_eq!(error, format!("data/dem.asc{expected}"));
        }
        assert_eq!(
            read(CORNER, None).unwrap_err(),
            "data/dem.asc: crs: found no data/dem.prj beside it, expected one that names the coordinate \
             reference system, as WKT"
        );
        assert_eq!(
            read(CORNER, Some("Projection UTM\nZone 32")).unwrap_err(),
            "data/dem.prj: found \"Projection UTM\", expected a coordinate reference system as WKT \
             that PROJ understands"
        );
    }
}
