//! Listings of FANUC's TP programs.

use super::{TargetKind, accepted, refused};
use calib::program::{Language, Partial, PostureStatement, Program, joint_list};

const LISTING: &str = "/PROG  MEASURE\r
/ATTR\r
OWNER\t\t= MNEDITOR;\r
COMMENT\t\t= \"don't\";\r
DEFAULT_GROUP\t= 1,1,*,*,*;\r
/MN\r
   1:  !it's a remark with P[9] ;\r
   2:  UFRAME_NUM=0 ;\r
   3:J P[1] 100% FINE    ;\r
   4:L P[2:\"left, {up}\"] 250mm/sec CNT100    ;\r
   5:L PR[3] 250mm/sec FINE    ;\r
/POS\r
P[1]{\r
   GP1:\r
\tUF : 0, UT : 2,\t\r
\tJ1=     -.500 deg,\tJ2=   -20.000 deg,\tJ3=    10.000 deg,\r
\tJ4=     0.000 deg,\tJ5=   -90.000 deg,\tJ6=   180.000 deg,\r
\tE1=   500.000  mm\r
   GP2:\r
\tUF : 0, UT : 1,\t\r
\tJ1=    12.000 deg\r
};\r
P[2:\"left, {up}\"]{\r
   GP1:\r
\tUF : 0, UT : 2,\t\tCONFIG : 'N U T, 0, 0, -1',\r
\tX =   500.000  mm,\tY =    -1.250  mm,\tZ =   300.000  mm,\r
\tW =   180.000 deg,\tP =      .000 deg,\tR =   -30.000 deg\r
};\r
/END\r
";

fn message_of(text: &str) -> Vec<String> {
    refused(Language::Fanuc, text)
}

#[test]
fn joints_and_poses_of_the_first_group_are_targets() {
    let (found, warned) = accepted(Language::Fanuc, LISTING);
    let joints = (
        TargetKind::Joints,
        vec![-0.5, -20.0, 10.0, 0.0, -90.0, 180.0],
    );
    let pose = (
        TargetKind::Frame,
        vec![500.0, -1.25, 300.0, -30.0, 0.0, 180.0],
    );
    assert_eq!(found, [joints, pose]);
    assert_eq!(
        warned,
        [
            "11:1: left as it is: moves to a position register, which is not in the listing",
            "18:8: external axis at 500: calib assumed that external axes do not move the robot",
            "19:4: group 2 stays as it is: calib assumed that it does not move the robot",
            "25:28: CONFIG: calib assumed that N is a wrist with J5 below zero, and F one above; confirm it at one pose of the controller",
        ]
    );
    let program = Program::parse(LISTING.as_bytes(), Language::Fanuc, Partial::Refused).unwrap();
    let posture = PostureStatement::Config {
        flip: false,
        up: true,
        turns: [0, 0, -1],
    };
    assert_eq!(program.literals()[1].posture, posture);
    let list = joint_list(LISTING.as_bytes(), Language::Fanuc).unwrap();
    assert_eq!(
        (
            list.rows.len(),
            list.poses,
            list.rows[0].name.as_str(),
            list.rows[0].line
        ),
        (1, 1, "P[1]", 16)
    );
}

#[test]
fn a_turn_that_changes_is_written_where_it_stands() {
    let program = Program::parse(LISTING.as_bytes(), Language::Fanuc, Partial::Refused).unwrap();
    let answer = |literal: &calib::program::Literal| calib::program::SolvedLiteral {
        values: literal.values.clone(),
        posture: match literal.posture {
            PostureStatement::Config { flip, up, .. } => PostureStatement::Config {
                flip,
                up,
                turns: [0, 1, 0],
            },
            other => other,
        },
        remark: String::new(),
    };
    let out = program
        .rewritten(
            program
                .literals()
                .iter()
                .map(|literal| Ok(answer(literal)))
                .collect(),
        )
        .unwrap();
    assert_eq!(
        String::from_utf8_lossy(&out.bytes),
        LISTING.replace("'N U T, 0, 0, -1'", "'N U T, 0, 1, 0'")
    );
}

#[test]
fn what_is_not_understood_is_refused_with_its_line() {
    let changed = |from: &str, to: &str| message_of(&LISTING.replacen(from, to, 1));
    for (from, to, line, wanted) in [
        (
            "J2=   -20.000 deg",
            "J2=********* deg",
            "16:",
            "`*` in the positions is not understood; expected a number",
        ),
        (
            "J2=   -20.000 deg",
            "J2=   -20.000  mm",
            "16:",
            "J2 in mm, expected deg",
        ),
        (
            ",\tJ3=    10.000 deg",
            "",
            "14:",
            "J3 is missing; expected J1, J2, J3, J4, J5, J6",
        ),
        (
            "J2=   -20",
            "J1=   -20",
            "16:",
            "J1 stands twice in a group",
        ),
        (
            "J2=   -20.000",
            "J2=   -20.0.0",
            "16:",
            "in the positions is not understood; expected a number",
        ),
        (
            "'N U T, 0, 0, -1'",
            "'N U B, 0, 0, -1'",
            "25:",
            "configuration `'N U B, 0, 0, -1'` is not read",
        ),
        (
            "'N U T, 0, 0, -1'",
            "'N R U T, 0, 0, -1'",
            "25:",
            "is not read; expected N or F",
        ),
        (
            "CONFIG : 'N U T, 0, 0, -1',",
            "",
            "24:",
            "CONFIG is missing",
        ),
        ("P[2:\"left, {up}\"]{", "P[1]{", "23:", "P[1] stands twice"),
        ("};\r\n/END", "}\r\n/END", "", "expected `;`"),
        (
            "W =   180.000 deg,",
            "Q =   180.000 deg,",
            "27:",
            "`Q` in the positions is not understood; expected UF, UT, CONFIG",
        ),
        (
            "/END",
            "/ENDE",
            "1:",
            "no listing of a TP program: expected the sections",
        ),
        ("J1=     -.500 deg", "J1= 9999999.0 deg", "16:", ""),
    ] {
        let messages = changed(from, to);
        assert!(
            messages
                .iter()
                .any(|one| one.starts_with(line) && one.contains(wanted)),
            "{to}: {messages:?}"
        );
    }
    assert!(message_of("a,b\n1,2\n")[0].contains("no listing of a TP program"));
}

#[test]
fn frames_and_displacements_that_a_listing_does_not_hold_are_said() {
    let frames = |text: &str| {
        let program = Program::parse(text.as_bytes(), Language::Fanuc, Partial::Refused).unwrap();
        super::message_of(program.frames())
    };
    let posture = "CONFIG: calib assumed that N is a wrist with J5 below zero, and F one above; confirm it at one pose of the controller";
    let behind = |text: &str| {
        let mut all = frames(text);
        let at = all.iter().position(|note| note.ends_with(posture)).unwrap();
        all.remove(at);
        all
    };
    assert!(behind(LISTING).is_empty());
    let other = LISTING.replace("UF : 0, UT : 2,\t\tCONFIG", "UF : 3, UT : 2,\t\tCONFIG");
    assert_eq!(
        behind(&other),
        [
            "25:2: user frame 3 is in no listing: calib assumed that it is the robot's world, as UF 0"
        ]
    );
    let other = LISTING.replace("CNT100    ;", "CNT100 Offset,PR[4]    ;");
    assert_eq!(
        behind(&other),
        ["10:1: OFFSET displaces the target: calib assumed that it is reached where it stands"]
    );
}
