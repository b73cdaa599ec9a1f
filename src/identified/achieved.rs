//! What compensation achieved: points that were measured at corrected targets, beside what the model had said.

use crate::compensate::{Corrector, IdentifiedArm};
use crate::error::{Error, Result};
use crate::robot::RobotModel;
use crate::spatial::Pose;
use crate::targets::MeasuredTarget;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Cycles of a pose from which ISO 9283 speaks of accuracy and repeatability.
const CYCLES: usize = 30;
/// Points that a base is found from at least.
const FEWEST: usize = 4;

/// Lengths of each target, m.
#[derive(Debug, Default)]
pub struct Achieved {
    /// How far the uncorrected commands would be off by the model.
    pub(crate) before: Vec<f64>,
    /// Within which the corrected ones were predicted to be with 95 %; empty where the model has no covariance.
    pub(crate) predicted: Vec<f64>,
    /// How far the measured points are from the wanted ones.
    pub(crate) achieved: Vec<f64>,
    /// Poses that were repeated often enough.
    pub(crate) poses: Vec<RepeatedPose>,
    /// Targets that the model could not reach, which were not corrected.
    pub(crate) unreached: usize,
}

/// A pose of 30 cycles or more, ISO 9283.
#[derive(Debug)]
pub struct RepeatedPose {
    /// How often.
    pub(crate) cycles: usize,
    /// Distance of the mean of the attained points from the wanted one (AP), m.
    pub(crate) accuracy: f64,
    /// Mean distance from that mean plus three standard deviations (RP), m.
    pub(crate) repeatability: f64,
}

/// Compares; `new_base` finds the tracker's place anew from these points. Fails where they are too few for that.
pub fn achieved(
    arm: &IdentifiedArm,
    nominal: &RobotModel,
    corrector: &mut Corrector,
    rows: &[MeasuredTarget],
    new_base: bool,
) -> Result<Achieved> {
    let convention = corrector.convention().clone();
    let wanted = |row: &MeasuredTarget| {
        let mut q = row.target.q.clone().unwrap_or_default();
        convention.to_robot(&mut q);
        nominal.forward(&q).translation
    };
    let wanted: Vec<Vector3<f64>> = rows.iter().map(wanted).collect();
    let points: Vec<Vector3<f64>> = rows.iter().map(|row| row.point).collect();
    let base = if new_base {
        placed(&wanted, &points)?
    } else {
        *arm.base()
    };
    let off: Vec<Vector3<f64>> = wanted
        .iter()
        .zip(&points)
        .map(|(wanted, point)| point - base.point(wanted))
        .collect();
    let mut found = Achieved {
        achieved: off.iter().map(Vector3::norm).collect(),
        ..Achieved::default()
    };
    for answer in corrector.batch(rows.iter().map(|row| row.target.clone()).collect()) {
        found.before.push(answer.uncorrected);
        found
            .predicted
            .extend(answer.uncertainty.map(|known| answer.residual + known.u95));
        found.unreached += usize::from(answer.q.is_none());
    }
    let mut repeated: BTreeMap<Vec<i64>, Vec<Vector3<f64>>> = BTreeMap::new();
    for (row, off) in rows.iter().zip(&off) {
        // Commands are the same where they agree to a nanoradian.
        let key = row
            .target
            .q
            .iter()
            .flatten()
            .map(|q| (q * 1e9).round() as i64)
            .collect();
        repeated.entry(key).or_default().push(*off);
    }
    found.poses = repeated
        .into_values()
        .filter(|cycles| cycles.len() >= CYCLES)
        .map(|cycles| repeated_pose(&cycles))
        .collect();
    Ok(found)
}

/// Deviations from the wanted point of one pose.
fn repeated_pose(off: &[Vector3<f64>]) -> RepeatedPose {
    let count = off.len() as f64;
    let mean = off.iter().sum::<Vector3<f64>>() / count;
    let from: Vec<f64> = off.iter().map(|one| (one - mean).norm()).collect();
    let average = from.iter().sum::<f64>() / count;
    let deviation =
        (from.iter().map(|one| (one - average).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    RepeatedPose {
        cycles: off.len(),
        accuracy: mean.norm(),
        repeatability: average + 3.0 * deviation,
    }
}

/// The rigid motion that brings points of the base onto measured ones, least squares (Kabsch).
fn placed(base: &[Vector3<f64>], measured: &[Vector3<f64>]) -> Result<Pose> {
    if base.len() < FEWEST {
        return Err(Error::spec(
            "--new-base",
            format!("needs {FEWEST} points or more, found {}", base.len()),
        ));
    }
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (from, to) = (mean(base), mean(measured));
    let spread: Matrix3<f64> = base
        .iter()
        .zip(measured)
        .map(|(a, b)| (b - to) * (a - from).transpose())
        .sum();
    let svd = spread.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return Err(Error::Bug("a 3 x 3 SVD without vectors".into()));
    };
    let mirror = (u * v).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, mirror)) * v;
    Ok(Pose::new(rotation, to - rotation * from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_base_is_found_again_and_repeats_have_the_figures_of_the_standard() {
        let base: Vec<Vector3<f64>> = (0..6)
            .map(|k| Vector3::new(f64::from(k), f64::from(k * k) * 0.3, f64::from(7 - k).sin()))
            .collect();
        let truth =
            Pose::from_rotation_vector(Vector3::new(0.2, -0.4, 0.7), Vector3::new(1.0, -2.0, 0.5));
        let seen: Vec<Vector3<f64>> = base.iter().map(|point| truth.point(point)).collect();
        let found = placed(&base, &seen).expect("a base");
        assert!(
            (found.translation - truth.translation).norm() < 1e-12
                && (found.rotation - truth.rotation).norm() < 1e-12
        );
        // Two places 2 mm apart, by turns, about a mean that is 3 mm off: every cycle is 1 mm from the mean.
        let off: Vec<Vector3<f64>> = (0..30)
            .map(|k| Vector3::new(0.003, if k % 2 == 0 { 0.001 } else { -0.001 }, 0.0))
            .collect();
        let pose = repeated_pose(&off);
        assert!(
            (pose.accuracy - 0.003).abs() < 1e-12
                && (pose.repeatability - 0.001).abs() < 1e-12
                && pose.cycles == 30
        );
    }
}
