//! The language of PDS3 labels: `KEY = VALUE` lines in nested objects.

use super::Problem;

/// A label: every key with the objects it stands in and its value as written.
#[derive(Debug, Default)]
pub(super) struct Label {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    object: String,
    key: String,
    value: String,
}

impl Label {
    /// From the text up to `END`.
    pub fn parse(text: &str) -> Self {
        let mut label = Self::default();
        let mut objects: Vec<String> = Vec::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let line = line.trim();
            if line == "END" {
                break;
            }
            let Some((key, value)) = line.split_once('=') else {
                continue;
            };
            let (key, mut value) = (key.trim(), value.trim().to_owned());
            // Quoted texts and lists may run over several lines.
            while is_open(&value) {
                let Some(more) = lines.next() else {
                    break;
                };
                value.push(' ');
                value.push_str(more.trim());
            }
            match key {
                "OBJECT" | "GROUP" => objects.push(unquoted(&value).to_owned()),
                "END_OBJECT" | "END_GROUP" => {
                    objects.pop();
                }
                _ => label.entries.push(Entry {
                    object: objects.last().cloned().unwrap_or_default(),
                    key: key.to_owned(),
                    value,
                }),
            }
        }
        label
    }

    /// The value of a key in an object, as written; of the root for an empty name.
    pub fn raw(&self, object: &str, key: &str) -> Option<&str> {
        self.entries
            .iter()
            .find(|entry| entry.object == object && entry.key == key)
            .map(|entry| entry.value.as_str())
            .filter(|value| !matches!(unquoted(value), "" | "N/A" | "UNK" | "NULL"))
    }

    /// A word or quoted text.
    pub fn text(&self, object: &str, key: &str) -> Option<&str> {
        self.raw(object, key).map(unquoted)
    }

    /// A number and its unit: `3396.19 <KM>`, `16#FF7FFFFB#`.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn number(&self, object: &str, key: &str) -> Result<Option<(f64, &str)>, Problem> {
        let Some(value) = self.raw(object, key) else {
            return Ok(None);
        };
        let (number, unit) = match value.split_once('<') {
            Some((number, unit)) => (number.trim(), unit.trim_end_matches('>').trim()),
            None => (value, ""),
        };
        let number = unquoted(number);
        let parsed = number.parse().ok().or_else(|| of_base(number));
        parsed
            .map(|x| Some((x, unit)))
            .ok_or_else(|| Problem::found(key, format!("{value:?}"), "a number"))
    }

    /// A whole number.
    ///
    /// # Errors
    /// Where there is something else.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the number is checked to be whole and within 2^53"
    )]
    pub fn count(&self, object: &str, key: &str) -> Result<Option<u64>, Problem> {
        match self.number(object, key)? {
            None => Ok(None),
            Some((x, _)) if x >= 0.0 && x.fract() == 0.0 && x < 9e15 => Ok(Some(x as u64)),
            Some((x, _)) => Err(Problem::found(key, x, "a whole number not below zero")),
        }
    }
}

/// A number in another base: bits of a float, where there are as many as one has, else a whole.
#[expect(
    clippy::cast_precision_loss,
    reason = "whole numbers of 32 bits at most"
)]
fn of_base(text: &str) -> Option<f64> {
    let (base, digits) = text.trim_end_matches('#').split_once('#')?;
    let bits =
        u64::from_str_radix(digits, base.parse().ok().filter(|b| (2..=36).contains(b))?).ok()?;
    match digits.len() {
        8 if base == "16" => Some(f64::from(f32::from_bits(u32::try_from(bits).ok()?))),
        16 if base == "16" => Some(f64::from_bits(bits)),
        _ => Some(bits as f64),
    }
}

fn unquoted(value: &str) -> &str {
    value.trim().trim_matches(['"', '\'']).trim()
}

fn is_open(value: &str) -> bool {
    let quotes = value.matches('"').count() % 2 == 1;
    let count = |c| value.matches(c).count();
    quotes || count('(') > count(')') || count('{') > count('}')
}
