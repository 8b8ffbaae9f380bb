//! Columns of numbers as text that a script unpacks into typed arrays.

use serde::{Serialize, Serializer};

/// The digits of RFC 4648, section 4.
const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// A column: `f32:`, `f64:`, `u32:` or `u8:`, then its little-endian bytes in base64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Packed {
    text: String,
}

impl Packed {
    /// Numbers to seven digits; an absent one is a NaN.
    pub(super) fn f32(values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let bytes = values.into_iter().flat_map(|value| {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "seven digits are enough to draw"
            )]
            let value = value.map_or(f32::NAN, |v| v as f32);
            value.to_le_bytes()
        });
        Self::new("f32", bytes)
    }

    /// Numbers with all their digits.
    pub(super) fn f64(values: impl IntoIterator<Item = f64>) -> Self {
        Self::new("f64", values.into_iter().flat_map(f64::to_le_bytes))
    }

    /// Indices; an absent one, or one that is too large, is [`u32::MAX`].
    pub(super) fn indices(values: impl IntoIterator<Item = Option<usize>>) -> Self {
        let bytes = values.into_iter().flat_map(|value| {
            let index = value.and_then(|v| u32::try_from(v).ok());
            index.unwrap_or(u32::MAX).to_le_bytes()
        });
        Self::new("u32", bytes)
    }

    /// Counts up to 255, to which greater ones are cut.
    pub(super) fn small_counts(values: impl IntoIterator<Item = usize>) -> Self {
        let cut = |value: usize| u8::try_from(value).unwrap_or(u8::MAX);
        Self::new("u8", values.into_iter().map(cut))
    }

    /// Where the rows of lists that stand in one column begin, and where the last one ends.
    pub(super) fn offsets(lengths: impl IntoIterator<Item = usize>) -> Self {
        let mut end = 0;
        let ends = lengths.into_iter().map(|length| {
            end += length;
            Some(end)
        });
        let ends: Vec<_> = ends.collect();
        Self::indices(std::iter::once(Some(0)).chain(ends))
    }

    fn new(kind: &str, bytes: impl IntoIterator<Item = u8>) -> Self {
        let bytes: Vec<u8> = bytes.into_iter().collect();
        Self {
            text: format!("{kind}:{}", base64(&bytes)),
        }
    }
}

impl Serialize for Packed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

/// Bytes in base64 (RFC 4648, section 4), padded.
pub(super) fn base64(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let at = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = (at(0) << 16) | (at(1) << 8) | at(2);
        for digit in 0..4 {
            let value = (word >> (18 - 6 * digit)) & 63;
            let is_padding = digit > chunk.len();
            text.push(if is_padding {
                '='
            } else {
                char::from(DIGITS[value as usize])
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648, section 10.
    #[test]
    fn base64_is_the_standards() {
        let vectors = [
            "", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy",
        ];
        for (length, expected) in vectors.into_iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..length]), expected);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn columns_are_little_endian() {
        let text = |packed: Packed| packed.text;
        assert_eq!(text(Packed::f32([Some(1.0)])), "f32:AACAPw==");
        assert_eq!(text(Packed::f32([None])), "f32:AADAfw==");
        assert_eq!(text(Packed::f64([1.0])), "f64:AAAAAAAA8D8=");
        assert_eq!(text(Packed::indices([Some(1), None])), "u32:AQAAAP////8=");
        assert_eq!(text(Packed::small_counts([7, 300])), "u8:B/8=");
        assert_eq!(
            Packed::offsets([2, 0, 1]),
            Packed::indices([0, 2, 2, 3].map(Some))
        );
    }
}
