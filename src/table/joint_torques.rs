//! Noise and errors of the torque of each joint.

use crate::dynamics::TorqueDiagnosis;

crate::table::rows! { "joint_torques",
    /// Joints, one a row; key `joint`. Errors are of held-out rows where there are any.
    pub struct JointTorques of JointTorqueRow {
        /// From 1.
        joint: i64,
        noise_nm: f64,
        autocorrelation: f64,
        before_rms_nm: f64,
        after_rms_nm: f64,
        before_nrmse: f64,
        after_nrmse: f64,
        before_moving_rms_nm: Option<f64>,
        after_moving_rms_nm: Option<f64>,
        before_rest_rms_nm: Option<f64>,
        after_rest_rms_nm: Option<f64>,
        leftover_rms_nm: f64,
        leftover_over_noise: f64,
        signature: Option<String>,
    }
}

impl JointTorques {
    /// A row for each joint.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let (before, after) = (&diagnosis.before, &diagnosis.after);
        let rows = diagnosis.noise.iter().zip(&diagnosis.leftover).enumerate().map(|(joint, (noise, leftover))| JointTorqueRow {
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
