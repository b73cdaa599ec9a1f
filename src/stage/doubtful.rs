//! Remarks on rows that a model is not to be believed at without a word: where its correction is uncertain.

use crate::compensate::{IdentifiedArm, Scatter, Uncertainty, doubts};
use crate::error::counted;
use crate::estimate::{Covariance, Model};
use crate::robot::Measurements;
use crate::table::{Prediction, PredictionRow};

/// A model, and where it was measured.
pub struct KnownModel<'a> {
    pub model: &'a Model,
    /// Covariance of all of its parameters; none where that is not known.
    pub covariance: Option<&'a Covariance>,
    /// The recording that it was identified by.
    pub measured: &'a Measurements,
}

impl KnownModel<'_> {
    /// A remark for each row of `data` among `rows` of which the correction is doubtful, none for all others.
    pub fn remarks(&self, data: &Measurements, rows: &[usize]) -> Vec<Option<String>> {
        let mut out = vec![None; data.rows()];
        let Some(covariance) = self.covariance else {
            return out;
        };
        let arm = IdentifiedArm::new(self.model.clone(), None);
        let uncertainty = Uncertainty::new(&arm, covariance.clone(), Scatter::default())
            .with_recording(&arm, self.measured);
        for (row, doubt) in rows.iter().zip(doubts(&arm, &uncertainty, data, rows)) {
            out[*row] = doubt.map(|doubt| doubt.to_string());
        }
        out
    }
}

/// How many held-out points have a remark, of how many, in a sentence; none where none has.
pub fn sentence(prediction: &Prediction) -> Option<String> {
    let held_out = || prediction.0.iter().filter(|row| row.held_out);
    let remarked: Vec<&PredictionRow> = held_out().filter(|row| row.remark.is_some()).collect();
    (!remarked.is_empty()).then(|| {
        format!(
            "{} of {}: the correction is uncertain by more than half of itself: {}",
            remarked.len(),
            counted(held_out().count(), "held-out point"),
            named(&remarked)
        )
    })
}

/// Points that are named of many.
const NAMED: usize = 3;

/// The first of some points, each once, with the remark of the first one.
pub fn named(rows: &[&PredictionRow]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.point_id.as_str()) {
            names.push(&row.point_id);
        }
    }
    let more = names.len().saturating_sub(NAMED);
    names.truncate(NAMED);
    let more = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    let first = rows
        .first()
        .and_then(|row| row.remark.as_deref())
        .unwrap_or_default();
    let of = if names.len() > 1 {
        format!("{}: ", names[0])
    } else {
        String::new()
    };
    format!("{}{more} ({of}{first})", names.join(", "))
}
