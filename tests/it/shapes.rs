//! Numbers of shapes stay within what can be meant, however often a search refines them.

use crate::fixture;
use calib::effect::{CAUSES, Form, Survey};
use calib::robot::{Measurements, PointReadings, RobotModel};
use nalgebra::Vector3;
use serde_json::Value;

/// Every number of a form under this name.
fn numbers(form: &Value, name: &str, out: &mut Vec<f64>) {
    match form {
        Value::Object(fields) => fields.iter().for_each(|(key, value)| match value.as_f64() {
            Some(number) if key == name => out.push(number),
            _ => numbers(value, name, out),
        }),
        Value::Array(items) => items.iter().for_each(|item| numbers(item, name, out)),
        _ => (),
    }
}

#[test]
fn refinement_never_leaves_the_bounds_of_a_shape() {
    const ROWS: usize = 60;
    let robot = RobotModel::new(fixture::spherical());
    let n = robot.joints();
    let data = Measurements {
        joints: n,
        q: fixture::poses(robot.description(), ROWS),
        points: PointReadings::new(vec![Vector3::zeros(); ROWS], 1e-5),
        payload: vec![0.0; ROWS],
        time: Some((0..ROWS).map(|row| 100.0 + 10.0 * row as f64).collect()),
        ..Measurements::default()
    };
    let rows: Vec<usize> = (0..ROWS).collect();
    let torque: Vec<f64> = (0..ROWS * n)
        .map(|k| 600.0 * (fixture::spread(k, 2) - 0.5))
        .collect();
    let compliance = vec![0.0; n];
    let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
    // 590 s were recorded, no joint carries more than 300 Nm.
    let bounds = [
        ("constant", 0.02 * 590.0, 10.0 * 590.0),
        ("at_nm", 0.009 * 300.0, 10.0 * 300.0),
        ("friction_nm", 1e-3 * 290.0, 1.5 * 300.0),
        ("exponent", 0.2, 6.0),
        ("below", 0.0, 3.0),
    ];
    let mut seen = vec![0; bounds.len()];
    for hypothesis in CAUSES.iter().flat_map(|cause| cause.propose(&survey)) {
        for pick in [<[Form]>::first, <[Form]>::last] {
            let mut form = hypothesis.form.clone();
            for _ in 0..60 {
                let near = form.near(&survey, 0);
                let Some(next) = pick(&near) else { break };
                form = next.clone();
            }
            let text = serde_json::to_value(&form).unwrap();
            for ((name, low, high), seen) in bounds.iter().zip(&mut seen) {
                let mut found = Vec::new();
                numbers(&text, name, &mut found);
                *seen += found.len();
                for number in found {
                    assert!(
                        (*low * (1.0 - 1e-12)..=*high * (1.0 + 1e-12)).contains(&number.abs()),
                        "{name} of {text}"
                    );
                }
            }
        }
    }
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}
