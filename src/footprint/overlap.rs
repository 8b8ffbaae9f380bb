//! Where the ground is seen by several views.

use geo::{BooleanOps, MultiPolygon};

/// The part of the plane that at least `k` of these areas cover; for `k` = 0 nothing, since the
/// whole plane is no area.
///
/// Sweeps over the areas keeping "seen by at least 1, 2 ... k so far": an area lifts whatever it
/// covers by one level.
pub fn seen_by_at_least<'a>(
    areas: impl IntoIterator<Item = &'a MultiPolygon<f64>>,
    k: usize,
) -> MultiPolygon<f64> {
    let mut levels = vec![MultiPolygon::new(Vec::new()); k];
    for area in areas {
        for level in (1..k).rev() {
            let lifted = levels[level - 1].intersection(area);
            if !lifted.0.is_empty() {
                levels[level] = levels[level].union(&lifted);
            }
        }
        if let Some(lowest) = levels.first_mut() {
            *lowest = lowest.union(area);
        }
    }
    levels
        .pop()
        .unwrap_or_else(|| MultiPolygon::new(Vec::new()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geo::{Area, Rect, coord};

    fn square(east: f64, north: f64, side: f64) -> MultiPolygon<f64> {
        let far = coord! { x: east + side, y: north + side };
        Rect::new(coord! { x: east, y: north }, far)
            .to_polygon()
            .into()
    }

    #[test]
    fn identical_touching_and_partial_overlaps() {
        let areas = [
            square(0.0, 0.0, 2.0),
            square(0.0, 0.0, 2.0), // identical
            square(2.0, 0.0, 2.0), // touches along an edge
            square(1.0, 1.0, 2.0), // overlaps all of them
        ];
        let seen = |k| seen_by_at_least(&areas, k).unsigned_area();
        assert!((seen(1) - 10.0).abs() < 1e-6, "{}", seen(1));
        assert!((seen(2) - 5.0).abs() < 1e-6, "{}", seen(2));
        assert!((seen(3) - 1.0).abs() < 1e-6, "{}", seen(3));
        assert!(seen(4).abs() < 1e-6 && seen(0) == 0.0);
    }

    #[test]
    fn counts_agree_with_sampling() {
        let areas: Vec<_> = (0..9)
            .map(|i| square(f64::from(i % 3) * 0.7, f64::from(i / 3) * 0.6, 1.0))
            .collect();
        for k in 1..=4 {
            let region = seen_by_at_least(&areas, k);
            let mut agree = 0;
            for i in 0..2500 {
                let (x, y) = (
                    f64::from(i % 50) * 0.05 + 0.013,
                    f64::from(i / 50) * 0.05 + 0.017,
                );
                let covers = |area: &MultiPolygon<f64>| {
                    geo::Contains::contains(area, &coord! { x: x, y: y })
                };
                let count = areas.iter().filter(|a| covers(a)).count();
                agree += usize::from(covers(&region) == (count >= k));
            }
            assert_eq!(agree, 2500, "k = {k}");
        }
    }
}
