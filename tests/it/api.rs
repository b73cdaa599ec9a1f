//! calib from arrays: to the last digit what a pipeline gives for the same numbers in a file.

use crate::answer::{calib, ends_with, fed, has, put, starts_with};
use crate::compensate::{ROBOT, cell};
use calib::api::{CalibRun, Options, Poses, Recording, Robot, Sigma, diagnose, identify};
use calib::error::{Error, Result};
use calib::pipeline::StageTables;
use calib::store::Store;
use calib::table::{Recording as RecordingTable, Table};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

const PIPELINE: &str = "calib: 1
name: arrays
seed: 1
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: measured.csv
          columns:
            q: {column: 'q{j}', unit: rad}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
            sigma_x: {value: 0.013, unit: mm}
            sigma_y: {value: 0.013, unit: mm}
            sigma_z: {value: 0.013, unit: mm}
            temperature: {column: temp, unit: C}
  - uses: split
    with: {by: every, n: 4}
  - uses: identify
  - uses: diagnose
";

fn robot() -> Robot {
    Robot::from_text("robot.yaml", ROBOT).unwrap()
}

fn run(folder: &Path) -> CalibRun {
    let store = Store::open(folder.join(".calib")).unwrap();
    CalibRun::open(store, "HEAD").unwrap()
}

/// The recording of the cell that all tests share, as arrays.
fn arrays() -> Recording {
    let frame = run(cell()).table("recording").unwrap();
    let table = RecordingTable::from_frame(&frame).unwrap();
    let rows = table.rows() as u32;
    let temperature = (0..rows).map(|row| 21.0 + f64::from(row) / 7.0).collect();
    Recording {
        poses: Poses {
            joints_rad: table.q.clone(),
            columns: [("temp_c".to_string(), temperature)].into(),
        },
        points_mm: table
            .position
            .iter()
            .map(|point| point.map(|value| value * 1e3))
            .collect(),
        sigma: Sigma::Mm(vec![0.013]),
        ..Recording::default()
    }
}

#[test]
fn arrays_give_to_the_last_digit_what_a_pipeline_gives_for_the_same_numbers_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let recording = arrays();
    let mut csv = "q1,q2,q3,q4,q5,q6,x,y,z,temp\n".to_string();
    let temperature = &recording.poses.columns["temp_c"];
    let rows = recording
        .poses
        .joints_rad
        .chunks(6)
        .zip(&recording.points_mm);
    for ((q, point), temperature) in rows.zip(temperature) {
        q.iter()
            .chain(point)
            .for_each(|value| write!(csv, "{value},").unwrap());
        writeln!(csv, "{temperature}").unwrap();
    }
    for (name, text) in [
        ("robot.yaml", ROBOT),
        ("pipeline.yaml", PIPELINE),
        ("measured.csv", &csv),
    ] {
        put(folder.path(), name, text);
    }
    let output = calib(folder.path(), "run pipeline.yaml --quiet");
    let stderr = output.err;
    assert!(output.code == Some(0), "{stderr}");
    let run = run(folder.path());
    let identified = identify(&robot(), &recording, &Options::with(json!({}))).unwrap();
    let diagnosed = diagnose(&robot(), &recording, &Options::with(json!({}))).unwrap();
    let same = |stage: &str, given: &StageTables| {
        for (port, frame) in &given.tables {
            let stored = run.table(&format!("{stage}.{port}")).unwrap();
            assert_eq!(&stored, frame, "{stage}.{port}");
        }
    };
    same("identify", &identified.given);
    same("diagnose", &diagnosed.given);
    let stored = run.table("identify.prediction").unwrap();
    let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|name| stored.read::<f64>(name).unwrap());
    let predicted = identified.model.predict(&recording.poses).unwrap();
    for (row, point) in predicted.iter().enumerate() {
        let off =
            |(axis, value_mm): (usize, &f64)| (value_mm - [x[row], y[row], z[row]][axis]).abs();
        let off = point.iter().enumerate().map(off).fold(0.0, f64::max);
        assert!(off < 1e-9, "row {row}: {off} mm");
    }
}

fn refused<T>(found: Result<T>) -> String {
    match found {
        Ok(_) => "nothing is wrong".into(),
        Err(error @ (Error::Spec(_) | Error::Data(_))) => error.to_string(),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn arrays_that_are_no_recording_are_refused_with_row_and_what_is_allowed() {
    let with = |change: &dyn Fn(&mut Recording)| {
        let mut recording = arrays();
        change(&mut recording);
        refused(identify(&robot(), &recording, &Options::with(json!({}))))
    };
    let degrees = with(&|one| {
        one.poses
            .joints_rad
            .iter_mut()
            .for_each(|q| *q = q.to_degrees())
    });
    starts_with(
        &degrees,
        "joints, row 0: `joints` is declared in rad, but 8",
    );
    ends_with(
        &degrees,
        "allowed: up to 9.42 rad; if the array holds degrees, convert it to radians",
    );
    let faults = [
        with(&|one| one.poses.joints_rad[14] = f64::NAN),
        with(&|one| one.points_mm[7][1] = f64::INFINITY),
        with(&|one| one.points_mm.truncate(79)),
        with(&|one| one.sigma = Sigma::Mm(vec![0.01; 7])),
        with(&|one| one.sigma = Sigma::Instrument("leica_at96".into())),
        with(&|one| {
            one.poses
                .columns
                .insert("payload".into(), vec![1.0; one.points_mm.len()]);
        }),
        refused(identify(
            &robot(),
            &arrays(),
            &Options::with(json!({ "efects": ["backlash"] })),
        )),
        refused(Robot::library("ur5ee")),
    ];
    let starts = [
        "joints, row 2, joint 3: NaN is not a number",
        "points, row 7: inf is not a number",
        "points: 79 values; expected 80",
        "sigma: 7 numbers; expected one for all, 80, or three for each of 80 rows",
        "sigma: unknown instrument `leica_at96`; did you mean `leica_at960`?",
        "payload: no such column; did you mean `payload_kg`?",
        "identify: with.efects: unknown key; did you mean `effects`?",
        "NAME: no arm `ur5ee` in the library; did you mean `ur5e`?",
    ];
    for (fault, start) in faults.iter().zip(starts) {
        starts_with(fault, start);
    }
}

fn served(arguments: &str, input: &str) -> Vec<Value> {
    let text = fed(
        cell(),
        &format!("serve-model HEAD --quiet {arguments}"),
        input,
    )
    .ok();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn a_served_model_answers_every_line_with_what_the_library_computes() {
    let model = run(cell()).model(None).unwrap();
    let poses = Poses {
        joints_rad: vec![
            0.3, 0.2, -0.4, 0.5, 0.8, -1.0, 0.1, -0.3, 0.4, 0.2, -0.6, 1.1,
        ],
        ..Poses::default()
    };
    let [first, second] = [&poses.joints_rad[..6], &poses.joints_rad[6..]];
    let input = format!(
        "{}\n[1, 2]\n{}\n",
        json!(first),
        json!({ "joints_rad": second, "id": "b" })
    );
    let commands = model.compensate(&poses, false).unwrap();
    let answers = served("", &input);
    assert_eq!(answers.len(), 3);
    assert_eq!(answers[0]["joints_rad"], json!(commands.joints_rad[..6]));
    assert_eq!(answers[2]["joints_rad"], json!(commands.joints_rad[6..]));
    assert_eq!(answers[2]["id"], "b");
    assert_eq!(
        answers[1]["error"],
        "line 2: joints_rad: 2 numbers; the robot has 6 joints"
    );
    let points = model.predict(&poses).unwrap();
    let answers = served("--predict", &input);
    for (answer, point) in [&answers[0], &answers[2]].into_iter().zip(points) {
        for (axis, value) in point.iter().enumerate() {
            let value_mm = answer["point_mm"][axis].as_f64().unwrap();
            assert!((value_mm - value).abs() < 1e-9, "{value_mm} {value}");
        }
    }
    // No row was measured with joint 1 turned by 170 degrees.
    let far = served("--predict", "[2.97, 0.2, -0.4, 0.5, 0.8, -1.0]\n");
    let remark = far[0]["remark"].as_str().unwrap();
    has(remark, "joint 1");
}
