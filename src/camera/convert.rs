//! Tables of pixels to tables of rays, and of points to pixels.

use super::{Camera, LensError, Mount, PanTilt};
use crate::error::{Error, Fault};
use crate::frame::{self, Pixel, Point, RigidTransform, Rotation, Vector};
use crate::input::{Row, Table};

/// The axes rays and points are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// The body's: x forward, y left, z up.
    Body,
    /// The camera's: x right, y down, z forward.
    Camera,
}

/// How a table is converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// The axes of rays and points.
    pub axes: Axes,
    /// The pan-tilt head; of no effect in camera axes.
    pub head: PanTilt,
    /// Whether derivatives are given too.
    pub jacobian: bool,
}

/// A converted table.
#[derive(Debug, Clone, PartialEq)]
pub struct Converted {
    /// CSV with a header row.
    pub csv: Vec<u8>,
    /// Records.
    pub n_rows: usize,
    /// Records without an answer.
    pub n_problems: usize,
}

const PIXEL: [&str; 2] = ["u_px", "v_px"];
const POINT: [&str; 3] = ["x_m", "y_m", "z_m"];
const RAY: [&str; 6] = [
    "origin_x_m",
    "origin_y_m",
    "origin_z_m",
    "direction_x",
    "direction_y",
    "direction_z",
];

/// The rays of a table's `u_px, v_px`: to these columns it adds `origin_x_m` to `origin_z_m`,
/// `direction_x` to `direction_z` (a unit vector), with derivatives `origin_x_m_by_u_px`,
/// `origin_x_m_by_v_px` and so on, and `problem`, which says why a record has no ray; its numbers
/// are then empty. Other columns follow as they are. Numbers are written with as many digits as
/// give them back exactly.
///
/// # Errors
/// All faults of the table at once.
pub fn rays_of_table(
    camera: &Camera,
    table: &mut Table,
    conversion: &Conversion,
) -> Result<Converted, Error> {
    let body_from_camera = conversion.axes_from_camera(&camera.mount);
    convert(table, &PIXEL, &RAY, conversion.jacobian, |[u, v]| {
        let (ray, by_pixel) = camera.ray_with_jacobian(Pixel::new(u, v))?;
        let ray = body_from_camera * ray;
        let by_pixel = by_pixel.turned(&body_from_camera.rotation.matrix());
        let (origin, direction) = (ray.origin.xyz, ray.direction.xyz());
        let values = origin.iter().chain(direction.iter());
        let rows = by_pixel
            .origin
            .row_iter()
            .chain(by_pixel.direction.row_iter());
        let slopes = rows.flat_map(|row| [row[0], row[1]]);
        Ok((values.copied().collect(), slopes.collect()))
    })
}

/// The raw pixels of a table's points `x_m, y_m, z_m`: to these columns it adds `u_px, v_px`, with
/// derivatives `u_px_by_x_m` and so on; otherwise as [`rays_of_table`]. A pixel may lie outside the
/// picture.
///
/// # Errors
/// All faults of the table at once.
pub fn pixels_of_table(
    camera: &Camera,
    table: &mut Table,
    conversion: &Conversion,
) -> Result<Converted, Error> {
    let camera_from_body = conversion.axes_from_camera(&camera.mount).inverse();
    convert(table, &POINT, &PIXEL, conversion.jacobian, |[x, y, z]| {
        let point = camera_from_body * Point::new(x, y, z);
        let (pixel, by_point) = camera.pixel_with_jacobian(point)?;
        let by_point = by_point * camera_from_body.rotation.matrix();
        let slopes = by_point.row_iter().flat_map(|r| [r[0], r[1], r[2]]);
        Ok((vec![pixel.u, pixel.v], slopes.collect()))
    })
}

impl Conversion {
    /// Camera axes into the wanted ones, which go by the name of the body's here.
    fn axes_from_camera(&self, mount: &Mount) -> RigidTransform<frame::Body, frame::Camera> {
        match self.axes {
            Axes::Body => mount.body_from_camera(self.head),
            Axes::Camera => RigidTransform::new(
                Rotation::from_unit_quaternion(nalgebra::UnitQuaternion::identity()),
                Vector::new(0.0, 0.0, 0.0),
            ),
        }
    }
}

/// The values of a record and their derivatives, row by row.
type Answer = Result<(Vec<f64>, Vec<f64>), LensError>;

fn convert<const N: usize>(
    table: &mut Table,
    from: &[&str; N],
    to: &[&str],
    jacobian: bool,
    answer: impl Fn([f64; N]) -> Answer,
) -> Result<Converted, Error> {
    table.require(from)?;
    let mut header: Vec<String> = from.iter().chain(to).map(|&c| c.to_owned()).collect();
    if jacobian {
        let slopes = to.iter().flat_map(|of| from.iter().map(move |by| (of, by)));
        header.extend(slopes.map(|(of, by)| format!("{of}_by_{by}")));
    }
    let n_values = header.len() - N;
    header.push("problem".to_owned());
    let taken: Vec<&str> = header.iter().map(String::as_str).collect();
    let others = table.unknown(&taken);
    header.extend(others.iter().cloned());
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| Error::Output(format!("cannot write a table: {e}"));
    writer.write_record(&header).map_err(failed)?;
    let (mut n_rows, mut n_problems) = (0, 0);
    let mut faults: Vec<Fault> = Vec::new();
    while let Some(row) = table.next_row() {
        let (row, given) = match row.and_then(|row| Ok((numbers(&row, from)?, row))) {
            Ok((given, row)) => (row, given),
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        n_rows += 1;
        let mut record: Vec<String> = given.iter().map(f64::to_string).collect();
        match answer(given) {
            Ok((values, slopes)) => {
                let all = values.iter().chain(&slopes).take(n_values);
                record.extend(all.map(shortest));
                record.push(String::new());
            }
            Err(problem) => {
                n_problems += 1;
                record.extend(vec![String::new(); n_values]);
                record.push(problem.to_string());
            }
        }
        record.extend(others.iter().map(|c| row.text(c).unwrap_or("").to_owned()));
        writer.write_record(&record).map_err(failed)?;
    }
    Error::check(faults)?;
    let csv = writer.into_inner();
    Ok(Converted {
        csv: csv.map_err(|e| Error::Output(format!("cannot write a table: {e}")))?,
        n_rows,
        n_problems,
    })
}

fn numbers<const N: usize>(row: &Row, columns: &[&str; N]) -> Result<[f64; N], Fault> {
    let mut numbers = [0.0; N];
    for (number, column) in numbers.iter_mut().zip(columns) {
        *number = row.required_number(column)?;
    }
    Ok(numbers)
}

/// The fewest digits that give the number back: with an exponent where it is very small or large.
fn shortest(number: &f64) -> String {
    // A zero without a sign.
    format!("{:?}", number + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::cameras_from_toml;

    /// A metre ahead and two up, looking forward.
    fn camera() -> Camera {
        let text = "[cameras.c]\nmodel = \"pinhole\"\nwidth = 101\nheight = 101\nfx = 100\nfy = 50\n\
            cx = 50\ncy = 50\nmount = { translation_m = [1, 0, 2] }\n";
        cameras_from_toml(text, "cameras.toml").unwrap()["c"].clone()
    }

    fn conversion(axes: Axes, jacobian: bool) -> Conversion {
        Conversion {
            axes,
            head: PanTilt::default(),
            jacobian,
        }
    }

    fn table(text: &str) -> Table {
        Table::from_bytes(text.as_bytes(), "points.csv").unwrap()
    }

    fn text(converted: &Converted) -> &str {
        std::str::from_utf8(&converted.csv).unwrap()
    }

    #[test]
    fn pixels_of_points_with_derivatives_problems_and_other_columns() {
        let points = "name,x_m,y_m,z_m,problem\nahead,11,-5,2,\nbehind,-3,0,0,old\n";
        let conversion = conversion(Axes::Body, true);
        let seen = pixels_of_table(&camera(), &mut table(points), &conversion).unwrap();
        assert_eq!((seen.n_rows, seen.n_problems), (2, 1));
        // 10 m ahead and 5 m to the right: a metre to the left is 10 columns less.
        assert_eq!(
            text(&seen),
            "x_m,y_m,z_m,u_px,v_px,u_px_by_x_m,u_px_by_y_m,u_px_by_z_m,v_px_by_x_m,v_px_by_y_m,v_px_by_z_m,problem,name\n\
             11,-5,2,100.0,50.0,-5.0,-10.0,0.0,0.0,0.0,-5.0,,ahead\n\
             -3,0,0,,,,,,,,,behind the camera,behind\n"
        );
    }

    #[test]
    fn rays_of_pixels() {
        let rays = rays_of_table(
            &camera(),
            &mut table("v_px,u_px\n50,50\n"),
            &conversion(Axes::Body, false),
        );
        assert_eq!(
            text(&rays.unwrap()),
            "u_px,v_px,origin_x_m,origin_y_m,origin_z_m,direction_x,direction_y,direction_z,problem\n\
             50,50,1.0,0.0,2.0,1.0,0.0,0.0,\n"
        );
        let rays = rays_of_table(
            &camera(),
            &mut table("u_px,v_px\n50,50\n"),
            &conversion(Axes::Camera, true),
        );
        let expected =
            "50,50,0.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,0.0,0.0,0.01,0.0,0.0,0.02,0.0,0.0,\n";
        assert!(text(&rays.unwrap()).ends_with(expected));
    }

    #[test]
    fn the_head_turns_rays() {
        let head = PanTilt {
            pan: std::f64::consts::FRAC_PI_2,
            tilt: 0.0,
        };
        let conversion = Conversion {
            head,
            ..conversion(Axes::Body, false)
        };
        let rays = rays_of_table(&camera(), &mut table("u_px,v_px\n50,50\n"), &conversion);
        let rays = rays.unwrap();
        let mut again = Table::from_bytes(&rays.csv, "rays.csv").unwrap();
        let row = again.next_row().unwrap().unwrap();
        // A quarter to the right.
        assert!((row.required_number("direction_y").unwrap() + 1.0).abs() < 1e-15);
    }

    #[test]
    fn faults_are_listed_together() {
        let mut bad = table("u_px,v_px\n1,2\n1,x\n,3\n");
        let error = rays_of_table(&camera(), &mut bad, &conversion(Axes::Body, false)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "points.csv:3: v_px: found \"x\", expected a number\n\
             points.csv:4: u_px: found nothing, expected a number"
        );
        let mut bad = table("u,v_px\n1,2\n");
        let error = rays_of_table(&camera(), &mut bad, &conversion(Axes::Body, false)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "points.csv:1: u_px: found columns u, v_px, expected a column u_px (is v_px meant?)"
        );
    }
}
