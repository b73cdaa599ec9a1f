//! The verdict of a diagnosis of commands and responses, with errors before and after.

use super::findings::{beside_findings, ranked};
use super::{
    DriveVerdict, DriveVerdictRow, FindingNumberRow, FindingNumbers, FindingRow, Findings,
    JointDriveRow, JointDrives, RivalRow, Rivals,
};
use crate::diagnose::VerdictKind;
use crate::drives::DriveDiagnosis;

beside_findings! { DriveDiagnosis => FindingNumbers::of_drives of FindingNumberRow, Rivals::of_drives of RivalRow }

impl Findings {
    /// A row for each finding of drives.
    pub fn of_drives(diagnosis: &DriveDiagnosis) -> Self {
        let rows = ranked(&diagnosis.findings).map(|(rank, finding)| FindingRow {
            rank,
            effect: finding.effect.into(),
            place: finding.place.clone(),
            statement: finding.statement.clone(),
            delta_bic: Some(finding.delta_bic),
            effect_rms_rad: Some(finding.effect_rms),
            probability: Some(finding.probability),
            place_probability: Some(finding.place_probability),
            none_probability: Some(finding.none_probability),
            forms: "[]".into(),
            ..FindingRow::default()
        });
        Self(rows.collect())
    }
}

impl DriveVerdict {
    /// The verdict of the stage `step`.
    pub fn of(step: &str, diagnosis: &DriveDiagnosis) -> Self {
        let kind = match (diagnosis.explained, diagnosis.findings.is_empty()) {
            (true, true) => VerdictKind::NothingMissing,
            (true, false) => VerdictKind::Explained,
            (false, _) => VerdictKind::Unexplained,
        };
        let error = &diagnosis.overall;
        let mrad = |rad: f64| 1e3 * rad;
        let statement = format!(
            "Simulated angles differ from measured ones by {:.3} mrad rms, with the findings by {:.3} mrad; the noise is {:.3} mrad.",
            mrad(error.held_out[0]),
            mrad(error.held_out[1]),
            mrad(error.noise)
        );
        Self(vec![DriveVerdictRow {
            step: step.into(),
            verdict: kind.name().into(),
            statement,
            rows: diagnosis.rows as i64,
            held_out: diagnosis.held_out,
            noise_rad: error.noise,
            before_rms_rad: error.held_out[0],
            after_rms_rad: error.held_out[1],
            before_fitted_rms_rad: error.fitted[0],
            after_fitted_rms_rad: error.fitted[1],
        }])
    }
}

impl JointDrives {
    /// A row for each joint.
    pub fn of(diagnosis: &DriveDiagnosis) -> Self {
        let rows = (1..).zip(&diagnosis.joints);
        let rows = rows.map(|(joint, error)| JointDriveRow {
            joint,
            noise_rad: error.noise,
            before_rms_rad: error.held_out[0],
            after_rms_rad: error.held_out[1],
            leftover_over_noise: error.over_noise,
        });
        Self(rows.collect())
    }
}
