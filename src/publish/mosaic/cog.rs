//! A mosaic as a cloud-optimised GeoTIFF: tiles with overviews, all directories first, then the
//! tiles from the coarsest overview to the finest (OGC 21-026).

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::{Mosaic, MosaicGrid};
use crate::error::Error;
use crate::frame::Site;

/// Side of a tile, pixels.
const TILE: usize = 256;
/// The largest file of a classic TIFF.
const MOST_BYTES: usize = u32::MAX as usize;

/// One level of the pyramid.
struct Level {
    columns: usize,
    rows: usize,
    rgba: Vec<u8>,
}

/// A tag of a directory: its number, the type of its values, how many, and their bytes.
struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    bytes: Vec<u8>,
}

impl Entry {
    fn shorts(tag: u16, values: &[u16]) -> Self {
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        Self {
            tag,
            kind: 3,
            count: values.len(),
            bytes,
        }
    }

    fn longs(tag: u16, values: &[u32]) -> Self {
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        Self {
            tag,
            kind: 4,
            count: values.len(),
            bytes,
        }
    }

    fn doubles(tag: u16, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        Self {
            tag,
            kind: 12,
            count: values.len(),
            bytes,
        }
    }

    fn text(tag: u16, text: &str) -> Self {
        let mut bytes = text.as_bytes().to_vec();
        bytes.push(0);
        Self {
            tag,
            kind: 2,
            count: bytes.len(),
            bytes,
        }
    }

    /// Bytes beyond the directory itself: values that do not fit into its four.
    fn outside(&self) -> usize {
        if self.bytes.len() > 4 {
            self.bytes.len().next_multiple_of(2)
        } else {
            0
        }
    }
}

/// The bytes of a mosaic's GeoTIFF.
///
/// # Errors
/// More bytes than a TIFF may have.
pub fn encode(mosaic: Mosaic, site: &Site) -> Result<Vec<u8>, Error> {
    let geo = geo_entries(&mosaic.grid, site);
    let levels = pyramid(mosaic);
    let tiles: Vec<Vec<Vec<u8>>> = levels.iter().map(tiles).collect::<Result<_, _>>()?;
    // What a directory takes does not depend on the offsets in it.
    let no_offsets = vec![0; tiles.len()];
    let sizes: Vec<usize> = (0..levels.len())
        .map(|i| size(&entries(i, &levels[i], &tiles[i], no_offsets[i], &geo)))
        .collect();
    let mut begin = vec![0; levels.len()];
    let mut at = 8 + sizes.iter().sum::<usize>();
    for i in (0..levels.len()).rev() {
        begin[i] = at;
        at += tiles[i].iter().map(Vec::len).sum::<usize>();
    }
    if at > MOST_BYTES {
        let text = format!("mosaic.tif: found {at} bytes, expected at most {MOST_BYTES}");
        return Err(Error::Output(text));
    }
    let mut file = Vec::with_capacity(at);
    file.extend_from_slice(b"II*\0");
    file.extend_from_slice(&long(8).to_le_bytes());
    for i in 0..levels.len() {
        let next = if i + 1 < levels.len() {
            file.len() + sizes[i]
        } else {
            0
        };
        directory(
            &mut file,
            &entries(i, &levels[i], &tiles[i], begin[i], &geo),
            next,
        );
    }
    for tile in tiles.iter().rev().flatten() {
        file.extend_from_slice(tile);
    }
    Ok(file)
}

/// The mosaic and its overviews, each half the one before, to one tile.
fn pyramid(mosaic: Mosaic) -> Vec<Level> {
    let mut levels = vec![Level {
        columns: mosaic.grid.columns,
        rows: mosaic.grid.rows,
        rgba: mosaic.rgba,
    }];
    while let Some(last) = levels.last()
        && last.columns.max(last.rows) > TILE
    {
        levels.push(half(last));
    }
    levels
}

/// Half the size: means of the opaque of two by two pixels; opaque where two or more are.
fn half(level: &Level) -> Level {
    let (columns, rows) = (level.columns.div_ceil(2), level.rows.div_ceil(2));
    let pixel = |column: usize, row: usize| {
        let mut sum = [0_u32; 3];
        let (mut opaque, mut all) = (0, 0);
        for (c, r) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (c, r) = (2 * column + c, 2 * row + r);
            if c >= level.columns || r >= level.rows {
                continue;
            }
            all += 1;
            let at = 4 * (r * level.columns + c);
            if level.rgba[at + 3] > 0 {
                opaque += 1;
                (0..3).for_each(|i| sum[i] += u32::from(level.rgba[at + i]));
            }
        }
        if opaque == 0 || 2 * opaque < all {
            return [0; 4];
        }
        let mean = |sum: u32| u8::try_from((sum + opaque / 2) / opaque).unwrap_or(u8::MAX);
        [mean(sum[0]), mean(sum[1]), mean(sum[2]), 255]
    };
    let rgba = (0..rows)
        .into_par_iter()
        .flat_map_iter(|row| (0..columns).flat_map(move |column| pixel(column, row)))
        .collect();
    Level {
        columns,
        rows,
        rgba,
    }
}

/// The tiles of a level, row by row, deflated; beyond its edges they are empty.
fn tiles(level: &Level) -> Result<Vec<Vec<u8>>, Error> {
    let (across, down) = (level.columns.div_ceil(TILE), level.rows.div_ceil(TILE));
    (0..across * down)
        .into_par_iter()
        .map(|i| {
            let (left, top) = (i % across * TILE, i / across * TILE);
            let mut raw = vec![0; TILE * TILE * 4];
            for row in 0..TILE.min(level.rows - top) {
                let width = TILE.min(level.columns - left) * 4;
                let from = 4 * ((top + row) * level.columns + left);
                let line = &mut raw[row * TILE * 4..][..TILE * 4];
                line[..width].copy_from_slice(&level.rgba[from..from + width]);
                // Predictor 2: each sample as its difference from the pixel before.
                for at in (4..TILE * 4).rev() {
                    line[at] = line[at].wrapping_sub(line[at - 4]);
                }
            }
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            let deflated = encoder.write_all(&raw).and_then(|()| encoder.finish());
            deflated.map_err(|e| Error::Output(format!("mosaic.tif: cannot deflate: {e}")))
        })
        .collect()
}

/// The tags of a level whose tiles begin at `begin`, in rising order.
fn entries(
    index: usize,
    level: &Level,
    tiles: &[Vec<u8>],
    begin: usize,
    geo: &[Entry],
) -> Vec<Entry> {
    let mut at = begin;
    let offsets: Vec<u32> = tiles
        .iter()
        .map(|tile| {
            let here = at;
            at += tile.len();
            long(here)
        })
        .collect();
    let counts: Vec<u32> = tiles.iter().map(|tile| long(tile.len())).collect();
    let side = u16::try_from(TILE).unwrap_or(u16::MAX);
    let mut entries = vec![
        Entry::longs(254, &[u32::from(index > 0)]), // a reduced image
        Entry::longs(256, &[long(level.columns)]),
        Entry::longs(257, &[long(level.rows)]),
        Entry::shorts(258, &[8; 4]), // bits a sample
        Entry::shorts(259, &[8]),    // deflate
        Entry::shorts(262, &[2]),    // red, green, blue
        Entry::shorts(277, &[4]),    // samples a pixel
        Entry::shorts(284, &[1]),    // pixel by pixel
        Entry::shorts(317, &[2]),    // horizontal differences
        Entry::shorts(322, &[side]),
        Entry::shorts(323, &[side]),
        Entry::longs(324, &offsets),
        Entry::longs(325, &counts),
        Entry::shorts(338, &[2]), // the fourth is opacity, not multiplied in
    ];
    if index == 0 {
        entries.extend(geo.iter().map(|e| Entry {
            bytes: e.bytes.clone(),
            ..*e
        }));
    }
    entries
}

/// Where the mosaic is (OGC 19-008r4): the corner and size of pixels, and the keys of its CRS.
fn geo_entries(grid: &MosaicGrid, site: &Site) -> Vec<Entry> {
    let step = grid.scale.m_per_px;
    let mut keys: Vec<[u16; 4]> = vec![[1024, 0, 1, 1], [1025, 0, 1, 1]];
    let mut doubles: Vec<f64> = Vec::new();
    let mut text = String::new();
    let epsg = grid
        .crs
        .strip_prefix("EPSG:")
        .and_then(|code| code.parse().ok());
    match epsg {
        Some(code) => keys.push([3072, 0, 1, code]),
        None => {
            text = format!("{} local transverse Mercator|", site.planet().name);
            let mut number = |key: u16, value: f64| {
                doubles.push(value);
                let last = u16::try_from(doubles.len() - 1).unwrap_or(0);
                [key, 34736, 1, last]
            };
            let (ellipsoid, origin) = (site.planet().ellipsoid, site.origin());
            keys.push([1026, 34737, u16::try_from(text.len()).unwrap_or(0), 0]);
            keys.push([2048, 0, 1, 32767]);
            keys.push([2054, 0, 1, 9102]);
            keys.push(number(2057, ellipsoid.a));
            keys.push(number(2058, ellipsoid.a * (1.0 - ellipsoid.f)));
            keys.extend([[3072, 0, 1, 32767], [3074, 0, 1, 32767], [3075, 0, 1, 1]]);
            keys.push([3076, 0, 1, 9001]);
            // The decimals of the definition, which the coordinates were made by.
            let written = |deg: f64| (deg * 1e6).round() / 1e6;
            keys.push(number(3080, written(origin.lon_deg())));
            keys.push(number(3081, written(origin.lat_deg())));
            keys.push(number(3082, 0.0));
            keys.push(number(3083, 0.0));
            keys.push(number(3092, 1.0));
        }
    }
    let n_keys = u16::try_from(keys.len()).unwrap_or(0);
    let mut words = vec![1, 1, 0, n_keys];
    words.extend(keys.as_flattened());
    let mut entries = vec![
        Entry::doubles(33550, &[step, step, 0.0]),
        Entry::doubles(33922, &[0.0, 0.0, 0.0, grid.west_m, grid.north_m, 0.0]),
        Entry::shorts(34735, &words),
    ];
    if epsg.is_none() {
        entries.push(Entry::doubles(34736, &doubles));
        entries.push(Entry::text(34737, &text));
    }
    entries
}

/// Bytes of a directory with the values outside of it.
fn size(entries: &[Entry]) -> usize {
    2 + 12 * entries.len() + 4 + entries.iter().map(Entry::outside).sum::<usize>()
}

fn directory(file: &mut Vec<u8>, entries: &[Entry], next: usize) {
    let mut outside = file.len() + 2 + 12 * entries.len() + 4;
    let mut values = Vec::new();
    file.extend_from_slice(&u16::try_from(entries.len()).unwrap_or(0).to_le_bytes());
    for entry in entries {
        file.extend_from_slice(&entry.tag.to_le_bytes());
        file.extend_from_slice(&entry.kind.to_le_bytes());
        file.extend_from_slice(&long(entry.count).to_le_bytes());
        if entry.outside() > 0 {
            file.extend_from_slice(&long(outside).to_le_bytes());
            outside += entry.outside();
            values.extend_from_slice(&entry.bytes);
            values.resize(values.len().next_multiple_of(2), 0);
        } else {
            let mut inside = [0; 4];
            inside[..entry.bytes.len()].copy_from_slice(&entry.bytes);
            file.extend_from_slice(&inside);
        }
    }
    file.extend_from_slice(&long(next).to_le_bytes());
    file.extend_from_slice(&values);
}

/// An offset or count; the file's size is checked before any is written.
fn long(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
