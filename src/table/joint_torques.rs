//! Noise and errors of the torque of each joint.

use super::{JointTorqueRow, JointTorques};
use crate::dynamics::TorqueDiagnosis;

impl JointTorques {
    /// A row for each joint.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let (before, after) = (&diagnosis.before, &diagnosis.after);
        let rows = diagnosis
            .noise
            .iter()
            .zip(&diagnosis.leftover)
            .enumerate()
            .map(|(joint, (noise, leftover))| JointTorqueRow {
                joint: joint as i64 + 1,
                noise_nm: noise.sigma,
                autocorrelation: noise.autocorrelation,
                before_rms_nm: before.rms[joint],
                after_rms_nm: after.rms[joint],
                before_nrmse: before.nrmse[joint],
                after_nrmse: after.nrmse[joint],
                before_moving_rms_nm: before.rms_moving[joint],
                after_moving_rms_nm: after.rms_moving[joint],
                before_rest_rms_nm: before.rms_rest[joint],
                after_rest_rms_nm: after.rms_rest[joint],
                leftover_rms_nm: leftover.rms,
                leftover_over_noise: leftover.over_noise,
                signature: leftover.signature.clone(),
            });
        Self(rows.collect())
    }
}
