//! What tests share: four kinematics as plain data, fits, and what a diagnosis is asked.

use calib::description::{Coupling, JointDescription, JointKind, RobotDescription};
use calib::diagnose::{Diagnosis, Question, diagnose};
use calib::estimate::{Fitted, Model, fit, gauge};
use calib::robot::import::{RobotFileText, read_calib};
use calib::robot::{Measurements, RobotModel};
use std::collections::BTreeMap;

/// Axis, point (mm), kind per joint.
type Chain<'a> = &'a [([f64; 3], [f64; 3], JointKind)];

fn robot(name: &str, chain: Chain, tool_mm: [f64; 3], masses: &[f64]) -> RobotDescription {
    let metres = |point: [f64; 3]| point.map(|value| value * 1e-3);
    let joints = chain
        .iter()
        .enumerate()
        .map(|(j, (axis, point, kind))| {
            let next = chain.get(j + 1).map_or(tool_mm, |(_, point, _)| *point);
            let centre = [0, 1, 2].map(|k| 0.5e-3 * (point[k] + next[k]));
            JointDescription {
                name: format!("J{}", j + 1),
                kind: *kind,
                axis: *axis,
                point: metres(*point),
                limits: Some(if *kind == JointKind::Revolute {
                    [-2.5, 2.5]
                } else {
                    [0.0, 3.0]
                }),
                reduction_ratio: Some(100.0),
                motor_constant: Some(1.0),
                mass: Some(masses[j]),
                centre: Some(centre),
                coulomb: None,
            }
        })
        .collect();
    RobotDescription {
        name: name.into(),
        joints,
        tool: metres(tool_mm),
        tool_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        couplings: Vec::new(),
        payload_mass: 10.0,
        payload_centre: metres([tool_mm[0] + 50.0, tool_mm[1], tool_mm[2] + 30.0]),
        gravity: [0.0, 0.0, -9.81],
        inertias: Default::default(),
        tolerances: Default::default(),
    }
}

const R: JointKind = JointKind::Revolute;
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const NEG_Y: [f64; 3] = [0.0, -1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// A heavy 6R arm with a spherical wrist, joint 6 coupled to joint 5.
pub fn spherical() -> RobotDescription {
    let chain = [
        (Z, [0.0, 0.0, 0.0], R),
        (NEG_Y, [312.0, 0.0, 0.0], R),
        (NEG_Y, [312.0, 0.0, 1075.0], R),
        (X, [0.0, 0.0, 1310.0], R),
        (NEG_Y, [1594.0, 0.0, 1310.0], R),
        (X, [0.0, 0.0, 1310.0], R),
    ];
    let mut out = robot(
        "spherical",
        &chain,
        [1954.0, 60.0, 1400.0],
        &[350.0, 310.0, 230.0, 90.0, 45.0, 15.0],
    );
    out.couplings = vec![Coupling {
        moved: 5,
        by: 4,
        ratio: 0.02,
    }];
    out
}

/// A small 6R arm with an offset wrist and three parallel axes.
pub fn offset_wrist() -> RobotDescription {
    let chain = [
        (Z, [0.0, 0.0, 0.0], R),
        (NEG_Y, [0.0, 0.0, 127.3], R),
        (NEG_Y, [-612.0, 0.0, 127.3], R),
        (NEG_Y, [-1184.3, 0.0, 127.3], R),
        ([0.0, 0.0, -1.0], [-1184.3, -163.9, 127.3], R),
        (NEG_Y, [-1184.3, -163.9, 11.6], R),
    ];
    robot(
        "offset wrist",
        &chain,
        [-1184.3, -340.0, -40.0],
        &[7.1, 12.7, 4.3, 2.0, 2.0, 0.4],
    )
}

/// A 7R arm with alternating axes.
pub fn seven() -> RobotDescription {
    let chain = [
        (Z, [0.0, 0.0, 0.0], R),
        (Y, [0.0, 0.0, 340.0], R),
        (Z, [0.0, 0.0, 340.0], R),
        (NEG_Y, [0.0, 0.0, 740.0], R),
        (Z, [0.0, 0.0, 740.0], R),
        (Y, [0.0, 0.0, 1140.0], R),
        (Z, [0.0, 0.0, 1140.0], R),
    ];
    robot(
        "seven",
        &chain,
        [70.0, 30.0, 1300.0],
        &[6.0, 6.0, 4.0, 4.0, 2.0, 2.0, 0.5],
    )
}

/// The offset-wrist arm on a linear track.
pub fn on_track() -> RobotDescription {
    let mut out = offset_wrist();
    let mut track = out.joints[0].clone();
    track.kind = JointKind::Prismatic;
    track.axis = X;
    track.point = [0.0, 0.0, -0.5];
    track.limits = Some([0.0, 3.0]);
    track.mass = Some(80.0);
    track.centre = Some([0.0, 0.0, -0.3]);
    out.joints.insert(0, track);
    out.name = "on track".into();
    out
}

pub fn all() -> Vec<RobotDescription> {
    vec![spherical(), offset_wrist(), seven(), on_track()]
}

/// A fixed sequence of numbers in [0, 1): additive recurrence, evenly spread in every dimension.
pub fn spread(index: usize, dimension: usize) -> f64 {
    const ROOTS: [f64; 8] = [
        0.754_877_666,
        0.569_840_291,
        0.819_172_513,
        0.671_043_607,
        0.549_700_478,
        0.856_674_884,
        0.733_891_857,
        0.628_706_721,
    ];
    (0.5 + (index + 1) as f64 * ROOTS[dimension % 8] + dimension as f64 * 0.137).fract()
}

/// `count` joint positions evenly within the limits, row-major.
pub fn poses(robot: &RobotDescription, count: usize) -> Vec<f64> {
    let n = robot.joints.len();
    (0..count * n)
        .map(|k| {
            let [lower, upper] = robot.joints[k % n].limits.unwrap_or([-2.5, 2.5]);
            lower + (upper - lower) * spread(k / n, k % n)
        })
        .collect()
}

/// The robot of a file in calib's format.
pub fn robot_of(text: &str) -> RobotDescription {
    let label = "robot.yaml";
    read_calib(RobotFileText { label, text }, None)
        .unwrap()
        .robot
}

/// Fits all parameters of a model to rows.
pub fn fit_all(start: &Model, data: &Measurements, rows: &[usize]) -> (Model, Fitted) {
    let candidates: Vec<usize> = (0..start.x.len()).collect();
    let candidates = &candidates;
    fit(start, data, rows, candidates)
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, count), value| {
        (sum + value * value, count + 1.0)
    });
    f64::sqrt(sum / count)
}

/// The largest of sizes.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// The largest difference of two lists.
pub fn apart(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    largest(one.iter().zip(other).map(|(a, b)| (a - b).abs()))
}

/// How far each predicted point is from those of the rows, m.
pub fn misses(model: &Model, data: &Measurements) -> Vec<f64> {
    let pairs = model.predict(data).into_iter().zip(&data.points.position);
    pairs.map(|(a, b)| (a - b).norm()).collect()
}

pub fn all_rows(data: &Measurements) -> Vec<usize> {
    (0..data.rows()).collect()
}

/// What a diagnosis is asked of rows to fit that are one set, with nothing held out.
pub fn question<'a>(
    robot: &'a RobotModel,
    data: &'a Measurements,
    fit: &'a [usize],
) -> Question<'a> {
    static ONE_SET: [usize; 10_000] = [0; 10_000];
    Question {
        robot,
        data,
        fit,
        validate: &[],
        set: &ONE_SET[..data.rows()],
        prior_weight: 1.0,
        open_world: 0.3,
        without: &[],
        declared: &[],
        beside_simulation: false,
        known: &[],
        seed: 1,
    }
}

/// What a diagnosis of all rows says of an arm.
pub fn diagnosed(arm: &RobotDescription, data: &Measurements) -> Diagnosis {
    let all = all_rows(data);
    let arm = RobotModel::new(arm.clone());
    let (robot, _) = gauge(arm, data, &all, &BTreeMap::new()).unwrap();
    diagnose(&question(&robot, data, &all), |_| ())
}
