//! The paper's experiment on the twin, stage by stage from the settings of `pipelines/sr210d`.

use crate::recorded::{Example, Made, Recorded, made, mean_mm_of};
use calib::stage::{Identify, Stiffness, StiffnessReads};
use calib::table::{Parameters, Prediction, PredictionRow, Truth};
use serde_json::json;

/// The pipeline, with the variable `remainder` put in.
pub fn example(remainder: &str) -> Example {
    Example::new("sr210d", &[("remainder", remainder)])
}

pub fn experiment(remainder: &str, seed: u64) -> (Recorded, Truth) {
    example(remainder).simulated(json!({"seed": seed}))
}

fn identified(recorded: &Recorded, id: &str, remainder: &str) -> Made {
    recorded
        .identify_by(&example(remainder).with::<Identify>(id))
        .unwrap()
}

/// What the paper's second step makes of its first one.
fn stiffness(recorded: &Recorded, geometry: &Made) -> Prediction {
    let stage: Stiffness = example("all").with("stiffness");
    let recorded = recorded.clone();
    let reads = StiffnessReads {
        robot: recorded.robot,
        recording: recorded.recording,
        split: recorded.split,
        parameters: geometry.get(),
        covariance: None,
        prediction: geometry.get(),
    };
    made(&stage, reads).get()
}

/// The paper's first two steps: after the unloaded fit, after the stiffness.
pub fn papers_sequence(recorded: &Recorded) -> (Prediction, Prediction) {
    let geometry = identified(recorded, "geometry", "all");
    (geometry.get(), stiffness(recorded, &geometry))
}

/// Tables 5, 7 and 9 of Wang et al. (2020), mean position error in mm, within 20 % either way whatever the seed.
#[test]
fn the_papers_own_sequence_ends_at_the_papers_figures() {
    for seed in [1, 2, 3] {
        let (geometry, stiffness) = papers_sequence(&experiment("all", seed).0);
        for (what, prediction, set, paper) in [
            (
                "other unloaded points after geometry",
                &geometry,
                "unloaded_check",
                0.3008,
            ),
            ("210 kg before stiffness", &geometry, "loaded", 7.0261),
            ("210 kg after stiffness", &stiffness, "loaded", 0.9847),
            ("200 points before the network", &stiffness, "learn", 0.9262),
            (
                "200 other points before the network",
                &stiffness,
                "check",
                0.9370,
            ),
        ] {
            let ratio = mean_mm_of(prediction, set) / paper;
            assert!(
                (0.8..=1.2).contains(&ratio),
                "{what}, seed {seed}: {ratio:.3} times the paper's {paper} mm"
            );
        }
    }
}

#[test]
fn identifying_everything_at_once_beats_the_sequence_on_points_neither_has_seen() {
    let (experiment, _) = experiment("all", 1);
    let (_, sequence) = papers_sequence(&experiment);
    let joint = identified(&experiment, "joint", "all").get();
    for (set, at_most) in [("check", 0.75), ("unloaded_check", 0.5)] {
        let share = mean_mm_of(&joint, set) / mean_mm_of(&sequence, set);
        assert!(
            (0.05..at_most).contains(&share),
            "{set}: {share} of what the sequence leaves"
        );
    }
}

#[test]
fn without_the_remainder_every_true_parameter_comes_back_and_nothing_but_noise_is_left() {
    let (experiment, truth) = experiment("none", 1);
    let joint = identified(&experiment, "joint", "none");
    let mut compared = 0;
    for row in &joint.get::<Parameters>().0 {
        let truth = truth.0.iter().find(|truth| truth.name == row.name);
        if let (Some(sigma), Some(truth)) = (row.sigma, truth) {
            assert_eq!(truth.unit, row.unit, "{}", row.name);
            let off = (row.value - truth.value) / sigma;
            assert!(
                off.abs() <= 3.0,
                "{}: {} is {off} sigma from {}",
                row.name,
                row.value,
                truth.value
            );
            compared += 1;
        }
    }
    // 28 of geometry without the base, 6 ratios, 1 coupling, 6 compliances.
    assert_eq!(compared, 41);
    let prediction: Prediction = joint.get();
    for set in ["unloaded_check", "check"] {
        let rows: Vec<_> = prediction.0.iter().filter(|row| row.set == set).collect();
        let rms = |value: &dyn Fn(&&PredictionRow) -> f64| {
            (rows.iter().map(|row| value(row).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
        };
        let ratio = rms(&|row| row.error_mm) / rms(&|row| row.noise_mm);
        // Currents carry 20 mA of noise, worth a few um; 50 points scatter by 6 %.
        assert!(
            (0.85..1.2).contains(&ratio),
            "{set}: {ratio} times the tracker's noise"
        );
    }
}

/// The paper's ratios differ from quotients of tooth counts by up to 13e-4: a part of them is the arm's own weight.
#[test]
fn where_gears_are_exact_and_only_the_arms_weight_bends_it_ratios_are_not_believed() {
    let example = example("none");
    let mut truth: serde_json::Value = example.with("simulate");
    let mut truth = truth["truth"].take();
    truth["ratio"] = json!([1, 1, 1, 1, 1, 1]);
    truth["couplings"] = json!([]);
    for seed in [1, 2, 3] {
        let (recorded, _) = example.simulated(json!({"truth": truth, "seed": seed}));
        let warned = identified(&recorded, "geometry", "none").warnings;
        assert!(
            warned.contains("the data favour compliance"),
            "seed {seed}: {warned}"
        );
    }
}
