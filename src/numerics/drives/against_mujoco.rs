//! The chain and its roll-out against MuJoCo itself: `mujoco/arm.xml`, and what MuJoCo 4.0 makes of it.

use crate::chain::{Bodies, Chain, MOST, Posed};
use crate::mjcf::{MjcfArm, MjcfText, read};
use crate::physics::{Joint, Physics};
use crate::recording::{Recording, Trajectory};
use crate::rollout::{Which, roll};
use calib_dynamics::InertialTolerance;
use serde_json::Value;

const ARM: &str = include_str!("mujoco/arm.xml");

fn arm() -> MjcfArm {
    let names = ["j1", "j2", "j3", "j4"].map(String::from);
    read(file(ARM), &[], &names).unwrap()
}

fn file(text: &str) -> MjcfText<'_> {
    MjcfText {
        label: "arm.xml",
        text,
    }
}

fn parts(arm: &MjcfArm) -> (Chain, Bodies) {
    let reference: Vec<f64> = arm.joints.iter().map(|joint| joint.reference).collect();
    let bodies = Bodies {
        links: arm.arm.links.clone().unwrap(),
        gravity: arm.arm.gravity,
    };
    (Chain::new(&arm.arm, &reference), bodies)
}

fn numbers(value: &Value) -> Vec<f64> {
    let all = value.as_array().unwrap().iter();
    all.map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn mass_matrix_bias_and_kinematics_are_those_of_mujoco() {
    let arm = arm();
    let (chain, bodies) = parts(&arm);
    let all: Value = serde_json::from_str(include_str!("mujoco/states.json")).unwrap();
    for state in all["states"].as_array().unwrap() {
        let (mut posed, mut matrix) = (Posed::default(), [[0.0; MOST]; MOST]);
        let mut bias = [0.0; MOST];
        chain.pose(&numbers(&state["q"]), &bodies, &mut posed);
        chain.mass_matrix(&posed, &mut matrix);
        let speed = numbers(&state["v"]);
        chain.torques(&posed, &bodies.gravity, &speed, None, &mut bias);
        let (m, b, tool) = (&state["M"], &state["b"], &state["tool"]);
        for (i, expected) in numbers(b).into_iter().enumerate() {
            assert!((bias[i] - expected).abs() < 1e-9 * (1.0 + expected.abs()));
            for k in 0..4 {
                let armature = if i == k { arm.joints[i].armature } else { 0.0 };
                let expected = numbers(m)[4 * i + k];
                assert!((matrix[i][k] + armature - expected).abs() < 1e-9);
            }
        }
        for (found, expected) in chain.tool_at(&posed).iter().zip(numbers(tool)) {
            assert!((found - expected).abs() < 1e-9);
        }
    }
}

/// One standard deviation of its inertials.
pub(crate) const TOLERANCE: InertialTolerance = InertialTolerance {
    mass_relative: 0.02,
    centre: 1e-3,
    inertia_relative: 0.02,
};

/// The arm with its drives along a motion, as MuJoCo simulates it.
pub(crate) fn motion() -> (Chain, Physics, Recording) {
    let arm = arm();
    let (chain, bodies) = parts(&arm);
    let all: Value = serde_json::from_str(include_str!("mujoco/motion.json")).unwrap();
    let flat = |name: &str| -> Vec<f64> {
        all[name]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(numbers)
            .collect()
    };
    let (command, mut angle) = (flat("command"), flat("angle"));
    let period = all["period"].as_f64().unwrap();
    let rows = angle.len() / 4;
    // MuJoCo begins where it is told, not at the mean of its first rows.
    let start = angle[..4].to_vec();
    for row in 0..40 {
        angle[4 * row..4 * row + 4].copy_from_slice(&start);
    }
    let recording = Recording {
        time: (0..rows).map(|row| row as f64 * period).collect(),
        command,
        angle,
        trajectories: vec![Trajectory {
            rows: 0..rows,
            began: 0.0,
        }],
        held_out: vec![false; rows],
        period,
        encoder: vec![1e-6; 4],
        noise: vec![1e-6; 4],
    };
    let joints = arm.joints.iter().map(|joint| {
        let servo = joint.servo.unwrap();
        Joint {
            kp: servo.kp,
            kd: servo.kd,
            limit: servo.limit,
            damping: joint.damping,
            friction: joint.friction,
            armature: joint.armature,
            spring: [joint.stiffness, joint.spring_reference],
            ..Joint::default()
        }
    });
    let physics = Physics {
        joints: joints.collect(),
        bodies,
        tool: arm.arm.tool,
        hold: 0.0,
        sag: 0.0,
    };
    (chain, physics, recording)
}

#[test]
fn a_roll_out_is_that_of_mujoco_to_a_ten_thousandth_of_the_motion() {
    let (chain, physics, simulated) = motion();
    let all: Value = serde_json::from_str(include_str!("mujoco/motion.json")).unwrap();
    let angles = all["angle"].as_array().unwrap().iter();
    let angle: Vec<f64> = angles.flat_map(numbers).collect();
    let start = angle[..4].to_vec();
    let (mut worst, mut range) = ([0.0_f64; 4], [0.0_f64; 4]);
    roll(&chain, &physics, &simulated, &[], Which::All, |row| {
        for joint in 0..4 {
            let measured = angle[4 * row.row + joint];
            worst[joint] = worst[joint].max((measured - row.angle[joint]).abs());
            range[joint] = range[joint].max((measured - start[joint]).abs());
        }
    });
    for joint in 0..4 {
        let share = worst[joint] / range[joint];
        assert!(share < 1e-4, "joint {}: {share:.1e}", joint + 1);
    }
}

fn fault(text: &str, joints: &[&str]) -> String {
    let names: Vec<String> = joints.iter().map(|name| name.to_string()).collect();
    read(file(text), &[], &names).unwrap_err().to_string()
}

#[test]
fn what_is_not_read_is_refused_by_its_element() {
    let names = ["j1", "j2", "j3", "j4"];
    let muscle = ARM.replace("<general joint=\"j4\"", "<muscle joint=\"j4\"");
    let text = fault(&muscle, &names);
    assert!(
        text.contains("<muscle>") && text.contains("allowed: position"),
        "{text}"
    );
    let bare = ARM.replace(
        "<inertial pos=\"0.03 0 0.01\" mass=\"0.6\" diaginertia=\"0.003 0.002 0.002\"/>",
        "",
    );
    let text = fault(&bare, &names);
    assert!(text.contains("body `three` has no <inertial>"), "{text}");
    let weld = ARM.replace(
        "<actuator>",
        "<equality><weld body1=\"four\" body2=\"base\"/></equality><actuator>",
    );
    let text = fault(&weld, &names);
    assert!(text.contains("closes a loop"), "{text}");
    let text = fault(ARM, &["j1", "j2", "j5"]);
    assert!(text.contains("no hinge or slide joint `j5`"), "{text}");
    let text = fault(ARM, &["j1", "held", "j3"]);
    assert!(text.contains("is not carried by joint `held`"), "{text}");
    let text = fault(
        &ARM.replace("<worldbody>", "<include file=\"more.xml\"/><worldbody>"),
        &names,
    );
    assert!(text.contains("more.xml"), "{text}");
}

#[test]
fn an_included_file_counts_as_if_it_stood_there() {
    let at = ARM.find("<default>").unwrap();
    let end = ARM.rfind("</default>").unwrap() + "</default>".len();
    let outer = format!(
        "{}<include file=\"defaults.xml\"/>{}",
        &ARM[..at],
        &ARM[end..]
    );
    let inner = format!("<mujoco>{}</mujoco>", &ARM[at..end]);
    let names = ["j1", "j2", "j3", "j4"].map(String::from);
    let included = MjcfText {
        label: "models/defaults.xml",
        text: &inner,
    };
    assert_eq!(read(file(&outer), &[included], &names).unwrap(), arm());
}
