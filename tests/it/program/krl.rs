//! KUKA KRL: numbers are strict, fields are known, types are stated.

use super::{TargetKind, accepted, message_of, refused};
use calib::program::{Language, Partial, Program};

fn faults(text: &str) -> Vec<String> {
    refused(Language::Krl, text)
}

fn targets(text: &str) -> Vec<(TargetKind, Vec<f64>)> {
    accepted(Language::Krl, text).0
}

fn warnings(text: &str) -> Vec<String> {
    accepted(Language::Krl, text).1
}

#[test]
fn blanks_do_not_join_numbers_and_strays_are_not_dropped() {
    assert_eq!(
        faults("PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 306 30.0}"),
        ["1:39: A6 is `306 30.0`, expected a number"]
    );
    assert_eq!(
        faults("PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 3 0.0}"),
        ["1:39: A6 is `3 0.0`, expected a number"]
    );
    assert_eq!(
        faults("PTP {A1 5,0,A2 20,A3 -30,A4 5,A5 40,A6 0}"),
        ["1:11: `0` has no name"]
    );
    assert_eq!(
        faults("PTP {A1 5,A1 7,A2 20,A3 -30,A4 5,A5 40,A6 0}"),
        ["1:11: A1 is given twice"]
    );
    assert_eq!(
        faults("PTP {A1 5,A2 20,,A3 -30,A4 5,A5 40,A6 0}"),
        ["1:16: a field is empty"]
    );
    assert_eq!(
        faults("PTP {A1 5,20,A3 -30,A4 5,A5 40,A6}"),
        ["1:11: `20` has no name", "1:34: A6 has no number"]
    );
}

#[test]
fn a_number_is_one_token_of_the_grammar() {
    let with = |number: &str| format!("PTP {{A1 {number},A2 0,A3 0,A4 0,A5 0,A6 0}}");
    for (text, value) in [
        ("10", 10.0),
        ("-10.5", -10.5),
        ("- 10.5", -10.5),
        ("+3", 3.0),
        ("1E1", 10.0),
        ("1.5e-2", 0.015),
        ("2E+1", 20.0),
    ] {
        assert_eq!(targets(&with(text))[0].1[0], value, "{text}");
    }
    for text in [
        "1.", ".5", "1..2", "1.2.3", "1,5", "0x1F", "'H1F'", "10mm", "1E", "1E+", "1E5.5", "1E 5",
        "--1", "- -1", "1-", "1+2", "2*3", "HOME.A1", "X1", "#ON", "\"1\"", "1 ", "1_0", "١",
        "1\u{a0}", "\u{a0}1", "NaN", "inf", "1e999", "{A 1}", "(1)", "1:2",
    ] {
        let text = with(text);
        if text.contains("A1 1 ,") {
            assert_eq!(targets(&text)[0].1[0], 1.0);
        } else {
            assert!(!faults(&text).is_empty(), "{text}");
        }
    }
}

#[test]
fn all_faults_of_a_program_come_at_once() {
    let text = "DEF x()\r\n PTP {A1 10,A2 foo,A3 -30,A4 5,A5 40,A6 0}\r\nPTP {A1 10,A2 3\r\nLIN {E6POS: X 1,Y 2}\r\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6,Q 7}\r\n";
    assert_eq!(
        faults(text),
        [
            "2:16: A2 is `foo`, expected a number",
            "3:5: `{` without `}` on its line",
            "4:5: the target has no Z, A, B, C; a target is corrected whole or not at all",
            "5:30: unknown field `Q` (allowed: X, Y, Z, A, B, C, S, T, E1, E2, E3, E4, E5, E6)",
        ]
    );
}

#[test]
fn the_operands_of_the_geometric_operator_are_no_absolute_poses() {
    const SAID: &str = "the geometric operator `:` makes a relative pose of its operand; calib corrects absolute ones alone";
    let operand = "{X 0,Y 0,Z 50,A 0,B 0,C 0}";
    for (text, column) in [
        (format!("LIN XP1:{operand}"), 8),
        (format!("LIN {operand}:XP1"), 31),
        (format!("LIN XP1:XP2:{operand} C_DIS"), 8),
        ("PTP XP1 : XOFFSET".into(), 9),
        (format!("XP2=XP1:{operand}"), 8),
        (
            format!("XP2 = {{E6POS: X 1,Y 2,Z 3,A 4,B 5,C 6}} : {operand}"),
            40,
        ),
    ] {
        assert_eq!(faults(&text), [format!("1:{column}: {SAID}")], "{text}");
    }
    // Frames of the system may be made so; labels and parameters are no operators.
    let text = format!(
        "DEF F(A:IN,B:OUT)\n$BASE=EK1:{operand}\nL1:\nPTP {{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}}\nXP2=XP1:XOFF\n"
    );
    let (found, warned) = accepted(Language::Krl, &text);
    assert_eq!(found.len(), 1);
    assert_eq!(
        warned,
        ["5:8: left as it is: a pose that the program computes by the geometric operator `:`",]
    );
}

#[test]
fn partial_targets_are_listed_and_left_where_that_is_wished() {
    let text = "LIN {X 10,Y 20}\nPTP {A1 20}\nPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nDECL E6POS XP1\nXP1.Z = 50\nPTP {E1 500}\n";
    let whole = "; a target is corrected whole or not at all";
    let printed = [
        format!("the target has no Z, A, B, C{whole}"),
        format!("the target has no A2, A3, A4, A5, A6{whole}"),
        format!("sets Z of the target `XP1` alone{whole}"),
        format!("the target has no X, Y, Z, A, B, C{whole}"),
    ];
    let places = ["1:5", "2:5", "5:1", "6:5"];
    let listed: Vec<String> = places
        .iter()
        .zip(&printed)
        .map(|(place, printed)| format!("{place}: {printed}"))
        .collect();
    let refusal = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused)
        .expect_err("partial targets");
    assert_eq!((message_of(&refusal.faults), refusal.partial), (listed, 4));
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Left).unwrap();
    assert_eq!(program.literals().len(), 1);
    let mut warned: Vec<String> = places
        .iter()
        .zip(&printed)
        .map(|(place, printed)| format!("{place}: left as it is: {printed}"))
        .collect();
    warned.push(
        "6:9: E1 is 500: calib assumed that external axes stand at 0 and do not move the robot"
            .into(),
    );
    assert_eq!(message_of(program.warnings()), warned);
}

#[test]
fn what_calib_takes_for_granted_is_told_at_the_target() {
    let target = "{X 1,Y 2,Z 3,A 4,B 5,C 6,S 18,T 'B1010',E1 1500.0,E2 0.0}";
    let text = format!(
        "SLIN {target} WITH $TOOL={{X 1,Y 0,Z 0,A 0,B 0,C 0}}, $IPO_MODE=#TCP\nSLIN {target}\n"
    );
    let external =
        "E1 is 1500: calib assumed that external axes stand at 0 and do not move the robot";
    let accurate = "S says that the point was taught at an absolutely accurate robot: calib assumed that the controller's own model of the robot's errors is off";
    assert_eq!(
        warnings(&text),
        [
            "1:9: its $BASE is carried by the robot: the tool stands still ($IPO_MODE #TCP) ($IPO_MODE of line 1)".into(),
            format!("1:33: {accurate}"),
            format!("1:49: {external}"),
            "2:9: no $BASE is set before this target: calib assumed that it stands in the robot's base".into(),
            format!("2:33: {accurate}"),
            format!("2:49: {external}"),
        ]
    );
}

#[test]
fn a_target_is_known_by_its_prefix_its_declaration_or_its_motion() {
    let frame = "{X 1,Y 2,Z 3,A 4,B 5,C 6}";
    let axes = "{a6 6,A5 5,A4 4,A3 3,A2 2,A1 1}";
    let text = format!(
        "&ACCESS RVP\n&PARAM T = {{\nDEFDAT X\n;FOLD PTP P1 {{A1 9,A2\nDECL POS P[2]\nP[1]={frame}\nDECL E6AXIS H={axes} ; {{A1\nGLOBAL E6POS G={{ e6pos : X 1 , Y 2,Z 3,A 4,B 5,C 6 }}\nQ={{AXIS: A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}}\nSCIRC {frame},{frame},CA 30 C_SPL\nSPL {frame}\nLIN {{FRAME: X 1,Y 2,Z 3,A 4,B 5,C 6}}\nENDDAT\n"
    );
    let frame = (TargetKind::Frame, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let axes = (TargetKind::Joints, frame.1.clone());
    assert_eq!(
        targets(&text),
        [&frame, &axes, &frame, &axes, &frame, &frame, &frame, &frame].map(Clone::clone)
    );
}

#[test]
fn what_is_no_target_stays_and_what_may_be_one_is_refused() {
    let frame = "{X 1,Y 2,Z 3,A 4,B 5,C 6}";
    let text = format!(
        "LIN_REL {frame}\nPTP_REL {{A1 5}}\nASYPTP {{E1 5}}\nDECL FRAME F={frame}\nF={frame}\nDECL LOAD L={{M 5,CM {frame},J {{X 0,Y 0,Z 0}}}}\n$VEL={{CP 2,ORI1 200}}\nDECL PDAT P={{VEL 100,ACC 100,APO_DIST 100}}\nMsg(\"{{A1 5\")\n"
    );
    let moves = |line: usize, what: &str| {
        format!(
            "{line}:1: left as it is: {what} moves by a distance from where the target before, as corrected, has led"
        )
    };
    assert_eq!(
        accepted(Language::Krl, &text),
        (vec![], vec![moves(1, "LIN_REL"), moves(2, "PTP_REL")])
    );
    let unstated = |what: &str, advice: &str| {
        format!("the type of {what} is not stated in this file; write {advice}")
    };
    let pose = "`{E6POS: ...}` for a target, `{FRAME: ...}` for a frame, which stays as it is";
    assert_eq!(
        faults(&format!("XP1={frame}")),
        [format!("1:5: {}", unstated("`XP1`", pose))]
    );
    assert_eq!(
        faults("H={A1 1,A2 2}"),
        [format!("1:3: {}", unstated("`H`", "`{E6AXIS: ...}`"))]
    );
    assert_eq!(
        faults(&format!("MOVE({frame})")),
        [format!("1:6: {}", unstated("this aggregate", pose))]
    );
    assert_eq!(
        warnings(&format!(
            "STRUC SPAN FRAME P,INT GUN\nDECL SPOT S={{P {frame},GUN 1}}\nDECL SPAN Q={frame}"
        )),
        [
            "2:16: left as it is: read as a FRAME inside a structure",
            "3:13: left as it is: SPAN is a structure of this file and no type of targets"
        ]
    );
    let unknown = |name: &str| {
        format!("type {name} is not understood: calib cannot say whether this is a target")
    };
    assert_eq!(
        faults("DECL AXISx XP2={A1 10,A2 -80,A3 95,A4 10,A5 30,A6 -20}"),
        [format!("1:16: {}", unknown("AXISX"))]
    );
    assert_eq!(
        faults(&format!(
            "DECL SPOT S={{P {{E6PXS: X 1}}}}\nDECL E6PXS Q={frame}"
        )),
        [
            format!("1:16: {}", unknown("E6PXS")),
            format!("2:14: {}", unknown("E6PXS"))
        ]
    );
    assert_eq!(
        faults("DECL SPOT S={P {X 1,Y 2,Z 3,A 4,B 5,C 6,S 1,T 2},GUN 1}"),
        [format!(
            "1:16: the type of this aggregate is not stated; write {pose}"
        )]
    );
    assert_eq!(
        faults(&format!("PTP {frame} 5")),
        ["1:31: `5` behind a position is not understood"]
    );
    assert_eq!(
        faults(&format!("PTP {frame},{frame}")),
        ["1:31: an aggregate that is no position of this motion"]
    );
    assert_eq!(
        faults("DECL AXIS H={A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}$X=1"),
        ["1:44: `$X` behind a target is not understood"]
    );
    assert_eq!(
        faults("PTP XP1 \"x"),
        ["1:9: `\"` is not closed on its line"]
    );
}
