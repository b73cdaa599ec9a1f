//! Joints that turn the other way than the robot file says: no small error, hence looked for before anything is fitted.

use crate::effect::EffectStack;
use crate::estimate::{Model, align};
use crate::robot::{Measurements, RobotModel};
use nalgebra::Vector3;

/// The error of a reduction ratio whose joint turns the other way.
pub(crate) const REVERSED: f64 = -2.0;
/// A nominal robot leaves less than this share of the size of the measured cloud.
const NOMINAL: f64 = 0.02;
/// With the right sense so many times less is left.
const BETTER: f64 = 3.0;

/// Joints whose reversal brings the nominal robot's points onto the measured ones, ascending; usually none.
pub(super) fn reversed(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Vec<usize> {
    let mut data = data.clone();
    let mut out = Vec::new();
    let mut now = left(robot, &data, rows);
    while now > NOMINAL {
        let joints = (0..robot.joints()).filter(|joint| robot.is_revolute(*joint) && !out.contains(joint));
        let tried = joints.map(|joint| {
            reverse(&mut data, joint);
            let left = left(robot, &data, rows);
            reverse(&mut data, joint);
            (left, joint)
        });
        let Some((left, joint)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|best| BETTER * best.0 < now) else { break };
        reverse(&mut data, joint);
        out.push(joint);
        now = left;
    }
    // Several at once that do not end at a nominal robot are no reversals.
    if now > NOMINAL {
        out.clear();
    }
    out.sort_unstable();
    out
}

/// Reverses a joint in every row.
pub(super) fn reverse(data: &mut Measurements, joint: usize) {
    let joints = data.joints;
    data.q.iter_mut().skip(joint).step_by(joints).for_each(|q| *q = -*q);
}

/// Median distance of the aligned nominal robot's points from the measured ones, as a share of the cloud's size.
fn left(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> f64 {
    let rows: Vec<usize> = rows.iter().copied().filter(|row| data.whole(*row)).collect();
    let base = align(robot, data, &rows);
    let predicted = Model::nominal(robot.clone(), EffectStack::new(robot, base, Vec::new())).predict(data);
    let mut off: Vec<f64> = rows.iter().map(|row| (data.position[*row] - predicted[*row]).norm()).collect();
    if off.is_empty() {
        return 0.0;
    }
    let centre = rows.iter().map(|row| data.position[*row]).sum::<Vector3<f64>>() / rows.len() as f64;
    let size = rows.iter().map(|row| (data.position[*row] - centre).norm_squared()).sum::<f64>() / rows.len() as f64;
    let middle = off.len() / 2;
    *off.select_nth_unstable_by(middle, f64::total_cmp).1 / size.sqrt().max(f64::MIN_POSITIVE)
}
