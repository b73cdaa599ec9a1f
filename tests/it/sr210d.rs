//! The paper's experiment on the twin, stage by stage from the settings of `pipelines/sr210d`.

use crate::answer::{read, root};
use crate::desk::{Desk, identify_reads, table};
use calib::stage::{Identify, ReadRobot, RobotReads, Simulate, SimulateReads};
use calib::stage::{Stiffness, StiffnessReads};
use calib::table::{Parameters, Prediction, Recording, Robot, Split, SplitRow, Truth};
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::path::PathBuf;

fn folder() -> PathBuf {
    root("pipelines/sr210d")
}

/// The settings of a stage of the pipeline, with the variable `remainder` put in.
pub fn settings<T: DeserializeOwned>(id: &str, remainder: &str) -> T {
    let text = read(folder().join("pipeline.yaml"));
    let whole: Value = serde_saphyr::from_str(&text.replace("${remainder}", remainder)).unwrap();
    let stages = whole["stages"].as_array().unwrap();
    let stage = stages
        .iter()
        .find(|stage| stage["id"] == id || (stage["id"].is_null() && stage["uses"] == id));
    serde_json::from_value(stage.unwrap()["with"].clone()).unwrap()
}

pub struct Experiment {
    pub robot: Robot,
    pub recording: Recording,
    pub truth: Truth,
    pub split: Split,
}

pub fn experiment(remainder: &str, seed: u64) -> Experiment {
    experiment_on(Simulate {
        seed: Some(seed),
        ..settings("simulate", remainder)
    })
}

fn experiment_on(twin: Simulate) -> Experiment {
    let desk = Desk::default();
    let mut robot: ReadRobot = settings("robot", "none");
    robot.file.0 = folder().join(&robot.file.0);
    let robot: Robot = table(&desk.run(&robot, RobotReads {}).unwrap()).remove(0);
    let tables = desk
        .run(
            &twin,
            SimulateReads {
                robot: robot.clone(),
            },
        )
        .unwrap();
    let recording: Recording = table(&tables).remove(0);
    let rows = recording
        .sequence
        .iter()
        .zip(&recording.point_id)
        .zip(&recording.usage);
    let rows = rows.map(|((sequence, id), set)| SplitRow {
        sequence: *sequence,
        point_id: id.clone(),
        set: set.clone().unwrap(),
    });
    let split = Split(rows.collect());
    Experiment {
        robot,
        truth: table(&tables).remove(0),
        recording,
        split,
    }
}

fn mean_mm(prediction: &Prediction, set: &str) -> f64 {
    let errors: Vec<f64> = prediction
        .0
        .iter()
        .filter(|row| row.set == set)
        .map(|row| row.error_mm)
        .collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn identified(of: &Experiment, id: &str, remainder: &str) -> (Parameters, Prediction) {
    let stage: Identify = settings(id, remainder);
    let Experiment {
        robot,
        recording,
        split,
        ..
    } = of;
    let tables = Desk::default()
        .run(
            &stage,
            identify_reads(robot.clone(), recording.clone(), split.clone()),
        )
        .unwrap();
    (table(&tables).remove(0), table(&tables).remove(0))
}

/// The paper's first two steps: after the unloaded fit, after the stiffness.
fn papers_sequence(of: &Experiment, remainder: &str) -> (Prediction, Prediction) {
    let (parameters, prediction) = identified(of, "geometry", remainder);
    let stage: Stiffness = settings("stiffness", remainder);
    let Experiment {
        robot,
        recording,
        split,
        ..
    } = of;
    let (robot, recording, split) = (robot.clone(), recording.clone(), split.clone());
    let reads = StiffnessReads {
        robot,
        recording,
        split,
        parameters,
        covariance: None,
        prediction: prediction.clone(),
    };
    (
        prediction,
        table(&Desk::default().run(&stage, reads).unwrap()).remove(0),
    )
}

/// Tables 5, 7 and 9 of Wang et al. (2020), mean position error in mm, within 20 % either way whatever the seed.
#[test]
fn the_papers_own_sequence_ends_at_the_papers_figures() {
    for seed in [1, 2, 3] {
        let experiment = experiment("all", seed);
        let (geometry, stiffness) = papers_sequence(&experiment, "all");
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
            let ratio = mean_mm(prediction, set) / paper;
            assert!(
                (0.8..=1.2).contains(&ratio),
                "{what}, seed {seed}: {ratio:.3} times the paper's {paper} mm"
            );
        }
    }
}

#[test]
fn identifying_everything_at_once_beats_the_sequence_on_points_neither_has_seen() {
    let experiment = experiment("all", 1);
    let (_, sequence) = papers_sequence(&experiment, "all");
    let (_, joint) = identified(&experiment, "joint", "all");
    for (set, at_most) in [("check", 0.75), ("unloaded_check", 0.5)] {
        let share = mean_mm(&joint, set) / mean_mm(&sequence, set);
        assert!(
            (0.05..at_most).contains(&share),
            "{set}: {share} of what the sequence leaves"
        );
    }
}

#[test]
fn without_the_remainder_every_true_parameter_comes_back_and_nothing_but_noise_is_left() {
    let experiment = experiment("none", 1);
    let (parameters, prediction) = identified(&experiment, "joint", "none");
    let mut compared = 0;
    for row in &parameters.0 {
        let truth = experiment
            .truth
            .0
            .iter()
            .find(|truth| truth.name == row.name);
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
    // 27 of geometry without the six of the base, 6 ratios, 1 coupling, 6 compliances.
    assert_eq!(compared, 34);
    for set in ["unloaded_check", "check"] {
        let rows: Vec<_> = prediction.0.iter().filter(|row| row.set == set).collect();
        let rms = |value: &dyn Fn(&&calib::table::PredictionRow) -> f64| {
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
    for seed in [1, 2, 3] {
        let mut twin: Value = settings("simulate", "none");
        twin["truth"]["ratio"] = serde_json::json!([1, 1, 1, 1, 1, 1]);
        twin["truth"]["couplings"] = serde_json::json!([]);
        twin["seed"] = seed.into();
        let of = experiment_on(serde_json::from_value(twin).unwrap());
        let desk = Desk::default();
        desk.run(
            &settings::<Identify>("geometry", "none"),
            identify_reads(of.robot, of.recording, of.split),
        )
        .unwrap();
        let warned = desk.warnings.lock().unwrap().join("\n");
        assert!(
            warned.contains("the data favour compliance"),
            "seed {seed}: {warned}"
        );
    }
}
