//! Points, vectors, directions and rays that know their frame.

use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

use nalgebra::Vector3;

macro_rules! triple {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        pub struct $name<F> {
            /// The three components along the frame's axes, metres.
            pub xyz: Vector3<f64>,
            frame: PhantomData<fn() -> F>,
        }

        impl<F> Clone for $name<F> {
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<F> Copy for $name<F> {}
        impl<F> PartialEq for $name<F> {
            fn eq(&self, other: &Self) -> bool {
                self.xyz == other.xyz
            }
        }
        impl<F> std::fmt::Debug for $name<F> {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let axes = std::any::type_name::<F>().rsplit("::").next().unwrap_or("?");
                write!(f, "{}<{axes}>({}, {}, {})", stringify!($name), self.xyz.x, self.xyz.y, self.xyz.z)
            }
        }
        impl<F> $name<F> {
            /// From components along the frame's x, y and z axes, metres.
            pub const fn new(x: f64, y: f64, z: f64) -> Self {
                Self::from_xyz(Vector3::new(x, y, z))
            }
            /// From a bare vector whose frame the caller vouches for.
            pub const fn from_xyz(xyz: Vector3<f64>) -> Self {
                Self { xyz, frame: PhantomData }
            }
        }
    };
}

triple!(
    /// A place, in the axes of frame `F`.
    Point
);
triple!(
    /// A displacement, in the axes of frame `F`.
    Vector
);

impl<F> Point<F> {
    /// The frame's origin.
    pub const fn origin() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }

    /// Distance to another point of the same frame, metres.
    pub fn distance(self, other: Self) -> f64 {
        (self.xyz - other.xyz).norm()
    }

    /// Distance to another point of the same frame in its x-y plane, metres: in [`super::Enu`] the
    /// ground range.
    pub fn horizontal_distance(self, other: Self) -> f64 {
        (self.xyz - other.xyz).xy().norm()
    }
}

impl<F> Vector<F> {
    /// Length, metres.
    pub fn norm(self) -> f64 {
        self.xyz.norm()
    }
}

impl<F> Sub for Point<F> {
    type Output = Vector<F>;
    fn sub(self, other: Self) -> Vector<F> {
        Vector::from_xyz(self.xyz - other.xyz)
    }
}
impl<F> Add<Vector<F>> for Point<F> {
    type Output = Point<F>;
    fn add(self, v: Vector<F>) -> Point<F> {
        Point::from_xyz(self.xyz + v.xyz)
    }
}
impl<F> Add for Vector<F> {
    type Output = Vector<F>;
    fn add(self, v: Self) -> Self {
        Self::from_xyz(self.xyz + v.xyz)
    }
}
impl<F> Sub for Vector<F> {
    type Output = Vector<F>;
    fn sub(self, v: Self) -> Self {
        Self::from_xyz(self.xyz - v.xyz)
    }
}
impl<F> Mul<f64> for Vector<F> {
    type Output = Vector<F>;
    fn mul(self, k: f64) -> Self {
        Self::from_xyz(self.xyz * k)
    }
}
impl<F> Div<f64> for Vector<F> {
    type Output = Vector<F>;
    fn div(self, k: f64) -> Self {
        Self::from_xyz(self.xyz / k)
    }
}
impl<F> Neg for Vector<F> {
    type Output = Vector<F>;
    fn neg(self) -> Self {
        Self::from_xyz(-self.xyz)
    }
}

/// A unit vector in the axes of frame `F`.
pub struct Direction<F> {
    unit: Vector3<f64>,
    frame: PhantomData<fn() -> F>,
}

impl<F> Clone for Direction<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Direction<F> {}
impl<F> PartialEq for Direction<F> {
    fn eq(&self, other: &Self) -> bool {
        self.unit == other.unit
    }
}
impl<F> std::fmt::Debug for Direction<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Direction{:?}", Vector::<F>::from_xyz(self.unit))
    }
}

impl<F> Direction<F> {
    /// The direction of a vector, or `None` where its length is zero or not finite.
    pub fn new(v: Vector3<f64>) -> Option<Self> {
        let norm = v.norm();
        (norm > 0.0 && norm.is_finite()).then(|| Self::from_unit(v / norm))
    }

    /// From a vector that the caller knows to have length one.
    pub const fn from_unit(unit: Vector3<f64>) -> Self {
        Self {
            unit,
            frame: PhantomData,
        }
    }

    /// The unit vector's components.
    pub const fn xyz(self) -> Vector3<f64> {
        self.unit
    }
}

impl<F> Mul<f64> for Direction<F> {
    type Output = Vector<F>;
    fn mul(self, length: f64) -> Vector<F> {
        Vector::from_xyz(self.unit * length)
    }
}

/// A half-line: a starting point and a direction.
pub struct Ray<F> {
    /// Where it starts.
    pub origin: Point<F>,
    /// Where it points.
    pub direction: Direction<F>,
}

impl<F> Clone for Ray<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Ray<F> {}
impl<F> std::fmt::Debug for Ray<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Ray({:?} along {:?})", self.origin, self.direction)
    }
}

impl<F> Ray<F> {
    /// The point `distance` metres along the ray.
    pub fn at(self, distance: f64) -> Point<F> {
        self.origin + self.direction * distance
    }
}
