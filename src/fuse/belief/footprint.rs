//! How much ground views see, and how much room their readings have.

use std::collections::HashSet;

use rayon::prelude::*;

use super::engine::Engine;
use crate::frame::{Direction, Enu, Pixel, Point, Ray};

/// Cells of ground across the reach of a view.
const CELLS: f64 = 28.0;
/// The share of a picture that shows trusted ground is looked up at this many columns and rows.
const COLUMNS: u32 = 24;
const ROWS: u32 = 16;

impl Engine<'_> {
    /// Measures the ground that views see: of any view, and of a view in the mean; and the room that
    /// their readings have.
    pub(super) fn measure_ground(&mut self) {
        self.volumes = (0..self.n_views())
            .into_par_iter()
            .map(|view| self.volume(view))
            .collect();
        let step_m = (self.reach_m / CELLS).max(1e-3);
        let cells: Vec<Vec<(i64, i64)>> = (0..self.n_views())
            .into_par_iter()
            .map(|view| self.cells(view, step_m))
            .collect();
        let cell_m2 = step_m * step_m;
        #[expect(clippy::cast_precision_loss, reason = "counts")]
        {
            let total: usize = cells.iter().map(Vec::len).sum();
            let mean = total as f64 / self.n_views().max(1) as f64;
            let union: HashSet<(i64, i64)> = cells.into_iter().flatten().collect();
            self.area_m2 = (union.len() as f64 * cell_m2).max(1.0);
            self.view_area_m2 = (mean * cell_m2).max(1.0);
        }
        self.set_typical();
    }

    /// The cells of the ground whose middles a view could see.
    #[expect(clippy::cast_possible_truncation, reason = "a site spans few cells")]
    #[expect(clippy::cast_precision_loss, reason = "a site spans few cells")]
    fn cells(&self, view: usize, step_m: f64) -> Vec<(i64, i64)> {
        let origin = self.poses[view].origin;
        let (least_m, most_m) = (self.ranges_m.0, self.reach_m);
        let index = |x: f64| (x / step_m).floor() as i64;
        let mut cells = Vec::new();
        for i in index(origin.x - most_m)..=index(origin.x + most_m) {
            for j in index(origin.y - most_m)..=index(origin.y + most_m) {
                let (east_m, north_m) = ((i as f64 + 0.5) * step_m, (j as f64 + 0.5) * step_m);
                let range2 = (east_m - origin.x).powi(2) + (north_m - origin.y).powi(2);
                if range2 < least_m * least_m || range2 > most_m * most_m {
                    continue;
                }
                let up_m = self.ground(east_m, north_m).0;
                if self.covers(view, &[east_m, north_m, up_m, 0.0]) {
                    cells.push((i, j));
                }
            }
        }
        cells
    }

    fn covers(&self, view: usize, place: &[f64; 4]) -> bool {
        let platform = &self.platforms[view];
        let seen = super::expect::expect(platform, &self.poses[view], place, 0.0);
        let Some(seen) = seen else { return false };
        match platform.camera.as_deref() {
            Some(camera) => {
                Pixel::new(seen.values[0], seen.values[1]).is_inside(camera.width, camera.height)
            }
            None => (platform.sector.0..=platform.sector.1).contains(&seen.values[0]),
        }
    }

    /// Square pixels (times metres of range), or radians times metres, that show trusted ground.
    fn volume(&self, view: usize) -> f64 {
        let platform = &self.platforms[view];
        let span_m = (self.reach_m - self.ranges_m.0).max(1e-3);
        let Some(camera) = platform.camera.as_deref() else {
            return (platform.sector.1 - platform.sector.0) * span_m;
        };
        let pose = &self.poses[view];
        let far_m = 1.5 * self.reach_m;
        let shows = |column: u32, row: u32| {
            let at = |i: u32, n: u32, size: u32| {
                (f64::from(i) + 0.5) / f64::from(n) * f64::from(size) - 0.5
            };
            let pixel = Pixel::new(
                at(column, COLUMNS, camera.width),
                at(row, ROWS, camera.height),
            );
            let Ok(ray) = camera.ray(pixel) else {
                return false;
            };
            let direction = Direction::new(pose.from_camera * ray.direction.xyz());
            let Some(direction) = direction else {
                return false;
            };
            let origin: Point<Enu> = Point::from_xyz(pose.origin);
            let hit = self.surface.first_hit(Ray { origin, direction }, far_m);
            hit.is_some_and(|p| p.horizontal_distance(origin) < self.reach_m)
        };
        let pixels = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (column, row)));
        let shown: f64 = pixels
            .map(|(column, row)| f64::from(u8::from(shows(column, row))))
            .sum();
        let share = (shown / f64::from(COLUMNS * ROWS)).max(0.05);
        let area = f64::from(camera.width) * f64::from(camera.height) * share;
        let ranged = self.looks_of(view).any(|l| self.looks[l].has[3]);
        if ranged { area * span_m } else { area }
    }

    /// How well readings of the first two rows are known, typically.
    fn set_typical(&mut self) {
        self.typical = std::array::from_fn(|r| {
            let all = self.looks.iter().filter(|l| l.has[r]).map(|l| l.sigmas[r]);
            super::single::median(all.collect()).unwrap_or(1.0)
        });
    }
}
