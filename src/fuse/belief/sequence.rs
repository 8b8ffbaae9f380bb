//! Stage A: the views are taken in one after the other (3.6).

use super::algebra::Square4;
use super::classes::{Class, Given};
use super::engine::{Edge, Engine};
use super::evidence::probability;
use super::looks::Repeats;
use super::near::Buckets;
use super::noise::robust_weight;
use super::pairs::Candidates;
use super::register::Registered;
use super::solve::{Part, Robust};
use crate::fuse::Exclusive;

/// How many times the stated covariance of a pose registration searches in.
const SCALES: [f64; 2] = [1.0, 2.5];
/// The wider search must be better by this much.
const MARGIN: f64 = 3.0;
/// The last views whose poses still move.
const WINDOW: usize = 24;
/// Squared scales of the robust steps after each view.
const SCHEDULE: [f64; 3] = [100.0, 25.0, 9.0];
/// Objects are taken to exist with no more than this probability.
const MOST_LIKELY: f64 = 0.9;
/// A detection joins an object if it belongs to the known ones at all ...
const JOINS: f64 = 0.5;
/// ... and to this one with at least this membership.
const LEAST_MEMBERSHIP: f64 = 0.05;

/// The map on its way.
struct Growing {
    objects: Vec<[f64; 4]>,
    cov: Vec<Square4>,
    classes: Vec<Class>,
    /// Log-odds that they exist, and the probabilities as registration takes them.
    log_odds: Vec<f64>,
    exist: Vec<f64>,
    /// The last view that expected each to be seen.
    last: Vec<Option<usize>>,
    near: Buckets,
    /// The object of each look.
    own: Vec<Option<usize>>,
    /// What each look was worth when its object was last solved for.
    worth: Vec<f64>,
    /// Information of looks that have left the window, and its product with the place.
    folded: Vec<Square4>,
    toward: Vec<[f64; 4]>,
}

impl Growing {
    /// How much of a view's look at an object is new: little soon after the last.
    fn news(&self, engine: &Engine<'_>, object: usize, view: usize) -> f64 {
        let x = &self.objects[object];
        self.last[object].map_or(1.0, |last| engine.apart(x, last, view, Repeats::Detection))
    }
}

impl Engine<'_> {
    /// Takes in the views in an order, and leaves one edge of full weight a look.
    pub(super) fn sequence(&mut self, order: &[usize]) {
        let mut map = Growing {
            objects: Vec::new(),
            cov: Vec::new(),
            classes: Vec::new(),
            log_odds: Vec::new(),
            exist: Vec::new(),
            last: Vec::new(),
            near: Buckets::new(self.bucket_m()),
            own: vec![None; self.looks.len()],
            worth: vec![1.0; self.looks.len()],
            folded: Vec::new(),
            toward: Vec::new(),
        };
        let mut exclusive = Exclusive::new();
        for (at, &view) in order.iter().enumerate() {
            let before = at.checked_sub(1).map(|i| order[i]);
            if self.drift_law().is_some() {
                let (mean, _) = self.drift_from(before, view);
                self.drift[view] = mean;
                self.set_delta(view, mean);
            }
            if !map.objects.is_empty() && !self.looks_of(view).is_empty() {
                self.take_in(view, before, &mut map, &mut exclusive);
            }
            self.found_new(view, &mut map);
            let window = &order[(at + 1).saturating_sub(WINDOW)..=at];
            if at >= WINDOW {
                self.fold(order[at - WINDOW], &mut map);
            }
            self.is_settled[view] = true;
            self.settle_window(view, window, &mut map);
        }
        self.edges = map
            .own
            .iter()
            .enumerate()
            .filter_map(|(look, own)| {
                Some(Edge {
                    look,
                    object: (*own)?,
                    weight: 1.0,
                })
            })
            .collect();
        self.objects = map.objects;
        self.object_cov = map.cov;
        self.classes = map.classes;
        self.hear_classes();
    }

    /// Registers a view, and gives its detections to the objects they are of.
    fn take_in(
        &mut self,
        view: usize,
        before: Option<usize>,
        map: &mut Growing,
        exclusive: &mut Exclusive,
    ) {
        let among = Candidates {
            objects: &map.objects,
            cov: &map.cov,
            classes: &map.classes,
            given: Given::NONE,
            exist: &map.exist,
            near: &map.near,
        };
        if self.corrects_poses() {
            let mut stated = [[0.0; 6]; 6];
            let (_, variance) = self.drift_from(before, view);
            for (i, v) in variance.iter().enumerate() {
                stated[i][i] = *v;
            }
            let mut best: Option<Registered> = None;
            for scale in SCALES {
                let prior = stated.map(|row| row.map(|x| x * scale * scale));
                let found = self.register(view, &among, &prior, exclusive);
                if best.is_none_or(|b| found.score > b.score + MARGIN) {
                    best = Some(found);
                }
            }
            if let Some(best) = best {
                self.set_delta(view, best.delta);
                self.pose_cov[view] = best.cov;
            }
        }
        let found = self.expectation_of(view, &among, &self.pose_cov[view]);
        let p = self.associate_view(view, &found, exclusive);
        let first = self.start[view];
        let mut total = vec![0.0; self.looks_of(view).len()];
        for (c, p) in found.candidates.iter().zip(&p) {
            total[c.candidate.look - first] += p;
        }
        let mut joining: Vec<usize> = (0..p.len())
            .filter(|&i| {
                let look = found.candidates[i].candidate.look;
                total[look - first] > JOINS && p[i] > LEAST_MEMBERSHIP
            })
            .collect();
        joining.sort_by(|&a, &b| p[b].total_cmp(&p[a]).then(a.cmp(&b)));
        let mut taken: Vec<usize> = Vec::new();
        for i in joining {
            let c = found.candidates[i].candidate;
            let object = found.pairs[c.pair].pair.object;
            if map.own[c.look].is_none() && !taken.contains(&object) {
                taken.push(object);
                map.own[c.look] = Some(object);
                let clutter = self.background[c.look].clutter;
                let news = map.news(self, object, view);
                let said = self.looks[c.look].class;
                map.classes[object].hear(self.kinds.as_deref(), said, news);
                map.log_odds[object] += news
                    * (c.ln_likelihood - clutter
                        + found.pairs[c.pair].pair.p_detect.max(0.02).ln());
            }
        }
        for pair in &found.pairs {
            let k = pair.pair.object;
            if !taken.contains(&k) {
                map.log_odds[k] += map.news(self, k, view) * (-pair.pair.p_detect).ln_1p();
            }
            if self.corrects_poses() {
                map.exist[k] = likely(map.log_odds[k]);
            }
            map.last[k] = Some(view);
        }
    }

    /// Detections that are of no known object are of new ones.
    fn found_new(&self, view: usize, map: &mut Growing) {
        for look in self.looks_of(view) {
            if map.own[look].is_some() {
                continue;
            }
            let single = self.single(&self.looks[look], &self.singles[look].object);
            let k = map.objects.len();
            map.own[look] = Some(k);
            map.near.put(k, single.object[0], single.object[1]);
            map.objects.push(single.object);
            map.cov.push(single.cov);
            map.classes.push(self.class_of(look));
            let background = &self.background[look];
            map.log_odds.push(background.new - background.clutter);
            // Where nothing is registered, nothing is lost by trusting every object.
            map.exist.push(if self.corrects_poses() {
                likely(background.new - background.clutter)
            } else {
                MOST_LIKELY
            });
            map.last.push(Some(view));
            map.folded.push([[0.0; 4]; 4]);
            map.toward.push([0.0; 4]);
        }
    }

    /// Turns the looks of a view that leaves the window into information of their objects.
    fn fold(&self, view: usize, map: &mut Growing) {
        for look in self.looks_of(view) {
            let Some(k) = map.own[look] else { continue };
            let x = map.objects[k];
            let Some((h, m, n, e, _)) = self.information_of(look, &x) else {
                continue;
            };
            let detection = &self.looks[look];
            let weight =
                map.worth[look] * robust_weight(&e, &self.looseness[look], detection.n_rows());
            let mut a = [[0.0; 4]; 4];
            super::algebra::add_information(&mut a, &h, &m, n, weight);
            for i in 0..4 {
                let mut b = 0.0;
                for r in 0..n {
                    let pull: f64 = (0..n).map(|s| m[r][s] * e[s]).sum();
                    b += weight * h[r][i] * pull;
                }
                for j in 0..4 {
                    map.folded[k][i][j] += a[i][j];
                    b += a[i][j] * x[j];
                }
                map.toward[k][i] += b;
            }
        }
    }

    /// Solves again for the poses of the window and the objects they see.
    fn settle_window(&mut self, view: usize, window: &[usize], map: &mut Growing) {
        let corrects = self.corrects_poses();
        let mut moving: Vec<usize> = window.to_vec();
        moving.sort_unstable();
        let mut touched: Vec<usize> = if corrects {
            let looks = moving.iter().flat_map(|&v| self.looks_of(v));
            looks.filter_map(|look| map.own[look]).collect()
        } else {
            self.looks_of(view)
                .filter_map(|look| map.own[look])
                .collect()
        };
        touched.sort_unstable();
        touched.dedup();
        if touched.is_empty() {
            return;
        }
        let mut edges = Vec::new();
        for &v in &moving {
            for look in self.looks_of(v) {
                let Some(Ok(object)) = map.own[look].map(|k| touched.binary_search(&k)) else {
                    continue;
                };
                edges.push(Edge {
                    look,
                    object,
                    weight: 1.0,
                });
            }
        }
        let mut objects: Vec<[f64; 4]> = touched.iter().map(|&k| map.objects[k]).collect();
        let folded: Vec<Square4> = touched.iter().map(|&k| map.folded[k]).collect();
        let toward: Vec<[f64; 4]> = touched.iter().map(|&k| map.toward[k]).collect();
        let of: Vec<(usize, usize)> = edges
            .iter()
            .map(|e| (e.object, self.looks[e.look].view))
            .collect();
        let worth = self.worth(&objects, &of, Repeats::Errors);
        for (edge, worth) in edges.iter().zip(&worth) {
            map.worth[edge.look] = *worth;
        }
        let schedule: &[Robust] = if corrects {
            &SCHEDULE.map(Robust::Scale)
        } else {
            &[Robust::Contaminated]
        };
        for robust in schedule {
            let part = Part {
                objects: &mut objects,
                edges: &edges,
                worth: &worth,
                moving: &moving,
                folded: Some((&folded, &toward)),
            };
            self.step(part, *robust, false);
        }
        let part = Part {
            objects: &mut objects,
            edges: &edges,
            worth: &worth,
            moving: &moving,
            folded: Some((&folded, &toward)),
        };
        let cov = self.apart_cov(&part);
        for ((&k, x), cov) in touched.iter().zip(&objects).zip(cov) {
            map.objects[k] = *x;
            map.cov[k] = cov;
            map.near.put(k, x[0], x[1]);
        }
    }
}

/// Registration never takes an object for certain, one way or the other: its own beginnings are
/// rough.
fn likely(log_odds: f64) -> f64 {
    probability(log_odds).clamp(1.0 - MOST_LIKELY, MOST_LIKELY)
}
