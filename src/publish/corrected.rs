//! Poses as fusion corrected them.

use super::{Product, Scene};
use crate::error::Error;
use crate::frame::{Geodetic, RigidTransform};
use crate::pose::{PoseRecord, Time, poses_text};
use crate::view::View;

/// How far a view's pose was corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// Of its position, metres.
    pub(super) shift_m: f64,
    /// Of its attitude, radians.
    pub(super) turn: f64,
    /// Of its position to the east, north and up at the platform, metres; of its attitude about the
    /// body's axes (roll, pitch, yaw), radians.
    pub(super) parts: [f64; 6],
}

impl Scene<'_> {
    /// How far the pose of a view was corrected; `None` where poses are as measured.
    pub(super) fn correction(&self, view: usize) -> Option<Correction> {
        let from = self.measured?.get(view)?.pose.enu_from_body;
        let view = &self.views[view];
        let to = view.pose.enu_from_body;
        let shift = view.enu_from_local.inverse() * (to.translation - from.translation);
        let turn = from.rotation.inverse() * to.rotation;
        // By the quaternion: the matrix of a small turn has no digits of its angle.
        let about = turn.quaternion().scaled_axis();
        let by = shift.xyz;
        Some(Correction {
            shift_m: by.norm(),
            turn: turn.quaternion().angle(),
            parts: [by.x, by.y, by.z, about.x, about.y, about.z],
        })
    }

    /// `poses_corrected.csv`: the poses of all views as corrected, with their posterior standard
    /// deviations; `None` where poses are as measured. Places are as the run's own pose logs have them:
    /// latitude and longitude by the planet's convention, heights in the run's vertical datum. Headings
    /// count from true north.
    ///
    /// # Errors
    /// A place outside the grid of the run's vertical datum.
    pub fn corrected_poses(&self) -> Result<Option<Product>, Error> {
        if self.measured.is_none() {
            return Ok(None);
        }
        let records: Result<Vec<PoseRecord>, Error> =
            self.views.iter().map(|v| self.record(v)).collect();
        let text = poses_text(&records?)?;
        Ok(Some(Product::new("poses_corrected.csv", text)))
    }

    fn record(&self, view: &View) -> Result<PoseRecord, Error> {
        let RigidTransform { rotation, .. } = view.pose.enu_from_body;
        let place = self.site.geodetic(view.pose.enu_from_body.origin());
        let height_m = self.height_m(place).ok_or_else(|| {
            let id = &view.image_id;
            Error::Output(format!(
                "poses_corrected.csv: view {id} lies outside the grid of the run's vertical datum"
            ))
        })?;
        let (lat_deg, lon_deg) = self.site.planet().lat_lon_deg(place);
        let epoch = Time::parse("0");
        Ok(PoseRecord {
            image_id: Some(view.image_id.clone()),
            camera: view.camera_name().map(str::to_owned),
            path: None,
            platform: view.platform.clone(),
            time_s: view.time.zip(epoch).map(|(t, zero)| t.seconds_since(zero)),
            place: Geodetic::from_degrees(lat_deg, lon_deg, height_m),
            attitude: self.site.enu_from_local(place).inverse() * rotation,
            sigma: Some(view.pose.sigma),
        })
    }
}
