//! What is refused though it can be computed, and that one who insists is told so in what is written.

use super::{PIPELINE, ROBOT, calib, cell};

const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n";

fn run(arguments: &[&str], input: &str) -> (Option<i32>, String, String) {
    let output = calib(cell(), arguments, input);
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    (output.status.code(), out, err)
}

#[test]
fn a_correction_above_its_limit_has_no_joints_and_one_who_insists_is_told() {
    let (code, out, err) = run(&["compensate", "latest", "--max-correction", "0.01"], HEADER);
    assert_eq!(code, Some(10), "{err}");
    assert!(out.lines().nth(1).is_some_and(|line| line.starts_with(",,,,,,")), "{out}");
    assert!(out.contains("at most 0.01 mm allowed (--max-correction)") && err.contains("refused"), "{out}{err}");
    let (code, out, err) = run(&["compensate", "latest", "--max-correction", "0.01", "--force"], HEADER);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("written because of --force: corrected by") && !out.contains(",,,"), "{out}");
    let (code, out, _) = run(&["compensate", "latest", "--max-turn", "0.0001"], HEADER);
    assert_eq!(code, Some(10));
    assert!(out.contains("at most 0.0001 deg allowed (--max-turn)"), "{out}");
    let program = "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n";
    std::fs::write(cell().join("far.src"), program).expect("a file");
    let (code, out, err) = run(&["compensate", "latest", "far.src", "--max-correction", "0.01"], "");
    assert_eq!((code, out.as_str()), (Some(10), ""));
    assert!(err.contains("far.src:1:9: refused: corrected by"), "{err}");
}

#[test]
fn what_calib_corrected_is_not_corrected_once_more() {
    let (_, once, err) = run(&["compensate", "latest"], HEADER);
    let (code, out, said) = run(&["compensate", "latest"], &once);
    assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
    assert!(said.contains("was compensated by calib already") && said.contains("--force"), "{said}");
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
        std::fs::write(cell().join(name), format!("{head}{target}")).expect("a file");
        let (code, once, err) = run(&["compensate", "latest", name], "");
        assert_eq!(code, Some(0), "{err}");
        assert!(once.starts_with(&format!("{second}corrected by calib from ")), "{once}");
        std::fs::write(cell().join(name), &once).expect("a file");
        let (code, out, err) = run(&["compensate", "latest", name], "");
        assert_eq!((code, out.as_str()), (Some(10), ""));
        assert!(err.contains(&format!("{name}: was compensated by calib already")), "{err}");
        assert_eq!(run(&["compensate", "latest", name, "--force"], "").0, Some(0));
    }
}

#[test]
fn a_cartesian_program_in_a_frame_that_is_not_applied_is_refused_by_line() {
    let rest = "[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let text = format!("MODULE m\nMoveL [[900,40,930],{rest},v1,z1,t\\WObj:=fixture;\nENDMODULE\n");
    std::fs::write(cell().join("wobj.mod"), text).expect("a file");
    let (code, out, err) = run(&["compensate", "latest", "wobj.mod"], "");
    assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
    assert!(err.contains("wobj.mod:2:") && err.contains("work object `fixture`") && err.contains("--assume-frames"), "{err}");
    let (code, _, err) = run(&["compensate", "latest", "wobj.mod", "--assume-frames"], "");
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("warning: wobj.mod:2:"), "{err}");
}

#[test]
fn an_output_never_takes_the_place_of_a_file_that_was_read() {
    for file in ["robot.yaml", "pipeline.yaml"] {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["robot.yaml", "pipeline.yaml"] {
            std::fs::copy(cell().join(name), folder.path().join(name)).expect("a file");
        }
        let before = std::fs::read(folder.path().join(file)).expect("a file");
        let output = calib(folder.path(), &["export", "pipeline.yaml", "--format", "json", "--out", file], "");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("that the model was made from"), "{said}");
        assert_eq!(std::fs::read(folder.path().join(file)).expect("a file"), before);
    }
}

#[test]
fn an_arm_far_from_the_robot_file_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("robot.yaml"), ROBOT).expect("a file");
    let truth = PIPELINE.replace("shift_mm: [0.4, 0.2, -0.3]", "shift_mm: [80.0, 0.2, -0.3]");
    std::fs::write(here.join("pipeline.yaml"), truth).expect("a file");
    for verb in [&["compensate", "pipeline.yaml"][..], &["export", "pipeline.yaml", "--format", "json"]] {
        let output = calib(here, verb, HEADER);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(10), 0), "{said}");
        assert!(
            said.contains(" from the robot file's") && said.contains("refused: the set-up is wrong") && said.contains("--force"),
            "{said}"
        );
        assert!(calib(here, &[verb, &["--force"]].concat(), HEADER).status.code() != Some(2));
    }
}

#[test]
fn a_table_whose_common_normals_are_far_from_the_arm_is_refused_with_the_formats_that_carry_it() {
    for format in ["dh", "mdh"] {
        let (code, out, err) = run(&["export", "latest", "--format", format], "");
        assert_eq!((code, out.as_str()), (Some(10), ""), "{err}");
        assert!(err.contains("axes 2 and 3 are") && err.contains("--format urdf or mjcf"), "{err}");
    }
}

#[test]
fn targets_that_state_no_payload_are_refused_where_the_model_depends_on_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    std::fs::write(here.join("robot.yaml"), ROBOT).expect("a file");
    let loaded = PIPELINE
        .replace("{usage: fit, points: 60}", "{usage: fit, points: 40}, {usage: fit, points: 40, payload_kg: 50}")
        .replace("{on: [fit]}", "{on: [fit], effects: [base_frame, tool_offset, joint_offset, link_geometry, joint_compliance]}");
    std::fs::write(here.join("pipeline.yaml"), loaded).expect("a file");
    std::fs::write(here.join("p.src"), "PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}\n").expect("a file");
    for file in ["-", "p.src"] {
        let output = calib(here, &["compensate", "pipeline.yaml", file, "--quiet"], HEADER);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(10), 0), "{said}");
        assert!(said.contains("states no payload") && said.contains("measured up to 50 kg"), "{said}");
        let stated = calib(here, &["compensate", "pipeline.yaml", file, "--quiet", "--payload", "0"], HEADER);
        assert_eq!(stated.status.code(), Some(0), "{}", String::from_utf8_lossy(&stated.stderr));
    }
    let column = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n10,20,-30,5,40,0,50\n";
    assert_eq!(calib(here, &["compensate", "pipeline.yaml", "--quiet"], column).status.code(), Some(0));
}
