//! Too few rows to ask what was left out: the nominal robot in its place, and no findings.

use super::types::{Diagnosis, Question, VerdictKind};
use super::unasked::{on_its_base, unasked};
use crate::criteria::search::FEWEST;
use crate::estimate::fit_screened;

/// The nominal robot with its base where the rows to fit have it.
pub(crate) fn not_asked(question: &Question) -> Diagnosis {
    let (start, candidates) = on_its_base(question);
    let Question { data, fit, set, .. } = *question;
    let diagnosis = unasked(
        question,
        VerdictKind::NotAsked,
        fit_screened(&start, data, fit, &candidates, Some(set)),
    );
    let rows = question.fit.len();
    let too_few = format!(
        "what the simulation lacks: {rows} rows were fitted, at least {} are needed to separate it from geometry",
        *FEWEST
    );
    Diagnosis {
        after: diagnosis.before,
        not_observable: vec![too_few],
        ..diagnosis
    }
}
