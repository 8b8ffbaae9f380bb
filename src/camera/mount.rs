//! Where a camera sits on its platform.

use nalgebra::{UnitQuaternion, Vector3};

use crate::frame::{self, Point, RigidTransform, Rotation, Vector};

/// The angles of a pan-tilt head, radians; both zero in the mount as given.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PanTilt {
    /// Clockwise seen from above: positive looks to the right.
    pub pan: f64,
    /// Positive looks up.
    pub tilt: f64,
}

/// A camera's place and attitude in body axes with its pan-tilt head at zero, and the head's pivot.
#[derive(Debug, Clone, Copy)]
pub struct Mount {
    translation: Vector<frame::Body>,
    /// As given, not normalised: a mount that is written and read again is the same to the last bit.
    quaternion: [f64; 4],
    pivot: Option<Point<frame::Body>>,
    body_from_camera: RigidTransform<frame::Body, frame::Camera>,
}

impl Default for Mount {
    /// At the body's origin, looking forward, upright.
    fn default() -> Self {
        let quaternion = Self::FORWARD;
        let [w, x, y, z] = quaternion;
        let unit = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        let rotation = Rotation::from_unit_quaternion(unit);
        Self::from_transform(RigidTransform::new(rotation, Vector::new(0.0, 0.0, 0.0)))
    }
}

impl PartialEq for Mount {
    fn eq(&self, other: &Self) -> bool {
        self.is_at(other) && self.pivot == other.pivot
    }
}

impl Mount {
    /// The quaternion, scalar first, of a camera that looks along the body's forward axis: camera
    /// axes (right, down, forward) into body axes (forward, left, up).
    pub const FORWARD: [f64; 4] = [0.5, -0.5, 0.5, -0.5];

    /// A camera whose centre lies at `translation` and whose axes `quaternion` (scalar first, of
    /// any length) rotates into body axes; `None` where the quaternion has no length.
    pub fn new(translation: Vector<frame::Body>, quaternion: [f64; 4]) -> Option<Self> {
        let rotation = Rotation::from_scalar_first(quaternion)?;
        Some(Self {
            translation,
            quaternion,
            pivot: None,
            body_from_camera: RigidTransform::new(rotation, translation),
        })
    }

    /// The mount of a transform.
    pub fn from_transform(body_from_camera: RigidTransform<frame::Body, frame::Camera>) -> Self {
        let translation = body_from_camera.translation;
        let quaternion = body_from_camera.rotation.scalar_first();
        // Through the same door as a mount that is read, so that both are the same to the last bit.
        Self::new(translation, quaternion).unwrap_or(Self {
            translation,
            quaternion,
            pivot: None,
            body_from_camera,
        })
    }

    /// The same camera on a head that turns about `pivot`; without one it turns about its centre.
    pub fn with_pivot(self, pivot: Point<frame::Body>) -> Self {
        Self {
            pivot: Some(pivot),
            ..self
        }
    }

    /// Whether another mount puts a camera in the same place and attitude, wherever the pivots are.
    pub fn is_at(&self, other: &Self) -> bool {
        self.translation == other.translation && self.quaternion == other.quaternion
    }

    /// The camera's centre in body axes with the head at zero, metres.
    pub fn translation(&self) -> Vector<frame::Body> {
        self.translation
    }

    /// The quaternion as given, scalar first.
    pub fn quaternion(&self) -> [f64; 4] {
        self.quaternion
    }

    /// The pivot that was given, if any, in body axes, metres.
    pub fn pivot(&self) -> Option<Point<frame::Body>> {
        self.pivot
    }

    /// The camera's place and attitude with the head at these angles: first the pan about the
    /// body's up axis, then the tilt about the head's left-right axis, which turns with the pan;
    /// both axes run through the pivot.
    pub fn body_from_camera(&self, head: PanTilt) -> RigidTransform<frame::Body, frame::Camera> {
        let zero = self.body_from_camera;
        if head == PanTilt::default() {
            return zero;
        }
        // Right-handed angles about up and left are counter-clockwise and downward.
        let pan = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -head.pan);
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -head.tilt);
        let turn = Rotation::<frame::Body, frame::Body>::from_unit_quaternion(pan * tilt);
        let pivot = self.pivot.unwrap_or(zero.origin());
        let arm = turn * (zero.origin() - pivot);
        let centre = (pivot + arm) - Point::origin();
        RigidTransform::new(turn * zero.rotation, centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Body, Camera};

    fn forward(transform: RigidTransform<Body, Camera>) -> Vector3<f64> {
        (transform.rotation * Vector::<Camera>::new(0.0, 0.0, 1.0)).xyz
    }

    #[test]
    fn a_default_camera_looks_forward_upright() {
        let axes = Mount::default().body_from_camera(PanTilt::default());
        let seen = axes * Point::<Camera>::new(1.0, 2.0, 3.0); // 1 right, 2 down, 3 ahead
        assert!(seen.distance(Point::new(3.0, -1.0, -2.0)) < 1e-15);
    }

    #[test]
    fn pan_turns_right_and_tilt_up_about_the_pivot() {
        // A camera 0.1 m ahead of its head's pivot, 2 m above the ground.
        let mount = Mount::new(Vector::new(0.6, 0.0, 2.0), Mount::FORWARD)
            .unwrap()
            .with_pivot(Point::new(0.5, 0.0, 2.0));
        let quarter = std::f64::consts::FRAC_PI_2;
        let right = mount.body_from_camera(PanTilt {
            pan: quarter,
            tilt: 0.0,
        });
        assert!((forward(right) - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-15);
        assert!(right.origin().distance(Point::new(0.5, -0.1, 2.0)) < 1e-15);
        let up = mount.body_from_camera(PanTilt {
            pan: 0.0,
            tilt: quarter,
        });
        assert!((forward(up) - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-15);
        assert!(up.origin().distance(Point::new(0.5, 0.0, 2.1)) < 1e-15);
        // To the right and then 30 degrees down: the tilt axis has turned with the pan.
        let angles = PanTilt {
            pan: quarter,
            tilt: -quarter / 3.0,
        };
        let below = forward(mount.body_from_camera(angles));
        assert!((below - Vector3::new(0.0, -0.75f64.sqrt(), -0.5)).norm() < 1e-15);
        // The picture stays level: its right-hand side is still horizontal, towards the rear.
        let side = mount.body_from_camera(angles).rotation * Vector::<Camera>::new(1.0, 0.0, 0.0);
        assert!((side.xyz - Vector3::new(-1.0, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn without_a_pivot_the_centre_stays() {
        let mount = Mount::new(Vector::new(0.6, -0.2, 2.0), [2.0, -2.0, 2.0, -2.0]).unwrap();
        let turned = mount.body_from_camera(PanTilt {
            pan: 0.3,
            tilt: -0.4,
        });
        assert!(turned.origin().distance(Point::new(0.6, -0.2, 2.0)) < 1e-15);
        assert!(Mount::new(Vector::new(0.0, 0.0, 0.0), [0.0; 4]).is_none());
    }
}
