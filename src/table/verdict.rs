//! The verdict of a diagnosis, with errors before and after.
//!
//! What a diagnosis says in addition to its verdict.

use super::{Findings, Verdict, VerdictRow, VerdictSentenceRow, VerdictSentences};
use crate::diagnose::{Diagnosis, ErrorLengths, VerdictKind};
use crate::dynamics::TorqueDiagnosis;
use crate::observation::Dimension;
use crate::robot::NoiseBasis;

impl VerdictRow {
    /// Whether something is left that neither a finding nor noise explains.
    pub(crate) fn is_unexplained(&self) -> bool {
        self.verdict == VerdictKind::Unexplained.name()
    }

    /// Whether nothing is known of the noise: neither was it stated nor measured, nor is it what the joints scatter by.
    pub(crate) fn is_noise_assumed(&self) -> bool {
        self.is_noise_inferred() && self.repeatability_rad == 0.0
    }

    /// Whether the noise was neither stated nor measured.
    pub(crate) fn is_noise_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}

impl Verdict {
    /// What is wrong with the set-up, where a diagnosis says so: `findings` are its own.
    pub(crate) fn wrong_setup(&self, findings: &Findings) -> Option<String> {
        let wrong = self
            .0
            .iter()
            .any(|row| row.verdict == VerdictKind::WrongSetup.name());
        let first = findings
            .0
            .first()
            .map(|finding| finding.statement.as_str())
            .unwrap_or_default();
        wrong.then(|| {
            format!("the set-up is wrong: {first}")
                .trim_end_matches('.')
                .to_string()
        })
    }

    /// The verdict of the stage `step`.
    pub fn of(step: &str, diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let in_mm = |size: f64| lengths.then_some(size * 1e3);
        let in_rad = |size: f64| (!lengths).then_some(size);
        let mm = |errors: Option<ErrorLengths>, of: fn(ErrorLengths) -> f64| {
            errors.and_then(|errors| in_mm(of(errors)))
        };
        let rms_rad = |errors: Option<ErrorLengths>| errors.and_then(|errors| in_rad(errors.rms));
        Self(vec![VerdictRow {
            step: step.into(),
            verdict: diagnosis.verdict.name().into(),
            statement: Some(diagnosis.statement.clone()),
            noise_basis: Some(diagnosis.noise_basis.name().into()),
            noise_floor_mm: in_mm(diagnosis.noise_floor),
            held_out: diagnosis.held_out,
            before_mean_mm: mm(diagnosis.before, |e| e.mean),
            before_rms_mm: mm(diagnosis.before, |e| e.rms),
            before_max_mm: mm(diagnosis.before, |e| e.max),
            after_mean_mm: mm(diagnosis.after, |e| e.mean),
            after_rms_mm: mm(diagnosis.after, |e| e.rms),
            after_max_mm: mm(diagnosis.after, |e| e.max),
            leftover_rms_mm: in_mm(diagnosis.leftover_rms),
            noise_floor_rad: in_rad(diagnosis.noise_floor),
            before_rms_rad: rms_rad(diagnosis.before),
            after_rms_rad: rms_rad(diagnosis.after),
            leftover_rms_rad: in_rad(diagnosis.leftover_rms),
            chi_square: diagnosis.chi_square,
            p_before: diagnosis.gate_first,
            p_after: diagnosis.gate_last,
            repeatability_rad: diagnosis.repeatability.sigma,
            repeats: diagnosis.repeatability.repeats as i64,
            points: diagnosis.kept.len() as i64,
            signature: diagnosis.signature.clone(),
            clock: Some(if diagnosis.clock { "s" } else { "row" }.into()),
        }])
    }
}

/// What a sentence is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerdictTopic {
    /// What the data cannot show.
    NotObservable,
    /// What to measure next.
    NextMeasurement,
    /// What is odd about the recording.
    Remark,
}

impl VerdictTopic {
    /// As the table has it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::NotObservable => "not_observable",
            Self::NextMeasurement => "next_measurement",
            Self::Remark => "remark",
        }
    }
}

impl VerdictSentences {
    /// The sentences of the stage `step`, in their order.
    pub fn of(step: &str, topics: &[(VerdictTopic, &[String])]) -> Self {
        let row = |topic: VerdictTopic, number, sentence: &String| VerdictSentenceRow {
            step: step.into(),
            about: topic.name().into(),
            number,
            sentence: sentence.clone(),
        };
        let rows = topics.iter().flat_map(|(topic, all)| {
            (1..)
                .zip(*all)
                .map(|(number, said)| row(*topic, number, said))
        });
        Self(rows.collect())
    }

    /// What a diagnosis of positions says, of the stage `step`.
    pub(crate) fn of_positions(step: &str, diagnosis: &Diagnosis) -> Self {
        let next = (
            VerdictTopic::NextMeasurement,
            diagnosis.next_measurements.as_slice(),
        );
        Self::of(
            step,
            &[
                (VerdictTopic::NotObservable, &diagnosis.not_observable),
                next,
            ],
        )
    }

    /// The same of a diagnosis of torques.
    pub(crate) fn of_torques(step: &str, diagnosis: &TorqueDiagnosis) -> Self {
        let remarks = (VerdictTopic::Remark, diagnosis.remarks.as_slice());
        Self::of(
            step,
            &[
                (VerdictTopic::NotObservable, &diagnosis.not_observable),
                remarks,
            ],
        )
    }

    /// What the stage `step` says of a topic, in its order.
    pub fn about(&self, step: &str, topic: VerdictTopic) -> Vec<&str> {
        let own = self
            .0
            .iter()
            .filter(|row| row.step == step && row.about == topic.name());
        own.map(|row| row.sentence.as_str()).collect()
    }
}
