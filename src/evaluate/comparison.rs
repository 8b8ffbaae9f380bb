//! Puts map and truth into one frame, decides what counts, and matches the two.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::map::{Estimate, RockMap};
use super::truth::{IgnoredPlace, TrueObject};
use super::{Options, Truth};
use crate::error::{Error, Fault, Place};
use crate::frame::{Ellipse, Enu, Geodetic, LocalEnu, Point, Site, Vector};
use crate::matching::{Pair, assign};

/// Map and truth in one local frame, with what became of every object.
///
/// The frame is east-north-up at the first true object. Distances are horizontal: all places are
/// taken at that object's height.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// What was asked.
    pub options: Options,
    /// The local frame.
    pub site: Site,
    /// The mapped objects, in the order of the map.
    pub estimates: Vec<ComparedEstimate>,
    /// The true objects, in the order of the truth.
    pub truths: Vec<ComparedTruth>,
    /// The places to ignore.
    pub ignored: Vec<Point<Enu>>,
    /// The matches within the radius, in the order of the map.
    pub matches: Vec<Match>,
    /// The matches within the cut-off of GOSPA and OSPA, of the same counted objects.
    pub cutoff_matches: Vec<Match>,
}

/// A mapped object in the comparison.
#[derive(Debug, Clone)]
pub struct ComparedEstimate {
    /// Its name.
    pub rock_id: String,
    /// What it is said to be.
    pub class: Option<String>,
    /// Where it is said to be.
    pub place: Point<Enu>,
    /// The covariance of its place over (east, north), m^2.
    pub covariance: Option<Matrix2<f64>>,
    /// The probability said of its existence.
    pub p_exist: Option<f64>,
    /// What became of it.
    pub outcome: EstimateOutcome,
    /// Whether it exists, as far as the truth can tell: `None` near an ignored place.
    ///
    /// An object below the least existence exists where it can be matched to a true object that
    /// no counted one is matched to.
    pub exists: Option<bool>,
}

/// What became of a mapped object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EstimateOutcome {
    /// Matched to the true object of this index.
    Matched(usize),
    /// Counted, and matched to nothing.
    False,
    /// Matched to nothing, and within the radius of an ignored or a rarely detected object.
    Ignored,
    /// Below the least existence, and not counted.
    Doubtful,
}

/// A true object in the comparison.
#[derive(Debug, Clone)]
pub struct ComparedTruth {
    /// Its name.
    pub object_id: String,
    /// What it is.
    pub class: Option<String>,
    /// Where it is.
    pub place: Point<Enu>,
    /// What became of it.
    pub outcome: TruthOutcome,
}

/// What became of a true object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TruthOutcome {
    /// Matched to the mapped object of this index.
    Matched(usize),
    /// Counted, and matched to nothing.
    Missed,
    /// In too few detections to be expected in the map.
    Rare,
}

/// A mapped object and the true one it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Index of the mapped object.
    pub estimate: usize,
    /// Index of the true object.
    pub truth: usize,
    /// Place of the mapped object less that of the true one, (east, north), metres.
    pub error_m: Vector2<f64>,
}

impl Match {
    /// The distance between the two, metres.
    pub fn distance_m(&self) -> f64 {
        self.error_m.norm()
    }
}

/// Most pairs within the radius that are still matched: about 2 GB of memory.
const MAX_PAIRS: usize = 50_000_000;

impl Comparison {
    /// Compares a map with the truth.
    ///
    /// # Errors
    /// Options outside their domain; truth without objects or farther spread than a site reaches;
    /// a radius within which there are too many pairs.
    pub fn new(map: &RockMap, truth: &Truth, options: &Options) -> Result<Self, Error> {
        options.check()?;
        let first = truth
            .objects
            .first()
            .ok_or_else(|| Fault::found(Place::default(), "truth", "no objects", "at least one"))?;
        let site = Site::new(map.planet, first.place);
        let mut comparison = Self {
            options: options.clone(),
            site,
            estimates: map
                .estimates
                .iter()
                .map(|e| placed(&site, e, options))
                .collect(),
            truths: places_of_truth(&site, &truth.objects, options)?,
            ignored: truth
                .ignored
                .iter()
                .map(|i| at_height(&site, i.place))
                .collect(),
            matches: Vec::new(),
            cutoff_matches: Vec::new(),
        };
        comparison.match_within_radius(&truth.ignored)?;
        comparison.match_doubtful()?;
        comparison.match_within_cutoff()?;
        Ok(comparison)
    }

    /// The mapped objects that count: those matched, and those false.
    pub fn counted_estimates(&self) -> Vec<usize> {
        let counts = |o| matches!(o, EstimateOutcome::Matched(_) | EstimateOutcome::False);
        (0..self.estimates.len())
            .filter(|&i| counts(self.estimates[i].outcome))
            .collect()
    }

    /// The true objects that count: those matched, and those missed.
    pub fn counted_truths(&self) -> Vec<usize> {
        (0..self.truths.len())
            .filter(|&i| self.truths[i].outcome != TruthOutcome::Rare)
            .collect()
    }

    fn match_within_radius(&mut self, ignored: &[IgnoredPlace]) -> Result<(), Error> {
        let candidates: Vec<usize> = (0..self.estimates.len())
            .filter(|&i| self.estimates[i].outcome != EstimateOutcome::Doubtful)
            .collect();
        let truths = self.counted_truths();
        self.matches = self.matched(&candidates, &truths, self.options.radius_m, "--radius")?;
        for m in &self.matches {
            self.estimates[m.estimate].outcome = EstimateOutcome::Matched(m.truth);
            self.estimates[m.estimate].exists = Some(true);
            self.truths[m.truth].outcome = TruthOutcome::Matched(m.estimate);
        }
        let excuses = self.excuses(ignored);
        let (radius, by_class) = (self.options.radius_m, self.options.by_class);
        for estimate in &mut self.estimates {
            if matches!(estimate.outcome, EstimateOutcome::Matched(_)) {
                continue;
            }
            let excused = excuses
                .locate_within_distance(planar(estimate.place), radius * radius)
                .any(|excuse| !by_class || agree(&excuse.data, estimate.class.as_deref()));
            estimate.exists = (!excused).then_some(false);
            if excused && estimate.outcome == EstimateOutcome::False {
                estimate.outcome = EstimateOutcome::Ignored;
            }
        }
        Ok(())
    }

    /// The places near which an unmatched object is not counted, with their classes.
    fn excuses(&self, ignored: &[IgnoredPlace]) -> RTree<Excuse> {
        let rare = self
            .truths
            .iter()
            .filter(|t| t.outcome == TruthOutcome::Rare)
            .map(|t| GeomWithData::new(planar(t.place), t.class.clone()));
        let named = ignored
            .iter()
            .zip(&self.ignored)
            .map(|(i, &place)| GeomWithData::new(planar(place), i.class.clone()));
        RTree::bulk_load(rare.chain(named).collect())
    }

    /// Whether those below the least existence exist after all.
    fn match_doubtful(&mut self) -> Result<(), Error> {
        let doubtful: Vec<usize> = (0..self.estimates.len())
            .filter(|&i| self.estimates[i].outcome == EstimateOutcome::Doubtful)
            .collect();
        let missed: Vec<usize> = (0..self.truths.len())
            .filter(|&i| self.truths[i].outcome == TruthOutcome::Missed)
            .collect();
        for m in self.matched(&doubtful, &missed, self.options.radius_m, "--radius")? {
            self.estimates[m.estimate].exists = Some(true);
        }
        Ok(())
    }

    fn match_within_cutoff(&mut self) -> Result<(), Error> {
        let (estimates, truths) = (self.counted_estimates(), self.counted_truths());
        self.cutoff_matches =
            self.matched(&estimates, &truths, self.options.cutoff_m, "--cutoff")?;
        Ok(())
    }

    /// The optimal matching of some mapped objects with some true ones, nearer than `reach_m`.
    fn matched(
        &self,
        estimates: &[usize],
        truths: &[usize],
        reach_m: f64,
        option: &str,
    ) -> Result<Vec<Match>, Error> {
        let left: Vec<Spot> = estimates
            .iter()
            .map(|&i| (planar(self.estimates[i].place), &self.estimates[i].class))
            .collect();
        let right: Vec<Spot> = truths
            .iter()
            .map(|&i| (planar(self.truths[i].place), &self.truths[i].class))
            .collect();
        let pairs = pairs_within(&left, &right, reach_m, self.options.by_class, option)?;
        let matched = assign(left.len(), right.len(), &pairs, reach_m * reach_m / 2.0);
        Ok(matched
            .into_iter()
            .map(|pair| {
                let (e, t) = (left[pair.left].0, right[pair.right].0);
                Match {
                    estimate: estimates[pair.left],
                    truth: truths[pair.right],
                    error_m: Vector2::new(e[0] - t[0], e[1] - t[1]),
                }
            })
            .collect())
    }
}

/// A place to excuse unmatched objects near it, with its class.
type Excuse = GeomWithData<[f64; 2], Option<String>>;

/// A place with the class of what stands there.
type Spot<'a> = ([f64; 2], &'a Option<String>);

/// All pairs nearer than `reach_m`, with their squared distances, sorted by left and right.
fn pairs_within(
    left: &[Spot<'_>],
    right: &[Spot<'_>],
    reach_m: f64,
    by_class: bool,
    option: &str,
) -> Result<Vec<Pair>, Error> {
    let tree: RTree<GeomWithData<[f64; 2], usize>> = RTree::bulk_load(
        right
            .iter()
            .enumerate()
            .map(|(i, (place, _))| GeomWithData::new(*place, i))
            .collect(),
    );
    let limit = reach_m * reach_m;
    let near = |place: [f64; 2]| tree.locate_within_distance(place, limit);
    let total: usize = left.par_iter().map(|(place, _)| near(*place).count()).sum();
    if total > MAX_PAIRS {
        let found = format!("{reach_m} m, with {total} pairs of objects within it");
        let expected = format!("at most {MAX_PAIRS} pairs");
        return Err(Fault::found(Place::default(), option, found, expected).into());
    }
    let pairs_of = |(index, (place, class)): (usize, &Spot<'_>)| {
        let mut pairs: Vec<Pair> = near(*place)
            .filter(|at| !by_class || agree(right[at.data].1, class.as_deref()))
            .map(|at| {
                let (x, y) = (at.geom()[0] - place[0], at.geom()[1] - place[1]);
                Pair {
                    left: index,
                    right: at.data,
                    cost: x * x + y * y,
                }
            })
            .collect();
        pairs.sort_unstable_by_key(|pair| pair.right);
        pairs
    };
    let lists: Vec<Vec<Pair>> = left.par_iter().enumerate().map(pairs_of).collect();
    Ok(lists.into_iter().flatten().collect())
}

/// Whether two classes can be the same: one that is not given agrees with all.
pub(crate) fn agree(a: &Option<String>, b: Option<&str>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a == b,
        _ => true,
    }
}

fn planar(place: Point<Enu>) -> [f64; 2] {
    [place.xyz.x, place.xyz.y]
}

/// A place at the height of the site's origin, so that distances are horizontal.
pub(crate) fn at_height(site: &Site, place: Geodetic) -> Point<Enu> {
    let height_m = site.origin().height_m;
    let at = site.enu(Geodetic { height_m, ..place });
    // Beyond a site's reach the tangent plane folds back on itself, and a place on the far side of
    // the planet would fall on the origin; such a place keeps its true distance instead.
    let flat = at.xyz.xy().norm();
    let scale = if at.xyz.norm() > Site::REACH_M && flat > 0.0 {
        at.xyz.norm() / flat
    } else {
        1.0
    };
    Point::new(at.xyz.x * scale, at.xyz.y * scale, 0.0)
}

/// The covariance over the site's (east, north) of an ellipse at a place, m^2.
pub(crate) fn spread(site: &Site, place: Geodetic, ellipse: Ellipse) -> Matrix2<f64> {
    let (sin, cos) = ellipse.azimuth.sin_cos();
    let turned = site.enu_from_local(place) * Vector::<LocalEnu>::new(sin, cos, 0.0);
    let along = turned.xyz.xy().normalize();
    let across = Vector2::new(along.y, -along.x);
    along * along.transpose() * ellipse.sigma_major_m.powi(2)
        + across * across.transpose() * ellipse.sigma_minor_m.powi(2)
}

fn placed(site: &Site, estimate: &Estimate, options: &Options) -> ComparedEstimate {
    let place = at_height(site, estimate.place);
    let covariance = estimate
        .ellipse
        .map(|ellipse| spread(site, estimate.place, ellipse));
    ComparedEstimate {
        outcome: match estimate.p_exist {
            Some(p) if p < options.min_exist => EstimateOutcome::Doubtful,
            _ => EstimateOutcome::False,
        },
        rock_id: estimate.rock_id.clone(),
        class: estimate.class.clone(),
        p_exist: estimate.p_exist,
        exists: None,
        place,
        covariance,
    }
}

fn places_of_truth(
    site: &Site,
    objects: &[TrueObject],
    options: &Options,
) -> Result<Vec<ComparedTruth>, Fault> {
    let placed = |object: &TrueObject| {
        let place = at_height(site, object.place);
        let distance_m = place.horizontal_distance(Point::origin());
        if distance_m > Site::REACH_M {
            let found = format!("{:.1} km from the first object", distance_m / 1e3);
            let expected = format!("at most {:.0} km", Site::REACH_M / 1e3);
            let field = format!("truth: {}", object.object_id);
            return Err(Fault::found(Place::default(), field, found, expected));
        }
        let rare = object
            .n_detections
            .is_some_and(|n| n < f64::from(options.min_detections));
        Ok(ComparedTruth {
            object_id: object.object_id.clone(),
            class: object.class.clone(),
            place,
            outcome: if rare {
                TruthOutcome::Rare
            } else {
                TruthOutcome::Missed
            },
        })
    };
    objects.iter().map(placed).collect()
}

#[cfg(test)]
mod tests;
