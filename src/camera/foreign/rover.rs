//! Pictures of rovers and landers, each with a camera model of its own and the pose of its platform,
//! and the axes that NASA writes them in.

use nalgebra::{Matrix3, Vector3};

use super::fields::made;
use crate::camera::{BodyAxes, Cahv, CahvVectors, Cahvor, Cahvore, Camera, Lens, Linearity};
use crate::frame::{Body, Enu, Point, RigidTransform, Rotation, Vector};
use crate::input::Section;
use crate::pose::Time;

/// A picture with its camera and the pose of its platform.
#[derive(Debug, Clone)]
pub struct RoverImage {
    /// The product's name.
    pub image_id: String,
    /// When it was taken.
    pub time: Option<Time>,
    /// Its camera, of the same name: where the mast pointed is in the vectors.
    pub camera: Camera,
    /// Where the platform was.
    pub pose: RoverPose,
    /// Where its site lies in another, if that is told.
    pub link: Option<SiteLink>,
}

/// Where the origin of a site frame lies in the one before it. The axes of all sites are north, east,
/// down and count as parallel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiteLink {
    /// The number of the site.
    pub site: u32,
    /// The number of the site that the offset is told in.
    pub reference: u32,
    /// From the origin of the reference to that of the site.
    pub offset: Vector<Enu>,
}

/// A platform's pose in a site frame: east, north, up from the site's origin.
#[derive(Debug, Clone, Copy, Default)]
pub struct RoverPose {
    /// The number of the site frame, where it is told.
    pub site: Option<u32>,
    /// The body's origin.
    pub place: Option<Point<Enu>>,
    /// Body axes (forward, left, up) into the site's.
    pub attitude: Option<Rotation<Enu, Body>>,
}

/// A place written in a site frame, whose axes are north, east, down.
pub(super) fn place([north, east, down]: [f64; 3]) -> Point<Enu> {
    Point::new(east, north, -down)
}

/// An attitude that a quaternion, scalar first, gives as forward-right-down into north-east-down
/// axes, the way of NASA's rovers; `None` where its length is off one by more than 0.01.
pub fn attitude(q: [f64; 4]) -> Option<Rotation<Enu, Body>> {
    let rotation = Rotation::<Enu, Body>::from_scalar_first(q)?;
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (length - 1.0).abs() > 0.01 {
        return None;
    }
    let enu_from_ned = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let frd_from_flu = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    Some(Rotation::from_matrix(
        enu_from_ned * rotation.matrix() * frd_from_flu,
    ))
}

impl RoverPose {
    /// The pose of a transform from forward-right-down axes to those of a site, north-east-down.
    pub(super) fn of_ned(transform: &RigidTransform<Enu, Body>, site: Option<u32>) -> Self {
        Self {
            site,
            place: Some(place(transform.translation.xyz.into())),
            attitude: attitude(transform.rotation.scalar_first()),
        }
    }
}

/// A step from one frame to the one it is given in, both with z down.
pub(super) fn step(offset: [f64; 3], q: [f64; 4]) -> Option<RigidTransform<Enu, Body>> {
    let rotation = Rotation::from_scalar_first(q)?;
    Some(RigidTransform::new(
        rotation,
        Vector::from_xyz(offset.into()),
    ))
}

/// One step after another.
pub(super) fn after(
    outer: &RigidTransform<Enu, Body>,
    inner: &RigidTransform<Enu, Body>,
) -> RigidTransform<Enu, Body> {
    let outer = RigidTransform::<Enu, Enu>::new(
        Rotation::from_unit_quaternion(outer.rotation.quaternion()),
        outer.translation,
    );
    outer * *inner
}

/// The vectors of a CAHV camera or one of its relatives, as a file gives them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vectors {
    /// C, A, H, V.
    pub(super) cahv: [[f64; 3]; 4],
    /// O, R, with the relatives.
    pub(super) or: Option<[[f64; 3]; 2]>,
    /// E, and `mtype` with the linearity, with CAHVORE.
    pub(super) e: Option<([f64; 3], Linearity)>,
}

impl Vectors {
    /// The camera, whose vectors are in forward-right-down axes.
    pub(super) fn camera(
        &self,
        section: &Section,
        key: &str,
        name: &str,
        [width, height]: [u32; 2],
    ) -> Option<Camera> {
        let [centre, axis, horizontal, vertical] = self.cahv;
        let vectors = CahvVectors {
            axes: BodyAxes::Frd,
            centre,
            axis,
            horizontal,
            vertical,
        };
        let (lens, mount) = match (self.or, self.e) {
            (Some([o, r]), Some((e, linearity))) => {
                let lens = made(section, key, Cahvore::new(vectors, o, r, e, linearity))?;
                let mount = lens.linear().mount();
                (Lens::Cahvore(lens), mount)
            }
            (Some([o, r]), None) => {
                let lens = made(section, key, Cahvor::new(vectors, o, r))?;
                let mount = lens.linear().mount();
                (Lens::Cahvor(lens), mount)
            }
            (None, _) => {
                let lens = made(section, key, Cahv::new(vectors))?;
                let mount = lens.mount();
                (Lens::Cahv(lens), mount)
            }
        };
        Some(Camera {
            name: name.to_owned(),
            width,
            height,
            lens,
            mount,
            readout: None,
        })
    }
}

/// `mtype` and the linearity; `None` where the type is no such.
pub(super) fn linearity(mtype: f64, linearity: f64) -> Option<Linearity> {
    let is = |type_: f64| (mtype - type_).abs() < 1e-9;
    if is(1.0) {
        Some(Linearity::Perspective)
    } else if is(2.0) {
        Some(Linearity::Fisheye)
    } else {
        is(3.0).then_some(Linearity::General(linearity))
    }
}

/// An instant of a record: RFC 3339, or without its zone, which is UTC then.
pub(super) fn utc(text: &str) -> Option<Time> {
    let text = text.trim();
    let dated = text.contains('T');
    Time::parse(text)
        .filter(|_| dated)
        .or_else(|| Time::parse(&format!("{text}Z")))
}
