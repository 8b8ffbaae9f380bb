//! Mixtures of Gaussians of one fixed width: standard EM, and the paper's multiple-view EM.
//!
//! Thompson & Wettergreen, "Multiple-Object Detection in Natural Scenes with Multiple-View
//! Expectation Maximization Clustering", IROS 2005. The feature space is the site's horizontal ENU
//! in metres: in latitude and longitude, as in the paper, a Gaussian of one width is not round.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::assignment::{Betas, Edges, Weights};
use super::gate::Neighbours;
use super::merge::collapsed;
use super::{Coverage, Fusion, Member, Object, Observation, SolverEvidence, Stopped};
use crate::frame::Point;

/// Where the clusters start.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// One on every observation, merged as they collapse; the count is found.
    EveryObservation,
    /// At these places (east, north; metres); the count is known, nothing merges, all are reported.
    Given(Vec<Vector2<f64>>),
}

/// Settings of both methods.
#[derive(Debug, Clone, PartialEq)]
pub struct MixtureSettings {
    /// How the Gaussians are weighted.
    pub weights: Weights,
    /// Where the clusters start.
    pub start: Start,
    /// The one standard deviation of the Gaussians, metres.
    pub width_m: f64,
    /// Observations farther than this many widths from a cluster are not considered.
    pub gate_widths: f64,
    /// Clusters closer than this become one, metres.
    pub merge_m: f64,
    /// Clusters of no more total membership are not reported.
    pub min_weight: f64,
    /// A largest move of no more than this ends the iterations, metres.
    pub tolerance_m: f64,
    /// The most iterations.
    pub max_iterations: usize,
}

impl MixtureSettings {
    /// The documented defaults: width 0.2 m, gate 4 widths, merging at 0.02 m, total membership
    /// over 1.5, tolerance 0.1 mm, 200 iterations.
    pub fn new(weights: Weights) -> Self {
        Self {
            weights,
            start: Start::EveryObservation,
            width_m: 0.2,
            gate_widths: 4.0,
            merge_m: 0.02,
            min_weight: 1.5,
            tolerance_m: 1e-4,
            max_iterations: 200,
        }
    }
}

/// Clusters of less total membership have lost all their observations and are dropped.
const VANISHED: f64 = 1e-6;
/// Memberships below this are not listed.
pub(super) const LISTED: f64 = 0.01;

/// Fuses observations, each class by itself.
pub fn fuse_mixture(
    observations: &[Observation],
    coverage: &dyn Coverage,
    settings: &MixtureSettings,
) -> Fusion {
    let mut classes: Vec<usize> = observations.iter().map(|o| o.class).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut objects = Vec::new();
    let mut solver = Vec::new();
    for class in classes {
        let mut mixture = Mixture::new(observations, class, settings);
        solver.push(mixture.solve(coverage, settings));
        objects.extend(mixture.objects(observations, settings));
    }
    objects.sort_by_key(|o| (o.members.first().map(|m| m.observation), o.class));
    Fusion {
        objects,
        solver,
        belief: None,
    }
}

/// The clusters of one class while they settle.
struct Mixture {
    class: usize,
    /// Index among all observations of each of this class, sorted by view.
    origin: Vec<usize>,
    points: Vec<Vector2<f64>>,
    views: Vec<usize>,
    means: Vec<Vector2<f64>>,
    weights: Vec<f64>,
    betas: Vec<Betas>,
    /// The last iteration's edges and memberships, by cluster.
    members: Vec<Vec<(usize, f64)>>,
}

impl Mixture {
    fn new(observations: &[Observation], class: usize, settings: &MixtureSettings) -> Self {
        let mut origin: Vec<usize> = (0..observations.len())
            .filter(|&i| observations[i].class == class)
            .collect();
        origin.sort_by_key(|&i| observations[i].view);
        let points: Vec<_> = origin
            .iter()
            .map(|&i| observations[i].place.xyz.xy())
            .collect();
        let means = match &settings.start {
            Start::EveryObservation => points.clone(),
            Start::Given(places) => places.clone(),
        };
        Self {
            class,
            views: origin.iter().map(|&i| observations[i].view).collect(),
            weights: vec![1.0; means.len()],
            betas: vec![Betas::new(); means.len()],
            members: Vec::new(),
            origin,
            points,
            means,
        }
    }

    fn solve(&mut self, coverage: &dyn Coverage, settings: &MixtureSettings) -> SolverEvidence {
        let tree = Neighbours::new(&self.points);
        let mut evidence = SolverEvidence {
            class: self.class,
            n_observations: self.points.len(),
            n_clusters: self.means.len(),
            iterations: 0,
            converged: self.points.is_empty(),
            stopped: if self.points.is_empty() {
                Stopped::NoObservations
            } else {
                Stopped::IterationLimit
            },
            log_likelihood: Vec::new(),
            last_move_m: 0.0,
        };
        while !evidence.converged && evidence.iterations < settings.max_iterations {
            let (moved, log_likelihood) = self.iterate(&tree, coverage, settings);
            let merged = settings.start == Start::EveryObservation && self.merge(settings.merge_m);
            evidence.iterations += 1;
            evidence.log_likelihood.push(log_likelihood);
            evidence.last_move_m = moved;
            if moved <= settings.tolerance_m && !merged {
                evidence.converged = true;
                evidence.stopped = Stopped::NothingMoved;
            }
        }
        evidence.n_clusters = self.means.len();
        evidence
    }

    /// One round of eqs 4, 5, 4 and 6. Returns the largest move and the log likelihood before it.
    fn iterate(
        &mut self,
        tree: &Neighbours,
        coverage: &dyn Coverage,
        settings: &MixtureSettings,
    ) -> (f64, f64) {
        let gate_m = settings.gate_widths * settings.width_m;
        let edges = Edges::new(&self.points, tree, &self.means, settings.width_m, gate_m);
        let (shares, log_likelihood) = edges.expectation(
            settings.weights,
            &self.views,
            &self.means,
            coverage,
            &mut self.betas,
        );
        let mut moved: f64 = 0.0;
        let mut kept = vec![true; self.means.len()];
        self.members.clear();
        for (k, kept) in kept.iter_mut().enumerate() {
            let members: Vec<(usize, f64)> = edges
                .of(k)
                .map(|e| (edges.observation[e], shares[e]))
                .collect();
            let weight: f64 = members.iter().map(|&(_, p)| p).sum();
            if weight < VANISHED {
                *kept = false;
                continue;
            }
            // Equation 6.
            let sum: Vector2<f64> = members.iter().map(|&(j, p)| self.points[j] * p).sum();
            let mean = sum / weight;
            moved = moved.max((mean - self.means[k]).amax());
            (self.means[k], self.weights[k]) = (mean, weight);
            self.members.push(members);
        }
        self.keep(&kept);
        (moved, log_likelihood)
    }

    fn keep(&mut self, kept: &[bool]) {
        let mut flags = kept.iter();
        self.means.retain(|_| *flags.next().unwrap_or(&true));
        let mut flags = kept.iter();
        self.weights.retain(|_| *flags.next().unwrap_or(&true));
        let mut flags = kept.iter();
        self.betas.retain(|_| *flags.next().unwrap_or(&true));
    }

    /// Replaces clusters that have collapsed to one point by their weighted mean. The mixing
    /// weights of the heaviest go on; the next iteration updates them.
    fn merge(&mut self, distance_m: f64) -> bool {
        let Some(groups) = collapsed(&self.means, distance_m) else {
            return false;
        };
        let count = groups.iter().max().map_or(0, |g| g + 1);
        let mut sums = vec![Vector2::zeros(); count];
        let mut weights = vec![0.0; count];
        let mut heaviest = vec![(f64::NEG_INFINITY, 0); count];
        let mut members: Vec<Vec<(usize, f64)>> = vec![Vec::new(); count];
        for (k, &g) in groups.iter().enumerate() {
            sums[g] += self.means[k] * self.weights[k];
            weights[g] += self.weights[k];
            if self.weights[k] > heaviest[g].0 {
                heaviest[g] = (self.weights[k], k);
            }
            members[g].extend(&self.members[k]);
        }
        self.means = sums.iter().zip(&weights).map(|(s, w)| s / *w).collect();
        self.weights = weights;
        self.betas = heaviest
            .iter()
            .map(|&(_, k)| std::mem::take(&mut self.betas[k]))
            .collect();
        self.members = members.into_iter().map(summed).collect();
        true
    }

    fn objects(&self, all: &[Observation], settings: &MixtureSettings) -> Vec<Object> {
        let report_all = matches!(settings.start, Start::Given(_));
        let reported = |k: &usize| report_all || self.weights[*k] > settings.min_weight;
        (0..self.members.len())
            .filter(reported)
            .map(|k| self.object(k, all))
            .collect()
    }

    /// The reported object: position and covariance of the weighted mean of its observations,
    /// whose errors are taken as independent.
    fn object(&self, k: usize, all: &[Observation]) -> Object {
        let total: f64 = self.members[k].iter().map(|&(_, p)| p).sum();
        let mut place = Vector3::zeros();
        let mut covariance = Matrix3::zeros();
        for &(j, p) in &self.members[k] {
            let observation = &all[self.origin[j]];
            let share = p / total;
            place += observation.place.xyz * share;
            covariance += observation.covariance * (share * share);
        }
        let mut members: Vec<Member> = self.members[k]
            .iter()
            .filter(|&&(_, p)| p >= LISTED)
            .map(|&(j, weight)| Member {
                observation: self.origin[j],
                weight,
            })
            .collect();
        members.sort_by_key(|m| m.observation);
        Object {
            place: Point::from_xyz(place),
            covariance,
            class: self.class,
            weight: self.weights[k],
            size_m: None,
            p_class: None,
            p_exist: None,
            members,
        }
    }
}

/// Memberships of merged clusters, added up an observation.
fn summed(mut members: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    members.sort_by_key(|&(j, _)| j);
    members.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    members
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuse::Everywhere;

    fn observation(view: usize, x: f64, y: f64) -> Observation {
        Observation {
            view,
            class: 0,
            place: Point::new(x, y, 1.0),
            covariance: Matrix3::identity() * 0.04,
        }
    }

    fn settings(weights: Weights) -> MixtureSettings {
        MixtureSettings {
            min_weight: 0.5,
            ..MixtureSettings::new(weights)
        }
    }

    #[test]
    fn nothing_gives_an_empty_map() {
        let fusion = fuse_mixture(&[], &Everywhere, &settings(Weights::Logistic));
        assert!(fusion.objects.is_empty() && fusion.solver.is_empty());
    }

    #[test]
    fn two_views_of_one_rock_average() {
        for weights in [Weights::Equal, Weights::Logistic] {
            let seen = [observation(0, 0.0, 0.0), observation(1, 0.1, 0.2)];
            let fusion = fuse_mixture(&seen, &Everywhere, &settings(weights));
            assert_eq!(fusion.objects.len(), 1);
            let rock = &fusion.objects[0];
            assert!((rock.place.xyz - Vector3::new(0.05, 0.1, 1.0)).norm() < 0.011);
            assert!((rock.weight - 2.0).abs() < 1e-9);
            assert!((rock.covariance[(0, 0)] - 0.02).abs() < 1e-9);
            assert!(fusion.solver[0].converged);
        }
    }

    #[test]
    fn classes_never_mix() {
        let mut seen = [observation(0, 0.0, 0.0), observation(1, 0.0, 0.0)];
        seen[1].class = 1;
        let fusion = fuse_mixture(&seen, &Everywhere, &settings(Weights::Equal));
        assert_eq!(fusion.objects.len(), 2);
    }

    /// The iteration written out densely, as the paper gives it (eqs 1, 4, 5, 4, 6).
    fn dense(
        views: &[Vec<Vector2<f64>>],
        s: f64,
        rounds: usize,
        logistic: bool,
    ) -> Vec<Vector2<f64>> {
        let mut mu = views[0].clone();
        let q = mu.len();
        let mut beta = vec![vec![0.5; q]; views.len()];
        for _ in 0..rounds {
            let mut sums = vec![(Vector2::zeros(), 0.0); q];
            for (i, view) in views.iter().enumerate() {
                let share = |beta: &[f64], x: &Vector2<f64>| {
                    let g: Vec<f64> = (0..q)
                        .map(|k| beta[k] * (-(x - mu[k]).norm_squared() / (2.0 * s * s)).exp())
                        .collect();
                    let sum: f64 = g.iter().sum();
                    g.into_iter().map(|g| g / sum).collect::<Vec<_>>()
                };
                if logistic {
                    let total: Vec<f64> = view.iter().fold(vec![0.0; q], |mut acc, x| {
                        for (a, p) in acc.iter_mut().zip(share(&beta[i], x)) {
                            *a += p;
                        }
                        acc
                    });
                    beta[i] = total
                        .iter()
                        .map(|t| 1.0 / (1.0 + (t - 1.0).exp()))
                        .collect();
                }
                for x in view {
                    for (k, p) in share(&beta[i], x).into_iter().enumerate() {
                        sums[k].0 += x * p;
                        sums[k].1 += p;
                    }
                }
            }
            mu = sums.iter().map(|(s, w)| s / *w).collect();
        }
        mu
    }

    #[test]
    fn agrees_with_the_dense_equations() {
        let views: Vec<Vec<Vector2<f64>>> = (0..4)
            .map(|v| {
                (0..6)
                    .map(|k| {
                        // Fixed, irregular offsets stand in for noise.
                        let a = f64::from(k) * 1.047 + 0.3 * f64::from((7 * v + 3 * k) % 5) - 0.6;
                        let r = 1.0 + 0.1 * f64::from((5 * v + k) % 4);
                        Vector2::new(r * a.cos(), r * a.sin())
                    })
                    .collect()
            })
            .collect();
        let observations: Vec<Observation> = views
            .iter()
            .enumerate()
            .flat_map(|(v, view)| view.iter().map(move |p| observation(v, p.x, p.y)))
            .collect();
        for (weights, logistic) in [(Weights::Equal, false), (Weights::Logistic, true)] {
            for rounds in [1, 2, 15] {
                let settings = MixtureSettings {
                    start: Start::Given(views[0].clone()),
                    width_m: 0.3,
                    gate_widths: f64::INFINITY,
                    tolerance_m: 0.0,
                    max_iterations: rounds,
                    ..MixtureSettings::new(weights)
                };
                let expected = dense(&views, 0.3, rounds, logistic);
                let mut mixture = Mixture::new(&observations, 0, &settings);
                mixture.solve(&Everywhere, &settings);
                assert_eq!(mixture.means.len(), expected.len());
                for (found, expected) in mixture.means.iter().zip(&expected) {
                    assert!((found - expected).norm() < 1e-12, "{weights:?} {rounds}");
                }
            }
        }
    }

    struct Only(usize);
    impl Coverage for Only {
        fn covers(&self, view: usize, _place: Point<crate::frame::Enu>) -> bool {
            view == self.0
        }
    }

    #[test]
    fn a_view_that_cannot_see_a_cluster_stays_neutral() {
        let seen = [
            observation(0, 0.0, 0.0),
            observation(0, 0.3, 0.0),
            observation(1, 0.1, 0.0),
        ];
        let one_round = MixtureSettings {
            max_iterations: 1,
            ..settings(Weights::Logistic)
        };
        let run = |coverage: &dyn Coverage| {
            let mut mixture = Mixture::new(&seen, 0, &one_round);
            mixture.solve(coverage, &one_round);
            mixture.betas
        };
        for betas in run(&Only(1)).iter().flatten() {
            assert_eq!(betas.0 == 0, betas.1 == 0.5, "{betas:?}");
        }
        assert!(run(&Everywhere).iter().flatten().all(|b| b.1 != 0.5));
    }
}
