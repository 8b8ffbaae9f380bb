//! Whether detections were put together rightly.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::comparison::{Comparison, EstimateOutcome};
use super::score::{count, ratio};
use super::truth::{DetectionKey, Evidence, Labels};
use crate::error::{Fault, Place};

/// How well the map's grouping of detections agrees with their labels.
///
/// A detection belongs to the mapped object of its largest weight (the first by name among
/// equals), unless that weight is less than what its weights leave to clutter, `1 - sum`, or the
/// object's existence is too improbable to count. With `n(r, o)` the detections of true object o
/// that belong to mapped object r, `n(r)` all labelled ones that belong to r (clutter included),
/// and `n(o)` all of o (those that belong to nothing included):
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Association {
    /// Detections labelled with a true object.
    pub n_labelled: usize,
    /// Of those, how many belong to a mapped object.
    pub n_associated: usize,
    /// Detections labelled as being of no object.
    pub n_clutter: usize,
    /// Of those, how many belong to a mapped object.
    pub n_clutter_associated: usize,
    /// Detections labelled with what is not in the truth: they are left out.
    pub n_left_out: usize,
    /// `sum over r of max over o of n(r, o)`, over `sum over r of n(r)`.
    pub purity: Option<f64>,
    /// `sum over o of max over r of n(r, o)`, over `sum over o of n(o)`.
    pub completeness: Option<f64>,
    /// Of the pairs of detections in one mapped object, the share that is of one true object.
    pub pair_precision: Option<f64>,
    /// Of the pairs of detections of one true object, the share that is in one mapped object.
    pub pair_recall: Option<f64>,
    /// Harmonic mean of the two.
    pub pair_f1: Option<f64>,
}

/// Scores the memberships of detections in mapped objects against labels.
///
/// # Errors
/// Labels and memberships that do not name detections in the same way: one names the image and the
/// other does not, where `det_id` alone is ambiguous.
pub fn associate(
    comparison: &Comparison,
    labels: &Labels,
    evidence: &Evidence,
) -> Result<Association, Fault> {
    let counted: BTreeSet<&str> = comparison
        .estimates
        .iter()
        .filter(|e| e.outcome != EstimateOutcome::Doubtful)
        .map(|e| e.rock_id.as_str())
        .collect();
    let known: BTreeSet<&str> = comparison
        .truths
        .iter()
        .map(|t| t.object_id.as_str())
        .collect();
    let owners = owners(labels, evidence)?;
    let mut tally = Tally::default();
    for (detection, object) in &labels.object_of {
        let owner = owners.get(detection).copied();
        let owner = owner.filter(|rock| counted.contains(rock));
        match object.as_deref() {
            Some(object) if !known.contains(object) => tally.n_left_out += 1,
            object => tally.add(owner, object),
        }
    }
    Ok(tally.scores())
}

/// The mapped object every detection belongs to, keyed as the labels are.
fn owners<'a>(
    labels: &Labels,
    evidence: &'a Evidence,
) -> Result<BTreeMap<DetectionKey, &'a str>, Fault> {
    if labels.by_image && !evidence.by_image {
        let place = Place::line(&evidence.file, 1);
        let expected = format!("a column image_id, as in {}", labels.file);
        return Err(Fault::found(place, "image_id", "no such column", expected));
    }
    let mut weights: BTreeMap<&DetectionKey, BTreeMap<&str, f64>> = BTreeMap::new();
    for membership in &evidence.memberships {
        let rocks = weights.entry(&membership.detection).or_default();
        *rocks.entry(&membership.rock_id).or_default() += membership.weight;
    }
    let mut owners = BTreeMap::new();
    let mut seen = BTreeSet::new();
    for (detection, rocks) in weights {
        let mut key = detection.clone();
        if !labels.by_image {
            key.image_id.clear();
            if !seen.insert(key.clone()) {
                let place = Place::line(&labels.file, 1);
                let expected = format!(
                    "a column image_id, since det_id {} is in several images of {}",
                    key.det_id, evidence.file
                );
                return Err(Fault::found(place, "image_id", "no such column", expected));
            }
        }
        let to_clutter = 1.0 - rocks.values().sum::<f64>();
        let mut best: Option<(&str, f64)> = None;
        for (rock, weight) in rocks {
            if best.is_none_or(|(_, most)| weight > most) {
                best = Some((rock, weight));
            }
        }
        // Weights are rounded where they are written: equal shares go to the object.
        if let Some((rock, _)) = best.filter(|&(_, most)| most + 1e-9 >= to_clutter) {
            owners.insert(key, rock);
        }
    }
    Ok(owners)
}

/// Counts of detections by mapped object and true object.
#[derive(Default)]
struct Tally<'a> {
    by_both: BTreeMap<(&'a str, &'a str), usize>,
    by_rock: BTreeMap<&'a str, usize>,
    by_object: BTreeMap<&'a str, usize>,
    n_clutter: usize,
    n_clutter_associated: usize,
    n_left_out: usize,
}

impl<'a> Tally<'a> {
    fn add(&mut self, owner: Option<&'a str>, object: Option<&'a str>) {
        if let Some(rock) = owner {
            *self.by_rock.entry(rock).or_default() += 1;
        }
        let Some(object) = object else {
            self.n_clutter += 1;
            self.n_clutter_associated += usize::from(owner.is_some());
            return;
        };
        *self.by_object.entry(object).or_default() += 1;
        if let Some(rock) = owner {
            *self.by_both.entry((rock, object)).or_default() += 1;
        }
    }

    fn scores(&self) -> Association {
        let mut most_of_rock: BTreeMap<&str, usize> = BTreeMap::new();
        let mut most_of_object: BTreeMap<&str, usize> = BTreeMap::new();
        for (&(rock, object), &n) in &self.by_both {
            let of_rock = most_of_rock.entry(rock).or_default();
            *of_rock = n.max(*of_rock);
            let of_object = most_of_object.entry(object).or_default();
            *of_object = n.max(*of_object);
        }
        let n_labelled = self.by_object.values().sum();
        let in_rocks: usize = self.by_rock.values().sum();
        let share = |part: usize, whole: usize| ratio(count(part), count(whole));
        let both = pairs(self.by_both.values());
        let (of_rocks, of_objects) = (pairs(self.by_rock.values()), pairs(self.by_object.values()));
        Association {
            n_labelled,
            n_associated: in_rocks - self.n_clutter_associated,
            n_clutter: self.n_clutter,
            n_clutter_associated: self.n_clutter_associated,
            n_left_out: self.n_left_out,
            purity: share(most_of_rock.values().sum(), in_rocks),
            completeness: share(most_of_object.values().sum(), n_labelled),
            pair_precision: ratio(both, of_rocks),
            pair_recall: ratio(both, of_objects),
            pair_f1: ratio(2.0 * both, of_rocks + of_objects),
        }
    }
}

/// How many pairs groups of these sizes hold.
fn pairs<'n>(sizes: impl Iterator<Item = &'n usize>) -> f64 {
    sizes.map(|&n| count(n) * (count(n) - 1.0) / 2.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{
        DetectionKey, Estimate, Membership, Options, RockMap, TrueObject, Truth,
    };
    use crate::frame::{Geodetic, Planet};

    fn comparison() -> Comparison {
        let place = Geodetic::from_degrees(49.0, 8.4, 0.0);
        let rock = |id: &str, p_exist| Estimate {
            rock_id: id.to_owned(),
            class: None,
            place,
            p_exist: Some(p_exist),
            ellipse: None,
        };
        let object = |id: &str| TrueObject {
            object_id: id.to_owned(),
            class: None,
            place,
            n_detections: None,
        };
        let map = RockMap {
            planet: Planet::EARTH,
            estimates: vec![rock("r1", 0.9), rock("r2", 0.9), rock("faint", 0.1)],
        };
        let truth = Truth {
            objects: vec![object("a"), object("b")],
            ignored: Vec::new(),
        };
        Comparison::new(&map, &truth, &Options::default()).unwrap()
    }

    fn key(image: &str, det: &str) -> DetectionKey {
        DetectionKey {
            image_id: image.to_owned(),
            det_id: det.to_owned(),
        }
    }

    fn labels(of: &[(&str, &str)]) -> Labels {
        let object = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        Labels {
            file: "labels.csv".to_owned(),
            object_of: of.iter().map(|&(d, o)| (key("", d), object(o))).collect(),
            by_image: false,
        }
    }

    fn evidence(of: &[(&str, &str, &str, f64)]) -> Evidence {
        let membership = |&(rock, image, det, weight): &(&str, &str, &str, f64)| Membership {
            rock_id: rock.to_owned(),
            detection: key(image, det),
            weight,
        };
        Evidence {
            file: "evidence.csv".to_owned(),
            memberships: of.iter().map(membership).collect(),
            by_image: true,
        }
    }

    /// By hand. r1 holds a a b and clutter, r2 holds a; one of b belongs to nothing (its weight is
    /// less than clutter's), one to an object that does not count.
    #[test]
    fn purity_completeness_and_pairs_are_those_by_hand() {
        let labels = labels(&[
            ("1", "a"),
            ("2", "a"),
            ("3", "b"),
            ("4", ""),
            ("5", "a"),
            ("6", "b"),
            ("7", "b"),
            ("8", "moving"),
            ("9", ""),
        ]);
        let evidence = evidence(&[
            ("r1", "x", "1", 1.0),
            ("r1", "x", "2", 0.6),
            ("r2", "x", "2", 0.4),
            ("r1", "y", "3", 0.5),
            ("r1", "y", "4", 0.9),
            ("r2", "y", "5", 0.7),
            ("r2", "z", "6", 0.45),
            ("faint", "z", "7", 1.0),
            ("r2", "z", "8", 1.0),
        ]);
        let a = associate(&comparison(), &labels, &evidence).unwrap();
        assert_eq!((a.n_labelled, a.n_associated), (6, 4));
        assert_eq!(
            (a.n_clutter, a.n_clutter_associated, a.n_left_out),
            (2, 1, 1)
        );
        // r1: a 2 of 4; r2: a 1 of 1.
        assert_eq!(a.purity, Some(3.0 / 5.0));
        // a: 2 of 3 in r1; b: 1 of 3 in r1.
        assert_eq!(a.completeness, Some(3.0 / 6.0));
        // One right pair; 6 pairs in r1; 3 pairs of a and 3 of b.
        assert_eq!(a.pair_precision, Some(1.0 / 6.0));
        assert_eq!(a.pair_recall, Some(1.0 / 6.0));
        assert_eq!(a.pair_f1, Some(1.0 / 6.0));
    }

    #[test]
    fn perfect_grouping_scores_one_and_none_has_no_purity() {
        let labels = labels(&[("1", "a"), ("2", "a"), ("3", "b")]);
        let right = [
            ("r1", "x", "1", 1.0),
            ("r1", "x", "2", 1.0),
            ("r2", "x", "3", 1.0),
        ];
        let a = associate(&comparison(), &labels, &evidence(&right)).unwrap();
        assert_eq!(
            (a.purity, a.completeness, a.pair_f1),
            (Some(1.0), Some(1.0), Some(1.0))
        );
        let a = associate(&comparison(), &labels, &evidence(&[])).unwrap();
        assert_eq!((a.purity, a.completeness), (None, Some(0.0)));
        assert_eq!((a.pair_precision, a.pair_recall), (None, Some(0.0)));
    }

    #[test]
    fn keys_that_do_not_fit_are_faults() {
        let labels_without = labels(&[("1", "a")]);
        let twice = evidence(&[("r1", "x", "1", 1.0), ("r1", "y", "1", 1.0)]);
        let fault = associate(&comparison(), &labels_without, &twice).unwrap_err();
        assert_eq!(
            fault.to_string(),
            "labels.csv:1: image_id: found no such column, expected a column image_id, since \
             det_id 1 is in several images of evidence.csv"
        );
        let with = Labels {
            by_image: true,
            ..labels_without
        };
        let without = Evidence {
            by_image: false,
            ..evidence(&[("r1", "", "1", 1.0)])
        };
        let fault = associate(&comparison(), &with, &without).unwrap_err();
        assert_eq!(
            fault.to_string(),
            "evidence.csv:1: image_id: found no such column, expected a column image_id, as in \
             labels.csv"
        );
    }
}
