//! Two maps of one place, made at different times or by different methods: what is the same, what
//! is new, gone or moved.
//!
//! Objects are matched one to one so that the sum of squared Mahalanobis distances is least, within
//! a gate of stated confidence. The covariance of a pair is that of both places and of the
//! registration of one map with the other: maps of two nights share no pose error, and their own
//! ellipses say nothing of it. What stays unmatched is paired within a radius as moved, and the
//! rest is new or gone, but only where the other map's views looked.

mod coverage;
mod epoch;
mod geopackage;
mod output;
mod pairs;
mod shift;

pub use coverage::Coverage;
pub use epoch::Epoch;
pub use output::{layer, products, summary, write};
pub use shift::Shift;

use nalgebra::Vector2;
use serde::Serialize;

use crate::error::{Domain, Error, Fault, Place};
use crate::evaluate::{Estimate, agree};
use crate::frame::{Geodetic, Site};
use pairs::{Spot, matched};

/// What counts as the same, and how far is too far.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// Uncertainty of the registration of one map with the other, one standard deviation along
    /// each axis, metres.
    pub sigma_m: f64,
    /// Share of the truly same objects that the gate lets pass.
    pub confidence: f64,
    /// Distance within which an object may have moved, metres.
    pub radius_m: f64,
    /// Objects whose existence is less probable are neither new, gone nor moved.
    pub min_exist: f64,
    /// Whether objects match only within their class.
    pub by_class: bool,
    /// The greatest common shift between the maps that is looked for, metres; `None` looks for none.
    pub align_m: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            sigma_m: 0.1,
            confidence: 0.99,
            radius_m: 1.0,
            min_exist: 0.5,
            by_class: false,
            align_m: None,
        }
    }
}

impl Options {
    /// Checks that every number lies in its domain.
    ///
    /// # Errors
    /// Every option that does not, named as on the command line.
    pub fn check(&self) -> Result<(), Error> {
        Error::check_options(&[
            ("--sigma", self.sigma_m, Domain::AboveZero),
            ("--confidence", self.confidence, Domain::InnerShare),
            ("--radius", self.radius_m, Domain::AboveZero),
            ("--min-exist", self.min_exist, Domain::Share),
            ("--align", self.align_m.unwrap_or(1.0), Domain::AboveZero),
        ])
    }

    /// The greatest squared Mahalanobis distance of a pair: the quantile of chi-squared with two
    /// degrees of freedom, `-2 ln(1 - confidence)`.
    pub fn gate(&self) -> f64 {
        -2.0 * (1.0 - self.confidence).ln()
    }
}

/// What became of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// In both maps, no farther apart than expected.
    Same,
    /// In both maps, farther apart than expected.
    Moved,
    /// In the later map alone, where the earlier one looked.
    New,
    /// In the earlier map alone, where the later one looked.
    Gone,
    /// In one map alone, where no view of the other could have seen it.
    Unseen,
}

impl Status {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Same, Self::Moved, Self::New, Self::Gone, Self::Unseen];

    /// Its name in the outputs.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Moved => "moved",
            Self::New => "new",
            Self::Gone => "gone",
            Self::Unseen => "unseen",
        }
    }
}

/// One object of either map, or of both.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What became of it.
    pub status: Status,
    /// Its index in the earlier map.
    pub before: Option<usize>,
    /// Its index in the later map.
    pub after: Option<usize>,
    /// From its earlier place to its later one, less the common shift, (east, north), metres.
    pub offset_m: Option<Vector2<f64>>,
    /// The Mahalanobis distance of the two places, standard deviations.
    pub mahalanobis: Option<f64>,
    /// Views of the earlier map that cover it; `None` where that map's footprints are not known.
    pub n_covered_before: Option<usize>,
    /// Views of the later map that cover it, likewise.
    pub n_covered_after: Option<usize>,
}

/// Two maps compared.
#[derive(Debug, Clone)]
pub struct Changes {
    /// What counted as the same.
    pub options: Options,
    /// The common shift of the later map against the earlier one, where it was looked for.
    pub shift: Option<Shift>,
    /// Every object that counts, by status and by name.
    pub changes: Vec<Change>,
}

impl Changes {
    /// How many objects have a status.
    pub fn count(&self, status: Status) -> usize {
        self.of(status).count()
    }

    /// The objects of a status.
    pub fn of(&self, status: Status) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(move |c| c.status == status)
    }

    /// The mean squared Mahalanobis distance of the same objects, which is 2 where ellipses and
    /// registration are as uncertain as they say; `None` where nothing is the same.
    pub fn mean_d2(&self) -> Option<f64> {
        let squares = self.of(Status::Same).filter_map(|c| c.mahalanobis);
        mean(squares.map(|d| d * d))
    }

    /// The root mean square distance of the same objects, metres.
    pub fn rms_m(&self) -> Option<f64> {
        let offsets = self.of(Status::Same).filter_map(|c| c.offset_m);
        mean(offsets.map(|o| o.norm_squared())).map(f64::sqrt)
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts of objects")]
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0_usize), |(sum, n), x| (sum + x, n + 1));
    (n > 0).then(|| sum / n as f64)
}

/// Compares an earlier map with a later one.
///
/// # Errors
/// Options outside their domain, maps of different planets, more pairs than can be matched, a
/// shift that is asked for and that too few objects agree on.
pub fn compare(before: &Epoch, after: &Epoch, options: &Options) -> Result<Changes, Error> {
    options.check()?;
    let (planet, other) = (before.map.planet, after.map.planet);
    if planet != other {
        let expected = format!("one of {}, as the earlier", planet.name);
        let found = format!("a map of {}", other.name);
        return Err(Fault::found(Place::default(), "the later map", found, expected).into());
    }
    let all = || before.map.estimates.iter().chain(&after.map.estimates);
    let origin = all().next().map(|e| e.place);
    let site = Site::new(
        planet,
        origin.unwrap_or(Geodetic::from_degrees(0.0, 0.0, 0.0)),
    );
    let spots = |epoch: &Epoch| -> Vec<Spot> {
        let estimates = epoch.map.estimates.iter();
        estimates.map(|e| Spot::new(&site, e)).collect()
    };
    let (earlier, mut later) = (spots(before), spots(after));
    let counts = |e: &Estimate| e.p_exist.is_none_or(|p| p >= options.min_exist);
    let [sure_before, sure_after] = [before, after]
        .map(|epoch| -> Vec<bool> { epoch.map.estimates.iter().map(counts).collect() });
    let shift = match options.align_m {
        Some(reach_m) => {
            let sure = |spots: &[Spot], sure: &[bool]| -> Vec<Spot> {
                let both = spots.iter().zip(sure);
                both.filter(|(_, sure)| **sure)
                    .map(|(s, _)| s.clone())
                    .collect()
            };
            let (a, b) = (sure(&earlier, &sure_before), sure(&later, &sure_after));
            Some(shift::estimate(&a, &b, reach_m, options)?)
        }
        None => None,
    };
    let moved_by = shift.as_ref().map_or(Vector2::zeros(), Shift::vector);
    for spot in &mut later {
        spot.at -= moved_by;
    }
    let matcher = Matcher {
        options,
        earlier,
        later,
        sure_before,
        sure_after,
    };
    let mut changes = matcher.changes(before, after)?;
    changes.sort_by_cached_key(|c| {
        let name =
            |i: Option<usize>, epoch: &Epoch| i.map(|i| epoch.map.estimates[i].rock_id.clone());
        (c.status, name(c.after, after), name(c.before, before))
    });
    Ok(Changes {
        options: options.clone(),
        shift,
        changes,
    })
}

/// The two maps in one plane.
struct Matcher<'a> {
    options: &'a Options,
    earlier: Vec<Spot>,
    later: Vec<Spot>,
    sure_before: Vec<bool>,
    sure_after: Vec<bool>,
}

/// Of each object of both maps, whether it is still to be matched.
struct Open {
    before: Vec<bool>,
    after: Vec<bool>,
}

impl Matcher<'_> {
    fn changes(&self, before: &Epoch, after: &Epoch) -> Result<Vec<Change>, Error> {
        let mut open = Open {
            before: vec![true; self.earlier.len()],
            after: vec![true; self.later.len()],
        };
        let gate = self.options.gate();
        let everywhere = f64::INFINITY;
        let (sure_b, sure_a) = (self.sure_before.as_slice(), self.sure_after.as_slice());
        // Sure objects find each other first; only what they leave is held against the doubtful
        // ones, for a rock is not gone that the other map still suspects.
        let mut same = self.round(&mut open, [Some(true), Some(true)], gate, everywhere)?;
        same.extend(self.round(&mut open, [Some(true), Some(false)], gate, everywhere)?);
        same.extend(self.round(&mut open, [Some(false), Some(true)], gate, everywhere)?);
        let radius_m = self.options.radius_m;
        let moved = self.round(&mut open, [Some(true), Some(true)], everywhere, radius_m)?;
        let covered = |coverage: &Option<Coverage>, place: Geodetic| {
            coverage.as_ref().map(|c| c.count(place))
        };
        let change = |status, i: Option<usize>, j: Option<usize>| {
            // Where it stands now; where it stood, if it stands no more.
            let now = j.map(|j| after.map.estimates[j].place);
            let was = i.map(|i| before.map.estimates[i].place);
            let place = now.or(was);
            let pair = i.zip(j).map(|(i, j)| (&self.earlier[i], &self.later[j]));
            Change {
                status,
                before: i,
                after: j,
                offset_m: pair.map(|(a, b)| b.at - a.at),
                mahalanobis: pair.map(|(a, b)| a.d2(b, self.options.sigma_m).sqrt()),
                n_covered_before: place.and_then(|p| covered(&before.coverage, p)),
                n_covered_after: place.and_then(|p| covered(&after.coverage, p)),
            }
        };
        let pair = |status| move |(i, j): (usize, usize)| (status, Some(i), Some(j));
        let pairs = same.into_iter().map(pair(Status::Same));
        let pairs = pairs.chain(moved.into_iter().map(pair(Status::Moved)));
        let gone = (0..open.before.len()).filter(|&i| open.before[i] && sure_b[i]);
        let new = (0..open.after.len()).filter(|&j| open.after[j] && sure_a[j]);
        let all = pairs
            .chain(gone.map(|i| (Status::Gone, Some(i), None)))
            .chain(new.map(|j| (Status::New, None, Some(j))));
        Ok(all
            .map(|(status, i, j)| {
                let change = change(status, i, j);
                let other = match status {
                    Status::Gone => change.n_covered_after,
                    Status::New => change.n_covered_before,
                    _ => None,
                };
                let status = if other == Some(0) {
                    Status::Unseen
                } else {
                    status
                };
                Change { status, ..change }
            })
            .collect())
    }

    /// Matches what is still open among the sure or doubtful objects of either map: within a gate
    /// by Mahalanobis distance, or within a radius by distance where the gate is infinite.
    fn round(
        &self,
        open: &mut Open,
        [sure_before, sure_after]: [Option<bool>; 2],
        gate: f64,
        radius_m: f64,
    ) -> Result<Vec<(usize, usize)>, Error> {
        let chosen = |open: &[bool], sure: &[bool], wanted: Option<bool>| -> Vec<usize> {
            let fits = |&i: &usize| open[i] && wanted.is_none_or(|w| w == sure[i]);
            (0..open.len()).filter(fits).collect()
        };
        let left = chosen(&open.before, &self.sure_before, sure_before);
        let right = chosen(&open.after, &self.sure_after, sure_after);
        let a: Vec<&Spot> = left.iter().map(|&i| &self.earlier[i]).collect();
        let b: Vec<&Spot> = right.iter().map(|&j| &self.later[j]).collect();
        let sigma_m = self.options.sigma_m;
        let may =
            |a: &Spot, b: &Spot| !self.options.by_class || agree(&a.class, b.class.as_deref());
        let found = if gate.is_finite() {
            let reach = pairs::reach(&a, &b, sigma_m, gate);
            let cost = |a: &Spot, b: &Spot| may(a, b).then(|| a.d2(b, sigma_m));
            matched(&a, &b, reach, gate, "--sigma", cost)?
        } else {
            let cost = |a: &Spot, b: &Spot| may(a, b).then(|| (b.at - a.at).norm_squared());
            matched(&a, &b, radius_m, radius_m * radius_m, "--radius", cost)?
        };
        let found = found
            .into_iter()
            .map(|pair| (left[pair.left], right[pair.right]));
        let found: Vec<(usize, usize)> = found.collect();
        for &(i, j) in &found {
            open.before[i] = false;
            open.after[j] = false;
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests;
