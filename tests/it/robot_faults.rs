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
    match read_calib(
        RobotFileText {
            label: "robot.yaml",
            text,
        },
        None,
    ) {
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
    let urdf = RobotFileText {
        label: "arm.urdf",
        text,
    };
    read_calib(
        RobotFileText {
            label: "robot.yaml",
            text: &file,
        },
        Some(urdf),
    )
    .map_or_else(|e| e.to_string(), |_| "no fault".into())
}

#[test]
fn the_good_file_is_good() {
    assert_eq!(calib(GOOD), "no fault");
}

#[test]
fn an_unknown_key_names_the_nearest() {
    assert_eq!(
        changed("tool: {point", "tool: {pont"),
        "robot.yaml:7:8: tool.pont: unknown key; did you mean `point`? Allowed: point, orientation\n\
         robot.yaml:7:7: tool.point: missing; expected a list of 3 numbers"
    );
    assert_eq!(
        added("payloda: {mass: 3}"),
        "robot.yaml:8:1: payloda: unknown key; did you mean `payload`? Allowed: calib_robot, name, about, units, kinematics, tool, joints, \
         couplings, links, payload, mass_tolerance, gravity"
    );
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
fn an_axis_has_a_direction() {
    assert_eq!(
        changed("axis: [0, 1, 0]", "axis: [0, 0, 0]"),
        "robot.yaml:6:14: kinematics.screws[1].axis: has no direction: its length is zero"
    );
    assert_eq!(
        changed(
            "axis: [0, 1, 0], point: [300, 0, 0]",
            "twist: [0, 0, 0, 0, 0, 0]"
        ),
        "robot.yaml:6:15: kinematics.screws[1].twist: is no screw: all six numbers are zero"
    );
    assert_eq!(
        changed(
            "axis: [0, 1, 0], point: [300, 0, 0]",
            "twist: [0, 5, 0, 0, 1, 0]"
        ),
        "robot.yaml:6:15: kinematics.screws[1].twist: moves 5 along its axis per rad; expected a pure rotation, v perpendicular to w, or w = 0"
    );
}

#[test]
fn numbers_are_finite() {
    assert_eq!(
        changed("point: [900, 0, 0]", "point: [900, .nan, .inf]"),
        "robot.yaml:7:21: tool.point[1]: expected a finite number, found `.nan`\n\
         robot.yaml:7:27: tool.point[2]: expected a finite number, found `.inf`"
    );
    assert_eq!(
        changed("point: [900, 0, 0]", "point: [900, '12,5', 0]"),
        "robot.yaml:7:21: tool.point[1]: expected a finite number, found the text `12,5`"
    );
}

#[test]
fn units_are_stated_and_known() {
    assert_eq!(
        changed("length: mm", "length: cm"),
        "robot.yaml:2:17: units.length: unknown value `cm` (allowed: mm, um, m, in)"
    );
    assert_eq!(
        changed("units: {length: mm, angle: deg}\n", ""),
        "robot.yaml:1:1: units: missing; expected a map with the keys length, angle"
    );
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
fn lists_have_one_entry_per_joint() {
    let message = added("links: [{mass: 1, centre: [0, 0, 0]}, null, null]");
    assert_eq!(
        message,
        "robot.yaml:8:8: links: 3 entries for 2 joints; expected one per joint"
    );
    let message = added("couplings: [{moved: 3, by: 1}, {moved: 1, by: 1}, {moved: 2, by: 0.5}]");
    assert_eq!(
        message,
        "robot.yaml:8:21: couplings[0].moved: there is no joint 3; expected a number from 1 to 2\n\
         robot.yaml:8:32: couplings[1]: a joint cannot move itself; expected two different joints\n\
         robot.yaml:8:66: couplings[2].by: there is no joint 0.5; expected a number from 1 to 2"
    );
}

#[test]
fn a_file_describes_one_arm_once() {
    assert_eq!(
        changed(
            "kinematics:\n",
            "kinematics:\n  dh: [{d: 1, a: 0, alpha: 0}]\n"
        ),
        "robot.yaml:4:3: kinematics: more than one description of the arm; expected one of screws, dh, mdh, urdf"
    );
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

#[test]
fn a_urdf_fault_names_its_line() {
    assert_eq!(urdf(ARM, "base_link", "tool0"), "no fault");
    assert_eq!(
        urdf(ARM, "base_link", "tool"),
        "arm.urdf:1: no link `tool`; did you mean `tool0`? (links: base_link, tool0, upper)"
    );
    assert_eq!(
        urdf(
            &ARM.replace("child link=\"upper\"", "child link=\"uper\""),
            "base_link",
            "tool0"
        ),
        "arm.urdf:3: joint `j1` refers to link `uper`, which does not exist; did you mean `upper`?"
    );
    assert_eq!(
        urdf(ARM, "upper", "base_link"),
        "arm.urdf:1: no chain from `upper` to `base_link`: the way up from `base_link` ends at `base_link`"
    );
    assert_eq!(
        urdf(&ARM.replace("0 0 1", "0 0 0"), "base_link", "tool0"),
        "arm.urdf:3: joint `j1`: the axis has no direction, its length is zero"
    );
    assert_eq!(
        urdf(&ARM.replace("0 0 1", "0 0 one"), "base_link", "tool0"),
        "arm.urdf:3: <axis xyz>: expected 3 finite numbers, found `0 0 one`"
    );
    assert_eq!(
        urdf(&ARM.replace("revolute", "floating"), "base_link", "tool0"),
        "arm.urdf:3: joint `j1` has the type `floating` (allowed: revolute, continuous, prismatic, fixed)"
    );
    assert_eq!(
        urdf(
            &ARM.replace("<axis xyz=\"0 0 1\"/>", "\n<mimic joint=\"j2\"/>"),
            "base_link",
            "tool0"
        ),
        "arm.urdf:4: joint `j1` mimics another joint; expected a serial chain of independent joints"
    );
    assert_eq!(
        urdf(&ARM.replace("revolute", "fixed"), "base_link", "tool0"),
        "robot.yaml:3:13: kinematics: no joints; expected at least one"
    );
    assert_eq!(
        urdf("<sdf/>", "a", "b"),
        "arm.urdf:1: expected a URDF, whose root is <robot>, found <sdf>"
    );
    assert!(urdf("<robot", "a", "b").starts_with("arm.urdf: not readable as XML: "));
    let circle = ARM.replace("child link=\"tool0\"", "child link=\"base_link\"");
    assert_eq!(
        urdf(&circle, "tool0", "upper"),
        "arm.urdf:1: the joints from `upper` run in a circle; expected a tree"
    );
    assert!(
        urdf(
            &ARM.replace(
                "<robot ",
                "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" "
            ),
            "base_link",
            "tool0"
        )
        .contains("no fault")
    );
}

#[test]
fn a_name_stands_for_one_joint() {
    assert_eq!(
        added("joints: [{name: A1}, {name: A1}]"),
        "robot.yaml:8:29: joints[1].name: joint 1 is called `A1` too; expected a name of its own"
    );
    // The first joint's name is the one that the second has for want of another.
    assert_eq!(
        added("joints: [{name: J2}, null]"),
        "robot.yaml:8:17: joints[0].name: joint 2 is called `J2` too; expected a name of its own"
    );
    let two = ARM.replace("\"j2\" type=\"fixed\"", "\"j1\" type=\"revolute\"");
    assert_eq!(
        urdf(&two, "base_link", "tool0"),
        "arm.urdf:4: joint `j1` is there twice"
    );
}

#[test]
fn a_practice_robot_is_checked_too() {
    let case = |text: &str| {
        read_case(RobotFileText {
            label: "robot.json",
            text,
        })
        .map_or_else(|e| e.to_string(), |_| "no fault".into())
    };
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
    assert_eq!(
        changed("point: [300, 0, 0]", "point: [300, 1e308, 0]"),
        "robot.yaml:6:38: kinematics.screws[1].point[1]: 1e305 m is more than 1000 m; is it in another unit?"
    );
    assert_eq!(
        changed(
            "tool: {point: [900, 0, 0]",
            "tool: {point: [900, 0, -2000001], orientation: {rpy: [0, 0, 9e307]}"
        ),
        "robot.yaml:7:24: tool.point[2]: -2000.001 m is more than 1000 m; is it in another unit?\n\
         robot.yaml:7:61: tool.orientation.rpy[2]: 1.5707963267948965e306 rad is more than 63 rad, ten turns; is it in another unit?"
    );
    assert_eq!(
        added(
            "joints:\n  - {name: A, reduction_ratio: 1e308}\n  - {name: B, motor_constant: -1e7}"
        ),
        "robot.yaml:9:32: joints[0].reduction_ratio: 1e308 is more than 1e6\nrobot.yaml:10:31: joints[1].motor_constant: -1e7 is more than 1e6"
    );
    assert_eq!(
        added("payload: {mass: 1e300, offset: [0, 0, 1e300]}"),
        "robot.yaml:8:39: payload.offset[2]: 1e297 m is more than 1000 m; is it in another unit?\n\
         robot.yaml:8:17: payload.mass: 1e300 kg is more than 1e6 kg; is it in another unit?"
    );
    let table = "calib_robot: 1\nunits: {length: m, angle: rad}\nkinematics:\n  dh:\n    - {theta: 1e3, d: 1e308, a: 0, alpha: 0}\n";
    assert_eq!(
        calib(table),
        "robot.yaml:5:15: kinematics.dh[0].theta: 1000 rad is more than 63 rad, ten turns; is it in another unit?\n\
         robot.yaml:5:23: kinematics.dh[0].d: 1e308 m is more than 1e9 m; is it in another unit?"
    );
    let case =
        r#"{"axes": [[0, 0, 1]], "points": [[0, 0, 1e308]], "tool": [0, 0, 0], "mass": [1e9]}"#;
    let printed = read_case(RobotFileText {
        label: "robot.json",
        text: case,
    })
    .unwrap_err()
    .to_string();
    assert_eq!(
        printed.lines().collect::<Vec<_>>(),
        [
            "robot.json:1:41: points[0][2]: 1e305 m is more than 1000 m; is it in another unit?",
            "robot.json:1:78: mass[0]: 1e9 kg is more than 1e6 kg; is it in another unit?"
        ]
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
    assert_eq!(
        changed(
            "{axis: [0, 1, 0], point: [300, 0, 0]}",
            "{twist: [1e6, 0, 0, 0, 1e-3, 0]}"
        ),
        "robot.yaml:6:15: kinematics.screws[1].twist: its axis is away from the base: -1e6 m is more than 1000 m; is it in another unit?"
    );
}

#[test]
fn a_urdf_with_numbers_that_no_robot_has_names_the_lines() {
    let arm = |origin: &str, axis: &str, limit: &str| {
        format!(
            "<robot name=\"r\">\n<link name=\"a\"/><link name=\"b\"><inertial>\n<mass value=\"1\"/></inertial></link>\n\
             <joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>\n<origin xyz=\"{origin}\"/>\n\
             <axis xyz=\"{axis}\"/>\n<limit {limit}/></joint></robot>"
        )
    };
    assert_eq!(
        urdf(
            &arm("0 0 1", "1e308 0 1e308", "lower=\"-3\" upper=\"3\""),
            "a",
            "b"
        ),
        "no fault"
    );
    assert_eq!(
        urdf(
            &arm("1e308 0 1e308", "0 0 1", "lower=\"-180\" upper=\"180\""),
            "a",
            "b"
        ),
        "arm.urdf:5: <origin xyz>: 1e308 m is more than 1000 m; is it in another unit?"
    );
    assert_eq!(
        urdf(
            &arm("0 0 1", "0 0 1", "lower=\"-180\" upper=\"3\""),
            "a",
            "b"
        ),
        "arm.urdf:7: <limit lower>: -180 rad is more than 63 rad, ten turns; is it in another unit?"
    );
}
