//! JPL's linear camera model, and what its relatives share with it.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, Vector3};

use super::sensor::Sensor;
use super::{BadLens, LensError, Mount};
use crate::frame::{self, Pixel, Point, Ray, RigidTransform, Rotation, Vector};

/// The body axes that the vectors of a CAHV model are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyAxes {
    /// x forward, y left, z up: this program's body axes.
    Flu,
    /// x forward, y right, z down: the rover frames of NASA's missions.
    Frd,
}

impl BodyAxes {
    /// The word `axes = "..."` of cameras.toml.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Flu => "flu",
            Self::Frd => "frd",
        }
    }

    /// The vector in body axes (forward, left, up).
    pub(super) fn to_body(self, [x, y, z]: [f64; 3]) -> Vector3<f64> {
        match self {
            Self::Flu => Vector3::new(x, y, z),
            Self::Frd => Vector3::new(x, -y, -z),
        }
    }
}

/// The four vectors of a CAHV model (Yakimovsky and Cunningham 1978): a point P in body axes is seen
/// at `u = (P - C).H / (P - C).A`, `v = (P - C).V / (P - C).A`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CahvVectors {
    /// The axes they are written in.
    pub axes: BodyAxes,
    /// C: the camera's centre, metres.
    pub centre: [f64; 3],
    /// A: the unit normal of the image plane.
    pub axis: [f64; 3],
    /// H: the columns' direction times the focal length, plus A times the centre column; pixels.
    pub horizontal: [f64; 3],
    /// V: the rows' direction times the focal length, plus A times the centre row; pixels.
    pub vertical: [f64; 3],
}

/// JPL's linear model, CAHV.
///
/// Its vectors are turned into a [`Mount`] and a lens once, at construction: camera z along A, x
/// along the part of H across A, y completing the right-handed axes (downward in the picture). The
/// lengths and angles of the vectors stay exactly as given, so a camera whose A is not quite of
/// length one, or whose pixels are skewed, projects as its formula says.
#[derive(Debug, Clone, PartialEq)]
pub struct Cahv {
    vectors: CahvVectors,
    mount: Mount,
    /// Rows H, V, A in camera axes.
    rows: Matrix3<f64>,
    sensor: Sensor,
}

impl Cahv {
    /// The lens of these vectors.
    ///
    /// # Errors
    /// [`BadLens::NoDirection`] where A is zero, [`BadLens::Singular`] where H, V and A do not point
    /// in three directions.
    pub fn new(vectors: CahvVectors) -> Result<Self, BadLens> {
        let body = |v: [f64; 3]| vectors.axes.to_body(v);
        let axis = body(vectors.axis);
        let horizontal = body(vectors.horizontal);
        let forward = axis
            .try_normalize(1e-9)
            .filter(|z| z.iter().all(|c| c.is_finite()))
            .ok_or(BadLens::NoDirection("A"))?;
        let right = (horizontal - forward * forward.dot(&horizontal))
            .try_normalize(1e-9)
            .ok_or(BadLens::Singular)?;
        let down = forward.cross(&right);
        let axes = Matrix3::from_columns(&[right, down, forward]);
        let mount = Mount::from_transform(RigidTransform::new(
            Rotation::from_matrix(axes),
            Vector::from_xyz(body(vectors.centre)),
        ));
        let rows = Matrix3::from_rows(&[
            horizontal.transpose(),
            body(vectors.vertical).transpose(),
            axis.transpose(),
        ]) * rotation(&mount);
        Ok(Self {
            vectors,
            mount,
            rows,
            sensor: Sensor::new(rows).ok_or(BadLens::Singular)?,
        })
    }

    /// The vectors it was made from.
    pub fn vectors(&self) -> CahvVectors {
        self.vectors
    }

    /// The place and attitude that the vectors give the camera.
    pub fn mount(&self) -> Mount {
        self.mount
    }

    /// The vectors of this lens on any mount: those it was made from on its own, and the same turned
    /// and shifted, in forward-left-up axes, on another.
    pub fn vectors_on(&self, mount: &Mount) -> CahvVectors {
        if self.mount.is_at(mount) {
            return self.vectors;
        }
        let turned = |row: usize| (rotation(mount) * self.rows.row(row).transpose()).into();
        CahvVectors {
            axes: BodyAxes::Flu,
            centre: mount.translation().xyz.into(),
            axis: turned(2),
            horizontal: turned(0),
            vertical: turned(1),
        }
    }

    /// A direction written in body axes, in camera axes.
    pub(super) fn camera_direction(&self, body: [f64; 3]) -> Vector3<f64> {
        rotation(&self.mount).transpose() * self.vectors.axes.to_body(body)
    }

    /// The homography from the plane at unit depth along another axis to pixels; `lens_from_camera`
    /// turns camera axes into ones whose z is that axis.
    pub(super) fn sensor_along(&self, lens_from_camera: &Matrix3<f64>) -> Option<Sensor> {
        Sensor::new(self.rows * lens_from_camera.transpose())
    }

    #[inline]
    pub(super) fn ray(&self, pixel: Pixel) -> Result<Ray<frame::Camera>, LensError> {
        self.sensor.perspective_ray(pixel)
    }

    #[inline]
    pub(super) fn ray_with_jacobian(
        &self,
        pixel: Pixel,
    ) -> Result<(Ray<frame::Camera>, Matrix3x2<f64>), LensError> {
        self.sensor.perspective_ray_with_jacobian(pixel)
    }

    #[inline]
    pub(super) fn pixel(&self, point: Point<frame::Camera>) -> Result<Pixel, LensError> {
        self.sensor.perspective_pixel(point)
    }

    #[inline]
    pub(super) fn pixel_with_jacobian(
        &self,
        point: Point<frame::Camera>,
    ) -> Result<(Pixel, Matrix2x3<f64>), LensError> {
        self.sensor.perspective_pixel_with_jacobian(point)
    }
}

/// The optical axis O of a CAHVOR or CAHVORE lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OpticalAxis {
    given: [f64; 3],
    /// Its length, one but for rounding in the file.
    pub(super) length: f64,
    /// Rows: two directions across the axis and the axis itself, in camera axes.
    pub(super) lens_from_camera: Matrix3<f64>,
}

impl OpticalAxis {
    /// The axis O, given in the axes of the lens's other vectors.
    pub(super) fn new(base: &Cahv, given: [f64; 3]) -> Result<Self, BadLens> {
        let axis = base.camera_direction(given);
        let length = axis.norm();
        let unit = axis / length;
        if !(length > 1e-9 && unit.iter().all(|c| c.is_finite())) {
            return Err(BadLens::NoDirection("O"));
        }
        let beside = if unit.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let right = (beside - unit * unit.dot(&beside)).normalize();
        let down = unit.cross(&right);
        let lens_from_camera =
            Matrix3::from_rows(&[right.transpose(), down.transpose(), unit.transpose()]);
        Ok(Self {
            given,
            length,
            lens_from_camera,
        })
    }

    /// O for this lens on any mount, in the axes of [`Cahv::vectors_on`].
    pub(super) fn vector_on(&self, base: &Cahv, mount: &Mount) -> [f64; 3] {
        if base.mount().is_at(mount) {
            return self.given;
        }
        (rotation(mount) * base.camera_direction(self.given)).into()
    }
}

fn rotation(mount: &Mount) -> Matrix3<f64> {
    mount.body_from_camera(Default::default()).rotation.matrix()
}
