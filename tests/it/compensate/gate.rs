//! What is refused though it can be computed, and that one who insists is told so in what is written.

use super::maker::{PLAIN, recorded};
use super::true_error::Cell;
use super::{PIPELINE, ROBOT, cell};
use crate::answer::{calib, ends_with, fed, has, put, read, starts_with};
use crate::fixture::robot_of;

const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n";

fn run(arguments: &str, input: &str) -> (Option<i32>, String, String) {
    fed(cell(), arguments, input).parts()
}

#[test]
fn a_correction_above_its_limit_has_no_joints_and_one_who_insists_is_told() {
    let (code, out, err) = run("compensate latest --max-correction 0.01", HEADER);
    assert_eq!(code, Some(10), "{err}");
    assert!(
        out.lines()
            .nth(1)
            .is_some_and(|line| line.starts_with(",,,,,,")),
        "{out}"
    );
    assert!(
        out.contains("at most 0.01 mm allowed (--max-correction)") && err.contains("refused"),
        "{out}{err}"
    );
    let (code, out, err) = run("compensate latest --max-correction 0.01 --force", HEADER);
    assert_eq!(code, Some(0), "{err}");
    assert!(
        out.contains("written because of --force: corrected by") && !out.contains(",,,"),
        "{out}"
    );
    let (code, out, _) = run("compensate latest --max-turn 0.0001", HEADER);
    assert_eq!(code, Some(10));
    has(&out, "at most 0.0001 deg allowed (--max-turn)");
    let program = "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n";
    put(cell(), "far.src", program);
    let (code, out, err) = run("compensate latest far.src --max-correction 0.01", "");
    assert_eq!((code, out.as_str()), (Some(10), ""));
    has(&err, "far.src:1:9: refused: corrected by");
}

#[test]
fn what_calib_corrected_is_not_corrected_once_more() {
    let (_, once, err) = run("compensate latest", HEADER);
    let (code, out, printed) = run("compensate latest", &once);
    assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
    has(&printed, ["was compensated by calib already", "--force"]);
    for (name, head, target, second) in [
        (
            "twice.src",
            "&ACCESS RVP\r\nDEF twice( )\r\n",
            "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\r\nEND\r\n",
            "&ACCESS RVP\r\nDEF twice( )\r\n; ",
        ),
        (
            "twice.mod",
            "MODULE m\n",
            "MoveAbsJ [[1,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\nENDMODULE\n",
            "MODULE m\n! ",
        ),
    ] {
        put(cell(), name, format!("{head}{target}"));
        let (code, once, err) = run(&format!("compensate latest {name}"), "");
        assert_eq!(code, Some(0), "{err}");
        starts_with(&once, &format!("{second}corrected by calib from "));
        put(cell(), name, &once);
        let (code, out, err) = run(&format!("compensate latest {name}"), "");
        assert_eq!((code, out.as_str()), (Some(10), ""));
        has(&err, &format!("{name}: was compensated by calib already"));
        assert_eq!(
            run(&format!("compensate latest {name} --force"), "").0,
            Some(0)
        );
    }
}

#[test]
fn a_cartesian_program_in_a_frame_that_is_not_applied_is_refused_by_line() {
    let tail = "[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let text = format!("MODULE m\nMoveL [[900,40,930],{tail},v1,z1,t\\WObj:=fixture;\nENDMODULE\n");
    put(cell(), "wobj.mod", text);
    let (code, out, err) = run("compensate latest wobj.mod", "");
    assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
    has(
        &err,
        ["wobj.mod:2:", "work object `fixture`", "--assume-frames"],
    );
    let (code, _, err) = run("compensate latest wobj.mod --assume-frames", "");
    assert_eq!(code, Some(0), "{err}");
    has(&err, "warning: wobj.mod:2:");
}

#[test]
fn a_target_in_a_work_object_is_corrected_where_it_stands() {
    let tail = "[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let numbers = |text: &str| -> Vec<f64> {
        let line = text.lines().find(|line| line.starts_with("MoveL")).unwrap();
        let cut = |c: char| !(c.is_ascii_digit() || "+-.".contains(c));
        line[5..]
            .split(cut)
            .filter_map(|word| word.parse().ok())
            .take(7)
            .collect()
    };
    let plain = format!(
        "MODULE m\nMoveL [[900,40,930],[1,0,0,0],[9E9,9E9,9E9,9E9],{tail},v1,z1,t;\nENDMODULE\n"
    );
    put(cell(), "plain.mod", plain);
    let (code, plain, err) = run("compensate latest plain.mod", "");
    assert_eq!(code, Some(0), "{err}");
    // Moved by 100, 20, -30 mm and turned by half a turn about z: x and y change their signs.
    let object =
        "PERS wobjdata fixture:=[FALSE,TRUE,\"\",[[100,0,0],[0,0,0,1]],[[0,-20,-30],[1,0,0,0]]];\n";
    let program = format!(
        "MODULE m\n{object}MoveL [[-800,-20,960],[0,0,0,1],[9E9,9E9,9E9,9E9],{tail},v1,z1,t\\WObj:=fixture;\nENDMODULE\n"
    );
    put(cell(), "object.mod", program);
    let (code, within, err) = run("compensate latest object.mod", "");
    assert_eq!(code, Some(0), "{err}");
    has(
        &err,
        "work object `fixture` is applied, in the robot's base",
    );
    let (plain, within) = (numbers(&plain), numbers(&within));
    let there = [100.0 - within[0], 20.0 - within[1], within[2] - 30.0];
    assert!(
        there.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 2e-5),
        "{there:?} {plain:?}"
    );
    assert!((plain[0] - 900.0).abs() > 0.01, "{plain:?}");
}

#[test]
fn a_table_of_parameters_without_a_verdict_is_held_to_the_same_limits() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", ROBOT);
    let far = PIPELINE.replace("shift_mm: [0.4, 0.2, -0.3]", "shift_mm: [80.0, 0.2, -0.3]");
    for (pipeline, refused) in [(PIPELINE.to_string(), false), (far, true)] {
        put(here, "pipeline.yaml", pipeline);
        calib(here, "run pipeline.yaml --quiet");
        let tables = here.join(".calib/tables");
        let table = newest_parameters(&tables);
        let bare = here.join("bare.parquet");
        std::fs::copy(table, &bare).unwrap();
        let given = "compensate bare.parquet --robot robot.yaml --angle deg";
        let message_of = |more: &str| {
            let output = fed(here, &format!("{given} {more}"), HEADER);
            (output.code, output.err.clone(), output.out.len())
        };
        let (code, err, bytes) = message_of("");
        if refused {
            assert_eq!((code, bytes), (Some(10), 0), "{err}");
            has(
                &err,
                [
                    "refused: joint_offset at joint 2 is",
                    "from the robot file's",
                ],
            );
            let (code, err, _) = message_of("--force");
            assert!(
                code != Some(2) && err.contains("used because of --force: joint_offset at joint 2"),
                "{err}"
            );
        } else {
            assert_eq!(code, Some(0), "{err}");
            assert_eq!(message_of("--max-correction 0.01").0, Some(10));
            assert_eq!(message_of("--max-shift 0.001").0, Some(10));
        }
    }
}

/// The table of parameters that was written last below a folder.
fn newest_parameters(folder: &std::path::Path) -> std::path::PathBuf {
    let mut all: Vec<std::path::PathBuf> = vec![folder.into()];
    let mut found = Vec::new();
    while let Some(next) = all.pop() {
        for entry in std::fs::read_dir(next)
            .unwrap()
            .map(|entry| entry.unwrap().path())
        {
            if entry.is_dir() {
                all.push(entry);
            } else if entry
                .file_name()
                .is_some_and(|name| name.to_string_lossy().contains("parameters"))
            {
                found.push((
                    entry.metadata().and_then(|data| data.modified()).unwrap(),
                    entry,
                ));
            }
        }
    }
    found.into_iter().max().unwrap().1
}

#[test]
fn an_output_never_takes_the_place_of_a_file_that_was_read() {
    for file in ["robot.yaml", "pipeline.yaml"] {
        let folder = tempfile::tempdir().unwrap();
        for name in ["robot.yaml", "pipeline.yaml"] {
            std::fs::copy(cell().join(name), folder.path().join(name)).unwrap();
        }
        let before = std::fs::read(folder.path().join(file)).unwrap();
        let output = calib(
            folder.path(),
            &format!("export pipeline.yaml --format json --out {file}"),
        );
        let printed = output.err.clone();
        assert_eq!(output.code, Some(2), "{printed}");
        has(&printed, "that the model was made from");
        assert_eq!(std::fs::read(folder.path().join(file)).unwrap(), before);
    }
}

#[test]
fn an_arm_far_from_the_robot_file_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", ROBOT);
    let truth = PIPELINE.replace("shift_mm: [0.4, 0.2, -0.3]", "shift_mm: [80.0, 0.2, -0.3]");
    put(here, "pipeline.yaml", truth);
    for verb in [
        "compensate pipeline.yaml",
        "export pipeline.yaml --format json",
    ] {
        let output = fed(here, verb, HEADER);
        let printed = output.err.clone();
        assert_eq!((output.code, output.out.len()), (Some(10), 0), "{printed}");
        has(
            &printed,
            [
                " from the robot file's",
                "refused: the set-up is wrong",
                "--force",
            ],
        );
        assert!(fed(here, &format!("{verb} --force"), HEADER).code != Some(2));
    }
}

#[test]
fn a_table_whose_common_normals_are_far_from_the_arm_is_refused_with_the_formats_that_carry_it() {
    for format in ["dh", "mdh"] {
        let (code, out, err) = run(&format!("export latest --format {format}"), "");
        assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
        has(&err, ["axes 2 and 3 are", "--format urdf or mjcf"]);
    }
}

#[test]
fn targets_that_state_no_payload_are_refused_where_the_model_depends_on_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", ROBOT);
    let loaded = PIPELINE
        .replace("{usage: fit, points: 60}", "{usage: fit, points: 40}, {usage: fit, points: 40, payload_kg: 50}")
        .replace("{on: [fit]}", "{on: [fit], effects: [base_frame, tool_offset, joint_offset, link_geometry, joint_compliance]}");
    put(here, "pipeline.yaml", loaded);
    put(here, "p.src", "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n");
    for file in ["-", "p.src"] {
        let output = fed(
            here,
            &format!("compensate pipeline.yaml {file} --quiet"),
            HEADER,
        );
        let printed = output.err.clone();
        assert_eq!((output.code, output.out.len()), (Some(10), 0), "{printed}");
        has(&printed, ["states no payload", "measured up to 50 kg"]);
        fed(
            here,
            &format!("compensate pipeline.yaml {file} --quiet --payload 0"),
            HEADER,
        )
        .code(0);
    }
    // A program says it by the tool of its motions, or by $LOAD.
    let joints = "MoveAbsJ [[10,20,-30,5,40,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,gun;\n";
    let tool = "PERS tooldata gun:=[TRUE,[[0,0,0],[1,0,0,0]],[50,[0,0,0],[1,0,0,0],0,0,0]];\n";
    for (file, stating, target) in [
        ("t.mod", tool, joints),
        (
            "t.src",
            "$LOAD={M 50,CM {X 0,Y 0,Z 0,A 0,B 0,C 0}}\n",
            "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n",
        ),
    ] {
        let message_of = |text: &str, more: &str| {
            put(here, file, text);
            let output = calib(here, &format!("compensate pipeline.yaml {file} {more}"));
            let (code, out, err) = output.parts();
            (
                code,
                out.lines()
                    .filter(|line| line.contains("20.") || line.contains("19."))
                    .collect::<String>(),
                err,
            )
        };
        let (code, out, err) = message_of(target, "");
        assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
        let (code, by_program, err) = message_of(&format!("{stating}{target}"), "");
        assert_eq!(code, Some(0), "{err}");
        has(&err, "payload 50 kg, as");
        assert_eq!(by_program, message_of(target, "--payload 50").1);
        let (_, other, err) = message_of(&format!("{stating}{target}"), "--payload 0");
        has(
            &err,
            "the program states a payload of 50 kg, --payload 0 kg, which is used",
        );
        assert_ne!(by_program, other);
    }
    let column = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n10,20,-30,5,40,0,50\n";
    assert_eq!(
        fed(here, "compensate pipeline.yaml --quiet", column).code,
        Some(0)
    );
}

#[test]
fn how_far_a_model_may_be_from_the_robot_file_is_for_the_user_to_say() {
    for (option, limit, unit) in [
        ("--max-shift", "0.001", "mm"),
        ("--max-tilt", "0.0001", "deg"),
    ] {
        for verb in ["compensate latest", "export latest --format json"] {
            let (code, out, err) = run(&format!("{verb} {option} {limit}"), HEADER);
            assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
            has(&err, &format!("at most {limit} {unit} allowed ({option})"));
        }
        let (code, _, err) = run(&format!("compensate latest {option} -1"), HEADER);
        assert_eq!(code, Some(2), "{err}");
    }
}

#[test]
fn a_pipeline_whose_report_does_not_accept_it_is_refused_as_its_run_is() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(here, "robot.yaml", ROBOT);
    let pipeline = |limits: &str| {
        format!(
            "{PIPELINE}  - uses: validate\n  - uses: report\n    with: {{limits: {{{limits}}}}}\n"
        )
    };
    let ran = |arguments: &str| {
        let output = fed(here, arguments, HEADER);
        (output.code, output.err.clone())
    };
    put(here, "strict.yaml", pipeline("max_mm: 0.0001"));
    assert_eq!(ran("run strict.yaml --quiet").0, Some(1));
    for model in ["strict.yaml", "latest"] {
        let (code, err) = ran(&format!("compensate {model}"));
        assert_eq!(code, Some(10), "{model}: {err}");
        assert!(
            err.contains("refused: not accepted") && err.contains("at most 0.0001 mm allowed"),
            "{model}: {err}"
        );
        assert_eq!(ran(&format!("export {model} --format json")).0, Some(10));
        let (code, err) = ran(&format!("compensate {model} --force"));
        assert_eq!(code, Some(0), "{model}: {err}");
        assert!(
            err.contains("warning: used because of --force: not accepted"),
            "{model}: {err}"
        );
    }
    put(here, "mild.yaml", pipeline("max_mm: 10"));
    assert_eq!(ran("compensate mild.yaml").0, Some(0));
}

#[test]
fn a_model_that_leaves_something_unexplained_says_so_once_and_in_the_program() {
    let robot = robot_of(ROBOT);
    let cell = Cell::of(robot, 1.2, [100.0, 200.0], Vec::new());
    let folder = recorded(
        &PLAIN,
        &cell,
        &cell.points(80, &[0.0], 5),
        ROBOT,
        "  - uses: diagnose\n",
    );
    let here = folder.path();
    // Heights with bumps over three joints that no cause has.
    let log = read(here.join("log.csv"));
    let bumpy = |line: &str| {
        let (tail, z) = line.rsplit_once(',').unwrap();
        let cells: Vec<f64> = tail
            .split(',')
            .skip(1)
            .map(|cell| cell.parse().unwrap())
            .collect();
        let bumps = (cells[0] / 7.0).sin() * (cells[1] / 5.0).sin()
            + (cells[2] / 6.0 + cells[0] / 9.0).cos();
        format!("{tail},{:.6}\n", z.parse::<f64>().unwrap() + 0.3 * bumps)
    };
    let (header, rows) = log.split_once('\n').unwrap();
    let rows: String = rows.lines().map(bumpy).collect();
    put(here, "log.csv", format!("{header}\n{rows}"));
    calib(here, "run pipeline.yaml --quiet");
    put(here, "p.src", "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n");
    for model in ["pipeline.yaml", "latest"] {
        let output = calib(here, &format!("compensate {model} p.src --quiet"));
        let (_code, out, err) = output.parts();
        assert_eq!(
            err.matches("the verdict is `unexplained`").count(),
            1,
            "{err}"
        );
        let head = out
            .lines()
            .find(|line| line.contains("corrected by calib"))
            .unwrap_or_else(|| panic!("{err}"));
        ends_with(head, ", verdict of the model: unexplained");
        let export = calib(here, &format!("export {model} --format json --quiet"));
        assert_eq!(
            export.err.matches("the verdict is `unexplained`").count(),
            1
        );
    }
}
