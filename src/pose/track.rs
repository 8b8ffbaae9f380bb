//! A pose log that answers for any time between its samples.

use super::{Pose, PoseSigma, Time};
use crate::frame::{RigidTransform, Vector};

/// The pose log of one platform: sorted by time, without duplicates, not empty.
#[derive(Debug, Clone)]
pub struct Track {
    samples: Vec<(Time, Pose)>,
}

/// Why a track has no pose for a time.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoPose {
    /// The time lies outside the log, which is never extrapolated.
    #[error("its time {time} lies outside the pose log, {first} to {last}")]
    OutsideLog {
        /// The time asked for.
        time: Time,
        /// The log's first sample.
        first: Time,
        /// The log's last sample.
        last: Time,
    },
    /// The samples around the time lie too far apart.
    #[error(
        "its time lies in a gap of {gap_s} s of the pose log, longer than max_gap_s = {max_gap_s}"
    )]
    Gap {
        /// Length of the gap, seconds.
        gap_s: f64,
        /// The longest the run allows, seconds.
        max_gap_s: f64,
    },
}

impl Track {
    /// From samples in any order; of several at one time the first given is kept.
    ///
    /// `None` where there is no sample.
    pub fn new(mut samples: Vec<(Time, Pose)>) -> Option<Self> {
        samples.sort_by_key(|&(time, _)| time);
        samples.dedup_by_key(|&mut (time, _)| time);
        (!samples.is_empty()).then_some(Self { samples })
    }

    /// The samples, sorted by time.
    pub fn samples(&self) -> &[(Time, Pose)] {
        &self.samples
    }

    /// The pose at a time: position linear in ENU, attitude by slerp, standard deviations linear.
    ///
    /// # Errors
    /// A time outside the log, or between samples more than `max_gap_s` seconds apart.
    pub fn at(&self, time: Time, max_gap_s: f64) -> Result<Pose, NoPose> {
        let after = self.samples.partition_point(|&(t, _)| t < time);
        if let Some(&(t, pose)) = self.samples.get(after)
            && t == time
        {
            return Ok(pose);
        }
        let (Some(&(t0, before)), Some(&(t1, next))) = (
            after.checked_sub(1).and_then(|i| self.samples.get(i)),
            self.samples.get(after),
        ) else {
            return Err(NoPose::OutsideLog {
                time,
                first: self.samples[0].0,
                last: self.samples[self.samples.len() - 1].0,
            });
        };
        let gap_s = t1.seconds_since(t0);
        if gap_s > max_gap_s {
            return Err(NoPose::Gap { gap_s, max_gap_s });
        }
        Ok(between(&before, &next, time.seconds_since(t0) / gap_s))
    }
}

fn between(a: &Pose, b: &Pose, share: f64) -> Pose {
    let (from, to) = (a.enu_from_body, b.enu_from_body);
    let translation = from.translation.xyz.lerp(&to.translation.xyz, share);
    let sigma = a.sigma.to_vector().lerp(&b.sigma.to_vector(), share);
    Pose {
        enu_from_body: RigidTransform::new(
            from.rotation.slerp(&to.rotation, share),
            Vector::from_xyz(translation),
        ),
        sigma: PoseSigma::from_vector(sigma),
        has_heading: a.has_heading && b.has_heading,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Rotation;
    use nalgebra::Vector3;

    fn pose(east: f64, yaw: f64) -> Pose {
        Pose {
            enu_from_body: RigidTransform::new(
                Rotation::identity().perturbed(Vector3::new(0.0, 0.0, yaw)),
                Vector::new(east, 0.0, 0.0),
            ),
            sigma: PoseSigma::from_vector(nalgebra::Vector6::repeat(east)),
            has_heading: true,
        }
    }

    fn time(text: &str) -> Time {
        Time::parse(text).unwrap()
    }

    #[test]
    fn interpolates_and_never_extrapolates() {
        let track = Track::new(vec![
            (time("11"), pose(4.0, 0.4)),
            (time("10"), pose(2.0, 0.0)),
            (time("15"), pose(8.0, 0.0)),
        ])
        .unwrap();
        let middle = track.at(time("10.25"), 1.0).unwrap();
        assert!((middle.enu_from_body.translation.xyz.x - 2.5).abs() < 1e-12);
        assert!((middle.enu_from_body.rotation.quaternion().angle() - 0.1).abs() < 1e-12);
        assert!((middle.sigma.yaw - 2.5).abs() < 1e-12);
        let exact = track.at(time("15"), 1.0).unwrap();
        assert!((exact.enu_from_body.translation.xyz.x - 8.0).abs() < 1e-12);
        assert_eq!(
            track.at(time("12"), 1.0).unwrap_err().to_string(),
            "its time lies in a gap of 4 s of the pose log, longer than max_gap_s = 1"
        );
        assert_eq!(
            track.at(time("15.5"), 1.0).unwrap_err().to_string(),
            "its time 1970-01-01T00:00:15.5Z lies outside the pose log, \
             1970-01-01T00:00:10Z to 1970-01-01T00:00:15Z"
        );
        assert!(track.at(time("9.999"), 1.0).is_err());
    }
}
