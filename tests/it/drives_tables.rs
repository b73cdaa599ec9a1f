//! Recordings of drives in tables of other kinds and units: Parquet with lists (LeRobot), arrays of NumPy, degrees, counts, per cent.

use crate::answer::{Answer, calib, put, read};
use crate::drives::{Folder, folder};
use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray, RecordBatch};
use arrow::datatypes::Float64Type;
use serde_json::{Value, json};
use std::io::{Cursor, Write};
use std::sync::Arc;
use tempfile::TempDir;

/// Time, command and angle of each row of the plain folder.
fn rows(folder: &Folder) -> Vec<[f64; 3]> {
    let lines = folder.recording.lines().skip(1);
    let of = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [0, 3, 4].map(|k| cells[k].parse().unwrap())
    };
    lines.map(of).collect()
}

/// The diagnosis of a recording in a file of this name, by lines below `columns`.
fn of_file(folder: &Folder, name: &str, bytes: Vec<u8>, columns: &str) -> Answer {
    let case = tempfile::tempdir().unwrap();
    put(case.path(), "robot.xml", &folder.robot);
    put(case.path(), "drives.json", folder.drives.to_string());
    put(case.path(), name, bytes);
    put(
        case.path(),
        "pipeline.yaml",
        format!(
            "calib: 1\nname: tables\nseed: 1\nstages:\n  - uses: diagnose_drives\n    with:\n      robot: robot.xml\n      drives: drives.json\n      \
             recording: {name}\n      columns: {columns}\n"
        ),
    );
    calib(
        case.path(),
        "diagnose --quiet --json pipeline.yaml --store store",
    )
}

fn csv(rows: &[[f64; 3]], of: impl Fn(f64) -> f64) -> Vec<u8> {
    let lines = rows
        .iter()
        .map(|[time, command, angle]| format!("{time},{},{}\n", of(*command), of(*angle)));
    let text = "time_s,cmd1_rad,q1_rad\n".to_string() + &lines.collect::<String>();
    text.into_bytes()
}

fn before(answer: &Answer) -> (f64, Value) {
    assert_eq!(answer.code, Some(0), "{}", answer.both());
    let document = answer.json();
    let rms = document["before"]["fit_rms_mrad"].as_f64().unwrap();
    (rms, document["rows"].clone())
}

/// What the plain file says.
fn plain() -> f64 {
    let folder = folder();
    let answer = of_file(&folder, "recording.csv", csv(&rows(&folder), |x| x), "{}");
    before(&answer).0
}

fn parquet(rows: &[[f64; 3]], episode: i64) -> Vec<u8> {
    // A gripper follows, as LeRobot has it; its clock begins anew with each episode.
    let list = |k: usize| {
        let all = rows
            .iter()
            .map(move |row| Some(vec![Some(row[k]), Some(0.5)]));
        ListArray::from_iter_primitive::<Float64Type, _, _>(all)
    };
    let halves = rows.len() / 2;
    let times = rows.iter().enumerate().map(|(k, row)| match k < halves {
        true => row[0],
        false => row[0] - rows[halves][0],
    });
    let episodes = (0..rows.len()).map(|k| episode + i64::from(k >= halves));
    let columns: [(&str, ArrayRef); 4] = [
        (
            "timestamp",
            Arc::new(Float64Array::from(times.collect::<Vec<f64>>())),
        ),
        (
            "episode_index",
            Arc::new(Int64Array::from(episodes.collect::<Vec<i64>>())),
        ),
        ("action", Arc::new(list(1))),
        ("observation.state", Arc::new(list(2))),
    ];
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let mut bytes = Vec::new();
    let mut writer =
        parquet::arrow::ArrowWriter::try_new(&mut bytes, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

const LEROBOT: &str =
    "{time: timestamp, trajectory: episode_index, command: action, angle: observation.state}";

#[test]
fn lists_of_a_parquet_file_are_commands_and_angles_and_its_episodes_trajectories() {
    let folder = folder();
    let answer = of_file(
        &folder,
        "episodes.parquet",
        parquet(&rows(&folder), 3),
        LEROBOT,
    );
    let (rms, count) = before(&answer);
    assert_eq!(count, json!(200));
    // The second half begins in motion, as it is measured.
    let whole = plain();
    assert!((rms / whole - 1.0).abs() < 0.2, "{rms} {whole}");
    let missing = LEROBOT.replace("action", "actions");
    let refused = of_file(
        &folder,
        "episodes.parquet",
        parquet(&rows(&folder), 0),
        &missing,
    );
    assert!(
        refused.err.contains("no column `actions`") && refused.err.contains("action[1]"),
        "{}",
        refused.err
    );
}

/// An array of NumPy, version 1, as `numpy.save` writes it.
fn npy(columns: usize, values: &[f64]) -> Vec<u8> {
    let shape = match columns {
        1 => format!("({},)", values.len()),
        _ => format!("({}, {columns})", values.len() / columns),
    };
    let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (head.len() + 11).next_multiple_of(64) - 10;
    let head = format!("{head:<0$}\n", length - 1);
    let data: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    [
        b"\x93NUMPY\x01\x00",
        &(length as u16).to_le_bytes()[..],
        head.as_bytes(),
        &data,
    ]
    .concat()
}

#[test]
fn arrays_of_numpy_are_a_recording() {
    let folder = folder();
    let rows = rows(&folder);
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let both = |k: usize| -> Vec<f64> { rows.iter().flat_map(|row| [row[k], 0.5]).collect() };
    let time: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    for (name, bytes) in [
        ("t.npy", npy(1, &time)),
        ("command.npy", npy(2, &both(1))),
        ("angle.npy", npy(2, &both(2))),
    ] {
        let stored = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored);
        archive.start_file(name, stored).unwrap();
        archive.write_all(&bytes).unwrap();
    }
    let bytes = archive.finish().unwrap().into_inner();
    let columns = "{time: t, command: command, angle: angle}";
    let (rms, _) = before(&of_file(&folder, "run.npz", bytes, columns));
    assert!((rms / plain() - 1.0).abs() < 1e-9, "{rms}");
}

#[test]
fn degrees_counts_and_per_cent_of_the_range_are_the_same_angles() {
    let mut folder = folder();
    let rows = rows(&folder);
    let expected = plain();
    let same = |folder: &Folder, unit: &str, of: &dyn Fn(f64) -> f64| {
        let columns = format!("{{unit: {unit}}}");
        let (rms, _) = before(&of_file(folder, "recording.csv", csv(&rows, of), &columns));
        assert!(
            (rms / expected - 1.0).abs() < 1e-6,
            "{unit}: {rms} {expected}"
        );
    };
    same(&folder, "deg", &f64::to_degrees);
    folder.drives["joints"][0]["zero_count"] = 2048.into();
    same(&folder, "counts", &|x| x / 1e-3 + 2048.0);
    folder.drives["joints"][0]["range_rad"] = json!([-1.0, 3.0]);
    same(&folder, "percent", &|x| 50.0 * (x - 1.0));
    folder.drives["joints"][0]["range_rad"] = Value::Null;
    let none = of_file(
        &folder,
        "recording.csv",
        csv(&rows, |x| x),
        "{unit: percent}",
    );
    assert!(
        none.err.contains("joints[0].range_rad") && none.err.contains("no range"),
        "{}",
        none.err
    );
    folder.robot = folder.robot.replace("axis=", "range=\"-1 3\" axis=");
    same(&folder, "percent", &|x| 50.0 * (x - 1.0));
}

/// A data set of LeRobot of two files with the angles in another unit.
fn data_set(folder: &Folder, data_path: &str, names: &Value, of: impl Fn(f64) -> f64) -> TempDir {
    let set = tempfile::tempdir().unwrap();
    let feature = json!({ "dtype": "float32", "shape": [2], "names": names });
    let info = json!({
        "fps": 100, "data_path": data_path,
        "features": { "action": feature, "observation.state": feature, "timestamp": { "dtype": "float32", "shape": [1], "names": null } },
    });
    std::fs::create_dir_all(set.path().join("meta")).unwrap();
    put(set.path(), "meta/info.json", info.to_string());
    std::fs::create_dir_all(set.path().join("data/chunk-000")).unwrap();
    let rows: Vec<[f64; 3]> = rows(folder)
        .into_iter()
        .map(|[time, command, angle]| [time, of(command), of(angle)])
        .collect();
    for file in 0..2 {
        let kind = if data_path.contains("file-") {
            "file"
        } else {
            "episode"
        };
        let digits = if kind == "file" { 3 } else { 6 };
        let name = format!("data/chunk-000/{kind}_{file:0digits$}.parquet");
        let name = name.replace("file_", "file-");
        put(set.path(), name, parquet(&rows, 2 * file));
    }
    put(set.path(), "robot.xml", &folder.robot);
    set
}

#[test]
fn the_folder_of_a_lerobot_data_set_becomes_a_pipeline_of_its_episodes() {
    let mut folder = folder();
    folder.robot = folder.robot.replace("axis=", "range=\"-1 3\" axis=");
    let three = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
    let two = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet";
    let motors = json!({ "motors": ["main_j1", "main_gripper"] });
    let per_cent = data_set(&folder, three, &json!(["j1.pos", "gripper.pos"]), |x| {
        50.0 * (x - 1.0)
    });
    let degrees = data_set(&folder, two, &motors, f64::to_degrees);
    let mut rms = Vec::new();
    for (set, unit, files) in [
        (per_cent, "percent", "chunk-*/file-*.parquet"),
        (degrees, "deg", "chunk-*/episode_*.parquet"),
    ] {
        let here = set.path();
        std::fs::create_dir_all(here.join("arm")).unwrap();
        put(here, "arm/drives.json", folder.drives.to_string());
        let answer = calib(here, "init arm --data . --mjcf robot.xml");
        assert_eq!(answer.code, Some(0), "{}", answer.both());
        assert!(answer.both().contains("gripper") && answer.both().contains("100 Hz"));
        let pipeline = read(here.join("arm/pipeline.yaml"));
        let lines = [
            files,
            "command: \"action[{j}]\"",
            "angle: \"observation.state[{j}]\"",
            "trajectory: \"episode_index\"",
            &format!("unit: {unit}   # CHECK"),
        ];
        for line in lines {
            assert!(pipeline.contains(line), "expected `{line}` in {pipeline}");
        }
        let diagnosed = calib(
            here,
            "diagnose --quiet --json arm/pipeline.yaml --store store",
        );
        let (error, _) = before(&diagnosed);
        rms.push(error);
    }
    // But for the steps, which each search halves where it finds what they err by.
    assert!((rms[0] / rms[1] - 1.0).abs() < 1e-3, "{rms:?}");
    let turned = data_set(&folder, three, &json!(["gripper.pos", "j1.pos"]), |x| x);
    let refused = calib(turned.path(), "init arm --data . --mjcf robot.xml");
    assert!(
        refused.err.contains("is number 2 of `observation.state`"),
        "{}",
        refused.both()
    );
}

#[test]
fn commands_by_which_causes_are_seen_hold_their_limits_and_say_what_each_part_is_for() {
    let folder = folder();
    let desk = tempfile::tempdir().unwrap();
    put(desk.path(), "robot.xml", &folder.robot);
    let excite = "excite --mjcf robot.xml --speed 90 --seconds 30 --rate 50 --out commands.csv";
    let none = calib(desk.path(), excite);
    assert!(none.err.contains("no range of j1"), "{}", none.both());
    let limits = format!("{excite} --limits -40:20 --home 5");
    let answer = calib(desk.path(), &limits);
    assert_eq!(answer.code, Some(0), "{}", answer.both());
    for word in ["slow", "sines", "ramps", "holds", "judge", "will not show"] {
        assert!(answer.out.contains(word), "no {word}: {}", answer.out);
    }
    let text = read(desk.path().join("commands.csv"));
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,traj,use,part,cmd1_rad"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1500);
    let command: Vec<f64> = rows.iter().map(|row| row[4].parse().unwrap()).collect();
    let [most, home] = [90f64, 5.0].map(f64::to_radians);
    for (pair, rows) in command.windows(2).zip(rows.windows(2)) {
        let speed = 50.0 * (pair[1] - pair[0]).abs();
        assert!(speed < 1.0001 * most, "{speed} in {:?}", rows[0]);
    }
    let in_limits = |angle: &f64| (-40.0..=20.0).contains(&angle.to_degrees());
    assert!(command.iter().all(in_limits));
    for traj in 1..=5 {
        let of_it = |row: &&Vec<&str>| row[1] == traj.to_string();
        let mut part = rows.iter().filter(of_it);
        let first: f64 = part.next().unwrap()[4].parse().unwrap();
        let last: f64 = part.next_back().unwrap()[4].parse().unwrap();
        assert!((first - home).abs() < 1e-6 && (last - home).abs() < 1e-6);
    }
    let widest = command
        .iter()
        .fold(0.0_f64, |most, angle| most.max((angle - home).abs()));
    assert!(widest.to_degrees() > 25.0, "moves by {widest} rad only");
    assert_eq!(calib(desk.path(), &limits).out, answer.out);
    let fast = calib(desk.path(), &format!("{limits} --harmonics 3"));
    assert!(fast.err.contains("cannot be used with"), "{}", fast.err);
}
