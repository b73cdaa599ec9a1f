//! Robot files: every description of one arm is the same arm, and the same as another program's.

use crate::answer::{has, root};
use crate::desk::{Desk, shared};
use crate::fixture::robot_of;
use calib::description::{Coupling, JointKind, RobotDescription};
use calib::robot::RobotModel;
use calib::robot::import::{Imported, RobotFileText, read_calib, read_case};
use calib::stage::{RawFile, ReadRobot, RobotFormat, RobotReads, Stage};
use calib::table::{Robot, Table};
use nalgebra::{Matrix3, Vector3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;

// m: 1e-9 mm.
const EXACT: f64 = 1e-12;

const HEAD: &str = "calib_robot: 1\nunits: {length: mm, angle: deg}\n";

fn reference(file: &str) -> String {
    let path = root("tests/reference/kinematics").join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Arms of which there is a file of each kind, and poses and masses by Pinocchio.
const ARMS: [&str; 4] = ["ur10", "spherical", "seven", "track"];

fn read_urdf(name: &str) -> RobotDescription {
    let text = format!("{HEAD}kinematics: {{urdf: {{base: world_base, tip: tool0}}}}\n");
    let urdf = reference(&format!("{name}.urdf"));
    let urdf = RobotFileText::new("arm.urdf", &urdf);
    read_calib(RobotFileText::new("robot.yaml", &text), Some(urdf))
        .unwrap_or_else(|e| panic!("{name}: {e}"))
        .robot
}

fn all_forms(arm: &str) -> Vec<(&'static str, RobotDescription)> {
    let file = |form| robot_of(&reference(&format!("{arm}.{form}.yaml")));
    let forms = ["screws", "dh", "mdh"].map(|form| (form, file(form)));
    forms
        .into_iter()
        .chain([("urdf", read_urdf(arm))])
        .collect()
}

#[test]
fn every_description_of_an_arm_moves_alike() {
    let mut random = ChaCha8Rng::seed_from_u64(20200116);
    for arm in ARMS {
        let models: Vec<_> = all_forms(arm)
            .into_iter()
            .map(|(form, robot)| (form, RobotModel::new(robot)))
            .collect();
        let (_, first) = &models[0];
        for _ in 0..1000 {
            let q: Vec<f64> = (0..first.joints())
                .map(|j| {
                    if first.is_revolute(j) {
                        random.random_range(-3.1..3.1)
                    } else {
                        random.random_range(-3.0..3.0)
                    }
                })
                .collect();
            let expected = first.forward(&q);
            for (form, model) in &models[1..] {
                let found = model.forward(&q);
                let (away, turned) = (
                    (found.translation - expected.translation).norm(),
                    (found.rotation - expected.rotation).norm(),
                );
                assert!(away < EXACT, "{} as {form}: {away} m away at {q:?}", arm);
                assert!(
                    turned < EXACT,
                    "{} as {form}: turned by {turned} at {q:?}",
                    arm
                );
            }
        }
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// Numbers by Pinocchio: `tests/reference/kinematics.py`.
#[test]
fn forward_kinematics_and_link_masses_agree_with_pinocchio() {
    for arm in ARMS {
        let file: Value = serde_json::from_str(&reference(&format!("{arm}.json"))).unwrap();
        for (form, robot) in all_forms(arm) {
            let model = RobotModel::new(robot);
            for pose in file["poses"].as_array().unwrap() {
                let found = model.forward(&numbers(&pose["q"]));
                let away =
                    (found.translation - Vector3::from_vec(numbers(&pose["position"]))).norm();
                let rotation = Matrix3::from_row_iterator(
                    pose["rotation"]
                        .as_array()
                        .unwrap()
                        .iter()
                        .flat_map(numbers),
                );
                assert!(away < EXACT, "{} as {form}: {away} m away", arm);
                assert!(
                    (found.rotation - rotation).norm() < EXACT,
                    "{} as {form}: turned",
                    arm
                );
            }
        }
        let bodies = file["bodies"].as_array().unwrap();
        let robot = read_urdf(arm);
        assert_eq!(robot.joints.len(), bodies.len());
        for (joint, body) in robot.joints.iter().zip(bodies) {
            let mass = joint.mass.unwrap();
            assert!(
                (mass - body["mass"].as_f64().unwrap()).abs() < 1e-12,
                "{} {}: {mass} kg",
                arm,
                joint.name
            );
            let centre = Vector3::from(joint.centre.unwrap());
            assert!(
                (centre - Vector3::from_vec(numbers(&body["centre"]))).norm() < EXACT,
                "{} {}",
                arm,
                joint.name
            );
        }
        let [lower, upper] = robot.joints[1].limits.unwrap();
        assert_eq!((lower, upper), (-3.1, 3.1));
    }
}

const FULL: &str = "
calib_robot: 1
name: gantry arm
units: {length: m, angle: rad}
kinematics:
  screws:
    - {kind: prismatic, axis: [3, 0, 4]}
    - {axis: [0, 0, 1], point: [0, 0, 0.5]}
    - {axis: [1, 2, -2], point: [0.1, 0.2, 0.3]}
tool: {point: [1.5, 0.1, 0.9], orientation: {rpy: [0.1, -0.2, 0.3]}}
joints:
  - {name: track, limits: [-1, 4.5]}
  - {reduction_ratio: -213, motor_constant: 1.3}
  -
couplings: [{moved: 3, by: 2, ratio: 0.01}, {moved: 3, by: 1}]
links: [{mass: 120, centre: [0.1, 0.2, 0.3]}, null, {mass: 0, centre: [0, 0, 0]}]
payload: {mass: 6, offset: [0.05, 0, 0], frame: tool}
gravity: [0.6, 0, -9.79]
";

#[test]
fn axes_that_are_nearly_parallel_stand_at_the_arm_whose_kinematics_they_keep() {
    let robot = robot_of(crate::whose_model::FACTORY);
    // The common normal of axes 2 and 3 is 574 m away.
    assert!(
        robot
            .joints
            .iter()
            .all(|joint| Vector3::from(joint.point).norm() < 1.0),
        "{:?}",
        robot.joints
    );
    let model = RobotModel::new(robot.clone());
    // By the driver's own forward kinematics, mm.
    for (q, tool) in [
        ([0.0; 6], [-816.8671, -193.4799, -6.5127]),
        (
            [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, 0.0, 0.0],
            [-0.3026, -193.5150, 1001.0569],
        ),
        (
            [0.5, -1.2, 1.4, -1.8, -1.57, 0.3],
            [-504.4739, -401.9760, 327.1429],
        ),
        (
            [1.0, -2.0, -1.0, 0.5, 1.0, 2.0],
            [435.3477, 390.9226, 648.9325],
        ),
    ] {
        let found = model.forward(&q).translation * 1e3;
        assert!(
            (found - Vector3::from(tool)).amax() < 1e-4,
            "{found} instead of {tool:?}"
        );
    }
    let back = Robot::from_description(&robot)
        .to_frame()
        .and_then(|frame| Robot::from_frame(&frame))
        .unwrap();
    assert!(distance(&back.to_description().unwrap(), &robot) < 1e-12);
    // Points along an axis make no difference: the same table with the axes where the convention puts them.
    let mut far = robot.clone();
    for joint in &mut far.joints {
        joint.point = (Vector3::from(joint.point) + Vector3::from(joint.axis) * 500.0).into();
    }
    let far = RobotModel::new(far);
    for k in 0..200 {
        let q: Vec<f64> = (0..6)
            .map(|j| 2.0 * (1.3 * f64::from(k) + 0.7 * f64::from(j)).sin())
            .collect();
        assert!(
            (far.forward(&q).translation - model.forward(&q).translation).norm() < EXACT,
            "{q:?}"
        );
    }
}

#[test]
fn a_robot_file_gives_what_it_says() {
    let robot = robot_of(FULL);
    assert_eq!(robot.name, "gantry arm");
    assert_eq!(robot.joints[0].kind, JointKind::Prismatic);
    assert_eq!(robot.joints[0].axis, [0.6, 0.0, 0.8]);
    assert_eq!(
        (robot.joints[0].name.as_str(), robot.joints[2].name.as_str()),
        ("track", "J3")
    );
    assert_eq!(robot.joints[0].limits, Some([-1.0, 4.5]));
    assert_eq!(
        (
            robot.joints[1].reduction_ratio,
            robot.joints[1].motor_constant
        ),
        (Some(-213.0), Some(1.3))
    );
    assert_eq!(
        (robot.joints[1].mass, robot.joints[2].mass),
        (None, Some(0.0))
    );
    assert_eq!(
        robot.couplings,
        [
            Coupling {
                moved: 2,
                by: 0,
                ratio: 0.0
            },
            Coupling {
                moved: 2,
                by: 1,
                ratio: 0.01
            }
        ]
    );
    assert_eq!(robot.gravity, [0.6, 0.0, -9.79]);
    let offset = Vector3::from(robot.payload_centre) - Vector3::from(robot.tool);
    let x_of_tool = Vector3::from(robot.tool_rotation.map(|row| row[0]));
    assert!((offset - x_of_tool * 0.05).norm() < 1e-15);
}

#[test]
fn a_link_frame_carries_its_centre() {
    let text = format!(
        "{HEAD}kinematics: {{dh: [{{d: 100, a: 200, alpha: 90}}]}}\nlinks: [{{mass: 1, centre: [10, 20, 30], frame: link}}]\n"
    );
    // Frame 1 stands at (200, 0, 100) with y up and z along -y of the base.
    let found = Vector3::from(robot_of(&text).joints[0].centre.unwrap());
    assert!(
        (found - Vector3::new(0.210, -0.030, 0.120)).norm() < 1e-15,
        "{found}"
    );
}

fn distance(a: &RobotDescription, b: &RobotDescription) -> f64 {
    let flat = |robot: &RobotDescription| -> Vec<f64> {
        let mut out = vec![robot.payload_mass];
        out.extend(
            robot
                .tool
                .iter()
                .chain(&robot.payload_centre)
                .chain(&robot.gravity)
                .chain(robot.tool_rotation.iter().flatten()),
        );
        out.extend(
            robot
                .couplings
                .iter()
                .flat_map(|c| [c.moved as f64, c.by as f64, c.ratio]),
        );
        for joint in &robot.joints {
            out.extend(joint.axis.iter().chain(&joint.point));
            let optional = [joint.reduction_ratio, joint.motor_constant, joint.mass];
            out.extend(optional.map(|x| x.unwrap_or(-1e9)));
            out.extend(
                joint
                    .limits
                    .unwrap_or([-1e9; 2])
                    .iter()
                    .chain(&joint.centre.unwrap_or([-1e9; 3])),
            );
        }
        out
    };
    let (a, b) = (flat(a), flat(b));
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(&b)
        .map(|(a, b)| (a - b).abs() / (1.0 + a.abs()))
        .fold(0.0, f64::max)
}

#[test]
fn the_table_keeps_the_description() {
    let forms = ARMS
        .into_iter()
        .flat_map(|arm| all_forms(arm).into_iter().map(|(_, robot)| robot));
    for robot in forms.chain([robot_of(FULL)]) {
        let frame = Robot::from_description(&robot).to_frame().unwrap();
        let again = Robot::from_frame(&frame)
            .and_then(|table| table.to_description())
            .unwrap();
        assert!(distance(&robot, &again) < 1e-12, "{}", robot.name);
        assert_eq!(robot.name, again.name);
        assert!(
            robot
                .joints
                .iter()
                .zip(&again.joints)
                .all(|(a, b)| (&a.name, a.kind) == (&b.name, b.kind))
        );
    }
}

#[test]
fn a_practice_robot_is_read_in_its_units() {
    let text = r#"{"name": "two", "axes": [[0, 0, 1], [0, -2, 0]], "points": [[0, 0, 0], [312.0, 0, 0]], "tool": [1854, 0, 1310],
	"mass": [350, null], "com": [[150, 0, -120], null], "ratio": [213, 214], "kt": [1.3, 1.3], "payload": 210.0,
	"payload_com": [180, 40, 60], "coupling": [[1, 0]], "colour": "orange"}"#;
    let Imported { robot, notes, .. } = read_case(RobotFileText::new("robot.json", text)).unwrap();
    assert_eq!(robot.joints[1].axis, [0.0, -1.0, 0.0]);
    assert_eq!(robot.joints[1].point, [0.312, 0.0, 0.0]);
    assert_eq!(
        (
            robot.joints[0].mass,
            robot.joints[1].mass,
            robot.joints[1].centre
        ),
        (Some(350.0), None, None)
    );
    assert_eq!(robot.joints[1].reduction_ratio, Some(214.0));
    assert!(
        (Vector3::from(robot.payload_centre) - Vector3::new(2.034, 0.040, 1.370)).norm() < 1e-12
    );
    assert_eq!(
        robot.couplings,
        [Coupling {
            moved: 1,
            by: 0,
            ratio: 0.0
        }]
    );
    assert_eq!(notes, ["robot.json: the key `colour` is not used"]);
}

#[test]
fn the_stage_reads_every_practice_robot() {
    let Some(folder) = shared("practice") else {
        return;
    };
    let mut cases: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    cases.retain(|path| path.is_dir());
    cases.sort();
    assert!(!cases.is_empty());
    for case in cases {
        let desk = Desk::default().with(
            "robot.json",
            std::fs::read(case.join("robot.json")).unwrap(),
        );
        let stage = ReadRobot {
            file: RawFile("robot.json".into()),
            format: RobotFormat::Case,
            urdf: None,
            mjcf: None,
        };
        let tables = desk
            .run(&stage, RobotReads {})
            .unwrap_or_else(|e| panic!("{}: {e}", case.display()));
        let robot = Robot::from_frame(&tables["robot"][0])
            .and_then(|table| table.to_description())
            .unwrap();
        assert!(matches!(robot.joints.len(), 5..=7), "{}", case.display());
        assert!(
            robot
                .joints
                .iter()
                .all(|joint| joint.mass.is_some_and(|mass| mass > 0.0))
        );
        assert!(
            desk.warnings.lock().unwrap().is_empty(),
            "{}",
            case.display()
        );
    }
}

#[test]
fn the_stage_reads_the_urdf_beside_a_robot_file() {
    let text = format!("{HEAD}kinematics: {{urdf: {{base: world_base, tip: tool0}}}}\n");
    let desk = Desk::default()
        .with("robot.yaml", text)
        .with("arm.urdf", reference("seven.urdf"));
    let urdf = Some(RawFile("arm.urdf".into()));
    let stage = ReadRobot {
        file: RawFile("robot.yaml".into()),
        format: RobotFormat::Calib,
        urdf,
        mjcf: None,
    };
    assert_eq!(stage.files().len(), 2, "both contents are part of the key");
    let tables = desk.run(&stage, RobotReads {}).unwrap();
    let robot = Robot::from_frame(&tables["robot"][0])
        .and_then(|table| table.to_description())
        .unwrap();
    assert!(distance(&robot, &read_urdf("seven")) < 1e-12);
}

#[test]
fn masses_that_no_arm_of_this_length_has_are_said() {
    let arm = |payload: f64, link: f64| {
        format!(
            "calib_robot: 1\nname: arm\nunits: {{length: mm, angle: deg}}\nkinematics:\n  dh:\n\
             \x20   - {{theta: 0, d: 400, a: 25, alpha: -90}}\n\x20   - {{theta: 0, d: 0, a: 560, alpha: 0}}\n\
             tool: {{point: [0, 0, 100]}}\n\
             links:\n  - {{mass: {link}, centre: [0, 0, 0], frame: link}}\n  - {{mass: {link}, centre: [0, 0, 0], frame: link}}\n\
             payload: {{mass: {payload}, offset: [0, 0, 100]}}\n"
        )
    };
    let notes = |payload: f64, link: f64| {
        let text = arm(payload, link);
        read_calib(RobotFileText::new("robot.yaml", &text), None)
            .unwrap()
            .notes
            .join("\n")
    };
    assert_eq!(notes(10.0, 30.0), "");
    let grams = notes(5000.0, 30_000.0);
    has(
        &grams,
        [
            "payload.mass: 5000 kg on an arm of 0.97 m between its axes",
            "links: 60000 kg on an arm of",
            "if the file holds grams, divide by 1000",
        ],
    );
}
