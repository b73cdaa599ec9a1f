//! What a table of targets, or an option, must not state; files that cannot be read or written; one of them and several.

use super::cell;
use crate::answer::{calib, fed, has, put};
use calib::compensate::CorrectionTotals;

const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";

/// Code, stderr and stdout of targets on stdin.
fn corrected(input: &str, more: &str) -> (Option<i32>, String, String) {
    let output = fed(cell(), &format!("compensate latest --quiet {more}"), input);
    (output.code, output.err, output.out)
}

#[test]
fn what_no_target_can_state_is_a_fault_with_row_and_column_and_nothing_is_written() {
    for (name, value, allowed) in [
        (
            "payload_kg",
            "-5",
            "expected a mass of 0 or more, kg, found -5",
        ),
        (
            "temp_c",
            "-500",
            "expected a temperature above -273.15 C, found -500",
        ),
        (
            "dir1",
            "7",
            "expected a direction: 1, -1, or 0 where it is not known, found 7",
        ),
    ] {
        let (code, printed, written) = corrected(
            &format!("{HEADER},{name}\n10,20,-30,5,40,0,1\n10,20,-30,5,40,0,{value}\n"),
            "",
        );
        assert_eq!((code, written.as_str()), (Some(10), ""), "{printed}");
        has(&printed, &format!("stdin:3: column 18: field 7: {allowed}"));
        let (code, printed, _) = corrected(
            &format!("{HEADER},{name}\n10,20,-30,5,40,0,0\n10,20,-30,5,40,0,\n"),
            "",
        );
        assert_eq!(code, Some(0), "{printed}");
    }
    for (option, allowed) in [
        ("--payload=-5", "--payload: expected a mass"),
        ("--temperature=-500", "--temperature: expected a temp"),
    ] {
        let (code, printed, _) = corrected(&format!("{HEADER}\n10,20,-30,5,40,0\n"), option);
        assert_eq!(code, Some(2), "{printed}");
        has(&printed, allowed);
    }
}

#[test]
fn a_column_of_parquet_is_held_to_the_same() {
    use arrow::array::{ArrayRef, Float64Array, RecordBatch};
    let column = |value: f64| -> ArrayRef { std::sync::Arc::new(Float64Array::from(vec![value])) };
    let columns = [
        ("x_mm", 800.0),
        ("y_mm", 40.0),
        ("z_mm", 900.0),
        ("payload_kg", -5.0),
    ];
    let batch =
        RecordBatch::try_from_iter(columns.map(|(name, value)| (name, column(value)))).unwrap();
    let file = std::fs::File::create(cell().join("loads.parquet")).unwrap();
    let mut writer = parquet::arrow::ArrowWriter::try_new(file, batch.schema(), None).unwrap();
    writer
        .write(&batch)
        .and_then(|()| writer.close().map(|_| ()))
        .unwrap();
    let (code, printed, _) = corrected("", "loads.parquet --out loads_c.parquet");
    assert_eq!(code, Some(10), "{printed}");
    has(
        &printed,
        "loads.parquet: row 1: column `payload_kg`: expected a mass of 0 or more, kg, found -5",
    );
    assert!(!cell().join("loads_c.parquet").exists());
}

#[test]
fn a_quaternion_of_zeros_is_no_orientation() {
    let (code, printed, written) =
        corrected("x_mm,y_mm,z_mm,qw,qx,qy,qz\n800,40,900,0,0,0,0\n", "");
    assert_eq!((code, written.as_str()), (Some(10), ""), "{printed}");
    has(
        &printed,
        "stdin:2: columns qw, qx, qy, qz: the quaternion has length 0.0000, expected 1",
    );
    // Angles of zero are one.
    let (_, printed, written) =
        corrected("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n800,40,900,0,0,0\n", "");
    assert_eq!(written.lines().count(), 2, "{printed}");
}

#[test]
fn degrees_under_a_header_in_rad_are_found_by_the_turns_of_most_rows() {
    let header = HEADER.replace("deg", "rad");
    let (code, printed, written) = corrected(&format!("{header}\n10,20,30,40,50,60\n"), "");
    assert_eq!((code, written.as_str()), (Some(10), ""), "{printed}");
    let turned = "stdin:2: in 1 of 1 row a joint is beyond one and a half turns, here joint 1 at 10 rad; allowed: up to 9.42 rad";
    has(&printed, [turned, "if these are degrees"]);
    let sound = "0.1,0.2,-0.3,0.1,0.4,0\n";
    let (code, printed, _) = corrected(
        &format!("{header}\n{sound}{sound}0.1,0.2,-0.3,0.1,0.4,10\n"),
        "",
    );
    assert_eq!(code, Some(0), "one row of three may be odd: {printed}");
}

#[test]
fn files_that_cannot_be_read_or_written_are_named_before_a_pipeline_is_run_for_them() {
    let folder = tempfile::tempdir().unwrap();
    for file in ["robot.yaml", "pipeline.yaml"] {
        std::fs::copy(cell().join(file), folder.path().join(file)).unwrap();
    }
    put(
        folder.path(),
        "t.csv",
        format!("{HEADER}\n10,20,-30,5,40,0\n"),
    );
    let refused = |arguments: &str| {
        let output = calib(
            folder.path(),
            &format!("compensate pipeline.yaml -q {arguments}"),
        )
        .code(2);
        assert!(!folder.path().join(".calib").exists(), "{arguments:?}");
        output.err
    };
    let printed = refused("nofile.csv --out nodir/x.csv");
    has(
        &printed,
        [
            "nofile.csv: cannot be read: ",
            "--out: nodir/x.csv: there is no folder nodir;",
        ],
    );
    assert!(refused("t.csv --out .").contains("--out: . is a folder: name a file"));
    assert!(
        refused("t.csv --out x.parquet").contains("--out: must have the format of the targets")
    );
}

#[test]
fn one_of_the_targets_is_told_as_one() {
    let totals = CorrectionTotals {
        turned: 2,
        beyond_limits: 2,
        beyond_measured: 1,
        ..CorrectionTotals::default()
    };
    let messages: Vec<String> = totals.warnings().collect();
    assert_eq!(
        messages,
        [
            "2 of them are reached in position but not in orientation: the wrist is singular there",
            "2 of them leave the joint limits",
            "1 of them is outside of what was measured: the model extrapolates there",
        ]
    );
}
