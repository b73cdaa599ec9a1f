//! Where targets and anchors are, as a start: targets by the median of the rows, or as stated; anchors as kinds place them.

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
    let aimed = |robot: RobotModel, targets| {
        let anchors = Vec::new();
        robot.measured_by(MeasurementSetup { targets, anchors })
    };
    let mut robot = aimed(robot, names.iter().map(target).collect());
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
        robot = aimed(robot, targets);
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
    nearest_rotation(sum)
}

fn nearest_rotation(matrix: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v_t) = svd.u.zip(svd.v_t)?;
    let mut sign = Matrix3::identity();
    // Without this a mirrored solution could win.
    sign[(2, 2)] = (u * v_t).determinant().signum();
    Some(u * sign * v_t)
}

/// Rows farther off than this many medians take no part in the alignment.
const TRIM: f64 = 4.0;
/// Triples tried: with 40 % of the points wrong, all of them are spoilt once in a million recordings.
const TRIPLES: usize = 60;
/// Points that judge a triple.
const JUDGES: usize = 500;

/// Returns the pose of the base in the tracker's frame, from whole points in `rows`; of fewer than three as another kind of measurement
/// has it, else the identity.
pub fn align(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Pose {
    let all = rows;
    let rows: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| data.has_point(*row))
        .collect();
    if rows.len() < 3 {
        return KINDS
            .iter()
            .find_map(|kind| kind.base(robot, data, all))
            .unwrap_or_else(Pose::identity);
    }
    let target = |row: &usize| robot.last_body(data.q(*row)) * *robot.mounting_at(data, *row);
    let model: Vec<Vector3<f64>> = rows.iter().map(|row| target(row).translation).collect();
    let measured: Vec<Vector3<f64>> = rows.iter().filter_map(|row| data.point(*row)).collect();
    align_points(&model, &measured)
}

/// Returns the pose that brings `model` to `measured`, wrong points aside; three points or more.
pub fn align_points(model: &[Vector3<f64>], measured: &[Vector3<f64>]) -> Pose {
    let mut used: Vec<usize> = Vec::new();
    let mut pose = best_start(model, measured);
    for _ in 0..10 {
        let errors: Vec<f64> = model
            .iter()
            .zip(measured)
            .map(|(a, b)| (pose.point(a) - b).norm())
            .collect();
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = TRIM * sorted[sorted.len() / 2];
        let next: Vec<usize> = (0..model.len()).filter(|i| errors[*i] <= limit).collect();
        if next == used {
            break;
        }
        used = next;
        pose = kabsch(model, measured, &used);
    }
    pose
}

/// The pose of all points or of three, whichever leaves the smallest median error.
fn best_start(model: &[Vector3<f64>], measured: &[Vector3<f64>]) -> Pose {
    let n = model.len();
    let all: Vec<usize> = (0..n).collect();
    let judges: Vec<usize> = (0..n).step_by(n.div_ceil(JUDGES)).collect();
    let median = |pose: &Pose| {
        let mut errors: Vec<f64> = judges
            .iter()
            .map(|i| (pose.point(&model[*i]) - measured[*i]).norm())
            .collect();
        nearest(&mut errors, 0.5).unwrap_or(f64::INFINITY)
    };
    // Spread evenly over the recording by the golden ratio's multiples: no two of a triple are neighbours.
    let at = |share: f64| ((share.fract() * n as f64) as usize).min(n - 1);
    let triples = (0..TRIPLES).map(|k| {
        let share = k as f64 * 0.618_033_988_75;
        vec![at(share), at(share * 1.3 + 0.37), at(share * 1.7 + 0.71)]
    });
    let mut best = (f64::INFINITY, Pose::identity());
    for set in std::iter::once(all).chain(triples) {
        let pose = kabsch(model, measured, &set);
        let error = median(&pose);
        if error < best.0 {
            best = (error, pose);
        }
    }
    best.1
}

pub(super) fn kabsch(from: &[Vector3<f64>], to: &[Vector3<f64>], used: &[usize]) -> Pose {
    let count = used.len() as f64;
    let centre =
        |points: &[Vector3<f64>]| used.iter().map(|i| points[*i]).sum::<Vector3<f64>>() / count;
    let (a, b) = (centre(from), centre(to));
    let covariance: Matrix3<f64> = used
        .iter()
        .map(|i| (to[*i] - b) * (from[*i] - a).transpose())
        .sum();
    nearest_rotation(covariance).map_or_else(Pose::identity, |rotation| {
        Pose::new(rotation, b - rotation * a)
    })
}
