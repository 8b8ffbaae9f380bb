//! How large a mosaic is, and how fine.

use geo::BoundingRect as _;

use crate::camera::Camera;
use crate::error::{Error, Fault, Place};
use crate::frame::{Crs, Enu, Geodetic, Pixel, Point};
use crate::publish::Scene;
use crate::view::View;

/// The most pixels of a mosaic whose scale is chosen.
const MOST_CHOSEN: f64 = 24e6;
/// The most pixels of a mosaic: with its working memory about 2 GB.
const MOST: f64 = 100e6;
/// Ground is shown where a picture's pixels are no longer than so many of the mosaic's.
const COARSEST: f64 = 8.0;

/// How fine a mosaic is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MosaicScale {
    /// Side of a pixel on the map, metres.
    pub m_per_px: f64,
}

impl MosaicScale {
    /// The least picture pixels on a square metre of ground that is still shown.
    pub(super) fn least_density(self) -> f64 {
        (COARSEST * self.m_per_px).powi(-2)
    }
}

/// Where the pixels of a mosaic are.
#[derive(Debug, Clone, PartialEq)]
pub struct MosaicGrid {
    /// The coordinate reference system, as PROJ knows it.
    pub crs: String,
    /// Easting of the west edge, metres.
    pub west_m: f64,
    /// Northing of the north edge, metres.
    pub north_m: f64,
    /// How fine it is.
    pub scale: MosaicScale,
    /// Pixels from west to east.
    pub columns: usize,
    /// Pixels from north to south.
    pub rows: usize,
}

/// A view whose picture can be laid on the ground, with the part of the site it matters for.
pub(super) struct Source<'a> {
    pub index: usize,
    pub view: &'a View,
    pub camera: &'a Camera,
    /// Angle between neighbouring pixels in the middle of the picture, radians.
    pub pixel_angle: f64,
    /// Height of the camera above the ground below it, metres.
    pub above_m: f64,
    /// West, south, east, north of its footprint in ENU, metres.
    pub bounds: [f64; 4],
}

impl Source<'_> {
    /// Pixels on a square metre of level ground at a range.
    fn density(&self, slant_m: f64) -> f64 {
        self.above_m / (slant_m.powi(3) * self.pixel_angle.powi(2))
    }

    /// Its bounds, no farther than it sees well enough for a scale.
    pub(super) fn reach(&self, scale: MosaicScale) -> [f64; 4] {
        let far_m = (self.above_m / (scale.least_density() * self.pixel_angle.powi(2))).cbrt();
        let at = self.view.origin().xyz;
        let [west, south, east, north] = self.bounds;
        [
            west.max(at.x - far_m),
            south.max(at.y - far_m),
            east.min(at.x + far_m),
            north.min(at.y + far_m),
        ]
    }
}

/// The views whose pictures can be laid on the ground.
pub(super) fn sources<'a>(scene: &'a Scene<'_>) -> Vec<Source<'a>> {
    let views = scene.views.iter().enumerate();
    views
        .filter_map(|(index, view)| {
            view.picture.as_ref()?;
            let camera = view.camera.as_deref()?;
            let bounds = scene.footprints.of(index).ground().bounding_rect()?;
            let (column, row) = (
                f64::from(camera.width) / 2.0,
                f64::from(camera.height) / 2.0,
            );
            let ray = |u: f64| camera.ray(Pixel::new(u, row)).ok();
            let (a, b) = (ray(column)?, ray(column + 1.0)?);
            let pixel_angle = (a.direction.xyz() - b.direction.xyz()).norm();
            let at = view.origin().xyz;
            let ground = scene.terrain?.ground_at(at.x, at.y);
            let above_m = ground.map_or(1.0, |g| at.z - g.point.xyz.z).max(0.1);
            Some(Source {
                index,
                view,
                camera,
                pixel_angle,
                above_m,
                bounds: [
                    bounds.min().x,
                    bounds.min().y,
                    bounds.max().x,
                    bounds.max().y,
                ],
            })
        })
        .collect()
}

/// The grid of the scene's mosaic; `None` where no picture shows ground.
///
/// Where the scale is not given it is that of the finest quarter of the ground the pictures show,
/// as a round number, or coarser where the mosaic would be too large.
pub(super) fn choose(
    scene: &Scene<'_>,
    crs: &Crs,
    m_per_px: Option<f64>,
) -> Result<Option<MosaicGrid>, Error> {
    let sources = sources(scene);
    if sources.is_empty() {
        return Ok(None);
    }
    let wanted = m_per_px.unwrap_or_else(|| round_down(fine(&sources)));
    let mut scale = MosaicScale { m_per_px: wanted };
    loop {
        let Some([west, south, east, north]) = extent(scene, crs, &sources, scale) else {
            return Ok(None);
        };
        // Edges on whole multiples of the pixel, so that mosaics of one site lie pixel on pixel.
        let step = scale.m_per_px;
        let (west, north) = ((west / step).floor() * step, (north / step).ceil() * step);
        let columns = ((east - west) / step).ceil().max(1.0);
        let rows = ((north - south) / step).ceil().max(1.0);
        let n_pixels = columns * rows;
        if m_per_px.is_none() && n_pixels > MOST_CHOSEN {
            scale.m_per_px = round_up(step * 1.01);
            continue;
        }
        if n_pixels > MOST {
            let found = format!("{step} m, which makes {columns} x {rows} pixels");
            let expected = format!("a mosaic of at most {:.0} million pixels", MOST / 1e6);
            let field = "output.mosaic_m_per_px";
            return Err(Fault::found(Place::default(), field, found, expected).into());
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole, above zero and bounded above"
        )]
        return Ok(Some(MosaicGrid {
            crs: crs.definition().to_owned(),
            west_m: west,
            north_m: north,
            scale,
            columns: columns as usize,
            rows: rows as usize,
        }));
    }
}

/// The side of a picture's pixel on the ground where a view shows it well: a quarter of the way out.
fn fine(sources: &[Source<'_>]) -> f64 {
    let mut sides: Vec<f64> = sources
        .iter()
        .map(|source| {
            let [west, south, east, north] = source.bounds;
            let at = source.view.origin().xyz;
            let (dx, dy) = ((west + east) / 2.0 - at.x, (south + north) / 2.0 - at.y);
            let slant_m = (dx.hypot(dy) / 2.0).hypot(source.above_m);
            source.density(slant_m).sqrt().recip()
        })
        .collect();
    sides.sort_unstable_by(f64::total_cmp);
    sides[sides.len() / 4].clamp(1e-4, 100.0)
}

/// West, south, east, north of all sources in the CRS.
fn extent(
    scene: &Scene<'_>,
    crs: &Crs,
    sources: &[Source<'_>],
    scale: MosaicScale,
) -> Option<[f64; 4]> {
    let mut all: Option<[f64; 4]> = None;
    for source in sources {
        let [west, south, east, north] = source.reach(scale);
        if west >= east || south >= north {
            continue;
        }
        let up = source.view.origin().xyz.z - source.above_m;
        for (x, y) in [(west, south), (west, north), (east, south), (east, north)] {
            let place: Geodetic = scene.site.geodetic(Point::<Enu>::new(x, y, up));
            let Ok((x, y)) = crs.xy(place.lon, place.lat) else {
                continue;
            };
            let [w, s, e, n] = all.unwrap_or([x, y, x, y]);
            all = Some([w.min(x), s.min(y), e.max(x), n.max(y)]);
        }
    }
    all
}

/// The greatest of 1, 2 and 5 times a power of ten that is no more than `x`.
fn round_down(x: f64) -> f64 {
    let decade = 10f64.powf(x.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * decade);
    steps
        .into_iter()
        .find(|step| *step <= x * (1.0 + 1e-9))
        .unwrap_or(decade)
}

/// The least of them that is no less.
fn round_up(x: f64) -> f64 {
    let decade = 10f64.powf(x.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|step| step * decade);
    steps
        .into_iter()
        .find(|step| *step >= x)
        .unwrap_or(10.0 * decade)
}
