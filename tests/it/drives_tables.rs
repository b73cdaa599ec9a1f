//! Recordings of drives in tables of other kinds and units: Parquet with lists (LeRobot), arrays of NumPy, degrees, counts, per cent.

use crate::answer::{Answer, calib, put};
use crate::drives::{Folder, folder};
use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray, RecordBatch};
use arrow::datatypes::Float64Type;
use serde_json::{Value, json};
use std::io::{Cursor, Write};
use std::sync::Arc;

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
