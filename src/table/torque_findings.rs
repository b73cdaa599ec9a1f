//! What a diagnosis of torques found, its numbers, and what would explain the data as well: three tables linked by the finding's rank.

use super::findings::{beside_findings, ranked};
use super::{
    BodyConsistencies, BodyConsistencyRow, ContactRow, Contacts, FrictionCurveRow, FrictionCurves,
    InertialRow, Inertials, JointTorqueRow, JointTorques, TorqueChangeRow, TorqueChangeTable,
    TorqueFindingRow, TorqueFindings, TorqueNumberRow, TorqueNumbers, TorqueRivalRow, TorqueRivals,
    TorqueVerdict, TorqueVerdictRow,
};
use crate::diagnose::VerdictKind;
use crate::dynamics::{
    BodyConsistency, InertialBasis, TorqueChange, TorqueChanges, TorqueDiagnosis,
};
use crate::effect::Place;

beside_findings! { TorqueDiagnosis => TorqueNumbers::of of TorqueNumberRow, TorqueRivals::of of TorqueRivalRow }

impl TorqueFindings {
    /// A row for each finding.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = ranked(&diagnosis.findings).map(|(rank, finding)| TorqueFindingRow {
            rank,
            effect: finding.effect.clone().into(),
            place: finding.place.to_string(),
            follows: Some(finding.follows.into()),
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

impl TorqueVerdictRow {
    /// Whether files and robot do not belong together as they are read.
    pub fn is_wrong_setup(&self) -> bool {
        self.verdict == VerdictKind::WrongSetup.name()
    }
}

impl TorqueVerdict {
    /// The verdict of the stage `step`; `from_current` where motor currents were recorded.
    pub fn of(step: &str, diagnosis: &TorqueDiagnosis, from_current: bool) -> Self {
        let (inertials, base_parameters) = match diagnosis.basis {
            InertialBasis::Declared => ("declared", None),
            InertialBasis::Free(count) => ("free", Some(count as i64)),
        };
        Self(vec![TorqueVerdictRow {
            step: step.into(),
            verdict: diagnosis.verdict.name().into(),
            statement: diagnosis.statement.clone(),
            inertials: inertials.into(),
            base_parameters,
            signal: if from_current { "current" } else { "torque" }.into(),
            cutoff_hz: diagnosis.cutoff,
            rate_hz: diagnosis.rate,
            rows: diagnosis.courses.time.len() as i64,
            held_out: diagnosis.held_out,
            before_nrmse: diagnosis.before.nrmse_mean,
            after_nrmse: diagnosis.after.nrmse_mean,
        }])
    }
}

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

impl Inertials {
    /// The numbers of a diagnosis.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = diagnosis.inertials.iter().map(|found| InertialRow {
            link: found.link as i64 + 1,
            quantity: found.quantity.into(),
            value: found.value,
            unit: found.unit.into(),
            declared: found.declared,
            sigma: found.sigma,
        });
        Self(rows.collect())
    }
}

impl Contacts {
    /// A row for each event, in the order of time.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let rows = (1..)
            .zip(&diagnosis.events)
            .map(|(event, found)| ContactRow {
                event,
                start_s: found.start,
                end_s: found.end,
                joints: found
                    .joints
                    .iter()
                    .map(|joint| (joint + 1).to_string())
                    .collect::<Vec<_>>()
                    .join(", "),
                force_x_n: found.force[0],
                force_y_n: found.force[1],
                force_z_n: found.force[2],
                sigma_x_n: found.sigma[0],
                sigma_y_n: found.sigma[1],
                sigma_z_n: found.sigma[2],
                gain: found.gain,
            });
        Self(rows.collect())
    }
}

impl BodyConsistencies {
    /// The table of a diagnosis.
    pub fn of(diagnosis: &TorqueDiagnosis) -> Self {
        let enforced = diagnosis.enforced.as_ref();
        let row = |found: BodyConsistency| BodyConsistencyRow {
            link: found.link as i64 + 1,
            mass_kg: found.mass,
            spread_kg_m2: found.spread,
            sigma_kg_m2: found.sigma,
            consistent: found.is_consistent(),
            enforced: enforced.map(|enforced| enforced.links.contains(&found.link)),
            cost: enforced.map(|enforced| enforced.cost),
        };
        Self(diagnosis.model.consistency().into_iter().map(row).collect())
    }
}

impl TorqueChangeTable {
    /// The rows of a comparison of a recording with its reference; `previous` gives a number of the reference's model by name.
    pub fn extend(
        &mut self,
        [recording, reference]: [&str; 2],
        changes: &TorqueChanges,
        previous: impl Fn(&str) -> Option<f64>,
    ) {
        let rows = changes.changes.iter().map(|change| TorqueChangeRow {
            recording: recording.into(),
            reference: reference.into(),
            name: change.name.clone(),
            effect: change.effect.clone(),
            place: change.place.to_string(),
            unit: change.unit.into(),
            previous: previous(&change.name),
            change: change.change,
            sigma: change.sigma,
            p_value: change.p_value,
            probability: change.probability,
            rank: change.rank.map(|rank| rank as i64),
            rivals: rivals(change),
        });
        self.0.extend(rows);
        let key = |row: &TorqueChangeRow| (row.recording.clone(), row.name.clone());
        self.0.sort_by_key(key);
        self.0.dedup_by(|a, b| key(a) == key(b));
    }
}

fn rivals(change: &TorqueChange) -> Option<String> {
    let place = |(place, share): &(Place, f64)| format!("{place} ({:.0} %)", 100.0 * share);
    let places: Vec<String> = change.rivals.iter().map(place).collect();
    (!places.is_empty()).then(|| places.join(", "))
}
