//! Writes height models as GeoTIFF files.

use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;

use tiff::TiffError;
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{
    Compression, DirectoryEncoder, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype,
};
use tiff::tags::Tag;

use crate::error::Error;
use crate::frame::{Crs, Planet};
use crate::terrain::{HeightGrid, Posts};

use super::keys::{
    CITATION, GEOG_ANGULAR_UNITS, GEOG_SEMI_MAJOR, GEOG_SEMI_MINOR, GEOGRAPHIC_TYPE, MODEL_TYPE,
    PROJ_LINEAR_UNITS, PROJECTED_TYPE, RASTER_TYPE, USER_DEFINED,
};

/// Files of more than this many bytes of heights are written as `BigTIFF`.
const LARGEST_CLASSIC: u64 = 3 << 30;

/// Writes a height model: one band in the precision it is held in, deflated, posts at the centres
/// of the pixels, unknown ones NaN, and the keys of its CRS. A CRS by another authority than EPSG is
/// named in the citation, which [`super::read_geotiff`] understands.
///
/// # Errors
/// [`Error::Io`] where the file cannot be written, [`Error::Output`] where the CRS is neither by an
/// authority's code nor geographic, or unknown on the planet.
pub fn write_geotiff(path: &Path, grid: &HeightGrid, planet: Planet) -> Result<(), Error> {
    let keys = Keys::of(grid, planet)?;
    let file = File::create(path).map_err(|error| Error::io(path, "create", error))?;
    let mut file = BufWriter::new(file);
    let bytes = grid.posts().len() as u64
        * match grid.posts() {
            Posts::F32(_) => 4,
            Posts::F64(_) => 8,
        };
    let written = if bytes > LARGEST_CLASSIC {
        write::<_, TiffKindBig>(&mut file, grid, &keys)
    } else {
        write::<_, TiffKindStandard>(&mut file, grid, &keys)
    };
    let written = written.and_then(|()| Ok(file.flush()?));
    written.map_err(|error| match error {
        TiffError::IoError(error) => Error::io(path, "write", error),
        other => Error::Output(format!("{}: cannot write: {other}", path.display())),
    })
}

fn write<W: Write + Seek, K: TiffKind>(
    file: W,
    grid: &HeightGrid,
    keys: &Keys,
) -> Result<(), TiffError> {
    let compression = Compression::Deflate(DeflateLevel::Balanced);
    let mut encoder = TiffEncoder::<W, K>::new_generic(file)?.with_compression(compression);
    let (width, height) = (u32::try_from(grid.columns())?, u32::try_from(grid.rows())?);
    match grid.posts() {
        Posts::F32(posts) => {
            let mut image = encoder.new_image::<colortype::Gray32Float>(width, height)?;
            keys.write(image.encoder(), grid)?;
            image.write_data(posts)
        }
        Posts::F64(posts) => {
            let mut image = encoder.new_image::<colortype::Gray64Float>(width, height)?;
            keys.write(image.encoder(), grid)?;
            image.write_data(posts)
        }
    }
}

/// The tags of the standard that tell where the posts are.
struct Keys {
    directory: Vec<u16>,
    doubles: Vec<f64>,
    text: String,
}

impl Keys {
    fn of(grid: &HeightGrid, planet: Planet) -> Result<Self, Error> {
        let crs = Crs::new(grid.crs(), planet).map_err(|error| Error::Output(error.to_string()))?;
        let model_type = if in_degrees(&crs, grid) { 2 } else { 1 };
        let mut keys = Self {
            directory: vec![1, 1, 0, 0],
            doubles: Vec::new(),
            text: String::new(),
        };
        keys.code(MODEL_TYPE, model_type);
        keys.code(RASTER_TYPE, 1);
        let own = if model_type == 2 {
            GEOGRAPHIC_TYPE
        } else {
            PROJECTED_TYPE
        };
        let epsg = grid
            .crs()
            .strip_prefix("EPSG:")
            .and_then(|code| code.parse().ok());
        let is_code = grid.crs().split_once(':').is_some_and(|(authority, code)| {
            !authority.contains(char::is_whitespace) && code.bytes().all(|b| b.is_ascii_digit())
        });
        if let Some(code) = epsg {
            keys.code(own, code);
        } else if is_code || model_type == 2 {
            if is_code {
                keys.citation(grid.crs());
            }
            // The axes come before what they define a projection of: keys are in rising order.
            keys.code(GEOGRAPHIC_TYPE, USER_DEFINED);
            let ellipsoid = planet.ellipsoid;
            keys.code(GEOG_ANGULAR_UNITS, 9102);
            keys.number(GEOG_SEMI_MAJOR, ellipsoid.a);
            keys.number(GEOG_SEMI_MINOR, ellipsoid.a * (1.0 - ellipsoid.f));
            if model_type == 1 {
                keys.code(PROJECTED_TYPE, USER_DEFINED);
                keys.code(PROJ_LINEAR_UNITS, 9001);
            }
        } else {
            return Err(Error::Output(format!(
                "found the CRS {:?}, expected an authority's code such as EPSG:32719 to write a GeoTIFF in",
                grid.crs()
            )));
        }
        Ok(keys)
    }

    fn code(&mut self, key: u16, code: u16) {
        self.entry([key, 0, 1, code]);
    }

    #[expect(clippy::cast_possible_truncation, reason = "there are two at most")]
    fn number(&mut self, key: u16, number: f64) {
        self.entry([key, 34736, 1, self.doubles.len() as u16]);
        self.doubles.push(number);
    }

    #[expect(clippy::cast_possible_truncation, reason = "a code is a few letters")]
    fn citation(&mut self, text: &str) {
        self.text = format!("{text}|");
        self.entry([CITATION, 34737, self.text.len() as u16, 0]);
    }

    fn entry(&mut self, entry: [u16; 4]) {
        self.directory.extend(entry);
        self.directory[3] += 1;
    }

    fn write<W: Write + Seek, K: TiffKind>(
        &self,
        tags: &mut DirectoryEncoder<'_, W, K>,
        grid: &HeightGrid,
    ) -> Result<(), TiffError> {
        let map = grid.crs_from_post();
        if map.x_row == 0.0 && map.y_column == 0.0 && map.x_column > 0.0 && map.y_row < 0.0 {
            let scale = [map.x_column, -map.y_row, 0.0];
            tags.write_tag(Tag::ModelPixelScaleTag, &scale[..])?;
            // The first post, the middle of the first pixel.
            let tie = [0.5, 0.5, 0.0, map.x0, map.y0, 0.0];
            tags.write_tag(Tag::ModelTiepointTag, &tie[..])?;
        } else {
            let (x, y) = map.apply(-0.5, -0.5);
            let rows = [
                [map.x_column, map.x_row, 0.0, x],
                [map.y_column, map.y_row, 0.0, y],
                [0.0; 4],
                [0.0, 0.0, 0.0, 1.0],
            ];
            tags.write_tag(Tag::ModelTransformationTag, rows.as_flattened())?;
        }
        tags.write_tag(Tag::GeoKeyDirectoryTag, &self.directory[..])?;
        if !self.doubles.is_empty() {
            tags.write_tag(Tag::GeoDoubleParamsTag, &self.doubles[..])?;
        }
        if !self.text.is_empty() {
            tags.write_tag(Tag::GeoAsciiParamsTag, self.text.as_str())?;
        }
        if (0..grid.posts().len()).any(|i| grid.posts().get(i).is_nan()) {
            tags.write_tag(Tag::GdalNodata, "nan")?;
        }
        Ok(())
    }
}

/// Whether a raster's CRS is in longitude and latitude: whether its coordinates are those.
#[expect(clippy::cast_precision_loss, reason = "rasters have under 2^53 posts")]
fn in_degrees(crs: &Crs, grid: &HeightGrid) -> bool {
    let near = |a: f64, b: f64| {
        let turn = (a - b).rem_euclid(360.0);
        turn.min(360.0 - turn) < 0.01
    };
    // Two places: a projection's own origin reads zero as longitude and latitude may.
    let last = ((grid.columns() - 1) as f64, (grid.rows() - 1) as f64);
    [(0.0, 0.0), last].into_iter().all(|(column, row)| {
        let (x, y) = grid.crs_from_post().apply(column, row);
        crs.lon_lat(x, y).is_ok_and(|(lon, lat)| {
            near(x, lon.to_degrees()) && (y - lat.to_degrees()).abs() < 0.01
        })
    })
}
