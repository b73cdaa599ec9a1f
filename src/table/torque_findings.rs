//! What a diagnosis of torques found, its numbers, and what would explain the data as well: three tables linked by the finding's rank.

use super::findings::{beside_findings, ranked};
use super::{
    TorqueFindingRow, TorqueFindings, TorqueNumberRow, TorqueNumbers, TorqueRivalRow, TorqueRivals,
};
use crate::dynamics::TorqueDiagnosis;

beside_findings! { TorqueDiagnosis => TorqueNumbers of TorqueNumberRow, TorqueRivals of TorqueRivalRow }

impl TorqueFindings {
    /// A row for each finding.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = ranked(&diagnosis.findings).map(|(rank, finding)| TorqueFindingRow {
            rank,
            effect: finding.effect.into(),
            place: finding.place.to_string(),
            statement: finding.statement.clone(),
            gain: finding.evidence.gain,
            f_statistic: finding.evidence.f_statistic,
            p_value: finding.evidence.p_value,
            delta_bic: finding.evidence.delta_bic,
            heldout_gain_nm: finding.evidence.heldout_gain,
            effect_rms_nm: finding.evidence.effect_rms,
            probability: finding.probabilities.name,
            place_probability: finding.probabilities.place,
            none_probability: finding.probabilities.none,
        });
        Self(rows.collect())
    }
}
