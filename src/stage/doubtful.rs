//! Remarks on rows that a model is not to be believed at without a word: where its correction is uncertain, and where a finding is used
//! beyond what was fitted.

use crate::compensate::{IdentifiedArm, Remark, Scatter, Uncertainty, doubts};
use crate::error::counted;
use crate::estimate::{Covariance, Model};
use crate::robot::{Measurements, Unmeasured, Visited};
use crate::stage::dependence::Dependence;
use crate::table::{Prediction, PredictionRow};

/// A model, and where it was measured.
pub struct KnownModel<'a> {
    pub model: &'a Model,
    /// Covariance of all of its parameters; none where that is not known.
    pub covariance: Option<&'a Covariance>,
    /// The recording that it was identified by.
    pub measured: &'a Measurements,
    /// What its rows visited; none where that is not known.
    pub visited: Option<&'a Visited>,
}

impl KnownModel<'_> {
    /// A remark for each row of `data` among `rows`, none for all others: of all that a finding depends on what was never visited, and how
    /// uncertain the correction is.
    pub fn remarks(&self, data: &Measurements, rows: &[usize]) -> Vec<Option<String>> {
        let depends = Dependence::of(self.model);
        let unvisited = |row: usize| {
            let beyond = self.visited.map(|visited| visited.beyond(data.q(row), data.payload[row], data.temperature(row)));
            let mut beyond = beyond.unwrap_or_default();
            beyond.retain_mut(|what| depends.has(what));
            beyond
        };
        let mut out = vec![None; data.rows()];
        for (row, doubts) in rows.iter().zip(self.doubts(data, rows)) {
            let said: Vec<String> =
                unvisited(*row).iter().map(Unmeasured::to_string).chain(doubts.iter().map(Remark::to_string)).collect();
            out[*row] = (!said.is_empty()).then(|| said.join("; "));
        }
        out
    }

    fn doubts(&self, data: &Measurements, rows: &[usize]) -> Vec<Vec<Remark>> {
        let Some(covariance) = self.covariance else { return vec![Vec::new(); rows.len()] };
        let arm = IdentifiedArm::new(self.model.clone(), None);
        let uncertainty = Uncertainty::new(&arm, covariance.clone(), Scatter::default()).beside(&arm, self.measured);
        doubts(&arm, &uncertainty, data, rows)
    }
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
