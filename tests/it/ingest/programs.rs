//! Joint positions that a controller's program declares are the joint file of a recording.

use super::{refusal, robot, settings, take};
use crate::answer::{has, starts_with};
use crate::desk::{Desk, table};
use calib::stage::ingest::IngestReads;
use calib::table::{Intake, Rejected, RejectedRow};

const RAPID: &str = "MODULE Measure
  ! the poses of Monday
  CONST robtarget home:=[[600,0,900],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL CONST jointtarget p10:=[[0,-12.5,20,0,
      30,-90],[1500,9E9,9E9,9E9,9E9,9E9]];
  PERS jointtarget more{2}:=[[[1,2,3,4,5,6],[0.5,9E9,9E9,9E9,9E9,9E9]],[[-1,-2,-3,-4,-5,-6],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR jointtarget now;
  PROC main()
    MoveAbsJ p10\\NoEOffs,v100,fine,tool0;
    now:=CJointT();
  ENDPROC
ENDMODULE
";
const JOINED: &str = r#"
files:
  - file: PROGRAM
    columns:
      point_id: {column: name}
      q: {columns: [J1, J2, J3, J4, J5, J6], unit: deg}
  - file: points.csv
    columns:
      point_id: {column: id}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
join: {by: id}
"#;

fn joined(program: &str, pattern: &str) -> String {
    (1..=6).fold(JOINED.replace("PROGRAM", program), |text, j| {
        text.replace(&format!("J{j}"), &pattern.replace('#', &j.to_string()))
    })
}

fn desk(program: &str, text: &str, points: &str) -> Desk {
    Desk::default()
        .with(program, text)
        .with("points.csv", format!("id,x,y,z\n{points}"))
}

fn degrees(row: &[f64]) -> Vec<f64> {
    let rounded = |angle: &f64| (angle.to_degrees() * 1e9).round() / 1e9;
    row.iter().map(rounded).collect()
}

fn leaves_out_a_pose(desk: &Desk, program: &str) {
    let note = format!("{program}: 1 pose without joints left out");
    assert!(desk.notes.lock().unwrap().contains(&note));
}

#[test]
fn jointtargets_of_rapid_are_rows_in_the_order_of_the_file_and_robtargets_are_counted() {
    // A track that is not a joint of the robot file stands.
    let rapid = RAPID.replace("[0.5,", "[1500,");
    let desk = desk(
        "cell.MOD",
        &rapid,
        "more{2},1,2,3\nmore{1},4,5,6\np10,7,8,16\n",
    );
    let taken = take(&desk, &joined("cell.MOD", "rax_#"), robot("rrrrrr", 1.0)).unwrap();
    assert_eq!(taken.recording.point_id, ["p10", "more{1}", "more{2}"]);
    assert_eq!(
        degrees(taken.recording.q(0)),
        [0.0, -12.5, 20.0, 0.0, 30.0, -90.0]
    );
    assert_eq!(taken.recording.position[0], [0.007, 0.008, 0.016]);
    leaves_out_a_pose(&desk, "cell.MOD");
}

#[test]
fn positions_of_one_line_that_no_point_was_measured_at_are_rejected_together() {
    let desk = desk(
        "cell.MOD",
        &RAPID.replace("[0.5,", "[1500,"),
        "p10,7,8,16\n",
    );
    let yaml = joined("cell.MOD", "rax_#") + "max_rejected_fraction: 0.9\n";
    let robot = robot("rrrrrr", 1.0);
    let tables = desk.run(&settings(&yaml), IngestReads { robot }).unwrap();
    let rejected = table::<Rejected>(&tables).into_iter();
    let rejected: Vec<RejectedRow> = rejected.flat_map(|chunk| chunk.0).collect();
    let of_row = |row: &RejectedRow| (row.line, row.detail.matches("no usable row").count());
    let answer: Vec<(i64, usize)> = rejected.iter().map(of_row).collect();
    assert_eq!(answer, [(6, 2)], "{rejected:?}");
    let files = table::<Intake>(&tables).remove(0).0;
    assert_eq!([files[0].rejected, files[1].rejected], [2, 0]);
}

#[test]
fn an_external_axis_at_9e9_is_none_and_a_connected_one_is_a_joint() {
    let track = JOINED.replace(
        "columns: [J1, J2, J3, J4, J5, J6], unit: deg",
        "columns: [eax_a, rax_1, rax_2, rax_3, rax_4, rax_5, rax_6], unit: deg, linear_unit: mm",
    );
    let desk = desk(
        "cell.prg",
        RAPID,
        "more{1},4,5,6\np10,7,8,9\nmore{2},1,2,3\n",
    );
    let track = track.replace("PROGRAM", "cell.prg");
    let taken = take(&desk, &track, robot("prrrrrr", 1.0)).unwrap();
    assert_eq!(
        [taken.recording.q(0)[0], taken.recording.q(1)[0]],
        [1.5, 0.0005]
    );
    let mut rejected = taken.rejected.0.iter();
    let rejected = rejected.find(|row| row.file == "cell.prg").unwrap();
    let found = (rejected.line, rejected.detail.as_str());
    assert_eq!(found, (6, "eax_a is blank"));
    let none = RAPID.replace("1500", "9E9").replace("[0.5,", "[9E9,");
    let message = refusal(&desk.with("cell.prg", none), &track, robot("prrrrrr", 1.0));
    has(&message, "cell.prg:1: no column `eax_a`, mapped to `q`");
}

#[test]
fn axes_that_krl_declares_are_rows_and_its_poses_are_counted() {
    let text = "&ACCESS RVO\nDEFDAT MEASURE\n;FOLD\nDECL E6POS XHOME={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2,T 2,E1 0.0}\n\
                DECL E6AXIS XP1={A1 0.0,A2 -90.0,A3 90.5,A4 0.0,A5 1.0E1,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}\n\
                GLOBAL AXIS XP2={A1 5,A2 -80,A3 80,A4 1,A5 2,A6 3}\nDECL FDAT FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}\nENDDAT\n";
    let desk = desk("measure.dat", text, "XP1,1,2,3\nXP2,4,5,6\n");
    let taken = take(&desk, &joined("measure.dat", "A#"), robot("rrrrrr", 1.0)).unwrap();
    assert_eq!(taken.recording.point_id, ["XP1", "XP2"]);
    assert_eq!(
        degrees(taken.recording.q(0)),
        [0.0, -90.0, 90.5, 0.0, 10.0, 0.0]
    );
    leaves_out_a_pose(&desk, "measure.dat");
}

#[test]
fn a_table_of_text_that_ends_as_a_program_does_is_a_table() {
    let text = "name,A1,A2,A3,A4,A5,A6\nP1,1,2,3,4,5,6\n";
    let desk = desk("joints.dat", text, "P1,1,2,3\n");
    let taken = take(&desk, &joined("joints.dat", "A#"), robot("rrrrrr", 1.0)).unwrap();
    assert_eq!(taken.recording.rows(), 1);
}

#[test]
fn faults_of_a_program_have_their_places_and_a_program_without_joints_is_refused() {
    let refused = |text: &str| {
        refusal(
            &desk("cell.mod", text, "p10,1,2,3\n"),
            &joined("cell.mod", "rax_#"),
            robot("rrrrrr", 1.0),
        )
    };
    let short = RAPID
        .replace("[[0,-12.5,20,0,\n      30,-90]", "[[0,-12.5,20,0]")
        .replace("[1,2,3,4,5,6]", "[1,2,3,4,5,a6]");
    assert_eq!(
        refused(&short),
        "cell.mod:4:33: 4 numbers, expected 6 here in a jointtarget\ncell.mod:5:42: `a6` is no number"
    );
    let message = refused(
        "MODULE a\n CONST robtarget h:=[[6,0,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n",
    );
    starts_with(
        &message,
        "cell.mod: declares no joint position (1 pose without joints); allowed: declarations such as `CONST jointtarget",
    );
    let far = refused(&RAPID.replace("-12.5", "-12500"));
    starts_with(&far, "cell.mod:4:");
    let cut: String = RAPID.chars().take(330).collect();
    assert!(refused(&cut).starts_with("cell.mod:"));
}
