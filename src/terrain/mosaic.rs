//! Rasters cut from one and laid side by side again.
//!
//! A raster says nothing beyond its outermost posts, and those of neighbours that were cut along
//! pixel borders stand one step apart: taken by themselves they would leave a gap a cell wide.

use super::grid::{Affine, HeightGrid, Posts};

/// Posts of two rasters coincide where they are this near, in steps between posts.
const ALIGNED: f64 = 1e-3;

/// A mosaic may have this many times the posts of its parts.
const SPARSEST: usize = 2;

/// Joins rasters that follow each other in the list, share their CRS and the lattice of their posts,
/// and together fill the better part of a rectangle. In the mosaic the earlier count where they
/// overlap, as before. Each comes out with the number of its first part.
pub(super) fn join(grids: Vec<HeightGrid>) -> Vec<(usize, HeightGrid)> {
    let mut joined = Vec::new();
    let mut parts: Vec<HeightGrid> = Vec::new();
    let mut first = 0;
    for (number, grid) in grids.into_iter().enumerate() {
        if parts
            .first()
            .is_some_and(|part| offset(part, &grid).is_none())
        {
            joined.extend(finish(first, std::mem::take(&mut parts)));
            first = number;
        }
        parts.push(grid);
    }
    joined.extend(finish(first, parts));
    joined
}

/// Column and row, in the lattice of one raster, of another's first post; `None` where the posts of
/// the two do not stand on one lattice.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "offsets are checked to be within 2^40 posts"
)]
fn offset(base: &HeightGrid, other: &HeightGrid) -> Option<[i64; 2]> {
    let (a, b) = (base.crs_from_post(), other.crs_from_post());
    let inverse = a.inverse()?;
    let position = |column: f64, row: f64| {
        let (x, y) = b.apply(column, row);
        a.solve(&inverse, x, y)
    };
    let first = position(0.0, 0.0).map(f64::round);
    let size = [(other.columns() - 1) as f64, (other.rows() - 1) as f64];
    let aligned = [(0.0, 0.0), (size[0], 0.0), (0.0, size[1])]
        .into_iter()
        .all(|(column, row)| {
            let [c, r] = position(column, row);
            (c - first[0] - column).abs() < ALIGNED && (r - first[1] - row).abs() < ALIGNED
        });
    let near = first.iter().all(|offset| offset.abs() < 2f64.powi(40));
    (aligned && near && base.crs() == other.crs()).then(|| first.map(|offset| offset as i64))
}

fn finish(first: usize, parts: Vec<HeightGrid>) -> Vec<(usize, HeightGrid)> {
    match mosaic(&parts) {
        Some(mosaic) => vec![(first, mosaic)],
        None => (first..).zip(parts).collect(),
    }
}

/// The rasters in one, or `None` where there are not two or they lie too far apart.
#[expect(clippy::cast_precision_loss, reason = "offsets are within 2^40 posts")]
fn mosaic(parts: &[HeightGrid]) -> Option<HeightGrid> {
    let base = parts.first().filter(|_| parts.len() > 1)?;
    let mut extents = Vec::with_capacity(parts.len());
    for part in parts {
        let [column, row] = offset(base, part)?;
        let size = [part.columns(), part.rows()].map(i64::try_from);
        extents.push((column, row, column + size[0].ok()?, row + size[1].ok()?));
    }
    let left = extents.iter().map(|e| e.0).min()?;
    let top = extents.iter().map(|e| e.1).min()?;
    let columns = usize::try_from(extents.iter().map(|e| e.2).max()? - left).ok()?;
    let rows = usize::try_from(extents.iter().map(|e| e.3).max()? - top).ok()?;
    let count = columns.checked_mul(rows)?;
    let own: usize = parts.iter().map(|part| part.posts().len()).sum();
    if count > SPARSEST * own {
        return None;
    }
    let single = parts
        .iter()
        .all(|part| matches!(part.posts(), Posts::F32(_)));
    let mut heights = if single {
        Posts::F32(vec![f32::NAN; count])
    } else {
        Posts::F64(vec![f64::NAN; count])
    };
    for (part, extent) in parts.iter().zip(&extents) {
        let column = usize::try_from(extent.0 - left).ok()?;
        let row = usize::try_from(extent.1 - top).ok()?;
        lay(&mut heights, columns, part, [column, row]);
    }
    let map = base.crs_from_post();
    let (x0, y0) = map.apply(left as f64, top as f64);
    HeightGrid::new(columns, rows, heights, Affine { x0, y0, ..map }, base.crs()).ok()
}

/// Lays a raster into the mosaic, where nothing is known yet.
fn lay(heights: &mut Posts, columns: usize, part: &HeightGrid, [column, row]: [usize; 2]) {
    for r in 0..part.rows() {
        for c in 0..part.columns() {
            let (from, to) = (r * part.columns() + c, (row + r) * columns + column + c);
            match (&mut *heights, part.posts()) {
                (Posts::F32(all), Posts::F32(own)) if all[to].is_nan() => all[to] = own[from],
                (Posts::F64(all), own) if all[to].is_nan() => all[to] = own.get(from),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(west: f64, north: f64, columns: usize, first: f32) -> HeightGrid {
        let heights = (0..columns * 2).map(|_| first).collect();
        let map = Affine::north_up(west, north, 2.0);
        HeightGrid::new(columns, 2, Posts::F32(heights), map, "EPSG:32632").unwrap()
    }

    #[test]
    fn neighbours_close_up_and_the_earlier_counts() {
        let east = grid(456_010.0, 5e6, 3, 2.0);
        let west = grid(456_000.0, 5e6, 5, 1.0);
        let over = grid(456_008.0, 5e6, 2, 9.0);
        let joined = join(vec![east, west, over]);
        assert_eq!(joined.len(), 1);
        let (number, mosaic) = &joined[0];
        assert_eq!((*number, mosaic.columns(), mosaic.rows()), (0, 8, 2));
        assert_eq!(mosaic.crs_from_post().apply(0.0, 0.0), (456_000.0, 5e6));
        let row: Vec<f64> = (0..8).map(|c| mosaic.height_m(c, 1)).collect();
        assert_eq!(row, [1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    }

    #[test]
    fn others_stay_apart_and_keep_their_numbers() {
        let base = || grid(456_000.0, 5e6, 5, 1.0);
        let between_posts = grid(456_011.0, 5e6, 5, 1.0);
        let far = grid(457_000.0, 5e6, 5, 1.0);
        let numbers = |grids| -> Vec<usize> { join(grids).iter().map(|part| part.0).collect() };
        assert_eq!(numbers(vec![base(), between_posts]), [0, 1]);
        assert_eq!(numbers(vec![base(), far]), [0, 1]);
        assert_eq!(
            numbers(vec![base(), base(), grid(1.0, 5e6, 5, 1.0)]),
            [0, 2]
        );
        assert_eq!(numbers(vec![]), Vec::<usize>::new());
    }
}
