//! Camera chains of Kalibr: `camchain.yaml` and `camchain-imucam.yaml`.

use nalgebra::Matrix3;

use super::Found;
use super::fields::{NO_MOUNT, fisheye, required, standard};
use crate::camera::{Camera, Intrinsics, Lens, Mount};
use crate::frame::{self, Body, RigidTransform, Rotation, Vector};
use crate::input::Section;

/// Reads all cameras of a chain. `T_cam_imu` takes points of the inertial unit into the camera; the
/// unit counts as the body, its axes as forward, left, up. A camera without it hangs on the one
/// before it by `T_cn_cnm1`.
pub(super) fn read(root: &Section, found: &mut Found) {
    let mut before: Option<RigidTransform<frame::Camera, Body>> = None;
    for (name, section) in root.groups() {
        if !name.starts_with("cam") {
            continue;
        }
        let lens = lens(&section);
        let size = size(&section);
        let of_imu = transform(&section, "T_cam_imu");
        let of_previous = transform(&section, "T_cn_cnm1");
        let (Some(lens), Some([width, height]), Some(of_imu), Some(of_previous)) =
            (lens, size, of_imu, of_previous)
        else {
            continue;
        };
        let chained = of_previous.zip(before).map(|(previous, camera)| {
            // The camera before this one stands where a body would in the type of the matrix.
            let step = RigidTransform::<frame::Camera, frame::Camera>::new(
                Rotation::from_unit_quaternion(previous.rotation.quaternion()),
                previous.translation,
            );
            step * camera
        });
        let camera_from_body = of_imu.or(chained).unwrap_or_else(|| {
            found.note(format!("{name}: {NO_MOUNT}"));
            Mount::default()
                .body_from_camera(Default::default())
                .inverse()
        });
        before = Some(camera_from_body);
        found.cameras.push(Camera {
            name,
            width,
            height,
            lens,
            mount: Mount::from_transform(camera_from_body.inverse()),
            readout: None,
        });
    }
}

fn size(section: &Section) -> Option<[u32; 2]> {
    let expected = "width and height in pixels";
    let size = required(section, "resolution", expected, |s, key| {
        s.numbers(key, &[2])
    })?;
    let side = |x: f64| {
        let whole = (1.0..=1e6).contains(&x) && x.fract() == 0.0;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be whole and in range"
        )]
        whole.then_some(x as u32)
    };
    let sides = side(size[0]).zip(side(size[1]));
    if sides.is_none() {
        let found = format!("{} x {}", size[0], size[1]);
        section.fault("resolution", found, "whole numbers above zero");
    }
    sides.map(|(width, height)| [width, height])
}

fn lens(section: &Section) -> Option<Lens> {
    let name = |s: &Section, key: &str| s.text(key);
    let model = required(section, "camera_model", "the name of a model", name);
    let distortion_model = required(section, "distortion_model", "the name of a model", name);
    match model.as_deref() {
        Some("pinhole") => {}
        Some(other) => {
            let expected = "\"pinhole\", the one projection of Kalibr's that is read";
            section.fault("camera_model", format!("{other:?}"), expected);
            return None;
        }
        None => return None,
    }
    let given = required(section, "intrinsics", "fu, fv, pu, pv", |s, key| {
        s.numbers(key, &[4])
    });
    let key = "distortion_coeffs";
    let distortion_model = distortion_model?;
    let count = match distortion_model.as_str() {
        "radtan" | "equidistant" => 4,
        "none" => 0,
        other => {
            let expected = "one of radtan, equidistant, none";
            section.fault("distortion_model", format!("{other:?}"), expected);
            return None;
        }
    };
    let distortion = if count == 0 {
        Vec::new()
    } else {
        required(section, key, "the distortion coefficients", |s, key| {
            s.numbers(key, &[count])
        })?
    };
    let &[fx, fy, cx, cy] = given?.as_slice() else {
        return None;
    };
    let intrinsics = Intrinsics { fx, fy, cx, cy };
    match distortion_model.as_str() {
        "equidistant" => fisheye(section, key, intrinsics, &distortion),
        _ => standard(section, key, intrinsics, &distortion),
    }
}

/// A 4 x 4 matrix as a transform; the outer `None` where it is none, the inner where it is absent.
#[expect(clippy::option_option, reason = "absent and wrong are two things")]
fn transform(section: &Section, key: &str) -> Option<Option<RigidTransform<frame::Camera, Body>>> {
    if !section.has(key) {
        return Some(None);
    }
    let m = section.matrix(key, 4, 4)?;
    let turn = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let is_rotation = (turn * turn.transpose() - Matrix3::identity()).norm() < 1e-4
        && turn.determinant() > 0.0
        && m[12..] == [0.0, 0.0, 0.0, 1.0];
    if !is_rotation {
        let expected = "a rotation and a translation above 0, 0, 0, 1";
        section.fault(key, "a matrix that stretches or mirrors", expected);
        return None;
    }
    let translation = Vector::new(m[3], m[7], m[11]);
    Some(Some(RigidTransform::new(
        Rotation::from_matrix(turn),
        translation,
    )))
}
