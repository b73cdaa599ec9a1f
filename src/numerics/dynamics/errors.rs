//! Differences of measured and predicted torque, moving and resting rows apart.

use super::problem::TorqueProblem;
use super::types::TorqueErrors;

/// Times the width of a sign below which a joint rests.
const REST: f64 = 2.0;

/// Whether a joint rests in a judged row.
pub(super) fn rests(problem: &TorqueProblem, joint: usize, row: usize) -> bool {
    problem.scene.velocity[joint][problem.reduction.rows[row]].abs()
        < REST * problem.scene.width_at(joint)
}

/// Errors by a residual (`[joint][judged row]`, Nm) in some rows.
pub(super) fn errors(
    problem: &TorqueProblem,
    residual: &[Vec<f64>],
    rows: &[usize],
) -> TorqueErrors {
    let n = problem.joints();
    let rms = |joint: usize, counts: &dyn Fn(usize) -> bool| {
        let squares: Vec<f64> = rows
            .iter()
            .filter(|row| counts(**row))
            .map(|row| residual[joint][*row].powi(2))
            .collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let all: Vec<f64> = (0..n)
        .map(|joint| rms(joint, &|_| true).unwrap_or(0.0))
        .collect();
    let nrmse: Vec<f64> = (0..n)
        .map(|joint| all[joint] / spread(problem, joint, rows))
        .collect();
    TorqueErrors {
        nrmse_mean: nrmse.iter().sum::<f64>() / n as f64,
        nrmse,
        rms: all,
        rms_moving: (0..n)
            .map(|joint| rms(joint, &|row| !rests(problem, joint, row)))
            .collect(),
        rms_rest: (0..n)
            .map(|joint| rms(joint, &|row| rests(problem, joint, row)))
            .collect(),
    }
}

/// Rms (Nm) of measured torque about its mean.
fn spread(problem: &TorqueProblem, joint: usize, rows: &[usize]) -> f64 {
    let torque = problem.torque_at(joint, problem.latency);
    let count = rows.len().max(1) as f64;
    let mean = rows.iter().map(|row| torque[*row]).sum::<f64>() / count;
    (rows
        .iter()
        .map(|row| (torque[*row] - mean).powi(2))
        .sum::<f64>()
        / count)
        .sqrt()
        .max(f64::MIN_POSITIVE)
}
