//! Tables of pixels, rays and points that OpenCV and JPL's code produced, where they are at hand:
//! `$ROCKMAP_DATA/../vectors`. Each line of them must agree.

use std::path::PathBuf;

use nalgebra::Vector3;
use rockmap::camera::{
    BodyAxes, BrownConrady, Cahv, CahvVectors, Cahvor, Cahvore, Camera, Fisheye, Intrinsics, Lens,
    Linearity, Mount, PanTilt, Pinhole,
};
use rockmap::frame::{Body, Pixel, Point, Ray};
use rockmap::input::{Row, Table};
use serde_json::Value;

#[test]
fn opencv_tables() {
    let Some((models, mut table)) = open("opencv") else {
        return;
    };
    let mut worst = Worst::default();
    while let Some(row) = table.next_row() {
        let row = row.unwrap();
        let name = row.text("name").unwrap();
        let camera = opencv_camera(find(&models, name));
        let [x, y, z] = numbers(&row, ["x_cam", "y_cam", "z_cam"]);
        let [u, v] = numbers(&row, ["u_px", "v_px"]);
        let point = Point::new(x, y, z);
        let seen = camera.pixel(point).unwrap();
        let off_px = seen.distance(Pixel::new(u, v));
        let ray = camera.ray(Pixel::new(u, v)).unwrap();
        let off_rad = angle(ray.direction.xyz(), Vector3::new(x, y, z));
        worst.add(name, off_px, 1e-6, off_rad, 1e-7);
    }
    worst.judge("opencv");
}

#[test]
fn cahv_family_tables() {
    let Some((models, mut table)) = open("cahv_family") else {
        return;
    };
    let mut worst = Worst::default();
    while let Some(row) = table.next_row() {
        let row = row.unwrap();
        let name = row.text("model_name").unwrap();
        let model = find(&models, name);
        let camera = cahv_camera(model);
        let body_from_camera = camera.mount.body_from_camera(PanTilt::default());
        let [u, v] = numbers(&row, ["px_u", "px_v"]);
        let ray: Ray<Body> = body_from_camera * camera.ray(Pixel::new(u, v)).unwrap();
        let origin = Vector3::from(numbers(&row, ["origin_x", "origin_y", "origin_z"]));
        let direction = Vector3::from(numbers(&row, ["dir_x", "dir_y", "dir_z"]));
        // The tables round origins to 12 digits; a pupil that moves is JPL's to its own tolerance.
        let (px, rad) = match model["model"].as_str() {
            Some("CAHV") => (1e-8, 1e-7),
            Some("CAHVOR") => (1e-6, 1e-7),
            _ => (0.02, 1e-5),
        };
        assert!((ray.origin.xyz - origin).norm() < 1e-5, "{name} {u} {v}");
        let [x, y, z] = numbers(&row, ["point_x", "point_y", "point_z"]);
        let seen = camera
            .pixel(body_from_camera.inverse() * Point::new(x, y, z))
            .unwrap();
        let [u, v] = numbers(&row, ["reproj_u", "reproj_v"]);
        let off_px = seen.distance(Pixel::new(u, v));
        worst.add(name, off_px, px, angle(ray.direction.xyz(), direction), rad);
    }
    worst.judge("cahv_family");
}

/// The largest disagreement of every camera, and the rows beyond their bounds.
#[derive(Default)]
struct Worst {
    rows: usize,
    cameras: Vec<(String, f64, f64)>,
    beyond: Vec<String>,
}

impl Worst {
    fn add(&mut self, name: &str, off_px: f64, max_px: f64, off_rad: f64, max_rad: f64) {
        self.rows += 1;
        if !self.cameras.iter().any(|(known, ..)| known == name) {
            self.cameras.push((name.to_owned(), 0.0, 0.0));
        }
        let camera = self.cameras.iter_mut().find(|(known, ..)| known == name);
        let (_, px, rad) = camera.unwrap();
        *px = px.max(off_px);
        *rad = rad.max(off_rad);
        let within = off_px <= max_px && off_rad <= max_rad;
        if !within {
            self.beyond
                .push(format!("{name}: {off_px:e} px, {off_rad:e} rad"));
        }
    }

    fn judge(&self, table: &str) {
        for (name, px, rad) in &self.cameras {
            println!("{table}: {name}: at most {px:.1e} px, {rad:.1e} rad");
        }
        assert!(self.rows > 0, "the table is empty");
        assert!(self.beyond.is_empty(), "{:#?}", self.beyond);
    }
}

fn open(name: &str) -> Option<(Vec<Value>, Table)> {
    let data =
        std::env::var_os("ROCKMAP_DATA").map_or_else(|| "../shared/data".into(), PathBuf::from);
    let folder = data.join("../vectors");
    let table = folder.join(format!("{name}_vectors.csv"));
    if !table.is_file() {
        println!("skipped: no {}", table.display());
        return None;
    }
    let models = std::fs::read_to_string(folder.join(format!("{name}_models.json"))).unwrap();
    let models = serde_json::from_str(&models).unwrap();
    Some((models, Table::open(&table, name).unwrap()))
}

fn numbers<const N: usize>(row: &Row, columns: [&str; N]) -> [f64; N] {
    columns.map(|column| row.required_number(column).unwrap())
}

fn find<'a>(models: &'a [Value], name: &str) -> &'a Value {
    models.iter().find(|m| m["name"] == name).unwrap()
}

fn list(model: &Value, key: &str) -> Vec<f64> {
    let numbers = model[key].as_array().unwrap().iter();
    numbers.map(|x| x.as_f64().unwrap()).collect()
}

fn triple(model: &Value, key: &str) -> [f64; 3] {
    list(model, key).try_into().unwrap()
}

fn angle(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    a.cross(&b).norm().atan2(a.dot(&b))
}

fn camera(lens: Lens, mount: Mount) -> Camera {
    Camera {
        name: "tabulated".to_owned(),
        width: 1024,
        height: 1024,
        lens,
        mount,
        readout: None,
    }
}

fn opencv_camera(model: &Value) -> Camera {
    let [fx, fy, cx, cy] = list(model, "K")[..] else {
        panic!("K has four numbers");
    };
    let intrinsics = Intrinsics { fx, fy, cx, cy };
    let d = list(model, "d");
    let lens = match model["model"].as_str().unwrap() {
        "pinhole" => Lens::Pinhole(Pinhole::new(intrinsics).unwrap()),
        "brown_conrady" => Lens::BrownConrady(BrownConrady::new(intrinsics, &d).unwrap()),
        "opencv_fisheye" => Lens::Fisheye(Fisheye::new(intrinsics, d.try_into().unwrap()).unwrap()),
        other => panic!("no model {other}"),
    };
    camera(lens, Mount::default())
}

fn cahv_camera(model: &Value) -> Camera {
    let vectors = CahvVectors {
        axes: BodyAxes::Flu,
        centre: triple(model, "C"),
        axis: triple(model, "A"),
        horizontal: triple(model, "H"),
        vertical: triple(model, "V"),
    };
    let mount = Cahv::new(vectors).unwrap().mount();
    let lens = match model["model"].as_str().unwrap() {
        "CAHV" => Lens::Cahv(Cahv::new(vectors).unwrap()),
        "CAHVOR" => {
            let lens = Cahvor::new(vectors, triple(model, "O"), triple(model, "R"));
            Lens::Cahvor(lens.unwrap())
        }
        _ => {
            let linearity = match model["mtype"].as_i64().unwrap() {
                1 => Linearity::Perspective,
                2 => Linearity::Fisheye,
                _ => Linearity::General(model["linearity"].as_f64().unwrap()),
            };
            let [o, r, e] = ["O", "R", "E"].map(|key| triple(model, key));
            Lens::Cahvore(Cahvore::new(vectors, o, r, e, linearity).unwrap())
        }
    };
    camera(lens, mount)
}
