//! Frames and loads that a program itself declares.

use crate::answer::has;
use calib::program::{Language, Partial, Program, TargetKind};
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::twin::conceal::robots::Kind;
use nalgebra::{Matrix3, Vector3};

const REST: &str = "[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
const TOOLS: &str = "PERS tooldata gun:=[TRUE,[[0,0,200],[1,0,0,0]],[12.5,[0,0,100],[1,0,0,0],0,0,0]];\nPERS tooldata bare:=[TRUE,[[0,0,0],[1,0,0,0]],[-1,[0,0,0],[1,0,0,0],0,0,0]];\nPERS loaddata part:=[30,[0,0,50],[1,0,0,0],0,0,0];\n";
const OBJECT: &str = "PERS wobjdata bench:=[FALSE,TRUE,\"\",[[100,200,300],[0.70710678,0,0,0.70710678]],[[10,0,0],[1,0,0,0]]];\n";

/// Frame and payload of a target.
type Surroundings = (Option<Pose>, Option<f64>);

/// Those of every target; lines that name a frame which is not applied.
fn read(language: Language, text: &str) -> (Vec<Surroundings>, Vec<String>) {
    let program = Program::parse(text.as_bytes(), language, Partial::Refused).unwrap();
    let literals = program
        .literals()
        .iter()
        .map(|literal| (literal.frame, literal.payload))
        .collect();
    (
        literals,
        program
            .frames()
            .iter()
            .map(|note| format!("{}: {}", note.line, note.message))
            .collect(),
    )
}

fn payloads(language: Language, text: &str) -> Vec<Option<f64>> {
    read(language, text)
        .0
        .into_iter()
        .map(|(_, payload)| payload)
        .collect()
}

/// A quarter turn about z at x, y, z in mm.
fn turned(x: f64, y: f64, z: f64) -> Pose {
    Pose::new(
        Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        Vector3::new(x, y, z) * 1e-3,
    )
}

fn is(pose: Option<Pose>, expected: Pose) -> bool {
    pose.is_some_and(|pose| {
        (pose.translation - expected.translation).norm()
            + (pose.rotation - expected.rotation).norm()
            < 1e-7
    })
}

#[test]
fn a_target_stands_in_the_work_object_of_its_motion_and_carries_its_tool() {
    let text = format!(
        "{TOOLS}{OBJECT}CONST robtarget p:=[[1,2,3],{REST};\nMoveL p,v1,z1,gun\\WObj:=bench;\nMoveL [[4,5,6],{REST},v1,z1,gun\\WObj:=bench;\nMoveAbsJ [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,gun\\TLoad:=part;\n"
    );
    let (literals, frames) = read(Language::Rapid, &text);
    assert_eq!(frames, [""; 0]);
    assert_eq!(
        literals.iter().map(|one| one.1).collect::<Vec<_>>(),
        [Some(12.5), Some(12.5), Some(30.0)]
    );
    // The object frame, 10 mm along x of the user frame, is along y of the base.
    assert!(
        is(literals[0].0, turned(100.0, 210.0, 300.0))
            && is(literals[1].0, turned(100.0, 210.0, 300.0)),
        "{literals:?}"
    );
    assert_eq!(literals[2].0, None);
}

#[test]
fn what_a_program_does_not_say_of_a_load_is_not_stated() {
    let moves = |motions: &str| {
        payloads(
            Language::Rapid,
            &format!("{TOOLS}CONST robtarget p:=[[1,2,3],{REST};\n{motions}"),
        )
    };
    assert_eq!(moves("MoveL p,v1,z1,gun;"), [Some(12.5)]);
    assert_eq!(moves("MoveL p,v1,z1,bare;"), [None], "below 0: not known");
    assert_eq!(moves("MoveL p,v1,z1,other;"), [None], "declared elsewhere");
    assert_eq!(
        moves("MoveL p,v1,z1,gun;\nMoveL p,v1,z1,gun\\TLoad:=part;"),
        [None],
        "two loads"
    );
    assert_eq!(
        moves("GripLoad part;\nMoveL p,v1,z1,gun;"),
        [None],
        "a load in the hand"
    );
    assert_eq!(moves("GripLoad load0;\nMoveL p,v1,z1,gun;"), [Some(12.5)]);
    assert_eq!(
        moves("gun.tload.mass:=3;\nMoveL p,v1,z1,gun;"),
        [None],
        "set when the program runs"
    );
    assert_eq!(moves("TPWrite \"p\";"), [None], "never moved to");
}

#[test]
fn a_work_object_that_moves_or_changes_is_not_applied() {
    let refused = |object: &str, motions: &str| {
        let text = format!("{TOOLS}{object}CONST robtarget p:=[[1,2,3],{REST};\n{motions}");
        let (literals, frames) = read(Language::Rapid, &text);
        assert_eq!(literals[0].0, None, "{text}");
        frames.join("\n")
    };
    let once = "MoveL p,v1,z1,gun\\WObj:=bench;";
    for object in [
        OBJECT.replace("FALSE,TRUE", "TRUE,TRUE"),
        OBJECT.replace("FALSE,TRUE", "FALSE,FALSE"),
        String::new(),
    ] {
        assert!(refused(&object, once).contains("work object `bench`"));
    }
    assert!(
        refused(OBJECT, &format!("bench.oframe.trans.x:=5;\n{once}"))
            .contains("work object `bench`")
    );
    let printed = refused(OBJECT, &format!("{once}\nMoveL p,v1,z1,gun;"));
    has(
        &printed,
        "its work object differs between the ways to this target: work object `bench` and wobj0",
    );
    let printed = refused(OBJECT, "MoveL p,v1,z1,gun;\nMoveL p,v1,z1,bare;");
    has(
        &printed,
        "its tool differs between the ways to this target: `gun` and `bare`",
    );
}

#[test]
fn a_base_and_a_load_that_a_file_sets_once_hold_for_its_targets() {
    let base = "{X 100.0,Y 210.0,Z 300.0,A 90.0,B 0.0,C 0.0}";
    let motion = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n";
    for head in [
        format!("$BASE={base}\n$LOAD={{M 40,CM {{X 0,Y 0,Z 0,A 0,B 0,C 0}},J {{X 0,Y 0,Z 0}}}}\n"),
        format!(
            "BASE_DATA[2]={base}\nLOAD_DATA[3]={{M 40}}\n$BASE=BASE_DATA[2]\n$LOAD=LOAD_DATA[3]\n"
        ),
        format!("BASE_DATA[2]={base}\nBAS(#BASE,2)\n$BASE=BASE_DATA[2]\n$LOAD={{M 40}}\n"),
    ] {
        let text = format!("{head}{motion}PTP {{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}}\n");
        let (literals, frames) = read(Language::Krl, &text);
        assert_eq!(frames, [""; 0], "{text}");
        assert!(
            is(literals[0].0, turned(100.0, 210.0, 300.0)),
            "{literals:?}"
        );
        assert_eq!(
            (literals[0].1, literals[1]),
            (Some(40.0), (None, Some(40.0)))
        );
    }
    for head in ["", "$LOAD={M -1}\n", "$LOAD=LOAD_DATA[1]\n"] {
        assert_eq!(
            payloads(Language::Krl, &format!("{head}{motion}")),
            [None],
            "{head}"
        );
    }
}

#[test]
fn joints_are_the_same_in_every_frame() {
    let text =
        "$BASE={X 100.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\n";
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused).unwrap();
    assert_eq!(
        (program.literals()[0].kind, program.literals()[0].frame),
        (TargetKind::Joints, None)
    );
}

#[test]
fn the_targets_of_a_file_are_reached_with_one_tool() {
    let robot = RobotModel::new(Kind::Sr210d.description([0.0; 3]));
    let message_of = |tool: &str| {
        let targets = format!(
            "{TOOLS}CONST robtarget p:=[[1,2,3],{REST};\nCONST robtarget r:=[[4,5,6],{REST};\n"
        );
        let text = format!("{targets}MoveL p,v1,z1,gun;\nMoveL r,v1,z1,{tool};");
        let mut program =
            Program::parse(text.as_bytes(), Language::Rapid, Partial::Refused).unwrap();
        program.relate_tools(&robot, None).unwrap();
        program
            .frames()
            .iter()
            .map(|note| note.message.clone())
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(message_of("gun"), "");
    let two = message_of("bare");
    has(
        &two,
        "is reached with the tool BARE, another target with GUN: --tool says which",
    );
}
