//! What a faulty robot file says: every fault at once, each with its place and what is allowed.

use crate::answer::{has, starts_with};
use calib::robot::import::{RobotFileText, read_calib, read_case};

const GOOD: &str = "calib_robot: 1
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [300, 0, 0]}
tool: {point: [900, 0, 0]}
";

fn calib(text: &str) -> String {
    match read_calib(RobotFileText::new("robot.yaml", text), None) {
        Ok(_) => "no fault".into(),
        Err(error) => {
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        }
    }
}

/// The faults of the good file with one text replaced by another.
fn changed(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    calib(&GOOD.replace(from, to))
}

fn added(text: &str) -> String {
    calib(&format!("{GOOD}{text}\n"))
}

fn urdf(text: &str, base: &str, tip: &str) -> String {
    let file = format!(
        "calib_robot: 1\nunits: {{length: mm, angle: deg}}\nkinematics: {{urdf: {{base: {base}, tip: {tip}}}}}\n"
    );
    let urdf = RobotFileText::new("arm.urdf", text);
    read_calib(RobotFileText::new("robot.yaml", &file), Some(urdf))
        .map_or_else(|e| e.to_string(), |_| "no fault".into())
}

/// Cases of `cases.txt`: of the good file or the good arm what is replaced (`-`) by what (`+`), or what is added (`+` alone), and the faults.
#[test]
fn every_fault_has_its_place_and_what_is_allowed() {
    for case in include_str!("robot_faults/cases.txt").split("\n\n") {
        let line = |mark: char| {
            let line = case.lines().find_map(|line| line.strip_prefix(mark));
            line.map(|text| text.trim_start().replace("\\n", "\n"))
        };
        let put = line('+').unwrap_or_default();
        let found = match line('-') {
            None => added(&put),
            Some(taken) if GOOD.contains(&taken) => changed(&taken, &put),
            Some(taken) => arm(&taken, &put),
        };
        let faults = case
            .lines()
            .filter(|line| !line.starts_with(['-', '+', '#']));
        assert_eq!(
            found.lines().collect::<Vec<_>>(),
            faults.collect::<Vec<_>>(),
            "{case}"
        );
    }
}

#[test]
fn the_good_file_is_good() {
    assert_eq!(calib(GOOD), "no fault");
}

#[test]
fn all_faults_come_at_once() {
    let text = "calib_robot: 2
units: {length: mm, angle: grad}
kinematics: {screws: [{axis: [0, 0, 1], point: [0, x, 0]}]}
tool: {point: [1, 2]}
joints: [{limits: [10, -10], reduction_ratio: 0}]
links: [{mass: -3, centre: [0, 0, 0], frame: link}]
gravity: [0, 0, -9810]
";
    assert_eq!(
        calib(text),
        "robot.yaml:1:14: calib_robot: format 2 is not known to this calib; expected 1\n\
         robot.yaml:2:28: units.angle: unknown value `grad` (allowed: rad, deg, mrad, arcsec)\n\
         robot.yaml:3:52: kinematics.screws[0].point[1]: expected a finite number, found the text `x`\n\
         robot.yaml:4:15: tool.point: expected a list of 3 numbers, found a list of 2\n\
         robot.yaml:5:19: joints[0].limits: expected [lower, upper] with lower < upper, found [10, -10]\n\
         robot.yaml:5:47: joints[0].reduction_ratio: expected a number other than 0\n\
         robot.yaml:6:46: links[0].frame: screws know no link frames; expected `base`\n\
         robot.yaml:6:16: links[0].mass: expected a mass in kg, not less than 0, found -3\n\
         robot.yaml:7:10: gravity: is 9810 m/s2 long; expected about 9.81 m/s2, or [0, 0, 0] for none"
    );
}

#[test]
fn units_are_stated_and_known() {
    assert_eq!(
        calib(&format!(
            "{}joints: [{{limits: [-185, 185]}}, ]\n",
            GOOD.replace("deg", "rad")
        )),
        "robot.yaml:8:9: joints: 1 entries for 2 joints; expected one per joint\n\
         robot.yaml:8:19: joints[0].limits: -185 rad is more than 63 rad, ten turns; is it in another unit?"
    );
}

#[test]
fn a_file_describes_one_arm_once() {
    assert_eq!(
        calib("calib_robot: 1\nunits: {length: mm, angle: deg}\nkinematics: {}\n"),
        "robot.yaml:3:13: kinematics: no description of the arm; expected one of screws, dh, mdh, urdf"
    );
    assert_eq!(
        calib("calib_robot: 1\nunits: {length: mm, angle: deg}\nkinematics: {dh: []}\n"),
        "robot.yaml:3:13: kinematics: no joints; expected at least one"
    );
    let urdf = calib(
        "calib_robot: 1\nunits: {length: mm, angle: deg}\nkinematics: {urdf: {base: a, tip: b}}\n",
    );
    starts_with(
        &urdf,
        "robot.yaml:3:20: kinematics.urdf: the URDF itself is missing; name it in the pipeline",
    );
}

#[test]
fn a_key_twice_and_broken_yaml_show_the_line() {
    let twice = added("tool: {point: [0, 0, 0]}");
    starts_with(&twice, "robot.yaml:8:1: key `tool` is given twice");
    let broken = changed("tool: {point: [900, 0, 0]}", "tool: {point: [900, 0, 0]");
    starts_with(&broken, "robot.yaml:7:7: unclosed bracket");
    for text in ["", "just text", "[1, 2]", "# nothing\n"] {
        assert!(
            calib(text).contains("expected a map with the keys calib_robot, name"),
            "{}",
            calib(text)
        );
    }
}

const ARM: &str = r#"<robot name="a">
<link name="base_link"/><link name="upper"/><link name="tool0"/>
<joint name="j1" type="revolute"><parent link="base_link"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="j2" type="fixed"><parent link="upper"/><child link="tool0"/><origin xyz="1 0 0"/></joint>
</robot>"#;

/// The faults of the good arm with one text replaced by another.
fn arm(from: &str, to: &str) -> String {
    assert!(ARM.contains(from), "{from}");
    urdf(&ARM.replace(from, to), "base_link", "tool0")
}

#[test]
fn a_urdf_fault_names_its_line() {
    assert_eq!(urdf(ARM, "base_link", "tool0"), "no fault");
    assert_eq!(
        urdf(ARM, "base_link", "tool"),
        "arm.urdf:1: no link `tool`; did you mean `tool0`? (links: base_link, tool0, upper)"
    );
    assert_eq!(
        urdf(ARM, "upper", "base_link"),
        "arm.urdf:1: no chain from `upper` to `base_link`: the way up from `base_link` ends at `base_link`; up from `upper` the joint `j1` \
         moves, and a base hangs on the chain by fixed joints alone"
    );
    assert_eq!(
        urdf("<sdf/>", "a", "b"),
        "arm.urdf:1: expected a URDF, whose root is <robot>, found <sdf>"
    );
    starts_with(&urdf("<robot", "a", "b"), "arm.urdf: not readable as XML: ");
    let circle = ARM.replace("child link=\"tool0\"", "child link=\"base_link\"");
    assert_eq!(
        urdf(&circle, "tool0", "upper"),
        "arm.urdf:1: the joints from `upper` run in a circle; expected a tree"
    );
    let space = "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" ";
    assert_eq!(arm("<robot ", space), "no fault");
}

fn case(text: &str) -> String {
    read_case(RobotFileText::new("robot.json", text))
        .map_or_else(|e| e.to_string(), |_| "no fault".into())
}

#[test]
fn a_practice_robot_is_checked_too() {
    assert_eq!(
        case(
            r#"{"axes": [[0, 0, 1], [0, 0, 0]], "points": [[0, 0, 0]], "mass": [1, -2], "coupling": [[2, 0]]}"#
        ),
        "robot.json:1:44: points: 1 entries for 2 joints; expected one per joint\n\
         robot.json:1:22: axes[1]: has no direction: its length is zero\n\
         robot.json:1:69: mass[1]: expected a mass in kg, not less than 0, found -2\n\
         robot.json:1:1: tool: missing; expected a list of 3 numbers\n\
         robot.json:1:87: coupling[0]: expected two different joints (moved, by) counted from 0, below 2"
    );
    let not_a_number = case("{\"axes\": [[0, 0, NaN]]}");
    has(
        &not_a_number,
        "robot.json:1:18: axes[0][2]: expected a finite number, found the text `NaN`",
    );
    let twice = case("{\"tool\": 1, \"tool\": 2}");
    starts_with(
        &twice,
        "robot.json:1:13: key `tool` is given twice in this block\n",
    );
    assert_eq!(case("{\"axes\": 1"), "robot.json:1:1: unclosed bracket '{'");
    for text in ["[]", ""] {
        assert!(
            case(text).starts_with("robot.json:1:1: expected a map with the keys name, axes"),
            "{}",
            case(text)
        );
    }
}

#[test]
fn a_number_that_no_robot_has_is_refused_at_its_place() {
    let table = "calib_robot: 1\nunits: {length: m, angle: rad}\nkinematics:\n  dh:\n    - {theta: 1e3, d: 1e308, a: 0, alpha: 0}\n";
    assert_eq!(
        calib(table),
        "robot.yaml:5:15: kinematics.dh[0].theta: 1000 rad is more than 63 rad, ten turns; is it in another unit?\n\
         robot.yaml:5:23: kinematics.dh[0].d: 1e308 m is more than 1e9 m; is it in another unit?"
    );
    assert_eq!(
        case(
            r#"{"axes": [[0, 0, 1]], "points": [[0, 0, 1e308]], "tool": [0, 0, 0], "mass": [1e9]}"#
        ),
        "robot.json:1:41: points[0][2]: 1e305 m is more than 1000 m; is it in another unit?\n\
         robot.json:1:78: mass[0]: 1e9 kg is more than 1e6 kg; is it in another unit?"
    );
}

#[test]
fn a_direction_may_have_any_length() {
    for axis in ["[0, 0, 1e308]", "[1e308, 0, 1e308]", "[0, 3e-5, 0]"] {
        assert_eq!(
            changed("axis: [0, 0, 1]", &format!("axis: {axis}")),
            "no fault"
        );
    }
}

#[test]
fn a_urdf_with_numbers_that_no_robot_has_names_the_lines() {
    let arm = |origin: &str, axis: &str, [lower, upper]: [i32; 2]| {
        let text = format!(
            "<robot name=\"r\">\n<link name=\"a\"/><link name=\"b\"><inertial>\n<mass value=\"1\"/></inertial></link>\n\
             <joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>\n<origin xyz=\"{origin}\"/>\n\
             <axis xyz=\"{axis}\"/>\n<limit lower=\"{lower}\" upper=\"{upper}\"/></joint></robot>"
        );
        urdf(&text, "a", "b")
    };
    assert_eq!(arm("0 0 1", "1e308 0 1e308", [-3, 3]), "no fault");
    assert_eq!(
        arm("1e308 0 1e308", "0 0 1", [-180, 180]),
        "arm.urdf:5: <origin xyz>: 1e308 m is more than 1000 m; is it in another unit?"
    );
    assert_eq!(
        arm("0 0 1", "0 0 1", [-180, 3]),
        "arm.urdf:7: <limit lower>: -180 rad is more than 63 rad, ten turns; is it in another unit?"
    );
}
