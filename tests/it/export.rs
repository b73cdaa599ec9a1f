//! Exports: what is written is read back by calib itself and is the same arm; programs change in the numbers of targets alone.

use crate::compensate::{calib, cell};
use calib::robot::RobotModel;
use calib::robot::import::{Text, read_calib};
use serde_json::Value;

fn exported(format: &str) -> String {
    let output = calib(cell(), &["export", "latest", "--format", format], "");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("not carried: reduction_ratio at joint 3"), "{said}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The tool at a joint position by the exported JSON: product of exponentials written out here.
fn by_json(model: &Value, q: &[f64]) -> [f64; 3] {
    let three = |value: &Value| -> [f64; 3] { [0, 1, 2].map(|k| value[k].as_f64().expect("a number")) };
    let mut point = three(&model["tool"]["point_m"]);
    for (joint, angle) in model["joints"].as_array().expect("joints").iter().zip(q).rev() {
        let (axis, on) = (three(&joint["axis"]), three(&joint["point_m"]));
        let p = [0, 1, 2].map(|k| point[k] - on[k]);
        let cross = [axis[1] * p[2] - axis[2] * p[1], axis[2] * p[0] - axis[0] * p[2], axis[0] * p[1] - axis[1] * p[0]];
        let along: f64 = (0..3).map(|k| axis[k] * p[k]).sum();
        point = [0, 1, 2].map(|k| on[k] + p[k] * angle.cos() + cross[k] * angle.sin() + axis[k] * along * (1.0 - angle.cos()));
    }
    point
}

#[test]
fn tables_and_urdf_are_the_arm_that_was_identified() {
    let model: Value = serde_json::from_str(&exported("json")).expect("JSON");
    let urdf = exported("urdf");
    let beside = "calib_robot: 1\nname: u\nunits: {length: mm, angle: deg}\nkinematics:\n  urdf: {base: base_link, tip: tool0}\n";
    let label = |text| Text { label: "robot.yaml", text };
    let robots = [
        read_calib(label(beside), Some(Text { label: "arm.urdf", text: &urdf })).expect("a URDF"),
        read_calib(label(&exported("dh")), None).expect("a DH table"),
        read_calib(label(&exported("mdh")), None).expect("a modified DH table"),
    ];
    for robot in robots.map(|imported| RobotModel::new(imported.robot)) {
        for k in 0..50 {
            let q: Vec<f64> = (0..6).map(|j| (1.3 * k as f64 + 0.7 * j as f64).sin()).collect();
            let (found, wanted) = (robot.forward(&q).translation, by_json(&model, &q));
            let apart = (0..3).map(|k| (found[k] - wanted[k]).powi(2)).sum::<f64>().sqrt();
            assert!(apart < 1e-9, "{apart} m");
        }
    }
}

const KRL: &str = "DEF weld( )\r\n; {A1 9, A2 not code\r\nDECL E6AXIS XHOME={A1 0.0,A2 -10.0,A3 20.0,A4 5,A5 30,A6 0.0,E1 0.0}\r\n PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0} C_PTP\r\nLIN {E6POS: X 900.0,Y 40.0,Z 930.5,A 0.0,B 0.0,C 0.0,S 2,T 10,E1 0.0}\r\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\r\nEND\r\n";

const RAPID: &str = "MODULE m\n  ! [[1,2\n  CONST jointtarget home:=[[0,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n  CONST robtarget ps{2}:=[[[900.0,40,930],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[910,40,930],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];\n  PERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n  MoveAbsJ [[1,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs, v1000, z50, t;\nENDMODULE\n";

fn program(name: &str, text: &str) -> (Option<i32>, String, String) {
    let path = cell().join(name);
    std::fs::write(&path, text).expect("a file");
    let output = calib(cell(), &["compensate", "latest", name, "--quiet"], "");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The text with every number taken out, where `keep` does not hold for its line.
fn without_numbers(text: &str, targets: &[usize]) -> Vec<String> {
    let strip = |line: &str| line.chars().filter(|c| !(c.is_ascii_digit() || *c == '.' || *c == '-')).collect();
    text.split('\n').enumerate().map(|(k, line)| if targets.contains(&k) { strip(line) } else { line.to_string() }).collect()
}

#[test]
fn programs_differ_in_the_numbers_of_targets_and_nothing_else() {
    for (name, text, targets) in [("weld.src", KRL, [2, 3, 4]), ("m.mod", RAPID, [2, 3, 5])] {
        let (code, corrected, said) = program(name, text);
        assert_eq!(code, Some(0), "{said}");
        assert_ne!(corrected, text);
        assert_eq!(without_numbers(&corrected, &targets), without_numbers(text, &targets));
        for k in targets {
            assert_ne!(corrected.split('\n').nth(k), text.split('\n').nth(k), "line {k} has a target");
        }
    }
    let (_, corrected, _) = program("weld.src", KRL);
    assert!(corrected.contains(",E1 0.0}") && corrected.contains(",S 2,T 10,"), "{corrected}");
}

#[test]
fn malformed_programs_are_refused_with_line_and_column() {
    let refused = |name: &str, text: &str, wanted: &[&str]| {
        let (code, out, said) = program(name, text);
        assert_eq!((code, out.as_str()), (Some(10), ""));
        for part in wanted {
            assert!(said.contains(part), "{said}");
        }
    };
    let krl = "DEF x()\n PTP {A1 10,A2 foo,A3 -30,A4 5,A5 40,A6 0}\nPTP {A1 10,A2 3\nLIN {E6POS: X 1,Y 2}\n";
    refused("bad.src", krl, &["bad.src:2:16: A2 is `foo`", "bad.src:3:5: `{` without `}`", "bad.src:4:5: the target has no Z"]);
    let rapid = "CONST jointtarget a:=[[1,2,3],[9E9,1,1,1,1,1]];\nCONST robtarget b:=[[1,2,x],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nCONST robtarget c:=[[1,2;\n";
    refused(
        "bad.mod",
        rapid,
        &["bad.mod:1:23: 3 numbers, expected 6", "bad.mod:2:26: `x` is no number", "bad.mod:3:21: `[` without `]`"],
    );
}
