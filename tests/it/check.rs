//! `check` reads what it reports on: the robot file, the headers of the data files, and the marks that `init` left.

use crate::compensate::calib;

const ROBOT: &str = "calib_robot: 1
name: arm
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 400]}
tool: {point: [800, 50, 400]}
";

const PIPELINE: &str = "calib: 1
name: two
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: arm.csv
          columns:
            point_id: {column: id}
            q: {column: \"q{j}\", unit: deg}
        - file: points.csv
          columns:
            point_id: {column: id}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
      join: {by: id}
";

/// Exit code, stdout and stderr of `check` with these files.
fn checked(robot: &str, pipeline: &str, arm: &str, points: &str) -> (i32, String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("robot.yaml", robot), ("pipeline.yaml", pipeline), ("arm.csv", arm), ("points.csv", points)] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let output = calib(folder.path(), &["check", "pipeline.yaml"], "");
    assert!(!folder.path().join(".calib").exists(), "check writes nothing");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("a code"), text(output.stdout), text(output.stderr))
}

const ARM: &str = "id,q1,q2\nA,1,2\n";
const POINTS: &str = "id,x,y,z\nA,1,2,3\n";

#[test]
fn a_sound_pipeline_passes_and_shows_its_graph() {
    let (code, out, err) = checked(ROBOT, PIPELINE, ARM, POINTS);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("reads   robot  <- robot.robot"), "{out}");
}

#[test]
fn a_broken_robot_file_is_a_fault_with_its_place() {
    let (code, _, err) = checked(&ROBOT.replace("tool:", "tol:"), PIPELINE, ARM, POINTS);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("robot.yaml:8") && err.contains("did you mean `tool`"), "{err}");
    let (code, _, err) = checked("\0 {no YAML: [", PIPELINE, ARM, POINTS);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("robot.yaml:1"), "{err}");
}

#[test]
fn columns_that_are_not_there_are_named_with_the_nearest_all_at_once() {
    let (code, _, err) = checked(ROBOT, PIPELINE, "id,q1,q_2\n", "ids,x,y,z_mm\n");
    assert_eq!(code, 10, "{err}");
    for part in [
        "arm.csv:1: no column `q2`",
        "did you mean `q1`",
        "points.csv:1: no column `id`, mapped to `point_id`; did you mean `ids`?",
        "points.csv:1: no column `z`",
    ] {
        assert!(err.contains(part), "{part} in {err}");
    }
    let (code, _, err) = checked(&ROBOT.replace("[0, 0, 400]}\ntool", "[0, 0]}\ntool"), PIPELINE, ARM, "id,x,y,Z\n");
    assert_eq!(code, 2, "the robot's fault decides: {err}");
    assert!(err.contains("robot.yaml:7") && err.contains("points.csv:1: no column `z`"), "{err}");
    let (code, _, err) = checked(ROBOT, PIPELINE, "", POINTS);
    assert_eq!((code, err.as_str()), (10, "error: arm.csv: is empty; allowed: a header and at least one data row\n"));
}

#[test]
fn lines_that_init_marked_are_listed_and_are_no_faults() {
    let robot = ROBOT.replace("name: arm", "name: arm   # REPLACE");
    let pipeline = PIPELINE.replace("join: {by: id}", "join: {by: id}   # CHECK: the points' names").replace(
        "unit: deg}\n",
        "unit: deg}   # CHECK: no value is beyond 6.5\n            # not used: REPLACE in a comment is no mark\n",
    );
    let (code, out, err) = checked(&robot, &pipeline, ARM, POINTS);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("\nwarning: robot.yaml: a line is still marked REPLACE"), "{out}");
    assert!(out.contains("  2: name: arm   # REPLACE\n"), "{out}");
    assert!(out.contains("\nwarning: pipeline.yaml: 2 lines are still marked CHECK"), "{out}");
    assert!(out.contains("  20: join: {by: id}   # CHECK: the points' names\n"), "{out}");
    assert!(!out.contains("pipeline.yaml: a line is still marked REPLACE"), "{out}");
}
