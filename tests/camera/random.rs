//! Plausible cameras of every model at random, narrow and extreme: over the whole picture a pixel
//! comes back, or has no ray.

use proptest::prelude::*;
use rockmap::camera::{
    BodyAxes, BrownConrady, Cahv, CahvVectors, Cahvor, Cahvore, Camera, Equirectangular, Fisheye,
    Intrinsics, Lens, Linearity, Mount, Pinhole,
};
use rockmap::frame::{Pixel, Point};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 960;

fn camera(lens: Lens) -> Camera {
    Camera {
        name: "random".to_owned(),
        width: WIDTH,
        height: HEIGHT,
        lens,
        mount: Mount::default(),
        readout: None,
    }
}

/// From 170 degrees across to a telephoto lens.
fn intrinsics() -> impl Strategy<Value = Intrinsics> {
    (4.0..9.5f64, 0.95..1.05f64, 560.0..720.0f64, 420.0..540.0f64).prop_map(
        |(log, aspect, cx, cy)| Intrinsics {
            fx: log.exp(),
            fy: log.exp() * aspect,
            cx,
            cy,
        },
    )
}

fn within(bounds: &[f64]) -> Vec<std::ops::Range<f64>> {
    bounds.iter().map(|b| -b..*b).collect()
}

fn brown_conrady() -> impl Strategy<Value = Lens> {
    let bounds = [
        0.5, 0.3, 3e-3, 3e-3, 0.1, 0.5, 0.3, 0.1, 2e-3, 1e-3, 2e-3, 1e-3, 0.05, 0.05,
    ];
    let count = prop::sample::select(BrownConrady::COUNTS.to_vec());
    (intrinsics(), within(&bounds), count).prop_map(|(intrinsics, mut distortion, count)| {
        distortion.truncate(count);
        Lens::BrownConrady(BrownConrady::new(intrinsics, &distortion).unwrap())
    })
}

fn fisheye() -> impl Strategy<Value = Lens> {
    (intrinsics(), within(&[0.2, 0.1, 0.05, 0.02])).prop_map(|(intrinsics, d)| {
        let wide = Intrinsics {
            fx: intrinsics.fx.max(200.0),
            fy: intrinsics.fy.max(200.0),
            ..intrinsics
        };
        Lens::Fisheye(Fisheye::new(wide, d.try_into().unwrap()).unwrap())
    })
}

fn pinhole() -> impl Strategy<Value = Lens> {
    intrinsics().prop_map(|intrinsics| Lens::Pinhole(Pinhole::new(intrinsics).unwrap()))
}

/// Vectors of a camera that looks anywhere, with a little skew and an A not quite of length one.
fn vectors() -> impl Strategy<Value = CahvVectors> {
    let direction = within(&[1.0, 1.0, 1.0]);
    let turned = direction.prop_filter("a direction", |d| {
        d.iter().map(|x| x * x).sum::<f64>() > 0.1
    });
    (
        intrinsics(),
        turned,
        within(&[3.0, 3.0, 3.0]),
        0.999..1.001f64,
        any::<bool>(),
    )
        .prop_map(|(k, forward, centre, length, frd)| {
            let forward = nalgebra::Vector3::from_vec(forward).normalize();
            let beside = if forward.x.abs() < 0.7 {
                nalgebra::Vector3::x()
            } else {
                nalgebra::Vector3::y()
            };
            let right = forward.cross(&beside).normalize();
            let down = forward.cross(&right);
            // Corners of fisheyes up to some 110 degrees from the axis: beyond, a pupil that moves far
            // sees near points twice.
            let f = k.fx.max(450.0);
            CahvVectors {
                axes: if frd { BodyAxes::Frd } else { BodyAxes::Flu },
                centre: centre.try_into().unwrap(),
                axis: (forward * length).into(),
                horizontal: (right * f + forward * k.cx).into(),
                vertical: (down * f + right * (1e-3 * f) + forward * k.cy).into(),
            }
        })
}

/// An optical axis within a degree or so of A, six digits long as in files.
fn optical_axis(vectors: &CahvVectors, tilt: &[f64]) -> [f64; 3] {
    let near = nalgebra::Vector3::from(vectors.axis) + nalgebra::Vector3::from_column_slice(tilt);
    near.normalize().map(|x| (x * 1e6).round() / 1e6).into()
}

fn cahv() -> impl Strategy<Value = Lens> {
    vectors().prop_map(|vectors| Lens::Cahv(Cahv::new(vectors).unwrap()))
}

fn cahvor() -> impl Strategy<Value = Lens> {
    let tilt = within(&[0.02, 0.02, 0.02]);
    (vectors(), tilt, within(&[1e-3, 0.3, 0.3])).prop_map(|(vectors, tilt, r)| {
        let o = optical_axis(&vectors, &tilt);
        Lens::Cahvor(Cahvor::new(vectors, o, r.try_into().unwrap()).unwrap())
    })
}

fn cahvore() -> impl Strategy<Value = Lens> {
    let linearity = prop_oneof![
        Just(Linearity::Perspective),
        Just(Linearity::Fisheye),
        // Between the two, beyond either, and where the series for none of them ends.
        (-1.2..1.5f64).prop_map(Linearity::General),
        (0.01..0.99f64).prop_map(Linearity::General),
        (-1e-7..1e-7f64).prop_map(Linearity::General),
    ];
    let tilt = within(&[0.02, 0.02, 0.02]);
    let (r, e) = (within(&[1e-2, 0.05, 0.02]), within(&[0.01, 0.005, 0.001]));
    (vectors(), tilt, r, e, linearity).prop_map(|(vectors, tilt, r, e, linearity)| {
        let o = optical_axis(&vectors, &tilt);
        let [r, e] = [r, e].map(|list| list.try_into().unwrap());
        Lens::Cahvore(Cahvore::new(vectors, o, r, e, linearity).unwrap())
    })
}

/// Corners and borders included.
fn grid() -> impl Iterator<Item = Pixel> {
    let steps = || (0..=8).map(|i| f64::from(i) / 8.0);
    steps().flat_map(move |v| {
        steps().map(move |u| Pixel::new(u * f64::from(WIDTH) - 0.5, v * f64::from(HEIGHT) - 0.5))
    })
}

/// Every pixel with a ray comes back from points near and far; its derivatives are those of
/// central differences.
fn comes_back(lens: Lens, bound_px: f64) -> Result<(), TestCaseError> {
    let camera = camera(lens);
    for pixel in grid() {
        let Ok((ray, by_pixel)) = camera.ray_with_jacobian(pixel) else {
            continue;
        };
        prop_assert!((ray.direction.xyz().norm() - 1.0).abs() < 1e-12);
        for distance in [0.5, 200.0] {
            let point = ray.at(distance);
            let back = camera.pixel(point);
            // Far off the axis a pupil that moves by a good part of the distance sees a near point
            // twice, in either of two pixels.
            let is_twin = |back: Pixel| {
                let origin = (ray.origin.xyz - point.xyz).norm();
                camera.ray(back).is_ok_and(|twin| {
                    let to_point = point.xyz - twin.origin.xyz;
                    let off = twin.direction.xyz().cross(&to_point).norm();
                    ray.origin.xyz.norm() > 0.2 * distance && off < 1e-9 * origin
                })
            };
            let off = back.map(|back| back.distance(pixel));
            let is_back = off.is_ok_and(|off| off < bound_px) || back.is_ok_and(is_twin);
            prop_assert!(is_back, "{pixel:?} {off:?}");
        }
        // A pixel beside may have no ray, and next to a fold no finite step serves.
        let beside = |du: f64| camera.ray(Pixel::new(pixel.u + du, pixel.v));
        let difference = |step: f64| {
            let (ahead, behind) = (beside(step).ok()?, beside(-step).ok()?);
            let slope = (ahead.direction.xyz() - behind.direction.xyz()) / (2.0 * step);
            let origin = (ahead.origin.xyz - behind.origin.xyz) / (2.0 * step);
            Some((slope, origin))
        };
        let (Some(near), Some(wide), Ok(far)) = (difference(1e-2), difference(2e-2), beside(10.0))
        else {
            continue;
        };
        // Of strongly bent lenses the square of the step shows; two steps cancel it (Richardson).
        let slope = (near.0 * 4.0 - wide.0) / 3.0;
        let origin = (near.1 * 4.0 - wide.1) / 3.0;
        let next = (far.direction.xyz() - ray.direction.xyz()) / 10.0;
        if (next - slope).norm() < 0.05 * slope.norm() {
            let off = (by_pixel.direction.column(0) - slope).norm() / slope.norm();
            prop_assert!(off < 1e-6, "{pixel:?} {off:e}");
            let off = (by_pixel.origin.column(0) - origin).norm();
            prop_assert!(off < 1e-5 * origin.norm() + 1e-13, "{pixel:?} {off:e}");
        }
    }
    Ok(())
}

/// A point whose pixel is in the picture lies on the ray of that pixel, or has no pixel.
fn no_wrong_ray(lens: Lens, [x, y, z]: [f64; 3]) -> Result<(), TestCaseError> {
    let camera = camera(lens);
    let point = Point::new(x, y, z);
    let Ok(pixel) = camera.pixel(point) else {
        return Ok(());
    };
    if let Ok(ray) = camera.ray(pixel) {
        let to_point = (point - ray.origin).xyz.normalize();
        let off = (ray.direction.xyz() - to_point).norm();
        prop_assert!(off < 1e-7, "{point:?} {pixel:?} {off:e}");
    } else {
        // At the very edge of the field rounding decides.
        let near = camera.pixel(Point::new(x * 0.999, y * 0.999, z));
        prop_assert!(
            near.is_err() || !pixel.is_inside(WIDTH, HEIGHT),
            "{pixel:?}"
        );
    }
    Ok(())
}

fn anywhere() -> impl Strategy<Value = [f64; 3]> {
    [-5.0..5.0f64, -5.0..5.0f64, -5.0..5.0f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn pinholes(lens in pinhole(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn brown_conradys(lens in brown_conrady(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn fisheyes(lens in fisheye(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn cahvs(lens in cahv(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn cahvors(lens in cahvor(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn cahvores(lens in cahvore(), point in anywhere()) {
        comes_back(lens.clone(), 1e-6)?;
        no_wrong_ray(lens, point)?;
    }

    #[test]
    fn panoramas(point in anywhere()) {
        let lens = Lens::Equirectangular(Equirectangular::new(WIDTH, HEIGHT));
        no_wrong_ray(lens, point)?;
    }
}
