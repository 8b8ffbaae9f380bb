//! The geographic keys of a GeoTIFF.

use std::collections::BTreeMap;

use crate::terrain::HeightsAbove;

pub(super) const MODEL_TYPE: u16 = 1024;
pub(super) const RASTER_TYPE: u16 = 1025;
pub(super) const CITATION: u16 = 1026;
pub(super) const GEOGRAPHIC_TYPE: u16 = 2048;
pub(super) const GEOG_CITATION: u16 = 2049;
pub(super) const GEOG_ANGULAR_UNITS: u16 = 2054;
pub(super) const GEOG_ELLIPSOID: u16 = 2056;
pub(super) const GEOG_SEMI_MAJOR: u16 = 2057;
pub(super) const GEOG_SEMI_MINOR: u16 = 2058;
pub(super) const GEOG_INV_FLATTENING: u16 = 2059;
pub(super) const GEOG_PRIME_MERIDIAN: u16 = 2061;
pub(super) const PROJECTED_TYPE: u16 = 3072;
pub(super) const PROJECTED_CITATION: u16 = 3073;
pub(super) const PROJ_COORD_TRANS: u16 = 3075;
pub(super) const PROJ_LINEAR_UNITS: u16 = 3076;
pub(super) const PROJ_LINEAR_UNIT_SIZE: u16 = 3077;
pub(super) const VERTICAL_TYPE: u16 = 4096;
pub(super) const VERTICAL_UNITS: u16 = 4099;

/// The code that says: defined by further keys.
pub(super) const USER_DEFINED: u16 = 32767;

/// What is wrong with the keys: in which, and how.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct KeyFault {
    pub key: &'static str,
    pub problem: String,
}

impl KeyFault {
    pub fn new(key: &'static str, problem: impl Into<String>) -> Self {
        Self {
            key,
            problem: problem.into(),
        }
    }
}

/// The keys of one file.
#[derive(Debug, Default)]
pub(super) struct GeoKeys {
    keys: BTreeMap<u16, Value>,
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Short(u16),
    Double(f64),
    Text(String),
}

impl GeoKeys {
    /// From the three tags that hold them: directory, doubles and text (7.1 of the standard).
    ///
    /// # Errors
    /// Where the directory is cut short or refers to what is not there.
    pub fn parse(directory: &[u16], doubles: &[f64], text: &str) -> Result<Self, KeyFault> {
        let fault = |problem: &str| KeyFault::new("GeoKeyDirectory", problem);
        let [_, _, _, count, entries @ ..] = directory else {
            return Err(fault("found no header, expected four numbers"));
        };
        let count = usize::from(*count);
        let (entries, _) = entries.as_chunks::<4>();
        if entries.len() < count {
            return Err(fault(&format!(
                "found {} keys, expected {count} as its header says",
                entries.len()
            )));
        }
        let mut keys = BTreeMap::new();
        for &[key, place, length, offset] in &entries[..count] {
            let (length, start) = (usize::from(length), usize::from(offset));
            let value = match place {
                0 => Some(Value::Short(offset)),
                34736 => doubles.get(start).copied().map(Value::Double),
                34737 => text
                    .get(start..(start + length).min(text.len()))
                    .map(|part| Value::Text(part.trim_end_matches(['|', '\0']).to_owned())),
                _ => continue,
            };
            let value = value.ok_or_else(|| {
                fault(&format!(
                    "found key {key} beyond its values, expected it within"
                ))
            })?;
            keys.insert(key, value);
        }
        Ok(Self { keys })
    }

    /// From texts: a code or number with its meaning in brackets behind it, or words.
    pub fn of_texts(keys: impl Iterator<Item = (u16, String)>) -> Self {
        let value = |text: &str| {
            let text = text.trim();
            let first = text.split('(').next().unwrap_or("").trim();
            if let Ok(code) = first.parse() {
                Value::Short(code)
            } else if let Ok(number) = first.parse() {
                Value::Double(number)
            } else {
                Value::Text(text.to_owned())
            }
        };
        Self {
            keys: keys.map(|(key, text)| (key, value(&text))).collect(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// A key that holds a code.
    pub fn code(&self, key: u16) -> Option<u16> {
        match self.keys.get(&key) {
            Some(Value::Short(code)) => Some(*code),
            _ => None,
        }
    }

    /// A key that holds a number.
    pub fn number(&self, key: u16) -> Option<f64> {
        match self.keys.get(&key) {
            Some(Value::Double(number)) => Some(*number),
            Some(Value::Short(number)) => Some(f64::from(*number)),
            _ => None,
        }
    }

    /// A key that holds words.
    pub fn text(&self, key: u16) -> Option<&str> {
        match self.keys.get(&key) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// What heights are above.
    pub fn heights_above(&self) -> HeightsAbove {
        match self.code(VERTICAL_TYPE) {
            None | Some(0 | USER_DEFINED) => HeightsAbove::Unsaid,
            // The three-dimensional WGS 84, and the codes of old by which heights are above an
            // ellipsoid.
            Some(4979 | 5001..=5033) => HeightsAbove::Ellipsoid,
            Some(code) => HeightsAbove::Datum(format!("EPSG:{code}")),
        }
    }

    /// Metres in the unit of heights.
    ///
    /// # Errors
    /// Where they are in an unknown unit.
    pub fn vertical_unit_m(&self) -> Result<f64, KeyFault> {
        match self.code(VERTICAL_UNITS) {
            None | Some(0 | USER_DEFINED) => Ok(1.0),
            Some(code) => metres(code).ok_or_else(|| {
                KeyFault::new(
                    "VerticalUnitsGeoKey",
                    format!("found unit {code}, expected 9001 (metre), 9002 or 9003 (foot)"),
                )
            }),
        }
    }
}

/// Metres in a linear unit of the EPSG registry.
pub(super) fn metres(unit: u16) -> Option<f64> {
    match unit {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(1200.0 / 3937.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_all_three_places() {
        let directory = [
            1, 1, 0, 3, 1024, 0, 1, 2, 2057, 34736, 1, 1, 1026, 34737, 5, 2,
        ];
        let keys = GeoKeys::parse(&directory, &[0.0, 3_396_190.0], "x|Mars|y|").unwrap();
        assert_eq!(keys.code(MODEL_TYPE), Some(2));
        assert_eq!(keys.number(GEOG_SEMI_MAJOR), Some(3_396_190.0));
        assert_eq!(keys.text(CITATION), Some("Mars"));
        assert_eq!(keys.code(CITATION), None);
    }

    #[test]
    fn a_directory_cut_short_is_told() {
        let error = GeoKeys::parse(&[1, 1, 0, 2, 1024, 0, 1, 2], &[], "").unwrap_err();
        assert_eq!(error.problem, "found 1 keys, expected 2 as its header says");
        let error = GeoKeys::parse(&[1, 1, 0, 1, 2057, 34736, 1, 3], &[], "").unwrap_err();
        assert_eq!(
            error.problem,
            "found key 2057 beyond its values, expected it within"
        );
    }

    #[test]
    fn what_heights_are_above_and_in_which_unit() {
        let parsed = |keys: &[u16]| {
            let mut directory = vec![1, 1, 0, u16::try_from(keys.len() / 4).unwrap()];
            directory.extend(keys);
            GeoKeys::parse(&directory, &[], "").unwrap()
        };
        let unit = |keys: &[u16]| parsed(keys).vertical_unit_m();
        for (keys, above) in [
            (&[4099, 0, 1, 9001][..], HeightsAbove::Unsaid),
            (&[4096, 0, 1, 32767], HeightsAbove::Unsaid),
            (&[4096, 0, 1, 5030], HeightsAbove::Ellipsoid),
            (&[4096, 0, 1, 4979], HeightsAbove::Ellipsoid),
            (
                &[4096, 0, 1, 5773],
                HeightsAbove::Datum("EPSG:5773".to_owned()),
            ),
        ] {
            assert_eq!(parsed(keys).heights_above(), above);
        }
        assert_eq!(unit(&[]), Ok(1.0));
        assert_eq!(unit(&[4096, 0, 1, 5030, 4099, 0, 1, 9001]), Ok(1.0));
        assert_eq!(unit(&[4099, 0, 1, 9002]), Ok(0.3048));
        assert_eq!(
            unit(&[4099, 0, 1, 9036]).unwrap_err().problem,
            "found unit 9036, expected 9001 (metre), 9002 or 9003 (foot)"
        );
    }
}
