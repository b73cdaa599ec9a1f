//! A correction carried to another series of the same robot, only the base refitted: never worse than none.

use crate::answer::{calib, has, put};
use crate::desk::{Desk, diagnose_reads, identify_reads, shared, table};
use calib::effect::Load;
use calib::error::Result;
use calib::estimate::Model;
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::stage::ingest::{Ingest, IngestReads};
use calib::stage::split::{SplitBy, SplitReads};
use calib::stage::{
    Context, Diagnose, Identify, Labelled, Learn, LearnReads, LearnWrites, ReadRobot, RobotReads,
    Simulate, SimulateReads, Stage, Transfer, TransferReads,
};
use calib::store::frame::Frame;
use calib::table::{Parameters, Prediction, Recording, Robot, Split};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// One series, thinned, with the identified geometry and the correction learnt on top.
struct Series {
    robot: Robot,
    recording: Recording,
    split: Split,
    model: Model,
    geometry: Parameters,
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
    let stage = yaml["stages"]
        .as_array()
        .unwrap()
        .iter()
        .find(|stage| stage["uses"] == "ingest")
        .unwrap();
    let mut with = stage["with"].clone();
    with["files"][0]["file"] = json!(shared("data/ipa_ur10").unwrap().join(file));
    let whole: Recording = table(&desk.run(
        &settings::<Ingest>(with),
        IngestReads {
            robot: robot.clone(),
        },
    )?)
    .remove(0);
    let kept: Vec<usize> = (0..whole.rows()).step_by(every).collect();
    let recording = Recording {
        sequence: kept.iter().map(|row| whole.sequence[*row]).collect(),
        point_id: kept
            .iter()
            .map(|row| whole.point_id[*row].clone())
            .collect(),
        usage: vec![None; kept.len()],
        q: kept.iter().flat_map(|row| whole.q(*row).to_vec()).collect(),
        position: kept.iter().map(|row| whole.position[*row]).collect(),
        joints: whole.joints,
        prismatic: whole.prismatic.clone(),
        ..Recording::default()
    };
    // A stretch at the end is held out: neighbours of its rows were not seen.
    let by = settings::<SplitBy>(
        json!({"by": "blocks", "count": 4, "sets": ["fit", "fit", "fit", "validate"]}),
    );
    let split: Split = table(&desk.run(
        &by,
        SplitReads {
            recording: recording.clone(),
        },
    )?)
    .remove(0);
    let geometry = settings::<Identify>(json!({
        "effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry"], "folds": 0,
    }));
    let tables = desk.run(
        &geometry,
        identify_reads(robot.clone(), recording.clone(), split.clone()),
    )?;
    let parameters: Parameters = table(&tables).remove(0);
    let prediction: Prediction = table(&tables).remove(0);
    let learn = settings::<Learn>(
        json!({"on": ["fit"], "rivals": ["ridge", "gaussian_process", "curves"], "folds": 2}),
    );
    let reads = LearnReads {
        robot: Some(robot.clone()),
        recording: recording.clone(),
        split: split.clone(),
        parameters: Some(parameters.clone()),
        prediction: prediction.clone(),
    };
    let learnt = learn.run(
        reads,
        &Context {
            id: "learn",
            seed: 5,
            jobs: 2,
            services: &desk,
        },
    )?;
    let of = |prediction: &Prediction| {
        let errors = || {
            prediction
                .0
                .iter()
                .filter(|row| row.set == "validate")
                .map(|row| row.error_mm)
        };
        [
            errors().sum::<f64>() / errors().count() as f64,
            errors().fold(0.0, f64::max),
        ]
    };
    let own = [of(&prediction), of(&learnt.prediction)];
    let model = parameters.model(
        RobotModel::new(robot.to_description()?),
        &[],
        Load::GravityTorque,
    )?;
    Ok(Series {
        robot,
        recording,
        split,
        model,
        geometry: parameters,
        learnt,
        own,
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
    let plain = from.model.predict(&to.recording.measurements());
    let correction = from
        .learnt
        .network
        .correction(&from.recording.prismatic)
        .unwrap()
        .unwrap();
    let corrected: Vec<Vector3<f64>> = plain
        .iter()
        .enumerate()
        .map(|(row, p)| p + Vector3::from(correction.at(to.recording.q(row)).delta))
        .collect();
    [
        after_base(&plain, &to.recording.position),
        after_base(&corrected, &to.recording.position),
    ]
}

/// Mean error on the rows of `to`, and that which one of a hundred exceeds, mm, of a model identified on another series.
fn transferred(parameters: &Parameters, to: &Series) -> Result<[f64; 2]> {
    let stage =
        settings::<Transfer>(json!({"on": ["fit", "validate"], "screen": false, "folds": 0}));
    let reads = TransferReads {
        robot: to.robot.clone(),
        recording: to.recording.clone(),
        split: to.split.clone(),
        parameters: parameters.clone(),
        covariance: None,
        recordings: Vec::new(),
        models: Vec::new(),
        predictions: Vec::new(),
    };
    let prediction: Prediction = table(&Desk::default().run(&stage, reads)?).remove(0);
    let mut errors: Vec<f64> = prediction.0.iter().map(|row| row.error_mm).collect();
    errors.sort_by(f64::total_cmp);
    // The largest of a thousand errors is that of one row.
    let of_a_hundred = errors[errors.len() * 99 / 100];
    println!("largest {:.3?} mm", errors.last());
    Ok([
        errors.iter().sum::<f64>() / errors.len() as f64,
        of_a_hundred,
    ])
}

/// The model with the causes that were found in a series.
fn diagnosed(series: &Series) -> Result<Parameters> {
    Ok(table(&Desk::default().run(
        &settings::<Diagnose>(json!({})),
        diagnose_reads(
            series.robot.clone(),
            series.recording.clone(),
            series.split.clone(),
        ),
    )?)
    .remove(0))
}

#[test]
fn between_two_series_of_a_real_robot_a_correction_is_never_worse_than_none() {
    let Some(_) = shared("data/ipa_ur10") else {
        return;
    };
    let (a, c) = rayon::join(
        || series("Series_A/measurements_grid.csv", 16).unwrap(),
        || series("Series_C/measurements_random_poses.csv", 3).unwrap(),
    );
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
        assert!(
            after[0] <= 1.001 * before[0],
            "{name}: {before:?} -> {after:?}"
        );
    }
    // Named causes carry over between random poses and the grid: there is more in them than the points they were found in.
    let ways = [("A to C", &a, &c), ("C to A", &c, &a)];
    let errors = |(_, from, to): &(_, &Series, &Series)| {
        (
            transferred(&from.geometry, to).unwrap(),
            transferred(&diagnosed(from).unwrap(), to).unwrap(),
        )
    };
    let found: Vec<([f64; 2], [f64; 2])> = ways.par_iter().map(errors).collect();
    for ((name, ..), (before, after)) in ways.into_iter().zip(found) {
        println!("{name}, diagnosed: {before:.3?} -> {after:.3?} mm");
        assert!(
            after[0] < before[0] && after[1] < before[1],
            "{name}: {before:?} -> {after:?}"
        );
    }
}

/// The twin of `pipelines/sr210d` without what the paper's model does not have.
fn measured(robot: &Robot, seed: u64) -> (Recording, Split) {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d/pipeline.yaml"),
    )
    .unwrap();
    let yaml: Value = serde_saphyr::from_str(&text.replace("${remainder}", "none")).unwrap();
    let mut twin = yaml["stages"]
        .as_array()
        .unwrap()
        .iter()
        .find(|stage| stage["uses"] == "simulate")
        .unwrap()["with"]
        .clone();
    twin["seed"] = json!(seed);
    twin["blocks"] = json!([{"usage": "fit", "points": 60}, {"usage": "check", "points": 60}]);
    let desk = Desk::default();
    let recording: Recording = table(
        &desk
            .run(
                &settings::<Simulate>(twin),
                SimulateReads {
                    robot: robot.clone(),
                },
            )
            .unwrap(),
    )
    .remove(0);
    let by = settings::<SplitBy>(json!({"by": "usage"}));
    let split = table(
        &desk
            .run(
                &by,
                SplitReads {
                    recording: recording.clone(),
                },
            )
            .unwrap(),
    )
    .remove(0);
    (recording, split)
}

#[test]
fn a_model_holds_on_a_later_recording_from_where_the_tracker_stands_then() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d/robot.yaml");
    let read = settings::<ReadRobot>(json!({"file": file}));
    let desk = Desk::default();
    let robot: Robot = table(&desk.run(&read, RobotReads {}).unwrap()).remove(0);
    let (recording, split) = measured(&robot, 1);
    let effects = [
        "base_frame",
        "tool_offset",
        "joint_offset",
        "link_geometry",
        "reduction_ratio",
        "coupling_ratio",
    ];
    let identify = settings::<Identify>(json!({"effects": effects, "folds": 0}));
    let tables = desk
        .run(&identify, identify_reads(robot.clone(), recording, split))
        .unwrap();
    let parameters: Parameters = table(&tables).remove(0);
    let unseen = |tables: &BTreeMap<&'static str, Vec<Frame>>| {
        let prediction: Prediction = table(tables).remove(0);
        let errors = || {
            prediction
                .0
                .iter()
                .filter(|row| row.set == "check")
                .map(|row| row.error_mm)
        };
        errors().sum::<f64>() / errors().count() as f64
    };
    let own = unseen(&tables);

    let (mut later, split) = measured(&robot, 2);
    let moved =
        Pose::from_rotation_vector(Vector3::new(0.02, -0.01, 2.0), Vector3::new(3.0, -1.5, 0.2));
    for position in &mut later.position {
        *position = moved.point(&Vector3::from(*position)).into();
    }
    let stage = settings::<Transfer>(json!({"folds": 0}));
    let reads = TransferReads {
        robot,
        recording: later,
        split,
        parameters: parameters.clone(),
        covariance: None,
        recordings: Vec::new(),
        models: Vec::new(),
        predictions: Vec::new(),
    };
    let tables = desk.run(&stage, reads).unwrap();
    let mean = unseen(&tables);
    assert!(
        mean < 1.2 * own,
        "{mean} mm, {own} mm in the recording it was identified by"
    );
    let carried: Parameters = table(&tables).remove(0);
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

#[test]
fn a_carried_model_says_that_its_geometry_alone_is_better() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d/robot.yaml");
    let read = settings::<ReadRobot>(json!({"file": file}));
    let desk = Desk::default();
    let robot: Robot = table(&desk.run(&read, RobotReads {}).unwrap()).remove(0);
    let (recording, split) = measured(&robot, 3);
    let identify = settings::<Identify>(json!({"folds": 0}));
    let mut parameters: Parameters = table(
        &desk
            .run(
                &identify,
                identify_reads(robot.clone(), recording.clone(), split.clone()),
            )
            .unwrap(),
    )
    .remove(0);
    // Where the first joint stood on its negative side, as if nothing else had been measured.
    let there: Vec<usize> = (0..recording.rows())
        .filter(|row| recording.q(*row)[0] < 0.0)
        .collect();
    let earlier = Recording {
        sequence: there.iter().map(|row| recording.sequence[*row]).collect(),
        point_id: there
            .iter()
            .map(|row| recording.point_id[*row].clone())
            .collect(),
        usage: vec![None; there.len()],
        q: there
            .iter()
            .flat_map(|row| recording.q(*row).to_vec())
            .collect(),
        position: there.iter().map(|row| recording.position[*row]).collect(),
        joints: recording.joints,
        prismatic: recording.prismatic.clone(),
        ..Recording::default()
    };
    let label = |stage: &str, table: Recording| Labelled {
        stage: stage.into(),
        table,
    };
    let carry = |parameters: &Parameters| {
        let desk = Desk::default();
        let reads = TransferReads {
            robot: robot.clone(),
            recording: recording.clone(),
            split: split.clone(),
            parameters: parameters.clone(),
            covariance: None,
            recordings: vec![
                label("ingest", earlier.clone()),
                label("later", recording.clone()),
            ],
            models: Vec::new(),
            predictions: Vec::new(),
        };
        let tables = desk
            .run(&settings::<Transfer>(json!({"folds": 0})), reads)
            .unwrap();
        let warnings = desk.warnings.lock().unwrap().join("\n");
        (table::<Prediction>(&tables).remove(0), warnings)
    };
    let worse = "what was identified besides it does not hold here";
    let (prediction, warnings) = carry(&parameters);
    assert!(!warnings.contains(worse), "{warnings}");
    // How certain its correction is nobody knows without a covariance.
    assert!(
        prediction.0.iter().all(|row| row.remark.is_none()),
        "{:?}",
        prediction.0[0].remark
    );
    let compliance = parameters
        .0
        .iter_mut()
        .filter(|row| row.effect == "joint_compliance");
    compliance.for_each(|row| row.value = 3e-6);
    let (_, warnings) = carry(&parameters);
    has(&warnings, worse);
}

fn labelled<T>(stage: &str, table: T) -> Labelled<T> {
    Labelled {
        stage: stage.into(),
        table,
    }
}

/// The twin's robot with a model and its geometry, each identified by itself in one recording, and another recording.
struct Carrying {
    robot: Robot,
    here: Recording,
    there: (Recording, Split),
    found: (Parameters, Prediction),
    geometry: (Parameters, Prediction),
}

/// What a stage wrote of a carried model, and what it said.
struct CarriedThere {
    parameters: Parameters,
    prediction: Prediction,
    notes: String,
    warnings: String,
}

impl Carrying {
    fn new() -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d/robot.yaml");
        let read = settings::<ReadRobot>(json!({"file": file}));
        let robot: Robot = table(&Desk::default().run(&read, RobotReads {}).unwrap()).remove(0);
        let (here, split) = measured(&robot, 4);
        let there = measured(&robot, 5);
        let effects = [
            "base_frame",
            "tool_offset",
            "joint_offset",
            "link_geometry",
            "reduction_ratio",
        ];
        let model = |effects: &[&str]| {
            let identify = settings::<Identify>(json!({"effects": effects, "folds": 0}));
            let tables = Desk::default()
                .run(
                    &identify,
                    identify_reads(robot.clone(), here.clone(), split.clone()),
                )
                .unwrap();
            (table(&tables).remove(0), table(&tables).remove(0))
        };
        let geometry = model(&effects);
        let found = model(&[&effects[..], &["joint_compliance"]].concat());
        Self {
            robot,
            here,
            there,
            found,
            geometry,
        }
    }

    fn carry(&self, parameters: &Parameters, separate: bool) -> CarriedThere {
        let desk = Desk::default();
        let geometry = separate.then(|| labelled("geometry", self.geometry.clone()));
        let reads = TransferReads {
            robot: self.robot.clone(),
            recording: self.there.0.clone(),
            split: self.there.1.clone(),
            parameters: parameters.clone(),
            covariance: None,
            recordings: vec![
                labelled("here", self.here.clone()),
                labelled("there", self.there.0.clone()),
            ],
            models: geometry
                .iter()
                .map(|one| labelled("geometry", one.table.0.clone()))
                .chain([labelled("found", parameters.clone())])
                .collect(),
            predictions: geometry
                .iter()
                .map(|one| labelled("geometry", one.table.1.clone()))
                .chain([labelled("found", self.found.1.clone())])
                .collect(),
        };
        let tables = desk
            .run(&settings::<Transfer>(json!({"folds": 0})), reads)
            .unwrap();
        let said = |lines: &std::sync::Mutex<Vec<String>>| lines.lock().unwrap().join("\n");
        CarriedThere {
            parameters: table(&tables).remove(0),
            prediction: table(&tables).remove(0),
            notes: said(&desk.notes),
            warnings: said(&desk.warnings),
        }
    }
}

fn of_joints(parameters: &Parameters) -> usize {
    parameters
        .0
        .iter()
        .filter(|row| row.effect == "joint_compliance")
        .count()
}

#[test]
fn findings_that_make_another_recording_worse_than_geometry_alone_are_not_used_there() {
    let carrying = Carrying::new();
    let held = carrying.carry(&carrying.found.0, true);
    assert!(!held.warnings.contains("not used"), "{}", held.warnings);
    has(&held.notes, ["the geometry alone", "visited cells"]);
    assert_eq!(of_joints(&held.parameters), of_joints(&carrying.found.0));
    // Too much wind-up: still better than the geometry without it, which left room for it, and worse than geometry found by itself.
    let mut wrong = carrying.found.0.clone();
    wrong
        .0
        .iter_mut()
        .filter(|row| row.effect == "joint_compliance")
        .for_each(|row| row.value *= 1.8);
    let mean = |carried: &CarriedThere| {
        let errors = || {
            carried
                .prediction
                .0
                .iter()
                .filter(|row| row.held_out)
                .map(|row| row.error_mm)
        };
        errors().sum::<f64>() / errors().count() as f64
    };
    let alone = carrying.carry(&carrying.geometry.0, false);
    for separate in [true, false] {
        let carried = carrying.carry(&wrong, separate);
        assert!(
            carried
                .warnings
                .contains("does not hold here and is not used"),
            "{separate}: {}",
            carried.warnings
        );
        for words in ["mean", "largest", "visited cells", "unvisited"] {
            assert!(
                carried.warnings.contains(words),
                "{words}: {}",
                carried.warnings
            );
        }
        assert_eq!(of_joints(&carried.parameters), 0);
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/sr210d");
    std::fs::copy(root.join("robot.yaml"), folder.path().join("robot.yaml")).unwrap();
    let simulate = |id: &str, seed: u64| {
        format!(
            "  - id: {id}\n    uses: simulate\n    with:\n      truth: {{offset_deg: [0.1, 0.2, -0.1, 0.1, 0.1, 0]}}\n      \
             poses: {{range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}}\n      \
             blocks: [{{usage: fit, points: 40}}, {{usage: check, points: 30}}]\n      seed: {seed}\n"
        )
    };
    let split = |id: &str, of: &str| {
        format!(
            "  - id: {id}\n    uses: split\n    reads: {{recording: {of}}}\n    with: {{by: usage}}\n"
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
    let told = calib(folder.path(), "run p.yaml --quiet").ok();
    let carried = told
        .lines()
        .find(|line| line.starts_with("carried"))
        .unwrap_or_default();
    assert!(
        carried.contains("step carried, ") && carried.contains("30 held-out points"),
        "{told}"
    );
    assert!(!told.contains("step found"), "{told}");
}
