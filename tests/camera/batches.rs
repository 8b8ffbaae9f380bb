//! Many at once are as each by itself.

use rockmap::camera::{Camera, LensError};
use rockmap::frame::{Pixel, Point};

/// Pixels all over the picture and far outside, and what is no number; not a multiple of eight.
fn pixels(camera: &Camera) -> Vec<Pixel> {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let shares = || (-4..=15).map(|i| f64::from(i) / 10.0);
    let mut pixels: Vec<Pixel> = shares()
        .flat_map(|v| shares().map(move |u| Pixel::new(u * width - 0.5, v * height - 0.5)))
        .collect();
    pixels.extend([f64::NAN, f64::INFINITY, 1e200].map(|u| Pixel::new(u, 3.0)));
    pixels
}

#[test]
fn rays_and_pixels() {
    for camera in super::cameras().values() {
        for camera in [camera.clone(), camera.binned([2, 2]).unwrap()] {
            let pixels = pixels(&camera);
            let mut rays = vec![Err(LensError::NoConvergence); pixels.len()];
            camera.rays(&pixels, &mut rays);
            let mut points = Vec::new();
            for (pixel, ray) in pixels.iter().zip(&rays) {
                let alone = camera.ray(*pixel);
                match (ray, alone) {
                    (Ok(ray), Ok(alone)) => {
                        let both = [*ray, alone].map(|r| (r.origin, r.direction));
                        assert_eq!(both[0], both[1], "{} {pixel:?}", camera.name);
                        points.push(ray.at(3.0));
                    }
                    (Err(ray), Err(alone)) => assert_eq!(*ray, alone),
                    _ => panic!("{} {pixel:?}: {ray:?} {alone:?}", camera.name),
                }
            }
            assert!(points.len() > 100, "{}", camera.name);
            points.push(Point::new(0.0, 0.0, -1.0));
            let mut seen = vec![Err(LensError::NoConvergence); points.len()];
            camera.pixels(&points, &mut seen);
            for (point, seen) in points.iter().zip(seen) {
                assert_eq!(seen, camera.pixel(*point), "{}", camera.name);
            }
        }
    }
}

#[test]
fn slices_of_two_lengths() {
    let camera = &super::cameras()["barrel"];
    let pixels = vec![Pixel::new(3.0, 4.0); 11];
    let mut rays = vec![Err(LensError::NoConvergence); 19];
    camera.rays(&pixels, &mut rays);
    assert!(rays[..11].iter().all(Result::is_ok) && rays[11..].iter().all(Result::is_err));
    let mut rays = vec![Err(LensError::NoConvergence); 9];
    camera.rays(&pixels, &mut rays);
    assert!(rays.iter().all(Result::is_ok));
}
