//! Poses as fusion corrected them.

use nalgebra::Rotation3;

use super::Scene;
use crate::error::Error;
use crate::frame::RigidTransform;
use crate::pose::{PoseRecord, Time, poses_text};
use crate::view::View;

/// How far a view's pose was corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// Of its position, metres.
    pub(super) shift_m: f64,
    /// Of its attitude, radians.
    pub(super) turn: f64,
}

impl Scene<'_> {
    /// How far the pose of a view was corrected; `None` where poses are as measured.
    pub(super) fn correction(&self, view: usize) -> Option<Correction> {
        let from = self.measured?.get(view)?.pose.enu_from_body;
        let to = self.views[view].pose.enu_from_body;
        let turn = from.rotation.inverse() * to.rotation;
        Some(Correction {
            shift_m: (to.translation - from.translation).norm(),
            turn: Rotation3::from_matrix_unchecked(turn.matrix()).angle(),
        })
    }

    /// poses_corrected.csv: the poses of all views as corrected, with their posterior standard
    /// deviations; `None` where poses are as measured.
    pub(super) fn corrected_poses(&self) -> Option<Result<Vec<u8>, Error>> {
        self.measured?;
        let records: Vec<PoseRecord> = self.views.iter().map(|v| self.record(v)).collect();
        Some(poses_text(&records))
    }

    fn record(&self, view: &View) -> PoseRecord {
        let RigidTransform { rotation, .. } = view.pose.enu_from_body;
        let place = self.site.geodetic(view.pose.enu_from_body.origin());
        let epoch = Time::parse("0");
        PoseRecord {
            image_id: Some(view.image_id.clone()),
            camera: view.camera_name().map(str::to_owned),
            path: None,
            platform: view.platform.clone(),
            time_s: view.time.zip(epoch).map(|(t, zero)| t.seconds_since(zero)),
            place,
            attitude: self.site.enu_from_local(place).inverse() * rotation,
            sigma: Some(view.pose.sigma),
        }
    }
}
