//! A line of blocks for each cause: how the measured point moves while a joint sweeps.

use crate::fixture;
use calib::effect::{CAUSES, Effect, EffectContext, EffectStack, Form, Load, Place, Survey, arm_effect};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use nalgebra::Vector3;
use std::collections::BTreeMap;

const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
const ROWS: usize = 120;
const SWEEP: usize = 40;
/// The joint that sweeps where the cause has none of its own, from 0.
const JOINT: usize = 1;
/// m; what moves the point by less is no picture.
const SMALL: f64 = 1e-12;

fn setting() -> EffectContext {
    EffectContext { base: Pose::exp(&Twist::new(9.0, -1.0, 0.5, 0.1, -0.2, 2.0)), load: Load::GravityTorque }
}

/// A recording with every column that a hypothesis may ask for.
fn recorded(robot: &RobotModel) -> Measurements {
    let n = robot.joints();
    let spread = |salt: usize| (0..ROWS * n).map(move |k| fixture::spread(k, salt) - 0.5);
    let q = fixture::poses(robot.description(), ROWS);
    Measurements {
        joints: n,
        points: PointReadings::new(q.chunks(n).map(|q| setting().base.point(&robot.forward(q).translation)).collect(), 1e-5),
        q,
        payload: (0..ROWS).map(|row| [0.0, 10.0][row % 2]).collect(),
        current: Some(spread(3).map(|value| 5.0 * value).collect()),
        direction: Some(spread(5).map(f64::signum).collect()),
        velocity: Some(spread(7).collect()),
        temperature: Some((0..ROWS).map(|row| 20.0 + 0.1 * row as f64).collect()),
        time: Some((0..ROWS).map(|row| 12.0 * row as f64).collect()),
        ..Measurements::default()
    }
}

/// One joint from end to end; the others stand at a posture that gravity loads.
fn sweep(robot: &RobotModel, joint: usize) -> Measurements {
    let n = robot.joints();
    let share = |row: usize| row as f64 / (SWEEP - 1) as f64;
    let still = [0.4, 0.5, -0.6, 0.7, 0.8, 0.3];
    let [low, high] = robot.description().joints[joint].limits.unwrap_or([-2.5, 2.5]);
    let q: Vec<f64> = (0..SWEEP * n)
        .map(|k| if k % n == joint { low + (high - low) * share(k / n) } else { still[k % n % still.len()] })
        .collect();
    let own = |each: &dyn Fn(usize) -> f64| (0..SWEEP * n).map(|k| if k % n == joint { each(k / n) } else { 0.0 }).collect();
    Measurements {
        joints: n,
        points: PointReadings::new(q.chunks(n).map(|q| setting().base.point(&robot.forward(q).translation)).collect(), 1e-5),
        q,
        payload: vec![10.0; SWEEP],
        current: Some(vec![1.0; SWEEP * n]),
        direction: Some(own(&|row| if 2 * row < SWEEP { 1.0 } else { -1.0 })),
        velocity: Some(own(&|row| (std::f64::consts::PI * share(row)).sin())),
        temperature: Some((0..SWEEP).map(|row| 20.0 + 0.1 * ROWS as f64 * share(row)).collect()),
        time: Some((0..SWEEP).map(|row| 12.0 * ROWS as f64 * share(row)).collect()),
        ..Measurements::default()
    }
}

/// Cause -> what is drawn (`joint 2`), and the line.
pub fn signatures() -> BTreeMap<&'static str, (String, String)> {
    let robot = RobotModel::new(fixture::spherical());
    let data = recorded(&robot);
    let rows: Vec<usize> = (0..ROWS).collect();
    let torque = vec![100.0; ROWS * robot.joints()];
    let compliance = vec![2e-7; robot.joints()];
    let survey = Survey::new(&robot, &data, &rows, &torque, &compliance);
    let drawn = CAUSES.iter().filter_map(|cause| {
        let forms: Vec<Form> = cause.propose(&survey).into_iter().map(|hypothesis| hypothesis.form).collect();
        let chosen = forms.iter().find(|form| form.place() == Place::Joint(JOINT)).or(forms.first());
        let effect: Box<dyn Effect> = match chosen {
            Some(form) => Box::new(form.clone()),
            None => cause.arm_effect(&setting())?,
        };
        let place = chosen.map_or(Place::Joint(JOINT), |form| form.place());
        Some((cause.name(), (place.to_string(), line(&robot, effect, place)?)))
    });
    drawn.collect()
}

/// The direction in which the point moves as a joint does, tracker's frame.
fn path(robot: &RobotModel, q: &[f64], joint: usize) -> Vector3<f64> {
    const STEP: f64 = 1e-6;
    let mut further = q.to_vec();
    further[joint] += STEP;
    let step = robot.forward(&further).translation - robot.forward(q).translation;
    setting().base.rotation * step.try_normalize(0.0).unwrap_or_else(Vector3::zeros)
}

/// The motion of the point by the first number of an effect at the place, along its main direction.
fn line(robot: &RobotModel, effect: Box<dyn Effect>, place: Place) -> Option<String> {
    let joint = match place {
        Place::Joint(joint) => joint,
        _ => JOINT,
    };
    let data = sweep(robot, joint);
    let base = setting().base;
    // Errors of the torque model move nothing but through joints that yield.
    let yields = arm_effect("joint_compliance", &setting()).expect("a cause");
    let alone = effect.name() == yields.name();
    let stack = EffectStack::new(robot, base, if alone { vec![effect] } else { vec![yields, effect] });
    let specs = stack.specs();
    let own = |k: &usize| alone || !specs[*k].name.starts_with("joint_compliance");
    let number = (0..specs.len()).filter(own).find(|k| specs[*k].place == place).or_else(|| (0..specs.len()).find(own))?;
    let none: Vec<f64> = specs.iter().enumerate().map(|(k, _)| if own(&k) { 0.0 } else { 2e-7 }).collect();
    let mut some = none.clone();
    some[number] = 1e-3 * specs[number].prior_sigma.min(1.0);
    let mut scratch = stack.scratch(robot);
    let moved: Vec<Vector3<f64>> = (0..SWEEP)
        .map(|row| stack.point(robot, &data, row, &some, &mut scratch) - stack.point(robot, &data, row, &none, &mut scratch))
        .collect();
    let main = *moved.iter().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let size = main.norm();
    if size < SMALL {
        return None;
    }
    // A turn of a joint moves the point along its own path, whose direction changes with the arm.
    let turned: Vec<f64> = (0..SWEEP).map(|row| moved[row].dot(&path(robot, data.q(row), joint))).collect();
    let along = matches!(place, Place::Joint(_)) && turned.iter().any(|part| part.abs() > 0.5 * size);
    let signed: Vec<f64> = if along { turned } else { moved.iter().map(|one| one.dot(&main) / size).collect() };
    let low = signed.iter().copied().fold(0.0, f64::min);
    let high = signed.iter().copied().fold(0.0, f64::max);
    let block = |value: f64| BLOCKS[(((value - low) / (high - low) * 7.0).round() as usize).min(7)];
    Some(signed.into_iter().map(block).collect())
}
