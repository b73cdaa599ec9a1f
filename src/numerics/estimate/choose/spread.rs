//! Poses spread evenly over the joint limits, the same at every call: a low-discrepancy sequence (Roberts' R sequence: fractional parts
//! of multiples of the powers of the generalised golden ratio).

use crate::robot::{Measurements, PointReadings, RobotModel};
use nalgebra::Vector3;

/// `rows` poses within the limits, rad or m, with the declared payload; a joint without limits keeps within 1 of its zero.
pub fn spread(robot: &RobotModel, rows: usize) -> Measurements {
    let n = robot.joints();
    let golden = (0..60).fold(1.5f64, |x, _| (1.0 + x).powf(1.0 / (n as f64 + 1.0)));
    let limits = |j: usize| robot.description().joints[j].limits.unwrap_or([-1.0, 1.0]);
    let q = (0..rows)
        .flat_map(|row| (0..n).map(move |j| (row, j)))
        .map(|(row, j)| {
            let share = (0.5 + (row as f64 + 1.0) * golden.powi(-(j as i32) - 1)).fract();
            let [lower, upper] = limits(j);
            lower + share * (upper - lower)
        });
    Measurements {
        joints: n,
        q: q.collect(),
        points: PointReadings::new(vec![Vector3::zeros(); rows], 0.0),
        payload: vec![robot.description().payload_mass; rows],
        ..Measurements::default()
    }
}
