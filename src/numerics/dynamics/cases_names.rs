//! What is named and what is not: parts of a sum, numbers at an end of their search, drives before masses, uneven stamps.

use super::cases::{arm, found, record};
use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::*;

fn diagnosed(recording: &TorqueRecording) -> TorqueDiagnosis {
    diagnose(&arm(), recording, &TorqueQuestion::default(), &mut |_| ()).unwrap()
}

/// The value of a parameter of a finding.
fn number(diagnosis: &TorqueDiagnosis, effect: &str, joint: usize, name: &str) -> Option<f64> {
    let place = crate::effect::Place::Joint(joint);
    let finding = diagnosis
        .findings
        .iter()
        .find(|finding| finding.effect == effect && finding.place == place)?;
    finding
        .parameters
        .iter()
        .find(|parameter| parameter.name == name)
        .map(|parameter| parameter.value)
}

#[test]
fn viscous_and_coulomb_friction_beside_a_curve_without_a_name_are_the_line_of_the_whole_curve() {
    let curve = |speed: f64| 8.0 + 6.0 * speed + 2.0 * (6.0 * speed).sin();
    let law = |velocity: f64| (velocity / 0.003).tanh() * curve(velocity.abs());
    let speeds = std::cell::RefCell::new(Vec::new());
    let recording = record(&arm(), 0.0, &|(joint, _, _, velocity, ..)| {
        if joint == 1 {
            speeds.borrow_mut().push(velocity.abs());
        }
        if joint == 1 {
            law(velocity)
        } else {
            5.0 * (velocity / 0.003).tanh()
        }
    });
    let diagnosis = diagnosed(&recording);
    // Plain least squares of the law over the recorded speeds.
    let (mut count, mut sums) = (0.0, [0.0; 4]);
    for speed in speeds.borrow().iter() {
        count += 1.0;
        let torque = curve(*speed);
        sums.iter_mut()
            .zip([*speed, speed * speed, torque, speed * torque])
            .for_each(|(sum, part)| *sum += part);
    }
    let [speed, square, torque, product] = sums.map(|sum| sum / count);
    let viscous = (product - speed * torque) / (square - speed * speed);
    let coulomb = torque - viscous * speed;
    let all = found(&diagnosis);
    assert!(all.contains(&"unknown joint 2".to_string()), "{all:?}");
    for (effect, name, wanted) in [
        ("viscous_friction", "viscous", viscous),
        ("coulomb_friction", "coulomb", coulomb),
    ] {
        let value = number(&diagnosis, effect, 1, name).expect("named");
        assert!(
            (value / wanted - 1.0).abs() < 0.3,
            "{name}: {value}, {wanted}"
        );
    }
    let friction = diagnosis
        .friction
        .iter()
        .find(|curve| curve.joint == 1)
        .expect("a curve");
    for (velocity, (found, sigma)) in friction
        .velocity
        .iter()
        .zip(friction.torque.iter().zip(&friction.sigma))
    {
        if velocity.abs() > 0.05 {
            assert!(
                (found - law(*velocity)).abs() < 4.0 * sigma + 0.3,
                "{velocity}: {found} +- {sigma}, {}",
                law(*velocity)
            );
        }
    }
}

#[test]
fn wrong_torque_constants_of_three_joints_are_these_and_no_masses() {
    let recording = record(&arm(), 0.0, &|(joint, _, _, velocity, _, rigid)| {
        let friction = 5.0 * (velocity / 0.003).tanh();
        if joint < 3 {
            0.4 * rigid + 1.4 * friction
        } else {
            friction
        }
    });
    let diagnosis = diagnosed(&recording);
    for joint in 0..3 {
        let relative = number(&diagnosis, "torque_constant", joint, "relative").expect("named");
        assert!(
            (relative - 0.4).abs() < 0.05,
            "joint {}: {relative}",
            joint + 1
        );
    }
    let masses = ["payload_error", "link_mass", "link_com", "link_inertia"];
    assert!(
        diagnosis
            .findings
            .iter()
            .all(|finding| !masses.contains(&finding.effect)),
        "{:?}",
        found(&diagnosis)
    );
}

#[test]
fn a_gas_spring_is_a_balancer_though_its_waves_are_uncertain_one_by_one() {
    // Where the joint moves little, two waves and a constant are hardly three curves.
    let spring = |angle: f64| {
        let bend = libm::sin(angle + 1.1);
        -60.0 * bend * (1.0 + 0.3 * bend)
    };
    let recording = record(&arm(), 0.0, &|(joint, _, angle, velocity, ..)| {
        4.0 * velocity
            + 5.0 * (velocity / 0.003).tanh()
            + if joint == 1 { spring(angle) } else { 0.0 }
    });
    let all = found(&diagnosed(&recording));
    assert!(
        all.contains(&"spring_balance joint 2".to_string()),
        "{all:?}"
    );
}

#[test]
fn torques_that_come_later_than_is_looked_for_get_no_latency() {
    let late = |seconds: f64| {
        let diagnosis = diagnosed(&record(&arm(), seconds, &|row| {
            5.0 * (row.3 / 0.003).tanh()
        }));
        diagnosis
            .findings
            .iter()
            .any(|finding| finding.effect == LATENCY)
    };
    assert!(late(0.02) && !late(0.09));
}

#[test]
fn a_number_at_an_end_of_its_search_is_none() {
    let recording = record(&arm(), 0.0, &|_| 0.0);
    let arm = arm();
    let scene = scene::DynamicScene::new(
        &arm,
        &recording,
        &clock::RecordingClock::of(&recording),
        10.0,
        false,
    );
    let form = |name: &str, index: usize, value: f64| -> TorqueForm {
        let all = TORQUE_CAUSES
            .iter()
            .filter(|cause| cause.name == name)
            .flat_map(|cause| (cause.forms)(cause, &scene));
        all.into_iter()
            .next()
            .expect("a form")
            .with_shape(index, value)
    };
    assert!(form("joint_elasticity", 0, 2.01).within_ends().is_none());
    assert!(form("joint_elasticity", 0, 4.6).within_ends().is_some());
    assert!(form("warmup_friction", 0, 1.0).within_ends().is_none());
    // Another power of speed has a usual one.
    assert_eq!(
        form("viscous_friction", 0, 1.59)
            .within_ends()
            .map(|within| within.shape),
        Some(vec![1.0])
    );
    let order = |order: usize| TorqueForm {
        with: [order, 0],
        ..form("torque_ripple", 0, 100.0)
    };
    assert!(order(6).within_ends().is_some() && order(9).within_ends().is_none());
}
