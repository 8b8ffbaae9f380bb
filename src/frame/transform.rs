//! Rotations and rigid transforms between frames.

use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::{Direction, Point, Ray, Vector};

/// Rotates from the axes of `From` into the axes of `To`.
pub struct Rotation<To, From> {
    rotation: UnitQuaternion<f64>,
    frames: PhantomData<fn(From) -> To>,
}

/// Turns and shifts points of `From` into points of `To`.
pub struct RigidTransform<To, From> {
    /// The rotation of the axes.
    pub rotation: Rotation<To, From>,
    /// Where the origin of `From` lies in `To`.
    pub translation: Vector<To>,
}

impl<To, From> Clone for Rotation<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Rotation<To, From> {}
impl<To, From> std::fmt::Debug for Rotation<To, From> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Rotation({:?})", self.rotation)
    }
}
impl<To, From> Clone for RigidTransform<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for RigidTransform<To, From> {}
impl<To, From> std::fmt::Debug for RigidTransform<To, From> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "RigidTransform({:?}, {:?})",
            self.rotation, self.translation
        )
    }
}

impl<To, From> Rotation<To, From> {
    /// The axes of both frames coincide.
    pub fn identity() -> Self {
        Self::from_unit_quaternion(UnitQuaternion::identity())
    }

    /// From a unit quaternion that rotates `From` axes into `To` axes.
    pub const fn from_unit_quaternion(rotation: UnitQuaternion<f64>) -> Self {
        Self {
            rotation,
            frames: PhantomData,
        }
    }

    /// From the four numbers of a quaternion, scalar first, normalised here; `None` where their
    /// length is under 1e-9 or not finite.
    pub fn from_scalar_first([w, x, y, z]: [f64; 4]) -> Option<Self> {
        let q = Quaternion::new(w, x, y, z);
        (q.norm().is_finite() && q.norm() > 1e-9)
            .then(|| Self::from_unit_quaternion(UnitQuaternion::from_quaternion(q)))
    }

    /// From a proper rotation matrix, whose columns are the `From` axes written in `To`.
    pub fn from_matrix(matrix: Matrix3<f64>) -> Self {
        Self::from_unit_quaternion(UnitQuaternion::from_rotation_matrix(
            &Rotation3::from_matrix_unchecked(matrix),
        ))
    }

    /// The rotation matrix: its columns are the `From` axes written in `To`.
    pub fn matrix(&self) -> Matrix3<f64> {
        self.rotation.to_rotation_matrix().into_inner()
    }

    /// The unit quaternion.
    pub const fn quaternion(&self) -> UnitQuaternion<f64> {
        self.rotation
    }

    /// The quaternion's four numbers, scalar first, with the scalar not negative.
    pub fn scalar_first(&self) -> [f64; 4] {
        let q = self.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [sign * q.w, sign * q.i, sign * q.j, sign * q.k]
    }

    /// The opposite rotation.
    pub fn inverse(&self) -> Rotation<From, To> {
        Rotation::from_unit_quaternion(self.rotation.inverse())
    }

    /// `R Exp(delta)`: this rotation turned further by the rotation vector `delta`, radians, about
    /// the axes of `From`. This is how a pose's attitude error is defined.
    pub fn perturbed(&self, delta: Vector3<f64>) -> Self {
        Self::from_unit_quaternion(self.rotation * UnitQuaternion::from_scaled_axis(delta))
    }

    /// Spherical linear interpolation by the shorter arc, `share` from 0 (this) to 1 (`other`).
    pub fn slerp(&self, other: &Self, share: f64) -> Self {
        // The angle between opposite attitudes has no shorter arc: nlerp's fallback is any one.
        let between = self
            .rotation
            .try_slerp(&other.rotation, share, 1e-12)
            .unwrap_or(if share < 0.5 {
                self.rotation
            } else {
                other.rotation
            });
        Self::from_unit_quaternion(between)
    }
}

impl<To, From> RigidTransform<To, From> {
    /// Both frames coincide.
    pub fn identity() -> Self {
        Self::new(Rotation::identity(), Vector::new(0.0, 0.0, 0.0))
    }

    /// From a rotation and the place of `From`'s origin in `To`.
    pub const fn new(rotation: Rotation<To, From>, translation: Vector<To>) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// Where the origin of `From` lies in `To`.
    pub fn origin(&self) -> Point<To> {
        Point::from_xyz(self.translation.xyz)
    }

    /// The opposite transform.
    pub fn inverse(&self) -> RigidTransform<From, To> {
        let rotation = self.rotation.inverse();
        RigidTransform::new(rotation, -(rotation * self.translation))
    }
}

impl<To, Mid, From> Mul<Rotation<Mid, From>> for Rotation<To, Mid> {
    type Output = Rotation<To, From>;
    fn mul(self, other: Rotation<Mid, From>) -> Rotation<To, From> {
        Rotation::from_unit_quaternion(self.rotation * other.rotation)
    }
}
impl<To, From> Mul<Vector<From>> for Rotation<To, From> {
    type Output = Vector<To>;
    fn mul(self, v: Vector<From>) -> Vector<To> {
        Vector::from_xyz(self.rotation * v.xyz)
    }
}
impl<To, From> Mul<Direction<From>> for Rotation<To, From> {
    type Output = Direction<To>;
    fn mul(self, d: Direction<From>) -> Direction<To> {
        Direction::from_unit(self.rotation * d.xyz())
    }
}
impl<To, Mid, From> Mul<RigidTransform<Mid, From>> for RigidTransform<To, Mid> {
    type Output = RigidTransform<To, From>;
    fn mul(self, other: RigidTransform<Mid, From>) -> RigidTransform<To, From> {
        RigidTransform::new(
            self.rotation * other.rotation,
            self.rotation * other.translation + self.translation,
        )
    }
}
impl<To, From> Mul<Point<From>> for RigidTransform<To, From> {
    type Output = Point<To>;
    fn mul(self, p: Point<From>) -> Point<To> {
        Point::from_xyz((self.rotation * Vector::<From>::from_xyz(p.xyz) + self.translation).xyz)
    }
}
impl<To, From> Mul<Ray<From>> for RigidTransform<To, From> {
    type Output = Ray<To>;
    fn mul(self, ray: Ray<From>) -> Ray<To> {
        Ray {
            origin: self * ray.origin,
            direction: self.rotation * ray.direction,
        }
    }
}

/// The matrix `[v]x` with `[v]x w = v x w`.
pub fn skew(v: Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Body, Enu};

    #[test]
    fn perturbation_is_in_body_axes() {
        // A platform facing north (body x = north) that pitches up about its own y (left) axis by
        // -1 degree (right-handed: x towards -z) looks below the horizon for a positive angle.
        let north = Rotation::<Enu, Body>::from_matrix(Matrix3::new(
            0.0, -1.0, 0.0, //
            1.0, 0.0, 0.0, //
            0.0, 0.0, 1.0,
        ));
        let turned = north.perturbed(Vector3::new(0.0, 0.1, 0.0));
        let forward = turned * Vector::<Body>::new(1.0, 0.0, 0.0);
        assert!((forward.xyz - Vector3::new(0.0, 0.1f64.cos(), -(0.1f64.sin()))).norm() < 1e-15);
    }

    #[test]
    fn inverse_undoes_the_transform() {
        let t = RigidTransform::<Enu, Body>::new(
            Rotation::from_scalar_first([0.3, -0.2, 0.5, 0.7]).unwrap(),
            Vector::new(3.0, -2.0, 1.0),
        );
        let p = Point::<Body>::new(0.4, 5.0, -6.0);
        assert!((t.inverse() * (t * p)).distance(p) < 1e-14);
    }

    #[test]
    fn zero_quaternion_is_no_rotation() {
        assert!(Rotation::<Enu, Body>::from_scalar_first([0.0; 4]).is_none());
        assert!(Rotation::<Enu, Body>::from_scalar_first([f64::NAN, 0.0, 0.0, 1.0]).is_none());
    }

    #[test]
    fn slerp_takes_the_shorter_arc() {
        let a = Rotation::<Enu, Body>::identity();
        let b = a.perturbed(Vector3::new(0.0, 0.0, 1.0));
        let [w, x, y, z] = b.scalar_first();
        let negated = Rotation::<Enu, Body>::from_scalar_first([-w, -x, -y, -z]).unwrap();
        let half = a.slerp(&negated, 0.5);
        assert!((half.quaternion().scaled_axis() - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-12);
    }
}
