//! A few numbers of other implementations for every model.

use nalgebra::Vector3;
use rockmap::camera::PanTilt;
use rockmap::frame::{Camera, Pixel, Point};

/// Points in camera axes, metres, and their pixels, by OpenCV 5.0 `projectPoints` and
/// `fisheye::projectPoints` for the cameras of cameras.toml.
#[rustfmt::skip]
const OPENCV: [(&str, [f64; 3], [f64; 2]); 14] = [
    ("pinhole", [-17.9717934071, -4.98981226582, 21.4492217386], [5.0, 5.0]),
    ("pinhole", [-4.47037501447, 4.2372154669, 22.5666205108], [466.625, 308.333333333]),
    ("barrel", [-23.663671844, -10.5653551008, 32.629356886], [5.0, 83.1666666667]),
    ("barrel", [-0.666307943046, 1.59498899697, 3.28790551963], [240.875, 474.0]),
    ("rational", [-122.394289417508, -91.9442750605817, 36.8573127820543], [10.0, 10.0]),
    ("rational", [-3.20710612882968, 3.61470830201617, 7.62103735982835], [430.0, 715.0]),
    ("prism", [-4.48844455122903, -3.31265974081695, 7.71994355600474], [10.0, 10.0]),
    ("prism", [-1.78936163486151, 2.09677657208964, 10.0436402190854], [430.0, 715.0]),
    ("tilted", [-9.12114834676547, -6.72490305455565, 14.9881995097243], [10.0, 10.0]),
    ("tilted", [-4.86523006735455, 5.71294175369026, 27.2694013617545], [430.0, 715.0]),
    ("fisheye", [-58.7323114948, -35.9707813968, 18.3196374963], [5.0, 5.0]),
    ("fisheye", [-1.80290624689, 3.62381196851, 6.43497455768], [480.875, 662.5]),
    ("fisheye_wide", [-18.3619673912198, -10.2429187972169, 3.29373212655547], [220.0, 245.0]),
    ("fisheye_wide", [27.7603905574466, -61.9426927846349, 4.35018354419577], [850.0, 10.0]),
];

/// A pixel; the ray's origin and direction, a point, and the point's pixel, in the axes of the
/// camera's vectors; tolerances in pixels and radians.
struct JplRow {
    camera: &'static str,
    pixel: [f64; 2],
    origin: [f64; 3],
    direction: [f64; 3],
    point: [f64; 3],
    seen: [f64; 2],
    tolerance: (f64, f64),
}

/// By cycahvore 0.0.1a0, which wraps JPL's `cmod_cahv*.c` of VICAR.
#[rustfmt::skip]
const JPL: [JplRow; 10] = [
    JplRow { camera: "cahv", pixel: [0.0, 170.5], origin: [0.823394, 0.796086, -1.84555], direction: [-0.498589882956, 0.718323593476, 0.485200312932], point: [-2.91603012217, 6.18351295107, 1.79345234699], seen: [0.0, 170.5], tolerance: (1e-8, 1e-7) },
    JplRow { camera: "cahv", pixel: [1023.0, 170.5], origin: [0.823394, 0.796086, -1.84555], direction: [-0.871900206348, 0.0748994234973, 0.483921591305], point: [-5.71585754761, 1.35783167623, 1.78386193478], seen: [1023.0, 170.5], tolerance: (1e-8, 1e-7) },
    JplRow { camera: "cahvor", pixel: [0.0, 0.0], origin: [0.960073, 0.0711001, -0.238974], direction: [0.709410676834, -0.443228780108, 0.547982426797], point: [6.28065307625, -3.25311575081, 3.87089420098], seen: [-3.24383890261e-06, -2.79915724963e-06], tolerance: (1e-6, 1e-7) },
    JplRow { camera: "cahvor", pixel: [1023.0, 0.0], origin: [0.960073, 0.0711001, -0.238974], direction: [0.798192274527, 0.264694775434, 0.541133780819], point: [6.94651505895, 2.05631091575, 3.81952935614], seen: [1022.99999976, 2.57001997459e-07], tolerance: (1e-6, 1e-7) },
    JplRow { camera: "cahvore", pixel: [0.0, 0.0], origin: [0.950848994031, 0.349752999779, -1.8942900041], direction: [0.721275551638, -0.675630278307, -0.15256843567], point: [6.36041563132, -4.71747408753, -3.03855327162], seen: [0.00503754705811, 0.00376596782695], tolerance: (0.02, 1e-5) },
    JplRow { camera: "cahvore", pixel: [1287.0, 0.0], origin: [0.950848998898, 0.349752999959, -1.89429000076], direction: [0.930092994593, -0.36014210598, -0.0722030104934], point: [7.92654645835, -2.35131279489, -2.43581257946], seen: [1287.00066623, 0.000986643135031], tolerance: (0.02, 1e-5) },
    JplRow { camera: "cahvore_perspective", pixel: [0.0, 0.0], origin: [0.563703209671294, 0.474436959118305, -1.901706769316], direction: [-0.757084740763589, -0.653236318332645, -0.00993132254933304], point: [-5.11443234605562, -4.42483542837653, -1.976191688436], seen: [-6.26252179355662e-06, -1.55980620713157e-06], tolerance: (0.02, 1e-5) },
    JplRow { camera: "cahvore_above", pixel: [0.0, 0.0], origin: [0.563935066762903, 0.475407010055308, -1.90231953607531], direction: [-0.807853114008649, -0.580108590198916, -0.104114296765153], point: [-5.49496328830197, -3.87540741643656, -2.68317676181396], seen: [0.000360903556271569, 0.000269670737331695], tolerance: (0.02, 1e-5) },
    JplRow { camera: "cahvore_below", pixel: [0.0, 0.0], origin: [0.567446173483033, 0.490096887945772, -1.91159891360709], direction: [-0.87631707290199, -0.317699105032302, -0.3621190525276], point: [-6.00493187328189, -1.89264639979649, -4.62749180756409], seen: [0.00439917434014109, 0.00328710695143408], tolerance: (0.02, 1e-5) },
    JplRow { camera: "cahvore_below", pixel: [1279.0, 959.0], origin: [0.566211732767931, 0.484932196350412, -1.9083364546877], direction: [0.746764920041685, -0.148253588077257, 0.648348906863499], point: [6.16694863308057, -0.626969714229018, 2.95428034678854], seen: [1278.99648276631, 958.997353343294], tolerance: (0.02, 1e-5) },
];

#[test]
fn opencv() {
    let cameras = super::cameras();
    for (name, [x, y, z], [u, v]) in OPENCV {
        let camera = &cameras[name];
        let point = Point::<Camera>::new(x, y, z);
        let seen = camera.pixel(point).unwrap();
        assert!(seen.distance(Pixel::new(u, v)) < 1e-6, "{name} {seen:?}");
        let ray = camera.ray(Pixel::new(u, v)).unwrap();
        let off = ray.direction.xyz().cross(&point.xyz.normalize()).norm();
        assert!(
            off < 1e-9 && ray.direction.xyz().dot(&point.xyz) > 0.0,
            "{name} {off:e}"
        );
    }
}

#[test]
fn jpl() {
    let cameras = super::cameras();
    for row in &JPL {
        let camera = &cameras[row.camera];
        // The vectors of this one are written in forward-left-up axes, all others in the rover's.
        let turn = if row.camera == "cahvore" { 1.0 } else { -1.0 };
        let body = |[x, y, z]: [f64; 3]| Vector3::new(x, turn * y, turn * z);
        let body_from_camera = camera.mount.body_from_camera(PanTilt::default());
        let [u, v] = row.pixel;
        let ray = body_from_camera * camera.ray(Pixel::new(u, v)).unwrap();
        let (px, rad) = row.tolerance;
        let off = ray.direction.xyz().cross(&body(row.direction)).norm();
        assert!(off < rad, "{} {off:e} rad", row.camera);
        assert!(
            (ray.origin.xyz - body(row.origin)).norm() < 2e-6,
            "{}",
            row.camera
        );
        let point = body_from_camera.inverse() * Point::from_xyz(body(row.point));
        let seen = camera.pixel(point).unwrap();
        let [u, v] = row.seen;
        assert!(
            seen.distance(Pixel::new(u, v)) < px,
            "{} {seen:?}",
            row.camera
        );
    }
}

/// Hand-made: 2048 columns over 360 degrees, 1024 rows over 180.
#[test]
fn panorama() {
    let panorama = &super::cameras()["panorama"];
    for (point, u, v) in [
        ([0.0, 0.0, 3.0], 1023.5, 511.5),  // forward
        ([2.0, 0.0, 0.0], 1535.5, 511.5),  // right
        ([-1.0, 0.0, 0.0], 511.5, 511.5),  // left
        ([0.0, -1.0, 1.0], 1023.5, 255.5), // forward and up by 45 degrees
    ] {
        let seen = panorama
            .pixel(Point::from_xyz(Vector3::from(point)))
            .unwrap();
        assert!(seen.distance(Pixel::new(u, v)) < 1e-9, "{seen:?}");
        let ray = panorama.ray(Pixel::new(u, v)).unwrap();
        assert!((ray.direction.xyz() - Vector3::from(point).normalize()).norm() < 1e-12);
    }
}
