//! Instants as pose logs and image lists give them.

use std::fmt;

use jiff::Timestamp;

/// An instant, to the nanosecond since 1970-01-01T00:00:00Z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time {
    nanoseconds: i64,
}

impl Time {
    /// From nanoseconds since 1970.
    pub const fn from_nanoseconds(nanoseconds: i64) -> Self {
        Self { nanoseconds }
    }

    /// Reads RFC 3339, or seconds since 1970 as a decimal, exactly to the nanosecond.
    pub fn parse(text: &str) -> Option<Self> {
        decimal_nanoseconds(text)
            .or_else(|| {
                let stamp: Timestamp = text.parse().ok()?;
                i64::try_from(stamp.as_nanosecond()).ok()
            })
            .map(Self::from_nanoseconds)
    }

    /// Seconds from an earlier instant to this one.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        #[expect(
            clippy::cast_precision_loss,
            reason = "spans of days keep their nanoseconds"
        )]
        let span = (self.nanoseconds - earlier.nanoseconds) as f64;
        span * 1e-9
    }

    /// The instant this many seconds later, to the nanosecond.
    pub fn later_by(self, seconds: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "it saturates, as the addition does"
        )]
        let span = (seconds * 1e9).round() as i64;
        Self::from_nanoseconds(self.nanoseconds.saturating_add(span))
    }

    /// Nanoseconds since 1970.
    pub const fn nanoseconds(self) -> i64 {
        self.nanoseconds
    }
}

/// `-12.345` as nanoseconds, without passing through binary fractions; digits past the ninth
/// are dropped.
fn decimal_nanoseconds(text: &str) -> Option<i64> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(fraction) {
        return None;
    }
    let fraction: String = fraction
        .chars()
        .chain("000000000".chars())
        .take(9)
        .collect();
    let seconds: i64 = whole.parse().ok()?;
    let nanoseconds = seconds
        .checked_mul(1_000_000_000)?
        .checked_add(fraction.parse().ok()?)?;
    Some(if negative { -nanoseconds } else { nanoseconds })
}

impl fmt::Display for Time {
    /// RFC 3339 in UTC, with as many decimals as the instant has, or as the format asks for.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Timestamp::from_nanosecond(i128::from(self.nanoseconds)) {
            Ok(stamp) => fmt::Display::fmt(&stamp, f),
            Err(_) => write!(f, "{} ns", self.nanoseconds),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_spellings_mean_the_same_instant() {
        let decimal = Time::parse("1317027600.1").unwrap();
        assert_eq!(Time::parse("2011-09-26T09:00:00.1Z"), Some(decimal));
        assert_eq!(Time::parse("2011-09-26T11:00:00.1+02:00"), Some(decimal));
        assert_eq!(decimal.to_string(), "2011-09-26T09:00:00.1Z");
        assert_eq!(decimal.nanoseconds(), 1_317_027_600_100_000_000);
    }

    #[test]
    fn what_is_no_time_is_none() {
        for text in [
            "",
            "12:30",
            "1e9",
            "NaN",
            "2011-09-26",
            ".5",
            "-",
            "99999999999999999999",
        ] {
            assert_eq!(Time::parse(text), None, "{text}");
        }
    }

    #[test]
    fn spans_are_exact() {
        let (a, b) = (Time::parse("-1.5").unwrap(), Time::parse("0.25").unwrap());
        assert_eq!(b.seconds_since(a), 1.75);
        assert_eq!(a.later_by(1.75), b);
        assert_eq!(b.later_by(-1.75), a);
    }
}
