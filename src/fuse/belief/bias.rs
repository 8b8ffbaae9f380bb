//! Errors that all readings of a sensor share: bearings counted from a little beside the bow,
//! ranges too long. No number of views averages them out, and where poses
//! are free they bend the whole map.
//!
//! A bias is an unknown that borders the normal equations: `[[H, G], [G^T, C]] [x; b] = [h; r]`, H of
//! objects and poses. It is taken in where the data ask for it, by the Bayes factor of a normal prior
//! against none, with looks counted by how often they are independent.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector4, Vector6};
use serde::Serialize;

use super::algebra::{self, Square4};
use super::engine::Engine;
use super::normal::Row;
use super::solve::{Part, Robust};
use super::system::System;
use crate::adjust::Problem;

/// Sensors with fewer readings say nothing of their bias.
const LEAST_READINGS: usize = 30;
/// A bias is taken in where it makes the data more probable by this factor, in logarithms.
const LEAST_GAIN: f64 = 1.0;
/// And is done where it moves by less than this share of its standard deviation.
const STILL: f64 = 0.05;

/// The readings that a bias shifts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BiasOf {
    /// Bearings, radians.
    Bearing,
    /// Ranges, metres.
    Range,
    /// Ranges, a share of them.
    RangeScale,
}

/// What a sensor reads too much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bias {
    /// The platform, where views name one.
    pub platform: Option<String>,
    /// The camera, where there is one.
    pub camera: Option<String>,
    /// Which of its readings.
    pub of: BiasOf,
    /// By how much: radians, metres, or a share.
    pub value: f64,
    /// One standard deviation of that.
    pub sigma: f64,
}

/// A bias that may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Term {
    pub(super) sensor: usize,
    pub(super) of: BiasOf,
    row: usize,
    /// One standard deviation, before any data.
    prior: f64,
    pub(super) value: f64,
    pub(super) is_on: bool,
}

impl Term {
    /// By how much a unit of it shifts the four rows of a reading.
    fn column(&self, row: &Row) -> [f64; 4] {
        let mut column = [0.0; 4];
        column[self.row] = match self.of {
            BiasOf::RangeScale => row.slant_m,
            _ => 1.0,
        };
        column
    }
}

/// The sensors of the views in the given order, numbered as they come.
pub(super) fn sensors(problem: &Problem<'_>, order: &[usize]) -> Vec<usize> {
    let mut numbers = BTreeMap::new();
    let number = |&view: &usize| {
        let view = &problem.views[view];
        let camera = view.camera.as_deref().map(|c| c.name.as_str());
        let n = numbers.len();
        *numbers
            .entry((view.platform.as_deref(), camera))
            .or_insert(n)
    };
    order.iter().map(number).collect()
}

type Sides = (Vec<Vector4<f64>>, Vec<Vector6<f64>>);

/// The solved normal equations of everything, bordered by all biases that may be.
pub(super) struct Survey {
    pub(super) system: System,
    spacing: usize,
    /// Where objects and poses would step, the biases held.
    steps: Sides,
    /// `H^-1 G`, by bias.
    pub(super) outward: Vec<Sides>,
    border: Vec<Sides>,
    /// What is left of the biases' information and its pull, objects and poses free:
    /// `C - G^T H^-1 G`.
    information: DMatrix<f64>,
    pull: DVector<f64>,
    /// Of every row its view and object, and how it pulls at the object.
    pub(super) pulls: Vec<(usize, usize, Vector4<f64>)>,
    /// How each view pulls at each bias.
    pub(super) bias_pulls: DMatrix<f64>,
}

impl Survey {
    /// Solves for other pulls at objects and the biases `on`, whose covariance is given.
    pub(super) fn again(
        &self,
        objects: &[Vector4<f64>],
        on: &[usize],
        covariance: &DMatrix<f64>,
        at_biases: &DVector<f64>,
    ) -> Vec<Vector4<f64>> {
        let still = vec![Vector6::zeros(); self.n_poses()];
        let (mut steps, _) = self.system.again(objects, &still);
        if on.is_empty() {
            return steps;
        }
        let left = DVector::from_fn(on.len(), |i, _| {
            at_biases[on[i]] - along(&self.border[on[i]].0, &steps)
        });
        let biases = covariance * left;
        for (i, &term) in on.iter().enumerate() {
            for (step, out) in steps.iter_mut().zip(&self.outward[term].0) {
                *step -= out * biases[i];
            }
        }
        steps
    }

    fn n_poses(&self) -> usize {
        self.steps.1.len()
    }

    /// What biases add to the covariances of objects and of views.
    pub(super) fn widen(
        &self,
        on: &[usize],
        covariance: &DMatrix<f64>,
        (objects, poses): &mut (Vec<Square4>, Vec<algebra::Square6>),
    ) {
        for (a, &i) in on.iter().enumerate() {
            for (b, &j) in on.iter().enumerate() {
                let c = covariance[(a, b)];
                let both = self.outward[i].0.iter().zip(&self.outward[j].0);
                for (cov, (x, y)) in objects.iter_mut().zip(both) {
                    for r in 0..4 {
                        for s in 0..4 {
                            cov[r][s] += c * x[r] * y[s];
                        }
                    }
                }
                let both = self.outward[i].1.iter().zip(&self.outward[j].1);
                for (cov, (x, y)) in poses.iter_mut().zip(both.step_by(self.spacing)) {
                    for r in 0..6 {
                        for s in 0..6 {
                            cov[r][s] += c * x[r] * y[s];
                        }
                    }
                }
            }
        }
    }
}

impl Engine<'_> {
    /// The biases that may be: of sensors with enough readings.
    pub(super) fn terms(&self) -> Vec<Term> {
        let n_sensors = self
            .platforms
            .iter()
            .map(|p| p.sensor + 1)
            .max()
            .unwrap_or(0);
        // Of every sensor and row: readings, their variances with those of headings, and ranges.
        let mut sums = vec![[(0usize, 0.0, 0.0); 4]; n_sensors];
        let mut is_bearing = vec![false; n_sensors];
        for edge in &self.edges {
            let look = &self.looks[edge.look];
            let Some(seen) = self.expect(look.view, &self.objects[edge.object]) else {
                continue;
            };
            let platform = &self.platforms[look.view];
            is_bearing[platform.sensor] = look.is_bearing();
            for r in (0..4).filter(|&r| look.has[r] && r != 2) {
                let turned = (3..6).map(|c| (seen.by_pose[r][c] * platform.sigma[c]).powi(2));
                let sum = &mut sums[platform.sensor][r];
                sum.0 += 1;
                sum.1 += look.sigmas[r].powi(2) + if r < 2 { turned.sum() } else { 0.0 };
                sum.2 += seen.values[3];
            }
        }
        let mut terms = Vec::new();
        for (sensor, rows) in sums.iter().enumerate() {
            for (row, (n, variance, range_m)) in rows.iter().enumerate() {
                if *n < LEAST_READINGS {
                    continue;
                }
                #[expect(clippy::cast_precision_loss, reason = "a count of readings")]
                let n = *n as f64;
                let mut add = |of, prior| {
                    terms.push(Term {
                        sensor,
                        of,
                        row,
                        prior,
                        value: 0.0,
                        is_on: false,
                    });
                };
                let sigma = (variance / n).sqrt();
                match row {
                    0 if is_bearing[sensor] => add(BiasOf::Bearing, sigma),
                    // A picture's axis off its mount is as a heading that is off, and the few
                    // headings of a short traverse that drift would pass for it.
                    0 | 1 => (),
                    _ => {
                        add(BiasOf::Range, sigma);
                        add(BiasOf::RangeScale, sigma / (range_m / n).max(0.1));
                    }
                }
            }
        }
        terms
    }

    /// The normal equations of all objects and poses, bordered by the biases that may be.
    pub(super) fn survey(&mut self) -> Option<Survey> {
        self.whole(|engine, part| engine.bordered(&part))
    }

    fn bordered(&self, part: &Part<'_>) -> Option<Survey> {
        let (n, b) = (part.objects.len(), self.terms.len());
        let begun = self.begin_normal(part);
        let (spacing, n_poses) = (begun.spacing, begun.poses.len());
        let side = || (vec![Vector4::zeros(); n], vec![Vector6::zeros(); n_poses]);
        let mut border: Vec<Sides> = (0..b).map(|_| side()).collect();
        let mut information = DMatrix::zeros(b, b);
        let mut pull = DVector::zeros(b);
        let mut pulls = Vec::with_capacity(part.edges.len());
        let mut bias_pulls = DMatrix::zeros(b, self.n_views());
        let normal = self.with_rows(begun, part, Robust::Contaminated, |row| {
            let toward = row.toward();
            pulls.push((
                row.view,
                row.object,
                Vector4::from(row.object_pull(&toward)),
            ));
            let sensor = self.platforms[row.view].sensor;
            let look = &self.looks[row.look];
            let own = |t: &(usize, &Term)| t.1.sensor == sensor && look.has[t.1.row];
            for (i, term) in self.terms.iter().enumerate().filter(own) {
                let column = term.column(row);
                let weighted: [f64; 4] = std::array::from_fn(|r| {
                    (0..4).map(|c| row.information[r][c] * column[c]).sum()
                });
                border[i].0[row.object] += Vector4::from(row.object_pull(&weighted));
                if n_poses > 0 {
                    let at = &mut border[i].1[row.view * spacing];
                    for r in 0..row.n {
                        for c in 0..6 {
                            at[c] += row.by_pose[r][c] * weighted[r];
                        }
                    }
                }
                let dot = |x: &[f64; 4]| column.iter().zip(x).map(|(c, x)| c * x).sum::<f64>();
                bias_pulls[(i, row.view)] += dot(&toward);
                pull[i] += dot(&toward);
                for (j, other) in self.terms.iter().enumerate().filter(own) {
                    let theirs = other.column(row);
                    information[(j, i)] += weighted
                        .iter()
                        .zip(&theirs)
                        .map(|(w, t)| w * t)
                        .sum::<f64>();
                }
            }
        });
        pulls.sort_by_key(|p| p.0);
        let (system, (steps, turns)) = System::new(normal)?;
        let outward: Vec<Sides> = border.iter().map(|(o, p)| system.again(o, p)).collect();
        for i in 0..b {
            pull[i] -= along(&border[i].0, &steps) + along(&border[i].1, &turns);
            for j in 0..b {
                information[(i, j)] -= along(&border[i].0, &outward[j].0);
                information[(i, j)] -= along(&border[i].1, &outward[j].1);
            }
        }
        Some(Survey {
            system,
            spacing,
            steps: (steps, turns),
            outward,
            border,
            information,
            pull,
            pulls,
            bias_pulls,
        })
    }

    /// The biases that are taken in, and their covariance.
    pub(super) fn biases_on(&self, survey: &Survey, effect: f64) -> (Vec<usize>, DMatrix<f64>) {
        let on: Vec<usize> = (0..self.terms.len())
            .filter(|&i| self.terms[i].is_on)
            .collect();
        let covariance = self.posterior(survey, &on, effect).1;
        (on, covariance)
    }

    /// Which biases the data ask for, where every look counts for one `effect`-th, and how large
    /// they are; objects and poses step along. Whether anything changed much.
    pub(super) fn find_biases(&mut self, survey: &Survey, effect: f64) -> bool {
        let mut on: Vec<usize> = Vec::new();
        let mut gained = 0.0;
        loop {
            let others = (0..self.terms.len()).filter(|i| !on.contains(i));
            let tries = others.map(|i| {
                let mut more = on.clone();
                more.push(i);
                more.sort_unstable();
                (self.bias_gain(survey, &more, effect), more)
            });
            let Some((gain, more)) = tries.max_by(|a, b| a.0.total_cmp(&b.0)) else {
                break;
            };
            if gain.is_nan() || gain < gained + LEAST_GAIN {
                break;
            }
            (on, gained) = (more, gain);
        }
        let (values, covariance) = self.posterior(survey, &on, effect);
        let mut is_moved = false;
        let (mut steps, mut turns) = survey.steps.clone();
        for i in 0..self.terms.len() {
            let before = self.terms[i];
            let place = on.iter().position(|&t| t == i);
            let value = place.map_or(0.0, |p| values[p]);
            let sigma = place.map_or(before.prior, |p| covariance[(p, p)].sqrt());
            is_moved |=
                place.is_some() != before.is_on || (value - before.value).abs() > STILL * sigma;
            let change = value - before.value;
            self.terms[i].is_on = place.is_some();
            self.terms[i].value = value;
            for (step, out) in steps.iter_mut().zip(&survey.outward[i].0) {
                *step -= out * change;
            }
            for (turn, out) in turns.iter_mut().zip(&survey.outward[i].1) {
                *turn -= out * change;
            }
        }
        if is_moved {
            self.correct_readings();
            for (x, step) in self.objects.iter_mut().zip(&steps) {
                for i in 0..4 {
                    x[i] += step[i];
                }
            }
            if !turns.is_empty() {
                let moving: Vec<usize> = (0..self.n_views()).collect();
                self.turn(&moving, &turns, survey.spacing);
            }
        }
        is_moved
    }

    /// Mean and covariance of biases, all others none.
    fn posterior(
        &self,
        survey: &Survey,
        on: &[usize],
        effect: f64,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let (information, pull) = self.asked(survey, on, effect);
        let precision = &information + self.prior_information(on);
        let covariance = precision
            .cholesky()
            .map_or_else(|| DMatrix::zeros(on.len(), on.len()), |c| c.inverse());
        (&covariance * pull, covariance)
    }

    /// Logarithm of the Bayes factor of these biases against none.
    fn bias_gain(&self, survey: &Survey, on: &[usize], effect: f64) -> f64 {
        let (information, pull) = self.asked(survey, on, effect);
        let prior = self.prior_information(on);
        let Some(whole) = (&information + &prior).cholesky() else {
            return f64::NAN;
        };
        let ln_prior = prior.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        0.5 * (pull.dot(&whole.solve(&pull)) + ln_prior - whole.ln_determinant())
    }

    fn prior_information(&self, on: &[usize]) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_fn(on.len(), |i, _| {
            self.terms[on[i]].prior.powi(-2)
        }))
    }

    /// What the data say of biases: information, and pull from none.
    fn asked(&self, survey: &Survey, on: &[usize], effect: f64) -> (DMatrix<f64>, DVector<f64>) {
        let all = DVector::from_fn(self.terms.len(), |i, _| self.terms[i].value);
        let from_none = &survey.pull + &survey.information * all;
        let n = on.len();
        (
            DMatrix::from_fn(n, n, |i, j| survey.information[(on[i], on[j])] / effect),
            DVector::from_fn(n, |i, _| from_none[on[i]] / effect),
        )
    }

    /// Takes the biases out of the readings, instead of those that were out of them.
    fn correct_readings(&mut self) {
        let mut by_sensor: BTreeMap<usize, Vec<Term>> = BTreeMap::new();
        for term in &self.terms {
            by_sensor.entry(term.sensor).or_default().push(*term);
        }
        for (look, raw) in self.looks.iter_mut().zip(&self.readings) {
            look.values = *raw;
            let sensor = self.platforms[look.view].sensor;
            for term in by_sensor.get(&sensor).into_iter().flatten() {
                if look.has[term.row] {
                    let value = &mut look.values[term.row];
                    match term.of {
                        BiasOf::RangeScale => *value /= 1.0 + term.value,
                        _ => *value -= term.value,
                    }
                }
            }
        }
    }
}

/// The inner product of two families of blocks.
fn along<const N: usize>(a: &[nalgebra::SVector<f64, N>], b: &[nalgebra::SVector<f64, N>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
