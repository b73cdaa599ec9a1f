//! A correction carried to another series of the same robot, only the base refitted: never worse than none.

use crate::answer::{calib, has, put, root};
use crate::desk::{Desk, shared, table};
use crate::recorded::{Example, Made, Recorded, made, mean_mm, mean_mm_of, rows_of, settings};
use crate::sr210d;
use calib::effect::Load;
use calib::error::Result;
use calib::estimate::Model;
use calib::estimate::network::Correction;
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::stage::split::SplitReads;
use calib::stage::{Learn, LearnReads};
use calib::table::{Network, Parameters, Prediction};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};

/// One series, thinned, with the identified geometry and the correction learnt on top.
struct Series {
    recorded: Recorded,
    model: Model,
    geometry: Parameters,
    correction: Correction,
    /// Mean and largest error of rows that were not trained on, mm, without and with the correction.
    errors_before: [[f64; 2]; 2],
}

fn series(file: &str, every: usize) -> Result<Series> {
    let example = Example::new("ur10", &[]);
    let mut ingest: Value = example.with("ingest");
    ingest["files"][0]["file"] = json!(shared("data/ipa_ur10").unwrap().join(file));
    let mut recorded = example.ingested_by(&settings(ingest), &example.with("split"));
    let kept: Vec<usize> = (0..recorded.recording.rows()).step_by(every).collect();
    recorded.recording = rows_of(&recorded.recording, &kept);
    // A stretch at the end is held out: neighbours of its rows were not seen.
    let by = settings::<calib::stage::split::SplitBy>(
        json!({"by": "blocks", "count": 4, "sets": ["fit", "fit", "fit", "validate"]}),
    );
    let recording = recorded.recording.clone();
    recorded.split = made(&by, SplitReads { recording }).get();
    let found = recorded.identify(json!({
        "effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry"], "folds": 0,
    }));
    let geometry: Parameters = found.get();
    let learn: Learn =
        settings(json!({"on": ["fit"], "rivals": ["ridge", "gaussian_process"], "folds": 2}));
    let Recorded {
        recording, split, ..
    } = recorded.clone();
    let reads = LearnReads {
        recording,
        split,
        prediction: found.get(),
    };
    let mut desk = Desk::default();
    (desk.seed, desk.jobs) = (5, 2);
    let tables = desk.run(&learn, reads)?;
    let errors = |prediction: &Prediction| {
        let held = prediction.0.iter().filter(|row| row.set == "validate");
        let largest = held.map(|row| row.error_mm).fold(0.0, f64::max);
        [mean_mm_of(prediction, "validate"), largest]
    };
    let ours = [errors(&found.get()), errors(&table(&tables).remove(0))];
    let network: Network = table(&tables).remove(0);
    let robot = RobotModel::new(recorded.robot.to_description()?);
    Ok(Series {
        model: geometry.model(robot, &[], Load::GravityTorque)?,
        correction: network.correction(&recorded.recording.prismatic)?.unwrap(),
        recorded,
        geometry,
        errors_before: ours,
    })
}

/// Mean and largest distance, mm, of points from where they were measured after the rigid motion that brings them there best.
fn after_base(points: &[Vector3<f64>], measured: &[[f64; 3]]) -> [f64; 2] {
    let count = points.len() as f64;
    let to: Vec<Vector3<f64>> = measured.iter().map(|p| Vector3::from(*p)).collect();
    let (a, b) = (
        points.iter().sum::<Vector3<f64>>() / count,
        to.iter().sum::<Vector3<f64>>() / count,
    );
    let cross: Matrix3<f64> = points
        .iter()
        .zip(&to)
        .map(|(p, m)| (m - b) * (p - a).transpose())
        .sum();
    let svd = cross.svd(true, true);
    let (u, v) = (svd.u.unwrap(), svd.v_t.unwrap());
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant())) * v;
    let errors = || {
        points
            .iter()
            .zip(&to)
            .map(|(p, m)| (turn * (p - a) + b - m).norm() * 1e3)
    };
    [errors().sum::<f64>() / count, errors().fold(0.0, f64::max)]
}

/// Mean and largest error on the rows of `to`, mm, without and with what was learnt on `from`.
fn carried(from: &Series, to: &Series) -> [[f64; 2]; 2] {
    let recording = &to.recorded.recording;
    let plain = from.model.predict(&recording.measurements());
    let corrected: Vec<Vector3<f64>> = plain
        .iter()
        .enumerate()
        .map(|(row, p)| p + Vector3::from(from.correction.at(recording.q(row)).delta))
        .collect();
    [
        after_base(&plain, &recording.position),
        after_base(&corrected, &recording.position),
    ]
}

/// Mean error on the rows of `to`, and that which one of a hundred exceeds, mm, of a model identified on another series.
fn transferred(parameters: &Parameters, to: &Series) -> [f64; 2] {
    let with = json!({"on": ["fit", "validate"], "screen": false, "folds": 0});
    let prediction: Prediction = to.recorded.carry(with, parameters, &[], &[]).get();
    let mut errors: Vec<f64> = prediction.0.iter().map(|row| row.error_mm).collect();
    errors.sort_by(f64::total_cmp);
    // The largest of a thousand errors is that of one row.
    let of_a_hundred = errors[errors.len() * 99 / 100];
    println!("largest {:.3?} mm", errors.last());
    [mean_mm(&prediction, |_| true), of_a_hundred]
}

#[test]
fn between_two_series_of_a_real_robot_a_correction_is_never_worse_than_none() {
    let Some(_) = shared("data/ipa_ur10") else {
        return;
    };
    let (a, c) = rayon::join(
        || series("Series_A/measurements_grid.csv", 24).unwrap(),
        || series("Series_C/measurements_random_poses.csv", 5).unwrap(),
    );
    for (name, series) in [("A", &a), ("C", &c)] {
        let [before, after] = series.errors_before;
        println!(
            "{name}, held-out stretch: mean {:.3} -> {:.3}, max {:.3} -> {:.3} mm",
            before[0], after[0], before[1], after[1]
        );
        assert!(after[0] < 0.8 * before[0], "{name}");
    }
    for (name, [before, after]) in [("A to C", carried(&a, &c)), ("C to A", carried(&c, &a))] {
        println!("{name}: {before:.3?} -> {after:.3?} mm");
        assert!(
            after[0] <= 1.001 * before[0],
            "{name}: {before:?} -> {after:?}"
        );
    }
    // Named causes carry over between random poses and the grid: there is more in them than the points they were found in.
    let ways = [("A to C", &a, &c), ("C to A", &c, &a)];
    let errors = |(_, from, to): &(_, &Series, &Series)| {
        (
            transferred(&from.geometry, to),
            transferred(&from.recorded.diagnose(json!({})).get(), to),
        )
    };
    let found: Vec<([f64; 2], [f64; 2])> = ways.par_iter().map(errors).collect();
    for ((name, ..), (before, after)) in ways.into_iter().zip(found) {
        println!("{name}, diagnosed: {before:.3?} -> {after:.3?} mm");
        assert!(
            // The largest hangs on a single point.
            after[0] < before[0] && after[1] < 1.05 * before[1],
            "{name}: {before:?} -> {after:?}"
        );
    }
}

/// The twin of `pipelines/sr210d` without what the paper's model does not have.
fn measured(seed: u64) -> Recorded {
    let blocks = json!([{"usage": "fit", "points": 60}, {"usage": "check", "points": 60}]);
    let change = json!({"seed": seed, "blocks": blocks});
    sr210d::example("none").simulated(change).0
}

#[test]
fn a_model_holds_on_a_later_recording_from_where_the_tracker_stands_then() {
    let effects = [
        "base_frame",
        "tool_offset",
        "joint_offset",
        "link_geometry",
        "reduction_ratio",
        "coupling_ratio",
    ];
    let found = measured(1).identify(json!({"effects": effects, "folds": 0}));
    let parameters: Parameters = found.get();
    let unseen = |made: &Made| mean_mm_of(&made.get(), "check");
    let ours = unseen(&found);
    let mut later = measured(2);
    let moved =
        Pose::from_rotation_vector(Vector3::new(0.02, -0.01, 2.0), Vector3::new(3.0, -1.5, 0.2));
    for position in &mut later.recording.position {
        *position = moved.point(&Vector3::from(*position)).into();
    }
    let carried = later.carry(json!({"folds": 0}), &parameters, &[], &[]);
    let mean = unseen(&carried);
    assert!(
        mean < 1.2 * ours,
        "{mean} mm, {ours} mm in the recording it was identified by"
    );
    let carried: Parameters = carried.get();
    for (before, after) in parameters.0.iter().zip(&carried.0) {
        let base = before.effect == "base_frame";
        assert_eq!(before.name, after.name);
        assert_eq!(
            before.value == after.value,
            !base || before.status == "redundant",
            "{}",
            before.name
        );
        assert!(
            !base || after.status == "free",
            "{}: {}",
            after.name,
            after.status
        );
    }
}

/// With its windings other than they are.
fn wound(parameters: &Parameters, change: impl Fn(f64) -> f64) -> Parameters {
    let mut out = parameters.clone();
    let compliance = out
        .0
        .iter_mut()
        .filter(|row| row.effect == "joint_compliance");
    compliance.for_each(|row| row.value = change(row.value));
    out
}

#[test]
fn a_carried_model_says_that_its_geometry_alone_is_better() {
    let recorded = measured(3);
    let parameters: Parameters = recorded.identify(json!({"folds": 0})).get();
    // Where the first joint stood on its negative side, as if nothing else had been measured.
    let there: Vec<usize> = (0..recorded.recording.rows())
        .filter(|row| recorded.recording.q(*row)[0] < 0.0)
        .collect();
    let earlier = rows_of(&recorded.recording, &there);
    let carry = |parameters: &Parameters| {
        let recordings = [("ingest", &earlier), ("later", &recorded.recording)];
        recorded.carry(json!({"folds": 0}), parameters, &recordings, &[])
    };
    let worse = "what was identified besides it does not hold here";
    let right = carry(&parameters);
    assert!(!right.warnings.contains(worse), "{}", right.warnings);
    // How certain its correction is nobody knows without a covariance.
    let prediction: Prediction = right.get();
    assert!(
        prediction.0.iter().all(|row| row.remark.is_none()),
        "{:?}",
        prediction.0[0].remark
    );
    has(&carry(&wound(&parameters, |_| 3e-6)).warnings, worse);
}

fn of_joints(made: &Made) -> usize {
    let parameters: Parameters = made.get();
    let mut effects = parameters.0.iter().map(|row| &row.effect);
    effects
        .by_ref()
        .filter(|effect| *effect == "joint_compliance")
        .count()
}

#[test]
fn findings_that_make_another_recording_worse_than_geometry_alone_are_not_used_there() {
    let (here, there) = (measured(4), measured(5));
    let mut effects = vec![
        "base_frame",
        "tool_offset",
        "joint_offset",
        "link_geometry",
        "reduction_ratio",
    ];
    let geometry = here.identify(json!({"effects": effects, "folds": 0}));
    effects.push("joint_compliance");
    let found = here.identify(json!({"effects": effects, "folds": 0}));
    // The model, and its geometry that was identified by itself, both with what they predict here.
    let carry = |parameters: &Parameters, separate: bool| {
        let recordings = [("here", &here.recording), ("there", &there.recording)];
        let models = [
            ("geometry", geometry.get(), geometry.get()),
            ("found", parameters.clone(), found.get()),
        ];
        let models = &models[usize::from(!separate)..];
        there.carry(json!({"folds": 0}), parameters, &recordings, models)
    };
    let held = carry(&found.get(), true);
    assert!(!held.warnings.contains("not used"), "{}", held.warnings);
    has(&held.notes, ["the geometry alone", "visited cells"]);
    assert_eq!(of_joints(&held), of_joints(&found));
    // Too much wind-up: still better than the geometry without it, which left room for it, and worse than geometry found by itself.
    let wrong = wound(&found.get(), |value| 1.8 * value);
    let mean = |carried: &Made| mean_mm(&carried.get(), |row| row.held_out);
    let alone = carry(&geometry.get(), false);
    for separate in [true, false] {
        let carried = carry(&wrong, separate);
        has(
            &carried.warnings,
            [
                "does not hold here and is not used",
                "mean",
                "largest",
                "visited cells",
                "unvisited",
            ],
        );
        assert_eq!(of_joints(&carried), 0);
        let apart = mean(&carried) / mean(&alone);
        assert!(
            (0.98..1.02).contains(&apart),
            "{separate}: {} mm, {} mm",
            mean(&carried),
            mean(&alone)
        );
    }
}

#[test]
fn the_closing_lines_state_the_carried_figure() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(
        root("pipelines/sr210d/robot.yaml"),
        folder.path().join("robot.yaml"),
    )
    .unwrap();
    let simulate = |id: &str, seed: u64| {
        format!(
            "  - id: {id}\n    uses: simulate\n    with:\n      truth: {{offset_deg: [0.1, 0.2, -0.1, 0.1, 0.1, 0]}}\n      \
             poses: {{range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}}\n      \
             blocks: [{{usage: fit, points: 40}}, {{usage: check, points: 30}}]\n      seed: {seed}\n"
        )
    };
    let split = |id: &str, subject: &str| {
        format!(
            "  - id: {id}\n    uses: split\n    reads: {{recording: {subject}}}\n    with: {{by: usage}}\n"
        )
    };
    let pipeline = format!(
        "calib: 1\nname: carried\nseed: 1\nstages:\n  - uses: robot\n    with: {{file: robot.yaml}}\n{}{}  - id: found\n    uses: \
         diagnose\n    reads: {{recording: here, split: fitted}}\n{}{}  \
         - id: carried\n    uses: transfer\n    reads: {{recording: there, split: placed, parameters: found, covariance: \
         found}}\n  - uses: validate\n  - uses: report\n",
        simulate("here", 1),
        split("fitted", "here"),
        simulate("there", 2),
        split("placed", "there")
    );
    put(folder.path(), "p.yaml", pipeline);
    let printed = calib(folder.path(), "run p.yaml --quiet").ok();
    let carried = printed
        .lines()
        .find(|line| line.starts_with("carried"))
        .unwrap_or_default();
    assert!(
        carried.contains("step carried, ") && carried.contains("30 held-out points"),
        "{printed}"
    );
    assert!(!printed.contains("step found"), "{printed}");
}
