//! A recording beside another simulation: the mismatch is measured minus simulated, whatever the simulation knows.

use crate::estimate::{align, align_points};
use crate::robot::{Measurements, RobotModel};
use nalgebra::Vector3;

/// Puts the robot file's arm in place of the simulation. `simulated` is the measured point of every row in a frame fixed to the base, m,
/// NaN where there is none: such rows say nothing. The frames are found from `rows`. `None` where fewer than three of them are simulated.
pub fn against_simulation(
    robot: &RobotModel,
    data: &Measurements,
    simulated: &[[f64; 3]],
    rows: &[usize],
) -> Option<Measurements> {
    let there = |row: &usize| {
        simulated
            .get(*row)
            .is_some_and(|point| point.iter().all(|axis| axis.is_finite()))
    };
    let used: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| there(row) && data.has_point(*row))
        .collect();
    if used.len() < 3 {
        return None;
    }
    let point = |row: usize| Vector3::from(simulated[row]);
    let model: Vec<Vector3<f64>> = used.iter().map(|row| point(*row)).collect();
    let measured: Vec<Vector3<f64>> = used.iter().filter_map(|row| data.point(*row)).collect();
    // Both frames are nearly right, and what they lack is a motion of the base, which is fitted.
    let (base, frame) = (align(robot, data, &used), align_points(&model, &measured));
    let mut out = data.clone();
    // What was measured beside points was not simulated.
    out.readings.clear();
    for row in 0..data.rows() {
        if there(&row) {
            let rigid = (robot.last_body(data.q(row)) * *robot.mounting_at(data, row)).translation;
            out.points
                .shift(row, base.point(&rigid) - frame.point(&point(row)));
        } else {
            out.points.forget(row);
        }
    }
    Some(out)
}
