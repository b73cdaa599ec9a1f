//! Numbers under tolerances: those of the robot, with honest standard deviations, in a base that does not turn.

use crate::fixture::{all_rows, fit_all, poses, rms, spread};
use calib::description::RobotDescription;
use calib::effect::{Effect, EffectContext, EffectStack, Load, arm_effect};
use calib::estimate::{Determined, Fitted, Model, ParameterStatus, align, beyond_tolerance};
use calib::robot::import::{RobotFileText, read_calib};
use calib::robot::{LibraryArm, Measurements, PointReadings, RobotModel};
use calib::spatial::Pose;
use nalgebra::Vector3;

const GEOMETRY: [&str; 4] = ["base_frame", "tool_offset", "joint_offset", "link_geometry"];
/// m, per axis.
const NOISE: f64 = 10e-6;
const POSES: usize = 100;

/// Standard normal numbers, the same for the same seed.
struct Draw {
    seed: usize,
    drawn: usize,
}

impl Draw {
    fn new(seed: usize) -> Self {
        Self { seed, drawn: 0 }
    }

    fn normal(&mut self) -> f64 {
        self.drawn += 1;
        let unit = |dimension| spread(7919 * self.seed + self.drawn, dimension).max(1e-9);
        (-2.0 * unit(0).ln()).sqrt() * (std::f64::consts::TAU * unit(3)).cos()
    }

    fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| size * self.normal())
    }
}

/// A library arm with a reflector off its last axis.
fn arm(name: &str) -> RobotDescription {
    let mut out = LibraryArm::named(name).unwrap().read().unwrap().robot;
    let axis = Vector3::from(out.joints.last().unwrap().axis);
    let across = axis.cross(&Vector3::new(0.3, 0.5, 0.8)).normalize();
    out.tool = (Vector3::from(out.tool) + 0.08 * axis + 0.1 * across).into();
    out
}

fn nominal(robot: &RobotDescription, base: Pose) -> Model {
    let robot = RobotModel::new(robot.clone());
    let setting = EffectContext {
        base,
        load: Load::GravityTorque,
    };
    let effects = GEOMETRY
        .iter()
        .filter_map(|name| arm_effect(name, &setting));
    let effects: Vec<Box<dyn Effect>> = effects.collect();
    Model::nominal(robot.clone(), EffectStack::new(&robot, base, effects))
}

/// What a tracker measures of an arm whose model is `truth` at poses all over its ranges.
fn measured(truth: &Model, draw: &mut Draw) -> Measurements {
    let joints = truth.robot.joints();
    let mut data = Measurements {
        joints,
        q: poses(truth.robot.description(), POSES),
        points: PointReadings {
            position: vec![Vector3::zeros(); POSES],
            sigma: vec![Vector3::from_element(NOISE); POSES],
        },
        payload: vec![0.0; POSES],
        ..Measurements::default()
    };
    let points = truth.predict(&data).into_iter();
    data.points.position = points.map(|point| point + draw.vector(NOISE)).collect();
    data
}

fn identified(robot: &RobotDescription, data: &Measurements) -> (Model, Fitted) {
    let rows = all_rows(data);
    let base = align(&RobotModel::new(robot.clone()), data, &rows);
    fit_all(&nominal(robot, base), data, &rows)
}

/// Where the tracker stands.
fn away() -> Pose {
    Pose::from_rotation_vector(Vector3::new(0.01, 0.0, 1.1), Vector3::new(1.5, -0.9, 0.2))
}

/// The arm as it was built: every link's length and offset, in all three directions, and its zeros are off, the last one's but for.
fn built(robot: &RobotDescription, draw: &mut Draw) -> (RobotDescription, Vec<f64>) {
    let (mut out, mut moved) = (robot.clone(), Vector3::zeros());
    for joint in out.joints.iter_mut().skip(1) {
        moved += draw.vector(0.3e-3);
        joint.point = (Vector3::from(joint.point) + moved).into();
    }
    out.tool = (Vector3::from(out.tool) + moved + draw.vector(0.3e-3)).into();
    let last = out.joints.len() - 1;
    let zero = |joint: usize| match joint {
        0 => 0.0,
        joint if joint == last => 0.0,
        _ => 0.1f64.to_radians() * draw.normal(),
    };
    (out, (0..=last).map(zero).collect())
}

#[test]
fn zeros_and_base_are_those_of_the_arm_where_the_shoulder_has_an_offset() {
    for (seed, name) in ["kr10_r1100", "gp7", "irb2600_12_165", "tx2_60"]
        .iter()
        .enumerate()
    {
        let robot = arm(name);
        let mut draw = Draw::new(seed + 1);
        let (real, zeros) = built(&robot, &mut draw);
        let real = nominal(&real, away());
        let mut data = measured(&real, &mut draw);
        // The joints of the real arm stand off what is read by its zeros.
        let read = data.q.clone();
        for (k, q) in data.q.iter_mut().enumerate() {
            *q += zeros[k % zeros.len()];
        }
        let points = real.predict(&data).into_iter();
        data.points.position = points.map(|point| point + draw.vector(NOISE)).collect();
        let at_truth = data.q.clone();
        data.q = read;
        let (model, fitted) = identified(&robot, &data);
        let zero = |joint: usize| {
            let name = format!("joint_offset.j{}", joint + 1);
            let mut specs = model.stack.specs().iter();
            specs.position(|spec| spec.name == name).unwrap()
        };
        let between = zeros.iter().enumerate().skip(1).take(zeros.len() - 2);
        for (joint, is) in between {
            let k = zero(joint);
            let ParameterStatus::Free(sigma) = fitted.statuses[k] else {
                panic!("{name}: joint {} is held", joint + 1)
            };
            let off = (model.x[k] - is) / sigma;
            assert!(
                off.abs() < 4.0,
                "{name}: zero {}: {off:.1} sigma",
                joint + 1
            );
        }
        // Points of its own base, as the arm is and as the model has it.
        let own = |model: &Model, q: &[f64]| -> Vec<Vector3<f64>> {
            let base = model.base();
            let data = Measurements {
                q: q.to_vec(),
                ..data.clone()
            };
            let points = model.predict(&data).into_iter();
            points
                .map(|point| base.rotation.tr_mul(&(point - base.translation)))
                .collect()
        };
        let (model_has, is) = (own(&model, &data.q), own(&real, &at_truth));
        let apart = model_has.iter().zip(&is).map(|(a, b)| (a - b).norm());
        let apart = rms(apart) * 1e3;
        // Where the base itself is hangs on the 0.3 mm of each length and zero.
        assert!(apart < 1.0, "{name}: {apart:.2} mm in its own base");
    }
}

#[test]
fn standard_deviations_are_honest_whether_the_data_or_the_tolerances_tell() {
    let (mut squares, mut inside, mut all) = ([0.0; 3], 0, [0usize; 3]);
    for name in ["kr10_r1100", "ur5e", "gp25"] {
        let robot = arm(name);
        for seed in 0..20 {
            let mut draw = Draw::new(100 + seed);
            let mut truth = nominal(&robot, away());
            let base = truth.stack.parameters_of("base_frame").count();
            // Six tenths of what the tolerances allow: 0.3 mm, 0.3 mrad, 0.1 deg.
            for k in base..truth.x.len() {
                truth.x[k] = 0.6 * truth.tolerances[k] * draw.normal();
            }
            let data = measured(&truth, &mut draw);
            let (model, fitted) = identified(&robot, &data);
            for k in base..truth.x.len() {
                let spec = &model.stack.specs()[k];
                let family = match spec.name.as_str() {
                    name if name.starts_with("joint_offset") => 0,
                    name if name.starts_with("link_geometry") && spec.unit.symbol() == "mm" => 1,
                    name if name.starts_with("link_geometry") => 2,
                    _ => continue,
                };
                let ParameterStatus::Free(sigma) = fitted.statuses[k] else {
                    panic!("{} is held", spec.name)
                };
                let z = (model.x[k] - truth.x[k]) / sigma;
                squares[family] += z * z;
                all[family] += 1;
                inside += usize::from(z.abs() < 1.96);
            }
        }
    }
    let share = inside as f64 / all.iter().sum::<usize>() as f64;
    println!("{:.1} % within 1.96 sigma", 100.0 * share);
    for (family, what) in ["zeros", "lengths", "tilts"].into_iter().enumerate() {
        let z = (squares[family] / all[family] as f64).sqrt();
        println!("{what}: {z:.2} sigma rms");
        assert!((0.5..1.2).contains(&z), "{what}: {z:.2} sigma rms");
    }
    assert!((0.93..=0.99).contains(&share), "{:.1} %", 100.0 * share);
}

#[test]
fn what_the_data_do_not_tell_keeps_its_tolerance_and_says_so() {
    let robot = arm("kr10_r1100");
    let mut draw = Draw::new(5);
    let data = measured(&nominal(&robot, away()), &mut draw);
    let (model, fitted) = identified(&robot, &data);
    let position = |name: &str| {
        let mut specs = model.stack.specs().iter();
        specs.position(|spec| spec.name == name).unwrap()
    };
    // The base may turn instead of joint 1.
    let (first, last) = (position("joint_offset.j1"), position("joint_offset.j5"));
    assert_eq!(
        fitted.determined(&model, first),
        Some(Determined::ByTolerance)
    );
    assert_eq!(
        fitted.determined(&model, last),
        Some(Determined::Determined)
    );
    assert!(fitted.undetermined(&model).contains(&first));
    assert!(fitted.singular.len() < fitted.free().len());
}

#[test]
fn a_number_beyond_four_tolerances_is_said_and_does_not_bend_the_others() {
    let robot = arm("irb120");
    let mut real = robot.clone();
    real.tool = (Vector3::from(real.tool) + Vector3::new(0.0, 0.025, 0.0)).into();
    let mut draw = Draw::new(6);
    let data = measured(&nominal(&real, away()), &mut draw);
    let (model, _) = identified(&robot, &data);
    let beyond: Vec<&str> = (0..model.x.len())
        .filter(|k| beyond_tolerance(&model, *k).is_some())
        .map(|k| &*model.stack.specs()[k].name)
        .collect();
    assert_eq!(beyond, ["tool_offset.y"]);
}

#[test]
fn the_robot_file_states_tolerances_with_their_units() {
    let file = |tolerances: &str| {
        let text = format!(
            "calib_robot: 1\nunits: {{length: mm, angle: deg}}\nkinematics:\n  screws:\n    - {{axis: [0, 0, 1], point: [0, 0, 0]}}\n    - {{axis: [0, 1, 0], point: [300, 0, 0]}}\n\
             tool: {{point: [900, 0, 0]}}\ntolerances: {{{tolerances}}}\n"
        );
        let label = "robot.yaml";
        read_calib(RobotFileText { label, text: &text }, None).map(|read| read.robot)
    };
    let robot = file("length: 200 um, zero: 0.1 deg, axis: 2e-4 rad").unwrap();
    let model = nominal(&robot, away());
    let tolerance = |name: &str| {
        let mut specs = model.stack.specs().iter();
        specs.find(|spec| spec.name == name).unwrap().tolerance
    };
    assert!((tolerance("joint_offset.j2") - 0.1f64.to_radians()).abs() < 1e-12);
    assert!((tolerance("link_geometry.l1.x") - 200e-6).abs() < 1e-12);
    assert!((tolerance("link_geometry.l1.rx") - 2e-4).abs() < 1e-12);
    assert!((tolerance("tool_offset.x") - 3e-3).abs() < 1e-12);
}
