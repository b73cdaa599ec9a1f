//! Remarks on rows that a model is not to be believed at without a word: where its correction is uncertain, and where a finding is used
//! beyond what was fitted.

use crate::compensate::{IdentifiedArm, Remark, Scatter, Uncertainty, doubts};
use crate::error::counted;
use crate::estimate::{Covariance, Model};
use crate::robot::Measurements;
use crate::table::{Prediction, PredictionRow};

/// A remark for each row of `data` among `rows`, none for all others, and none where the model's covariance is not known. What is usual is
/// seen at the rows of `measured`, by which the model was identified.
pub fn remarks(
    model: &Model,
    covariance: Option<&Covariance>,
    measured: &Measurements,
    data: &Measurements,
    rows: &[usize],
) -> Vec<Option<String>> {
    let mut out = vec![None; data.rows()];
    let Some(covariance) = covariance.filter(|_| !rows.is_empty()) else { return out };
    let arm = IdentifiedArm::new(model.clone(), None);
    let uncertainty = Uncertainty::new(&arm, covariance.clone(), Scatter::default()).beside(&arm, measured);
    for (row, remarks) in rows.iter().zip(doubts(&arm, &uncertainty, data, rows)) {
        let said: Vec<String> = remarks.iter().map(Remark::to_string).collect();
        out[*row] = (!said.is_empty()).then(|| said.join("; "));
    }
    out
}

/// How many held-out points have a remark, of how many, in a sentence; none where none has.
pub fn sentence(prediction: &Prediction) -> Option<String> {
    let held_out = || prediction.0.iter().filter(|row| row.held_out);
    let remarked: Vec<&PredictionRow> = held_out().filter(|row| row.remark.is_some()).collect();
    let have = if remarked.len() == 1 { "has" } else { "have" };
    (!remarked.is_empty()).then(|| {
        format!(
            "{} of {} {have} a remark, beyond what was fitted or uncertain by more than half of the correction: {}",
            remarked.len(),
            counted(held_out().count(), "held-out point"),
            named(&remarked)
        )
    })
}

/// Points that are named of many.
const NAMED: usize = 3;

/// The first of some points, with the remark of the first one.
pub fn named(rows: &[&PredictionRow]) -> String {
    let names: Vec<&str> = rows.iter().take(NAMED).map(|row| row.point_id.as_str()).collect();
    let more = rows.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let first = rows.first().and_then(|row| row.remark.as_deref()).unwrap_or_default();
    let of = if rows.len() > 1 { format!("{}: ", rows[0].point_id) } else { String::new() };
    format!("{}{more} ({of}{first})", names.join(", "))
}
