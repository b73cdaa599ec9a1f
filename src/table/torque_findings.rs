//! What a diagnosis of torques found, its numbers, and what would explain the data as well: three tables linked by the finding's rank.

use super::{TorqueFindingRow, TorqueFindings, TorqueNumberRow, TorqueNumbers, TorqueRivalRow, TorqueRivals};
use crate::dynamics::{TorqueDiagnosis, TorqueFinding};

fn ranked(diagnosis: &TorqueDiagnosis) -> impl Iterator<Item = (i64, &TorqueFinding)> {
    (1..).zip(&diagnosis.findings)
}

impl TorqueFindings {
    /// A row for each finding.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = ranked(diagnosis).map(|(rank, finding)| TorqueFindingRow {
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

impl TorqueNumbers {
    /// A row for each number of each finding.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = ranked(diagnosis).flat_map(|(rank, finding)| {
            finding.parameters.iter().map(move |number| TorqueNumberRow {
                rank,
                name: number.name.clone(),
                value: number.value,
                unit: number.unit.into(),
                sigma: number.sigma.filter(|sigma| sigma.is_finite()),
            })
        });
        let mut rows: Vec<TorqueNumberRow> = rows.collect();
        rows.sort_by(|a, b| (a.rank, &a.name).cmp(&(b.rank, &b.name)));
        Self(rows)
    }
}

impl TorqueRivals {
    /// A row for each rival of each finding.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = ranked(diagnosis).flat_map(|(rank, finding)| {
            finding.rivals.iter().map(move |rival| TorqueRivalRow {
                rank,
                effect: rival.effect.into(),
                place: rival.place.to_string(),
                delta_bic: rival.delta_bic,
                probability: rival.probability,
            })
        });
        let mut rows: Vec<TorqueRivalRow> = rows.collect();
        rows.sort_by(|a, b| (a.rank, &a.effect, &a.place).cmp(&(b.rank, &b.effect, &b.place)));
        Self(rows)
    }
}
