//! Causes whose law has other numbers or another curve than the usual one: one name each, and numbers that say how certain they are.

use super::cases::{arm, found, record};
use super::*;

fn diagnosed(extra: &dyn Fn((usize, f64, f64, f64, f64, f64)) -> f64) -> TorqueDiagnosis {
    diagnose(
        &arm(),
        &record(&arm(), 0.0, extra),
        &TorqueQuestion::default(),
        &mut |_| (),
    )
    .unwrap()
}

/// Value and standard deviation of a parameter of the only finding of a name.
fn stated(diagnosis: &TorqueDiagnosis, effect: &str, name: &str) -> (f64, f64) {
    let finding = diagnosis
        .findings
        .iter()
        .find(|finding| finding.effect == effect)
        .unwrap();
    let parameter = finding
        .parameters
        .iter()
        .find(|parameter| parameter.name == name)
        .unwrap();
    (parameter.value, parameter.sigma.unwrap())
}

fn covers((value, sigma): (f64, f64), truth: f64) -> bool {
    sigma > 0.0 && (value - truth).abs() < 3.0 * sigma
}

#[test]
fn a_zero_that_drifts_is_an_offset_and_nothing_else() {
    let drifting = diagnosed(&|row| {
        if row.0 == 3 {
            3.0 * (1.0 - 0.5 * (-row.1 / 10.0).exp())
        } else {
            0.0
        }
    });
    assert_eq!(
        found(&drifting),
        ["current_offset joint 4"],
        "{:#?}",
        drifting.withdrawn
    );
    assert!(
        covers(stated(&drifting, "current_offset", "offset"), 3.0)
            && covers(stated(&drifting, "current_offset", "time"), 10.0)
    );
}

#[test]
fn the_speed_over_which_friction_falls_is_as_uncertain_as_it_is_said_to_be_and_all_numbers_know_of_it()
 {
    let diagnosis = diagnosed(&|(joint, _, _, velocity, ..)| {
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
