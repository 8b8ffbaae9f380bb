//! The cameras of a file, for people and programs.

use super::{Camera, Cameras};
use crate::error::{Fault, Place, suggestion};
use crate::frame::Pixel;

impl Camera {
    /// The angle from the left border of the picture to the right one along its middle row,
    /// radians; `None` where the lens does not reach a border.
    pub fn horizontal_field(&self) -> Option<f64> {
        let row = 0.5 * (f64::from(self.height) - 1.0);
        let width = f64::from(self.width);
        let direction = |u: f64| Some(self.ray(Pixel::new(u, row)).ok()?.direction.xyz());
        // Two halves, since an angle between directions is at most 180 degrees.
        let [left, middle, right] = [-0.5, 0.5 * (width - 1.0), width - 0.5].map(direction);
        let (left, middle, right) = (left?, middle?, right?);
        Some(left.angle(&middle) + middle.angle(&right))
    }
}

/// The camera of a name, or the only one where none is named. `file` is what faults call the file
/// the cameras come from by.
///
/// # Errors
/// A name that no camera has; none, where there are several.
pub fn find_camera<'a>(
    cameras: &'a Cameras,
    name: Option<&str>,
    file: &str,
) -> Result<&'a Camera, Fault> {
    let names: Vec<&str> = cameras.keys().map(String::as_str).collect();
    let expected = format!("one of {}", names.join(", "));
    let fault = |found: &str, expected| Fault::found(Place::file(file), "camera", found, expected);
    match (name, &names[..]) {
        (Some(name), _) => cameras.get(name).ok_or_else(|| {
            let near = suggestion(name, names.iter().copied());
            let near = near.map(|n| format!(" (is {n} meant?)"));
            fault(name, expected + &near.unwrap_or_default())
        }),
        (None, [only]) => Ok(&cameras[*only]),
        (None, _) => Err(fault("no name", expected)),
    }
}

/// One line a camera: name, model, size and horizontal field of view; with a header.
pub fn cameras_as_text(cameras: &Cameras) -> String {
    let header = ["name", "model", "size", "field"].map(str::to_owned);
    let mut rows = vec![header];
    rows.extend(cameras.values().map(|camera| {
        let field = camera.horizontal_field();
        [
            camera.name.clone(),
            camera.lens.model().to_owned(),
            format!("{}x{}", camera.width, camera.height),
            field.map_or("-".to_owned(), |f| format!("{:.1} deg", f.to_degrees())),
        ]
    }));
    let width = |i: usize| rows.iter().map(|r| r[i].chars().count()).max().unwrap_or(0);
    let widths: [usize; 4] = std::array::from_fn(width);
    let line = |[name, model, size, field]: &[String; 4]| {
        let [a, b, c, _] = widths;
        format!("{name:a$}  {model:b$}  {size:c$}  {field}\n")
    };
    rows.iter().map(line).collect()
}

/// A list of objects `name, model, width, height, hfov_deg`; the latter is null where the lens does
/// not reach the picture's border.
pub fn cameras_as_json(cameras: &Cameras) -> String {
    let one = |camera: &Camera| {
        serde_json::json!({
            "name": camera.name,
            "model": camera.lens.model(),
            "width": camera.width,
            "height": camera.height,
            "hfov_deg": camera.horizontal_field().map(f64::to_degrees),
        })
    };
    let list: serde_json::Value = cameras.values().map(one).collect();
    format!("{list:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::cameras_from_toml;

    fn cameras() -> Cameras {
        // 200 columns at a focal length of 100: 90 degrees; distortion that ends at 31 degrees.
        let text = "\
[cameras.nav]
model = \"pinhole\"
width = 200
height = 101
fx = 100
fy = 100
cx = 99.5
cy = 50

[cameras.all_around]
model = \"equirectangular\"
width = 720
height = 360

[cameras.cut]
model = \"brown_conrady\"
width = 200
height = 100
fx = 100
fy = 100
cx = 99.5
cy = 50
distortion = [-0.9, 0, 0, 0]
";
        cameras_from_toml(text, "cameras.toml").unwrap()
    }

    #[test]
    fn listed_for_people() {
        assert_eq!(
            cameras_as_text(&cameras()),
            "name        model            size     field\n\
             all_around  equirectangular  720x360  360.0 deg\n\
             cut         brown_conrady    200x100  -\n\
             nav         pinhole          200x101  90.0 deg\n"
        );
    }

    #[test]
    fn listed_for_programs() {
        let list: serde_json::Value = serde_json::from_str(&cameras_as_json(&cameras())).unwrap();
        assert_eq!(list[1]["hfov_deg"], serde_json::Value::Null);
        assert_eq!(list[2]["name"], "nav");
        assert_eq!(list[2]["width"], 200);
        let field = list[2]["hfov_deg"].as_f64().unwrap();
        assert!((field - 90.0).abs() < 1e-12);
    }

    #[test]
    fn a_camera_is_found_by_its_name() {
        let cameras = cameras();
        assert_eq!(find_camera(&cameras, Some("nav"), "f").unwrap().width, 200);
        let fault = |name| {
            find_camera(&cameras, name, "f.toml")
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            fault(Some("navy")),
            "f.toml: camera: found navy, expected one of all_around, cut, nav (is nav meant?)"
        );
        assert_eq!(
            fault(None),
            "f.toml: camera: found no name, expected one of all_around, cut, nav"
        );
        let one: Cameras = cameras.clone().into_iter().take(1).collect();
        assert_eq!(find_camera(&one, None, "f").unwrap().name, "all_around");
    }
}
