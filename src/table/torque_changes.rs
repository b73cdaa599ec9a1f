//! What changed between two recordings of an arm's torques.

use super::{TorqueChangeRow, TorqueChangeTable};
use crate::dynamics::TorqueChanges;

impl TorqueChangeTable {
    /// The table of a comparison; `previous` gives a number of the earlier model by name.
    pub fn of(changes: &TorqueChanges, previous: impl Fn(&str) -> Option<f64>) -> Self {
        let rows = changes.changes.iter().map(|change| TorqueChangeRow {
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
        });
        let mut rows: Vec<TorqueChangeRow> = rows.collect();
        rows.sort_by(|a, b| a.name.cmp(&b.name));
        rows.dedup_by(|a, b| a.name == b.name);
        Self(rows)
    }
}
