//! Files that others made: damaged ones are refused with their name, endless ones are not opened, a bug is one line and code 70.

use crate::answer::{Answer, command, fed, has, put};
use crate::compensate::cell;
use arrow::array::{ArrayRef, Float64Array, RecordBatch};
use calib::raw;
use parquet::arrow::ArrowWriter;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

/// Targets of six joints as Parquet.
fn targets() -> Vec<u8> {
    let column = |joint: usize| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(
            (0..3).map(|row| (row + joint) as f64 / 10.0),
        ))
    };
    let batch = RecordBatch::try_from_iter(
        (0..6).map(|joint| (format!("q{}_rad", joint + 1), column(joint))),
    )
    .unwrap();
    let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.into_inner().unwrap()
}

/// With the backtraces that somebody may have asked for.
fn run(folder: &Path, words: &str) -> Answer {
    let mut command = command(words);
    let command = command.current_dir(folder).env("RUST_BACKTRACE", "1");
    Answer::of(command.output().unwrap())
}

#[test]
fn a_decoder_that_gives_up_is_a_fault_of_the_file() {
    let sound = targets();
    assert_eq!(
        raw::parquet(bytes::Bytes::from(sound.clone()), 8)
            .unwrap()
            .whole()
            .unwrap()
            .num_rows(),
        3
    );
    // Every byte of the footer, where lengths, types and places stand, one bit each.
    let footer = sound.len()
        - 8
        - u32::from_le_bytes(sound[sound.len() - 8..][..4].try_into().unwrap()) as usize;
    let damaged = (footer..sound.len()).map(|at| {
        let mut damaged = sound.clone();
        damaged[at] ^= 1 << (at % 8);
        damaged
    });
    let read = |bytes: &Vec<u8>| {
        raw::parquet(bytes::Bytes::from(bytes.clone()), 8).and_then(raw::BatchFile::whole)
    };
    let gives_up: Vec<Vec<u8>> = damaged
        .filter(|bytes| read(bytes).is_err_and(|message| message.contains("its decoder gives up")))
        .collect();
    // Else this test tests nothing: take other bits.
    assert!(!gives_up.is_empty());
    let folder = cell();
    put(folder, "damaged.parquet", &gives_up[0]);
    put(
        folder,
        "raw.yaml",
        "calib: 1\nname: raw\nstages:\n  - uses: robot\n    with: {file: robot.yaml}\n  - uses: ingest\n    with:\n      files:\n        \
         - file: damaged.parquet\n          columns: {q: {column: \"q{j}_rad\", unit: rad}, x: {column: q1_rad, unit: mm}, \
         y: {column: q2_rad, unit: mm}, z: {column: q3_rad, unit: mm}}\n",
    );
    for (words, code) in [
        (
            "compensate latest damaged.parquet --out raw_out.parquet",
            10,
        ),
        (
            "compensate damaged.parquet --robot robot.yaml damaged.parquet",
            10,
        ),
        ("poses robot.yaml --against damaged.parquet", 10),
        ("schema check damaged.parquet --as recording", 10),
        ("run raw.yaml --quiet --store raw_store", 10),
        ("diff damaged.parquet robot.yaml --key q1_rad", 2),
    ] {
        let printed = run(folder, words).code(code).err;
        assert!(
            code == 2 || printed.contains("damaged.parquet") && printed.contains("gives up"),
            "{words}: {printed}"
        );
        assert!(
            !printed.contains("panicked") && !printed.contains("backtrace"),
            "{words}: {printed}"
        );
    }
    assert!(!folder.join("raw_out.parquet").exists());
}

#[cfg(unix)]
#[test]
fn what_never_ends_is_not_opened_where_a_file_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = Command::new("mkfifo")
        .arg(folder.join("pipe.yaml"))
        .arg(folder.join("pipe.csv"))
        .arg(folder.join("pipe.parquet"))
        .status();
    assert!(made.unwrap().success());
    std::fs::copy(cell().join("robot.yaml"), folder.join("robot.yaml")).unwrap();
    let pipeline = "calib: 1\nname: raw\nstages:\n  - uses: robot\n    with: {file: FILE}\n";
    put(
        folder,
        "of_pipe.yaml",
        pipeline.replace("FILE", "pipe.yaml"),
    );
    put(
        folder,
        "of_device.yaml",
        pipeline.replace("FILE", "/dev/zero"),
    );
    put(folder, "of_folder.yaml", pipeline.replace("FILE", "/"));
    for (words, what) in [
        (
            "check pipe.yaml",
            "pipe.yaml: is a named pipe, not a regular file",
        ),
        (
            "run /dev/zero",
            "/dev/zero: is a device, not a regular file",
        ),
        (
            "run of_pipe.yaml --quiet",
            "pipe.yaml: cannot be read: is a named pipe",
        ),
        (
            "run of_device.yaml --quiet",
            "/dev/zero: cannot be read: is a device",
        ),
        ("run of_folder.yaml --quiet", "`/` is a folder"),
        ("poses /dev/zero", "/dev/zero: cannot be read: is a device"),
        ("poses robot.yaml --against pipe.parquet", "is a named pipe"),
        (
            "compensate pipe.parquet --robot robot.yaml",
            "pipe.parquet: cannot be read: is a named pipe",
        ),
        (
            "diff pipe.parquet pipe.parquet",
            "pipe.parquet: cannot be read: is a named pipe",
        ),
        (
            "schema check pipe.parquet",
            "pipe.parquet: cannot be read: is a named pipe",
        ),
        ("init made --data pipe.csv", "is a named pipe"),
        ("fleet run pipe.yaml", "is a named pipe"),
    ] {
        let answer = run(folder, words);
        assert!(matches!(answer.code, Some(2 | 10)), "{words}: {answer:?}");
        has(&answer.err, what);
    }
    let made = Command::new("mkfifo")
        .arg(cell().join("pipe.csv"))
        .arg(cell().join("pipe.src"))
        .status();
    assert!(made.unwrap().success());
    for targets in ["/dev/zero", "pipe.csv", "pipe.src"] {
        let answer = run(cell(), &format!("compensate latest {targets}"));
        assert!(matches!(answer.code, Some(2 | 10)), "{answer:?}");
        has(&answer.err, "not a regular file");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_of_targets_is_read_and_one_line_without_end_refused() {
    let sound = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,6\n";
    fed(cell(), "compensate latest", sound).ok();
    let zero = std::fs::File::open("/dev/zero").unwrap();
    let mut endless = command("compensate latest");
    let endless = endless.current_dir(cell()).stdin(zero).output().unwrap();
    let refused = Answer::of(endless).code(10);
    has(&refused.err, "stdin: has a line of more than 16 MB");
}

#[test]
fn a_target_that_no_robot_has_is_refused_with_its_line() {
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,6\n";
    for (input, fault) in [
        (
            format!("{header}1,2,3,4,5,1e308\n"),
            "stdin:3: 1.7453292519943295e306 rad is more than 63 rad",
        ),
        (
            "x_mm,y_mm,z_mm\n1e308,0,0\n".into(),
            "stdin:2: 1e305 m is more than 1000 m",
        ),
    ] {
        has(
            &fed(cell(), "compensate latest", &input).code(10).err,
            fault,
        );
    }
}
