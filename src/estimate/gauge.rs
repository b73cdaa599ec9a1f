//! Where targets and anchors are, as a start: targets by the median of the rows, or as stated; anchors by multilateration.

use super::align::align;
use crate::robot::{Anchor, Gauging, Measurements, RobotModel, Target};
use crate::spatial::Pose;
use crate::statistics::nearest;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;

/// Rounds of placing the base by the targets and the targets by the base.
const ROUNDS: usize = 8;
/// Distances that place an anchor.
const FEWEST: usize = 4;

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
        None if data.turn.is_some() => &[String::new()],
        None => &[],
    };
    let seat = |name: &String| {
        let offset = stated.get(name).copied().unwrap_or_else(Vector3::zeros);
        Target { name: name.clone(), seat: Pose::new(home.rotation, home.point(&offset)), oriented: false }
    };
    let mut robot = robot.measured_by(Gauging { targets: names.iter().map(seat).collect(), anchors: Vec::new() });
    let open = |target: &Target| !target.name.is_empty() && !stated.contains_key(&target.name);
    let mut base = align(&robot, data, rows);
    for _ in 0..ROUNDS {
        if !robot.gauging().targets.iter().any(open) {
            break;
        }
        let place = |target: &Target| match seen_at(&robot, data, rows, &base, target).filter(|_| open(target)) {
            Some(point) => Target { seat: Pose::new(target.seat.rotation, point), ..target.clone() },
            None => target.clone(),
        };
        let targets = robot.gauging().targets.iter().map(place).collect();
        robot = robot.measured_by(Gauging { targets, anchors: Vec::new() });
        base = align(&robot, data, rows);
    }
    let turned = |target: &Target| match turn_of(&robot, data, rows, &base, target) {
        Some(rotation) => Target { seat: Pose::new(rotation, target.seat.translation), oriented: true, ..target.clone() },
        None => target.clone(),
    };
    let targets = robot.gauging().targets.iter().map(turned).collect();
    let anchors = anchors(&robot, data, rows, &base)?;
    Ok((robot.measured_by(Gauging { targets, anchors }), base))
}

/// Whole points of a target, zero pose, base frame: their median by axis.
fn seen_at(robot: &RobotModel, data: &Measurements, rows: &[usize], base: &Pose, target: &Target) -> Option<Vector3<f64>> {
    let own = rows.iter().filter(|row| data.whole(**row) && data.target(**row) == target.name);
    let points: Vec<Vector3<f64>> =
        own.map(|row| (*base * robot.last_body(data.q(*row))).inverse_point(&data.position[*row])).collect();
    let median = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        nearest(&mut values, 0.5)
    };
    Some(Vector3::new(median(0)?, median(1)?, median(2)?))
}

/// Orientation of a target at the zero pose, base frame: the rotation nearest to the sum over its rows (Markley).
fn turn_of(robot: &RobotModel, data: &Measurements, rows: &[usize], base: &Pose, target: &Target) -> Option<Matrix3<f64>> {
    let own = rows.iter().filter(|row| data.target(**row) == target.name);
    let turns = own.filter_map(|row| {
        let (rotation, _) = data.turn(*row)?;
        Some((base.rotation * robot.last_body(data.q(*row)).rotation).tr_mul(rotation))
    });
    let sum = turns.reduce(|sum, next| sum + next)?;
    let svd = sum.svd(true, true);
    let (u, v_t) = svd.u.zip(svd.v_t)?;
    let mut sign = Matrix3::identity();
    sign[(2, 2)] = (u * v_t).determinant().signum();
    Some(u * sign * v_t)
}

/// Anchors, each from d2 - p2 = a2 - 2 p a over its rows, linear in a and a2.
fn anchors(robot: &RobotModel, data: &Measurements, rows: &[usize], base: &Pose) -> Result<Vec<Anchor>, String> {
    let mut by_name: BTreeMap<&str, Vec<(Vector3<f64>, f64)>> = BTreeMap::new();
    for row in rows {
        if let Some(distance) = data.distance(*row) {
            let seat = robot.seat(robot.gauging().target(data.target(*row)));
            let point = (*base * robot.last_body(data.q(*row))).point(&seat.translation);
            by_name.entry(distance.anchor).or_default().push((point, distance.length));
        }
    }
    let place = |(name, seen): (&str, Vec<(Vector3<f64>, f64)>)| {
        let called = if name.is_empty() { "the anchor".to_string() } else { format!("anchor `{name}`") };
        let count = seen.len();
        if count < FEWEST {
            return Err(format!("{called}: {count} distances to fit cannot place it, at least {FEWEST} are needed"));
        }
        // About the points' middle, so that nothing cancels.
        let middle = seen.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / count as f64;
        let lines = DMatrix::from_fn(count, 4, |i, j| if j < 3 { -2.0 * (seen[i].0 - middle)[j] } else { 1.0 });
        let right = DVector::from_fn(count, |i, _| seen[i].1.powi(2) - (seen[i].0 - middle).norm_squared());
        let solution = lines.svd(true, true).solve(&right, 1e-9).map_err(|_| format!("{called} cannot be placed"))?;
        Ok(Anchor { name: name.into(), place: middle + Vector3::new(solution[0], solution[1], solution[2]) })
    };
    by_name.into_iter().map(place).collect()
}
