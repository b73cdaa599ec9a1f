//! Universal Robots' script.

use super::{TargetKind, accepted, refused};
use calib::program::{Language, Partial, PostureStatement, Program, joint_list};

const SCRIPT: &str = "def weld():
  set_tcp(p[0, 0, 0.1, 0, 0, 0])   # the torch, p[1,2,3,4,5,6]
  set_payload(1.5, [0, 0, 0.05])
  global wp1_p = p[.5, -0.25, 3E-1, 0, 3.1, 0]
  global wp1_q=[-1.6, -1.73, -2.2, -0.81, 1.6, 0]
  global limits = [1, 2, 3, 4, 5, 6]
  home = [0, -1.57, 1.57, 0, 1.57, 0]
  $ 2 \"MoveJ p[1,2,3,4,5,6]\"
  movej(get_inverse_kin(wp1_p, qnear=wp1_q), a=1.4, v=1.05)
  if limits[0] == 1:
    movel(p[0.4, 0, 0.3, 0, 3, 0], a=1.2, v=0.25, r=0.01)
  end
  movec(p[0.4, 0.1, 0.3, 0, 3, 0], p[0.4, 0.2, 0.3, 0, 3, 0], a=1.2)
  movej(home)
  movel(get_actual_tcp_pose())
end
";

fn message_of(text: &str) -> Vec<String> {
    refused(Language::UrScript, text)
}

#[test]
fn poses_and_joints_of_motions_are_targets_where_they_are_written() {
    let (found, warned) = accepted(Language::UrScript, SCRIPT);
    let pose = |v: [f64; 6]| (TargetKind::RotationVector, v.to_vec());
    let expected = [
        pose([0.5, -0.25, 0.3, 0.0, 3.1, 0.0]),
        (TargetKind::Radians, vec![0.0, -1.57, 1.57, 0.0, 1.57, 0.0]),
        pose([0.4, 0.0, 0.3, 0.0, 3.0, 0.0]),
        pose([0.4, 0.1, 0.3, 0.0, 3.0, 0.0]),
        pose([0.4, 0.2, 0.3, 0.0, 3.0, 0.0]),
    ];
    assert_eq!(found, expected);
    assert_eq!(
        warned,
        [
            "3:3: payload 1.5 kg, as the program states",
            "15:9: left as it is: `get_actual_tcp_pose()` computes the target"
        ]
    );
    let program = Program::parse(SCRIPT.as_bytes(), Language::UrScript, Partial::Refused).unwrap();
    let near = [-1_600_000, -1_730_000, -2_200_000, -810_000, 1_600_000, 0];
    assert_eq!(program.literals()[0].posture, PostureStatement::Near(near));
    let list = joint_list(SCRIPT.as_bytes(), Language::UrScript).unwrap();
    let names: Vec<&str> = list.rows.iter().map(|row| row.name.as_str()).collect();
    assert_eq!((names, list.poses), (vec!["wp1_q", "limits", "home"], 1));
    assert!((list.rows[2].joints[4] - 1.57f64.to_degrees()).abs() < 1e-12);
}

#[test]
fn what_may_or_may_not_be_a_target_is_refused_with_its_line() {
    for (line, wanted) in [
        (
            "movel(pose_trans(p[1,0,0,0,0,0], wp1_p))",
            "16:9: `pose_trans(p[1,0,0,0,0,0], wp1_p)` computes a target from a literal",
        ),
        (
            "go(p[0.1,0.2,0.3,0,0,0])",
            "16:6: a pose in a call of `go`: calib cannot say whether it is a target",
        ),
        (
            "go([0.1,0.2,0.3,0,0,0])",
            "16:6: a list of six numbers in a call of `go`",
        ),
        (
            "go(home)",
            "16:6: the target `home` is handed to `go`: calib cannot say what becomes of it there",
        ),
        (
            "home[2] = 1.2",
            "16:3: the target `home` is changed in one number",
        ),
        (
            "x = wp1_p + p[0,0,0.1,0,0,0]",
            "16:15: a pose in an expression",
        ),
        (
            "movel(p[0.1,0.2,0.3,0,0])",
            "16:9: `p[0.1,0.2,0.3,0,0]` is no list of six numbers",
        ),
        (
            "movel(p[0.1,0.2,0.3,0,0,d2r(90)]",
            "16:8: `(` is not closed on its line",
        ),
        ("movej([0,0,0,0,0,0)]", "16:21: `)` without `(`"),
        (
            "x = p[1,2,3]",
            "16:7: a pose that is not written in six numbers",
        ),
        ("movej([0,0,0,0,0,1e9])", "16:"),
        (
            "movej([0,0,0,0,0,d2r(90)])",
            "16:9: `[0,0,0,0,0,d2r(90)]` is no list of six numbers",
        ),
    ] {
        let text = SCRIPT.replace("end\n  movec", "end2").replacen(
            "\nend\n",
            &format!("\n  {line}\nend\n"),
            1,
        );
        let text = text.replace("end2", "end\n  movec");
        let messages = message_of(&text);
        assert!(
            messages.iter().any(|one| one.contains(wanted)),
            "{line}: {messages:?}"
        );
    }
    let frames = SCRIPT.replace(
        "  movej(home)\n",
        "  set_tcp(p[0, 0, 0.2, 0, 0, 0])\n  movej(home)\n",
    );
    let program = Program::parse(frames.as_bytes(), Language::UrScript, Partial::Refused).unwrap();
    assert!(super::message_of(program.frames())[0].contains("set_tcp sets several tools"));
}
