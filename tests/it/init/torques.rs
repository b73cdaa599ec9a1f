//! Recordings of torques, files of columns with lists, files that are known and not read, and folders that have their robot file.

use super::layouts::{cells, joints, made, point, table};
use crate::answer::{calib, put};
use crate::bags::ARM;
use arrow::array::{ArrayRef, FixedSizeListArray, Float64Array, ListArray, RecordBatch};
use arrow::datatypes::{Field, Float32Type};
use std::fmt::Write;
use std::sync::Arc;

/// A log of an arm that moves: so many joints, and what stands under `more`.
fn log(header: &str, count: usize, row: impl Fn(usize, usize) -> String) -> String {
    let mut text = format!("time_s,{header}\n");
    for k in 0..40 {
        writeln!(
            text,
            "{:.3},{}",
            0.008 * k as f64,
            cells(count, ",", |column| row(k, column))
        )
        .unwrap();
    }
    text
}

fn names(pattern: &str, count: usize) -> String {
    cells(count, ",", |k| pattern.replace('#', &(k + 1).to_string()))
}

fn wave(row: usize, column: usize) -> String {
    format!(
        "{:.5}",
        (0.5 + 0.1 * column as f64) * (0.1 * row as f64 + column as f64).sin()
    )
}

#[test]
fn torques_under_any_name_make_a_pipeline_that_reads_torques() {
    for (pattern, quantity) in [
        ("tau#", "torque: {column: \"tau{j}\", unit: Nm}"),
        (
            "joint_torque_#",
            "torque: {column: \"joint_torque_{j}\", unit: Nm}",
        ),
        (
            "Drehmoment A# [Nm]",
            "torque: {column: \"Drehmoment A{j} [Nm]\", unit: Nm}",
        ),
        ("effort_#", "torque: {column: \"effort_{j}\", unit: Nm}"),
        (
            "actual_current_#",
            "current: {column: \"actual_current_{j}\", unit: A}",
        ),
        ("I# [mA]", "current: {column: \"I{j} [mA]\", unit: mA}"),
    ] {
        let header = [names("q#", 6), names("dq#", 6), names(pattern, 6)].join(",");
        let made = made(&[("log.csv", log(&header, 18, wave).into())]);
        made.has(&[
            "uses: ingest_torques",
            "uses: diagnose_torques",
            "uses: report_torques",
            "q: {column: \"q{j}\", unit: rad}",
        ]);
        made.has(&[
            quantity,
            "velocity: {column: \"dq{j}\", unit: rad/s}",
            "time: {column: \"time_s\", unit: s}",
        ]);
        made.lacks(&["uses: ingest\n", "instrument", "split"]);
        calib(made.path(), "check pipeline.yaml").code(0);
    }
}

#[test]
fn joint_states_of_ros_are_told_by_their_names_and_an_effort_may_be_a_current() {
    let of_what = |what: &str| ARM.map(|joint| format!("{joint}_{what}")).join(",");
    // Efforts before positions: the first column of a joint is not its position.
    let header = [of_what("effort"), of_what("velocity"), of_what("position")].join(",");
    let made = made(&[("log.csv", log(&header, 18, wave).into())]);
    made.has(&[
        "q: {columns: [\"shoulder_pan_joint_position\"",
        "velocity: {columns: [\"shoulder_pan_joint_velocity\"",
    ]);
    made.has(&["torque: {columns: [\"shoulder_pan_joint_effort\""])
        .says(&["# current: {columns: [\"shoulder_pan_joint_effort\""]);
}

#[test]
fn columns_that_are_no_joints_are_not_taken_for_joints() {
    // (header, columns): poses, forces, quaternions and channels in number of an arm's joints, and five of what nobody knows.
    for (header, count) in [
        (names("actual_TCP_pose_#", 6), 6),
        (names("ft_#", 6), 6),
        (names("strain #", 6), 6),
        (names("dq#", 6), 6),
        (names("R#", 5), 5),
    ] {
        let row = |k: usize| {
            format!(
                "{},{}",
                cells(count, ",", |column| wave(k, column)),
                point(k, ",")
            )
        };
        let made = made(&[("data.csv", table(&format!("{header},X,Y,Z"), row).into())]);
        assert!(
            !made.printed.contains("joints ("),
            "{header}: {}",
            made.printed
        );
        made.has(&[
            "q: {column: \"A{j}\", unit: deg}   # REPLACE: no columns of joints were recognised",
        ]);
    }
    let turned = |k: usize| {
        let angle = 0.1 * k as f64;
        format!(
            "{:.6},{:.6},0,0,{}",
            angle.cos(),
            angle.sin(),
            point(k, ",")
        )
    };
    let made = made(&[("data.csv", table("q1,q2,q3,q4,X,Y,Z", turned).into())]);
    assert!(!made.printed.contains("joints ("), "{}", made.printed);
}

/// A file of columns: times, a list of the state with so many numbers, and a point as a list.
fn lists(count: usize) -> Vec<u8> {
    let rows = 0..30;
    let state = |k: usize| {
        Some(
            (0..count)
                .map(|j| Some(wave(k, j).parse::<f32>().unwrap()))
                .collect::<Vec<_>>(),
        )
    };
    let state = ListArray::from_iter_primitive::<Float32Type, _, _>(rows.clone().map(state));
    let points: Vec<f64> = rows
        .clone()
        .flat_map(|k| {
            point(k, ",")
                .split(',')
                .map(|x| x.parse().unwrap())
                .collect::<Vec<f64>>()
        })
        .collect();
    let field = Arc::new(Field::new(
        "item",
        arrow::datatypes::DataType::Float64,
        true,
    ));
    let points = FixedSizeListArray::new(field, 3, Arc::new(Float64Array::from(points)), None);
    let time: Float64Array = rows.map(|k| 0.1 * k as f64).collect::<Vec<f64>>().into();
    let columns: [(&str, ArrayRef); 3] = [
        ("timestamp", Arc::new(time)),
        ("observation.state", Arc::new(state)),
        ("point", Arc::new(points)),
    ];
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let mut bytes = Vec::new();
    let mut writer =
        parquet::arrow::ArrowWriter::try_new(&mut bytes, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn lists_of_a_parquet_file_are_columns_of_which_the_first_are_the_joints() {
    let made = made(&[("episode.parquet", lists(7))]);
    made.has(&[
        "q: {columns: [\"observation.state[1]\", \"observation.state[2]\"",
        "time: {column: \"timestamp\", unit: s}",
    ]);
    made.says(&[
        "of the 7 numbers of the list the first 6",
        "# not used: \"observation.state[7]\"",
        "# not used: \"point[1]\"",
    ]);
    let mapped = (1..)
        .zip(["x", "y", "z"])
        .fold(made.pipeline.clone(), |text, (k, axis)| {
            text.replace(
                &format!("{axis}: {{column: {axis},"),
                &format!("{axis}: {{column: \"point[{k}]\","),
            )
        });
    put(made.path(), "pipeline.yaml", mapped);
    made.runs(30);
}

#[test]
fn programs_and_bags_are_named_as_what_they_are_by_init_and_by_check() {
    for (name, content, printed) in [
        (
            "measure.txt",
            &b"/PROG  MEASURE\n/ATTR\nOWNER = MNEDITOR;\n/POS\nP[1]{\n"[..],
            "is a FANUC program (a listing of TP): name it .ls",
        ),
        (
            "measure.prg.txt",
            b"MODULE Measure\n  CONST jointtarget p1:=[[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n",
            "is an ABB program in RAPID: name it .mod or .prg",
        ),
        (
            "run.db3",
            b"SQLite format 3\0\x10\x00\x01\x01\x00",
            "its first page is damaged",
        ),
        (
            "run.mcap",
            b"\x89MCAP0\r\n\x01\x00",
            "it has no end: a recorder that was stopped, or a copy that was cut",
        ),
    ] {
        let made = made(&[(name, content.to_vec())]);
        assert!(made.printed.contains(printed), "{name}: {}", made.printed);
        let check = calib(made.path(), "check pipeline.yaml");
        let message = check.err.clone();
        assert!(
            check.code == Some(10) && message.contains(printed),
            "{name}: {message}"
        );
    }
}

#[test]
fn a_folder_with_a_robot_file_keeps_it_and_joints_are_counted_by_it() {
    let folder = tempfile::tempdir().unwrap();
    let message_of = |arguments: &str| {
        let output = calib(folder.path(), arguments);
        (output.code, output.both())
    };
    put(
        folder.path(),
        "data.csv",
        table("A1,A2,A3,A4,A5,A6,X,Y,Z", |k| {
            format!("{},{}", joints(k, ","), point(k, ","))
        }),
    );
    let robot = message_of("robots lrmate_200id").1;
    put(folder.path(), "robot.yaml", &robot);
    let (code, printed) = message_of("init . --data data.csv --robot ur10e");
    assert!(
        code == Some(2) && printed.contains("robot.yaml: is already there and would be used"),
        "{printed}"
    );
    let (code, printed) = message_of("init . --data data.csv");
    assert!(
        code == Some(0)
            && printed
                .contains("wrote ./pipeline.yaml next to ./robot.yaml, which is used as it is"),
        "{printed}"
    );
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("robot.yaml"), robot);
    // What its controller counts otherwise goes along.
    assert!(
        read("pipeline.yaml").contains("coupled: [{joint: 3, by: 2"),
        "{}",
        read("pipeline.yaml")
    );
    assert_eq!(message_of("check pipeline.yaml").0, Some(0));
    std::fs::remove_file(folder.path().join("pipeline.yaml")).unwrap();
    put(folder.path(), "robot.yaml", message_of("robots panda").1);
    let (code, printed) = message_of("init . --data data.csv");
    assert!(
        code == Some(2)
            && printed
                .contains("has 7 joints, the recording 6; put the robot of the recording there"),
        "{printed}"
    );
}

/// Columns by name with their numbers, forty rows.
fn columns(all: &[(&str, &dyn Fn(usize) -> f64)]) -> String {
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for k in 0..40 {
        let cells: Vec<String> = all.iter().map(|(_, of)| format!("{:.5}", of(k))).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

fn numbers(column: usize) -> impl Fn(usize) -> f64 {
    move |row| (0.5 + 0.1 * column as f64) * (0.1 * row as f64 + column as f64).sin()
}

/// Six joints under each of some patterns.
fn six(patterns: &[&str], turns: f64) -> String {
    let time = |k: usize| 0.008 * k as f64;
    let waves: Vec<_> = (0..6 * patterns.len()).map(numbers).collect();
    // The last joint turns more than once.
    let scaled = |n: usize| {
        let wave = &waves[n];
        let factor = if n == 5 { turns } else { 1.0 };
        move |k: usize| factor * wave(k)
    };
    let waves_of: Vec<_> = (0..waves.len()).map(scaled).collect();
    let names: Vec<String> = (0..waves.len())
        .map(|n| patterns[n / 6].replace('#', &(n % 6).to_string()))
        .collect();
    let mut all: Vec<(&str, &dyn Fn(usize) -> f64)> = vec![("timestamp", &time)];
    all.extend(
        (names.iter().zip(&waves_of))
            .map(|(name, wave)| (name.as_str(), wave as &dyn Fn(usize) -> f64)),
    );
    columns(&all)
}

#[test]
fn what_a_controller_expects_is_no_measurement_where_currents_are() {
    let log = six(
        &[
            "target_q_#",
            "target_moment_#",
            "actual_q_#",
            "actual_qd_#",
            "actual_current_#",
            "target_current_#",
        ],
        1.0,
    );
    let made = made(&[("log.csv", log.into())]);
    made.has(&[
        "q: {columns: [\"actual_q_0\"",
        "current: {columns: [\"actual_current_0\"",
        "velocity: {columns: [\"actual_qd_0\"",
    ]);
    made.has(&["simulated: {columns: [\"target_moment_0\""]);
    made.says(&["what the controller's own model expects"]);
    made.lacks(&[
        "      torque: {columns: [\"target_moment_0\"",
        "are these degrees?",
    ]);
}

#[test]
fn a_joint_that_turns_more_than_once_makes_no_degrees_of_the_others() {
    let made = made(&[("log.csv", six(&["q#", "v#", "f#"], 20.0).into())]);
    made.has(&[
        "q: {columns: [\"q0\", \"q1\", \"q2\", \"q3\", \"q4\", \"q5\"], unit: rad}",
        "velocity: {columns: [\"v0\"",
        "torque: {columns: [\"f0\"",
    ]);
    made.says(&["several turns in radians"]);
}

#[test]
fn the_only_joint_may_have_the_number_of_its_motor_on_a_bus() {
    let folder = tempfile::tempdir().unwrap();
    let robot = "calib_robot: 1\nname: one\nunits: {length: mm, angle: deg}\nkinematics:\n  screws:\n    - {axis: [0, 1, 0], point: [0, 0, 0]}\n\
                 tool: {point: [0, 0, -100]}\n";
    put(&folder, "robot.yaml", robot);
    let log = log("pos (5),target pos (5),current (5) [mA]", 3, wave);
    put(&folder, "log.csv", log);
    let printed = calib(folder.path(), "init . --data log.csv");
    assert_eq!(printed.code, Some(0), "{}", printed.both());
    let made = std::fs::read_to_string(folder.path().join("pipeline.yaml")).unwrap();
    for part in [
        "uses: ingest_torques",
        "q: {columns: [\"pos (5)\"]",
        "current: {columns: [\"current (5) [mA]\"], unit: mA}",
    ] {
        assert!(made.contains(part), "{part} in\n{made}");
    }
}

#[test]
fn counts_of_the_motors_on_a_bus_are_joints_with_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let robot = "calib_robot: 1\nname: one\nunits: {length: mm, angle: deg}\nkinematics:\n  screws:\n    - {axis: [0, 1, 0], point: [0, 0, 0]}\n\
                 tool: {point: [0, 0, -100]}\n";
    put(&folder, "robot.yaml", robot);
    let counted = |row: usize, column: usize| match column {
        0 => format!("{}", 2048 + (900.0 * (0.1 * row as f64).sin()) as i64),
        _ => wave(row, column),
    };
    put(
        &folder,
        "log.csv",
        log("pos (5),current (5) [mA]", 2, counted),
    );
    let printed = calib(folder.path(), "init . --data log.csv");
    assert_eq!(printed.code, Some(0), "{}", printed.both());
    let made = std::fs::read_to_string(folder.path().join("pipeline.yaml")).unwrap();
    assert!(
        made.contains("q: {columns: [\"pos (5)\"], counts_per_turn: 4096}"),
        "{made}"
    );
}

#[test]
fn columns_without_a_header_of_an_arm_that_moves_are_angles_and_torques() {
    let folder = tempfile::tempdir().unwrap();
    let angle = |row: usize, joint: usize| (0.03 * row as f64 + joint as f64).sin();
    let torque = |row: usize, joint: usize| 5.0 * (0.03 * row as f64 + joint as f64).cos();
    let cells = |row: usize, of: &dyn Fn(usize, usize) -> f64| {
        let cells = (0..6).map(|joint| format!("{:.5}", of(row, joint)));
        cells.collect::<Vec<_>>().join(",")
    };
    let rows = |time: bool| {
        let row = |k: usize| {
            let time = if time {
                format!("{:.3},", 0.01 * k as f64)
            } else {
                String::new()
            };
            format!("{time}{},{}", cells(k, &angle), cells(k, &torque))
        };
        (0..900).map(row).collect::<Vec<_>>().join("\n")
    };
    put(&folder, "timed.csv", rows(true));
    put(&folder, "bare.csv", rows(false));
    for (name, expected) in [
        (
            "timed",
            [
                "time: {column: 1, unit: s}",
                "q: {columns: [2, 3, 4, 5, 6, 7], unit: rad}",
                "torque: {columns: [8, 9, 10, 11, 12, 13], unit: Nm}",
            ],
        ),
        (
            "bare",
            [
                "time: {rate: 100}",
                "q: {columns: [1, 2, 3, 4, 5, 6], unit: rad}",
                "torque: {columns: [7, 8, 9, 10, 11, 12], unit: Nm}",
            ],
        ),
    ] {
        calib(
            folder.path(),
            &format!("init {name} --robot ur5 --data {name}.csv"),
        )
        .ok();
        let made = std::fs::read_to_string(folder.path().join(name).join("pipeline.yaml")).unwrap();
        for part in expected
            .iter()
            .chain(&["uses: ingest_torques", "header: false"])
        {
            assert!(made.contains(part), "{part} in\n{made}");
        }
        calib(
            folder.path(),
            &format!("run {name}/pipeline.yaml --quiet --until ingest_torques"),
        )
        .ok();
    }
}
