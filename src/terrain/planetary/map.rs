//! The map an image is on, in the words that planetary labels share.

use super::Problem;

/// A map projection on a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Projection {
    /// Longitude and latitude as lengths; true to scale on a parallel.
    Equirectangular { true_lat_deg: f64, lon_deg: f64 },
    /// From the opposite pole onto the plane at a pole, or at the latitude of true scale.
    PolarStereographic {
        is_north: bool,
        lon_deg: f64,
        scale: f64,
    },
    /// Parallels as long as they are.
    Sinusoidal { lon_deg: f64 },
}

impl Projection {
    /// For PROJ, on a sphere of a radius in metres.
    pub fn definition(self, radius_m: f64) -> String {
        let start = match self {
            Self::Equirectangular {
                true_lat_deg,
                lon_deg,
            } => format!("+proj=eqc +lat_ts={true_lat_deg} +lat_0=0 +lon_0={lon_deg}"),
            Self::PolarStereographic {
                is_north,
                lon_deg,
                scale,
            } => {
                let lat = if is_north { 90 } else { -90 };
                format!("+proj=stere +lat_0={lat} +k={scale} +lon_0={lon_deg}")
            }
            Self::Sinusoidal { lon_deg } => format!("+proj=sinu +lon_0={lon_deg}"),
        };
        format!("{start} +R={radius_m} +no_defs +type=crs")
    }

    /// The sphere a map is on, metres, from the axes of the body that its label names: as map makers
    /// do it, maps over a pole take the polar axis and all others the equatorial one.
    pub fn radius_m(self, equatorial_m: f64, polar_m: Option<f64>) -> f64 {
        match self {
            Self::PolarStereographic { .. } => polar_m.unwrap_or(equatorial_m),
            _ => equatorial_m,
        }
    }
}

/// Which pole a latitude names.
pub(super) fn is_north(field: &str, lat_deg: f64) -> Result<bool, Problem> {
    if (lat_deg.abs() - 90.0).abs() < 1e-9 {
        Ok(lat_deg > 0.0)
    } else {
        Err(Problem::found(field, lat_deg, "90 or -90, a pole"))
    }
}

/// Metres in a unit of length, as labels spell it.
pub(super) fn metres(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => Some(1000.0),
        _ => None,
    }
}

/// The shift that makes heights of samples: samples that are radii from the body's centre become
/// heights above the map's sphere.
pub(super) fn height_shift_m(shift_m: f64, radius_m: f64) -> f64 {
    if (shift_m - radius_m).abs() < 0.02 * radius_m {
        shift_m - radius_m
    } else {
        shift_m
    }
}
