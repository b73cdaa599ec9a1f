//! Base parameters: inertial numbers that torques can determine, by QR with column pivoting of the stacked regressor (Gautier, 1991).

use super::newton_euler::INERTIAL_NUMBERS;
use super::regressor::ReducedRegressor;

/// A column of which less than this share is new is a combination of others.
const DEPENDENT: f64 = 1e-7;
/// A column smaller than this share of the largest acts on no joint.
const IDLE: f64 = 1e-9;

/// Numbers (10 link + number, ascending) whose columns are independent over the rows of a recording.
pub(super) fn base_parameters(regressor: &ReducedRegressor) -> Vec<usize> {
    let n = regressor.joints();
    let rows = regressor.course(n - 1, INERTIAL_NUMBERS * n - 1).len();
    let stacked = |number: usize| {
        let mut column = Vec::with_capacity(n * rows);
        for joint in 0..n {
            let course = regressor.course(joint, number);
            if course.is_empty() { column.resize(column.len() + rows, 0.0) } else { column.extend_from_slice(course) }
        }
        column
    };
    let mut columns: Vec<(usize, Vec<f64>)> = (0..INERTIAL_NUMBERS * n).map(|number| (number, stacked(number))).collect();
    let size = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt();
    let largest = columns.iter().map(|(_, column)| size(column)).fold(0.0, f64::max);
    columns.retain(|(_, column)| size(column) > IDLE * largest);
    for (_, column) in &mut columns {
        let scale = size(column);
        column.iter_mut().for_each(|value| *value /= scale);
    }
    let mut kept = Vec::new();
    // Modified Gram-Schmidt, largest remainder first: the diagonal of R falls as in Householder's.
    while let Some(next) = (0..columns.len()).max_by(|a, b| size(&columns[*a].1).total_cmp(&size(&columns[*b].1))) {
        let (number, mut direction) = columns.swap_remove(next);
        let left = size(&direction);
        if left <= DEPENDENT {
            break;
        }
        direction.iter_mut().for_each(|value| *value /= left);
        for (_, column) in &mut columns {
            let share: f64 = column.iter().zip(&direction).map(|(a, b)| a * b).sum();
            column.iter_mut().zip(&direction).for_each(|(value, along)| *value -= share * along);
        }
        kept.push(number);
    }
    kept.sort_unstable();
    kept
}
