//! Perfect torques of arms of the library: what differentiation, rounding and the filters make of them is no finding.

use super::rigid::{bare, ten};
use calib::dynamics::{
    DynamicArm, INERTIAL_NUMBERS, Inertial, InverseDynamics, MotionRow, TorqueQuestion,
    TorqueRecording, diagnose,
};
use calib::robot::LIBRARY;
use calib::twin::torque::Body;
use nalgebra::Matrix3;

/// Arms of the library with masses.
const ARMS: [&str; 6] = ["ur3e", "ur5e", "ur10e", "ur16e", "panda", "gen3_7"];
/// Hz, s.
const RATE: f64 = 50.0;
const SECONDS: f64 = 30.0;

/// The arm with its masses, and the ten numbers of each link about its joint's point.
fn declared(name: &str) -> (DynamicArm, Vec<f64>) {
    let arm = LIBRARY.iter().find(|arm| arm.name == name).unwrap();
    let robot = arm.read().unwrap().robot;
    let axes: Vec<[f64; 3]> = robot.joints.iter().map(|joint| joint.axis).collect();
    let points: Vec<[f64; 3]> = robot.joints.iter().map(|joint| joint.point).collect();
    let (mut links, mut theta) = (Vec::new(), Vec::new());
    for joint in &robot.joints {
        // The library has no moments of inertia: those of a ball.
        let mass = joint.mass.unwrap();
        let own = mass * 0.08 * 0.08;
        let body = Body {
            mass,
            centre: joint.centre.unwrap(),
            inertia: [own, 0.0, 0.0, own, 0.0, own],
        };
        theta.extend(ten(&body, joint.point));
        let [xx, xy, xz, yy, yz, zz] = body.inertia;
        links.push(Inertial {
            mass: body.mass,
            centre: body.centre.into(),
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        });
    }
    assert_eq!(theta.len(), INERTIAL_NUMBERS * axes.len());
    let arm = DynamicArm {
        links: Some(links),
        ..bare(&axes, &points, [0.0, 0.0, -9.81])
    };
    (arm, theta)
}

/// Position, velocity and acceleration: sums of sines, then moves from point to point whose acceleration jumps.
fn moved(joint: usize, time: f64) -> [f64; 3] {
    let phase = joint as f64;
    if time < 0.5 * SECONDS {
        let mut sum = [0.0; 3];
        for (number, size) in [0.5, 0.25, 0.12].into_iter().enumerate() {
            let pace = 0.45 * (1.0 + 0.31 * phase) * (1.0 + 1.37 * number as f64);
            let (sine, cosine) = (pace * time + number as f64 + phase).sin_cos();
            sum[0] += size * sine;
            sum[1] += size * pace * cosine;
            sum[2] -= size * pace * pace * sine;
        }
        return sum;
    }
    // A move of 1.2 s and a rest of 0.3 s, with a third of the time to speed up and to slow down.
    const LASTS: f64 = 1.2;
    let since = time - 0.5 * SECONDS;
    let (number, within) = ((since / 1.5).floor(), since % 1.5);
    let at = |number: f64| 0.9 * (2.3 * number + 1.7 * phase).sin();
    let (from, by) = (at(number), at(number + 1.0) - at(number));
    let share = (within / LASTS).min(1.0);
    let [s, v, a] = match share {
        share if share < 1.0 / 3.0 => [2.25 * share * share, 4.5 * share, 4.5],
        share if share < 2.0 / 3.0 => [1.5 * (share - 1.0 / 6.0), 1.5, 0.0],
        share if share < 1.0 => {
            let left = 1.0 - share;
            [1.0 - 2.25 * left * left, 4.5 * left, -4.5]
        }
        _ => [1.0, 0.0, 0.0],
    };
    [from + by * s, by * v / LASTS, by * a / (LASTS * LASTS)]
}

/// The torques of an arm, positions and torques rounded to so many digits after the point.
fn recorded(arm: &DynamicArm, theta: &[f64], digits: i32) -> TorqueRecording {
    let n = arm.axes.len();
    let rows = (SECONDS * RATE) as usize;
    let rounded = |value: f64| (value * 10f64.powi(digits)).round() / 10f64.powi(digits);
    let mut dynamics = InverseDynamics::new(arm);
    let mut recording = TorqueRecording {
        joints: n,
        trajectory: vec![1; rows],
        held_out: (0..rows).map(|row| row % 500 >= 350).collect(),
        ..TorqueRecording::default()
    };
    let mut torque = vec![0.0; n];
    for row in 0..rows {
        let time = row as f64 / RATE;
        let motion: Vec<[f64; 3]> = (0..n).map(|joint| moved(joint, time)).collect();
        let [position, velocity, acceleration] =
            [0, 1, 2].map(|part| motion.iter().map(|one| one[part]).collect::<Vec<f64>>());
        let motion = MotionRow {
            position: &position,
            velocity: &velocity,
            acceleration: &acceleration,
        };
        dynamics.torque(motion, &arm.gravity, theta, &mut torque);
        recording.time.push(time);
        recording
            .position
            .extend(position.iter().copied().map(rounded));
        recording.torque.extend(torque.iter().copied().map(rounded));
    }
    recording
}

#[test]
fn nothing_is_named_in_perfect_torques_of_six_arms_whatever_their_digits() {
    let said = |(k, name): (usize, &str)| {
        let (arm, theta) = declared(name);
        let recording = recorded(&arm, &theta, [4, 6, 12][k % 3]);
        let question = TorqueQuestion::default();
        let diagnosis = diagnose(&arm, &recording, &question, &mut |_| ()).unwrap();
        let findings = diagnosis.findings.iter();
        let findings = findings.map(|one| format!("{name}: {}", one.statement));
        findings.collect::<Vec<String>>()
    };
    let said: Vec<String> = ARMS.into_iter().enumerate().flat_map(said).collect();
    assert!(said.is_empty(), "{}", said.join("\n"));
}
