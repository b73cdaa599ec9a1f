//! What is in force where a program of KRL moves to its targets: followed through branches, loops, jumps, calls and its other files, or refused.

use calib::program::{Companion, Language, Literal, Partial, Program};
use calib::spatial::Pose;
use nalgebra::Vector3;

const MOTION: &str = "PTP {X 1,Y 2,Z 3,A 4,B 5,C 6}";

fn base(x: f64) -> String {
    format!("$BASE={{X {x},Y 0,Z 0,A 0,B 0,C 0}}")
}

fn read(text: &str, companions: &[(&str, &str)]) -> (Vec<Literal>, Vec<String>) {
    let companions: Vec<Companion> = companions
        .iter()
        .map(|(place, text)| Companion {
            place,
            text: text.as_bytes(),
        })
        .collect();
    let program = Program::parse_with(
        text.as_bytes(),
        Language::Krl,
        Partial::Refused,
        &companions,
    )
    .unwrap_or_else(|refusal| panic!("{text}\n{refusal:#?}"));
    let frames = program
        .frames()
        .iter()
        .map(|note| format!("{}: {}", note.line, note.message))
        .collect();
    (program.literals().to_vec(), frames)
}

/// Where each target's frame stands along x, mm; the reasons of those that are refused.
fn followed(text: &str) -> (Vec<f64>, Vec<String>) {
    let (literals, frames) = read(text, &[]);
    let x = |literal: &Literal| {
        literal
            .frame
            .map_or(0.0, |frame| (frame.translation.x * 1e3).round())
    };
    (literals.iter().map(x).collect(), frames)
}

fn is_refused(text: &str, why: &str) {
    let (_, frames) = followed(text);
    assert!(
        !frames.is_empty() && frames[0].contains(why),
        "{text}\n{frames:?}, expected {why}"
    );
    assert!(
        frames
            .iter()
            .all(|frame| frame.starts_with(&frames[0][..3])),
        "one target alone: {frames:?}"
    );
}

#[test]
fn each_target_stands_in_the_base_that_is_set_before_it() {
    let [one, two] = [base(100.0), base(200.0)];
    let plain = format!("{one}\n{MOTION}\n{two}\n{MOTION}\n$BASE=$NULLFRAME\n{MOTION}\n");
    assert_eq!(followed(&plain), (vec![100.0, 200.0, 0.0], vec![]));
    let both = format!("IF $IN[1] THEN\n{one}\n{MOTION}\nELSE\n{one}\nENDIF\n{MOTION}\n");
    assert_eq!(followed(&both), (vec![100.0, 100.0], vec![]));
    let switch =
        format!("SWITCH N\nCASE 1\n{one}\nCASE 2,3\n{one}\nDEFAULT\n{one}\nENDSWITCH\n{MOTION}\n");
    assert_eq!(followed(&switch), (vec![100.0], vec![]));
    let cycle = format!("{one}\nLOOP\n{MOTION}\n{two}\n{MOTION}\n{one}\nENDLOOP\n");
    assert_eq!(followed(&cycle), (vec![100.0, 200.0], vec![]));
    let jump = format!("{one}\nGOTO ON\n{two}\nON:\n{MOTION}\n");
    assert_eq!(followed(&jump), (vec![100.0], vec![]));
    let left =
        format!("{one}\nFOR I=1 TO 3\nIF $IN[2] THEN\nEXIT\nENDIF\n{MOTION}\nENDFOR\n{MOTION}\n");
    assert_eq!(followed(&left), (vec![100.0, 100.0], vec![]));
    // One routine sets, another only moves: each call hands on what it should.
    let calls = format!(
        "DEF MAIN()\n{one}\nMOVES()\n{MOTION}\nSETS()\n{MOTION}\nEND\nDEF SETS()\n{two}\nRETURN\nEND\nDEF MOVES()\n{MOTION}\nEND\n"
    );
    assert_eq!(followed(&calls), (vec![100.0, 200.0, 100.0], vec![]));
    let for_one =
        format!("{one}\nSLIN {{X 1,Y 2,Z 3,A 4,B 5,C 6}} WITH {two}, $VEL.CP=1\n{MOTION}\n");
    assert_eq!(followed(&for_one), (vec![200.0, 100.0], vec![]));
    let named = format!("DECL FRAME TABLE={{X 300,Y 0,Z 0,A 0,B 0,C 0}}\n$BASE=TABLE\n{MOTION}\n");
    assert_eq!(followed(&named), (vec![300.0], vec![]));
}

#[test]
fn what_cannot_be_followed_is_refused_with_its_line_and_what_is_allowed() {
    let [one, two] = [base(100.0), base(200.0)];
    is_refused(
        &format!("IF $IN[1] THEN\n{one}\nELSE\n{two}\nENDIF\n{MOTION}\n"),
        "6: its $BASE differs between the ways to this target: $BASE of line 2 and $BASE of line 4; expected one",
    );
    is_refused(
        &format!("IF $IN[1] THEN\n{one}\nENDIF\n{MOTION}\n"),
        "4: its $BASE is set on some of the ways to this target alone, by $BASE of line 2",
    );
    is_refused(
        &format!("{one}\nWHILE $IN[1]\n{MOTION}\n{two}\nENDWHILE\n"),
        "3: its $BASE differs",
    );
    is_refused(
        &format!("{one}\nSETS()\n$BASE=F1:F2\n{MOTION}\n"),
        "4: its $BASE is computed when the program runs ($BASE of line 3)",
    );
    is_refused(&format!("{one}\n$BASE.Z=5\n{MOTION}\n"), "is set in parts");
    is_refused(
        &format!("$BASE=BASE_DATA[4]\n{MOTION}\n"),
        "is BASE_DATA[4], which no file that was read declares",
    );
    is_refused(
        &format!("BAS(#BASE,N)\n{MOTION}\n"),
        "$BASE is an entry of BASE_DATA that no file that was read declares (line 1)",
    );
    is_refused(
        &format!(
            "BASE_DATA[4]={{X 1,Y 0,Z 0,A 0,B 0,C 0}}\nBASE_DATA[4].X=2\n$BASE=BASE_DATA[4]\n{MOTION}\n"
        ),
        "BASE_DATA[4]",
    );
    is_refused(
        &format!("{one}\n$IPO_MODE=#TCP\n{MOTION}\n"),
        "the tool stands still ($IPO_MODE #TCP)",
    );
    is_refused(
        &format!("BAS(#EX_BASE,3)\n{MOTION}\n"),
        "moves with an external kinematic",
    );
    is_refused(
        &format!("$ROBROOT={{X 5,Y 0,Z 0,A 0,B 0,C 0}}\n{MOTION}\n"),
        "the program moves the robot's base",
    );
    is_refused(
        &format!("{one}\nIF $IN[1] THEN\n{MOTION}\n"),
        "the block of line 2 does not close where it should",
    );
    is_refused(
        &format!("DECL FRAME F={{X 3,Y 0,Z 0,A 0,B 0,C 0}}\nF.X=4\n$BASE=F\n{MOTION}\n"),
        "is computed when the program runs",
    );
    let twice = format!("DECL E6POS P={{X 1,Y 2,Z 3,A 4,B 5,C 6}}\n{one}\nPTP P\n{two}\nLIN P\n");
    is_refused(
        &twice,
        "1: its $BASE differs between the ways to this target: $BASE of line 2 and $BASE of line 4",
    );
    is_refused(
        "DECL E6POS P={X 1,Y 2,Z 3,A 4,B 5,C 6}\n",
        "is moved to in none of the files that were read",
    );
    let (_, handed) = followed(&format!(
        "DECL E6POS P={{X 1,Y 2,Z 3,A 4,B 5,C 6}}\n{one}\nPTP P\nQ=P\n"
    ));
    assert!(
        handed[0].contains("its $BASE is not followed: line 4 hands the target on"),
        "{handed:?}"
    );
    assert_eq!(
        followed("IF $IN[1] THEN\n$BASE=$NULLFRAME\nENDIF\nPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\n")
            .1,
        [""; 0],
        "joints have no frame"
    );
}

#[test]
fn points_of_inline_forms_are_followed_through_the_files_of_a_program() {
    let data = "DEFDAT A\nDECL E6POS XP1={X 1,Y 2,Z 3,A 4,B 5,C 6}\nDECL FDAT FP1={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE,POINT2[] \" \"}\nENDDAT\n";
    let source = "DEF A()\nPDAT_ACT=PPDAT1\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1\nEND\n";
    let system = "BASE_DATA[3]={X 10,Y 20,Z 30,A 0,B 0,C 0}\nTOOL_DATA[2]={X 0,Y 0,Z 100,A 0,B 0,C 0}\nLOAD_DATA[2]={M 45.5,CM {X 0,Y 0,Z 0,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n";
    let (literals, frames) = read(data, &[("A.SRC", source), ("$CONFIG.DAT", system)]);
    assert_eq!(frames, [""; 0]);
    let at = Pose::new(
        nalgebra::Matrix3::identity(),
        Vector3::new(0.01, 0.02, 0.03),
    );
    assert_eq!(
        (literals[0].frame, literals[0].payload),
        (Some(at), Some(45.5))
    );
    let (_, frames) = read(data, &[("A.SRC", source)]);
    assert!(
        frames[0].contains(
            "2: its $BASE is BASE_DATA[3], which no file that was read declares (FP1 at A.SRC:4)"
        ),
        "{frames:?}"
    );
    let fixed = data.replace("#BASE", "#TCP");
    let (_, frames) = read(&fixed, &[("A.SRC", source), ("$CONFIG.DAT", system)]);
    assert!(frames[0].contains("the tool stands still"), "{frames:?}");
}

#[test]
fn routines_of_other_files_leave_frames_as_they_are_or_are_read() {
    let one = base(100.0);
    let text = format!("DEF MAIN()\n{one}\nGRIP(1)\nGRIP(2)\n{MOTION}\nEND\n");
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused).unwrap();
    let messages: Vec<&str> = program
        .warnings()
        .iter()
        .map(|note| note.message.as_str())
        .filter(|printed| printed.contains("GRIP"))
        .collect();
    assert_eq!(
        messages,
        [
            "calls GRIP of a file that was not read: calib assumed that it leaves $BASE, $TOOL and $LOAD as they are"
        ]
    );
    assert_eq!(
        read(
            &text,
            &[("grip.src", "DEF GRIP(N:IN)\n$OUT[1]=TRUE\nEND\n")]
        )
        .1,
        [""; 0]
    );
    let (_, frames) = read(
        &text,
        &[("grip.src", "DEF GRIP(N:IN)\n$BASE=$NULLFRAME\nEND\n")],
    );
    assert!(
        frames[0].contains("5: its $BASE is set by GRIP, a routine of another file (line 4)"),
        "{frames:?}"
    );
}

#[test]
fn what_a_routine_of_another_file_sets_by_one_that_it_calls_is_not_taken_as_left() {
    let one = base(100.0);
    let text = format!("DEF MAIN()\n{one}\nPART(1)\n{MOTION}\nEND\n");
    let (caller, setter) = (
        "DEF PART(N:IN)\nFIXTURE()\nEND\n",
        "DEF FIXTURE()\n$BASE=$NULLFRAME\nEND\n",
    );
    let is_refused = |companions: &[(&str, &str)], text: &str, name: &str| {
        let (_, frames) = read(text, companions);
        assert!(
            frames
                .first()
                .is_some_and(|frame| frame.contains(&format!("its $BASE is set by {name}"))),
            "{frames:?}"
        );
    };
    // In whatever order they stand.
    is_refused(
        &[("part.src", caller), ("fixture.src", setter)],
        &text,
        "PART",
    );
    is_refused(
        &[("fixture.src", setter), ("part.src", caller)],
        &text,
        "PART",
    );
    is_refused(&[("part.src", &format!("{caller}{setter}"))], &text, "PART");
    // Within an expression.
    let asked = format!("DEF MAIN()\n{one}\nIF CLAMPED(1) THEN\n{MOTION}\nENDIF\nEND\n");
    is_refused(
        &[(
            "clamped.src",
            "DEFFCT BOOL CLAMPED(N:IN)\n$BASE=$NULLFRAME\nRETURN TRUE\nENDFCT\n",
        )],
        &asked,
        "CLAMPED",
    );
}

#[test]
fn loads_follow_the_program() {
    let payloads = |text: &str| followed_loads(text);
    assert_eq!(
        payloads(&format!(
            "$LOAD={{M 4}}\n{MOTION}\n$LOAD={{M 5}}\n{MOTION}\n"
        )),
        [Some(4.0), Some(5.0)]
    );
    assert_eq!(
        payloads(&format!("IF $IN[1] THEN\n$LOAD={{M 4}}\nENDIF\n{MOTION}\n")),
        [None]
    );
    assert_eq!(
        payloads(&format!("LOAD_DATA[2]={{M 7}}\nBAS(#TOOL,2)\n{MOTION}\n")),
        [Some(7.0)]
    );
    assert_eq!(
        payloads(&format!(
            "LOAD_DATA[2]={{M 7}}\nBAS(#TOOL,2)\n$LOAD={{M 9}}\n{MOTION}\n"
        )),
        [Some(9.0)]
    );
}

fn followed_loads(text: &str) -> Vec<Option<f64>> {
    read(text, &[])
        .0
        .iter()
        .map(|literal| literal.payload)
        .collect()
}

#[test]
fn a_program_as_teach_pendants_write_it_is_followed() {
    let source = "&ACCESS RVP\n&REL 12\nDEF  weld( )\n;FOLD INI\n;FOLD BASISTECH INI\nGLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\nINTERRUPT ON 3\nBAS (#INITMOV,0 )\n;ENDFOLD\n;ENDFOLD\n;FOLD PTP HOME  Vel= 100 % DEFAULT\n$BWDSTART = FALSE\nPDAT_ACT=PDEFAULT\nFDAT_ACT=FHOME\nBAS (#PTP_PARAMS,100 )\n$H_POS=XHOME\nPTP  XHOME\n;ENDFOLD\nLOOP\nIF $IN[17] THEN\n;FOLD LIN P1 Vel=2 m/s CPDAT1 Tool[1] Base[2]\n$BWDSTART=FALSE\nLDAT_ACT=LCPDAT1\nFDAT_ACT=FP1\nBAS(#CP_PARAMS,2)\nLIN XP1 C_DIS\n;ENDFOLD\nELSE\nFDAT_ACT=FP2\nBAS(#CP_PARAMS,2)\nCIRC XP2, XP3\nENDIF\nENDLOOP\nEND\n";
    let pose = "{X 1,Y 2,Z 3,A 4,B 5,C 6,S 6,T 27,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}";
    let data = format!(
        "&ACCESS RVP\nDEFDAT  WELD\n;FOLD EXTERNAL DECLARATIONS\nEXT  BAS (BAS_COMMAND  :IN,REAL  :IN )\nDECL INT SUCCESS\n;ENDFOLD\nDECL E6POS XP1={pose}\nDECL FDAT FP1={{TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE,POINT2[] \" \",TQ_STATE FALSE}}\nDECL LDAT LCPDAT1={{VEL 2.0,ACC 100.0,APO_DIST 100.0,APO_FAC 50.0,ORI_TYP #VAR}}\nDECL E6POS XP2={pose}\nDECL E6POS XP3={pose}\nDECL FDAT FP2={{TOOL_NO 1,BASE_NO 3,IPO_FRAME #BASE,POINT2[] \"XP2\",TQ_STATE FALSE}}\nENDDAT\n"
    );
    let system = "DEFDAT  $CONFIG\nE6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}\nDECL FDAT FHOME={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] \" \"}\nFRAME BASE_DATA[32]\nBASE_DATA[2]={X 100,Y 0,Z 0,A 0,B 0,C 0}\nBASE_DATA[3]={X 200,Y 0,Z 0,A 0,B 0,C 0}\nTOOL_DATA[1]={X 0,Y 0,Z 210,A 0,B 0,C 0}\nLOAD_DATA[1]={M 62,CM {X 0,Y 0,Z 90,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\nENDDAT\n";
    let (literals, frames) = read(&data, &[("weld.src", source), ("$config.dat", system)]);
    assert_eq!(frames, [""; 0]);
    let x = |literal: &Literal| {
        literal
            .frame
            .map_or(0.0, |frame| (frame.translation.x * 1e3).round())
    };
    assert_eq!(
        literals.iter().map(x).collect::<Vec<_>>(),
        [100.0, 200.0, 200.0]
    );
    assert!(literals.iter().all(|literal| literal.payload == Some(62.0)));
}
