//! Recordings that others reported, each as its writer would run it: the right answer, or a refusal that says why.

use crate::answer::{calib, read};
use crate::desk::shared;
use std::path::Path;

/// A folder, what is run in it, the code of the last command, what it and the ones before say, and what they do not say.
struct Report {
    folder: &'static str,
    commands: &'static [&'static str],
    code: i32,
    says: &'static [&'static str],
    says_not: &'static [&'static str],
}

const RUN: &[&str] = &["run pipeline.yaml"];
const URDF: &[&str] = &[
    "run pipeline.yaml",
    "export pipeline.yaml --format urdf --out arm_out.urdf",
];

const REPORTS: [Report; 15] = [
    Report {
        folder: "advice_state_instrument",
        commands: RUN,
        code: 0,
        says: &["instrument 17 um", "measure ten poses twice"],
        says_not: &["state `instrument`"],
    },
    Report {
        folder: "append_same_ids",
        commands: RUN,
        code: 0,
        says: &["60 points"],
        says_not: &["duplicate"],
    },
    Report {
        folder: "clocks_two_hours_apart",
        commands: RUN,
        code: 10,
        says: &[
            "7201.2 s apart in all rows",
            "`join: {by: time",
            "offset_s: 7201",
        ],
        says_not: &[],
    },
    Report {
        folder: "heldout_shots_of_one_pose",
        commands: RUN,
        code: 0,
        says: &["after       0.2", "30 held-out points"],
        says_not: &["found "],
    },
    Report {
        folder: "joint_order_interleaved",
        commands: RUN,
        code: 10,
        says: &["joints 1, 4, 2, 5, 3, 6", "columns: ["],
        says_not: &[],
    },
    Report {
        folder: "mcap_json_encoding",
        commands: &["init c --data run.mcap --robot ur10e"],
        code: 0,
        says: &["600 messages", "6 joints"],
        says_not: &[],
    },
    Report {
        folder: "mjcf_dry_friction",
        commands: &[
            "run pipeline.yaml",
            "export pipeline.yaml --format mjcf --out arm.xml",
        ],
        code: 0,
        says: &["solreffriction=\"0.004 1.0\" solimpfriction=\"0.9999 0.9999"],
        says_not: &[],
    },
    Report {
        folder: "path_neighbours",
        commands: RUN,
        code: 0,
        says: &["after       0.02", "122 held-out points"],
        says_not: &["found "],
    },
    Report {
        folder: "probability_below_zero",
        commands: RUN,
        code: 0,
        says: &["never move in the 225 rows to fit", "joint 2"],
        says_not: &["out of range", "at joint 4", "joint 4->"],
    },
    Report {
        folder: "rail_unit_hint",
        commands: RUN,
        code: 10,
        says: &["if the file holds millimetres, say `linear_unit: mm`"],
        says_not: &["unit: um"],
    },
    Report {
        folder: "torque_external_only",
        commands: RUN,
        code: 10,
        says: &["hold no gravity", "external"],
        says_not: &["degrees"],
    },
    Report {
        folder: "torque_wall_mounted",
        commands: RUN,
        code: 10,
        says: &["`gravity: [0, -9.81, 0]`", "robot file"],
        says_not: &["spring"],
    },
    Report {
        folder: "torque_wrap360",
        commands: RUN,
        code: 0,
        says: &["logged within one turn", "joint 6", "explained"],
        says_not: &["spring", "unknown cause"],
    },
    Report {
        folder: "urdf_export_massless_links",
        commands: URDF,
        code: 0,
        says: &["<link name=\"base_link\">\n    <inertial>\n      <mass value=\"0\"/>"],
        says_not: &[],
    },
    Report {
        folder: "urdf_export_tool_names_limits",
        commands: URDF,
        code: 0,
        says: &[
            "<link name=\"j1_link\"",
            "effort=\"150\" velocity=\"3\"",
            "tool0 is the flange as there, measured_point the point",
            "not carried: where the base stands in the measured frame",
        ],
        says_not: &["1e9"],
    },
];

/// The folder's files in one of their own: runs and exports write beside them.
fn copied(from: &Path) -> tempfile::TempDir {
    let to = tempfile::tempdir().unwrap();
    for file in std::fs::read_dir(from).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), to.path().join(file.file_name())).unwrap();
    }
    to
}

#[test]
fn reported_recordings_are_answered_rightly_or_refused_with_the_reason() {
    let mut wrong = Vec::new();
    for report in &REPORTS {
        let Some(folder) = shared(&format!("review/faults5/{}", report.folder)) else {
            return;
        };
        let folder = copied(&folder);
        let mut output = String::new();
        let mut code = None;
        for command in report.commands {
            let answer = calib(folder.path(), *command);
            // Progress of a search is no result.
            let both = answer.both();
            let lines = both
                .lines()
                .filter(|line| !line.contains("looking for what"));
            output.extend(lines.flat_map(|line| [line, "\n"]));
            code = answer.code;
        }
        for file in ["arm.xml", "arm_out.urdf"] {
            if report
                .commands
                .iter()
                .any(|command| command.ends_with(file))
            {
                output += &read(folder.path().join(file));
            }
        }
        let lacks = |word: &&&str| !output.contains(**word);
        let lacking: Vec<_> = report.says.iter().filter(lacks).collect();
        let has = |word: &&&str| output.contains(**word);
        let too_much: Vec<_> = report.says_not.iter().filter(has).collect();
        if code != Some(report.code) || !lacking.is_empty() || !too_much.is_empty() {
            let name = report.folder;
            wrong.push(format!(
                "{name}: code {code:?}, lacks {lacking:?}, has {too_much:?}:\n{output}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_program_in_another_base_than_the_robot_files_is_refused_and_its_own_is_corrected() {
    let Some(folder) = shared("review/faults5/urscript_base_link") else {
        return;
    };
    let folder = copied(&folder);
    calib(folder.path(), "run pipeline.yaml").code(0);
    let compensate = "compensate pipeline.yaml job.script --out job_c.script";
    let refused = calib(folder.path(), compensate).code(10);
    assert!(
        refused.err.contains("begins at `base_link`") && refused.err.contains("180.0 deg"),
        "{}",
        refused.err
    );
    assert!(!folder.path().join("job_c.script").exists());
    // The chain that begins at the controller's base.
    let robot = read(folder.path().join("robot.yaml"));
    crate::answer::put(
        folder.path(),
        "robot.yaml",
        robot.replace("base_link", "base"),
    );
    calib(folder.path(), "run pipeline.yaml").code(0);
    calib(folder.path(), compensate).code(0);
}
