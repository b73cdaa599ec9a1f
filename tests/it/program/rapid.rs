//! ABB RAPID: numbers are strict, literals have the shape of their type, and what may be a target is not passed over.

use super::{TargetKind, accepted, message_of, refused};
use calib::program::{Language, Partial, Program};

const REST: &str = "[1,0,0,0],[0,0,-1,0],[9E9,9E+09,9e9,9000000000,9E9,9E9]]";

fn faults(text: &str) -> Vec<String> {
    refused(Language::Rapid, text)
}

fn targets(text: &str) -> Vec<(TargetKind, Vec<f64>)> {
    accepted(Language::Rapid, text).0
}

/// Diagnosed of targets to which no motion goes.
const NOWHERE: &str = "{}: is moved to in none of the files that were read, which would state its frame and tool; --with names others";

#[test]
fn blanks_do_not_join_numbers() {
    let text = "CONST jointtarget a:=[[10 3,-20,5,5,5,5],[9E9,9E9,9E9,9E9,9E9,9E9]];";
    assert_eq!(faults(text), ["1:24: `10 3` is no number"]);
    let text = format!("MoveL [[1,,2 . 5],{REST},v100,fine,t;");
    assert_eq!(
        faults(&text),
        [
            "1:8: a number is missing in this list",
            "1:12: `2 . 5` is no number"
        ]
    );
}

#[test]
fn a_number_is_one_token_of_the_grammar() {
    let with = |number: &str| format!("MoveL [[{number},2,3],{REST},v100,fine,t;");
    let good = [
        ("10", 10.0),
        ("-10.5", -10.5),
        ("-\n10.5", -10.5),
        ("+ 3", 3.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("1.5e-2", 0.015),
        ("1 ! [\n", 1.0),
    ];
    for (text, value) in good {
        assert_eq!(targets(&with(text))[0].1[0], value, "{text}");
    }
    for text in [
        "0x1F", "0b1", "0o7", "1.2.3", ".", "1E", "1e+", "10mm", "--1", "1+2", "(1)", "x", "reg1",
        "\"1\"", "1\u{a0}", "[1]", "1e999", "TRUE", "x{1}",
    ] {
        assert!(!faults(&with(text)).is_empty(), "{text}");
    }
}

#[test]
fn both_positions_of_a_circle_and_arrays_over_lines_are_targets() {
    let text = format!(
        "%%%\n VERSION:1\n LANGUAGE:ENGLISH\n%%%\nMODULE m(SYSMODULE)\nLOCAL PERS robtarget ps{{2}}:=[\n [[1,2,3],{REST}, ! [[\n [[4,5,6],{REST}\n];\nVAR jointtarget j;\nPROC main()\n IF TRUE THEN\n  movec [[7,8,9],{REST},[[1,2,3],{REST}\\ID:=id1,v100,z1,t\\WObj:=WOBJ0;\n ENDIF\n j:=[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];\n MoveAbsJ\\Conc,[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,[5,5,5,5],z1,t;\nENDPROC\nENDMODULE\n"
    );
    let (found, warned) = accepted(Language::Rapid, &text);
    assert_eq!(warned, ["7:4", "8:4"].map(|at| NOWHERE.replace("{}", at)));
    let pose = |x: f64| {
        (
            TargetKind::Quaternion,
            vec![x, x + 1.0, x + 2.0, 1.0, 0.0, 0.0, 0.0],
        )
    };
    let joints = (TargetKind::Joints, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(
        found,
        [
            pose(1.0),
            pose(4.0),
            pose(7.0),
            pose(1.0),
            joints.clone(),
            joints
        ]
    );
}

#[test]
fn all_faults_of_a_program_come_at_once() {
    let text = format!(
        "CONST jointtarget a:=[[1,2,3],[9E9,1,1,1,1,1]];\nCONST robtarget b:=[[1,2,x],{REST};\nCONST robtarget c:=[[1,2,3],orient1,[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nCONST robtarget d:=[[1,2,3],[1,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nCONST robtarget e:=[[1,2,3],{REST}:p1;\nCONST robtarget f:=[[1,2;\n"
    );
    assert_eq!(
        faults(&text),
        [
            "1:23: 3 numbers, expected 6 here in a jointtarget",
            "2:26: `x` is no number",
            "3:29: `orient1` in a robtarget, expected a list of 4 numbers",
            "4:30: the quaternion has length 1.4142, expected 1",
            "5:85: `:` behind a target is not understood",
            "6:20: `[` without `]` in its statement",
            "6:21: `[` without `]` in its statement",
        ]
    );
}

#[test]
fn what_may_be_a_target_is_refused_where_its_type_is_not_stated() {
    let form = |at: &str, what: &str| {
        format!(
            "{at}: has the form of a robtarget and stands in {what}; declare it: `CONST robtarget p := [...]`"
        )
    };
    assert_eq!(
        faults(&format!("p10:=[[1,2,3],{REST};")),
        [form(
            "1:6",
            "a variable whose type this file does not state"
        )]
    );
    assert_eq!(
        faults(&format!("Weld [[1,2,3],{REST},v1;")),
        [form(
            "1:6",
            "`WELD`, no motion instruction that calib knows"
        )]
    );
    assert_eq!(
        faults(&format!("MoveL Offs([[1,2,3],{REST},0,0,5),v1,z1,t;")),
        [form("1:12", "an expression")]
    );
    assert_eq!(
        faults(&format!("IF a MoveL [[1,2,3],{REST},v1,z1,t;")),
        [form("1:12", "`IF`, no motion instruction that calib knows")]
    );
    assert_eq!(
        faults(&format!("CONST point p:=[\"a\",[[1,2,3],{REST}];")),
        [form("1:16", "a variable of type POINT")]
    );
    assert_eq!(
        faults(&format!(
            "VAR robtarget p;\nVAR pose p;\np:=[[1,2,3],{REST};"
        )),
        [form(
            "3:4",
            "a variable whose type this file does not state"
        )]
    );
    let text = "PERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nCONST num n{2,6}:=[[1,2,3,4,5,6],[1,2,3,4,5,6]];\nPERS wobjdata w:=[FALSE,TRUE,\"[[\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\nTPWrite \"[[1,2\";\nMoveL p10,[100,500,5000,1000],z1,t;\n";
    assert_eq!(accepted(Language::Rapid, text), (vec![], vec![]));
}

#[test]
fn a_part_of_a_target_is_listed_and_left_where_that_is_wished() {
    let text = format!(
        "CONST robtarget a:=[[1,2,3],{REST};\nVAR robtarget p;\np.trans.z:=50;\nq.trans:=[1,2,3];\n"
    );
    let refusal = Program::parse(text.as_bytes(), Language::Rapid, Partial::Refused)
        .expect_err("a partial target");
    let printed =
        "`p.trans.z` sets a part of a target alone; a target is corrected whole or not at all";
    assert_eq!(
        (message_of(&refusal.faults), refusal.partial),
        (vec![format!("3:1: {printed}")], 1)
    );
    let program = Program::parse(text.as_bytes(), Language::Rapid, Partial::Left).unwrap();
    assert_eq!(
        message_of(program.warnings()),
        [
            NOWHERE.replace("{}", "1:22"),
            format!("3:1: left as it is: {printed}"),
            "4:1: left as it is: `q.trans`, of a type that this file does not state".into(),
        ]
    );
}

#[test]
fn what_calib_took_for_granted_is_told_by_line() {
    let text = format!(
        "MoveL [[1,2,3],{REST},v1,z1,t\\WObj:=wobj1;\nMoveL Offs(p10,0,0,50),v1,z1,t;\nMoveJ RelTool (p10,0,0,50),v1,z1,t\\wobj:=wobj0;\np:=CRobT(\\Tool:=tool0\\WObj:=wobj0);\nMoveJ Next(),v1,z1,t;\nPDispSet d;\nMoveAbsJ [[1,2,3,4,5,6],[500,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\n"
    );
    let base =
        "calib assumed that targets are in the robot's base, as in wobj0 without displacement";
    let shift =
        "shifts its target; where that one is corrected, the shifted one gets the same correction";
    assert_eq!(
        accepted(Language::Rapid, &text).1,
        [
            "1:9: its work object `wobj1` is declared in none of the files that were read".into(),
            format!("2:7: left as it is: `Offs` {shift}"),
            format!("3:7: left as it is: `RelTool` {shift}"),
            "5:7: left as it is: `Next` computes the target".into(),
            format!("6:1: `PDispSet` displaces what follows: {base}"),
            "7:26: external axis at 500: calib assumed that external axes do not move the robot"
                .into(),
        ]
    );
}

#[test]
fn an_angle_or_a_length_that_no_robot_has_is_refused_where_it_stands() {
    let text = "CONST jointtarget a:=[[10,5e21,5,5,5,5],[9E9,9E9,9E9,9E9,9E9,9E9]];";
    let found = faults(text);
    assert!(
        found.len() == 1
            && found[0].starts_with("1:27: ")
            && found[0].contains("rad is more than 63 rad"),
        "{found:?}"
    );
    let found = faults(&format!("MoveL [[1,2e9,3],{REST},v100,fine,t;"));
    assert!(
        found.len() == 1
            && found[0].starts_with("1:11: ")
            && found[0].contains("m is more than 1000 m"),
        "{found:?}"
    );
}
