//! Torque of friction over velocity, joint by joint.

use super::{FrictionCurveRow, FrictionCurves};
use crate::dynamics::TorqueDiagnosis;

impl FrictionCurves {
    /// The curves that were found.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = diagnosis.friction.iter().flat_map(|curve| {
            let points = curve.velocity.iter().zip(&curve.torque).zip(&curve.sigma);
            points.map(|((velocity, torque), sigma)| FrictionCurveRow {
                joint: curve.joint as i64 + 1,
                velocity_rad_s: *velocity,
                torque_nm: *torque,
                sigma_nm: *sigma,
            })
        });
        let mut rows: Vec<FrictionCurveRow> = rows.collect();
        rows.sort_by(|a, b| {
            a.joint
                .cmp(&b.joint)
                .then(a.velocity_rad_s.total_cmp(&b.velocity_rad_s))
        });
        rows.dedup_by(|a, b| (a.joint, a.velocity_rad_s) == (b.joint, b.velocity_rad_s));
        Self(rows)
    }
}
