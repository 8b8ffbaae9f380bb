//! The M-step: places of objects and errors of poses that agree best with weighted detections (3.4).

use nalgebra::{SMatrix, Vector6};
use rayon::prelude::*;

use super::algebra::{
    self, ByPose, Factor4, Square4, Square6, add_information, from_matrix, inverse4, inverse6,
};
use super::engine::{Edge, Engine};
use super::looks::Repeats;
use super::noise::{robust_weight, with_noise};
use super::normal::{Normal, Row, times};
use super::system::System;

/// Objects move by at most this share of the range of the nearest view that detected them ...
const STEP_SHARE: f64 = 0.2;
/// ... and by this at least and at most, metres.
const STEP_M: (f64, f64) = (0.3, 5.0);
/// From so many edges on their rows are computed in parallel, so many at a time.
const CHUNK: usize = 8192;
/// Logarithms of sizes move by at most this.
const STEP_SIZE: f64 = 0.5;

/// Objects that are solved for together with views, or a part of them.
pub(super) struct Part<'a> {
    /// The objects, by their number in the edges.
    pub(super) objects: &'a mut [[f64; 4]],
    pub(super) edges: &'a [Edge],
    /// How many looks each edge is worth.
    pub(super) worth: &'a [f64],
    /// Views whose poses move, ascending; others are held.
    pub(super) moving: &'a [usize],
    /// Information of looks that are no longer among the edges, and its product with the place.
    pub(super) folded: Option<(&'a [Square4], &'a [[f64; 4]])>,
}

/// What a step came to.
pub(super) struct Stepped {
    /// Covariances of objects, the poses held.
    pub(super) conditional: Vec<Square4>,
    /// Covariances of objects and of the moving poses, all others free.
    pub(super) marginal: Option<(Vec<Square4>, Vec<Square6>)>,
    /// The longest move, metres, before it was shortened.
    pub(super) move_m: f64,
}

/// How far residuals are trusted.
#[derive(Clone, Copy)]
pub(super) enum Robust {
    /// As the contaminated normal says.
    Contaminated,
    /// By Geman and `McClure`, with this squared scale.
    Scale(f64),
}

impl Engine<'_> {
    /// One Gauss-Newton step, which moves the objects of the part and the poses of its views.
    pub(super) fn step(&mut self, part: Part<'_>, robust: Robust, marginals: bool) -> Stepped {
        let mut normal = self.normal(&part, robust);
        let conditional: Vec<Square4> = normal.information.iter().map(inverse_or_zero).collect();
        let nearest_m = std::mem::take(&mut normal.nearest_m);
        let (steps, marginal) = if self.corrects_poses() {
            self.joint(normal, part.moving, marginals)
        } else {
            let steps = conditional.iter().zip(&normal.pull);
            let steps = steps.map(|(c, b)| times(c, b)).collect();
            (steps, marginals.then(|| (conditional.clone(), Vec::new())))
        };
        let mut move_m = 0.0f64;
        for ((x, step), nearest_m) in part.objects.iter_mut().zip(&steps).zip(&nearest_m) {
            let length = (step[0] * step[0] + step[1] * step[1] + step[2] * step[2]).sqrt();
            if !length.is_finite() {
                continue;
            }
            move_m = move_m.max(length);
            let limit_m = (STEP_SHARE * nearest_m).clamp(STEP_M.0, STEP_M.1);
            let share = (limit_m / length.max(1e-12)).min(1.0);
            for i in 0..3 {
                x[i] += step[i] * share;
            }
            x[3] += (step[3] * share).clamp(-STEP_SIZE, STEP_SIZE);
        }
        Stepped {
            conditional,
            marginal,
            move_m,
        }
    }

    /// The normal equations of a part.
    pub(super) fn normal(&self, part: &Part<'_>, robust: Robust) -> Normal {
        self.with_rows(self.begin_normal(part), part, robust, |_| ())
    }

    /// Normal equations with the rows of a part, each shown to `each`.
    pub(super) fn with_rows(
        &self,
        mut normal: Normal,
        part: &Part<'_>,
        robust: Robust,
        mut each: impl FnMut(&Row),
    ) -> Normal {
        let mut take = |row: &Row| {
            normal.add(row, part.moving, self.corrects_poses());
            each(row);
        };
        let objects: &[[f64; 4]] = part.objects;
        if part.edges.len() < CHUNK {
            for (edge, worth) in part.edges.iter().zip(part.worth) {
                if let Some(row) = self.row(edge, *worth, objects, robust) {
                    take(&row);
                }
            }
            return normal;
        }
        let chunks = part.edges.chunks(CHUNK).zip(part.worth.chunks(CHUNK));
        for (edges, worths) in chunks {
            let rows: Vec<Option<Row>> = edges
                .par_iter()
                .zip(worths)
                .map(|(edge, worth)| self.row(edge, *worth, objects, robust))
                .collect();
            rows.iter().flatten().for_each(&mut take);
        }
        normal
    }

    /// The normal equations before any look: priors, and looks that were folded into objects.
    pub(super) fn begin_normal(&self, part: &Part<'_>) -> Normal {
        let n = part.objects.len();
        let mut normal = Normal {
            information: Vec::with_capacity(n),
            pull: Vec::with_capacity(n),
            nearest_m: vec![f64::INFINITY; n],
            poses: Vec::new(),
            couplings: Vec::new(),
            links: Vec::new(),
            spacing: 1,
        };
        for (k, x) in part.objects.iter().enumerate() {
            let prior = self.prior(x);
            let (mut a, mut b) = (prior.information, prior.pull);
            if let Some((folded, toward)) = part.folded {
                for i in 0..4 {
                    b[i] += toward[k][i];
                    for j in 0..4 {
                        a[i][j] += folded[k][i][j];
                        b[i] -= folded[k][i][j] * x[j];
                    }
                }
            }
            normal.information.push(a);
            normal.pull.push(b);
        }
        if let Some(drift) = self.drifts(part.moving.len(), n) {
            let chain = self.chain(&drift, part.moving);
            normal.poses = chain.blocks;
            normal.links = chain.links;
            normal.spacing = 2;
        } else if self.corrects_poses() {
            normal.couplings.reserve(part.edges.len());
            normal.poses.extend(part.moving.iter().map(|&view| {
                let prior = Vector6::from(self.pose_information(view));
                let at = Vector6::from(self.delta[view]);
                (SMatrix::from_diagonal(&prior), -prior.component_mul(&at))
            }));
        }
        normal
    }

    fn row(&self, edge: &Edge, worth: f64, objects: &[[f64; 4]], robust: Robust) -> Option<Row> {
        let look = &self.looks[edge.look];
        let seen = self.expect(look.view, &objects[edge.object])?;
        let e = seen.residual(look);
        let variances = &self.looseness[edge.look];
        let (by_object, by_pose) = seen.of(look);
        let trust = match robust {
            Robust::Contaminated => robust_weight(&e, variances, look.n_rows()),
            Robust::Scale(c2) => {
                let mut m2: f64 = (0..2).map(|r| e[r] * e[r] / variances[r]).sum();
                if look.is_bearing() {
                    m2 += e[3] * e[3] / variances[3];
                }
                (c2 / (c2 + m2)).powi(2)
            }
        };
        let weight = edge.weight * worth * trust;
        let mut information = [[0.0; 4]; 4];
        if self.corrects_poses() {
            for r in 0..look.n {
                if look.has[r] {
                    information[r][r] = weight / variances[r];
                }
            }
        } else {
            let spread = algebra::spread(&by_pose, &self.pose_cov[look.view], look.n);
            let factor = Factor4::new(&with_noise(&spread, variances, 1.0), look.n)?;
            information = factor.inverse();
            for (r, row) in information.iter_mut().enumerate() {
                for (c, value) in row.iter_mut().enumerate() {
                    let counts = look.has[r] && look.has[c];
                    *value *= if counts { weight } else { 0.0 };
                }
            }
        }
        Some(Row {
            look: edge.look,
            object: edge.object,
            view: look.view,
            range_m: seen.range_m,
            slant_m: seen.values[3],
            by_object,
            by_pose,
            n: look.n,
            e,
            information,
        })
    }

    /// Objects and poses together; the poses move here, the steps of the objects are returned.
    #[expect(
        clippy::type_complexity,
        reason = "steps, and covariances where asked for"
    )]
    fn joint(
        &mut self,
        normal: Normal,
        moving: &[usize],
        marginals: bool,
    ) -> (Vec<[f64; 4]>, Option<(Vec<Square4>, Vec<Square6>)>) {
        let (n_objects, spacing) = (normal.information.len(), normal.spacing);
        let Some((system, (steps, turns))) = System::new(normal) else {
            return (vec![[0.0; 4]; n_objects], None);
        };
        let marginal = marginals.then(|| {
            let (objects, poses) = system.covariances();
            (
                objects.iter().map(from_matrix).collect(),
                poses.iter().step_by(spacing).map(from_matrix).collect(),
            )
        });
        self.turn(moving, &turns, spacing);
        (steps.iter().map(|s| (*s).into()).collect(), marginal)
    }

    /// Adds to the poses of views, and to their drifts where they have some.
    pub(super) fn turn(&mut self, moving: &[usize], turns: &[Vector6<f64>], spacing: usize) {
        for (p, &view) in moving.iter().enumerate() {
            let turn = &turns[p * spacing];
            if spacing == 2 {
                for (d, t) in self.drift[view].iter_mut().zip(turns[2 * p + 1].iter()) {
                    *d += t;
                }
            }
            let mut delta = self.delta[view];
            for (d, t) in delta.iter_mut().zip(turn.iter()) {
                *d += t;
            }
            self.set_delta(view, delta);
        }
    }

    /// Covariances of objects as others would see them from these edges, the errors of each pose
    /// independent: `C_k` of 3.4.
    pub(super) fn apart_cov(&self, part: &Part<'_>) -> Vec<Square4> {
        let mut information: Vec<Square4> = part
            .objects
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let mut a = self.prior(x).information;
                if let Some((folded, _)) = part.folded {
                    for (row, more) in a.iter_mut().zip(&folded[k]) {
                        for (x, m) in row.iter_mut().zip(more) {
                            *x += m;
                        }
                    }
                }
                a
            })
            .collect();
        for (edge, worth) in part.edges.iter().zip(part.worth) {
            let x = &part.objects[edge.object];
            if let Some((h, m, n, _, _)) = self.information_of(edge.look, x) {
                let weight = edge.weight * worth;
                add_information(&mut information[edge.object], &h, &m, n, weight);
            }
        }
        information.iter().map(inverse_or_zero).collect()
    }

    /// A detection's derivatives by the object and the information of its rows, its pose uncertain;
    /// with the residual and the variances of the reading.
    pub(super) fn information_of(
        &self,
        look: usize,
        x: &[f64; 4],
    ) -> Option<(Square4, Square4, usize, [f64; 4], ByPose)> {
        let detection = &self.looks[look];
        let seen = self.expect(detection.view, x)?;
        let (by_object, by_pose) = seen.of(detection);
        let spread = algebra::spread(&by_pose, &self.pose_cov[detection.view], detection.n);
        let noise = with_noise(&spread, &self.looseness[look], 1.0);
        let factor = Factor4::new(&noise, detection.n)?;
        let mut information = factor.inverse();
        for (r, row) in information.iter_mut().enumerate() {
            for (c, value) in row.iter_mut().enumerate() {
                if !(detection.has[r] && detection.has[c]) {
                    *value = 0.0;
                }
            }
        }
        let e = seen.residual(detection);
        Some((by_object, information, detection.n, e, by_pose))
    }

    /// Conditional covariances of poses, the objects known as other views know them.
    pub(super) fn update_pose_cov(&mut self) {
        let support = self.support();
        let mut information: Vec<Square6> = (0..self.n_views())
            .map(|view| {
                let prior = self.pose_information(view);
                let mut a = [[0.0; 6]; 6];
                for (i, row) in a.iter_mut().enumerate() {
                    row[i] = prior[i];
                }
                a
            })
            .collect();
        for edge in &self.edges {
            if support[edge.object] - edge.weight <= 0.3 {
                continue;
            }
            let look = &self.looks[edge.look];
            let Some(seen) = self.expect(look.view, &self.objects[edge.object]) else {
                continue;
            };
            let (by_object, by_pose) = seen.of(look);
            let spread = algebra::spread(&by_object, &self.object_cov[edge.object], look.n);
            let variances = &self.looseness[edge.look];
            let Some(factor) = Factor4::new(&with_noise(&spread, variances, 1.0), look.n) else {
                continue;
            };
            let trust = robust_weight(&seen.residual(look), variances, look.n_rows());
            let m = factor.inverse();
            add_information(
                &mut information[look.view],
                &by_pose,
                &m,
                look.n,
                edge.weight * trust,
            );
        }
        for (view, a) in information.iter().enumerate() {
            if let Some((cov, _)) = inverse6(a) {
                self.pose_cov[view] = cov;
            }
        }
    }

    /// What `of` makes of all objects, edges and views at this moment.
    pub(super) fn whole<T>(&mut self, of: impl FnOnce(&mut Self, Part<'_>) -> T) -> T {
        let edges = std::mem::take(&mut self.edges);
        let mut objects = std::mem::take(&mut self.objects);
        let views: Vec<(usize, usize)> = edges
            .iter()
            .map(|e| (e.object, self.looks[e.look].view))
            .collect();
        let worth = self.worth(&objects, &views, Repeats::Errors);
        let moving: Vec<usize> = (0..self.n_views()).collect();
        let part = Part {
            objects: &mut objects,
            edges: &edges,
            worth: &worth,
            moving: &moving,
            folded: None,
        };
        let made = of(self, part);
        self.edges = edges;
        self.objects = objects;
        made
    }

    /// Gauss-Newton steps of all objects and poses; with marginal covariances of the last if asked.
    pub(super) fn adjust(
        &mut self,
        steps: usize,
        robust: Robust,
        marginals: bool,
    ) -> Option<Stepped> {
        let mut last = None;
        for at in 0..steps {
            let asks = marginals && at + 1 == steps;
            let stepped = self.whole(|engine, part| engine.step(part, robust, asks));
            let still = stepped.move_m < 1e-5;
            self.object_cov.clone_from(&stepped.conditional);
            last = Some(stepped);
            if still && !marginals {
                break;
            }
        }
        if self.corrects_poses() {
            self.update_pose_cov();
        }
        last
    }
}

fn inverse_or_zero(a: &Square4) -> Square4 {
    inverse4(a).map_or([[0.0; 4]; 4], |(inverse, _)| inverse)
}
