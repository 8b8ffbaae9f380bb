use super::*;

#[test]
fn the_limit_is_where_growth_or_the_denominator_ends() {
    // r (1 - 0.3 r^2) turns at r^2 = 1 / 0.9.
    let turning = Radial::new([1.0, -0.3, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).unwrap();
    assert!((turning.limit() - (1.0 / 0.9f64).sqrt()).abs() < 1e-14);
    // r / (1 - r^2 / 4) grows without bound towards r = 2.
    let pole = Radial::new([1.0, 0.0, 0.0, 0.0, 0.0], [1.0, -0.25, 0.0, 0.0]).unwrap();
    assert!((pole.limit() - 2.0).abs() < 1e-14);
    assert!((pole.radius(1e9, 0.0).unwrap() - 2.0).abs() < 1e-8);
    // r / (1 + r^2 / 4) turns at r = 2, where it is 1.
    let fold = Radial::new([1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.25, 0.0, 0.0]).unwrap();
    assert!((fold.limit() - 2.0).abs() < 1e-12);
    assert!((fold.radius(0.8, 0.0).unwrap() - 1.0).abs() < 1e-14);
    assert_eq!(fold.radius(1.01, 0.0), Err(LensError::OutsideField));
    let free = Radial::new([1.0, 0.3, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).unwrap();
    assert_eq!(free.limit(), f64::INFINITY);
    assert!(Radial::new([-1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).is_none());
    assert!(Radial::new([f64::NAN, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).is_none());
}

/// Where the map saturates, Newton's method from the distorted radius overshoots at first.
#[test]
fn radii_come_back_up_to_the_limit() {
    for (n, d) in [
        ([1.0, -0.3, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
        ([1.0, 12.0, 5.0, 0.2, 0.0], [1.0, 12.7, 9.3, 1.1]),
        ([1.0, 0.9, -0.05, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
    ] {
        let radial = Radial::new(n, d).unwrap();
        let reach = radial.limit().min(50.0);
        for i in 1..1000 {
            let radius = reach * f64::from(i) / 1000.0;
            let distorted = radius * radial.factor(radius * radius).0;
            let off = (radial.radius(distorted, 4.0 * f64::EPSILON).unwrap() - radius).abs();
            // Towards the limit the slope goes to zero, and rounding grows by its inverse.
            assert!(off < 1e-10 * radius, "{radius} {off:e}");
        }
    }
}
