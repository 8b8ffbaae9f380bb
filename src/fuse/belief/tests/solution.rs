//! Registration, the joint solution and its covariances.

use serde_json::Value;

use super::recorded::{
    assert_close, assert_delta, assert_matrix, index, list, number, numbers, square4,
};
use super::{both, of_edges, unknowns};
use crate::fuse::Exclusive;
use crate::fuse::belief::PoseCorrection;
use crate::fuse::belief::engine::Engine;
use crate::fuse::belief::looks::Repeats;
use crate::fuse::belief::near::Buckets;
use crate::fuse::belief::pairs::Candidates;
use crate::fuse::belief::solve::{Part, Robust, Stepped};

/// All objects, which exist with the given probabilities.
fn among<'a>(engine: &'a Engine<'_>, near: &'a Buckets, exist: &'a [f64]) -> Candidates<'a> {
    Candidates {
        objects: &engine.objects,
        cov: &engine.object_cov,
        classes: &engine.classes,
        given: crate::fuse::belief::classes::Given::NONE,
        exist,
        near,
    }
}

#[test]
fn exclusive_association() {
    for recorded in both() {
        let engine = recorded.engine();
        let near = Buckets::over(engine.bucket_m(), engine.objects.iter());
        let exist = vec![0.9; engine.objects.len()];
        let step = recorded.step("association");
        let view = index(&step["view"]);
        let objects = among(&engine, &near, &exist);
        let found = engine.expectation_of(view, &objects, &engine.pose_cov[view]);
        let mut exclusive = Exclusive::new();
        let p = engine.associate_view(view, &found, &mut exclusive);
        assert_close("by the usual rounds", &p, &step["rounds"], 1e-8);
        exclusive.max_iterations = 5000;
        exclusive.tolerance = 0.0;
        let p = engine.associate_view(view, &found, &mut exclusive);
        assert_close("settled", &p, &step["p"], 1e-8);
    }
}

#[test]
fn registration_of_one_view() {
    for recorded in both() {
        for step in list(recorded.step("registration")) {
            let state = recorded.engine();
            let mut engine = state.clone();
            let near = Buckets::over(state.bucket_m(), state.objects.iter());
            let exist = vec![0.9; state.objects.len()];
            let (view, scale) = (index(&step["view"]), number(&step["scale"]));
            let prior = engine
                .pose_prior(view)
                .map(|row| row.map(|x| x * scale * scale));
            let objects = among(&state, &near, &exist);
            let found = engine.register(view, &objects, &prior, &mut Exclusive::new());
            assert_close("score", &[found.score], &step["score"], 1e-6);
            let sigma = &engine.platforms[view].sigma;
            let delta = Value::Array(vec![step["delta"].clone()]);
            assert_delta("error", &[found.delta], &delta, sigma, 1e-6);
            assert_matrix("posterior", &found.cov, &step["cov"], 1e-6);
            assert_eq!(engine.delta, state.delta, "registration changes nothing");
        }
    }
}

/// One Gauss-Newton step of the recorded kind, and the objects after it.
fn stepped(engine: &mut Engine<'_>, step: &Value) -> (Stepped, Vec<[f64; 4]>) {
    let worth = engine.worth(&engine.objects, &of_edges(engine), Repeats::Errors);
    let edges = engine.edges.clone();
    let mut objects = engine.objects.clone();
    let moving: Vec<usize> = list(&step["moving"]).iter().map(index).collect();
    let folded = &step["folded"];
    let information = folded["information"].as_array().map(|all| {
        let all = all.iter().map(|m| square4(m, 0.0));
        all.collect::<Vec<_>>()
    });
    let toward = folded["toward"].as_array().map(|all| {
        let padded = |b: &Value| {
            let mut out = [0.0; 4];
            let b = numbers(b);
            out[..b.len()].copy_from_slice(&b);
            out
        };
        all.iter().map(padded).collect::<Vec<_>>()
    });
    let part = Part {
        objects: &mut objects,
        edges: &edges,
        worth: &worth,
        moving: &moving,
        folded: information.as_deref().zip(toward.as_deref()),
    };
    let robust = step["scale2"]
        .as_f64()
        .map_or(Robust::Contaminated, Robust::Scale);
    (engine.step(part, robust, true), objects)
}

/// Marginal covariances were recorded as blocks of the inverse of the whole normal matrix.
#[test]
fn one_step_of_the_joint_solution() {
    for recorded in both() {
        for step in list(recorded.step("joint")) {
            let mut engine = recorded.engine();
            let (found, objects) = stepped(&mut engine, step);
            assert_close("moves", &[found.move_m], &step["move_m"], 1e-6);
            assert_close(
                "objects",
                &unknowns(&recorded, &objects),
                &step["objects"],
                1e-7,
            );
            let sigma = engine.platforms[0].sigma;
            assert_delta("poses", &engine.delta, &step["delta"], &sigma, 1e-6);
            for (cov, known) in found.conditional.iter().zip(list(&step["conditional"])) {
                assert_matrix("conditional", cov, known, 1e-6);
            }
            let (of_objects, of_poses) = found.marginal.unwrap();
            for (cov, known) in of_objects.iter().zip(list(&step["marginal"])) {
                assert_matrix("marginal", cov, known, 1e-6);
            }
            assert_eq!(of_poses.len(), list(&step["pose_marginal"]).len());
            for (cov, known) in of_poses.iter().zip(list(&step["pose_marginal"])) {
                assert_matrix("marginal of a pose", cov, known, 1e-6);
            }
        }
    }
}

#[test]
fn a_step_that_holds_the_poses() {
    for recorded in both() {
        let mut settings = recorded.settings.clone();
        settings.pose_correction = PoseCorrection::Off;
        let mut engine = recorded.engine();
        engine.settings = &settings;
        for view in 0..engine.n_views() {
            // Errors that are not corrected are as large as was stated.
            engine.pose_cov[view] = engine.platforms[view].prior(&[1.0; 6]);
        }
        let step = recorded.step("without_poses");
        let worth = engine.worth(&engine.objects, &of_edges(&engine), Repeats::Errors);
        let (edges, mut objects) = (engine.edges.clone(), engine.objects.clone());
        let part = Part {
            objects: &mut objects,
            edges: &edges,
            worth: &worth,
            moving: &[],
            folded: None,
        };
        let found = engine.step(part, Robust::Contaminated, false);
        assert_close("moves", &[found.move_m], &step["move_m"], 1e-6);
        assert_close(
            "objects",
            &unknowns(&recorded, &objects),
            &step["objects"],
            1e-7,
        );
        for (cov, known) in found.conditional.iter().zip(list(&step["conditional"])) {
            assert_matrix("conditional", cov, known, 1e-6);
        }
    }
}

#[test]
fn covariances_with_independent_poses() {
    for recorded in both() {
        let engine = recorded.engine();
        let worth = engine.worth(&engine.objects, &of_edges(&engine), Repeats::Errors);
        let mut objects = engine.objects.clone();
        let cov = engine.apart_cov(&Part {
            objects: &mut objects,
            edges: &engine.edges,
            worth: &worth,
            moving: &[],
            folded: None,
        });
        for (cov, known) in cov.iter().zip(list(recorded.step("apart_cov"))) {
            assert_matrix("covariance", cov, known, 1e-6);
        }
    }
}

#[test]
fn an_adjustment_and_what_it_leaves_of_the_poses() {
    for recorded in both() {
        let mut engine = recorded.engine();
        engine.adjust(1, Robust::Contaminated, false).unwrap();
        let step = recorded.step("adjust");
        assert_close(
            "objects",
            &unknowns(&recorded, &engine.objects),
            &step["objects"],
            1e-7,
        );
        let sigma = engine.platforms[0].sigma;
        assert_delta("poses", &engine.delta, &step["delta"], &sigma, 1e-6);
        for (cov, known) in engine.pose_cov.iter().zip(list(&step["pose_cov"])) {
            assert_matrix("conditional of a pose", cov, known, 1e-6);
        }
    }
}
