//! A correction carried to another series of the same robot, only the base refitted: never worse than none.

use crate::desk::{Desk, table};
use calib::compensate::Arm;
use calib::effect::Load;
use calib::error::Result;
use calib::estimate::Model;
use calib::robot::{Instrument, RobotModel};
use calib::stage::ingest::{Ingest, IngestReads};
use calib::stage::split::{SplitBy, SplitReads};
use calib::stage::{
    Context, Diagnose, DiagnoseReads, Identify, IdentifyReads, Learn, LearnReads, LearnWrites, ReadRobot, RobotReads, Stage,
};
use calib::table::{Parameters, Prediction, Recording, Robot, Split};
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use std::path::Path;

/// One series, thinned, with the identified geometry and the correction learnt on top.
struct Series {
    robot: Robot,
    recording: Recording,
    split: Split,
    model: Model,
    learnt: LearnWrites,
    /// Mean and largest error of rows that were not trained on, mm, without and with the correction.
    own: [[f64; 2]; 2],
}

fn settings<S: Stage>(value: Value) -> S {
    serde_json::from_value(value).unwrap()
}

fn series(file: &str, every: usize) -> Result<Series> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let desk = Desk::default();
    let read = settings::<ReadRobot>(json!({"file": root.join("pipelines/ur10/robot.yaml")}));
    let robot: Robot = table(&desk.run(&read, RobotReads {})?).remove(0);
    let yaml = std::fs::read_to_string(root.join("pipelines/ur10/pipeline.yaml")).unwrap();
    let yaml: Value = serde_saphyr::from_str(&yaml).unwrap();
    let stage = yaml["stages"].as_array().unwrap().iter().find(|stage| stage["uses"] == "ingest").unwrap();
    let mut with = stage["with"].clone();
    with["files"][0]["file"] = json!(root.join("../shared/data/ipa_ur10").join(file));
    let whole: Recording = table(&desk.run(&settings::<Ingest>(with), IngestReads { robot: robot.clone() })?).remove(0);
    let kept: Vec<usize> = (0..whole.rows()).step_by(every).collect();
    let recording = Recording {
        sequence: kept.iter().map(|row| whole.sequence[*row]).collect(),
        point_id: kept.iter().map(|row| whole.point_id[*row].clone()).collect(),
        usage: vec![None; kept.len()],
        q: kept.iter().flat_map(|row| whole.q(*row).to_vec()).collect(),
        position: kept.iter().map(|row| whole.position[*row]).collect(),
        joints: whole.joints,
        prismatic: whole.prismatic.clone(),
        ..Recording::default()
    };
    // A stretch at the end is held out: neighbours of its rows were not seen.
    let by = settings::<SplitBy>(json!({"by": "blocks", "count": 4, "sets": ["fit", "fit", "fit", "validate"]}));
    let split: Split = table(&desk.run(&by, SplitReads { recording: recording.clone() })?).remove(0);
    let geometry = settings::<Identify>(json!({
        "effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry"], "folds": 0,
    }));
    let reads = IdentifyReads { robot: robot.clone(), recording: recording.clone(), split: split.clone() };
    let tables = desk.run(&geometry, reads)?;
    let parameters: Parameters = table(&tables).remove(0);
    let prediction: Prediction = table(&tables).remove(0);
    let learn = settings::<Learn>(json!({"on": ["fit"], "rivals": ["ridge", "gaussian_process", "curves"], "folds": 2}));
    let reads = LearnReads {
        robot: Some(robot.clone()),
        recording: recording.clone(),
        split: split.clone(),
        parameters: Some(parameters.clone()),
        prediction: prediction.clone(),
    };
    let learnt = learn.run(reads, &Context { id: "learn", seed: 5, jobs: 2, services: &desk })?;
    let of = |prediction: &Prediction| {
        let errors = || prediction.0.iter().filter(|row| row.set == "validate").map(|row| row.error_mm);
        [errors().sum::<f64>() / errors().count() as f64, errors().fold(0.0, f64::max)]
    };
    let own = [of(&prediction), of(&learnt.prediction)];
    let model = parameters.model(RobotModel::new(robot.to_description()?), &[], Load::GravityTorque)?;
    Ok(Series { robot, recording, split, model, learnt, own })
}

/// Mean and largest distance, mm, of points from where they were measured after the rigid motion that brings them there best.
fn after_base(points: &[Vector3<f64>], measured: &[[f64; 3]]) -> [f64; 2] {
    let count = points.len() as f64;
    let to: Vec<Vector3<f64>> = measured.iter().map(|p| Vector3::from(*p)).collect();
    let (a, b) = (points.iter().sum::<Vector3<f64>>() / count, to.iter().sum::<Vector3<f64>>() / count);
    let cross: Matrix3<f64> = points.iter().zip(&to).map(|(p, m)| (m - b) * (p - a).transpose()).sum();
    let svd = cross.svd(true, true);
    let (u, v) = (svd.u.unwrap(), svd.v_t.unwrap());
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant())) * v;
    let errors = || points.iter().zip(&to).map(|(p, m)| (turn * (p - a) + b - m).norm() * 1e3);
    [errors().sum::<f64>() / count, errors().fold(0.0, f64::max)]
}

/// Mean and largest error on the rows of `to`, mm, without and with what was learnt on `from`.
fn carried(from: &Series, to: &Series) -> [[f64; 2]; 2] {
    let plain = from.model.predict(&to.recording.measurements(&Instrument::default()));
    let correction = from.learnt.network.correction(&from.recording.prismatic).unwrap().expect("something was learnt");
    let corrected: Vec<Vector3<f64>> =
        plain.iter().enumerate().map(|(row, p)| p + Vector3::from(correction.at(to.recording.q(row)).delta)).collect();
    [after_base(&plain, &to.recording.position), after_base(&corrected, &to.recording.position)]
}

/// The arm with the causes that were found in a series; what belongs to that measurement alone is left behind.
fn diagnosed(series: &Series) -> Result<Arm> {
    let reads = DiagnoseReads { robot: series.robot.clone(), recording: series.recording.clone(), split: series.split.clone() };
    let tables = Desk::default().run(&settings::<Diagnose>(json!({})), reads)?;
    let parameters: Parameters = table(&tables).remove(0);
    Ok(Arm::new(parameters.model(RobotModel::new(series.robot.to_description()?), &[], Load::GravityTorque)?, None))
}

#[test]
fn between_two_series_of_a_real_robot_a_correction_is_never_worse_than_none() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/ipa_ur10");
    if !data.is_dir() {
        assert!(std::env::var_os("CI").is_none(), "nothing may be skipped in CI");
        return println!("skipped: {} is not here", data.display());
    }
    let a = series("Series_A/measurements_grid.csv", 16).unwrap();
    let c = series("Series_C/measurements_random_poses.csv", 3).unwrap();
    for (name, series) in [("A", &a), ("C", &c)] {
        let [before, after] = series.own;
        println!(
            "{name}, held-out stretch: mean {:.3} -> {:.3}, max {:.3} -> {:.3} mm",
            before[0], after[0], before[1], after[1]
        );
        assert!(after[0] < 0.6 * before[0], "{name}");
    }
    for (name, [before, after]) in [("A to C", carried(&a, &c)), ("C to A", carried(&c, &a))] {
        println!("{name}: {before:.3?} -> {after:.3?} mm");
        assert!(after[0] <= 1.001 * before[0], "{name}: {before:?} -> {after:?}");
    }
    // Named causes carry over from random poses to the grid: there is more in them than the points they were found in.
    let data = a.recording.measurements(&Instrument::default());
    let before = after_base(&c.model.predict(&data), &a.recording.position);
    let after = after_base(&diagnosed(&c).unwrap().model().predict(&data), &a.recording.position);
    println!("C to A, diagnosed: {before:.3?} -> {after:.3?} mm");
    assert!(after[0] < 0.8 * before[0] && after[1] < before[1], "{before:?} -> {after:?}");
}
