//! Compensation: inverse kinematics, least change, and the command `compensate` on texts of targets.

pub mod concealed;
mod controller_list;
mod counting;
mod counting_said;
mod doubtful;
mod framed;
mod gate;
mod listings;
mod maker;
mod round_trip;
mod sides;
mod standing;
mod stated;
pub mod true_error;
mod within;

use crate::answer::{self, ends_with, fed, has, put, read, starts_with};
use calib::compensate::{Chain, Nominal, SETTLED, ToolGoal, inverse, least_change};
use calib::robot::RobotModel;
use calib::twin::conceal::robots::Kind;
use nalgebra::Vector3;
use std::path::Path;
use std::process::Output;
use std::sync::{Arc, OnceLock};

#[test]
fn a_cartesian_pose_is_found_and_reached_within_the_limits() {
    let robot = RobotModel::new(Kind::Sr210d.description([0.0; 3]));
    let q = [0.3, 0.2, -0.4, 0.5, 0.8, -1.0];
    let wanted = ToolGoal {
        pose: robot.forward(&q),
        oriented: true,
    };
    let found = inverse(&robot, &wanted, &[0.0; 6]);
    let placed = Nominal::new(&robot).place(&found);
    assert!((placed.translation - wanted.pose.translation).norm() < 1e-9);
    assert!((placed.rotation - wanted.pose.rotation).norm() < 1e-9);
    for (joint, q) in robot.description().joints.iter().zip(&found) {
        let [lower, upper] = joint.limits.unwrap();
        assert!((lower..=upper).contains(q));
    }
}

#[test]
fn a_redundant_arm_moves_its_joints_no_more_than_needed() {
    let robot = RobotModel::new(Kind::Seven7r.description([60.0, 0.0, 20.0]));
    let home = [0.4, 0.7, -0.3, 1.0, 0.2, 0.6, -0.5];
    let mut wanted = ToolGoal {
        pose: robot.forward(&home),
        oriented: false,
    };
    wanted.pose.translation += Vector3::new(3e-3, -2e-3, 4e-3);
    let mut chain = Nominal::new(&robot);
    let found = least_change(&mut chain, &wanted, &home, &home);
    assert!(found.residual <= SETTLED && found.iterations < 8);
    // The change of least length lies in the row space of the Jacobian: no part of it leaves the point where it is.
    chain.place(&found.q);
    let change: Vec<f64> = found
        .q
        .iter()
        .zip(&home)
        .map(|(q, home)| q - home)
        .collect();
    let length = change.iter().map(|d| d * d).sum::<f64>();
    let jacobian = nalgebra::Matrix3xX::from_columns(
        &chain
            .velocities()
            .iter()
            .map(|v| Vector3::new(v[0], v[1], v[2]))
            .collect::<Vec<_>>(),
    );
    let solved = jacobian
        .clone()
        .svd(true, true)
        .solve(&(&jacobian * nalgebra::DVector::from_vec(change)), 1e-12)
        .unwrap();
    assert!((solved.norm_squared() / length - 1.0).abs() < 1e-6);
}

pub const ROBOT: &str = "calib_robot: 1
name: small
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 400]}
    - {axis: [0, 1, 0], point: [0, 0, 900]}
    - {axis: [1, 0, 0], point: [500, 0, 900]}
    - {axis: [0, 1, 0], point: [700, 0, 900]}
    - {axis: [1, 0, 0], point: [700, 0, 900]}
tool: {point: [830, 40, 930]}
joints:
  - {name: A1, limits: [-120, 120]}
  - {name: A2, limits: [-60, 75]}
  - {name: A3, limits: [-80, 75]}
  - {name: A4, limits: [-170, 170]}
  - {name: A5, limits: [-125, 125]}
  - {name: A6, limits: [-170, 170]}
";

pub const PIPELINE: &str = "calib: 1
name: small
seed: 3
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: simulate
    with:
      truth: {offset_deg: [0.02, -0.05, 0.04, 0.03, -0.06, 0.0], links: [{link: 2, shift_mm: [0.4, 0.2, -0.3]}]}
      poses: {floor_mm: 100, clearance_mm: 200}
      blocks: [{usage: fit, points: 60}, {usage: validate, points: 20}]
  - uses: split
    with: {by: usage}
  - uses: identify
    with: {on: [fit]}
";

/// A folder with a robot that was identified.
pub fn cell() -> &'static Path {
    static CELL: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = CELL.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), "robot.yaml", ROBOT);
        put(folder.path(), "pipeline.yaml", PIPELINE);
        answer::calib(folder.path(), "run pipeline.yaml --quiet").ok();
        folder
    });
    folder.path()
}

/// Runs calib as [`answer::fed`] does, for those that look at bytes.
pub fn calib(folder: &Path, arguments: &[&str], input: &str) -> Output {
    answer::output(folder, arguments, input)
}

#[test]
fn only_the_numbers_of_joints_change_in_a_text_of_targets() {
    let input = "\u{feff}name;A1_deg;A2_deg;A3_deg;A4_deg;A5_deg;A6_deg;note\r\nP1;10,5;20;-30;5;40;0;\"a;b\"\r\n\r\nP2; -10;  20.25;3e1;5;40;1; x \r\n";
    let output = fed(cell(), "compensate latest --plain --quiet", input).code(0);
    let corrected = output.out;
    assert_eq!(corrected.matches('\n').count(), 4);
    let (before, after): (Vec<&str>, Vec<&str>) = (
        input.split("\r\n").collect(),
        corrected.split("\r\n").collect(),
    );
    assert_eq!(
        (before[0], before[2], before[4]),
        (after[0], after[2], after[4])
    );
    starts_with(after[1], "P1;10,");
    ends_with(after[1], ";\"a;b\"");
    starts_with(after[3], "P2;-");
    ends_with(after[3], "; x ");
    let first: f64 = after[1]
        .split(';')
        .nth(1)
        .unwrap()
        .replace(',', ".")
        .parse()
        .unwrap();
    assert!((first - 10.5).abs() > 1e-3 && (first - 10.5).abs() < 0.5);
}

#[test]
fn units_of_targets_are_written_as_in_headers_of_recordings() {
    let row = "10,20,-30,5,40,0\n";
    let joints = |header: fn(usize) -> String| {
        let input = (1..=6).map(header).collect::<Vec<_>>().join(",") + "\n" + row;
        let output = fed(cell(), "compensate latest --plain --quiet", &input).code(0);
        output.out.lines().nth(1).unwrap().to_string()
    };
    let expected = joints(|n| format!("q{n}_deg"));
    assert_ne!(expected, row.trim_end());
    let written: [fn(usize) -> String; 6] = [
        |n| format!("J{n} [Grad]"),
        |n| format!("A{n} [\u{b0}]"),
        |n| format!("q{n} (Degrees)"),
        |n| format!("A{n} deg"),
        |n| format!("J{n}/Grad"),
        |n| format!("joint{n}_GRAD"),
    ];
    for header in written {
        assert_eq!(joints(header), expected, "{}", header(1));
    }
    let point = |name: &str| format!("{name} [Millimeter]");
    let input = ["x", "y", "z"].map(point).join(",") + ",x_c\n900,40,930,7\n";
    fed(cell(), "compensate latest --quiet", &input).code(0);
}

#[test]
fn what_is_known_of_a_target_stands_behind_it() {
    let input =
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n119.999,20,-30,5,40,179\n";
    let output = fed(cell(), "compensate pipeline.yaml -", input).code(0);
    let printed = output.out;
    let mut lines = printed.lines();
    assert!(
        lines
            .next()
            .unwrap()
            .ends_with("q6_deg,uncorrected_mm,residual_mm,iterations,sigma_mm,u95_mm,remark")
    );
    let first: Vec<&str> = lines.next().unwrap().split(',').collect();
    let number = |k: usize| first[k].parse::<f64>().unwrap();
    assert!((0.1..3.0).contains(&number(6)), "{first:?}");
    assert!(
        number(7) < 1e-5 && (2.0..8.0).contains(&number(8)),
        "{first:?}"
    );
    assert!((0.001..0.1).contains(&number(9)), "{first:?}");
    // Between 1.96 standard deviations along one axis and 2.8 along three, in lengths of one sigma 1.96 to 1.62.
    assert!((1.6..2.0).contains(&(number(10) / number(9))), "{first:?}");
    assert_eq!(first[11], "");
    assert!(
        lines.next().unwrap().contains("joint 6 beyond its limits"),
        "{printed}"
    );
    has(&output.err, "1 of them leaves the joint limits");
}

#[test]
fn joints_and_the_pose_they_stand_for_are_corrected_alike() {
    let joints = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,25,40,10\n";
    let robot = calib::robot::import::read_calib(
        calib::robot::import::RobotFileText {
            label: "robot.yaml",
            text: ROBOT,
        },
        None,
    )
    .unwrap();
    let q = [10.0f64, 20.0, -30.0, 25.0, 40.0, 10.0].map(f64::to_radians);
    let pose = RobotModel::new(robot.robot).forward(&q);
    let [x, y, z]: [f64; 3] = (pose.translation * 1e3).into();
    let turn = nalgebra::UnitQuaternion::from_matrix(&pose.rotation);
    let [qx, qy, qz, qw]: [f64; 4] = turn.coords.into();
    let cartesian = format!("x_mm,y_mm,z_mm,qw,qx,qy,qz\n{x},{y},{z},{qw},{qx},{qy},{qz}\n");
    let quiet = "compensate latest --plain --quiet";
    let by_joints = fed(cell(), &format!("{quiet} --orientation keep"), joints);
    let by_pose = fed(
        cell(),
        &format!("{quiet} --start 12,18,-28,20,45,5"),
        &cartesian,
    );
    let last = |output: &answer::Answer| -> Vec<f64> {
        let row: Vec<f64> = output
            .out
            .lines()
            .nth(1)
            .unwrap()
            .split(',')
            .map(|cell| cell.parse().unwrap())
            .collect();
        row[row.len() - 6..].to_vec()
    };
    for (a, b) in last(&by_joints).iter().zip(last(&by_pose)) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn a_faulty_text_of_targets_is_refused_with_line_and_column() {
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n";
    let open = header.replace("q6_deg", "q6_deg,note");
    let two_faults = [
        "stdin:3: column 5: field 3 is `x`, no number",
        "stdin:4: has 2 fields, the header 6",
    ];
    for (input, code, parts) in [
        (
            format!("{header}1,2,3,4,5,6\n1,2,x,4,5,6\n1,2\n"),
            10,
            &two_faults[..],
        ),
        // A quote inside a field is a letter of it; one that begins a field ends it.
        (
            format!("{open}1,2,3,4,5,6,3\" bolt\n1,2,3,4,5,6,\"3, and 4\n"),
            10,
            &["stdin:3: column 13: `\"` is not closed on its line"],
        ),
        (
            format!("{header}1,2,3,4,5,\"0.25\"0\n"),
            10,
            &["stdin:2: column 17: text behind the closing `\"` of a field; allowed:"],
        ),
        (
            header.replace("q6_deg", "\"q6_deg"),
            10,
            &["stdin:1: column 36: `\"` is not closed on its line"],
        ),
        (
            "A1,A2,A3,A4,A5,A6\n1,2,3,4,5,6\n".into(),
            2,
            &["`A1` has no unit", "--angle deg"],
        ),
        ("foo,bar\n1,2\n".into(), 2, &["no targets found"]),
    ] {
        let err = fed(cell(), "compensate latest --quiet", &input)
            .code(code)
            .err;
        parts.iter().for_each(|part| has(&err, *part));
        if code == 10 {
            assert_eq!(err.matches("stdin:").count(), parts.len(), "{err}");
        }
    }
}

#[test]
fn a_target_that_is_not_reached_gets_no_joints_and_the_others_do() {
    let input = "id,x_mm,y_mm,z_mm\nnear,800,40,900\nfar,7800,40,900\nnear,810,40,900\n";
    for more in ["", "--one-step"] {
        let output = fed(cell(), &format!("compensate latest --quiet {more}"), input).code(10);
        let (message, printed) = (output.out, output.err);
        let rows: Vec<Vec<&str>> = message
            .lines()
            .map(|line| line.split(',').collect())
            .collect();
        assert_eq!(
            (rows.len(), rows[0][4], rows[0][9]),
            (4, "q1_deg", "q6_deg")
        );
        for row in [&rows[1], &rows[3]] {
            assert!(
                row[4..10]
                    .iter()
                    .all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite)),
                "{message}"
            );
        }
        assert_eq!(rows[2][4..10], [""; 6]);
        // The arm reaches 1.4 m from its second axis, which stands 0.4 m above the base.
        let off: f64 = rows[2][11].parse().unwrap();
        assert!((6000.0..7000.0).contains(&off), "{message}");
        assert!(
            message
                .lines()
                .nth(2)
                .is_some_and(|row| row.contains(",\"not reached, 6") && row.ends_with(" mm off\"")),
            "{message}"
        );
        has(
            &printed,
            ["stdin:3: not reached, 6", " mm off: no joints are written"],
        );
        has(
            &printed,
            "warning: 1 of them could not be reached and has no joints (column `remark`)",
        );
    }
    let plain = fed(cell(), "compensate latest --quiet --plain", input).code(10);
    assert_eq!(plain.out.lines().nth(2), Some("far,7800,40,900,,,,,,"));
}

#[test]
fn a_pose_that_only_another_orientation_reaches_gets_no_joints() {
    // The wrist's limits do not bind the search: what is out of reach is the point 1.4 m away, with the tool turned back.
    let input = "x_mm,y_mm,z_mm,qw,qx,qy,qz\n1230,0,900,1,0,0,0\n1230,0,900,0,0,0,1\n";
    let out = fed(cell(), "compensate latest --quiet", input).code(10).out;
    has(out.lines().nth(2).unwrap(), [",,,,,,", "not reached"]);
}

/// A table of Parquet in the cell.
fn put_columns(name: &str, columns: &[(&str, &[f64])]) {
    use arrow::array::{ArrayRef, Float64Array, RecordBatch};
    let column = |values: &[f64]| Arc::new(Float64Array::from(values.to_vec())) as ArrayRef;
    let columns = columns.iter().map(|(name, values)| (*name, column(values)));
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let file = std::fs::File::create(cell().join(name)).unwrap();
    let mut writer = parquet::arrow::ArrowWriter::try_new(file, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

#[test]
fn a_target_that_is_not_reached_is_null_in_parquet() {
    use arrow::array::{Array, AsArray};
    use arrow::datatypes::Float64Type;
    put_columns(
        "points.parquet",
        &[
            ("x_mm", &[800.0, 7800.0]),
            ("y_mm", &[40.0; 2]),
            ("z_mm", &[900.0; 2]),
        ],
    );
    let output = answer::calib(
        cell(),
        "compensate latest points.parquet --out points_c.parquet --quiet",
    )
    .code(10);
    has(&output.err, "points.parquet: row 2: not reached, 6");
    let file = std::fs::File::open(cell().join("points_c.parquet")).unwrap();
    let builder =
        parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let batch = builder.build().unwrap().next().unwrap().unwrap();
    for joint in 1..=6 {
        let q = batch
            .column_by_name(&format!("q{joint}_rad"))
            .unwrap()
            .as_primitive::<Float64Type>();
        assert!(q.is_valid(0) && q.value(0).is_finite() && q.is_null(1));
    }
    let remark = batch.column_by_name("remark").unwrap().as_string::<i32>();
    assert!(remark.value(0).is_empty() && remark.value(1).starts_with("not reached, 6"));
}

#[test]
fn quiet_keeps_warnings_and_takes_the_summary() {
    let input = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n119.999,20,-30,5,40,179\n";
    let message_of = |more: &str| fed(cell(), &format!("compensate latest {more}"), input).err;
    let (loud, quiet) = (message_of(""), message_of("-q"));
    has(&loud, ["model: ", "1 target; "]);
    let warnings = loud.split_inclusive('\n');
    let warnings: String = warnings
        .filter(|line| line.starts_with("warning: "))
        .collect();
    has(&warnings, "1 of them leaves the joint limits");
    assert_eq!(quiet, warnings);
}

#[test]
fn partial_targets_of_a_program_stay_where_that_is_wished_and_nothing_is_written_otherwise() {
    let program = "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\r\nLIN {X 10,Y 20}\r\nPTP {A1 20}\r\n";
    put(cell(), "partial.src", program);
    let run = |more: &str| {
        let words = format!("compensate latest partial.src --out partial_c.src -q {more}");
        answer::calib(cell(), &words)
    };
    let whole = "a target is corrected whole or not at all";
    let missing = format!("partial.src:3:5: the target has no A2, A3, A4, A5, A6; {whole}");
    let err = run("").refused();
    has(
        &err,
        &format!("partial.src:2:5: the target has no Z, A, B, C; {whole}"),
    );
    has(&err, &missing);
    has(
        &err,
        "partial.src: partial targets stay as they are with --leave-partial",
    );
    assert!(!cell().join("partial_c.src").exists());
    let left = missing.replace("3:5: ", "3:5: left as it is: ");
    has(
        &run("--leave-partial").code(0).err,
        &format!("warning: {left}"),
    );
    let written = read(cell().join("partial_c.src"));
    let (mark, tail) = written.split_once('\n').unwrap();
    starts_with(mark, "; corrected by calib");
    assert!(
        tail.starts_with("PTP {A1 10.") || tail.starts_with("PTP {A1 9."),
        "{written}"
    );
    ends_with(&written, "\r\nLIN {X 10,Y 20}\r\nPTP {A1 20}\r\n");
}
