//! What is refused though it can be computed, and that one who insists is told so in what is written.

use super::maker::{PLAIN, recorded};
use super::true_error::Cell;
use super::{PIPELINE, ROBOT, cell};
use crate::answer::{Answer, calib, ends_with, fed, has, put, read, starts_with};
use crate::fixture::robot_of;

const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n";

const KRL: &str = "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n";

/// The run of calib in the cell, with the targets on its stdin.
fn run(arguments: &str) -> Answer {
    fed(cell(), arguments, HEADER)
}

#[test]
fn a_correction_above_its_limit_has_no_joints_and_one_who_insists_is_told() {
    let limited = run("compensate latest --max-correction 0.01").code(10);
    has(
        &limited.out,
        ["\n,,,,,,", "at most 0.01 mm allowed (--max-correction)"],
    );
    has(&limited.err, "refused");
    let out = run("compensate latest --max-correction 0.01 --force").ok();
    has(&out, "written because of --force: corrected by");
    assert!(!out.contains(",,,"), "{out}");
    let limited = run("compensate latest --max-turn 0.0001").code(10);
    has(&limited.out, "at most 0.0001 deg allowed (--max-turn)");
    put(cell(), "far.src", KRL);
    let err = run("compensate latest far.src --max-correction 0.01").refused();
    has(&err, "far.src:1:9: refused: corrected by");
}

#[test]
fn what_calib_corrected_is_not_corrected_once_more() {
    let once = run("compensate latest").out;
    let err = fed(cell(), "compensate latest", &once).refused();
    has(&err, ["was compensated by calib already", "--force"]);
    for (name, head, target, mark) in [
        (
            "twice.src",
            "&ACCESS RVP\r\nDEF twice( )\r\n",
            "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\r\nEND\r\n",
            "; ",
        ),
        (
            "twice.mod",
            "MODULE m\n",
            "MoveAbsJ [[1,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\nENDMODULE\n",
            "! ",
        ),
    ] {
        put(cell(), name, format!("{head}{target}"));
        let once = run(&format!("compensate latest {name}")).ok();
        starts_with(&once, &format!("{head}{mark}corrected by calib from "));
        put(cell(), name, &once);
        let err = run(&format!("compensate latest {name}")).refused();
        has(&err, &format!("{name}: was compensated by calib already"));
        run(&format!("compensate latest {name} --force")).code(0);
    }
}

#[test]
fn a_cartesian_program_in_a_frame_that_is_not_applied_is_refused_by_line() {
    let tail = "[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let text = format!("MODULE m\nMoveL [[900,40,930],{tail},v1,z1,t\\WObj:=fixture;\nENDMODULE\n");
    put(cell(), "wobj.mod", text);
    let err = run("compensate latest wobj.mod").refused();
    has(
        &err,
        ["wobj.mod:2:", "work object `fixture`", "--assume-frames"],
    );
    let assumed = run("compensate latest wobj.mod --assume-frames").code(0);
    has(&assumed.err, "warning: wobj.mod:2:");
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
    let plain = run("compensate latest plain.mod").ok();
    // Moved by 100, 20, -30 mm and turned by half a turn about z: x and y change their signs.
    let object =
        "PERS wobjdata fixture:=[FALSE,TRUE,\"\",[[100,0,0],[0,0,0,1]],[[0,-20,-30],[1,0,0,0]]];\n";
    let program = format!(
        "MODULE m\n{object}MoveL [[-800,-20,960],[0,0,0,1],[9E9,9E9,9E9,9E9],{tail},v1,z1,t\\WObj:=fixture;\nENDMODULE\n"
    );
    put(cell(), "object.mod", program);
    let within = run("compensate latest object.mod").code(0);
    has(
        &within.err,
        "work object `fixture` is applied, in the robot's base",
    );
    let (plain, within) = (numbers(&plain), numbers(&within.out));
    let there = [100.0 - within[0], 20.0 - within[1], within[2] - 30.0];
    assert!(
        there.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 2e-5),
        "{there:?} {plain:?}"
    );
    assert!((plain[0] - 900.0).abs() > 0.01, "{plain:?}");
}

/// A folder with the robot and a pipeline, in which the second joint may be far from where the robot file has it.
fn folder(pipeline: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "robot.yaml", ROBOT);
    put(folder.path(), "pipeline.yaml", pipeline);
    folder
}

fn far() -> String {
    PIPELINE.replace("shift_mm: [0.4, 0.2, -0.3]", "shift_mm: [80.0, 0.2, -0.3]")
}

#[test]
fn a_table_of_parameters_without_a_verdict_is_held_to_the_same_limits() {
    for (pipeline, is_far) in [(PIPELINE.to_string(), false), (far(), true)] {
        let folder = folder(&pipeline);
        calib(folder.path(), "run pipeline.yaml --quiet");
        let table = ".calib/tables/small/identify.parameters.parquet";
        std::fs::copy(
            folder.path().join(table),
            folder.path().join("bare.parquet"),
        )
        .unwrap();
        let with = |more: &str| {
            let words = format!("compensate bare.parquet --robot robot.yaml --angle deg {more}");
            fed(folder.path(), &words, HEADER)
        };
        if is_far {
            let reason = "joint_offset at joint 2";
            let err = with("").refused();
            has(
                &err,
                [&*format!("refused: {reason} is"), "from the robot file's"],
            );
            let forced = with("--force");
            assert!(forced.code != Some(2));
            has(&forced.err, &format!("used because of --force: {reason}"));
        } else {
            with("").code(0);
            with("--max-correction 0.01").code(10);
            with("--max-shift 0.001").code(10);
        }
    }
}

#[test]
fn an_output_never_takes_the_place_of_a_file_that_was_read() {
    for file in ["robot.yaml", "pipeline.yaml"] {
        let folder = folder(PIPELINE);
        let before = read(folder.path().join(file));
        let words = format!("export pipeline.yaml --format json --out {file}");
        let refused = calib(folder.path(), &words).code(2);
        has(&refused.err, "that the model was made from");
        assert_eq!(read(folder.path().join(file)), before);
    }
}

#[test]
fn an_arm_far_from_the_robot_file_is_refused_before_anything_is_written() {
    let folder = folder(&far());
    for verb in [
        "compensate pipeline.yaml",
        "export pipeline.yaml --format json",
    ] {
        let err = fed(folder.path(), verb, HEADER).refused();
        has(
            &err,
            [
                " from the robot file's",
                "refused: the set-up is wrong",
                "--force",
            ],
        );
        let forced = fed(folder.path(), &format!("{verb} --force"), HEADER);
        assert!(forced.code != Some(2));
    }
}

#[test]
fn a_table_whose_common_normals_are_far_from_the_arm_is_refused_with_the_formats_that_carry_it() {
    for format in ["dh", "mdh"] {
        let err = run(&format!("export latest --format {format}")).refused();
        has(&err, ["axes 2 and 3 are", "--format urdf or mjcf"]);
    }
}

#[test]
fn targets_that_state_no_payload_are_refused_where_the_model_depends_on_it() {
    let loaded = PIPELINE
        .replace("{usage: fit, points: 60}", "{usage: fit, points: 40}, {usage: fit, points: 40, payload_kg: 50}")
        .replace("{on: [fit]}", "{on: [fit], effects: [base_frame, tool_offset, joint_offset, link_geometry, joint_compliance]}");
    let folder = folder(&loaded);
    let here = folder.path();
    put(here, "p.src", KRL);
    for file in ["-", "p.src"] {
        let words = format!("compensate pipeline.yaml {file} --quiet");
        let err = fed(here, &words, HEADER).refused();
        has(&err, ["states no payload", "measured up to 50 kg"]);
        fed(here, &format!("{words} --payload 0"), HEADER).code(0);
    }
    // A program says it by the tool of its motions, or by $LOAD.
    let joints = "MoveAbsJ [[10,20,-30,5,40,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,gun;\n";
    let tool = "PERS tooldata gun:=[TRUE,[[0,0,0],[1,0,0,0]],[50,[0,0,0],[1,0,0,0],0,0,0]];\n";
    let load = "$LOAD={M 50,CM {X 0,Y 0,Z 0,A 0,B 0,C 0}}\n";
    for (file, stating, target) in [("t.mod", tool, joints), ("t.src", load, KRL)] {
        let with = |text: &str, more: &str| {
            put(here, file, text);
            calib(here, &format!("compensate pipeline.yaml {file} {more}"))
        };
        let moves = |answer: &Answer| {
            let lines = answer.out.lines();
            lines
                .filter(|line| line.contains("20.") || line.contains("19."))
                .collect::<String>()
        };
        with(target, "").refused();
        let by_program = with(&format!("{stating}{target}"), "").code(0);
        has(&by_program.err, "payload 50 kg, as");
        assert_eq!(moves(&by_program), moves(&with(target, "--payload 50")));
        let other = with(&format!("{stating}{target}"), "--payload 0");
        has(
            &other.err,
            "the program states a payload of 50 kg, --payload 0 kg, which is used",
        );
        assert_ne!(moves(&by_program), moves(&other));
    }
    let column = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n10,20,-30,5,40,0,50\n";
    fed(here, "compensate pipeline.yaml --quiet", column).code(0);
}

#[test]
fn how_far_a_model_may_be_from_the_robot_file_is_for_the_user_to_say() {
    for (option, limit, unit) in [
        ("--max-shift", "0.001", "mm"),
        ("--max-tilt", "0.0001", "deg"),
    ] {
        for verb in ["compensate latest", "export latest --format json"] {
            let err = run(&format!("{verb} {option} {limit}")).refused();
            has(&err, &format!("at most {limit} {unit} allowed ({option})"));
        }
        run(&format!("compensate latest {option} -1")).code(2);
    }
}

#[test]
fn a_pipeline_whose_report_does_not_accept_it_is_refused_as_its_run_is() {
    let folder = folder(PIPELINE);
    let here = folder.path();
    let pipeline = |limits: &str| {
        format!(
            "{PIPELINE}  - uses: validate\n  - uses: report\n    with: {{limits: {{{limits}}}}}\n"
        )
    };
    put(here, "strict.yaml", pipeline("max_mm: 0.0001"));
    calib(here, "run strict.yaml --quiet").code(1);
    for model in ["strict.yaml", "latest"] {
        let refused = fed(here, &format!("compensate {model}"), HEADER).code(10);
        has(
            &refused.err,
            ["refused: not accepted", "at most 0.0001 mm allowed"],
        );
        calib(here, &format!("export {model} --format json")).code(10);
        let forced = fed(here, &format!("compensate {model} --force"), HEADER).code(0);
        has(
            &forced.err,
            "warning: used because of --force: not accepted",
        );
    }
    put(here, "mild.yaml", pipeline("max_mm: 10"));
    fed(here, "compensate mild.yaml", HEADER).code(0);
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
    put(here, "p.src", KRL);
    for model in ["pipeline.yaml", "latest"] {
        let corrected = calib(here, &format!("compensate {model} p.src --quiet"));
        let export = calib(here, &format!("export {model} --format json --quiet"));
        for err in [&corrected.err, &export.err] {
            assert_eq!(
                err.matches("the verdict is `unexplained`").count(),
                1,
                "{err}"
            );
        }
        let mut lines = corrected.out.lines();
        let head = lines.find(|line| line.contains("corrected by calib"));
        ends_with(head.unwrap(), ", verdict of the model: unexplained");
    }
}
