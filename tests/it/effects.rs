//! The laws that every effect obeys: zero parameters are the nominal robot, partials are derivatives, order is irrelevant.

use crate::fixture;
use calib::effect::{Effect, EffectContext, EffectStack, Load, ParameterSpec, identified};
use calib::robot::{LoadCorrection, Measurements, PointReadings, Posture, RobotModel};
use calib::spatial::{Pose, Twist};
use calib::units::Unit;
use nalgebra::Vector3;

fn setting(load: Load) -> EffectContext {
    EffectContext {
        base: Pose::exp(&Twist::new(3.0, -1.0, 0.5, 0.1, -0.2, 2.0)),
        load,
    }
}

fn data(robot: &RobotModel, rows: usize) -> Measurements {
    let n = robot.joints();
    Measurements {
        joints: n,
        q: fixture::poses(robot.description(), rows),
        points: PointReadings::new(vec![Vector3::zeros(); rows], 1e-5),
        payload: (0..rows)
            .map(|row| if row % 2 == 0 { 0.0 } else { 10.0 })
            .collect(),
        current: Some(
            (0..rows * n)
                .map(|k| 5.0 * fixture::spread(k, 3) - 2.0)
                .collect(),
        ),
        ..Measurements::default()
    }
}

fn all_effects(load: Load) -> Vec<Box<dyn Effect>> {
    identified()
        .filter_map(|cause| cause.arm_effect(&setting(load)))
        .collect()
}

/// A plausible value of each parameter, of either sign: a hundredth of its prior sigma, and a stiff gear for compliances.
fn values(stack: &EffectStack) -> Vec<f64> {
    let largest = |spec: &ParameterSpec| match spec.unit {
        Unit::RadianPerNewtonMetre => 1e-6,
        _ => 0.02 * spec.tolerance.min(0.05),
    };
    stack
        .specs()
        .iter()
        .enumerate()
        .map(|(k, spec)| (fixture::spread(k, 1) - 0.5) * largest(spec))
        .collect()
}

#[test]
fn zero_parameters_are_the_nominal_robot() {
    for description in fixture::all() {
        let robot = RobotModel::new(description);
        let data = data(&robot, 20);
        for effect in all_effects(Load::GravityTorque) {
            let setting = setting(Load::GravityTorque);
            let name = effect.name().to_string();
            let stack = EffectStack::new(&robot, setting.base, vec![effect]);
            let zeros = vec![0.0; stack.specs().len()];
            let mut scratch = stack.scratch(&robot);
            for row in 0..data.rows() {
                let nominal = setting.base.point(&robot.forward(data.q(row)).translation);
                let point = stack.point(&robot, &data, row, &zeros, &mut scratch);
                assert!(
                    (point - nominal).norm() < 1e-12,
                    "{name} moves {} without a parameter",
                    robot.description().name
                );
            }
        }
    }
}

#[test]
fn partials_are_central_differences() {
    for (description, load) in fixture::all()
        .into_iter()
        .flat_map(|d| [(d.clone(), Load::GravityTorque), (d, Load::MotorCurrent)])
    {
        let robot = RobotModel::new(description);
        let data = data(&robot, 6);
        let stack = EffectStack::new(&robot, setting(load).base, all_effects(load));
        let x = values(&stack);
        let mut scratch = stack.scratch(&robot);
        for row in 0..data.rows() {
            let mut partials = vec![Vector3::zeros(); x.len()];
            stack.derivatives(&robot, &data, row, &x, &mut scratch, |k, d| {
                partials[k] += d
            });
            for (k, spec) in stack.specs().iter().enumerate() {
                let step = if spec.unit == Unit::RadianPerNewtonMetre {
                    1e-8
                } else {
                    1e-4 * spec.tolerance.min(0.1)
                };
                let mut moved = x.clone();
                moved[k] = x[k] + step;
                let plus = stack.point(&robot, &data, row, &moved, &mut scratch);
                moved[k] = x[k] - step;
                let minus = stack.point(&robot, &data, row, &moved, &mut scratch);
                let difference = (plus - minus) / (2.0 * step);
                // Torques move with the deflection: second order, at most a few per mille of a compliance's partial.
                let tolerance = 1e-6
                    + if load == Load::GravityTorque {
                        5e-3
                    } else {
                        1e-7
                    } * difference.norm();
                assert!(
                    (difference - partials[k]).norm() < tolerance,
                    "{} {}: {difference} against {}",
                    robot.description().name,
                    spec.name,
                    partials[k]
                );
            }
        }
    }
}

#[test]
fn the_order_of_effects_is_irrelevant() {
    let robot = RobotModel::new(fixture::spherical());
    let data = data(&robot, 10);
    let load = Load::GravityTorque;
    let forward = EffectStack::new(&robot, setting(load).base, all_effects(load));
    let mut reversed = all_effects(load);
    reversed.reverse();
    let reversed = EffectStack::new(&robot, setting(load).base, reversed);
    let x = values(&forward);
    let y: Vec<f64> = reversed
        .specs()
        .iter()
        .map(|spec| {
            x[forward
                .specs()
                .iter()
                .position(|other| other.name == spec.name)
                .unwrap()]
        })
        .collect();
    let (mut a, mut b) = (forward.scratch(&robot), reversed.scratch(&robot));
    for row in 0..data.rows() {
        let difference = forward.point(&robot, &data, row, &x, &mut a)
            - reversed.point(&robot, &data, row, &y, &mut b);
        assert!(difference.norm() < 1e-13);
    }
}

#[test]
fn gravity_torque_of_a_horizontal_arm_is_weight_times_lever() {
    let robot = RobotModel::new(fixture::offset_wrist());
    let mut posture = Posture::new(6);
    posture.gravity_torques(&robot, 10.0, &LoadCorrection::new(6));
    let torque = &posture.torque;
    // Joint 2 turns about -y through x = 0; bodies 2..6 and the payload hang at their x.
    let bodies = [
        (12.7, -0.306),
        (4.3, -0.89815),
        (2.0, -1.1843),
        (2.0, -1.1843),
        (0.4, -1.1843),
        (10.0, -1.1343),
    ];
    let expected: f64 = bodies.iter().map(|(mass, x)| mass * 9.81 * x).sum();
    assert!(
        (torque[1].abs() - expected.abs()).abs() < 1e-9,
        "{} against {expected}",
        torque[1]
    );
    // The joint turns where gravity pulls: a small step along the torque lowers the tool.
    let mut lower = vec![0.0; 6];
    lower[1] = 1e-3 * torque[1].signum();
    assert!(robot.forward(&lower).translation.z < robot.forward(&[0.0; 6]).translation.z);
    assert!(
        torque[0].abs() < 1e-12,
        "gravity has no moment about a vertical axis"
    );
}
