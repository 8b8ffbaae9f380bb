//! The ground as a whole: rasters by hand, across projections, and rays against brute force.

mod brute;

use super::*;
use crate::frame::{Crs, Geodetic, Planet};
use nalgebra::Vector3;

pub(super) const UTM: &str = "EPSG:32632";

pub(super) fn site() -> Site {
    Site::new(Planet::EARTH, Geodetic::from_degrees(49.0, 8.4, 115.0))
}

/// The place in UTM of the site's origin.
pub(super) fn utm_origin() -> (f64, f64) {
    let origin = site().origin();
    let utm = Crs::new(UTM, Planet::EARTH).unwrap();
    utm.xy(origin.lon, origin.lat).unwrap()
}

pub(super) fn ray(origin: Point<Enu>, azimuth_deg: f64, down_deg: f64) -> Ray<Enu> {
    let (sa, ca) = azimuth_deg.to_radians().sin_cos();
    let (sd, cd) = down_deg.to_radians().sin_cos();
    Ray {
        origin,
        direction: Direction::new(Vector3::new(sa * cd, ca * cd, -sd)).unwrap(),
    }
}

/// A raster around the site's origin, its height given by the offset from there in UTM metres.
pub(super) fn utm_grid(posts: u32, step: f64, height: impl Fn(f64, f64) -> f64) -> HeightGrid {
    let (x, y) = utm_origin();
    let half = f64::from(posts - 1) * step / 2.0;
    let heights = (0..posts * posts)
        .map(|i| {
            let (column, row) = (f64::from(i % posts), f64::from(i / posts));
            height(column * step - half, half - row * step)
        })
        .collect();
    let map = Affine::north_up(x - half, y + half, step);
    let size = posts as usize;
    HeightGrid::new(size, size, Posts::F64(heights), map, UTM).unwrap()
}

pub(super) fn terrain(grids: Vec<HeightGrid>, outside_m: Option<f64>) -> Terrain {
    Terrain::from_grids(site(), grids, outside_m).unwrap()
}

fn hill(x: f64, y: f64) -> f64 {
    115.0 + 2.0 * (x / 9.0).sin() + 1.5 * (y / 7.0).cos()
}

#[test]
fn the_height_at_a_place_is_that_between_its_posts() {
    // 4 posts, 2 m apart: 10, 30 / 50, 110; the site's origin is in the middle.
    let posts = Posts::F32(vec![10.0, 30.0, 50.0, 110.0]);
    let (x, y) = utm_origin();
    let map = Affine::north_up(x - 1.0, y + 1.0, 2.0);
    let grid = HeightGrid::new(2, 2, posts, map, UTM).unwrap();
    let terrain = terrain(vec![grid], None);
    let at = |dx: f64, dy: f64| {
        let utm = Crs::new(UTM, Planet::EARTH).unwrap();
        let (lon, lat) = utm.lon_lat(x + dx, y + dy).unwrap();
        let point = site().enu(Geodetic {
            lat,
            lon,
            height_m: 50.0,
        });
        terrain
            .ground_at(point.xyz.x, point.xyz.y)
            .map(|ground| site().height_m(ground.point))
    };
    for (dx, dy, expected) in [
        (0.0, 0.0, 50.0),   // the mean of the four
        (0.0, 0.5, 35.0),   // 3/4 of (10 + 30) / 2 and 1/4 of (50 + 110) / 2
        (-0.5, -0.5, 52.5), // (3/16) 10 + (1/16) 30 + (9/16) 50 + (3/16) 110
    ] {
        let found = at(dx, dy).unwrap();
        // The vertical of the site's frame is that of its origin: the tilt over 1 m is 1e-7, and
        // 50 m below that is 1e-5 m sideways on a slope of 40.
        assert!((found - expected).abs() < 1e-3, "{dx} {dy}: {found}");
    }
    assert!(at(1.01, 0.0).is_none(), "no extrapolation beyond the posts");
}

#[test]
fn the_normal_leans_away_from_the_slope() {
    // Rises 1 in 2 eastwards of UTM, whose north is turned by the convergence of the meridians.
    let terrain = terrain(vec![utm_grid(21, 1.0, |x, _| 115.0 + 0.5 * x)], None);
    let normal = terrain.ground_at(0.0, 0.0).unwrap().normal.xyz();
    let convergence = ((8.4f64 - 9.0).to_radians().tan() * 49f64.to_radians().sin()).atan();
    // UTM's scale at 0.6 degrees from its meridian.
    let slope = 0.5 * 0.999_623_6;
    let expected = Vector3::new(-slope * convergence.cos(), slope * convergence.sin(), 1.0);
    assert!(
        (normal - expected.normalize()).norm() < 1e-5,
        "{normal} {expected}"
    );
    let hit = terrain
        .first_hit(ray(Point::new(0.0, 0.0, 5.0), 0.0, 90.0), 10.0)
        .unwrap();
    assert!((hit.normal.xyz() - normal).norm() < 1e-9);
    assert!((hit.distance_m - 5.0).abs() < 1e-6);
}

#[test]
fn rasters_in_metres_and_in_degrees_are_one_surface() {
    // A bilinear surface is not one in another projection: planes are compared, fine ones.
    let plane = |place: Geodetic| 115.0 + 0.1 * (place.lat_deg() - 49.0) * 111_000.0;
    let utm = Crs::new(UTM, Planet::EARTH).unwrap();
    let (x, y) = utm_origin();
    let metres = utm_grid(201, 1.0, |dx, dy| {
        let (lon, lat) = utm.lon_lat(x + dx, y + dy).unwrap();
        plane(Geodetic {
            lat,
            lon,
            height_m: 0.0,
        })
    });
    for turn in [0.0, 360.0, -360.0] {
        let map = Affine {
            x0: 8.398 + turn,
            x_column: 2e-5,
            x_row: 0.0,
            y0: 49.001,
            y_column: 0.0,
            y_row: -1e-5,
        };
        let heights = (0..201 * 201)
            .map(|i| map.apply(f64::from(i % 201), f64::from(i / 201)))
            .map(|(lon, lat)| plane(Geodetic::from_degrees(lat, lon, 0.0)))
            .collect();
        let degrees = HeightGrid::new(201, 201, Posts::F64(heights), map, "EPSG:4326").unwrap();
        let (a, b) = (
            terrain(vec![metres.clone()], None),
            terrain(vec![degrees], None),
        );
        for azimuth in 0..72 {
            let ray = ray(Point::new(1.0, 2.0, 3.0), 5.0 * f64::from(azimuth), 12.0);
            let (hit_a, hit_b) = (
                a.first_hit(ray, 80.0).unwrap(),
                b.first_hit(ray, 80.0).unwrap(),
            );
            assert!(hit_a.point.distance(hit_b.point) < 1e-3);
            assert!((hit_a.normal.xyz() - hit_b.normal.xyz()).norm() < 1e-4);
        }
    }
}

#[test]
fn earlier_rasters_count_and_later_ones_show_through_their_holes() {
    let first = utm_grid(
        11,
        1.0,
        |x, y| if x.hypot(y) < 1.5 { f64::NAN } else { 116.0 },
    );
    let second = utm_grid(21, 2.0, |_, _| 115.5);
    let both = vec![first, second];
    let height = |terrain: &Terrain, east: f64| {
        let ground = terrain.ground_at(east, 0.0)?;
        Some((site().height_m(ground.point) * 1e6).round() / 1e6)
    };
    let closed = terrain(both.clone(), Some(115.0));
    for (east, expected) in [(0.0, 115.5), (4.0, 116.0), (10.0, 115.5), (30.0, 115.0)] {
        assert_eq!(height(&closed, east), Some(expected));
    }
    let open = terrain(both, None);
    assert_eq!(height(&open, 30.0), None);
    assert_eq!(height(&open, 10.0), Some(115.5));
    // The step from the second up to the first is a wall: it is met 0.3 m above the lower one.
    let across = ray(Point::new(10.0, 0.0, 0.8), 270.0, 0.0);
    let hit = open.first_hit(across, 100.0).unwrap();
    assert!((hit.point.xyz.x - 5.0).abs() < 0.1, "{hit:?}");
}

#[test]
fn a_model_in_pieces_is_the_whole() {
    let whole = utm_grid(41, 1.0, hill);
    let pieces = vec![
        whole.window((0, 15), (0, 20)),
        whole.window((16, 40), (0, 20)),
        whole.window((0, 15), (21, 40)),
        whole.window((16, 40), (21, 40)),
    ];
    let (whole, pieces) = (terrain(vec![whole], None), terrain(pieces, None));
    for azimuth in 0..90 {
        let ray = ray(Point::new(-6.0, 3.0, 5.0), 4.0 * f64::from(azimuth), 35.0);
        let (a, b) = (whole.first_hit(ray, 30.0), pieces.first_hit(ray, 30.0));
        assert!(a.unwrap().point.distance(b.unwrap().point) < 1e-6);
    }
}

#[test]
fn misses_have_their_reasons() {
    let flat = || utm_grid(41, 1.0, |_, _| 115.0);
    let terrain = terrain(vec![flat()], None);
    let from = |east: f64, up: f64, down_deg: f64, range: f64| {
        let hit = terrain.first_hit(ray(Point::new(east, 0.0, up), 90.0, down_deg), range);
        hit.map(|hit| hit.distance_m)
    };
    assert_eq!(from(0.0, 2.0, -1.0, 100.0), Err(Miss::AboveHorizon));
    assert_eq!(from(0.0, 2.0, 10.0, 11.0), Err(Miss::TooFar)); // 11.3 m
    assert!(from(0.0, 2.0, 10.0, 11.4).is_ok());
    assert_eq!(from(0.0, 2.0, 1.0, 500.0), Err(Miss::OffTerrain)); // 115 m, beyond the edge
    assert_eq!(from(0.0, 2.0, 1.0, 50.0), Err(Miss::TooFar));
    assert_eq!(from(0.0, -0.1, 1.0, 50.0), Err(Miss::UnderGround));
    // From outside, in over the edge, at any height above the ground; not from below it.
    assert!(from(-30.0, 5.0, 12.0, 100.0).is_ok());
    assert_eq!(from(-30.0, 1.0, 12.0, 100.0), Err(Miss::OffTerrain));
    let down = |east: f64| terrain.first_hit(ray(Point::new(east, 0.0, 50.0), 0.0, 90.0), 1.0);
    assert!((down(3.0).unwrap().distance_m - 50.0).abs() < 1e-6);
    assert_eq!(down(25.0), Err(Miss::OffTerrain));
}

#[test]
fn over_a_hole_a_ray_passes_above_its_rim_only() {
    let rim = |x: f64, y: f64| if x.hypot(y) < 3.5 { f64::NAN } else { 115.0 };
    let terrain = terrain(vec![utm_grid(41, 1.0, rim)], None);
    let hit = |east: f64, up: f64, down_deg: f64| {
        terrain
            .first_hit(ray(Point::new(east, 0.0, up), 90.0, down_deg), 100.0)
            .map(|hit| hit.point.xyz.x.round())
    };
    assert_eq!(hit(-10.0, 2.0, 6.34), Ok(8.0)); // 18 m: over the hole, 0.4 m above at its far rim
    assert_eq!(hit(-10.0, 2.0, 11.31), Err(Miss::OffTerrain)); // comes down in the hole
    assert_eq!(hit(-10.0, 2.0, 20.0), Ok(-5.0)); // before it
    assert_eq!(hit(0.0, 2.0, 14.0), Ok(8.0)); // from within, out over the rim
    assert_eq!(hit(0.0, 2.0, 40.0), Err(Miss::OffTerrain)); // from within, into the hole
    let filled = super::Terrain::from_grids(site(), vec![utm_grid(41, 1.0, rim)], Some(114.0));
    let filled = filled.unwrap();
    let at = filled
        .first_hit(ray(Point::new(0.0, 0.0, 2.0), 0.0, 90.0), 1.0)
        .unwrap();
    assert!((at.distance_m - 3.0).abs() < 1e-6);
}

#[test]
fn the_ground_hides_what_is_behind_it() {
    let ridge = |x: f64, _: f64| 115.0 + (2.0 - x.abs()).max(0.0);
    let terrain = terrain(vec![utm_grid(61, 1.0, ridge)], None);
    let ground = |east: f64| terrain.ground_at(east, 0.0).unwrap().point;
    let eye = Point::new(-10.0, 0.0, 1.5);
    assert!(terrain.occluded(eye, ground(10.0), 0.05));
    assert!(!terrain.occluded(eye, ground(-5.0), 0.05));
    assert!(!terrain.occluded(eye, ground(-1.0), 0.05));
    assert!(!terrain.occluded(eye, Point::new(10.0, 0.0, 4.0), 0.05));
    // The sight runs 1.25 m up at the crest of 2 m: 0.75 m of ground are in its way.
    let low = Point::new(10.0, 0.0, 1.0);
    assert!(terrain.occluded(eye, low, 0.7));
    assert!(!terrain.occluded(eye, low, 0.8));
}

#[test]
fn distances_to_the_model_are_to_its_edge() {
    let terrain = terrain(vec![utm_grid(41, 1.0, hill)], None);
    assert_eq!(terrain.distance_to(Point::new(5.0, -19.0, 3.0)), 0.0);
    let away = terrain.distance_to(Point::new(120.0, 0.0, 3.0));
    assert!((away - 100.0).abs() < 0.3, "{away}"); // the raster is turned by 0.45 degrees
    assert!(
        terrain.covers(Point::new(5.0, -19.0, 3.0)) && !terrain.covers(Point::new(25.0, 0.0, 0.0))
    );
    let plane = Terrain::constant_height(site(), 115.0);
    assert_eq!(plane.distance_to(Point::new(9e3, 0.0, 0.0)), 0.0);
}

#[test]
fn a_model_far_larger_than_the_site_is_cut_to_it() {
    // A degree a post over a whole planet; the surface is the same plane of longitude.
    let map = Affine::north_up(0.0, 90.0, 1.0);
    let heights = (0..361 * 181u32).map(|i| f64::from(i % 361)).collect();
    let grid = HeightGrid::new(361, 181, Posts::F64(heights), map, "IAU_2015:49900").unwrap();
    let site = Site::new(Planet::MARS, Geodetic::from_degrees(18.4, 77.5, 0.0));
    let terrain = Terrain::from_grids(site, vec![grid], None).unwrap();
    let Shape::Model(model) = &terrain.shape else {
        panic!("a model");
    };
    assert!(model.tiles[0].last()[0] < 8.0);
    let ground = terrain.ground_at(0.0, 0.0).unwrap();
    assert!((ground.point.xyz.z - 77.5).abs() < 1e-6);
    let west = Geodetic::from_degrees(18.4, -175.0, 0.0);
    let there = Site::new(Planet::MARS, west);
    let map = Affine::north_up(0.0, 90.0, 1.0);
    let heights = (0..361 * 181u32).map(|i| f64::from(i % 361)).collect();
    let grid = HeightGrid::new(361, 181, Posts::F64(heights), map, "IAU_2015:49900").unwrap();
    let terrain = Terrain::from_grids(there, vec![grid], None).unwrap();
    let up = terrain.ground_at(0.0, 0.0).unwrap().point.xyz.z;
    assert!(
        (up - 185.0).abs() < 1e-6,
        "east of 180 by the raster, west by the site"
    );
}

#[test]
fn the_constant_height_answers_like_the_models() {
    let plane = Terrain::constant_height(site(), 115.0);
    let from = |up: f64, down_deg: f64, range: f64| {
        plane
            .first_hit(ray(Point::new(0.0, 0.0, up), 30.0, down_deg), range)
            .map(|hit| hit.distance_m)
    };
    // A nanometre is one unit in the last place of a planet's radius.
    assert!((from(2.0, 90.0, 1.0).unwrap() - 2.0).abs() < 1e-8);
    assert_eq!(from(2.0, 10.0, 11.0), Err(Miss::TooFar));
    assert_eq!(from(-1e-6, 10.0, 11.0), Err(Miss::UnderGround));
    assert_eq!(from(2.0, 0.0, f64::INFINITY), Err(Miss::AboveHorizon));
    let ground = plane.ground_at(20_000.0, 0.0).unwrap();
    assert!((ground.point.xyz.z + 31.3).abs() < 0.2);
    assert!((site().height_m(ground.point) - 115.0).abs() < 1e-8);
    assert!((ground.normal.xyz().x - 20_000.0 / 6.39e6).abs() < 1e-5);
}

/// kitti-0001 of the reference data: 2 m posts in UTM, two flat stretches with nodata around.
#[test]
fn a_real_model_lies_under_its_traverse() {
    let data = std::env::var("ROCKMAP_DATA").unwrap_or_else(|_| "../shared/data".to_owned());
    let path = std::path::PathBuf::from(data).join("kitti-0001/terrain.tif");
    if !path.exists() {
        println!("skipped: no {}", path.display());
        return;
    }
    let files = [(path, "terrain.tif".to_owned())];
    let probe = Terrain::open(site(), &files, None, None).unwrap();
    let Shape::Model(model) = &probe.shape else {
        panic!("a model");
    };
    assert_eq!(model.tiles[0].last(), [168.0, 129.0]);
    let mut hits = 0;
    for i in 0..168 * 129u32 {
        let position = [f64::from(i % 168) + 0.3, f64::from(i / 168) + 0.6];
        let place = model.tiles[0].place(position, 0.0).unwrap();
        let east_north = site().enu(place).xyz;
        let Some(ground) = probe.ground_at(east_north.x, east_north.y) else {
            continue;
        };
        let eye = ground.point + crate::frame::Vector::new(0.0, 0.0, 1.65);
        let hit = probe.first_hit(ray(eye, f64::from(i % 360), 12.0), 100.0);
        match hit {
            Ok(hit) => {
                let again = probe.ground_at(hit.point.xyz.x, hit.point.xyz.y).unwrap();
                assert!(again.point.distance(hit.point) < 1e-6);
                hits += 1;
            }
            Err(miss) => assert!(miss != Miss::UnderGround),
        }
    }
    assert!(hits > 1000, "{hits}");
}
