//! Exports: what is written is read back by calib itself and is the same arm; programs change in the numbers of targets alone.

use crate::answer::{calib, has, put, read};
use crate::compensate::{PIPELINE, cell};
use calib::robot::RobotModel;
use calib::robot::import::{RobotFileText, read_calib};
use serde_json::Value;

fn exported(format: &str) -> String {
    let output = calib(cell(), &format!("export latest --format {format} --force"));
    let printed = output.err.clone();
    assert!(output.code == Some(0), "{printed}");
    // Ratios are in the list of numbers, links are not.
    let left_out = match format {
        "controller" => "not carried: link_geometry at link 2",
        _ => "not carried: reduction_ratio at joint 3",
    };
    has(&printed, left_out);
    output.out
}

/// Joint positions here and there.
fn postures(count: usize) -> impl Iterator<Item = Vec<f64>> {
    let joint = |k: usize, j: usize| (1.3 * k as f64 + 0.7 * j as f64).sin();
    (0..count).map(move |k| (0..6).map(|j| joint(k, j)).collect())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Numbers with blanks between them.
fn split(text: &str) -> Vec<f64> {
    let words = text.split(' ');
    words.map(|number| number.parse().unwrap()).collect()
}

/// The tool at a joint position by the exported JSON: product of exponentials written out here.
fn by_json(model: &Value, q: &[f64]) -> [f64; 3] {
    let three = |value: &Value| -> [f64; 3] { [0, 1, 2].map(|k| value[k].as_f64().unwrap()) };
    let mut point = three(&model["tool"]["point_m"]);
    for (joint, angle) in model["joints"].as_array().unwrap().iter().zip(q).rev() {
        let (axis, on) = (three(&joint["axis"]), three(&joint["point_m"]));
        let p = [0, 1, 2].map(|k| point[k] - on[k]);
        let cross = [
            axis[1] * p[2] - axis[2] * p[1],
            axis[2] * p[0] - axis[0] * p[2],
            axis[0] * p[1] - axis[1] * p[0],
        ];
        let along: f64 = (0..3).map(|k| axis[k] * p[k]).sum();
        point = [0, 1, 2].map(|k| {
            on[k]
                + p[k] * angle.cos()
                + cross[k] * angle.sin()
                + axis[k] * along * (1.0 - angle.cos())
        });
    }
    point
}

#[test]
fn tables_and_urdf_are_the_arm_that_was_identified() {
    let model: Value = serde_json::from_str(&exported("json")).unwrap();
    let urdf = exported("urdf");
    let urdf_units = "calib_robot: 1\nname: u\nunits: {length: mm, angle: deg}\nkinematics:\n  urdf: {base: base_link, tip: tool0}\n";
    let label = |text| RobotFileText {
        label: "robot.yaml",
        text,
    };
    let robots = [
        read_calib(
            label(urdf_units),
            Some(RobotFileText {
                label: "arm.urdf",
                text: &urdf,
            }),
        )
        .unwrap(),
        read_calib(label(&exported("dh")), None).unwrap(),
        read_calib(label(&exported("mdh")), None).unwrap(),
    ];
    for robot in robots.map(|imported| RobotModel::new(imported.robot)) {
        for q in postures(50) {
            let apart = distance(robot.forward(&q).translation.into(), by_json(&model, &q));
            assert!(apart < 1e-9, "{apart} m");
        }
    }
}

#[test]
fn an_sdf_is_the_arm_that_was_identified_and_states_no_limit_that_is_not_known() {
    let model: Value = serde_json::from_str(&exported("json")).unwrap();
    let text = exported("sdf");
    let document = roxmltree::Document::parse(&text).unwrap();
    let child = |node: roxmltree::Node<'_, '_>, name: &str| -> Vec<f64> {
        let mut inner = node.descendants();
        let found = inner.find(|child| child.has_tag_name(name));
        split(found.unwrap_or_else(|| panic!("no {name}")).text().unwrap())
    };
    let moving = |node: &roxmltree::Node| {
        node.has_tag_name("joint") && node.attribute("type") != Some("fixed")
    };
    let joints: Vec<roxmltree::Node> = document.descendants().filter(moving).collect();
    let mut point = [0.0; 3];
    for (joint, answer) in joints.iter().zip(model["joints"].as_array().unwrap()) {
        point = [0, 1, 2].map(|k| point[k] + child(*joint, "pose")[k]);
        for k in 0..3 {
            assert!((point[k] - answer["point_m"][k].as_f64().unwrap()).abs() < 1e-12);
            assert_eq!(child(*joint, "xyz")[k], answer["axis"][k].as_f64().unwrap());
        }
    }
    let tool = document
        .descendants()
        .find(|node| node.has_tag_name("frame"))
        .unwrap();
    for k in 0..3 {
        assert!(
            (point[k] + child(tool, "pose")[k] - model["tool"]["point_m"][k].as_f64().unwrap())
                .abs()
                < 1e-12
        );
    }
    assert_eq!(joints.len(), 6);
    assert!(!text.contains("effort") && !exported("urdf").contains("effort=\"0\""));
}

#[test]
fn a_file_says_whose_it_is_and_whether_it_was_edited() {
    let here = tempfile::tempdir().unwrap();
    let held = |name: &str, text: &str| {
        let path = here.path().join(name);
        std::fs::write(&path, text).unwrap();
        let output = calib(
            cell(),
            &[
                "check-export",
                path.to_str().unwrap(),
                "--against",
                "latest",
            ],
        );
        (output.code, output.both())
    };
    // All formats, as the program lists them, and those that this arm cannot have.
    let listed = calib(cell(), "export latest --format none").err;
    let (_, listed) = listed.split_once("[possible values: ").unwrap();
    let formats = listed.split_once(']').unwrap().0.split(", ");
    let of_others = [
        "xacro",
        "ur_kinematics",
        "dynamics",
        "isaac",
        "mjcf_control",
    ];
    assert_eq!(
        formats
            .clone()
            .filter(|format| of_others.contains(format))
            .count(),
        of_others.len()
    );
    for format in formats.filter(|format| !of_others.contains(format)) {
        let text = exported(format);
        let (code, printed) = held(format, &text);
        assert!(
            code == Some(0) && printed.contains(": is the export of run"),
            "{format}: {printed}"
        );
        // One digit of one number.
        let at = text.rfind("0.").unwrap() + 2;
        let digit = if text.as_bytes()[at] == b'7' {
            "8"
        } else {
            "7"
        };
        let edited = format!("{}{digit}{}", &text[..at], &text[at + 1..]);
        let (code, printed) = held(format, &edited);
        let line = text[..at].lines().count();
        assert!(
            code == Some(1) && printed.contains(&format!("line {line} is not as run")),
            "{format}: {printed}"
        );
    }
    let text = exported("urdf");
    let (start, _) = text.split_once(", model ").unwrap();
    let other = format!(
        "{start}, model 0123456789abcdef{}",
        &text[start.len() + 8 + 16..]
    );
    let (code, printed) = held("other", &other);
    assert!(
        code == Some(1) && printed.contains("is of the model 0123456789abcdef; that of run"),
        "{printed}"
    );
    let (code, printed) = held(
        "other",
        &text.replace("robot serial not stated", "robot serial 77"),
    );
    assert!(
        code == Some(1) && printed.contains("is of the robot with serial 77; that of run"),
        "{printed}"
    );
    let (code, printed) = held("none", "<robot/>");
    assert!(
        code == Some(10) && printed.contains("carries no mark of calib"),
        "{printed}"
    );
}

/// A folder with an arm of the library that was identified.
fn of_the_library(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let robot = calib::robot::LibraryArm::find(name)
        .unwrap()
        .text
        .replace("point: [0, 0, 0]", "point: [40, 30, 120]");
    put(folder.path(), "robot.yaml", robot);
    let pipeline = PIPELINE.replace(
        "[0.4, 0.2, -0.3]",
        "[0.4, 0.2, -0.3], tilt_arcsec: [40, 20, 60]",
    );
    put(folder.path(), "pipeline.yaml", pipeline);
    calib(folder.path(), "run pipeline.yaml --quiet").code(0);
    folder
}

#[test]
fn a_drivers_kinematics_are_those_of_the_arm_near_the_frames_of_its_meshes() {
    let folder = of_the_library("ur10e");
    let export = |format: &str| {
        let output = calib(folder.path(), &format!("export latest --format {format}")).code(0);
        output.out
    };
    let model: Value = serde_json::from_str(&export("json")).unwrap();
    let text = export("ur_kinematics");
    let tool = text.split_once("in tool0 it stands at ").unwrap().1;
    let tool = tool.split(' ').take(3).collect::<Vec<_>>().join(" ");
    let tool = split(&tool);
    let value = |line: &str| {
        line.trim()
            .split_once(": ")
            .and_then(|(_, number)| number.parse::<f64>().ok())
    };
    let numbers: Vec<f64> = text
        .lines()
        .filter(|line| line.starts_with("    "))
        .filter_map(value)
        .collect();
    // The file that the maker ships for this arm, config/ur10e/default_kinematics.yaml.
    let half = std::f64::consts::FRAC_PI_2;
    let shipped = [
        [0.0, 0.0, 0.1807, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, half, 0.0, 0.0],
        [-0.6127, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-0.57155, 0.0, 0.17415, 0.0, 0.0, 0.0],
        [0.0, -0.11985, 0.0, half, 0.0, 0.0],
        [0.0, 0.11655, 0.0, -half, 0.0, 0.0],
    ];
    assert_eq!(numbers.len(), 36);
    for (number, shipped) in numbers.iter().zip(shipped.as_flattened()) {
        assert!((number - shipped).abs() < 3e-3, "{number} {shipped}");
    }
    for q in postures(50) {
        let mut point: [f64; 3] = [tool[0], tool[1], tool[2]];
        for (origin, angle) in numbers.chunks(6).zip(&q).rev() {
            let turned_by = |axis, angle| about(axis, angle);
            let rpy = product(
                turned_by([0.0, 0.0, 1.0], origin[5]),
                product(
                    turned_by([0.0, 1.0, 0.0], origin[4]),
                    turned_by([1.0, 0.0, 0.0], origin[3]),
                ),
            );
            let moved = turned(rpy, turned(about([0.0, 0.0, 1.0], *angle), point));
            point = [0, 1, 2].map(|axis| moved[axis] + origin[axis]);
        }
        let wanted = by_json(&model, &q);
        assert!(
            (0..3).all(|axis| (point[axis] - wanted[axis]).abs() < 1e-12),
            "{point:?} {wanted:?}"
        );
    }
    let other = calib(cell(), "export latest --format ur_kinematics");
    assert!(other.code == Some(10) && other.err.contains("is no arm of Universal Robots"));
}

type Turn = [[f64; 3]; 3];

/// The product of two rotations, row-major.
fn product(a: Turn, b: Turn) -> Turn {
    [0, 1, 2].map(|i| [0, 1, 2].map(|k| (0..3).map(|j| a[i][j] * b[j][k]).sum()))
}

fn turned(turn: Turn, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|k| turn[i][k] * p[k]).sum())
}

/// About a unit axis, by Rodrigues.
fn about([x, y, z]: [f64; 3], angle: f64) -> Turn {
    let (sin, cos) = angle.sin_cos();
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let square = product(cross, cross);
    let unit = |i, k| if i == k { 1.0 } else { 0.0 };
    [0, 1, 2]
        .map(|i| [0, 1, 2].map(|k| unit(i, k) + sin * cross[i][k] + (1.0 - cos) * square[i][k]))
}

fn numbers<const N: usize>(element: roxmltree::Node, name: &str) -> [f64; N] {
    let text = element
        .attribute(name)
        .unwrap_or_else(|| panic!("no {name}"));
    split(text).try_into().unwrap()
}

/// Place and orientation of the site `tool0`, from body to body as MuJoCo's documentation has them.
fn by_mjcf(text: &str, q: &[f64]) -> ([f64; 3], Turn) {
    let document = roxmltree::Document::parse(text).unwrap();
    let child = |node: roxmltree::Node<'_, '_>, name: &str| {
        node.children()
            .find(|child| child.has_tag_name(name))
            .map(|child| child.id())
    };
    let mut body = document
        .root_element()
        .children()
        .find(|node| node.has_tag_name("worldbody"))
        .unwrap();
    let (mut place, mut turn, mut joints) = ([0.0; 3], about([0.0, 0.0, 1.0], 0.0), q.iter());
    while let Some(next) = child(body, "body") {
        body = document.get_node(next).unwrap();
        if body.has_attribute("pos") {
            let step = turned(turn, numbers(body, "pos"));
            place = [0, 1, 2].map(|k| place[k] + step[k]);
        }
        if let Some(joint) = child(body, "joint") {
            let joint = document.get_node(joint).unwrap();
            assert_eq!(
                (joint.attribute("type"), numbers(joint, "pos")),
                (Some("hinge"), [0.0; 3])
            );
            turn = product(turn, about(numbers(joint, "axis"), *joints.next().unwrap()));
        }
    }
    assert_eq!(joints.next(), None, "a joint for every angle");
    let site = document.get_node(child(body, "site").unwrap()).unwrap();
    let [w, x, y, z] = numbers(site, "quat");
    let ours = [
        [
            w * w + x * x - y * y - z * z,
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            w * w - x * x + y * y - z * z,
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            w * w - x * x - y * y + z * z,
        ],
    ];
    let step = turned(turn, numbers(site, "pos"));
    ([0, 1, 2].map(|k| place[k] + step[k]), product(turn, ours))
}

#[test]
fn a_mujoco_model_is_the_arm_that_was_identified_with_its_limits_and_known_masses() {
    let heavy = crate::compensate::ROBOT.to_string()
        + "links:\n  - {mass: 90, centre: [10, 0, 200]}\n  - {mass: 60, centre: [0, 20, 650]}\n  - null\n  - null\n  - null\n  - null\n";
    // The cell's arm by another name, of which the table must be a model.
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    put(
        here,
        "heavy <1>.yaml",
        heavy.replace("name: small", "name: \"<a & b> ---\""),
    );
    let pipeline = read(cell().join("pipeline.yaml"));
    put(
        here,
        "pipeline.yaml",
        pipeline.replace("robot.yaml", "'heavy <1>.yaml'"),
    );
    let export = |format: &str| {
        let output = calib(here, &format!("export pipeline.yaml --format {format}")).code(0);
        output.out
    };
    let (text, model) = (export("mjcf"), export("json"));
    let model: Value = serde_json::from_str(&model).unwrap();
    for k in 0..20 {
        let q: Vec<f64> = (0..6)
            .map(|j| 2.0 * (1.7 * k as f64 + 0.9 * j as f64).sin())
            .collect();
        let apart = distance(by_mjcf(&text, &q).0, by_json(&model, &q));
        assert!(apart < 1e-9, "{apart} m");
    }
    let at_zero = by_mjcf(&text, &[0.0; 6]).1;
    for (i, row) in at_zero.iter().enumerate() {
        for (k, found) in row.iter().enumerate() {
            assert!((found - model["tool"]["rotation"][i][k].as_f64().unwrap()).abs() < 1e-12);
        }
    }
    let document = roxmltree::Document::parse(&text).unwrap();
    let all = |name: &'static str| {
        document
            .descendants()
            .filter(move |node| node.has_tag_name(name))
    };
    assert_eq!(
        document.root_element().attribute("model"),
        Some("<a & b> ---")
    );
    let masses: Vec<[f64; 1]> = all("inertial").map(|node| numbers(node, "mass")).collect();
    assert_eq!(masses, [[90.0], [60.0]]);
    let limits: [f64; 2] = numbers(all("joint").nth(1).unwrap(), "range");
    assert!(
        (limits[0].to_degrees() + 60.0).abs() < 1e-9
            && (limits[1].to_degrees() - 75.0).abs() < 1e-9,
        "{limits:?}"
    );
    let remarks: String = document
        .root()
        .children()
        .filter_map(|node| node.text())
        .collect();
    has(&remarks, "not carried: reduction_ratio at joint 3");
    has(&remarks, "bodies whose mass is not known have 0.001 kg");
}

/// A number of a sentence, behind `before`.
fn stated(text: &str, before: &str) -> f64 {
    let (_, tail) = text
        .split_once(before)
        .unwrap_or_else(|| panic!("{before}: {text}"));
    tail.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn a_list_for_the_controller_says_what_is_left_with_it_and_is_better_than_nothing() {
    let text = exported("controller");
    let left = stated(&text, "error that is left with this list: ");
    let nothing = stated(&text, "nothing entered: ");
    assert!(left < 0.7 * nothing, "{left} {nothing}");
    assert!(nothing > 0.2, "{nothing}");
    has(&text, "the list holds no base");
    let zero = |joint: usize| stated(&text.replace(',', " "), &format!("zero joint {joint} "));
    for (joint, truth) in [(2, -0.05), (3, 0.04), (4, 0.03), (5, -0.06)] {
        assert!(
            (zero(joint) - truth).abs() < 0.05,
            "{joint}: {}",
            zero(joint)
        );
    }
}

/// The arm of the cell as a URDF with links and limits of its author's, and `base` beside `base_link`.
const OWN: &str = r#"<robot name="own">
  <link name="world"/><link name="base_link"/><link name="base"/><link name="flange"/>
  <link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="f"/>
  <joint name="w" type="fixed"><parent link="world"/><child link="base_link"/></joint>
  <joint name="beside" type="fixed"><parent link="base_link"/><child link="base"/><origin xyz="0 0 0.4" rpy="0 0 3.141592653589793"/></joint>
  <joint name="A1" type="revolute"><parent link="base_link"/><child link="a"/><axis xyz="0 0 1"/><limit lower="-2.1" upper="2.1" effort="151" velocity="3.5"/></joint>
  <joint name="A2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-1.05" upper="1.3" effort="152" velocity="3"/></joint>
  <joint name="A3" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/><limit lower="-1.4" upper="1.3" effort="150" velocity="3"/></joint>
  <joint name="A4" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="150" velocity="3"/></joint>
  <joint name="A5" type="revolute"><parent link="d"/><child link="e"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-2.1" upper="2.1" effort="150" velocity="3"/></joint>
  <joint name="A6" type="revolute"><parent link="e"/><child link="f"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="150" velocity="3"/></joint>
  <joint name="fl" type="fixed"><parent link="f"/><child link="flange"/><origin xyz="0 0 0.1"/></joint>
</robot>"#;

/// A folder with that arm, identified from a base of its file.
fn own(base: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let robot = format!(
        "calib_robot: 1\nname: own\nunits: {{length: mm, angle: deg}}\nkinematics:\n  urdf: {{base: {base}, tip: flange}}\ntool: {{point: [-30, 40, 30]}}\n"
    );
    put(folder.path(), "robot.yaml", robot);
    put(folder.path(), "arm.urdf", OWN);
    let pipeline = PIPELINE
        .replace("{file: robot.yaml}", "{file: robot.yaml, urdf: arm.urdf}")
        .replace("floor_mm: 100", "floor_mm: -500");
    put(folder.path(), "pipeline.yaml", pipeline);
    calib(folder.path(), "run pipeline.yaml --quiet").code(0);
    folder
}

#[test]
fn a_urdf_keeps_the_links_and_limits_of_the_arms_own_and_its_flange_beside_the_measured_point() {
    let folder = own("base_link");
    let export = |format: &str| {
        calib(
            folder.path(),
            &format!("export latest --format {format} --force"),
        )
        .code(0)
        .out
    };
    let (urdf, model) = (export("urdf"), export("json"));
    let model: Value = serde_json::from_str(&model).unwrap();
    has(
        &urdf,
        [
            "<link name=\"c\"",
            "effort=\"151\" velocity=\"3.5\"",
            "<link name=\"flange\">",
            "<link name=\"measured_point\">",
            "where the base stands in the measured frame: at ",
            "beside the chain: world, base -->",
            "<mass value=\"0\"/>",
        ],
    );
    let units = "calib_robot: 1\nname: u\nunits: {length: mm, angle: deg}\nkinematics:\n  urdf: {base: base_link, tip: TIP}\n";
    let read = |tip: &str| {
        let text = units.replace("TIP", tip);
        let [robot, urdf] = [("robot.yaml", text.as_str()), ("arm.urdf", urdf.as_str())]
            .map(|(label, text)| RobotFileText { label, text });
        RobotModel::new(read_calib(robot, Some(urdf)).unwrap().robot)
    };
    let (point, flange) = (read("measured_point"), read("flange"));
    for q in postures(50) {
        let at: [f64; 3] = point.forward(&q).translation.into();
        assert!(distance(at, by_json(&model, &q)) < 1e-9);
    }
    let apart = (point.home().translation - flange.home().translation).norm();
    assert!((apart - 0.0583).abs() < 1e-3, "{apart}");
}

#[test]
fn poses_in_another_base_than_the_robot_files_are_refused_and_a_base_beside_the_chain_begins_it() {
    let program = "def job():\n  movel(p[-0.6, 0.1, 0.5, 0, 1.5, 0], a=0.5, v=0.2)\nend\n";
    let asked = |folder: &tempfile::TempDir, more: &str| {
        put(folder.path(), "job.script", program);
        calib(
            folder.path(),
            &format!("compensate latest job.script --quiet {more}"),
        )
    };
    let folder = own("base_link");
    let refused = asked(&folder, "").refused();
    has(
        &refused,
        [
            "job.script:2:",
            "the link `base` of arm.urdf",
            "0.0, 0.0, 400.0 mm",
            "base: base",
        ],
    );
    let robot = own("base");
    let output = asked(&robot, "");
    assert!(!output.err.contains("controller's base"), "{}", output.err);
    // The same place in both bases.
    let model = |folder: &tempfile::TempDir| -> Value {
        let text = calib(folder.path(), "export latest --format json --force")
            .code(0)
            .out;
        serde_json::from_str(&text).unwrap()
    };
    let tool = |model: &Value| [0, 1, 2].map(|k| model["tool"]["point_m"][k].as_f64().unwrap());
    let ([x, y, z], [a, b, c]) = (tool(&model(&folder)), tool(&model(&robot)));
    assert!(
        distance([-x, -y, z - 0.4], [a, b, c]) < 5e-3,
        "{x} {y} {z}, {a} {b} {c}"
    );
    // FANUC's world is at the height of axis 2.
    let pose = "/PROG  A\n/MN\n   1:L P[1] 250mm/sec FINE    ;\n/POS\nP[1]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX =   830.000  mm,\tY =    40.000  mm,\tZ =   730.000  mm,\n\tW =   0.000 deg,\tP =      .000 deg,\tR =   0.000 deg\n};\n/END\n";
    put(cell(), "world.ls", pose);
    let refused = calib(cell(), "compensate latest world.ls --quiet").refused();
    has(
        &refused,
        ["at the height of axis 2", "400.0 mm", "--assume-frames"],
    );
}

#[test]
fn a_program_whose_external_axes_move_is_refused() {
    let text = "DEF rail( )\nPTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0,E1 0}\nPTP {A1 12,A2 20,A3 -30,A4 5,A5 40,A6 0,E1 500}\nEND\n";
    put(cell(), "rail.src", text);
    let refused = calib(cell(), "compensate latest rail.src --quiet").refused();
    has(
        &refused,
        ["rail.src:3:", "the external axis E1 moves (0 to 500)"],
    );
    calib(cell(), "compensate latest rail.src --quiet --assume-frames").code(0);
    put(cell(), "rail.src", text.replace("E1 500", "E1 0"));
    calib(cell(), "compensate latest rail.src --quiet").code(0);
}

#[test]
fn points_of_a_data_list_are_corrected_with_the_program_that_moves_to_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let joints = "{A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0}";
    put(
        folder.path(),
        "pair.src",
        format!("DEF pair( )\nPTP {joints}\nPTP XP1\nEND\n"),
    );
    let list = format!("DEFDAT pair\nDECL AXIS XP1={joints}\nENDDAT\n");
    put(folder.path(), "pair.dat", &list);
    let refused = calib(cell(), &format!("compensate latest {}", at("pair.src")))
        .code(2)
        .err;
    has(&refused, ["moves to points of ", "pair.dat", "--out"]);
    let out = |name: &str| {
        calib(
            cell(),
            &format!("compensate latest {} --out {}", at("pair.src"), at(name)),
        )
    };
    has(&out("pair_.dat").code(2).err, "--out");
    let said = out("pair_c.src").code(0).err;
    has(&said, "to whose points the program moves, is corrected too");
    let corrected = read(folder.path().join("pair_c.dat"));
    has(&corrected, ["corrected by calib", "DECL AXIS XP1={A1 "]);
    assert!(!corrected.contains(joints), "{corrected}");
    assert_eq!(read(folder.path().join("pair.dat")), list);
}

const KRL: &str = "DEF weld( )\r\n; {A1 9, A2 not code\r\nDECL E6AXIS XHOME={A1 0.0,A2 -10.0,A3 20.0,A4 5,A5 30,A6 0.0,E1 0.0}\r\n PTP {A1 10,A2 20,A3 -30,A4 5,A5 40,A6 0} C_PTP\r\nLIN {E6POS: X 900.0,Y 40.0,Z 930.5,A 0.0,B 0.0,C 0.0,S 2,T 4,E1 0.0}\r\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\r\nEND\r\n";

const RAPID: &str = "MODULE m\n  ! [[1,2\n  CONST jointtarget home:=[[0,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n  CONST robtarget ps{2}:=[[[900.0,40,930],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[910,40,930],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];\n  PERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n  MoveAbsJ [[1,-10,20,5,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs, v1000, z50, t;\nENDMODULE\n";

fn program(name: &str, text: &str) -> (Option<i32>, String, String) {
    let path = cell().join(name);
    std::fs::write(&path, text).unwrap();
    let output = calib(
        cell(),
        &format!("compensate latest {name} --quiet --assume-frames"),
    );
    (output.code, output.out, output.err)
}

/// The text with every number taken out, where `keep` does not hold for its line.
fn without_numbers(text: &str, targets: &[usize]) -> Vec<String> {
    let strip = |line: &str| {
        line.chars()
            .filter(|c| !(c.is_ascii_digit() || *c == '.' || *c == '-'))
            .collect()
    };
    text.split('\n')
        .enumerate()
        .map(|(k, line)| {
            if targets.contains(&k) {
                strip(line)
            } else {
                line.to_string()
            }
        })
        .collect()
}

#[test]
fn programs_differ_in_the_numbers_of_targets_and_nothing_else() {
    for (name, text, targets) in [("weld.src", KRL, [2, 3, 4]), ("m.mod", RAPID, [2, 3, 5])] {
        let (code, corrected, printed) = program(name, text);
        assert_eq!(code, Some(0), "{printed}");
        assert_ne!(corrected, text);
        // The second line is the mark of what was corrected.
        let mark = corrected.split('\n').nth(1).unwrap();
        assert!(
            mark.starts_with("; corrected by calib") || mark.starts_with("! corrected by calib"),
            "{mark}"
        );
        let corrected = corrected.replacen(&format!("{mark}\n"), "", 1);
        assert_eq!(
            without_numbers(&corrected, &targets),
            without_numbers(text, &targets)
        );
        for k in targets {
            assert_ne!(
                corrected.split('\n').nth(k),
                text.split('\n').nth(k),
                "line {k} has a target"
            );
        }
    }
    let (_, corrected, printed) = program("weld.src", KRL);
    // The target stands at A1 0 and A6 0, and its correction takes both below: the turns say so, or they would go once round.
    has(&corrected, [",E1 0.0}", ",S 2,T 37,"]);
    has(
        &printed,
        "posture S 2, T 37 of the corrected joints, was S 2, T 4",
    );
}

#[test]
fn malformed_programs_are_refused_with_line_and_column() {
    let refused = |name: &str, text: &str, wanted: &[&str]| {
        let (code, out, printed) = program(name, text);
        assert_eq!((code, out.as_str()), (Some(10), ""));
        for part in wanted {
            has(&printed, part);
        }
    };
    let krl = "DEF x()\n PTP {A1 10,A2 foo,A3 -30,A4 5,A5 40,A6 0}\nPTP {A1 10,A2 3\nLIN {E6POS: X 1,Y 2}\n";
    refused(
        "bad.src",
        krl,
        &[
            "bad.src:2:16: A2 is `foo`",
            "bad.src:3:5: `{` without `}`",
            "bad.src:4:5: the target has no Z",
        ],
    );
    let rapid = "CONST jointtarget a:=[[1,2,3],[9E9,1,1,1,1,1]];\nCONST robtarget b:=[[1,2,x],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nCONST robtarget c:=[[1,2;\n";
    refused(
        "bad.mod",
        rapid,
        &[
            "bad.mod:1:23: 3 numbers, expected 6",
            "bad.mod:2:26: `x` is no number",
            "bad.mod:3:21: `[` without `]`",
        ],
    );
}
