//! `check` reads what it reports on: the robot file, the headers of the data files, and the marks that `init` left.

use crate::answer::{calib, has, put};
use tempfile::TempDir;

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

/// A folder with these files.
fn folder(robot: &str, pipeline: &str, arm: &str, points: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "robot.yaml", robot);
    put(folder.path(), "pipeline.yaml", pipeline);
    put(folder.path(), "arm.csv", arm);
    put(folder.path(), "points.csv", points);
    folder
}

/// Exit code, stdout and stderr of `check` with these files.
fn checked(robot: &str, pipeline: &str, arm: &str, points: &str) -> (i32, String, String) {
    let folder = folder(robot, pipeline, arm, points);
    let output = calib(folder.path(), "check pipeline.yaml");
    let is_clean = !folder.path().join(".calib").exists();
    assert!(is_clean, "check writes nothing");
    (output.code.unwrap(), output.out, output.err)
}

const ARM: &str = "id,q1,q2\nA,1,2\n";
const POINTS: &str = "id,x,y,z\nA,1,2,3\n";

#[test]
fn a_sound_pipeline_is_ready_and_shows_its_graph_on_demand() {
    let (code, out, err) = checked(ROBOT, PIPELINE, ARM, POINTS);
    let ready = "ready     2 stages are wired, rows are not read (--data reads them): calib run pipeline.yaml\n";
    assert_eq!((code, err.as_str(), out.as_str()), (0, "", ready));
    let folder = folder(ROBOT, PIPELINE, ARM, POINTS);
    let out = calib(folder.path(), "check pipeline.yaml --details").out;
    has(&out, "reads   robot  <- robot.robot");
}

#[test]
fn a_broken_robot_file_is_a_fault_with_its_place() {
    let (code, _, err) = checked(&ROBOT.replace("tool:", "tol:"), PIPELINE, ARM, POINTS);
    assert_eq!(code, 2, "{err}");
    has(&err, ["robot.yaml:8", "did you mean `tool`"]);
    let (code, _, err) = checked("\0 {no YAML: [", PIPELINE, ARM, POINTS);
    assert_eq!(code, 2, "{err}");
    has(&err, "robot.yaml:1");
}

#[test]
fn faults_of_the_yaml_and_of_the_robot_file_are_told_in_one_pass() {
    let pipeline = PIPELINE.replace("join: {by: id}", "join: {by: id}\n  - uses: splt");
    assert_ne!(pipeline, PIPELINE);
    let (code, _, err) = checked(&ROBOT.replace("tool:", "tol:"), &pipeline, ARM, POINTS);
    assert_eq!(code, 2, "{err}");
    has(&err, ["did you mean `tool`", "did you mean `split`"]);
}

#[test]
fn currents_of_an_arm_without_motor_constants_are_warned_of() {
    let pipeline = "calib: 1
name: currents
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest_torques
    with:
      files:
        - file: arm.csv
          columns:
            time: {column: t, unit: s}
            q: {column: \"q{j}\", unit: deg}
            current: {column: \"i{j}\", unit: A}
";
    let (code, out, err) = checked(ROBOT, pipeline, "t,q1,q2,i1,i2\n0,1,2,3,4\n", POINTS);
    assert_eq!(code, 0, "{err}");
    has(
        &out,
        [
            "joint 1, 2 has no reduction ratio or no motor constant",
            "ready",
        ],
    );
}

#[test]
fn columns_that_are_not_there_are_named_with_the_nearest_all_at_once() {
    let (code, _, err) = checked(ROBOT, PIPELINE, "id,q1,q_2\n", "ids,x,y,z_mm\n");
    assert_eq!(code, 10, "{err}");
    let named = [
        "arm.csv:1: no column `q2`",
        "did you mean `q1`",
        "points.csv:1: no column `id`, mapped to `point_id`; did you mean `ids`?",
        "points.csv:1: no column `z`",
    ];
    has(&err, named);
    let robot = ROBOT.replace("[0, 0, 400]}\ntool", "[0, 0]}\ntool");
    let (code, _, err) = checked(&robot, PIPELINE, ARM, "id,x,y,Z\n");
    assert_eq!(code, 2, "the robot's fault decides: {err}");
    has(&err, ["robot.yaml:7", "points.csv:1: no column `z`"]);
    let (code, _, err) = checked(ROBOT, PIPELINE, "", POINTS);
    let empty = "error: arm.csv: is empty; allowed: a header and at least one data row\n";
    assert_eq!((code, err.as_str()), (10, empty));
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
    let lines: Vec<&str> = out.lines().collect();
    let printed = [
        "replace   1 line: put your value there and delete the mark",
        "          robot.yaml:2: name: arm   # REPLACE",
        "check     2 lines: check that it is right and delete the mark",
        "          pipeline.yaml:12: q: {column: \"q{j}\", unit: deg}   # CHECK: no value is beyond 6.5",
        "          pipeline.yaml:20: join: {by: id}   # CHECK: the points' names",
        "not yet   a line is left to fill in; 2 stages are wired",
    ];
    assert_eq!(lines, printed, "{out}");
}

/// Exit code and stderr of a command on the pipeline, with a good robot and data of two days.
fn message_of(command: &str, pipeline: &str, tuesday: &str) -> (i32, String) {
    let folder = folder(ROBOT, pipeline, ARM, POINTS);
    std::fs::create_dir(folder.path().join("tue")).unwrap();
    put(folder.path(), "tue/arm.csv", ARM);
    put(folder.path(), "tue/points.csv", tuesday);
    let output = calib(folder.path(), &[command, "pipeline.yaml"]);
    (output.code.unwrap(), output.err)
}

/// A command on the pipeline ends so, and says this.
fn refuses(command: &str, pipeline: &str, expected: (i32, &str)) {
    let (code, err) = message_of(command, pipeline, POINTS);
    assert_eq!(code, expected.0, "{err}");
    has(&err, expected.1);
}

#[test]
fn a_set_that_the_split_does_not_deal_to_is_a_fault_with_its_place() {
    let with =
        |split: &str, more: &str| format!("{PIPELINE}  - uses: split\n    with: {split}\n{more}");
    let on = |set: &str| {
        format!("  - uses: identify\n    with: {{effects: [base_frame], on: [{set}]}}\n")
    };
    let silent = "  - uses: identify\n    with: {effects: [base_frame]}\n";
    let reference = "  - uses: validate\n    with: {reference: [{label: L, step: identify, set: fitt, mean_mm: 1}]}\n";
    for (split, more, expected) in [
        (
            "{by: every, n: 4}",
            on("Fit"),
            "pipeline.yaml:23:40: stages[3].with.on[0]: no set `Fit` in the split; did you mean `fit`? Allowed: fit, validate",
        ),
        (
            "{by: blocks, count: 4, sets: [training, test]}",
            silent.into(),
            "stages[3].with.on[0]: not given, which means `fit`: no set of the split. Allowed: test, training",
        ),
        (
            "{by: every, n: 4}",
            on("fit") + reference,
            "stages[4].with.reference[0].set: no set `fitt` in the split; did you mean `fit`?",
        ),
        (
            "{by: usage, sets: {a: fit, b: check}, blank: rest}",
            on("validate"),
            "no set `validate` in the split. Allowed: check, fit, rest",
        ),
    ] {
        refuses("check", &with(split, &more), (2, expected));
    }
    // Labels of the data may be any.
    let any = message_of("check", &with("{by: usage}", &on("Fit")), POINTS);
    assert_eq!(any, (0, String::new()));
}

#[test]
fn a_setting_that_only_the_data_refute_is_named_with_its_line_and_stage() {
    let identify = "  - uses: identify\n    with: {effects: [base_frame], on: [Fit]}\n";
    for (split, expected) in [
        (
            "{by: every, n: 4, rest: Fit}",
            "pipeline.yaml:21:26: stages[2].with.n: stage `split`: set `validate` gets none of the 1 row; say a smaller `n`",
        ),
        (
            "{by: usage, blank: fit}",
            "pipeline.yaml:23:40: stages[3].with.on[0]: stage `identify`: no row is in set `Fit`; did you mean `fit`? Allowed: fit",
        ),
    ] {
        let pipeline = format!("{PIPELINE}  - uses: split\n    with: {split}\n{identify}");
        refuses("run", &pipeline, (10, expected));
    }
}

#[test]
fn files_of_one_name_are_told_by_their_folder() {
    let pipeline = PIPELINE.replace(
        "join:",
        "later:\n        - files: [tue/arm.csv, tue/points.csv]\n      join:",
    );
    let (code, err) = message_of("check", &pipeline, "id,x,y\nA,1,2\n");
    assert!(
        code == 10 && err.contains("tue/points.csv:1: no column `z`"),
        "{err}"
    );
}

#[test]
fn a_name_that_is_too_long_says_how_long_it_may_be() {
    let (name, id) = ("n".repeat(65), "s".repeat(70));
    let pipeline = PIPELINE
        .replace("name: two", &format!("name: {name}"))
        .replace("  - uses: robot", &format!("  - id: {id}\n    uses: robot"));
    let named = format!("name: `{name}`: 65 letters; allowed: up to 64");
    refuses("check", &pipeline, (2, &named));
    let named = format!("stages[0].id: `{id}`: 70 letters; allowed: up to 64");
    refuses("check", &pipeline, (2, &named));
}

#[test]
fn check_of_the_data_fits_base_and_geometry_and_names_rows_that_have_no_partner() {
    use std::fmt::Write;
    let (mut arm, mut points) = (String::from("id,q1,q2\n"), String::from("id,x,y,z\n"));
    for k in 0..40_i32 {
        let q = [f64::from(k * 37 % 120 - 60), f64::from(k * 53 % 80 - 20)];
        let (s, c) = q[0].to_radians().sin_cos();
        let (t, d) = q[1].to_radians().sin_cos();
        let (along, up) = (800.0 * d, 400.0 - 800.0 * t);
        writeln!(arm, "P{k},{},{}", q[0], q[1]).unwrap();
        // The last five were measured under other names.
        let name = if k < 35 { "P" } else { "Q" };
        let (x, y) = (along * c - 50.0 * s, along * s + 50.0 * c);
        writeln!(points, "{name}{k},{x:.4},{y:.4},{up:.4}").unwrap();
    }
    let fits = "  - uses: split\n    with: {by: every, n: 4}\n  - id: nominal\n    uses: identify\n    with: {effects: [base_frame]}\n\
                \x20 - id: geometry\n    uses: identify\n    with: {effects: [base_frame, tool_offset, joint_offset, link_geometry]}\n";
    let folder = folder(ROBOT, &format!("{PIPELINE}{fits}"), &arm, &points);
    let output = calib(folder.path(), "check pipeline.yaml --data --store kept");
    let out = output.out.clone();
    assert_eq!(output.code, Some(0), "{out}{}", output.err);
    let parts = [
        "rows      35 used, of 35 points\n",
        "ranges    J1 -60.0 deg to 53.0 deg\n",
        "rejected  10 rows, unmatched: P35 (arm.csv: ",
        "after `nominal`, 35 points\n",
        "after `geometry`, 35 points\n",
        "parameters determined\n",
    ];
    has(&out, parts);
    assert!(folder.path().join("kept").exists() && !folder.path().join(".calib").exists());
    let run = calib(folder.path(), "run pipeline.yaml --store kept");
    let printed = run.err.clone();
    has(&printed, "geometry  cached");
    let diagnosed =
        format!("{PIPELINE}  - uses: split\n    with: {{by: every, n: 4}}\n  - uses: diagnose\n");
    put(folder.path(), "diagnosed.yaml", diagnosed);
    assert_eq!(
        calib(folder.path(), "run diagnosed.yaml --store kept").code,
        Some(0)
    );
    for what in ["diagnosed.yaml", "HEAD"] {
        let output = calib(folder.path(), &format!("diagnose {what} --store kept"));
        let out = output.out.clone();
        let printed = output.err;
        assert!(
            out.contains("rejected  10 rows, each with its reason in kept/tables/"),
            "{out}{printed}"
        );
        // HEAD is what `calib run` made, though something was diagnosed since.
        let is_said = printed.contains("HEAD is the last `calib run`, 01");
        assert_eq!(is_said, what == "HEAD", "{printed}");
    }
}
