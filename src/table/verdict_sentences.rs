//! What a diagnosis says beside its verdict.

use super::{VerdictSentenceRow, VerdictSentences};
use crate::diagnose::Diagnosis;
use crate::dynamics::TorqueDiagnosis;

/// What a sentence is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerdictTopic {
    /// What the data cannot show.
    NotObservable,
    /// What to measure next.
    NextMeasurement,
    /// A finding on torques that the fit of the whole model left without size.
    Withdrawn,
    /// What is odd about the recording.
    Remark,
}

impl VerdictTopic {
    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotObservable => "not_observable",
            Self::NextMeasurement => "next_measurement",
            Self::Withdrawn => "withdrawn",
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
    pub fn of_positions(step: &str, diagnosis: &Diagnosis) -> Self {
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
    pub fn of_torques(step: &str, diagnosis: &TorqueDiagnosis) -> Self {
        let withdrawn = (VerdictTopic::Withdrawn, diagnosis.withdrawn.as_slice());
        let remarks = (VerdictTopic::Remark, diagnosis.remarks.as_slice());
        Self::of(
            step,
            &[
                (VerdictTopic::NotObservable, &diagnosis.not_observable),
                withdrawn,
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
