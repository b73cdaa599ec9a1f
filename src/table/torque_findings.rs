//! What a diagnosis of torques found, its numbers, and what would explain the data as well: three tables linked by the finding's rank.

use crate::dynamics::{TorqueDiagnosis, TorqueFinding};

crate::table::rows! { "torque_findings",
    /// Findings, strongest first; key `rank`.
    pub struct TorqueFindings of TorqueFindingRow {
        /// From 1.
        rank: i64,
        effect: String,
        place: String,
        /// One sentence for a person.
        statement: String,
        gain: f64,
        f_statistic: f64,
        p_value: f64,
        delta_bic: f64,
        heldout_gain_nm: Option<f64>,
        effect_rms_nm: f64,
        probability: f64,
        place_probability: f64,
        none_probability: f64,
    }
}

crate::table::rows! { "torque_numbers",
    /// Numbers of findings; key (`rank`, `name`).
    pub struct TorqueNumbers of TorqueNumberRow {
        rank: i64,
        name: String,
        value: f64,
        unit: String,
        /// One standard deviation.
        sigma: Option<f64>,
    }
}

crate::table::rows! { "torque_rivals",
    /// Explanations that these data cannot separate from a finding; key (`rank`, `effect`, `place`).
    pub struct TorqueRivals of TorqueRivalRow {
        rank: i64,
        effect: String,
        place: String,
        delta_bic: f64,
        probability: f64,
    }
}

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
