//! Where targets and anchors are, as a start: targets by the median of the rows, or as stated; anchors as kinds place them.

use super::align::align;
use crate::observation::{KINDS, kinds};
use crate::robot::{Anchor, MeasurementSetup, Measurements, RobotModel, Target};
use crate::spatial::Pose;
use crate::statistics::nearest;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Rounds of placing the base by the targets and the targets by the base.
const ROUNDS: usize = 8;

/// The robot with the targets and anchors of the recording, and the pose of its base.
///
/// `stated` are places of targets (m, from the tool point in the axes of the tool frame). Fails with a sentence where distances
/// are too few to place an anchor.
pub fn gauge(
    robot: RobotModel,
    data: &Measurements,
    rows: &[usize],
    stated: &BTreeMap<String, Vector3<f64>>,
) -> Result<(RobotModel, Pose), String> {
    let home = *robot.home();
    let names: &[String] = match &data.target {
        Some(named) => &named.names,
        None if kinds(data).iter().any(|kind| kind.about().rank.rotations) => &[String::new()],
        None => &[],
    };
    let target = |name: &String| {
        let offset = stated.get(name).copied().unwrap_or_else(Vector3::zeros);
        Target {
            name: name.clone(),
            mounting: Pose::new(home.rotation, home.point(&offset)),
            oriented: false,
        }
    };
    let mut robot = robot.measured_by(MeasurementSetup {
        targets: names.iter().map(target).collect(),
        anchors: Vec::new(),
    });
    let open = |target: &Target| !target.name.is_empty() && !stated.contains_key(&target.name);
    let mut base = align(&robot, data, rows);
    for _ in 0..ROUNDS {
        if !robot.setup().targets.iter().any(open) {
            break;
        }
        let place = |target: &Target| match seen_at(&robot, data, rows, &base, target)
            .filter(|_| open(target))
        {
            Some(point) => Target {
                mounting: Pose::new(target.mounting.rotation, point),
                ..target.clone()
            },
            None => target.clone(),
        };
        let targets = robot.setup().targets.iter().map(place).collect();
        robot = robot.measured_by(MeasurementSetup {
            targets,
            anchors: Vec::new(),
        });
        base = align(&robot, data, rows);
    }
    let turned = |target: &Target| match rotation_of(&robot, data, rows, &base, target) {
        Some(rotation) => Target {
            mounting: Pose::new(rotation, target.mounting.translation),
            oriented: true,
            ..target.clone()
        },
        None => target.clone(),
    };
    let targets = robot.setup().targets.iter().map(turned).collect();
    let anchors: Vec<Anchor> = KINDS
        .iter()
        .map(|kind| kind.anchors(&robot, data, rows, &base))
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    if let Some(twice) = (1..anchors.len()).find(|k| {
        anchors[..*k]
            .iter()
            .any(|other| other.name == anchors[*k].name)
    }) {
        return Err(format!(
            "`{}` names things of two kinds; give each a name of its own",
            anchors[twice].name
        ));
    }
    Ok((
        robot.measured_by(MeasurementSetup { targets, anchors }),
        base,
    ))
}

/// Whole points of a target, zero pose, base frame: their median by axis.
fn seen_at(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
    base: &Pose,
    target: &Target,
) -> Option<Vector3<f64>> {
    let rows_of_target = rows.iter().filter(|row| data.target(**row) == target.name);
    let points: Vec<Vector3<f64>> = rows_of_target
        .filter_map(|row| {
            Some((*base * robot.last_body(data.q(*row))).inverse_point(&data.point(*row)?))
        })
        .collect();
    let median = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        nearest(&mut values, 0.5)
    };
    Some(Vector3::new(median(0)?, median(1)?, median(2)?))
}

/// Orientation of a target at the zero pose, base frame: the rotation nearest to the sum over its rows (Markley).
fn rotation_of(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
    base: &Pose,
    target: &Target,
) -> Option<Matrix3<f64>> {
    let rows_of_target = rows.iter().filter(|row| data.target(**row) == target.name);
    let attitudes = rows_of_target.flat_map(|row| {
        let body = base.rotation * robot.last_body(data.q(*row)).rotation;
        KINDS
            .iter()
            .filter_map(move |kind| kind.attitude(data, *row, &body))
    });
    let sum = attitudes.reduce(|sum, next| sum + next)?;
    let svd = sum.svd(true, true);
    let (u, v_t) = svd.u.zip(svd.v_t)?;
    let mut sign = Matrix3::identity();
    sign[(2, 2)] = (u * v_t).determinant().signum();
    Some(u * sign * v_t)
}
