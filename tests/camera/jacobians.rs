//! Analytic derivatives against central differences.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};
use rockmap::camera::Camera;
use rockmap::frame::{self, Pixel, Point};

#[test]
fn rays_by_pixels() {
    for camera in super::cameras().values() {
        for pixel in grid(camera) {
            let (ray, analytic) = camera.ray_with_jacobian(pixel).unwrap();
            let alone = camera.ray(pixel).unwrap();
            assert_eq!((ray.origin, ray.direction), (alone.origin, alone.direction));
            let step = 0.01;
            let slope = |by: Vector2<f64>| {
                let [ahead, behind] = [1.0, -1.0].map(|sign| {
                    let moved = Pixel::from(pixel.to_vector() + by * (sign * step));
                    let ray = camera.ray(moved).unwrap();
                    (ray.origin.xyz, ray.direction.xyz())
                });
                let by_step = |a: Vector3<f64>, b: Vector3<f64>| (a - b) / (2.0 * step);
                (by_step(ahead.0, behind.0), by_step(ahead.1, behind.1))
            };
            let (by_u, by_v) = (slope(Vector2::x()), slope(Vector2::y()));
            let direction = Matrix3x2::from_columns(&[by_u.1, by_v.1]);
            let off = (analytic.direction - direction).norm() / direction.norm();
            assert!(off < 1e-6, "{} {pixel:?} {off:e}", camera.name);
            // The moved pupil of a CAHVORE lens; all others have their centre.
            let origin = Matrix3x2::from_columns(&[by_u.0, by_v.0]);
            let off = (analytic.origin - origin).norm();
            let bound = 1e-6 * origin.norm() + 1e-15;
            assert!(off < bound, "{} {pixel:?} {off:e} {origin}", camera.name);
            assert_eq!(
                origin.norm() > 0.0,
                camera.lens.model() == "cahvore",
                "{} {pixel:?}",
                camera.name
            );
        }
    }
}

#[test]
fn pixels_by_points() {
    for camera in super::cameras().values() {
        for pixel in grid(camera) {
            // Near and far: the moved entrance pupil matters more to a near point.
            for distance in [0.7, 40.0] {
                let point = camera.ray(pixel).unwrap().at(distance);
                let (_, analytic) = camera.pixel_with_jacobian(point).unwrap();
                let numeric = by_point(camera, point, 1e-5 * distance);
                let off = (analytic - numeric).norm() / numeric.norm();
                assert!(off < 1e-6, "{} {pixel:?} {off:e}", camera.name);
            }
        }
    }
}

/// On the axis itself the polar forms inside the models have no direction.
#[test]
fn on_the_axis() {
    for name in ["pinhole", "radial", "barrel", "fisheye", "panorama"] {
        let camera = &super::cameras()[name];
        let point = Point::new(0.0, 0.0, 2.0);
        let (pixel, analytic) = camera.pixel_with_jacobian(point).unwrap();
        let numeric = by_point(camera, point, 1e-5);
        assert!(
            (analytic - numeric).norm() < 1e-6 * numeric.norm(),
            "{name}"
        );
        let (_, by_pixel) = camera.ray_with_jacobian(pixel).unwrap();
        // At depth 2 a step of the direction is half a step of the point.
        let product = analytic * by_pixel.direction * 2.0;
        assert!(
            (product - nalgebra::Matrix2::identity()).norm() < 1e-9,
            "{name}"
        );
    }
}

fn by_point(camera: &Camera, point: Point<frame::Camera>, step: f64) -> Matrix2x3<f64> {
    let slope = |by: Vector3<f64>| {
        let [ahead, behind] = [1.0, -1.0].map(|sign| {
            let moved = Point::from_xyz(point.xyz + by * (sign * step));
            camera.pixel(moved).unwrap().to_vector()
        });
        (ahead - behind) / (2.0 * step)
    };
    Matrix2x3::from_columns(&[
        slope(Vector3::x()),
        slope(Vector3::y()),
        slope(Vector3::z()),
    ])
}

/// Pixels all over the picture but for its very border, where a panorama has its poles.
fn grid(camera: &Camera) -> Vec<Pixel> {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let shares = [0.02, 0.17, 0.33, 0.49, 0.5, 0.66, 0.81, 0.98];
    let rows = shares.iter().map(|share| share * height);
    rows.flat_map(|v| shares.map(|share| Pixel::new(share * width, v)))
        .collect()
}
