//! The stage `learn`: what it gains on the twin, what it refuses, and what it says.

use crate::answer::has;
use crate::desk::Desk;
use crate::recorded::{mean_mm_of, settings};
use crate::sr210d::{experiment, papers_sequence};
use calib::error::Result;
use calib::stage::{Context, Learn, LearnReads, LearnWrites, Stage};
use calib::table::{Prediction, PredictionRow, Recording, Split, SplitRow};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};

/// `rows` poses of a six-joint arm, the last third in set `check`; residuals of `signal` mm along smooth functions plus `noise` mm.
fn arm(rows: usize, signal: f64, noise: f64, seed: u64) -> (Recording, Split, Prediction) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut recording = Recording {
        joints: 6,
        prismatic: vec![false; 6],
        ..Recording::default()
    };
    let (mut split, mut prediction) = (Split::default(), Prediction::default());
    for (row, sequence) in (0..rows).zip(1..) {
        let q: Vec<f64> = (0..6).map(|_| rng.random_range(-1.2..1.2)).collect();
        let mut residual = [
            q[0].sin() * q[1].cos(),
            (2.0 * q[1]).sin(),
            q[2].cos() - q[4],
        ]
        .map(|value| signal * value);
        for value in &mut residual {
            *value += noise * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
        }
        let set = if 3 * row < 2 * rows { "fit" } else { "check" };
        let [dx_mm, dy_mm, dz_mm] = residual;
        recording.sequence.push(sequence);
        recording.point_id.push(sequence.to_string());
        recording.usage.push(None);
        recording.q.extend(q);
        recording.position.push([1.0; 3]);
        split.0.push(SplitRow {
            sequence,
            point_id: sequence.to_string(),
            set: set.into(),
        });
        prediction.0.push(PredictionRow {
            sequence,
            point_id: sequence.to_string(),
            set: set.into(),
            step: "geometry".into(),
            held_out: row % 5 != 0,
            suspect: false,
            x_mm: 1000.0 - dx_mm,
            y_mm: 1000.0 - dy_mm,
            z_mm: 1000.0 - dz_mm,
            dx_mm,
            dy_mm,
            dz_mm,
            error_mm: (dx_mm * dx_mm + dy_mm * dy_mm + dz_mm * dz_mm).sqrt(),
            noise_mm: 0.02,
            ..Default::default()
        });
    }
    (recording, split, prediction)
}

fn learn(
    settings_: Value,
    arm: &(Recording, Split, Prediction),
    jobs: usize,
    desk: &Desk,
) -> Result<LearnWrites> {
    let (recording, split, prediction) = arm.clone();
    let context = Context {
        id: "network",
        seed: 11,
        jobs,
        services: desk,
    };
    settings::<Learn>(settings_).run(
        LearnReads {
            recording,
            split,
            prediction,
        },
        &context,
    )
}

/// Settings that train in a moment.
fn quick() -> Value {
    json!({"rivals": ["mlp"], "starts": ["bso"], "beetles": 10, "generations": 10, "iterations": 80})
}

#[test]
fn on_the_twin_the_network_leaves_about_what_the_paper_s_leaves() {
    let mut ratios: Vec<f64> = (1..=3)
        .map(|seed| {
            let (recorded, _) = experiment("all", seed);
            let (_, prediction) = papers_sequence(&recorded);
            let before = (recorded.recording, recorded.split, prediction);
            let after = learn(
                json!({"on": ["learn"], "rivals": ["mlp"], "starts": ["bso"], "generations": 20}),
                &before,
                2,
                &Desk::default(),
            )
            .unwrap()
            .prediction;
            let ratio = |set| mean_mm_of(&after, set) / mean_mm_of(&before.2, set);
            println!(
                "seed {seed}: training {:.3}, held out {:.3}",
                ratio("learn"),
                ratio("check")
            );
            assert!(ratio("learn") < ratio("check"), "training rows flatter");
            ratio("check")
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    // The paper: 0.696. Far below it the twin would have a remainder made to be learnable.
    assert!((0.55..0.72).contains(&ratios[1]), "{ratios:?}");
}

#[test]
fn pure_noise_leaves_the_prediction_as_it_was_and_says_why() {
    for seed in 0..5 {
        let desk = Desk::default();
        let noise = arm(180, 0.0, 0.3, seed);
        let written = learn(quick(), &noise, 1, &desk).unwrap();
        assert!(written.network.0.is_empty() && written.training.0.is_empty());
        for (after, before) in written.prediction.0.iter().zip(&noise.2.0) {
            let held_out = before.held_out && before.set != "fit";
            assert_eq!(
                *after,
                PredictionRow {
                    step: "network".into(),
                    held_out,
                    ..before.clone()
                }
            );
        }
        let notes = desk.notes.lock().unwrap().join("\n");
        has(&notes, "no correction was kept; cross-validated error");
    }
}

#[test]
fn a_smooth_remainder_shrinks_on_rows_that_were_not_trained_on_with_any_number_of_threads() {
    let arm = arm(300, 0.5, 0.05, 2);
    let of_jobs = |jobs| learn(quick(), &arm, jobs, &Desk::default()).unwrap();
    let (one, written) = (of_jobs(1), of_jobs(2));
    assert!(!one.network.0.is_empty());
    assert_eq!(
        (one.network, &one.training, &one.prediction),
        (written.network, &written.training, &written.prediction)
    );
    let ratio = mean_mm_of(&written.prediction, "check") / mean_mm_of(&arm.2, "check");
    assert!((0.1..0.5).contains(&ratio), "{ratio}");
    for (after, before) in written.prediction.0.iter().zip(&arm.2.0) {
        assert_eq!(after.held_out, before.held_out && before.set == "check");
        // Predicted and left over still add up to what was measured.
        let measured = [
            (after.x_mm, after.dx_mm),
            (after.y_mm, after.dy_mm),
            (after.z_mm, after.dz_mm),
        ];
        assert!(
            measured
                .iter()
                .all(|(at, left)| (at + left - 1000.0).abs() < 1e-9)
        );
        let length = (after.dx_mm.powi(2) + after.dy_mm.powi(2) + after.dz_mm.powi(2)).sqrt();
        assert!((after.error_mm - length).abs() < 1e-12);
    }
    let course = &written.training.0;
    let phases = |phase: &str| course.iter().filter(|row| row.phase == phase).count();
    assert_eq!(phases("swarm"), 11);
    assert!(phases("gradient") > 20);
}

#[test]
fn gross_errors_are_not_learnt_and_rows_outside_the_range_are_left_alone() {
    let mut arm = arm(300, 0.5, 0.05, 3);
    arm.2.0[7].dx_mm = 40.0;
    arm.2.0[7].error_mm = 40.0;
    // A pose far from all others, in the set that is not trained on.
    arm.0.q[299 * 6] = 3.0;
    let desk = Desk::default();
    let after = learn(quick(), &arm, 1, &desk).unwrap().prediction;
    let ratio = mean_mm_of(&after, "check") / mean_mm_of(&arm.2, "check");
    assert!(ratio < 0.5, "{ratio}");
    assert_eq!(after.0[299].dx_mm, arm.2.0[299].dx_mm);
    let notes = desk.notes.lock().unwrap().join("\n");
    has(&notes, ["1 of 200 rows are not learnt from", "silent on 1"]);
}

#[test]
fn what_was_learnt_under_load_is_not_applied_without() {
    let mut arm = arm(300, 0.5, 0.05, 5);
    // Trained at 210 kg; of the other rows one is near that load, one empty, and one not known.
    let mut payload = vec![210.0; 300];
    (payload[297], payload[298], payload[299]) = (205.0, 0.0, f64::NAN);
    arm.0.payload = Some(payload);
    let after = learn(quick(), &arm, 1, &Desk::default())
        .unwrap()
        .prediction;
    let changed = |row: usize| after.0[row].dx_mm != arm.2.0[row].dx_mm;
    assert_eq!(
        [296, 297, 298, 299].map(changed),
        [true, true, false, false]
    );
}

#[test]
fn settings_and_sets_that_make_no_sense_are_named() {
    let faults = settings::<Learn>(
        json!({"on": [], "hidden": 0, "keep_back": 0.5, "folds": 1, "decay": -1.0}),
    )
    .check();
    let places: Vec<&str> = faults.iter().map(|fault| fault.place.as_str()).collect();
    assert_eq!(places, ["on", "hidden", "folds", "keep_back", "decay"]);
    assert!(settings::<Learn>(quick()).check().is_empty());

    let arm = arm(40, 0.5, 0.05, 4);
    let desk = Desk::default();
    let message_of = |with| learn(with, &arm, 1, &desk).err().unwrap().to_string();
    has(
        &message_of(json!({"on": ["training"]})),
        ["`training`", "check, fit"],
    );
    has(&message_of(json!({"payload": true})), "with.payload");
    let written = learn(quick(), &arm, 1, &desk).unwrap();
    assert!(written.network.0.is_empty());
    has(
        &desk.warnings.lock().unwrap()[0],
        "only 27 rows to learn from",
    );
}
