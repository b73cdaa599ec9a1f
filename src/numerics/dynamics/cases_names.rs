//! What is named and what is not: parts of a sum, numbers at an end of their search, drives before masses, uneven stamps.

use super::cases::{
    arm, diagnosed, diagnosed_with, found, of_name, parameter, record, scene, sign,
};
use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::*;

/// A recording diagnosed with settings that differ from the usual ones.
fn asked(
    change: impl Fn(&mut TorqueQuestion),
    extra: &dyn Fn(super::cases::Row) -> f64,
) -> TorqueDiagnosis {
    let mut question = TorqueQuestion::default();
    change(&mut question);
    diagnose(&arm(), &record(&arm(), 0.0, extra), &question, &mut |_| ()).unwrap()
}

#[test]
fn a_law_of_a_users_own_is_found_with_its_size_and_shape_and_stays_in_the_model() {
    let declaration = crate::effect::EffectDeclaration {
        name: "worn_seal".into(),
        place: "joint".into(),
        law: crate::effect::Laws(vec!["exp(-((q - centre) / width)^2)".into()]),
        // Starts apart: the law between them must be found all the same.
        shape: [("centre", [-2.0, 2.0]), ("width", [0.05, 0.8])]
            .map(|(name, [from, to])| {
                let range = crate::effect::ShapeRange {
                    from,
                    to,
                    ..Default::default()
                };
                (name.to_string(), range)
            })
            .into(),
        sentence: Some("{place} has a worn seal near {centre} rad: {value}".into()),
        ..Default::default()
    };
    let law = crate::effect::DeclaredTorque::of(&declaration).expect("a law");
    let diagnosis =
        asked(
            |question| question.effects = vec![law.clone()],
            &|(joint, _, angle, velocity, ..)| {
                let hump = 6.0 * libm::exp(-((angle - 0.3) / 0.2).powi(2));
                5.0 * sign(velocity) + if joint == 2 { hump } else { 0.0 }
            },
        );
    let mut at_joint = found(&diagnosis);
    at_joint.retain(|name| name.ends_with("joint 3"));
    assert_eq!(at_joint, ["coulomb_friction joint 3", "worn_seal joint 3"]);
    let finding = of_name(&diagnosis, "worn_seal");
    assert_eq!(finding.follows, "own angle");
    assert!(
        finding
            .statement
            .starts_with("joint 3 has a worn seal near 0.3"),
        "{}",
        finding.statement
    );
    for (name, truth) in [("coefficient", 6.0), ("centre", 0.3), ("width", 0.2)] {
        let value = parameter(finding, name).value;
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value}");
    }
    let mut terms = diagnosis.model.terms.iter();
    let term = terms
        .find(|term| term.effect == "worn_seal")
        .expect("a term");
    assert_eq!(term.declared.as_ref(), Some(&law));
    assert!(term.names().is_ok());
    // Of a law over time nobody knows the torque unless it is known how long ago the arm began to move.
    let over_time = crate::effect::EffectDeclaration {
        name: "drift".into(),
        place: "joint".into(),
        law: crate::effect::Laws(vec!["time".into()]),
        ..Default::default()
    };
    let mut model = diagnosis.model.clone();
    model.terms = vec![TorqueTerm {
        effect: "drift".into(),
        declared: crate::effect::DeclaredTorque::of(&over_time).ok(),
        shape: Vec::new(),
        coefficients: vec![1.0],
        ..term.clone()
    }];
    model.covariance.clear();
    let joints = model.joints();
    let rows = 0..20;
    let mut motion = PlannedMotion {
        joints,
        time: rows.clone().map(|row| 0.01 * f64::from(row)).collect(),
        position: vec![0.0; joints * rows.len()],
        velocity: None,
        acceleration: None,
        temperature: None,
        since_start: None,
    };
    let refused = model.needed(&arm(), &motion).unwrap_err();
    assert!(refused.to_string().contains("follows time"), "{refused}");
    motion.since_start = Some(5.0);
    assert!(model.needed(&arm(), &motion).is_ok());
}

#[test]
fn what_a_left_out_name_explains_is_without_one_at_its_place_and_stays_in_the_model() {
    let extra = |(joint, _, angle, velocity, ..): super::cases::Row| {
        5.0 * sign(velocity) + if joint == 3 { 2.0 * angle } else { 0.0 }
    };
    let diagnosis = asked(
        |question| question.without = vec!["cable_stiffness".into()],
        &extra,
    );
    let mut at_joint = found(&diagnosis);
    at_joint.retain(|name| name.ends_with("joint 4"));
    assert_eq!(at_joint, ["coulomb_friction joint 4", "unknown joint 4"]);
    let usual = asked(|_| (), &extra);
    assert_eq!(usual.after, diagnosis.after);
}

#[test]
fn a_more_open_world_names_less_and_says_more_often_that_nobody_listed_it() {
    let nameless = |open_world: f64, size: f64| {
        let hump = |(joint, _, angle, velocity, ..): super::cases::Row| {
            let hump = size * libm::exp(-((angle - 0.3) / 0.3).powi(2));
            5.0 * sign(velocity) + if joint == 2 { hump } else { 0.0 }
        };
        let diagnosis = asked(|question| question.open_world = open_world, &hump);
        let mut findings = diagnosis.findings.iter();
        findings.any(|finding| finding.effect == "unknown")
    };
    let sizes = [0.12, 0.16, 0.2, 0.25];
    let [closed, open] = [0.001, 0.999].map(|open_world| {
        let of_size = |size: &&f64| nameless(open_world, **size);
        sizes.iter().filter(of_size).count()
    });
    assert!(closed < open, "{closed} {open}");
}

#[test]
fn a_torque_over_what_no_cause_follows_is_one_without_a_name_that_says_what_it_follows() {
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, _, rigid)| {
        let bent = 4.0 * (0.05 * rigid).sin().powi(2);
        5.0 * sign(velocity) + if joint == 1 { bent } else { 0.0 }
    });
    let finding = of_name(&diagnosis, "unknown");
    assert_eq!(
        (finding.place, finding.follows),
        (crate::effect::Place::Joint(1), "load")
    );
}

/// The value of a parameter of a finding at a joint.
fn number(diagnosis: &TorqueDiagnosis, effect: &str, joint: usize, name: &str) -> f64 {
    let place = crate::effect::Place::Joint(joint);
    let mut findings = diagnosis.findings.iter();
    let finding = findings.find(|finding| finding.effect == effect && finding.place == place);
    parameter(finding.expect("named"), name).value
}

#[test]
fn viscous_and_coulomb_friction_beside_a_curve_without_a_name_are_the_line_of_the_whole_curve() {
    let curve = |speed: f64| 8.0 + 6.0 * speed + 2.0 * (6.0 * speed).sin();
    let law = |velocity: f64| sign(velocity) * curve(velocity.abs());
    let speeds = std::cell::RefCell::new(Vec::new());
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, ..)| match joint {
        1 => {
            speeds.borrow_mut().push(velocity.abs());
            law(velocity)
        }
        _ => 5.0 * sign(velocity),
    });
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
        let value = number(&diagnosis, effect, 1, name);
        assert!(
            (value / wanted - 1.0).abs() < 0.3,
            "{name}: {value}, {wanted}"
        );
    }
    let mut curves = diagnosis.friction.iter();
    let friction = curves.find(|curve| curve.joint == 1).expect("a curve");
    let torques = friction.torque.iter().zip(&friction.sigma);
    let points = friction.velocity.iter().zip(torques);
    for (velocity, (found, sigma)) in points.filter(|(velocity, _)| velocity.abs() > 0.05) {
        let truth = law(*velocity);
        assert!(
            (found - truth).abs() < 4.0 * sigma + 0.3,
            "{velocity}: {found} +- {sigma}, {truth}"
        );
    }
}

#[test]
fn wrong_torque_constants_of_three_joints_are_these_and_no_masses() {
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, _, rigid)| {
        let friction = 5.0 * sign(velocity);
        match joint {
            0..3 => 0.4 * rigid + 1.4 * friction,
            _ => friction,
        }
    });
    for joint in 0..3 {
        let relative = number(&diagnosis, "torque_constant", joint, "relative");
        assert!(
            (relative - 0.4).abs() < 0.05,
            "joint {}: {relative}",
            joint + 1
        );
    }
    let masses = ["payload_error", "link_mass", "link_com", "link_inertia"];
    let mut effects = diagnosis.findings.iter().map(|finding| &*finding.effect);
    assert!(
        effects.all(|effect| !masses.contains(&effect)),
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
    let all = found(&diagnosed_with(&|(joint, _, angle, velocity, ..)| {
        let spring = if joint == 1 { spring(angle) } else { 0.0 };
        4.0 * velocity + 5.0 * sign(velocity) + spring
    }));
    assert!(
        all.contains(&"spring_balance joint 2".to_string()),
        "{all:?}"
    );
}

#[test]
fn torques_that_come_later_than_is_looked_for_get_no_latency() {
    let late = |seconds: f64| {
        let diagnosis = diagnosed(&record(&arm(), seconds, &|row| 5.0 * sign(row.3)));
        found(&diagnosis).contains(&format!("{LATENCY} recording"))
    };
    assert!(late(0.02) && !late(0.09));
}

#[test]
fn a_number_at_an_end_of_its_search_is_none() {
    let arm = arm();
    let scene = scene(&arm, record(&arm, 0.0, &|_| 0.0).position);
    let form = |name: &str, index: usize, value: f64| -> TorqueForm {
        let mut causes = TORQUE_CAUSES.into_iter();
        let cause = causes.find(|cause| cause.name == name).expect("a cause");
        (cause.forms)(cause, &scene)[0].with_shape(index, value)
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

#[test]
fn held_out_rows_judge_and_choose_nothing() {
    let plain = record(&arm(), 0.0, &|(joint, _, angle, velocity, ..)| {
        5.0 * sign(velocity) + if joint == 3 { 2.0 * angle } else { 0.0 }
    });
    let mut other = plain.clone();
    // From 2 s after the first held-out row on, as filters feel what is near, the spring pushes where it pulled.
    let first = plain.held_out.iter().position(|held| *held).unwrap() + 200;
    for row in first..plain.rows() {
        other.torque[4 * row + 3] -= 4.0 * plain.position[4 * row + 3];
    }
    let [plain, other] = [plain, other].map(|recording| diagnosed(&recording));
    let numbers = |diagnosis: &TorqueDiagnosis| {
        let terms = diagnosis.model.terms.iter();
        let terms = terms.map(|term| (term.effect.clone(), term.coefficients.clone()));
        terms.collect::<Vec<_>>()
    };
    assert!(found(&plain).contains(&"cable_stiffness joint 4".to_string()));
    assert_eq!(found(&plain), found(&other));
    assert_eq!(numbers(&plain), numbers(&other));
    assert!(other.after.rms[3] > 5.0 * plain.after.rms[3]);
}

#[test]
fn one_curve_over_the_angle_of_its_joint_is_one_finding() {
    // Neither a line nor waves: a hump 0.3 rad wide.
    let diagnosis = diagnosed_with(&|(joint, _, angle, velocity, ..)| {
        let hump = 6.0 * libm::exp(-((angle - 0.3) / 0.3).powi(2));
        5.0 * sign(velocity) + if joint == 2 { hump } else { 0.0 }
    });
    let mut at_joint = found(&diagnosis);
    at_joint.retain(|name| name.ends_with("joint 3"));
    assert_eq!(at_joint, ["coulomb_friction joint 3", "unknown joint 3"]);
    let statement = &of_name(&diagnosis, "unknown").statement;
    assert!(
        statement.ends_with("it depends on the angle of the joint"),
        "{statement}"
    );
}

#[test]
fn friction_that_turns_before_the_velocity_is_plain_friction_with_its_lead() {
    const LEAD: f64 = 0.0095;
    // As a solver lets it, rad/s.
    let widths = [0.001, 0.002, 0.006, 0.03];
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, acceleration, _)| {
        let ahead = (velocity + LEAD * acceleration) / widths[joint];
        3.0 * velocity + 8.0 * ahead.clamp(-1.0, 1.0)
    });
    let mut others = found(&diagnosis);
    let common = ["viscous_friction", "coulomb_friction"];
    others.retain(|name| !common.iter().any(|common| name.starts_with(common)));
    let lead = diagnosis.model.friction_lead;
    assert!(
        (lead - LEAD).abs() < 0.001 && others.is_empty(),
        "{lead}: {others:?}"
    );
}

// Causes whose law has other numbers or another curve than the usual one: one name each, and numbers that say how certain they are.

/// Value and standard deviation of a parameter of the only finding of a name.
fn stated(diagnosis: &TorqueDiagnosis, effect: &str, name: &str) -> (f64, f64) {
    let parameter = parameter(of_name(diagnosis, effect), name);
    (parameter.value, parameter.sigma.unwrap())
}

fn covers((value, sigma): (f64, f64), truth: f64) -> bool {
    sigma > 0.0 && (value - truth).abs() < 3.0 * sigma
}

#[test]
fn a_zero_that_drifts_is_an_offset_and_nothing_else() {
    let drifting = diagnosed_with(&|row| match row.0 {
        3 => 3.0 * (1.0 - 0.5 * (-row.1 / 10.0).exp()),
        _ => 0.0,
    });
    assert_eq!(found(&drifting), ["current_offset joint 4"]);
    assert!(
        covers(stated(&drifting, "current_offset", "offset"), 3.0)
            && covers(stated(&drifting, "current_offset", "time"), 10.0)
    );
}

#[test]
fn the_speed_over_which_friction_falls_is_as_uncertain_as_it_is_said_to_be_and_all_numbers_know_of_it()
 {
    let diagnosis = diagnosed_with(&|(joint, _, _, velocity, ..)| {
        let sign = (velocity / 0.01).tanh();
        let falls = if joint == 2 {
            2.0 * sign * (-velocity.abs() / 0.1).exp()
        } else {
            0.0
        };
        2.0 * velocity + 3.0 * sign + falls
    });
    assert!(
        covers(stated(&diagnosis, "stribeck_friction", "speed"), 0.1),
        "{:#?}",
        diagnosis.findings
    );
    assert!(covers(
        stated(&diagnosis, "stribeck_friction", "stribeck"),
        2.0
    ));
    let names = diagnosis.model.names().unwrap();
    let width = names.len();
    assert_eq!(diagnosis.model.covariance.len(), width * width);
    let sigma = |name: &str| {
        let place = names.iter().position(|(known, _)| known == name).unwrap();
        diagnosis.model.covariance[place * (width + 1)].sqrt()
    };
    assert!(
        covers(
            (diagnosis.model.sign_width, sigma("recording.sign_width")),
            0.01
        ),
        "{}",
        diagnosis.model.sign_width
    );
    assert_eq!(
        sigma("stribeck_friction.j3.speed"),
        stated(&diagnosis, "stribeck_friction", "speed").1
    );
}
