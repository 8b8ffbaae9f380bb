//! Objects of two maps in one plane, and the pairs of them that may be one object.

use nalgebra::{Matrix2, Vector2};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::error::{Error, Fault, Place};
use crate::evaluate::{Estimate, Pair, assign, at_height, spread};
use crate::frame::Site;

/// Most pairs that are still matched: about 2 GB of memory.
const MAX_PAIRS: usize = 50_000_000;

/// An object in the plane of both maps.
#[derive(Debug, Clone)]
pub(super) struct Spot {
    /// Where it is, (east, north), metres.
    pub at: Vector2<f64>,
    /// The covariance of its place, m^2; zero where the map says nothing of it.
    pub covariance: Matrix2<f64>,
    /// What it is.
    pub class: Option<String>,
}

impl Spot {
    pub(super) fn new(site: &Site, estimate: &Estimate) -> Self {
        let ellipse = estimate.ellipse;
        Self {
            at: at_height(site, estimate.place).xyz.xy(),
            covariance: ellipse.map_or(Matrix2::zeros(), |e| spread(site, estimate.place, e)),
            class: estimate.class.clone(),
        }
    }

    /// The covariance of the offset between this object and the same one of the other map.
    pub(super) fn joint(&self, other: &Self, sigma_m: f64) -> Matrix2<f64> {
        self.covariance + other.covariance + Matrix2::identity() * (sigma_m * sigma_m)
    }

    /// The squared Mahalanobis distance; infinite where the covariance is not a covariance.
    pub(super) fn d2(&self, other: &Self, sigma_m: f64) -> f64 {
        let offset = other.at - self.at;
        let inverse = self.joint(other, sigma_m).try_inverse();
        inverse.map_or(f64::INFINITY, |inverse| offset.dot(&(inverse * offset)))
    }

    /// The greatest variance in any direction, m^2; no less, for the trace bounds it.
    fn variance_bound(&self) -> f64 {
        self.covariance.trace()
    }
}

/// How far apart two objects within the gate can be at most, metres.
pub(super) fn reach(a: &[&Spot], b: &[&Spot], sigma_m: f64, gate: f64) -> f64 {
    let widest = |spots: &[&Spot]| spots.iter().map(|s| s.variance_bound()).fold(0.0, f64::max);
    (gate * (widest(a) + widest(b) + sigma_m * sigma_m)).sqrt()
}

/// The one-to-one matching of least total cost among pairs no farther apart than `reach_m`, where
/// a pair costs no more than `limit`. A `cost` of `None` keeps a pair apart. Sorted by `left`.
///
/// # Errors
/// More pairs within reach than can be held; `option` is the one to blame.
pub(super) fn matched(
    a: &[&Spot],
    b: &[&Spot],
    reach_m: f64,
    limit: f64,
    option: &str,
    cost: impl Fn(&Spot, &Spot) -> Option<f64>,
) -> Result<Vec<Pair>, Error> {
    let tree = tree(b.iter().map(|spot| spot.at));
    let mut pairs = Vec::new();
    for (left, spot) in a.iter().enumerate() {
        let begin = pairs.len();
        let near = tree.locate_within_distance([spot.at.x, spot.at.y], reach_m * reach_m);
        let costs = near.filter_map(|n| Some((n.data, cost(spot, b[n.data])?)));
        pairs.extend(
            costs
                .filter(|&(_, cost)| cost <= limit)
                .map(|(right, cost)| Pair { left, right, cost }),
        );
        pairs[begin..].sort_unstable_by_key(|pair| pair.right);
        if pairs.len() > MAX_PAIRS {
            return Err(too_many(reach_m, option));
        }
    }
    Ok(assign(a.len(), b.len(), &pairs, limit / 2.0))
}

/// The offsets `b - a` of all pairs no farther apart than `reach_m`.
///
/// # Errors
/// As [`matched`].
pub(super) fn offsets(
    a: &[Spot],
    b: &[Spot],
    reach_m: f64,
    may: impl Fn(&Spot, &Spot) -> bool,
) -> Result<Vec<Vector2<f64>>, Error> {
    let tree = tree(b.iter().map(|spot| spot.at));
    let mut offsets = Vec::new();
    for spot in a {
        let near = tree.locate_within_distance([spot.at.x, spot.at.y], reach_m * reach_m);
        let mut near: Vec<usize> = near.map(|n| n.data).collect();
        near.sort_unstable();
        let partners = near.into_iter().filter(|&j| may(spot, &b[j]));
        offsets.extend(partners.map(|j| b[j].at - spot.at));
        if offsets.len() > MAX_PAIRS / 10 {
            return Err(too_many(reach_m, "--align"));
        }
    }
    Ok(offsets)
}

/// A tree over places in the plane, each with its index.
pub(super) fn tree(
    places: impl Iterator<Item = Vector2<f64>>,
) -> RTree<GeomWithData<[f64; 2], usize>> {
    let entries = places.enumerate();
    RTree::bulk_load(
        entries
            .map(|(i, at)| GeomWithData::new([at.x, at.y], i))
            .collect(),
    )
}

fn too_many(reach_m: f64, option: &str) -> Error {
    let found = format!("pairs of objects up to {reach_m:.1} m apart");
    let expected = "fewer pairs: a smaller distance";
    Fault::found(Place::default(), option, found, expected).into()
}
