//! What a table of targets, or an option, must not state; files that cannot be read or written; one of them and several.

use super::{cell, put_columns};
use crate::answer::{Answer, calib, fed, has, put};
use calib::compensate::CorrectionTotals;

const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";

fn corrected(input: &str, more: &str) -> Answer {
    fed(cell(), &format!("compensate latest --quiet {more}"), input)
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
        let rows = |one: &str, other: &str| {
            format!("{HEADER},{name}\n10,20,-30,5,40,0,{one}\n10,20,-30,5,40,0,{other}\n")
        };
        let err = corrected(&rows("1", value), "").refused();
        has(&err, &format!("stdin:3: column 18: field 7: {allowed}"));
        corrected(&rows("0", ""), "").code(0);
    }
    for (option, allowed) in [
        ("--payload=-5", "--payload: expected a mass"),
        ("--temperature=-500", "--temperature: expected a temp"),
    ] {
        let refused = corrected(&format!("{HEADER}\n10,20,-30,5,40,0\n"), option);
        has(&refused.code(2).err, allowed);
    }
}

#[test]
fn a_column_of_parquet_is_held_to_the_same() {
    let columns: [(&str, &[f64]); 4] = [
        ("x_mm", &[800.0]),
        ("y_mm", &[40.0]),
        ("z_mm", &[900.0]),
        ("payload_kg", &[-5.0]),
    ];
    put_columns("loads.parquet", &columns);
    let refused = corrected("", "loads.parquet --out loads_c.parquet");
    has(
        &refused.refused(),
        "loads.parquet: row 1: column `payload_kg`: expected a mass of 0 or more, kg, found -5",
    );
    assert!(!cell().join("loads_c.parquet").exists());
}

#[test]
fn a_quaternion_of_zeros_is_no_orientation() {
    let refused = corrected("x_mm,y_mm,z_mm,qw,qx,qy,qz\n800,40,900,0,0,0,0\n", "");
    has(
        &refused.refused(),
        "stdin:2: columns qw, qx, qy, qz: the quaternion has length 0.0000, expected 1",
    );
    // Angles of zero are one.
    let angles = corrected("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n800,40,900,0,0,0\n", "");
    assert_eq!(angles.out.lines().count(), 2, "{}", angles.err);
}

#[test]
fn degrees_under_a_header_in_rad_are_found_by_the_turns_of_most_rows() {
    let header = HEADER.replace("deg", "rad");
    let err = corrected(&format!("{header}\n10,20,30,40,50,60\n"), "").refused();
    let turned = "stdin:2: in 1 of 1 row a joint is beyond one and a half turns, here joint 1 at 10 rad; allowed: up to 9.42 rad";
    has(&err, [turned, "if these are degrees"]);
    // One row of three may be odd.
    let sound = "0.1,0.2,-0.3,0.1,0.4,0\n";
    let odd = format!("{header}\n{sound}{sound}0.1,0.2,-0.3,0.1,0.4,10\n");
    corrected(&odd, "").code(0);
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
