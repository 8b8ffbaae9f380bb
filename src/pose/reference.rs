//! What the headings and heights of a pose log are measured from.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Attitude, PoseFile, PoseKey, PoseRow, Position};
use crate::frame::{Crs, CrsError, DatumError, Geodetic, VerticalDatum};
use crate::input::{Reason, Reject};

/// Where a log's headings count from. Azimuths of detections count from true north, whatever the
/// log does.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadingReference {
    /// The north.
    pub north: North,
    /// What a compass or a mount adds: radians clockwise to be added to every heading.
    pub bias: f64,
}

/// A north.
#[derive(Debug, Clone, PartialEq)]
pub enum North {
    /// The planet's axis.
    True,
    /// The way of growing northings of a map, at every place its own.
    Grid(Crs),
    /// Where a compass points.
    Magnetic {
        /// Its azimuth, radians clockwise from true north.
        declination: f64,
    },
}

impl HeadingReference {
    /// True north, and nothing to add.
    pub const TRUE: Self = Self {
        north: North::True,
        bias: 0.0,
    };

    /// What a heading logged at a place lacks to one from true north, radians clockwise.
    ///
    /// # Errors
    /// A place outside the domain of the map that grid north is of.
    pub fn turn(&self, place: Geodetic) -> Result<f64, CrsError> {
        let north = match &self.north {
            North::True => 0.0,
            North::Grid(crs) => crs.convergence(place)?,
            North::Magnetic { declination } => *declination,
        };
        Ok(north + self.bias)
    }
}

impl PoseFile {
    /// Puts all rows into true north and ellipsoidal heights, as the rest of the program has them.
    /// `datum` is the one heights are in, if they are not ellipsoidal; `origin` is that of the frame
    /// of `x_m, y_m, z_m` offsets, whose attitudes are in its own axes and turn as one there. Rows
    /// that have no place in the map or the datum are set aside. Messages call the file `shown`.
    pub fn refer(
        &mut self,
        shown: &str,
        heading: &HeadingReference,
        datum: Option<&VerticalDatum>,
        origin: Option<Geodetic>,
    ) {
        let mut kept = Vec::with_capacity(self.rows.len());
        for mut row in std::mem::take(&mut self.rows) {
            match row.refer(heading, datum, origin) {
                Ok(()) => kept.push(row),
                Err((field, problem)) => self.rejects.push(Reject {
                    file: shown.to_owned(),
                    line: Some(row.line),
                    record: row.key.record(),
                    reason: Reason::BadValue,
                    detail: format!("{field}: {problem}"),
                }),
            }
        }
        self.rows = kept;
    }
}

impl PoseRow {
    fn refer(
        &mut self,
        heading: &HeadingReference,
        datum: Option<&VerticalDatum>,
        origin: Option<Geodetic>,
    ) -> Result<(), (&'static str, String)> {
        if let (Position::Geodetic(place), Some(datum)) = (&mut self.position, datum) {
            *place = datum
                .to_ellipsoidal(*place)
                .map_err(|error: DatumError| ("alt_m", error.to_string()))?;
        }
        let place = self.geodetic().or(origin);
        if let (Attitude::Measured(attitude), Some(place)) = (&mut self.attitude, place) {
            let turn = heading
                .turn(place)
                .map_err(|error| ("yaw_deg", error.to_string()))?;
            // Clockwise seen from above is against the sense of rotations about the vertical.
            let about_up = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -turn);
            *attitude = about_up * *attitude;
        }
        Ok(())
    }
}

impl PoseKey {
    /// How tables of rejects call the row: its image, or its time.
    pub fn record(&self) -> String {
        match self {
            Self::Time(time) => time.to_string(),
            Self::Image { image_id, .. } => image_id.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Planet, Point};
    use crate::pose::Time;

    fn file(position: Position, yaw_deg: f64) -> PoseFile {
        let row = PoseRow {
            line: 2,
            key: PoseKey::Time(Time::from_nanoseconds(0)),
            platform: None,
            position,
            attitude: Attitude::from_roll_pitch_yaw(0.1, -0.2, yaw_deg.to_radians()),
            sigma: [None; 6],
        };
        PoseFile {
            rows: vec![row],
            rejects: Vec::new(),
            unknown_columns: Vec::new(),
            is_per_image: false,
            is_local: false,
            has_attitude: true,
        }
    }

    fn same(file: &PoseFile, yaw_deg: f64) {
        let expected = Attitude::from_roll_pitch_yaw(0.1, -0.2, yaw_deg.to_radians());
        let (Attitude::Measured(a), Attitude::Measured(b)) = (file.rows[0].attitude, expected)
        else {
            panic!("attitudes are measured");
        };
        assert!(a.angle_to(&b) < 1e-9, "{a} {b}");
    }

    #[test]
    fn declination_and_bias_are_added_clockwise() {
        let here = Geodetic::from_degrees(49.0, 8.4, 0.0);
        let heading = HeadingReference {
            north: North::Magnetic {
                declination: 4f64.to_radians(),
            },
            bias: -1.5f64.to_radians(),
        };
        let mut log = file(Position::Geodetic(here), 350.0);
        log.refer("poses.csv", &heading, None, None);
        same(&log, 352.5);
        let mut log = file(Position::Geodetic(here), 350.0);
        log.refer("poses.csv", &HeadingReference::TRUE, None, None);
        same(&log, 350.0);
    }

    #[test]
    fn grid_north_is_that_of_the_place_or_of_the_origin_of_offsets() {
        // East of the central meridian of zone 32 and north of the equator grid north lies east:
        // convergence (lon - lon0) sin(lat) = 3 sin(49) = 2.26 degrees.
        let here = Geodetic::from_degrees(49.0, 12.0, 0.0);
        let crs = Crs::new("EPSG:32632", Planet::EARTH).unwrap();
        let convergence_deg = crs.convergence(here).unwrap().to_degrees();
        assert!((convergence_deg - 2.2650).abs() < 2e-3, "{convergence_deg}");
        let heading = HeadingReference {
            north: North::Grid(crs),
            bias: 0.0,
        };
        let mut log = file(Position::Geodetic(here), 20.0);
        log.refer("poses.csv", &heading, None, None);
        same(&log, 20.0 + convergence_deg);
        let mut offsets = file(Position::Site(Point::new(5.0, 6.0, 7.0)), 20.0);
        offsets.refer("poses.csv", &heading, None, Some(here));
        same(&offsets, 20.0 + convergence_deg);
    }

    #[test]
    fn a_place_outside_the_geoid_grid_is_set_aside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tiny.gtx");
        let mut bytes: Vec<u8> = [48.0f64, 8.0, 1.0, 1.0]
            .into_iter()
            .flat_map(f64::to_be_bytes)
            .collect();
        bytes.extend([2i32, 2].into_iter().flat_map(i32::to_be_bytes));
        bytes.extend([48.5f32; 4].into_iter().flat_map(f32::to_be_bytes));
        std::fs::write(&path, bytes).unwrap();
        let here = Geodetic::from_degrees(48.5, 8.4, 100.0);
        let datum = VerticalDatum::from_grid(&path, "tiny.gtx", here).unwrap();
        let mut log = file(Position::Geodetic(here), 0.0);
        log.refer("poses.csv", &HeadingReference::TRUE, Some(&datum), None);
        assert_eq!(log.rows[0].geodetic().map(|g| g.height_m), Some(148.5));
        let away = Geodetic::from_degrees(50.0, 8.4, 100.0);
        let mut log = file(Position::Geodetic(away), 0.0);
        log.refer("poses.csv", &HeadingReference::TRUE, Some(&datum), None);
        assert!(log.rows.is_empty());
        assert_eq!(
            log.rejects[0].detail,
            "alt_m: found a place outside the grid of tiny.gtx, expected one within"
        );
        assert_eq!(log.rejects[0].record, "1970-01-01T00:00:00Z");
    }
}
