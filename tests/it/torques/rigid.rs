//! Torques of rigid arms by other engines: MuJoCo's and Pinocchio's inverse dynamics (tests/reference/mujoco_dynamics.py).

use calib::dynamics::{
    DynamicArm, INERTIAL_NUMBERS, InertialTolerance, InverseDynamics, MotionRow,
};
use calib::twin::torque::{Body, JointState, Machine};
use serde_json::Value;

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

fn list(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// The ten numbers of a body about its joint's point, by the parallel-axis rule.
pub(super) fn ten(body: &Body, point: [f64; 3]) -> [f64; INERTIAL_NUMBERS] {
    let r = [0, 1, 2].map(|k| body.centre[k] - point[k]);
    let square: f64 = r.iter().map(|x| x * x).sum();
    let entry = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    std::array::from_fn(|k| match k {
        0 => body.mass,
        1..=3 => body.mass * r[k - 1],
        _ => {
            let (row, column) = entry[k - 4];
            body.inertia[k - 4]
                + body.mass * (if row == column { square } else { 0.0 } - r[row] * r[column])
        }
    })
}

/// An arm without declared masses.
pub(super) fn bare(axes: &[[f64; 3]], points: &[[f64; 3]], gravity: [f64; 3]) -> DynamicArm {
    DynamicArm {
        axes: axes.iter().map(|axis| (*axis).into()).collect(),
        points: points.iter().map(|point| (*point).into()).collect(),
        prismatic: vec![false; axes.len()],
        tool: points[points.len() - 1].into(),
        links: None,
        payload: None,
        gravity: gravity.into(),
        ratio: vec![1.0; axes.len()],
        coupled: Vec::new(),
        tolerance: InertialTolerance {
            mass_relative: 0.01,
            centre: 0.001,
            inertia_relative: 0.05,
        },
    }
}

#[test]
fn columns_of_the_regressor_are_those_of_mujoco_and_pinocchio() {
    let document: Value = serde_json::from_str(include_str!("rigid_arms.json")).unwrap();
    let mut compared = 0;
    let mut largest: [f64; 2] = [0.0; 2];
    for answer in document["arms"].as_array().unwrap() {
        let of_name = |name: &str| -> Vec<[f64; 3]> {
            answer["links"]
                .as_array()
                .unwrap()
                .iter()
                .map(|link| numbers(&link[name]))
                .collect()
        };
        let arm = bare(
            &of_name("axis"),
            &of_name("point"),
            numbers(&answer["gravity"]),
        );
        let mut dynamics = InverseDynamics::new(&arm);
        for (row, columns) in answer["rows"]
            .as_array()
            .unwrap()
            .iter()
            .zip(answer["columns"].as_array().unwrap())
        {
            let [q, v, a] = ["q", "v", "a"].map(|name| list(&row[name]));
            let motion = MotionRow {
                position: &q,
                velocity: &v,
                acceleration: &a,
            };
            dynamics.regressor(motion, &arm.gravity, |joint, link, ours| {
                for (engine, off) in ["mujoco", "pinocchio"].into_iter().zip(&mut largest) {
                    for (number, value) in ours.iter().enumerate() {
                        let other = columns[engine][link][number][joint].as_f64().unwrap();
                        *off = off.max((value - other).abs());
                        compared += 1;
                    }
                }
            });
        }
    }
    println!(
        "columns differ by {:.1e} Nm from MuJoCo's, by {:.1e} Nm from Pinocchio's",
        largest[0], largest[1]
    );
    // Two motions of arms of 5, 6 and 7 joints: n (n + 1) / 2 pairs of joint and link, ten numbers, two engines.
    assert_eq!(compared, 2 * 2 * 10 * (15 + 21 + 28));
    assert!(largest.iter().all(|off| *off < 1e-9), "{largest:?}");
}

#[test]
fn inverse_dynamics_of_estimator_and_twin_are_those_of_mujoco_and_pinocchio() {
    let text = include_str!("rigid_arms.json");
    let document: Value = serde_json::from_str(text).unwrap();
    let arms = document["arms"].as_array().unwrap();
    assert_eq!(arms.len(), 3);
    for answer in arms {
        let links = answer["links"].as_array().unwrap();
        let gravity: [f64; 3] = numbers(&answer["gravity"]);
        let axes: Vec<[f64; 3]> = links.iter().map(|link| numbers(&link["axis"])).collect();
        let points: Vec<[f64; 3]> = links.iter().map(|link| numbers(&link["point"])).collect();
        let body = |link: &Value| Body {
            mass: link["mass"].as_f64().unwrap(),
            centre: numbers(&link["centre"]),
            inertia: numbers(&link["inertia"]),
        };
        let bodies: Vec<Body> = links.iter().map(body).collect();
        let theta: Vec<f64> = bodies
            .iter()
            .zip(&points)
            .flat_map(|(body, point)| ten(body, *point))
            .collect();
        let tool = points[points.len() - 1];
        let arm = bare(&axes, &points, gravity);
        let machine = Machine {
            axes,
            points,
            tool,
            links: bodies,
            payload: None,
            gravity,
        };
        let mut dynamics = InverseDynamics::new(&arm);
        for row in answer["rows"].as_array().unwrap() {
            let [q, v, a, mujoco, pinocchio] =
                ["q", "v", "a", "mujoco", "pinocchio"].map(|name| list(&row[name]));
            let mut estimator = vec![0.0; q.len()];
            dynamics.torque(
                MotionRow {
                    position: &q,
                    velocity: &v,
                    acceleration: &a,
                },
                &arm.gravity,
                &theta,
                &mut estimator,
            );
            let twin = machine.torque(&JointState { q, v, a });
            let largest = mujoco
                .iter()
                .fold(1.0, |most: f64, torque| most.max(torque.abs()));
            for ours in [&estimator, &twin] {
                for other in [&mujoco, &pinocchio] {
                    let off = ours
                        .iter()
                        .zip(other)
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max);
                    assert!(off < 1e-9 * largest, "{off} Nm of {largest}");
                }
            }
        }
    }
}
