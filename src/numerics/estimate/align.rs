//! The base pose that puts the nominal robot on the measured points: Kabsch's solution, with far points trimmed.
//!
//! It starts from the three points that leave the smallest median error, so that nearly half of the points may be wrong.

use crate::observation::KINDS;
use crate::robot::{Measurements, RobotModel};
use crate::spatial::Pose;
use crate::statistics::nearest;
use nalgebra::{Matrix3, Vector3};

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
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Pose::identity();
    };
    let mut sign = Matrix3::identity();
    // Without this a mirrored solution could win.
    sign[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = u * sign * v_t;
    Pose::new(rotation, b - rotation * a)
}
