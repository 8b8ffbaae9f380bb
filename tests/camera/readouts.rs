//! Subframes, binning and downsampling of every model.

use nalgebra::Vector3;
use rockmap::camera::{Camera, Subframe, cameras_from_toml, cameras_to_toml};
use rockmap::frame::{Pixel, Point};

const PART: Subframe = Subframe {
    first_u_px: 120,
    first_v_px: 60,
    width: 300,
    height: 200,
};

/// Where on the sensor a column and row of the picture are.
type OnSensor = fn(f64, f64) -> (f64, f64);

/// A few readouts of a camera, each with its column and row on the sensor for a pixel, by hand.
fn readouts(camera: &Camera) -> Vec<(Camera, OnSensor)> {
    let part = camera.subframe(PART).unwrap();
    vec![
        (part.clone(), |u, v| (u + 120.0, v + 60.0)),
        (camera.binned([2, 2]).unwrap(), |u, v| {
            (2.0 * u + 0.5, 2.0 * v + 0.5)
        }),
        (camera.downsampled([4, 2]).unwrap(), |u, v| {
            (4.0 * u, 2.0 * v)
        }),
        (part.binned([3, 2]).unwrap(), |u, v| {
            (3.0 * u + 121.0, 2.0 * v + 60.5)
        }),
        (part.downsampled([3, 2]).unwrap(), |u, v| {
            (3.0 * u + 120.0, 2.0 * v + 60.0)
        }),
    ]
}

#[test]
fn rays_and_points_are_those_of_the_sensor() {
    for whole in super::cameras().values() {
        for (camera, on_sensor) in readouts(whole) {
            for (u, v) in [(0.0, 0.0), (20.25, 31.5), (99.0, 70.0)] {
                let (full_u, full_v) = on_sensor(u, v);
                let (pixel, full) = (Pixel::new(u, v), Pixel::new(full_u, full_v));
                let (seen, expected) = (camera.ray(pixel).unwrap(), whole.ray(full).unwrap());
                let off = (seen.direction.xyz() - expected.direction.xyz()).norm();
                assert!(off < 1e-14, "{} {off:e}", whole.name);
                let back = camera.pixel(seen.at(7.0)).unwrap();
                assert!(back.distance(pixel) < 1e-9, "{} {back:?}", whole.name);
            }
        }
    }
}

#[test]
fn jacobians_follow() {
    for whole in super::cameras().values() {
        for (camera, _) in readouts(whole) {
            let pixel = Pixel::new(21.0, 33.0);
            let (ray, by_pixel) = camera.ray_with_jacobian(pixel).unwrap();
            let moved = |u: f64, v: f64| camera.ray(Pixel::new(pixel.u + u, pixel.v + v)).unwrap();
            for (column, du, dv) in [(0, 0.01, 0.0), (1, 0.0, 0.01)] {
                let (ahead, behind) = (moved(du, dv), moved(-du, -dv));
                let slope = (ahead.direction.xyz() - behind.direction.xyz()) / 0.02;
                let off = (by_pixel.direction.column(column) - slope).norm();
                assert!(off < 1e-6 * slope.norm(), "{} {off:e}", whole.name);
                let slope = (ahead.origin.xyz - behind.origin.xyz) / 0.02;
                let off = (by_pixel.origin.column(column) - slope).norm();
                assert!(off < 1e-6 * slope.norm() + 1e-15, "{} {off:e}", whole.name);
            }
            let point = ray.at(5.0);
            let (_, by_point) = camera.pixel_with_jacobian(point).unwrap();
            for axis in 0..3 {
                let step = Vector3::ith(axis, 5e-5);
                let [ahead, behind] = [1.0, -1.0].map(|sign| {
                    let moved = Point::from_xyz(point.xyz + step * sign);
                    camera.pixel(moved).unwrap().to_vector()
                });
                let slope = (ahead - behind) / 1e-4;
                let off = (by_point.column(axis) - slope).norm();
                assert!(off < 1e-6 * by_point.norm(), "{} {off:e}", whole.name);
            }
        }
    }
}

#[test]
fn written_and_read_they_are_the_same() {
    for whole in super::cameras().values() {
        for (camera, _) in readouts(whole) {
            let text = cameras_to_toml(&[(camera.name.clone(), camera.clone())].into());
            let again = cameras_from_toml(&text, "cameras.toml").unwrap();
            assert_eq!(again[&camera.name], camera, "{text}");
        }
    }
}
