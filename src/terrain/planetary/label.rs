//! The groups of a PDS3 or VICAR label, read key by key.

use super::Problem;
use crate::input::Section;

/// What a label writes where it has nothing to say.
const NOTHING: [&str; 5] = ["", "N/A", "UNK", "NULL", "NONE"];

/// A group of a label.
pub(super) struct Group<'a>(Section<'a>);

impl<'a> Group<'a> {
    /// A whole label.
    pub fn root(section: Section<'a>) -> Self {
        Self(section)
    }

    /// The first group of any of these names, however deep it stands.
    pub fn find(&self, names: &[&str]) -> Option<Self> {
        names.iter().find_map(|name| below(&self.0, name).map(Self))
    }

    /// Whether the group has this key, whatever it holds.
    pub fn has(&self, key: &str) -> bool {
        self.0.has(key)
    }

    /// The words and numbers under a key as they are written, without its unit.
    pub fn words(&self, key: &str) -> Option<Vec<String>> {
        let words = self.0.words(key)?;
        let says = words.iter().any(|word| !NOTHING.contains(&word.trim()));
        says.then_some(words)
    }

    /// A word or quoted text; the first of a list.
    pub fn text(&self, key: &str) -> Option<String> {
        let words = self.words(key)?;
        words.first().map(|word| word.trim().to_owned())
    }

    /// The unit of a key's value, `KM`; of the first of a list. Empty where there is none.
    pub fn unit(&self, key: &str) -> String {
        self.text(&format!("{key}__UNIT")).unwrap_or_default()
    }

    /// The numbers under a key: one, or a list. `16#FF7FFFFB#` is the bits of one.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn numbers(&self, key: &str) -> Result<Vec<f64>, Problem> {
        let Some(words) = self.words(key) else {
            return Ok(Vec::new());
        };
        let number = |word: &String| {
            let word = word.trim();
            let parsed = word.parse().ok().or_else(|| of_base(word));
            parsed.ok_or_else(|| self.found(key, format!("{word:?}"), "a number"))
        };
        words.iter().map(number).collect()
    }

    /// A number; the first of a list.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn number(&self, key: &str) -> Result<Option<f64>, Problem> {
        Ok(self.numbers(key)?.first().copied())
    }

    /// A number that has to be there.
    ///
    /// # Errors
    /// Where there is something else, or nothing.
    pub fn required(&self, key: &str) -> Result<f64, Problem> {
        self.number(key)?
            .ok_or_else(|| self.missing(key, "a number"))
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
    pub fn count(&self, key: &str) -> Result<Option<u64>, Problem> {
        match self.number(key)? {
            None => Ok(None),
            Some(x) if x >= 0.0 && x.fract() == 0.0 && x < 9e15 => Ok(Some(x as u64)),
            Some(x) => Err(self.found(key, x, "a whole number not below zero")),
        }
    }

    /// The number of lines or samples.
    ///
    /// # Errors
    /// Where there is none above 1.
    pub fn side(&self, key: &str) -> Result<usize, Problem> {
        let expected = "a whole number above 1";
        let count = self.count(key)?;
        let count = count.ok_or_else(|| self.missing(key, expected))?;
        let side = usize::try_from(count).ok().filter(|&n| n > 1);
        side.ok_or_else(|| self.found(key, count, expected))
    }

    /// A problem with a key.
    pub fn found(&self, key: &str, found: impl std::fmt::Display, expected: &str) -> Problem {
        let mut problem = Problem::found(key, found, expected);
        problem.place = Some(self.0.place(key));
        problem
    }

    /// A key that is not there.
    pub fn missing(&self, key: &str, expected: &str) -> Problem {
        let found = if self.has(key) {
            self.0.shown(key)
        } else {
            "nothing".to_owned()
        };
        self.found(key, found, expected)
    }
}

fn below<'a>(section: &Section<'a>, name: &str) -> Option<Section<'a>> {
    let groups = section.groups();
    if let Some(index) = groups.iter().position(|(key, _)| key == name) {
        return groups.into_iter().nth(index).map(|(_, group)| group);
    }
    groups.iter().find_map(|(_, group)| below(group, name))
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
